//! The coarse-to-fine search grid of the direct methods (paper, appendix B, "coarse-to-fine grid
//! search").
//!
//! The grid is centred on the reference camera and uses its axes: right (x) and forward (z), then
//! yaw about its up axis (−y). Height, pitch and roll stay the reference's.

mod basin;
mod dense;
mod lattice;
mod reach;
mod scan;
mod scored;
mod settle;

pub use lattice::{Lattice, LatticeTooLarge, MAX_CELLS};
pub use scan::{Scored, scan};
pub use scored::ScoredLattice;

#[doc(hidden)]
pub use basin::Basin;
#[doc(hidden)]
pub use dense::DenseSurface;
#[doc(hidden)]
pub use reach::Reach;

pub use crate::render::Score;

use nalgebra::{Translation3, Vector3};
use serde::{Serialize, Serializer};

use crate::describe::parameters;
use crate::geometry::{Pose, yaw};

parameters! {
    /// Steps and ranges of the search. The range of positions is the problem's uncertainty radius.
    #[derive(Clone, Debug, PartialEq)]
    pub struct GridParams {
        /// Step of the coarse positions.
        pub coarse_step_m: f64 = 1.0 => number("coarse_step", "m", 1e-6..=1e4),
        /// Half width of the square of fine positions.
        pub fine_range_m: f64 = 1.0 => number("fine_range", "m", 0.0..=1e4),
        /// Step of the fine positions.
        pub fine_step_m: f64 = 0.2 => number("fine_step", "m", 1e-6..=1e4),
        /// Half range of the coarse yaw angles.
        pub yaw_range_deg: f64 = 10.0 => number("yaw_range", "°", 0.0..=180.0),
        /// Step of the coarse yaw angles.
        pub yaw_step_deg: f64 = 1.0 => number("yaw_step", "°", 0.05..=45.0),
        /// Half range of the fine yaw angles.
        pub yaw_fine_range_deg: f64 = 1.0 => number("yaw_fine_range", "°", 0.0..=45.0),
        /// Step of the fine yaw angles.
        pub yaw_fine_step_deg: f64 = 0.1 => number("yaw_fine_step", "°", 0.01..=10.0),
        /// Rounds of searching position, then yaw; the paper has one.
        pub rounds: usize = 1 => count("rounds", "", 1..=10),
        /// Least coverage of an eligible hypothesis, as a share of the pixels covered at the
        /// reference pose.
        ///
        /// Fewer pixels make lower costs: without a floor both costs have their global minimum where
        /// less than 1 % is covered. At 0.15 and above the right basin is cut off when the query is
        /// 8 to 10 m ahead.
        pub coverage_floor: f64 = 0.05 => number("coverage_floor", "", 0.0..=1.0),
    }
}

parameters! {
    /// The dense grid of costs that a picture shows: every position with every heading.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SurfaceParams {
        /// Step of the positions within the uncertainty radius.
        pub step_m: f64 = 0.1 => number("step", "m", 1e-6..=1e4),
        /// Step of the headings within `grid.yaw_range`.
        pub yaw_step_deg: f64 = 0.5 => number("yaw_step", "°", 0.01..=90.0),
    }
}

impl GridParams {
    /// Whether an offset lies where the grid of a search within `radius_m` ends, in position or yaw: its
    /// basin may go on outside.
    pub fn is_on_rim(&self, offset: &Offset, radius_m: f64) -> bool {
        let yaw_deg = offset.yaw_rad.to_degrees().abs();
        self.is_on_edge(offset, radius_m) || yaw_deg > self.yaw_range_deg - 0.5 * self.yaw_step_deg
    }

    /// Whether an offset lies where the coarse positions within `radius_m` end.
    pub fn is_on_edge(&self, offset: &Offset, radius_m: f64) -> bool {
        offset.distance_m() > radius_m - 0.5 * self.coarse_step_m
    }
}

/// Pixels that an eligible hypothesis covers at least, for a coverage floor as in
/// [`GridParams::coverage_floor`].
pub fn least_covered(coverage_floor: f64, covered_at_reference: u32) -> u32 {
    (coverage_floor * f64::from(covered_at_reference)).ceil() as u32
}

/// Where a camera is, seen from the reference camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Offset {
    /// To the reference camera's right \[m\].
    pub right_m: f64,
    /// To its front \[m\].
    pub forward_m: f64,
    /// About its up axis, positive to the left \[rad\]; written as data in degrees.
    #[serde(rename = "yaw_deg", serialize_with = "in_degrees")]
    pub yaw_rad: f64,
}

fn in_degrees<S: Serializer>(angle_rad: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_f64(angle_rad.to_degrees())
}

impl Offset {
    /// The offset of a camera `reference_from_camera`. What no offset has is left out: height, pitch
    /// and roll.
    pub fn of(reference_from_camera: &Pose) -> Self {
        let centre = &reference_from_camera.translation;
        let ahead = reference_from_camera.rotation * Vector3::z();
        Self { right_m: centre.x, forward_m: centre.z, yaw_rad: (-ahead.x).atan2(ahead.z) }
    }

    /// Distance from the reference camera \[m\].
    pub fn distance_m(&self) -> f64 {
        self.right_m.hypot(self.forward_m)
    }

    /// Distance from the position of another offset \[m\].
    pub fn distance_from(&self, other: &Self) -> f64 {
        (self.right_m - other.right_m).hypot(self.forward_m - other.forward_m)
    }

    /// The camera's pose in the reference camera's frame.
    pub fn reference_from_camera(&self) -> Pose {
        Pose::from_parts(
            Translation3::from(Vector3::new(self.right_m, 0.0, self.forward_m)),
            yaw(self.yaw_rad),
        )
    }
}

impl Serialize for Phase {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// The four parts of one round of the search, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Phase {
    /// All positions within the uncertainty radius.
    PositionCoarse,
    /// Positions around the coarse minimum.
    PositionFine,
    /// Yaw angles at the fine position.
    YawCoarse,
    /// Yaw angles around the coarse yaw.
    YawFine,
}

impl Phase {
    /// The order of the search.
    pub const ALL: [Self; 4] =
        [Self::PositionCoarse, Self::PositionFine, Self::YawCoarse, Self::YawFine];

    /// Whether this phase turns the camera rather than moves it.
    pub fn is_yaw(self) -> bool {
        matches!(self, Self::YawCoarse | Self::YawFine)
    }

    /// What makes its lattice smaller.
    fn remedy(self) -> &'static str {
        match self {
            Self::PositionCoarse => "Raise grid.coarse_step or lower the radius",
            Self::PositionFine => "Raise grid.fine_step or lower grid.fine_range",
            Self::YawCoarse => "Raise grid.yaw_step or lower grid.yaw_range",
            Self::YawFine => "Raise grid.yaw_fine_step or lower grid.yaw_fine_range",
        }
    }

    /// The name that people read.
    pub fn name(self) -> &'static str {
        match self {
            Self::PositionCoarse => "position, coarse",
            Self::PositionFine => "position, fine",
            Self::YawCoarse => "yaw, coarse",
            Self::YawFine => "yaw, fine",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    #[test]
    fn the_rim_is_the_last_step_of_positions_and_of_yaws() {
        let params = GridParams::default();
        let is_on_rim = |right_m, yaw_deg: f64| {
            let offset = Offset { right_m, forward_m: 0.0, yaw_rad: yaw_deg.to_radians() };
            params.is_on_rim(&offset, 10.0)
        };
        assert!(is_on_rim(-9.6, 0.0) && is_on_rim(0.0, 9.8));
        assert!(!is_on_rim(9.4, 0.0) && !is_on_rim(0.0, -9.4));
    }

    #[test]
    fn a_camera_ahead_sees_a_point_nearer_and_one_turned_left_sees_it_to_the_right() {
        let point = Point3::new(0.0, 0.0, 10.0);
        let camera = |offset: Offset| offset.reference_from_camera().inverse() * point;
        let ahead = camera(Offset { forward_m: 4.0, ..Default::default() });
        assert!((ahead.z - 6.0).abs() < 1e-12);
        let left = camera(Offset { yaw_rad: 0.1, ..Default::default() });
        assert!(left.x > 0.0);
    }

    proptest! {
        #[test]
        fn an_offset_is_read_back_from_its_pose(
            right_m in -50.0..50.0, forward_m in -50.0..50.0, yaw_rad in -3.0..3.0,
        ) {
            let offset = Offset { right_m, forward_m, yaw_rad };
            let read = Offset::of(&offset.reference_from_camera());
            prop_assert!((read.right_m - right_m).abs() < 1e-9);
            prop_assert!((read.forward_m - forward_m).abs() < 1e-9);
            prop_assert!((read.yaw_rad - yaw_rad).abs() < 1e-9);
        }
    }
}
