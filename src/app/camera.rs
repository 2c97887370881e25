//! The trial camera: another pose to try.

use nalgebra::Translation3;

use crate::geometry::{Pose, yaw};

/// A pose that the search knows by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NamedPose {
    /// The reference's pose, where the search starts.
    Start,
    /// The minimum of the coarse positions.
    Coarse,
    /// The minimum of the fine positions.
    Fine,
    /// The estimator's result.
    Estimate,
    /// The ground truth.
    Truth,
    /// Where the camera was before the last jump.
    Last,
}

impl NamedPose {
    /// The name in a note.
    pub fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Coarse => "coarse",
            Self::Fine => "fine",
            Self::Estimate => "estimate",
            Self::Truth => "truth",
            Self::Last => "back",
        }
    }
}

/// A small move of the camera in its own frame, in steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Nudge {
    /// Moves to its right.
    Right(f64),
    /// Moves upwards.
    Up(f64),
    /// Moves ahead.
    Forward(f64),
    /// Turns about its up axis, to the left.
    Yaw(f64),
}

/// One step of a nudge \[m\]: that of the fine grid.
const STEP_M: f64 = 0.2;
/// One step of a turn \[rad\].
const STEP_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;

impl Nudge {
    /// The pose (`world_from_camera`) after the move.
    pub fn apply(self, pose: &Pose) -> Pose {
        let shift = |x, y, z| pose * Translation3::new(STEP_M * x, STEP_M * y, STEP_M * z);
        match self {
            Self::Right(steps) => shift(steps, 0.0, 0.0),
            Self::Up(steps) => shift(0.0, -steps, 0.0),
            Self::Forward(steps) => shift(0.0, 0.0, steps),
            Self::Yaw(steps) => pose * yaw(STEP_RAD * steps),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nudges_go_where_they_say() {
        let pose = Pose::translation(1.0, 2.0, 3.0);
        let right = Nudge::Right(5.0).apply(&pose).translation;
        assert!((right.x - 2.0).abs() < 1e-12);
        let up = Nudge::Up(5.0).apply(&pose).translation;
        assert!((up.y - 1.0).abs() < 1e-12);
        // After a quarter turn to the left, ahead is where left was.
        let turned = Nudge::Yaw(180.0).apply(&pose);
        let ahead = Nudge::Forward(5.0).apply(&turned).translation;
        assert!((ahead.x - 0.0).abs() < 1e-9 && (ahead.z - 3.0).abs() < 1e-9);
    }
}
