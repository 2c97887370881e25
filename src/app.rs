//! The window: drive an estimator as in a debugger and see why it decides what it decides.
//!
//! ```text
//! keys, buttons, views → command::Queue → App → AppState → ViewContext → views
//! ```
//!
//! A view keeps no copy of the run. It is handed a [`ViewContext`], the run at the cursor, and
//! sends what is to be done after the frame; so looking back costs no second run, and whatever a person
//! can do, a test can do.

mod action;
mod adapter;
mod camera;
mod changes;
mod command;
mod dispatch;
mod frame;
mod headless;
mod lecture;
mod lesson;
mod memo;
mod navigation;
mod opening;
mod queries;
mod run_pictures;
mod save;
mod saved;
mod scoring;
mod selection;
mod setup;
mod shot;
mod shown;
mod state;
mod text_field;
mod textures;
mod theme;
mod view_context;
mod view_name;
mod view_options;
pub mod views;
mod window;
mod worker;

pub use action::{ACTIONS, Action, Group};
pub use camera::NamedPose;
pub use opening::{Opener, Opening};
pub use save::SaveTarget;
pub use scoring::{CostAlong, CostLine, DenseAsk, DenseMap, Probe, Scoring};
pub use selection::{KnownResults, ResultRow, Results};
pub use setup::Setup;
pub use shot::{Shot, ShotError, ShotTime, shoot};
pub use shown::{ShownReason, ShownView};
pub use state::{AppState, Note};
pub(crate) use view_context::Sends;
pub use view_context::ViewContext;
pub use view_name::ViewName;
pub use view_options::{Arrangement, CompareMode, SidePanel, Tab, ViewOptions};
pub use window::{WindowError, has_display, open, open_lesson};

use egui::{Margin, Panel};
use frame::help::ActionSearch;
use frame::{Panes, Sizes};
use lesson::OpenLesson;

use crate::lesson::Lesson;

/// The application.
pub struct App {
    state: AppState,
    panes: Panes,
    commands: command::Queue,
    /// Whether the list of keys is open.
    help: bool,
    /// The search for an action, while it is open.
    search: Option<ActionSearch>,
    pictures: save::Pictures,
    /// Where something is to be saved, while that is asked.
    asking: Option<save::Asking>,
    /// The lesson that is open.
    lesson: Option<OpenLesson>,
    /// Opens other scenes, runs and lessons.
    opener: Option<Opener>,
    /// What the window's frame says.
    title: String,
    /// Where the canvas is \[points\].
    canvas: egui::Rect,
}

impl App {
    /// The window's content for a setup. It starts to run at once, in the mode of the setup.
    pub fn new(creation: &eframe::CreationContext<'_>, setup: Setup) -> Self {
        Self::of(&creation.egui_ctx, setup)
    }

    fn of(ctx: &egui::Context, setup: Setup) -> Self {
        theme::install(ctx);
        Self {
            state: AppState::new(setup, ctx.clone()),
            panes: Panes::new(),
            commands: command::Queue::default(),
            help: false,
            search: None,
            pictures: save::Pictures::default(),
            asking: None,
            lesson: None,
            opener: None,
            title: String::new(),
            canvas: egui::Rect::NOTHING,
        }
    }

    /// With results of the setup's queries that are known already.
    pub fn with_results(mut self, results: impl Into<KnownResults>) -> Self {
        self.state.set_known_results(results.into());
        self
    }

    /// With a lesson at its first page, of which the setup is what is localised there.
    pub fn with_lesson(mut self, lesson: Lesson) -> Self {
        self.lesson = Some(OpenLesson::new(lesson, &self.state.setup));
        self.arrange(Arrangement::Lecture);
        self
    }

    /// The state that the window is drawn from: the run, the cursor, the camera.
    pub fn app_state(&self) -> &AppState {
        &self.state
    }

    /// Where the canvas is \[points\].
    pub fn canvas(&self) -> egui::Rect {
        self.canvas
    }

    /// The same to be changed, as keys, buttons and views do.
    pub fn app_state_mut(&mut self) -> &mut AppState {
        &mut self.state
    }
}

impl App {
    /// Takes in what other threads have done, and does what was asked for.
    fn update(&mut self, ctx: &egui::Context) {
        self.state.poll();
        for written in self.pictures.take() {
            let is_error = written.is_err();
            self.state.note(written.unwrap_or_else(|why| why), is_error);
        }
        for opened in self.state.opener.poll() {
            self.take_opened(opened);
        }
        self.obey();
        let title = self.state.setup.title();
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    /// Draws the window.
    fn content(&mut self, ui: &mut egui::Ui) {
        self.read_keys(ui.ctx());
        self.take_dropped(ui.ctx());
        self.frame(ui);
        self.above(ui.ctx());
        self.state.textures.end_frame();
        let pointed_at = self.state.pointed_at.take();
        if pointed_at != self.state.hovered {
            self.state.hovered = pointed_at;
            ui.ctx().request_repaint();
        }
        self.obey();
    }

    /// Does what was asked for.
    fn obey(&mut self) {
        for command in self.commands.take() {
            command(self);
        }
    }

    fn read_keys(&mut self, ctx: &egui::Context) {
        // A question has the keys to itself.
        if self.asking.is_some() || self.search.is_some() {
            return;
        }
        let close = |input: &mut egui::InputState| {
            input.consume_key(egui::Modifiers::NONE, egui::Key::Escape)
        };
        if self.help && ctx.input_mut(close) {
            self.help = false;
        }
        if let Some(lesson) = &self.lesson {
            lesson.read_keys(ctx, &self.commands);
        }
        let in_batch = self.state.options.layout == Arrangement::Batch;
        let enter = |input: &mut egui::InputState| {
            input.consume_key(egui::Modifiers::NONE, egui::Key::Enter)
        };
        if in_batch && !ctx.egui_wants_keyboard_input() {
            if ctx.input_mut(enter) {
                self.open_selected();
            }
            let pressed = |key: egui::Key| {
                ctx.input_mut(|input| input.consume_key(egui::Modifiers::NONE, key))
            };
            for (key, is_back) in [(egui::Key::ArrowDown, false), (egui::Key::ArrowUp, true)] {
                if pressed(key) {
                    self.state.next_row(is_back);
                }
            }
        }
        action::read_keys(ctx, &self.commands);
    }

    /// The parts of the window at their places.
    fn frame(&mut self, ui: &mut egui::Ui) {
        let Self { state, panes, commands, lesson, .. } = self;
        let sizes = Sizes::of(ui.ctx().content_rect().size());
        let fill = ui.visuals().panel_fill;
        let plain = |margin: Margin| egui::Frame::NONE.fill(fill).inner_margin(margin);
        let fixed = |panel: Panel, size: f32, margin: Margin| {
            panel.exact_size(size).resizable(false).frame(plain(margin))
        };
        let context = &ViewContext::new(state, commands);
        fixed(Panel::top("toolbar"), sizes.toolbar, Margin::symmetric(8, 0))
            .show(ui, |ui| frame::toolbar::ui(ui, context, panes));
        let mut canvas = egui::Rect::NOTHING;
        let central = egui::CentralPanel::default().frame(plain(Margin::same(6)));
        let options = context.options;
        let below = Margin::symmetric(8, 4);
        match options.layout {
            _ if options.is_alone => {
                central.show(ui, |ui| {
                    canvas = ui.max_rect();
                    frame::canvas::alone(ui, context, panes);
                });
            }
            Arrangement::Inspect => {
                fixed(Panel::top("verdicts"), sizes.verdicts, Margin::ZERO)
                    .show(ui, |ui| frame::verdicts::ui(ui, context));
                let height = sizes.storyboard.min(frame::storyboard::height(context.setup));
                fixed(Panel::bottom("storyboard"), height, below)
                    .show(ui, |ui| frame::storyboard::ui(ui, context));
                if options.shows_side(SidePanel::Queries, sizes.has_sides) {
                    fixed(Panel::left("queries"), sizes.queries, Margin::same(6))
                        .show(ui, |ui| panes.show(ui, ViewName::Queries, context));
                }
                if options.shows_side(SidePanel::Inspector, sizes.has_sides) {
                    fixed(Panel::right("inspector"), sizes.inspector, Margin::symmetric(10, 6))
                        .show(ui, |ui| frame::inspector::ui(ui, context, panes));
                }
                central.show(ui, |ui| {
                    canvas = ui.max_rect();
                    frame::canvas::ui(ui, context, panes, 4);
                });
            }
            Arrangement::Lecture => {
                fixed(Panel::bottom("lecture"), sizes.sentence, below)
                    .show(ui, |ui| lecture::ui(ui, context));
                if let Some(lesson) = lesson {
                    Panel::left("lesson")
                        .exact_size(lesson::WIDTH)
                        .resizable(false)
                        .show(ui, |ui| lesson.ui(ui, context));
                }
                central.show(ui, |ui| {
                    canvas = ui.max_rect();
                    if context.options.lockstep.is_some() {
                        panes.show(ui, ViewName::Lockstep, context);
                    } else {
                        frame::canvas::ui(ui, context, panes, 2);
                    }
                });
            }
            Arrangement::Batch => {
                let width = ui.available_width() * 0.44;
                fixed(Panel::right("selected"), width, Margin::same(10)).show(ui, |ui| {
                    canvas = ui.max_rect();
                    frame::batch::right(ui, context, panes);
                });
                central.show(ui, |ui| frame::batch::left(ui, context, panes));
            }
        }
        self.canvas = canvas;
    }

    /// What is open above all parts.
    fn above(&mut self, ctx: &egui::Context) {
        let context = ViewContext::new(&self.state, &self.commands);
        frame::notes(ctx, &context);
        let is_over = |asking: &mut save::Asking| asking.ui(ctx, &self.commands);
        if self.asking.as_mut().is_some_and(is_over) {
            self.asking = None;
        }
        let is_over = |search: &mut ActionSearch| search.ui(ctx, &context);
        if self.search.as_mut().is_some_and(is_over) {
            self.search = None;
        }
        if self.help {
            frame::help::keys_ui(ctx, &mut self.help);
        }
    }
}

impl eframe::App for App {
    /// Runs for a hidden window too, so that a worker is never left unheard.
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.update(ctx);
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.content(ui);
    }

    /// A recording that is being written is not cut off.
    fn on_exit(&mut self) {
        self.state.recorder.finish();
    }
}
