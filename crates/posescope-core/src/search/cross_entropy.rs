//! From a start to the deep minimum near it, by samples that gather.
//!
//! Where the photos differ, the cost is rough along its valleys, and steps along the axes stop at the first dent. Here
//! poses are drawn around the start, and the next ones where the cheapest of these lie: the cross-entropy method
//! (Rubinstein, *The Cross-Entropy Method for Combinatorial and Continuous Optimization*, 1999).

use nalgebra::{Matrix6, Vector6};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use super::pattern::{Refined, moved_in_place};
use crate::geometry::Pose;
use crate::render::MAX_AT_A_TIME;

/// How the cross-entropy method draws its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossEntropy {
    /// The standard deviation of the first samples, to the right and forward \[m\].
    pub first_m: f64,
    /// Radians that count as a metre.
    pub rad_per_m: f64,
    /// Walks that are never given up.
    pub fewest: usize,
    /// Decides which samples are drawn.
    pub seed: u64,
}

/// Times that samples are drawn.
const ROUNDS: i32 = 4;

/// Samples of each walk and round.
const SAMPLES: usize = 64;

/// The cheapest samples, which say where the next are drawn.
const ELITE: usize = 12;

/// Standard deviations of the first samples to the right, down and forward, and about these axes, as shares of
/// [`CrossEntropy::first_m`]: a vehicle moves and turns in the plane more than it lifts or tilts.
const WIDTHS: [f64; 6] = [1.0, 0.3, 1.0, 0.3, 0.5, 0.3];

/// Share of the covariance that the elite decides. The rest keeps samples from gathering in a dent too soon: it is the
/// covariance of the first samples, which shrinks by [`SHRINKING`] squared each round.
const WEIGHT_OF_ELITE: f64 = 0.7;

/// By how much the least width of the samples shrinks in a round.
const SHRINKING: f64 = 0.6;

/// The distribution of the samples of one walk, as steps from where it began.
struct Samples {
    origin: Pose,
    mean: Vector6<f64>,
    /// The lower Cholesky factor of the covariance.
    factor: Matrix6<f64>,
}

/// Moves each walk to the cheapest of the samples around it, where one costs less. After each round, the half whose poses
/// rank behind stays where it is. All walks draw the same samples. `costs_of` is as for
/// [`pattern_search`](super::pattern_search()).
///
/// # Errors
/// Those of `costs_of`.
pub fn cross_entropy<E>(
    walks: &mut [Refined],
    plan: &CrossEntropy,
    rank: impl Fn(&Pose, f64) -> f64,
    mut costs_of: impl FnMut(&[Pose]) -> Result<Vec<Option<f64>>, E>,
) -> Result<(), E> {
    let first = Vector6::from_fn(|axis, _| {
        plan.first_m * WIDTHS[axis] * if axis < 3 { 1.0 } else { plan.rad_per_m }
    });
    let cloud = |walk: &Refined| Samples {
        origin: walk.pose,
        mean: Vector6::zeros(),
        factor: Matrix6::from_diagonal(&first),
    };
    let mut active: Vec<(Samples, &mut Refined)> =
        walks.iter_mut().map(|walk| (cloud(walk), walk)).collect();
    let mut rng = Pcg64::seed_from_u64(plan.seed);
    for round in 1..=ROUNDS {
        let normal: Vec<Vector6<f64>> = (0..SAMPLES).map(|_| nearly_normal(&mut rng)).collect();
        let least = Matrix6::from_diagonal(&(first * SHRINKING.powi(round)).map(|one| one * one));
        for (cloud, walk) in &mut active {
            let steps: Vec<Vector6<f64>> =
                normal.iter().map(|one| cloud.mean + cloud.factor * one).collect();
            let sampled =
                |by: &Vector6<f64>| moved_in_place(&cloud.origin, by.as_ref(), plan.rad_per_m);
            let poses: Vec<Pose> = steps.iter().map(sampled).collect();
            let costs = costs_of(&poses)?;
            walk.evaluations += SAMPLES as u64;
            let mut elite: Vec<(f64, usize)> =
                costs.iter().zip(0..).filter_map(|(&cost, at)| Some((cost?, at))).collect();
            elite.sort_by(|a, b| a.0.total_cmp(&b.0));
            elite.truncate(ELITE);
            if let Some(&(cost, at)) = elite.first()
                && cost < walk.cost
            {
                (walk.pose, walk.cost) = (poses[at], cost);
            }
            // Where few have a cost, these say nothing of where more would.
            if elite.len() == ELITE {
                let elite = || elite.iter().map(|&(_, at)| steps[at]);
                cloud.mean = elite().sum::<Vector6<f64>>() / ELITE as f64;
                let squares =
                    elite().map(|one| one - cloud.mean).map(|away| away * away.transpose());
                let of_elite = squares.sum::<Matrix6<f64>>() / ELITE as f64;
                let covariance = of_elite * WEIGHT_OF_ELITE + least * (1.0 - WEIGHT_OF_ELITE);
                cloud.factor = covariance.cholesky().map_or(cloud.factor, |it| it.unpack());
            }
        }
        let rank = |walk: &Refined| rank(&walk.pose, walk.cost);
        active.sort_by(|(_, a), (_, b)| rank(a).total_cmp(&rank(b)));
        active.truncate(plan.fewest.max(active.len().div_ceil(2)));
    }
    Ok(())
}

/// Six values of nearly the normal distribution: sums of three even ones, which are the same on all processors.
fn nearly_normal(rng: &mut Pcg64) -> Vector6<f64> {
    Vector6::from_fn(|_, _| (0..3).map(|_| rng.random_range(-1.0..1.0)).sum())
}

const _: () = assert!(SAMPLES <= MAX_AT_A_TIME);

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;
    use crate::geometry::PoseError;
    use crate::search::{Freedoms, PatternSearch, Start, moved, pattern_search};

    const PLAN: CrossEntropy = CrossEntropy { first_m: 0.5, rad_per_m: 0.05, fewest: 3, seed: 0 };

    /// A bowl around a pose with dents every quarter of a metre, which hold what goes down step by step.
    fn dented(truth: &Pose, pose: &Pose) -> f64 {
        let between = truth.inverse() * pose;
        let (t, r) = (between.translation.vector, between.rotation.scaled_axis() / PLAN.rad_per_m);
        let dents: f64 = t.iter().chain(r.iter()).map(|way| 1.0 - (way * 25.0).cos()).sum();
        t.norm_squared() + r.norm_squared() + 0.05 * dents
    }

    fn start(truth: &Pose, pose: Pose) -> Refined {
        Refined::unmoved(&Start { pose, cost: dented(truth, &pose) })
    }

    fn gathered(truth: &Pose, mut walks: Vec<Refined>) -> Vec<Refined> {
        let costs = |poses: &[Pose]| {
            assert!(poses.len() <= MAX_AT_A_TIME);
            Ok::<_, Infallible>(poses.iter().map(|pose| Some(dented(truth, pose))).collect())
        };
        let Ok(()) = cross_entropy(&mut walks, &PLAN, |_, cost| cost, costs);
        walks
    }

    #[test]
    fn samples_get_past_the_dents_that_hold_steps() {
        let truth = moved(&Pose::identity(), &[3.0, -0.1, 7.0, 0.01, -0.1, 0.0]);
        let from = moved(&truth, &[0.5, 0.05, -0.6, 0.005, 0.02, -0.004]);
        let walk = start(&truth, from);
        let plan = PatternSearch {
            freedoms: Freedoms::Six,
            first_m: 0.1,
            last_m: 0.004,
            rad_per_m: PLAN.rad_per_m,
            in_place: true,
        };
        let costs = |poses: &[Pose]| {
            Ok::<_, Infallible>(poses.iter().map(|pose| Some(dented(&truth, pose))).collect())
        };
        let Ok(stepped) = pattern_search(&[walk.start], &plan, costs);
        let off = |refined: &Refined| PoseError::between(&truth, &refined.pose).translation_m;
        let gathered = gathered(&truth, vec![walk])[0];
        assert!(off(&stepped[0]) > 0.4, "{}", off(&stepped[0]));
        assert!(off(&gathered) < 0.3, "{}", off(&gathered));
        assert_eq!(gathered.cost, dented(&truth, &gathered.pose));
        assert_eq!((gathered.start, gathered.evaluations), (walk.start, 256));
    }

    #[test]
    fn a_walk_ends_where_it_does_alone_and_never_higher() {
        let truth = Pose::identity();
        let walks: Vec<Refined> =
            [0.0, 0.3, -0.7].map(|x| start(&truth, Pose::translation(x, 0.0, 0.2 * x))).into();
        let together = gathered(&truth, walks.clone());
        for (&before, &after) in walks.iter().zip(&together) {
            assert_eq!(gathered(&truth, vec![before]), [after]);
            assert!(after.cost <= before.cost);
        }
    }

    #[test]
    fn half_of_the_walks_are_given_up_after_each_round_by_price() {
        let away = |x: f64| start(&Pose::identity(), Pose::translation(x, 0.0, 0.0));
        let mut walks = [9.0, 0.0, 6.0, 12.0, 3.0].map(away);
        // No sample has a cost, so each walk stays. The cheapest is nearest, and ranks last.
        let nothing = |poses: &[Pose]| Ok::<_, Infallible>(vec![None; poses.len()]);
        let plan = CrossEntropy { fewest: 2, ..PLAN };
        let Ok(()) = cross_entropy(&mut walks, &plan, |pose, _| -pose.translation.x, nothing);
        assert_eq!(walks.map(|walk| walk.evaluations), [256, 64, 128, 256, 64]);
    }

    #[test]
    fn where_nothing_has_a_cost_a_walk_stays() {
        let mut walks = [start(&Pose::identity(), Pose::translation(1.0, 0.0, 0.0))];
        let before = walks[0];
        let nothing = |poses: &[Pose]| Ok::<_, Infallible>(vec![None; poses.len()]);
        let Ok(()) = cross_entropy(&mut walks, &PLAN, |_, cost| cost, nothing);
        assert_eq!((walks[0].pose, walks[0].cost), (before.pose, before.cost));
    }
}
