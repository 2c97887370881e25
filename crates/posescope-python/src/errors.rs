//! Errors as Python's exceptions.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use posescope::localize::{ChoiceError, LocalizeError};
use posescope::run::{ConfigError, DrawError, FolderError, PlanError, RunError, SurveyError};
use posescope::scene::{NoIndex, SceneError};
use posescope_core::InputError;
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;

/// Where the classes of exceptions are.
const MODULE: &str = "posescope._errors";

/// Where the last panic came from. It may have been on a thread of a pool.
static PLACE: Mutex<String> = Mutex::new(String::new());

/// A panic becomes an exception, so nothing is printed.
pub fn keep_panics_silent() {
    std::panic::set_hook(Box::new(|panic| {
        let place = panic.location().map(|place| format!("{}:{}", place.file(), place.line()));
        *PLACE.lock().unwrap_or_else(PoisonError::into_inner) = place.unwrap_or_default();
    }));
}

/// Where the last panic came from, as file and line.
pub fn place_of_panic() -> String {
    PLACE.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

fn raised(class: &str, arguments: impl for<'py> pyo3::call::PyCallArgs<'py>) -> PyErr {
    Python::attach(|py| {
        let made = || py.import(MODULE)?.getattr(class)?.call1(arguments);
        made().map_or_else(|error| error, PyErr::from_value)
    })
}

/// `posescope.InternalError`: a bug of posescope.
pub fn internal(message: &str) -> PyErr {
    raised("InternalError", (message.to_owned(),))
}

/// `posescope.InputError`: a file, a place in it, and what was expected there.
pub fn input(file: &str, place: &str, expected: &str) -> PyErr {
    raised("InputError", (file.to_owned(), place.to_owned(), expected.to_owned()))
}

/// An error of input files.
pub fn scene(error: &SceneError) -> PyErr {
    let shown = |path: &Path| path.display().to_string();
    match error {
        SceneError::Io { path, source } => input(&shown(path), "", &source.to_string()),
        SceneError::Image { path, source } => input(&shown(path), "", &source.to_string()),
        SceneError::Content { path, expected } => input(&shown(path), "", expected),
        SceneError::Line { path, line, expected } => {
            input(&shown(path), &format!("line {line}"), expected)
        }
        SceneError::UnknownFrame { scene, frame, known } => {
            input(scene, &format!("frame {frame}"), &format!("one of the frames {known}"))
        }
        SceneError::NoPose { scene, frame } => {
            input(scene, &format!("frame {frame}"), "a reference has a pose")
        }
        SceneError::NoCloud { path, frame, hint } => input(
            &shown(path),
            &format!("frame {frame}"),
            &format!("a reference has a cloud; {hint}"),
        ),
        SceneError::NotFound { argument } => input(
            argument,
            "",
            "no such file or folder; a path expected, or the built-in scene street",
        ),
        SceneError::NotRecognized { argument, known, hint } => {
            input(argument, "", &format!("one of the formats {known} expected; {hint}"))
        }
        SceneError::UnknownCondition { argument, known } => {
            input(argument, "", &format!("one of the conditions {known} expected after street:"))
        }
        // A wrong argument.
        SceneError::UnknownFormat { .. } => value(error),
        other => input("", "", &other.to_string()),
    }
}

/// An error of a run folder or another file of an evaluation.
pub fn folder(error: &FolderError) -> PyErr {
    let shown = |path: &Path| path.display().to_string();
    match error {
        FolderError::NotEmpty { .. } | FolderError::OtherRun { .. } | FolderError::InUse(_) => {
            value(error)
        }
        FolderError::Io { path, source } => input(&shown(path), "", &source.to_string()),
        FolderError::Damaged { path, line, message } => {
            input(&shown(path), &format!("line {line}"), message)
        }
        FolderError::NoRun(path) => input(&shown(path), "", "a run folder with run.toml expected"),
        FolderError::Incomplete { path, done, items } => {
            input(&shown(path), "", &format!("{items} queries expected, {done} are done"))
        }
    }
}

/// An error before the first query of an evaluation.
pub fn plan(error: &PlanError) -> PyErr {
    let shown = |path: &Path| path.display().to_string();
    match error {
        PlanError::Scene(error) | PlanError::Draw(DrawError::Scene(error)) => scene(error),
        PlanError::Folder(error) => folder(error),
        PlanError::Config(ConfigError::Io { path, source }) => {
            input(&shown(path), "", &source.to_string())
        }
        PlanError::Config(ConfigError::File { path, source }) => {
            input(&shown(path), "", &source.to_string())
        }
        PlanError::Draw(DrawError::NoPose(scene)) => input(
            scene,
            "",
            "a frame with a known pose expected; `posescope.doctor` says what is missing",
        ),
        PlanError::Index(error @ NoIndex::Unusable { .. }) => input("", "", &error.to_string()),
        PlanError::Survey(error @ SurveyError::Scenes(_)) => value(error),
        PlanError::Survey(error) => input("", "", &error.to_string()),
        PlanError::Protocol(_)
        | PlanError::Config(ConfigError::Param(_))
        | PlanError::Draw(DrawError::NotDrawn { .. })
        | PlanError::Index(NoIndex::NoFolder)
        | PlanError::Output(_)
        | PlanError::Refused(_) => value(error),
    }
}

/// An error of an evaluation.
pub fn run(error: &RunError) -> PyErr {
    match error {
        RunError::Scene(error) | RunError::Choice(ChoiceError::Scene(error)) => scene(error),
        RunError::Folder(error) => folder(error),
        RunError::Cancelled(_) => PyKeyboardInterrupt::new_err(()),
        RunError::Choice(error) => value(error),
    }
}

/// An error of arrays, cameras and radii.
pub fn array(error: &InputError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// An error of a localisation.
pub fn localize(error: &LocalizeError) -> PyErr {
    match error {
        LocalizeError::Scene(error) => scene(error),
        LocalizeError::Cancelled(_) => PyKeyboardInterrupt::new_err(()),
        other => internal(&other.to_string()),
    }
}

/// A wrong argument.
pub fn value(error: impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}
