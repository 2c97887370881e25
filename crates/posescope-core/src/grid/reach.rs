//! For posescope's own crates: may change in any version.
//!
//! What a search with three freedoms reaches of the ways that a map's cameras differ.

use serde::{Deserialize, Serialize};

use super::{GridParams, Offset};
use crate::diagnosis::Tolerance;
use crate::geometry::{Pose, PoseError};
use crate::scale::Scale;

/// Cameras from which the others are looked at, evenly spaced. More tell nothing new.
const MOST_FROM: usize = 200;

/// Cameras that are turned farther against each other share no view, so nobody looks for one from the other.
const MOST_TURNED_DEG: f64 = 45.0;

/// Of the pairs of a map's cameras that are within a search's radius of each other and look the same way, the share that a
/// search with the [three freedoms of the grid](super) can find.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reach {
    /// Those whose height, pitch and roll are so much alike that a pose that keeps these is near.
    pub level: f64,
    /// Those of them whose heading is within the range of a default search, too.
    pub ahead: f64,
}

impl Reach {
    /// That of cameras that move as a grid does.
    pub const ALL: Self = Self { level: 1.0, ahead: 1.0 };

    /// That of these cameras, where a pose within a tolerance of the truth is near, and things are at a typical depth
    /// \[m\]. All, where there are no such pairs.
    ///
    /// A tilt that a search cannot follow moves what it sees, so the search moves the camera: by up to the tilt times the
    /// depth.
    pub fn among(world_from_camera: &[Pose], radius_m: f64, near: Tolerance, depth_m: f64) -> Self {
        let range_deg = GridParams::default().yaw_range_deg;
        let step = world_from_camera.len().div_ceil(MOST_FROM).max(1);
        let (mut pairs, mut level, mut ahead) = (0_usize, 0_usize, 0_usize);
        for (number, from) in world_from_camera.iter().enumerate().step_by(step) {
            let others = world_from_camera.iter().enumerate().filter(|(other, _)| *other != number);
            for reference_from_camera in others.map(|(_, to)| from.inverse() * to) {
                let offset = Offset::of(&reference_from_camera);
                let turned = reference_from_camera.rotation.angle().to_degrees();
                if offset.distance_m() > radius_m || turned > MOST_TURNED_DEG {
                    continue;
                }
                let kept =
                    PoseError::between(&offset.reference_from_camera(), &reference_from_camera);
                let moved_m = kept.translation_m + kept.rotation_deg.to_radians() * depth_m;
                let is_level =
                    moved_m <= near.translation_m && kept.rotation_deg <= near.rotation_deg;
                let is_ahead = offset.yaw_rad.to_degrees().abs() <= range_deg;
                pairs += 1;
                level += usize::from(is_level);
                ahead += usize::from(is_level && is_ahead);
            }
        }
        let share = |of: usize| match pairs {
            0 => 1.0,
            // The mean of what is likely of the share, if all shares were likely (Jeffreys); as people read it.
            _ => (100.0 * (of as f64 + 0.5) / (pairs as f64 + 1.0)).round() / 100.0,
        };
        Self { level: share(level), ahead: share(ahead) }
    }

    /// The share for a search at a scale. One that turns farther than by default loses nothing by its range, and in streets
    /// cameras turn as in those that probabilities were fitted to.
    pub fn of(&self, grid: &GridParams, scale: Scale) -> f64 {
        let turns_farther = grid.yaw_range_deg > GridParams::default().yaw_range_deg;
        if turns_farther || scale.is_paper() { self.level } else { self.ahead }
    }

    /// Whether its numbers can be used.
    pub fn is_sound(&self) -> bool {
        (0.0..=1.0).contains(&self.level) && (0.0..=self.level).contains(&self.ahead)
    }
}

impl Default for Reach {
    fn default() -> Self {
        Self::ALL
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion, Vector3};

    use super::*;
    use crate::geometry::yaw;

    const NEAR: Tolerance = Tolerance { translation_m: 1.0, rotation_deg: 5.0 };

    fn among(cameras: &[Pose]) -> Reach {
        Reach::among(cameras, 15.0, NEAR, 10.0)
    }

    /// A drive that goes ahead, one metre a frame.
    fn drive(
        turn: impl Fn(f64) -> UnitQuaternion<f64>,
        height_m: impl Fn(f64) -> f64,
    ) -> Vec<Pose> {
        let at = |number: usize| {
            let z = number as f64;
            Pose::from_parts(Translation3::new(0.0, height_m(z), z), turn(z))
        };
        (0..40).map(at).collect()
    }

    fn pitch(deg: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), deg.to_radians())
    }

    #[test]
    fn a_car_moves_as_the_grid_does_and_a_hand_does_not() {
        let swaying = |z: f64| pitch((0.8 * z).sin());
        assert_eq!(among(&drive(swaying, |z| 0.02 * (3.0 * z).sin())), Reach::ALL);
        // Every second photo is tilted, so half of the pairs differ. Of the others those of two tilted photos are level where
        // they are near: the way from one to the other is not along the tilted view.
        let hand = among(&drive(|z| pitch(if z % 2.0 == 0.0 { 0.0 } else { 8.0 }), |_| 0.0));
        assert!((0.3..0.5).contains(&hand.level) && hand.ahead == hand.level, "{hand:?}");
        // A tilt below that of a near pose still moves a near pose away: 4° are 0.7 m at 10 m, 1.4 m at 20 m.
        let tilted = drive(|z| pitch(if z % 2.0 == 0.0 { 0.0 } else { 4.0 }), |_| 0.0);
        let [near, deep] = [10.0, 20.0].map(|depth_m| Reach::among(&tilted, 4.0, NEAR, depth_m));
        assert_eq!(near, Reach::ALL);
        assert!(deep.level < 0.6, "{deep:?}");
        // And so does height.
        let lifted = among(&drive(|_| pitch(0.0), |z| if z % 2.0 == 0.0 { 0.0 } else { 1.2 }));
        assert!(lifted.level < 0.6, "{lifted:?}");
    }

    #[test]
    fn headings_beyond_the_range_are_reached_by_a_search_that_turns_farther() {
        // On a circle, frames that are 15 m apart have turned by 30°.
        let round = among(&drive(|z| yaw((2.0 * z).to_radians()), |_| 0.0));
        assert!(round.level == 1.0 && round.ahead < 0.5, "{round:?}");
        let usual = GridParams::default();
        let wide = GridParams { yaw_range_deg: 45.0, ..usual.clone() };
        let room = Scale::of_depth(1.8, true);
        assert_eq!([round.of(&usual, room), round.of(&wide, room)], [round.ahead, 1.0]);
        assert_eq!(round.of(&usual, Scale::PAPER), 1.0);
    }

    #[test]
    fn lone_cameras_say_nothing_and_few_say_little() {
        let far = Pose::translation(0.0, 0.0, 100.0);
        assert_eq!(among(&[]), Reach::ALL);
        assert_eq!(among(&[Pose::identity(), far]), Reach::ALL);
        let back = Pose::from_parts(Translation3::identity(), yaw(3.0));
        assert_eq!(among(&[Pose::identity(), back]), Reach::ALL);
        let tilted = Pose::from_parts(Translation3::identity(), pitch(20.0));
        // Two ways between them, and neither is level.
        assert_eq!(among(&[Pose::identity(), tilted]).level, 0.17);
    }

    #[test]
    fn shares_are_shares() {
        assert!(Reach::ALL.is_sound() && Reach { level: 0.4, ahead: 0.0 }.is_sound());
        let [more_ahead, more_than_all] = [[0.4, 0.5], [1.1, 0.5]];
        for [level, ahead] in [more_ahead, more_than_all, [f64::NAN, 0.0]] {
            assert!(!Reach { level, ahead }.is_sound(), "{level} {ahead}");
        }
    }
}
