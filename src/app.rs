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
mod camera;
mod command;
mod dispatch;
mod layout;
mod navigation;
mod prober;
mod queries;
mod save;
mod saved;
mod setup;
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

pub use command::{Command, Shortcut, shortcuts};
pub use setup::{ReferencePick, Setup};
pub use shown::{ShownReason, ShownView};
pub use state::{AppState, Note, Results};
pub use view_context::ViewContext;
pub use view_options::{CompareMode, ViewOptions};
pub use window::{WindowError, has_display, open, window_options};

use layout::Layout;

/// The application.
pub struct App {
    state: AppState,
    layout: Layout,
    commands: command::Queue,
    help: bool,
    pictures: save::Pictures,
}

impl App {
    /// The window's content for a setup. It starts to run at once, in the mode of the setup.
    pub fn new(creation: &eframe::CreationContext<'_>, setup: Setup) -> Self {
        theme::install(&creation.egui_ctx);
        Self {
            state: AppState::new(setup, creation.egui_ctx.clone()),
            layout: Layout::new(creation.wgpu_render_state.as_ref()),
            commands: command::Queue::default(),
            help: false,
            pictures: save::Pictures::default(),
        }
    }

    /// With results of the setup's queries that are known already.
    pub fn with_results(mut self, results: Results) -> Self {
        self.state.set_known_results(results);
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

impl eframe::App for App {
    /// Runs for a hidden window too, so that a worker is never left unheard.
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.state.poll();
        for said in self.pictures.write() {
            match said {
                Ok(words) => self.state.note(words, false),
                Err(why) => self.state.note(why, true),
            }
        }
        for command in self.commands.take() {
            self.dispatch(command, ctx);
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        command::read_keys(ui.ctx(), &self.commands);
        let Self {
            state,
            layout,
            commands,
            help,
            ..
        } = self;
        egui::Panel::top("transport").show(ui, |ui| transport::ui(ui, state, commands));
        egui::Panel::bottom("timeline").show(ui, |ui| timeline::ui(ui, state, commands));
        egui::CentralPanel::default()
            .frame(egui::Frame::NONE.fill(ui.visuals().panel_fill))
            .show(ui, |ui| layout.ui(ui, state, commands));
        if *help {
            command::help_ui(ui.ctx(), help);
        }
        state.textures.end_frame();
        for command in self.commands.take() {
            self.dispatch(command, ui.ctx());
        }
    }
}
