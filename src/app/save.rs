//! What leaves the window: recordings, pictures, sessions, the command line.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::command::Queue;
use super::setup::Setup;
use super::state::AppState;
use super::textures::rgb_image;
use crate::session::Run;
use crate::sink::rerun::{Identity, Recorder, Targets};

/// Something that leaves the window for a file, or comes from one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveTarget {
    /// All that was reported so far, for the Rerun viewer.
    Recording,
    /// The whole window, as PNG.
    Picture,
    /// The canvas, as PNG.
    Canvas,
    /// Scene, query, settings and layout.
    Session,
    /// Back from such a file.
    Restored,
    /// Another scene, run or lesson.
    Opened,
}

impl SaveTarget {
    /// What is asked, as the title of the question.
    fn title(self) -> &'static str {
        match self {
            Self::Recording => "Save the recording",
            Self::Picture => "Save the window as a picture",
            Self::Canvas => "Save the canvas as a picture",
            Self::Session => "Save the session",
            Self::Restored => "Restore a session",
            Self::Opened => "Open a scene, a run folder or a lesson",
        }
    }
}

/// The file that is offered: what is looked at gives its name.
fn offered(target: SaveTarget, setup: &Setup) -> PathBuf {
    let name = |ending: &str| format!("{}{ending}", name_of(setup));
    let file = match target {
        SaveTarget::Opened => return setup.task.scene.clone().into(),
        SaveTarget::Recording => name(".rrd"),
        SaveTarget::Picture => name("-window.png"),
        SaveTarget::Canvas => name("-canvas.png"),
        SaveTarget::Session | SaveTarget::Restored => "session.json".to_owned(),
    };
    setup.folder.join(file)
}

/// Scene, query and references, as a file is called.
fn name_of(setup: &Setup) -> String {
    let mut words = vec![setup.references.name().to_owned()];
    if !setup.is_one_drive() {
        words.push(setup.queries.name().to_owned());
    }
    words.push(setup.query_name().to_owned());
    words.extend(setup.reference_names());
    let plain = |c: char| {
        if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }
    };
    words.join("-").chars().map(plain).collect()
}

/// The question where something is to be saved.
pub(super) struct Asking {
    target: SaveTarget,
    path: String,
    /// Whether the field has had the keyboard.
    is_focused: bool,
}

impl Asking {
    pub(super) fn new(target: SaveTarget, setup: &Setup) -> Self {
        Self { target, path: offered(target, setup).display().to_string(), is_focused: false }
    }

    /// Draws the question; whether it is answered or taken back.
    pub(super) fn ui(&mut self, ctx: &egui::Context, commands: &Queue) -> bool {
        let mut is_over = false;
        let window = egui::Window::new(self.target.title())
            .collapsible(false)
            .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]);
        window.show(ctx, |ui| {
            let label = ui.label("File");
            let field = egui::TextEdit::singleline(&mut self.path).desired_width(520.0);
            let field = ui.add(field).labelled_by(label.id);
            if !self.is_focused {
                field.request_focus();
                self.is_focused = true;
            }
            let (enter, escape) = ui.input(|input| {
                let is_pressed = |key| input.key_pressed(key);
                (is_pressed(egui::Key::Enter), is_pressed(egui::Key::Escape))
            });
            ui.horizontal(|ui| {
                let is_named = !self.path.trim().is_empty();
                let does = match self.target {
                    SaveTarget::Restored => "Restore",
                    SaveTarget::Opened => "Open",
                    _ if Path::new(self.path.trim()).exists() => "Replace the file",
                    _ => "Save it",
                };
                let button = ui.add_enabled(is_named, egui::Button::new(does));
                if button.on_hover_text("Enter").clicked() || (enter && is_named) {
                    let (target, path) = (self.target, self.path.trim().into());
                    commands.send(move |app| app.save(target, path));
                    is_over = true;
                }
                let cancel = ui.button("Cancel").on_hover_text("Escape");
                is_over |= cancel.clicked() || escape;
            });
        });
        is_over
    }
}

impl AppState {
    pub(super) fn save_recording(&mut self, path: PathBuf) {
        let done = format!("Recording: {}", path.display());
        self.record_to(Targets { save: Some(path), ..Targets::default() }, done);
    }

    pub(super) fn stream_recording(&mut self) {
        let targets = Targets { connect: Some(String::new()), ..Targets::default() };
        self.record_to(targets, "The run was sent to the Rerun viewer".to_owned());
    }

    pub(super) fn spawn_viewer(&mut self) {
        let targets = Targets { spawn: true, ..Targets::default() };
        self.record_to(targets, "A Rerun viewer shows the run".to_owned());
    }

    pub(super) fn copy_command_line(&mut self) {
        self.ctx.copy_text(self.setup.command_line());
        self.note("The command line is on the clipboard", false);
    }

    /// Records the run beside the window's thread; a note says how that went.
    fn record_to(&mut self, targets: Targets, done: String) {
        if self.run().loaded.is_none() {
            self.note("There is nothing to record yet: no photo has been read", true);
            return;
        }
        self.note("Recording the run …", false);
        let (run, setup) = (self.run().clone(), self.setup.clone());
        self.recorder.ask(move |emit| {
            emit(record(&run, &setup, &targets).map(|()| done));
        });
    }
}

/// Records a run from its history: nothing is computed anew.
fn record(run: &Run, setup: &Setup, targets: &Targets) -> Result<(), String> {
    if let Some(folder) = targets.save.as_deref().and_then(Path::parent) {
        std::fs::create_dir_all(folder)
            .map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    let identity = Identity {
        scene: setup.references.name().to_owned(),
        query_scene: (!setup.is_one_drive()).then(|| setup.queries.name().to_owned()),
        queries: vec![setup.query_name().to_owned()],
        references: setup.reference_names(),
        configuration: run.params.to_toml(),
        degraded: setup.task.protocol.degrade,
        seed: setup.task.protocol.seed,
    };
    let recorder = Recorder::open(targets, &identity, &setup.task.protocol.methods);
    let recorded = recorder.and_then(|mut recorder| {
        run.replay(&mut recorder);
        recorder.close()
    });
    recorded.map_err(|error| error.to_string())
}

/// What to say of pictures that were asked for and have been written.
#[derive(Clone, Default)]
pub(super) struct Pictures(Arc<Mutex<Vec<Result<String, String>>>>);

impl Pictures {
    /// Asks the window for its pixels, or for those of a part \[points\], and writes them.
    pub(super) fn ask(&self, ctx: &egui::Context, path: PathBuf, part: Option<egui::Rect>) {
        let part = part.map(|rect| (rect, ctx.pixels_per_point()));
        let (written, waker) = (Arc::clone(&self.0), ctx.clone());
        ctx.request_screenshot(move |image| {
            let image = match part {
                Some((rect, pixels_per_point)) => image.region(&rect, Some(pixels_per_point)),
                None => egui::ColorImage::clone(&image),
            };
            let said = write(&image, &path).map_err(|why| format!("{}: {why}", path.display()));
            let said = said.map(|()| format!("Picture: {}", path.display()));
            written.lock().unwrap_or_else(PoisonError::into_inner).push(said);
            waker.request_repaint();
        });
        ctx.request_repaint();
    }

    /// What to say of those that were written since the last call.
    pub(super) fn take(&self) -> Vec<Result<String, String>> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

fn write(image: &egui::ColorImage, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    rgb_image(image).ok_or("the window gave no picture")?.save(path)?;
    Ok(())
}
