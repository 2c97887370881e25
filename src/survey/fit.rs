//! What a map's own frames show: two numbers that move the odds of a pose, and how many times wider intervals are.

use nalgebra::{Matrix2, Vector2};
use posescope_core::survey::{Surveyed, log_odds};

/// A pose of the map's own frames: the stated probability, and the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Judged {
    /// The probability of being near, as it was fitted.
    pub probability: f64,
    pub is_right: bool,
    /// Errors of position and rotation over those that hold 95 %, as they were fitted; of a pose that is right.
    pub over_95: Option<[f64; 2]>,
}

/// Fewer poses say nothing.
const LEAST: usize = 10;
/// Nor do fewer poses that are right.
const LEAST_RIGHT: usize = 5;

/// The numbers of a method; `None` where there are too few poses.
///
/// At the scale at which confidence was fitted, it is the starting point, and the map must speak against it. At
/// another scale it is a weaker one.
pub(super) fn fitted(poses: &[Judged], is_paper: bool) -> Option<Surveyed> {
    let right = poses.iter().filter(|pose| pose.is_right).count();
    let are_enough = poses.len() >= LEAST && right >= LEAST_RIGHT;
    are_enough.then(|| numbers(poses, is_paper))
}

/// The numbers of a method, however few its poses are.
pub(super) fn numbers(poses: &[Judged], is_paper: bool) -> Surveyed {
    let (shift, slope) = moved_odds(poses, is_paper);
    let factor = |axis: usize| {
        let errors = poses.iter().filter_map(|pose| Some(pose.over_95?[axis]));
        upper(errors.collect())
    };
    Surveyed { shift, slope, position: factor(0), rotation: factor(1) }
}

/// Shift and slope of the logarithm of the odds that are most likely, with normal priors around 0 and 1.
fn moved_odds(poses: &[Judged], is_paper: bool) -> (f64, f64) {
    /// Standard deviations of the priors of shift and slope.
    const PRIORS: [[f64; 2]; 2] = [[3.0, 1.0], [1.0, 0.25]];
    /// The least slope: more evidence never speaks against a pose.
    const LEAST_SLOPE: f64 = 0.05;
    const STEPS: usize = 50;
    let [of_shift, of_slope] = PRIORS[usize::from(is_paper)];
    let prior = Matrix2::from_diagonal(&Vector2::new(of_shift.powi(-2), of_slope.powi(-2)));
    let start = Vector2::new(0.0, 1.0);
    let mut numbers = start;
    for _ in 0..STEPS {
        let mut gradient = prior * (numbers - start);
        let mut curvature = prior;
        for pose in poses {
            let values = Vector2::new(1.0, log_odds(pose.probability));
            let probability = 1.0 / (1.0 + (-numbers.dot(&values)).exp());
            gradient += values * (probability - f64::from(u8::from(pose.is_right)));
            curvature += values * values.transpose() * (probability * (1.0 - probability));
        }
        // The prior keeps the curvature positive.
        let step =
            curvature.try_inverse().map_or_else(Vector2::zeros, |inverse| inverse * gradient);
        // Far from the best numbers, whole steps may leave it on the other side.
        numbers -= step * (1.0 / step.norm()).min(1.0);
        if step.norm() < 1e-10 {
            break;
        }
    }
    (rounded(numbers.x), rounded(numbers.y.max(LEAST_SLOPE)))
}

/// What 95 % of such errors are below, as long as there are enough to say so; with fewer, the greatest.
fn upper(mut errors: Vec<f64>) -> f64 {
    const SHARE: f64 = 0.95;
    const RANGE: std::ops::RangeInclusive<f64> = 0.1..=1000.0;
    errors.retain(|error| error.is_finite());
    errors.sort_by(f64::total_cmp);
    if errors.len() < LEAST_RIGHT {
        return 1.0;
    }
    // One more error, not seen yet, is as likely at any rank (split conformal prediction).
    let rank = (SHARE * (errors.len() + 1) as f64).ceil() as usize;
    let error = errors[rank.min(errors.len()) - 1];
    rounded(error.clamp(*RANGE.start(), *RANGE.end()))
}

/// A number as people read it.
fn rounded(number: f64) -> f64 {
    (number * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64;

    use super::*;

    /// Poses whose odds are moved by these numbers, in a world where errors are three times as great.
    fn poses(count: usize, shift: f64, slope: f64) -> Vec<Judged> {
        let mut rng = Pcg64::seed_from_u64(7);
        let pose = |_| {
            let probability: f64 = rng.random_range(0.02..0.98);
            let truth = 1.0 / (1.0 + (-shift - slope * log_odds(probability)).exp());
            let is_right = rng.random::<f64>() < truth;
            let error: f64 = 3.0 * rng.random::<f64>() / 0.95;
            Judged { probability, is_right, over_95: is_right.then_some([error, 1.0]) }
        };
        (0..count).map(pose).collect()
    }

    #[test]
    fn numbers_that_moved_the_odds_are_found() {
        for (shift, slope) in [(-1.0, 0.6), (0.0, 1.0), (0.8, 1.4)] {
            let found = fitted(&poses(4000, shift, slope), false).expect("enough");
            assert!((found.shift - shift).abs() < 0.15, "{shift}: {found:?}");
            assert!((found.slope - slope).abs() < 0.15, "{slope}: {found:?}");
            assert!((found.position - 3.0).abs() < 0.1, "{found:?}");
            assert_eq!(found.rotation, 1.0);
        }
    }

    #[test]
    fn few_poses_move_little_and_fewer_say_nothing() {
        let twenty = fitted(&poses(20, 0.0, 1.0), true).expect("enough");
        assert!(twenty.shift.abs() < 0.8 && (twenty.slope - 1.0).abs() < 0.4, "{twenty:?}");
        assert_eq!(fitted(&poses(9, 0.0, 1.0), false), None);
        let wrong = Judged { probability: 0.9, is_right: false, over_95: None };
        assert_eq!(fitted(&[wrong; 40], false), None);
    }

    #[test]
    fn a_map_where_all_is_well_is_trusted_more_and_one_of_wrong_poses_less() {
        let pose = |is_right| Judged { probability: 0.9, is_right, over_95: None };
        let well = fitted(&[pose(true); 60], false).expect("enough");
        assert!(well.probability(0.9) > 0.95, "{well:?}");
        let mut ill = vec![pose(false); 55];
        ill.extend([pose(true); 5]);
        let ill = fitted(&ill, false).expect("enough");
        assert!(ill.probability(0.9) < 0.3, "{ill:?}");
        // The odds still grow with the evidence.
        assert!(ill.slope > 0.0 && well.slope > 0.0);
    }

    #[test]
    fn an_interval_holds_one_more_error_in_95_of_100_cases() {
        let mut rng = Pcg64::seed_from_u64(1);
        for count in [19, 40, 200] {
            let mut held = 0;
            for _ in 0..2000 {
                let errors: Vec<f64> = (0..count).map(|_| rng.random()).collect();
                held += usize::from(rng.random::<f64>() <= upper(errors));
            }
            assert!((1870..=1960).contains(&held), "{count}: {held}");
        }
    }
}
