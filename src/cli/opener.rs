//! Windows in which other scenes, runs and lessons can be opened.

use std::path::Path;
use std::sync::Arc;

use posescope::app::{self, KnownResults, Opener, Opening};
use posescope::lesson::Lesson;

use super::args::ViewArgs;
use super::failure::CliError;
use super::terminal::Terminal;
use super::{lesson, view};

/// Shows a lesson in the window, or without a display records it.
pub fn lesson_window(opened: &Lesson, terminal: &Terminal) -> Result<(), CliError> {
    let setup = lesson::setup_of(opened)?;
    match app::open_lesson(setup, opened.clone(), opener()) {
        Ok(()) => Ok(()),
        Err(why) => lesson::save_instead(opened, &why, terminal),
    }
}

/// What opens scenes, runs and lessons.
pub fn opener() -> Opener {
    Arc::new(|name| opening(name).map_err(|error| error.to_string()))
}

/// A lesson, a run folder or a scene. What is in the file system comes before a lesson of that name.
fn opening(name: &str) -> Result<Opening, CliError> {
    let lessons = if Path::new(name).exists() { Vec::new() } else { Lesson::all()? };
    if let Some(lesson) = lessons.into_iter().find(|lesson| lesson.name == name) {
        let setup = lesson::setup_of(&lesson)?;
        return Ok(Opening { setup, results: KnownResults::default(), lesson: Some(lesson) });
    }
    let args = ViewArgs::parse(["posescope", "view", name].map(str::to_owned))?;
    let (setup, results) = view::setup(&args)?;
    Ok(Opening { setup, results, lesson: None })
}
