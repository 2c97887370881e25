//! Another scene, run or lesson in a window that is open.

use std::sync::Arc;

use super::App;
use super::frame::Panes;
use super::lesson::OpenLesson;
use super::selection::KnownResults;
use super::setup::Setup;
use super::state::{AppState, Opened};
use super::view_options::Arrangement;
use crate::lesson::Lesson;

/// What the window shows.
pub struct Opening {
    /// What is run.
    pub setup: Setup,
    /// Results that are known already.
    pub results: KnownResults,
    /// The lesson, of which the setup is what its first page localises.
    pub lesson: Option<Lesson>,
}

/// Opens what has this name: a scene, a run folder or a lesson.
pub type Opener = Arc<dyn Fn(&str) -> Result<Opening, String> + Send + Sync>;

impl App {
    /// With something that opens other scenes, runs and lessons.
    pub fn with_opener(mut self, opener: Opener) -> Self {
        self.opener = Some(opener);
        self
    }

    /// Opens another scene, run folder or lesson in place of what is shown.
    pub fn open_named(&mut self, name: &str) {
        let Some(opener) = self.opener.clone() else {
            self.state.note("This window opens nothing else", true);
            return;
        };
        self.state.note(format!("Opening {name} …"), false);
        let name = name.to_owned();
        self.state.open(move || Opened::Other(Box::new(opener(&name))));
    }

    /// Opens a file or a folder that was dropped on the window.
    pub(super) fn take_dropped(&mut self, ctx: &egui::Context) {
        let dropped = ctx.input(|input| {
            let first = input.raw.dropped_files.first();
            first.map(|file| file.path().to_owned())
        });
        if let Some(path) = dropped {
            // A report or a description stands for its folder.
            let is_of_folder = ["report.html", "run.toml"]
                .iter()
                .any(|name| path.file_name().is_some_and(|file| file == *name));
            let path = path.parent().filter(|_| is_of_folder).unwrap_or(&path);
            self.open_named(&path.display().to_string());
        }
    }

    /// Shows what was opened, from its beginning.
    pub(super) fn begin(&mut self, opening: Opening) {
        self.state.recorder.finish();
        let has_results = !opening.results.now.is_empty();
        self.state = AppState::new(opening.setup, self.state.ctx.clone());
        self.state.set_known_results(opening.results);
        self.panes = Panes::new();
        self.lesson = opening.lesson.map(|lesson| OpenLesson::new(lesson, &self.state.setup));
        self.arrange(match &self.lesson {
            Some(_) => Arrangement::Lecture,
            None if has_results => Arrangement::Batch,
            None => Arrangement::Inspect,
        });
    }
}
