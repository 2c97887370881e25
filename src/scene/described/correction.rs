//! What a `scene.toml` says of data with other conventions: the axes of the poses' cameras, units of length, and how
//! photos are turned.

use image::metadata::Orientation;
use nalgebra::UnitQuaternion;
use serde::Deserialize;

use crate::diagnosis::{OPENGL_AXES, VEHICLE_AXES, other_axes};

/// The rotation from the camera here to that of the poses: `"opengl"`, `"vehicle"`, or what x, y and z of the poses'
/// cameras are.
pub(super) fn axes(text: &str) -> Result<UnitQuaternion<f64>, String> {
    let words = |text: &str| -> Vec<String> {
        let is_between = |c: char| c.is_whitespace() || matches!(c, '(' | ',' | ')');
        text.split(is_between).filter(|word| !word.is_empty()).map(str::to_lowercase).collect()
    };
    let wanted = words(match text {
        "opengl" => OPENGL_AXES,
        "vehicle" => VEHICLE_AXES,
        axes => axes,
    });
    if wanted == ["x", "y", "z"] {
        return Ok(UnitQuaternion::identity());
    }
    let found = other_axes().into_iter().find(|(axes, _)| words(axes) == wanted);
    found.map(|(_, turn)| turn).ok_or_else(|| {
        format!(
            "\"opengl\", \"vehicle\", or three right-handed axes such as \"x -y -z\" expected, what x, y and z of the \
             poses' cameras are if x is right, y down and z forward; `{text}` found"
        )
    })
}

const LENGTH: &str =
    "a unit of length expected: \"m\", \"cm\", \"mm\", \"km\", \"ft\", or its length in metres";

/// A unit of length.
#[derive(Clone, Deserialize)]
#[serde(untagged)]
pub(super) enum Length {
    Name(String),
    Metres(f64),
}

impl Length {
    fn metres(&self) -> Result<f64, String> {
        let metres = match self {
            Self::Metres(metres) => *metres,
            Self::Name(name) => match name.as_str() {
                "m" => 1.0,
                "cm" => 0.01,
                "mm" => 0.001,
                "km" => 1000.0,
                "ft" => 0.3048,
                other => return Err(format!("{LENGTH}; `{other}` found")),
            },
        };
        if (1e-9..=1e9).contains(&metres) {
            Ok(metres)
        } else {
            Err(format!("{LENGTH}; {metres} found"))
        }
    }
}

/// The unit of poses and clouds: one for both, or one of each.
#[derive(Clone, Deserialize)]
#[serde(
    untagged,
    expecting = "a unit of length such as \"mm\" expected, or unit.poses and unit.clouds"
)]
pub(super) enum Units {
    Both(Length),
    Each(UnitOfEach),
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct UnitOfEach {
    poses: Option<Length>,
    clouds: Option<Length>,
}

impl Units {
    /// The lengths of the units of poses and of clouds \[m\].
    pub fn metres(&self) -> Result<[f64; 2], String> {
        let [poses, clouds] = match self {
            Self::Both(both) => [Some(both), Some(both)],
            Self::Each(each) => [each.poses.as_ref(), each.clouds.as_ref()],
        };
        let metres = |unit: Option<&Length>| unit.map_or(Ok(1.0), Length::metres);
        Ok([metres(poses)?, metres(clouds)?])
    }
}

/// How the images in files must be turned.
#[derive(Clone, Deserialize)]
#[serde(untagged, expecting = "90, 180 or 270 (degrees clockwise) or \"mirrored\" expected")]
pub(super) enum Turn {
    Clockwise(i64),
    Name(String),
}

impl Turn {
    pub fn orientation(&self) -> Result<Orientation, String> {
        match self {
            Self::Clockwise(0) => Ok(Orientation::NoTransforms),
            Self::Clockwise(90) => Ok(Orientation::Rotate90),
            Self::Clockwise(180) => Ok(Orientation::Rotate180),
            Self::Clockwise(270) => Ok(Orientation::Rotate270),
            Self::Name(name) if name == "mirrored" => Ok(Orientation::FlipHorizontal),
            Self::Clockwise(other) => Err(Self::expected(other)),
            Self::Name(other) => Err(Self::expected(other)),
        }
    }

    fn expected(found: &dyn std::fmt::Display) -> String {
        format!("0, 90, 180 or 270 (degrees clockwise) or \"mirrored\" expected, `{found}` found")
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn axes_are_those_of_the_poses_cameras_in_any_writing() {
        let opengl = axes("opengl").expect("known");
        assert!((opengl * Vector3::y() + Vector3::y()).norm() < 1e-12);
        for text in ["(x, -y, -z)", "x -y -z", "X,-Y,-Z"] {
            assert!(axes(text).expect("known").angle_to(&opengl) < 1e-12, "{text}");
        }
        assert!(axes("x y z").expect("those here").angle() < 1e-12);
        // Left-handed, incomplete, and no axes.
        for text in ["x y -z", "x -y", "right", ""] {
            assert!(axes(text).expect_err("no axes").contains("such as"), "{text}");
        }
    }
}
