//! What travels: how values are pickled and copied. A frame of a scene travels as its name, a scene as its path, and
//! everything else as its numbers.

use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use posescope_core::Pose;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// What `__reduce__` returns: the function that makes the value again, and its arguments.
pub type Reduced<'py> = (Bound<'py, PyAny>, Bound<'py, PyTuple>);

/// A position and the quaternion x y z w. A matrix would be rounded.
pub type Parts = [f64; 7];

/// The value that a function of `posescope._travel` makes of these.
pub fn by<'py>(
    py: Python<'py>,
    function: &str,
    arguments: impl IntoPyObject<'py, Target = PyTuple, Output = Bound<'py, PyTuple>, Error = PyErr>,
) -> PyResult<Reduced<'py>> {
    let makes = py.import("posescope._travel")?.getattr(function)?;
    Ok((makes, arguments.into_pyobject(py)?))
}

/// The parts of a pose.
pub fn parts(pose: &Pose) -> Parts {
    let (at, turn) = (pose.translation.vector, pose.rotation.coords);
    [at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w]
}

/// The pose of its parts.
pub fn pose([x, y, z, i, j, k, w]: Parts) -> Pose {
    let turn = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
    Pose::from_parts(Translation3::new(x, y, z), turn)
}
