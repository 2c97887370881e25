//! What changes more than the state: the layout, the open lesson, files.

use std::path::{Path, PathBuf};

use super::App;
use super::action;
use super::frame::Panes;
use super::frame::help::ActionSearch;
use super::lesson::{Given, OpenLesson};
use super::navigation::{Anchor, Navigation};
use super::opening::{Opener, Opening};
use super::save::{Asking, SaveTarget};
use super::saved::SavedSession;
use super::state::{AppState, Opened};
use super::view_name::ViewName;
use super::view_options::Arrangement;

impl App {
    /// Does the action of [`ACTIONS`](super::ACTIONS) that has this text, as its key or its button does.
    pub fn act(&mut self, text: &str) {
        match action::of(text) {
            Some(action) => (action.run)(self),
            None => self.state.note(format!("There is no action `{text}`"), true),
        }
    }

    /// Arranges the window for something.
    pub fn arrange(&mut self, layout: Arrangement) {
        let is_lecture = layout == Arrangement::Lecture;
        let options = &mut self.state.options;
        let was_lecture = options.layout == Arrangement::Lecture;
        options.layout = layout;
        options.hides_future = is_lecture;
        options.is_alone = false;
        options.presented = None;
        if is_lecture {
            options.shows_why = false;
            self.show_page();
        } else if was_lecture {
            self.state.show_why_at_end();
        }
    }

    /// Shows the selected result in the layout that explains one query.
    pub fn open_selected(&mut self) {
        let part = self.state.shown_span().map(|span| span.part);
        self.arrange(Arrangement::Inspect);
        if let Some(part) = part {
            self.state.show_outcome(part);
        }
    }

    pub(super) fn switch_theme(&self) {
        let ctx = &self.state.ctx;
        let is_dark = ctx.global_style().visuals.dark_mode;
        ctx.set_theme(if is_dark { egui::Theme::Light } else { egui::Theme::Dark });
    }

    pub(super) fn open_search(&mut self) {
        self.search = Some(ActionSearch::default());
    }

    /// The next page of the lesson, or the one before.
    pub(super) fn turn_page(&mut self, back: bool) {
        match self.lesson.as_mut().map(|open| open.turn(back)) {
            Some(true) => self.show_page(),
            Some(false) => {}
            None => {
                let words = "No lesson is open; `posescope lesson` lists them";
                self.state.note(words, false);
            }
        }
    }

    /// Answers the lesson's question.
    pub(super) fn answer(&mut self, given: Given) {
        if self.lesson.as_mut().is_some_and(|open| open.answer(given)) {
            self.show_page();
        }
    }

    /// Answers it with the place of the trial camera.
    pub(super) fn guess(&mut self) {
        if let Some(camera) = self.state.camera {
            self.answer(Given::Place(camera));
        }
    }

    pub(super) fn close_lesson(&mut self) {
        self.lesson = None;
        self.state.options.lockstep = None;
        self.arrange(Arrangement::default());
    }

    /// Shows what the present page of the lesson is about.
    fn show_page(&mut self) {
        let Some(open) = &self.lesson else { return };
        match open.other_setup(&self.state.setup) {
            Some(job) => self.state.open(job),
            None => self.state.seek(open.moment().clone()),
        }
        // The truth would be an answer.
        self.state.options.shows_truth = open.asked().is_none();
        let page = open.page();
        self.state.options.lockstep = page.lockstep;
        let named = page.show.iter().filter_map(|word| ViewName::find(word));
        let named: Vec<_> = named.collect();
        self.state.options.presented = Some(named).filter(|named| !named.is_empty());
    }

    /// Asks for the file that something is saved in, or comes from.
    pub fn ask_where(&mut self, target: SaveTarget) {
        self.asking = Some(Asking::new(target, &self.state.setup));
    }

    /// Saves something in a file, or takes it from there.
    pub fn save(&mut self, target: SaveTarget, path: PathBuf) {
        match target {
            SaveTarget::Recording => self.state.save_recording(path),
            SaveTarget::Picture => self.pictures.ask(&self.state.ctx, path, None),
            SaveTarget::Canvas => self.pictures.ask(&self.state.ctx, path, Some(self.canvas)),
            SaveTarget::Session => self.save_session(&path),
            SaveTarget::Restored => self.restore_session(path),
            SaveTarget::Opened => self.open_named(&path.display().to_string()),
        }
    }

    fn save_session(&mut self, path: &Path) {
        let layout = self.state.options.layout;
        let saved = SavedSession::new(&self.state.setup, self.state.cursor(), layout);
        match saved.write(path) {
            Ok(()) => self.state.note(format!("Session: {}", path.display()), false),
            Err(why) => self.state.note(why, true),
        }
    }

    fn restore_session(&mut self, path: PathBuf) {
        self.state.note(format!("Opening the session {} …", path.display()), false);
        let present = self.state.setup.clone();
        self.state.open(move || {
            Opened::Session(
                SavedSession::read(&path)
                    .and_then(|saved| Ok((saved.setup(&present)?, saved.cursor, saved.layout))),
            )
        });
    }

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
    fn begin(&mut self, opening: Opening) {
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

    /// Takes over what was opened; `None` stands for a panic.
    pub(super) fn take_opened(&mut self, opened: Option<Opened>) {
        match opened {
            Some(Opened::Session(Ok((setup, cursor, layout)))) => {
                self.state.restore(setup, cursor);
                self.arrange(layout);
                self.state.note("The session is restored", false);
            }
            Some(Opened::Page(variant, Ok(setup))) => {
                if let Some(open) = &mut self.lesson
                    && open.take(variant, &setup)
                {
                    let navigation = Navigation::towards(Anchor::Moment(open.moment().clone()));
                    self.state.change_setup(setup, navigation);
                }
            }
            Some(Opened::Other(opened)) => match *opened {
                Ok(opening) => self.begin(opening),
                Err(why) => self.state.note(why, true),
            },
            Some(Opened::Session(Err(why))) => self.state.note(why, true),
            Some(Opened::Page(_, Err(error))) => self.state.note(error.to_string(), true),
            None => self.state.note("internal error while scenes were opened", true),
        }
    }
}
