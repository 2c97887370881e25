//! The window: drive an estimator as in a debugger and see why it decides what it decides.
//!
//! ```text
//! keys, buttons, views → Command → App::dispatch → AppState → ViewContext → views
//! ```
//!
//! A view keeps no copy of the run. It is handed a [`ViewContext`], the run at the cursor, and
//! answers with commands; so looking back costs no second run, and whatever a person can do, a test
//! can do.

mod adapter;
mod arrangement;
mod camera;
mod card;
mod command;
mod cost_line;
mod deciding;
mod dense_map;
mod dispatch;
mod headless;
mod keys;
mod layout;
mod lecture;
mod lesson;
mod navigation;
mod pictures;
mod prober;
mod queries;
mod run_results;
mod save;
mod save_target;
mod saved;
mod selection;
mod setup;
mod shot;
mod shown;
mod state;
mod textures;
mod theme;
mod timeline;
mod transport;
mod view_context;
mod view_options;
pub mod views;
mod window;

pub use arrangement::Arrangement;
pub use camera::NamedPose;
pub use command::Command;
pub use cost_line::{CostAlong, CostLine};
pub use dense_map::{DenseAsk, DenseMap};
pub use keys::{Shortcut, shortcuts};
pub use run_results::results_of_run;
pub use save_target::SaveTarget;
pub use selection::{KnownResults, ResultRow, Results, VerdictChange};
pub use setup::{ReferencePick, Setup};
pub use shot::{Moment, Shot, ShotError, shoot};
pub use shown::{ShownReason, ShownView};
pub use state::{AppState, Note};
pub use view_context::ViewContext;
pub use view_options::{CompareMode, ViewOptions};
pub use window::{WindowError, has_display, open, open_lesson, window_options};

use eframe::egui_wgpu::RenderState;
use layout::Layout;
use lesson::OpenLesson;

use crate::lesson::Lesson;

/// The application.
pub struct App {
    state: AppState,
    layout: Layout,
    timeline: timeline::Timeline,
    card: card::Card,
    commands: command::Queue,
    help: bool,
    pictures: save::Pictures,
    /// Where something is to be saved, while that is asked.
    asking: Option<save::Asking>,
    /// The lesson that somebody goes through.
    lesson: Option<OpenLesson>,
    /// What the window's frame says.
    title: String,
    /// Whether a maximised view is drawn without bars around it, for a picture.
    is_bare: bool,
}

impl App {
    /// The window's content for a setup. It starts to run at once, in the mode of the setup.
    pub fn new(creation: &eframe::CreationContext<'_>, setup: Setup) -> Self {
        let state = creation.wgpu_render_state.as_ref();
        Self::of(&creation.egui_ctx, state, setup)
    }

    fn of(ctx: &egui::Context, render_state: Option<&RenderState>, setup: Setup) -> Self {
        theme::install(ctx);
        Self {
            state: AppState::new(setup, ctx.clone()),
            layout: Layout::new(render_state),
            timeline: timeline::Timeline::default(),
            card: card::Card::default(),
            commands: command::Queue::default(),
            help: false,
            pictures: save::Pictures::default(),
            asking: None,
            lesson: None,
            title: String::new(),
            is_bare: false,
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
        self.commands.send(Command::Arrange(Arrangement::Teach));
        self
    }

    /// The state that the views draw from: the run, the cursor, the camera.
    pub fn app_state(&self) -> &AppState {
        &self.state
    }

    /// Does what a key or a button would do.
    pub fn send(&mut self, command: Command) {
        self.commands.send(command);
    }
}

impl App {
    /// Takes in what other threads have done, and does what was asked for.
    fn update(&mut self, ctx: &egui::Context) {
        self.state.poll();
        let said = self.pictures.write();
        for said in said {
            match said {
                Ok(words) => self.state.note(words, false),
                Err(why) => self.state.note(why, true),
            }
        }
        for command in self.commands.take() {
            self.dispatch(command, ctx);
        }
        let title = self.state.setup.title();
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }
    }

    /// Draws the window.
    fn content(&mut self, ui: &mut egui::Ui) {
        // A question has the keys to itself.
        if self.asking.is_none() {
            // What is open on top closes first.
            let close = |input: &mut egui::InputState| {
                input.consume_key(egui::Modifiers::NONE, egui::Key::Escape)
            };
            if self.help && ui.input_mut(close) {
                self.help = false;
            }
            if let Some(lesson) = &self.lesson {
                lesson.read_keys(ui.ctx(), &self.commands);
            }
            keys::read_keys(ui.ctx(), &self.commands);
        }
        let Self {
            state,
            layout,
            timeline,
            card,
            commands,
            help,
            is_bare,
            lesson,
            asking,
            ..
        } = self;
        if *is_bare && layout.is_maximized() {
            egui::CentralPanel::default().show(ui, |ui| layout.alone_ui(ui, state, commands));
            state.textures.end_frame();
            return;
        }
        egui::Panel::top("transport").show(ui, |ui| transport::ui(ui, state, commands));
        if let Some(lesson) = lesson {
            egui::Panel::left("lesson")
                .exact_size(lesson::WIDTH)
                .show(ui, |ui| lesson.ui(ui, state, commands));
        }
        // A view that has all the room has that of the card too.
        if !layout.is_maximized() {
            if layout.arrangement() == Arrangement::Teach {
                egui::Panel::top("lecture").show(ui, |ui| lecture::ui(ui, state));
            }
            // Beside each other the methods say themselves what became of them.
            if state.options.lockstep.is_none() {
                egui::Panel::top("verdicts").show(ui, |ui| card.ui(ui, state, commands));
            }
        }
        egui::Panel::bottom("timeline").show(ui, |ui| timeline.ui(ui, state, commands));
        egui::CentralPanel::default()
            .frame(egui::Frame::NONE.fill(ui.visuals().panel_fill))
            .show(ui, |ui| layout.ui(ui, state, commands));
        transport::notes(ui.ctx(), state, commands);
        if asking
            .as_mut()
            .is_some_and(|asking| asking.ui(ui.ctx(), commands))
        {
            *asking = None;
        }
        if *help {
            keys::help_ui(ui.ctx(), help);
        }
        state.textures.end_frame();
        for command in self.commands.take() {
            self.dispatch(command, ui.ctx());
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
}
