//! The commands: all of them for the program, and some that return what they find.

use std::ffi::OsString;
use std::path::PathBuf;

use posescope::cli;
use posescope::doctor::{Estimate, Examination, Fit, Remark, examine};
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

/// What `posescope doctor` finds: the answer, the measures, remarks, the mistake with its remedy, the text and the
/// picture.
#[pyfunction]
pub fn doctor<'py>(py: Python<'py>, scene: &Scene) -> PyResult<Bound<'py, PyDict>> {
    let format = posescope::scene::format_of(&scene.opened.argument, None);
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
    let answer = match (found.coarse_step_m, found.fit) {
        (None, Some(Fit::Fits)) if finding.is_none() => "fits",
        (None, Some(Fit::Fits | Fit::Unexplained)) => "does not fit",
        _ if finding.is_some() => "does not fit",
        _ => "cannot be judged",
    };
    dict.set_item("answer", answer)?;
    let agreement = found.agreement.map(|one| (one.motions, one.carried.map(f64::tanh), one.edges));
    dict.set_item("agreement", agreement)?;
    let write = finding.as_ref().and_then(|one| one.correction.as_ref());
    dict.set_item("write", write.map(|one| (one.lines.join("\n"), one.place.about())))?;
    let mistake = finding.as_ref().map(|one| (one.mistake.about(), one.remedy.as_str()));
    dict.set_item("mistake", mistake)?;
    dict.set_item("text", cli::examination_in_words(scene, format, &found, None).trim_end())?;
    let picture = picture
        .as_ref()
        .map(|picture| arrays::of_photo(py, &posescope_core::Photo::from_color(picture.clone())));
    dict.set_item("picture", picture.transpose()?)?;
    Ok(dict)
}

/// How far camera and scanner are from where a scene says; the values are `None` where that cannot be judged.
#[pyfunction]
pub fn calibration<'py>(py: Python<'py>, scene: &Scene) -> PyResult<Bound<'py, PyDict>> {
    let scene = scene.opened.scene.as_ref();
    let found = detached(py, None, |_| posescope::doctor::calibration(scene, &|_| ()))?;
    let dict = PyDict::new(py);
    dict.set_item("text", cli::calibration_in_words(scene, &found, None).trim_end())?;
    let Ok(found) = found else {
        dict.set_item("answer", "cannot be judged")?;
        return Ok(dict);
    };
    let answer = match (found.is_off(), found.is_disputed) {
        (true, _) => "off",
        (false, true) => "undecided",
        (false, false) => "consistent",
    };
    dict.set_item("answer", answer)?;
    let interval = |one: &Estimate, unit: f64| (one.value / unit, one.half_width() / unit);
    let each = |of: &[Estimate; 3], unit: f64| of.each_ref().map(|one| interval(one, unit));
    dict.set_item("turn_deg", each(&found.turn, 1.0_f64.to_radians()))?;
    dict.set_item("shift_m", each(&found.shift, 1.0))?;
    dict.set_item("focal_length_percent", interval(&found.focal_length, 0.01))?;
    dict.set_item("delay_s", found.delay.as_ref().map(|delay| interval(delay, 1.0)))?;
    dict.set_item("frames", found.frames)?;
    dict.set_item("edges", found.edges)?;
    dict.set_item("camera_from_stated", arrays::of_pose(py, &found.camera_from_stated())?)?;
    let picture = posescope_core::Photo::from_color(found.picture);
    dict.set_item("picture", arrays::of_photo(py, &picture)?)?;
    Ok(dict)
}

/// Writes `report.html` of a run folder and returns its path.
#[pyfunction]
pub fn write_report(py: Python<'_>, folder: PathBuf) -> PyResult<PathBuf> {
    let written = detached(py, None, |_| write_html(&folder, None, PICTURES, None))?;
    written.map_err(|error| PyOSError::new_err(error.to_string()))
}
