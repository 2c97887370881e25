//! The commands: all of them for the program, and some that return what they find.

use std::ffi::OsString;
use std::path::PathBuf;

use posescope::cli;
use posescope::doctor::{Examination, Remark, examine};
use posescope::report::{PICTURES, write_html};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::detached::detached;
use crate::scene::Scene;
use crate::{arrays, errors};

/// Runs the command `posescope` with these arguments, the program's name first, and returns its exit code.
#[pyfunction]
pub fn main(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    let code = py.detach(|| cli::run(arguments));
    // The program prints panics; those of later calls are exceptions again.
    errors::keep_panics_silent();
    code
}

/// What `posescope doctor` finds: whether the scene is broken, its remarks, the mistake with its remedy, the text and
/// the picture.
#[pyfunction]
pub fn doctor<'py>(py: Python<'py>, scene: &Scene) -> PyResult<Bound<'py, PyDict>> {
    let scene = scene.opened.scene.as_ref();
    let found = detached(py, None, |_| examine(scene))?;
    let dict = PyDict::new(py);
    let Examination { remarks, finding, picture, .. } = &found;
    dict.set_item("is_broken", found.is_broken())?;
    let remarks = remarks.iter().map(|remark| match remark {
        Remark::Broken(why) => ("broken", why.as_str()),
        Remark::Odd(why) => ("odd", why.as_str()),
    });
    dict.set_item("remarks", PyList::new(py, remarks.collect::<Vec<_>>())?)?;
    let mistake = finding.as_ref().map(|one| (one.mistake.about(), one.remedy.as_str()));
    dict.set_item("mistake", mistake)?;
    dict.set_item("text", cli::examination_in_words(scene, &found, None).trim_end())?;
    let picture = picture
        .as_ref()
        .map(|picture| arrays::of_photo(py, &posescope_core::Photo::from_color(picture.clone())));
    dict.set_item("picture", picture.transpose()?)?;
    Ok(dict)
}

/// Writes `report.html` of a run folder and returns its path.
#[pyfunction]
pub fn write_report(py: Python<'_>, folder: PathBuf) -> PyResult<PathBuf> {
    let written = detached(py, None, |_| write_html(&folder, None, PICTURES, None))?;
    written.map_err(|error| PyOSError::new_err(error.to_string()))
}
