//! What is known of a pose before anything is seen of it.
//!
//! Between two conditions the best of thousands of wrong poses often costs less than the right one, and it is
//! mostly one that no vehicle takes: turned to the end of what is searched, lifted, tilted. A camera that
//! stands on one is about as high and as level as the reference's, and looks about the same way, or has turned with
//! the bend that leads from one to the other. That is a weak belief, and is worth little: what it takes off never
//! exceeds a few standard deviations of the coarse costs, where minima of one condition are tens of them deep.

use nalgebra::Vector3;

use super::{MultiStart, MultiStartParams, Spread};
use crate::geometry::Pose;
use crate::grid::Offset;

impl MultiStart {
    /// The maximum-a-posteriori cost of a pose: its cost and the prior penalty, in standard deviations of the coarse
    /// costs.
    pub(in crate::estimator) fn map_cost(&self, spread: &Spread, pose: &Pose, cost: f64) -> f64 {
        cost + spread.deviation() * self.prior_penalty(pose)
    }

    /// Whether a pose is not as unlikely as can be.
    pub(super) fn is_plausible(&self, pose: &Pose) -> bool {
        self.params.unlikely == 0.0 || self.prior_penalty(pose) < self.params.unlikely
    }

    fn prior_penalty(&self, pose: &Pose) -> f64 {
        prior_penalty(&self.params, self.scale.length(MIN_BEND_M), pose)
    }
}

/// The turn of a bend whose penalty is one standard deviation of the coarse costs: most roads are straight.
const USUAL_BEND_DEG: f64 = 22.0;

/// The tightest bend that a vehicle takes: its radius \[m\], at the paper's scale.
const MIN_BEND_M: f64 = 5.0;

/// The penalty of a pose `reference_from_camera` under the prior, in standard deviations of the coarse costs: the squares
/// of its heading, height and tilt over what is usual for each, together no more than the most. A heading may be off the
/// reference's, or off what the bend from there turns.
fn prior_penalty(params: &MultiStartParams, min_bend_m: f64, pose: &Pose) -> f64 {
    let offset = Offset::of(pose);
    let bend_rad = bend(&offset, min_bend_m);
    let [yaw_deg, bend_deg, off_bend_deg] =
        [offset.yaw_rad, bend_rad, offset.yaw_rad - bend_rad].map(f64::to_degrees);
    let down = pose.rotation * Vector3::y();
    let tilt_deg = down.y.clamp(-1.0, 1.0).acos().to_degrees();
    let over = |value: f64, usual: f64| (value / usual).powi(2);
    let straight = over(yaw_deg, params.usual_yaw_deg);
    let bent = over(bend_deg, USUAL_BEND_DEG) + over(off_bend_deg, params.usual_yaw_deg);
    let sum = straight.min(bent)
        + over(pose.translation.y, params.usual_height_m)
        + over(tilt_deg, params.usual_tilt_deg);
    sum.min(params.unlikely)
}

/// The turn \[rad\] of a bend that leads from the reference, in its heading, to a place: twice the angle at which
/// the place is seen, and not more than the tightest bend turns on the way.
fn bend(offset: &Offset, min_bend_m: f64) -> f64 {
    let seen_at = -(offset.right_m / offset.forward_m).atan();
    let most = 2.0 * (0.5 * offset.distance_m() / min_bend_m).min(1.0).asin();
    // At the reference itself no angle is known, and no turn is possible.
    if seen_at.is_nan() { 0.0 } else { (2.0 * seen_at).clamp(-most, most) }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::params::Params;
    use crate::search::{Refined, Start};

    #[test]
    fn a_level_pose_that_looks_the_same_way_is_likely_wherever_it_stands() {
        let params = MultiStartParams::default();
        let there = Pose::translation(3.0, 0.0, -7.0);
        assert_eq!(prior_penalty(&params, MIN_BEND_M, &there), 0.0);
    }

    #[test]
    fn a_turn_along_a_bend_is_likelier_than_one_the_other_way_or_on_the_spot() {
        let params = MultiStartParams::default();
        let on_bend = |radius_m: f64, turn: f64, yaw_rad: f64| {
            let [right_m, forward_m] = [radius_m * (1.0 - turn.cos()), radius_m * turn.sin()];
            let pose = Offset { right_m, forward_m, yaw_rad }.reference_from_camera();
            prior_penalty(&params, MIN_BEND_M, &pose)
        };
        let usual = USUAL_BEND_DEG.to_radians();
        // Ahead to the right, and, before the bend, behind to the right.
        for turn in [usual, -usual] {
            assert!((on_bend(8.0, turn, -turn) - 1.0).abs() < 1e-9, "{turn}");
            assert_eq!(on_bend(8.0, turn, turn), params.unlikely, "{turn}");
            assert!(on_bend(0.5, turn, -turn) > 3.0, "no vehicle turns so tightly");
        }
        assert_eq!(on_bend(0.0, 0.0, usual), params.unlikely);
    }

    #[test]
    fn heading_height_and_tilt_count_by_what_is_usual_and_never_more_than_the_most() {
        let params = MultiStartParams::default();
        let turned = |axis: Vector3<f64>, deg: f64| {
            let rotation = UnitQuaternion::from_scaled_axis(axis * deg.to_radians());
            prior_penalty(&params, MIN_BEND_M, &Pose::from_parts(Vector3::zeros().into(), rotation))
        };
        let is_one = |value: f64| (value - 1.0).abs() < 1e-9;
        assert!(is_one(turned(Vector3::y(), params.usual_yaw_deg)));
        assert!(is_one(turned(Vector3::x(), -params.usual_tilt_deg)));
        assert!(is_one(turned(Vector3::z(), params.usual_tilt_deg)));
        let lifted = Pose::translation(0.0, -params.usual_height_m, 0.0);
        assert!(is_one(prior_penalty(&params, MIN_BEND_M, &lifted)));
        assert_eq!(turned(Vector3::x(), 60.0), params.unlikely);
    }

    #[test]
    fn of_refined_poses_the_likelier_comes_first_where_the_other_is_hardly_cheaper() {
        let six = MultiStart::new(&Params::default());
        let spread = Spread { median: 1.0, deviation: 0.01 };
        let lifted = Pose::translation(5.0, -six.params.usual_height_m, 0.0);
        let refined = |pose: Pose, cost: f64| Refined {
            start: Start { pose, cost },
            pose,
            cost,
            evaluations: 1,
        };
        let first = |cost_of_lifted: f64| {
            let both = vec![refined(lifted, cost_of_lifted), refined(Pose::identity(), 0.9)];
            six.apart(both, 2, |pose, cost| six.map_cost(&spread, pose, cost))[0].pose
        };
        assert_eq!(first(0.895), Pose::identity());
        assert_eq!(first(0.885), lifted);
    }

    #[test]
    fn nothing_is_unlikely_where_the_most_is_nothing() {
        let params = MultiStartParams { unlikely: 0.0, ..MultiStartParams::default() };
        assert_eq!(prior_penalty(&params, MIN_BEND_M, &Pose::translation(0.0, 5.0, 0.0)), 0.0);
    }
}
