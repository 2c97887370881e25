//! The extension module `posescope._posescope` of the Python package.
//!
//! It translates: arrays to photos, clouds and poses, Python's arguments to a [`job::Job`], results to JSON. What
//! people see (`Result`, `Run`, `localize` and the rest) is in `python/posescope` and stands on this module. No
//! algorithm is in either.

mod arrays;
mod camera;
mod command;
mod detached;
mod errors;
mod evaluate;
mod folder;
mod frames;
mod held;
mod job;
mod live;
mod localize;
mod scene;
mod travel;

use pyo3::prelude::*;

/// What the Python package is made of.
#[pymodule]
#[pyo3(name = "_posescope")]
fn extension(module: &Bound<'_, PyModule>) -> PyResult<()> {
    errors::keep_panics_silent();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<camera::Camera>()?;
    module.add_class::<frames::Query>()?;
    module.add_class::<frames::Reference>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<localize::Answer>()?;
    module.add_function(wrap_pyfunction!(camera::camera_of, module)?)?;
    module.add_function(wrap_pyfunction!(camera::restored_camera, module)?)?;
    module.add_function(wrap_pyfunction!(frames::restored_query, module)?)?;
    module.add_function(wrap_pyfunction!(frames::restored_reference, module)?)?;
    module.add_function(wrap_pyfunction!(scene::restored_scene, module)?)?;
    module.add_function(wrap_pyfunction!(localize::localize, module)?)?;
    module.add_function(wrap_pyfunction!(localize::diagnose, module)?)?;
    module.add_function(wrap_pyfunction!(localize::methods, module)?)?;
    module.add_function(wrap_pyfunction!(command::main, module)?)?;
    module.add_function(wrap_pyfunction!(evaluate::evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(command::doctor, module)?)?;
    module.add_function(wrap_pyfunction!(command::calibration, module)?)?;
    module.add_function(wrap_pyfunction!(command::write_report, module)?)?;
    module.add_function(wrap_pyfunction!(detached::panic, module)?)?;
    module.add_function(wrap_pyfunction!(live::check_photo, module)?)?;
    module.add_function(wrap_pyfunction!(live::save_photo, module)?)?;
    module.add_function(wrap_pyfunction!(live::pose_parts, module)?)?;
    module.add_function(wrap_pyfunction!(live::pose_of, module)?)?;
    module.add_function(wrap_pyfunction!(live::reference_parts, module)?)?;
    module.add_function(wrap_pyfunction!(live::check_matches, module)?)?;
    module.add_function(wrap_pyfunction!(live::save_matches, module)?)?;
    module.add_function(wrap_pyfunction!(live::save_cloud, module)?)?;
    module.add_function(wrap_pyfunction!(live::fingerprint, module)?)?;
    module.add_function(wrap_pyfunction!(live::alone, module)?)?;
    module.add_function(wrap_pyfunction!(live::reference_name, module)?)?;
    module.add_function(wrap_pyfunction!(live::nearest, module)?)?;
    module.add_function(wrap_pyfunction!(live::unjudged, module)?)?;
    module.add_function(wrap_pyfunction!(folder::check_judging, module)?)?;
    module.add_function(wrap_pyfunction!(folder::run_text, module)?)?;
    module.add_function(wrap_pyfunction!(folder::summarise, module)?)?;
    module.add_function(wrap_pyfunction!(folder::recording_files, module)?)?;
    module.add_function(wrap_pyfunction!(folder::exported, module)?)?;
    module.add_function(wrap_pyfunction!(folder::query_facts, module)?)?;
    Ok(())
}
