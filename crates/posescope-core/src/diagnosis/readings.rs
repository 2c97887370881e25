//! Other meanings of the numbers of a pose.

use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use super::axes::other_axes;
use crate::geometry::Pose;

/// What the numbers of a pose would mean if a usual mistake was made.
pub(crate) struct Reading {
    /// What it is called.
    pub name: String,
    meant: Meant,
}

enum Meant {
    Inverted,
    Scaled(f64),
    /// Where the numbers w, x, y and z stand among those that were read.
    Reordered([usize; 4]),
    CameraAxes(UnitQuaternion<f64>),
    WorldAxes(UnitQuaternion<f64>),
}

impl Reading {
    fn new(name: impl Into<String>, meant: Meant) -> Self {
        Self { name: name.into(), meant }
    }

    /// All readings, the likeliest mistakes first.
    pub(crate) fn all() -> Vec<Self> {
        let mut all = vec![
            Self::new("camera_from_world (inverted)", Meant::Inverted),
            Self::new("millimetres", Meant::Scaled(1e-3)),
            Self::new("centimetres", Meant::Scaled(1e-2)),
            Self::new("kilometres", Meant::Scaled(1e3)),
            Self::new("quaternions with w first", Meant::Reordered([1, 2, 3, 0])),
            Self::new("quaternions with w last", Meant::Reordered([3, 0, 1, 2])),
        ];
        for (axes, rotation) in other_axes() {
            all.push(Self::new(format!("camera axes {axes}"), Meant::CameraAxes(rotation)));
        }
        for (axes, rotation) in other_axes() {
            all.push(Self::new(format!("world axes {axes}"), Meant::WorldAxes(rotation)));
        }
        all
    }

    /// The pose as it would be.
    pub(crate) fn of(&self, pose: &Pose) -> Pose {
        match self.meant {
            Meant::Inverted => pose.inverse(),
            Meant::Scaled(by) => {
                Pose::from_parts(Translation3::from(pose.translation.vector * by), pose.rotation)
            }
            Meant::Reordered(places) => {
                let Quaternion { coords } = pose.rotation.into_inner();
                let read = [coords.w, coords.x, coords.y, coords.z];
                let [w, x, y, z] = places.map(|place| read[place]);
                let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
                Pose::from_parts(pose.translation, rotation)
            }
            Meant::CameraAxes(rotation) => pose * rotation,
            Meant::WorldAxes(rotation) => rotation * pose,
        }
    }
}
