//! What is known of a pose before anything is seen of it.
//!
//! Between two conditions the best of thousands of wrong poses often costs less than the right one, and it is
//! mostly one that no vehicle takes: turned to the end of what is searched, lifted, tilted. A camera that
//! stands on one is about as high and as level as the reference's, and looks about the same way. That is
//! a weak belief, and is worth little: what it takes off never exceeds a few standard deviations of the coarse
//! costs, where minima of one condition are tens of them deep.

use nalgebra::Vector3;

use super::{ManyStarts, SixParams, Spread};
use crate::geometry::Pose;
use crate::grid::Offset;

impl ManyStarts {
    /// What a pose and its cost are worth: the cost, and more for a pose that is less likely, by the
    /// standard deviation of the coarse costs.
    pub(in crate::estimator) fn price(&self, spread: &Spread, pose: &Pose, cost: f64) -> f64 {
        cost + spread.deviation() * unlikeliness(&self.params, pose)
    }
}

/// How unlikely a pose `reference_from_camera` is, in standard deviations of the coarse costs: the squares
/// of its heading, height and tilt over what is usual for each, together no more than the most.
fn unlikeliness(params: &SixParams, pose: &Pose) -> f64 {
    let yaw_deg = Offset::of(pose).yaw_rad.to_degrees();
    let down = pose.rotation * Vector3::y();
    let tilt_deg = down.y.clamp(-1.0, 1.0).acos().to_degrees();
    let over = |value: f64, usual: f64| (value / usual).powi(2);
    let sum = over(yaw_deg, params.usual_yaw_deg)
        + over(pose.translation.y, params.usual_height_m)
        + over(tilt_deg, params.usual_tilt_deg);
    sum.min(params.unlikely)
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::judge::{Refined, Start};
    use crate::params::Params;

    #[test]
    fn a_level_pose_that_looks_the_same_way_is_likely_wherever_it_stands() {
        let params = SixParams::default();
        let there = Pose::translation(3.0, 0.0, -7.0);
        assert_eq!(unlikeliness(&params, &there), 0.0);
    }

    #[test]
    fn heading_height_and_tilt_count_by_what_is_usual_and_never_more_than_the_most() {
        let params = SixParams::default();
        let turned = |axis: Vector3<f64>, deg: f64| {
            let rotation = UnitQuaternion::from_scaled_axis(axis * deg.to_radians());
            unlikeliness(&params, &Pose::from_parts(Vector3::zeros().into(), rotation))
        };
        let is_one = |value: f64| (value - 1.0).abs() < 1e-9;
        assert!(is_one(turned(Vector3::y(), params.usual_yaw_deg)));
        assert!(is_one(turned(Vector3::x(), -params.usual_tilt_deg)));
        assert!(is_one(turned(Vector3::z(), params.usual_tilt_deg)));
        let lifted = Pose::translation(0.0, -params.usual_height_m, 0.0);
        assert!(is_one(unlikeliness(&params, &lifted)));
        assert_eq!(turned(Vector3::x(), 60.0), params.unlikely);
    }

    #[test]
    fn of_refined_poses_the_likelier_comes_first_where_the_other_is_hardly_cheaper() {
        let six = ManyStarts::new(&Params::default());
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
            six.apart(both, 2, |pose, cost| six.price(&spread, pose, cost))[0].pose
        };
        assert_eq!(first(0.895), Pose::identity());
        assert_eq!(first(0.885), lifted);
    }

    #[test]
    fn nothing_is_unlikely_where_the_most_is_nothing() {
        let params = SixParams { unlikely: 0.0, ..SixParams::default() };
        assert_eq!(unlikeliness(&params, &Pose::translation(0.0, 5.0, 0.0)), 0.0);
    }
}
