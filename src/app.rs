//! The window: drive an estimator as in a debugger and see why it decides what it decides.
//!
//! ```text
//! keys, buttons, views → Command → App::obey → Desk (session, cursor, camera) → Scope → views
//! ```
//!
//! A view keeps no copy of the run. It is handed a [`Scope`], the run at the cursor, and answers
//! with commands; so looking back costs no second run, and whatever a person can do, a test can do.

mod adapter;
mod camera;
mod command;
mod desk;
mod layout;
mod obey;
mod prober;
mod queries;
mod save;
mod saved;
mod scope;
mod setup;
mod shown;
mod textures;
mod theme;
mod timeline;
mod transport;
pub mod views;
mod window;

pub use command::{Command, Shortcut, shortcuts};
pub use desk::{Comparing, Desk, Note};
pub use scope::Scope;
pub use setup::{ReferencePick, Setup};
pub use shown::{Shown, ShownAt};
pub use window::{WindowError, has_display, open, window_options};

use layout::Layout;

/// The application.
pub struct App {
    desk: Desk,
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
            desk: Desk::new(setup, creation.egui_ctx.clone()),
            layout: Layout::new(creation.wgpu_render_state.as_ref()),
            commands: command::Queue::default(),
            help: false,
            pictures: save::Pictures::default(),
        }
    }

    /// What is on the desk: the run, the cursor, the camera.
    pub fn desk(&self) -> &Desk {
        &self.desk
    }

    /// Does what a key or a button would do.
    pub fn send(&mut self, command: Command) {
        self.commands.send(command);
    }
}

impl eframe::App for App {
    /// Runs for a hidden window too, so that a worker is never left unheard.
    fn logic(&mut self, ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.desk.attend();
        for said in self.pictures.write() {
            match said {
                Ok(words) => self.desk.note(words, false),
                Err(why) => self.desk.note(why, true),
            }
        }
        for command in self.commands.take() {
            self.obey(command, ctx);
        }
    }

    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        command::read_keys(ui.ctx(), &self.commands);
        let Self {
            desk,
            layout,
            commands,
            help,
            ..
        } = self;
        egui::Panel::top("transport").show(ui, |ui| transport::ui(ui, desk, commands));
        egui::Panel::bottom("timeline").show(ui, |ui| timeline::ui(ui, desk, commands));
        egui::CentralPanel::default()
            .frame(egui::Frame::NONE.fill(ui.visuals().panel_fill))
            .show(ui, |ui| layout.ui(ui, desk, commands));
        if *help {
            command::help_ui(ui.ctx(), help);
        }
        desk.textures.end_frame();
        for command in self.commands.take() {
            self.obey(command, ui.ctx());
        }
    }
}
