//! What both photos say about a pose.
//!
//! Features that repeat, the windows of one house and of another, agree on a pose as well as those of one
//! place do. The photos as a whole do not: drawn at a right pose the reference's cloud goes with the query
//! far better than at poses beside it, or elsewhere around the reference. A search compares photos, too, but of the poses
//! that it tries one is always the best, also where none is right. The cost is that of the [judge](crate::judge), on
//! smaller photos.

use std::convert::Infallible;

use super::signed_log;
use crate::geometry::{Pose, yaw};
use crate::judge::Judge;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::{Objective as _, Score};
use crate::scale::Scale;
use crate::search::moved;
use crate::stats::median_and_deviation;

/// How closely one looks. A method's coefficients belong to its look.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look {
    /// How many times smaller the photos are.
    shrink: u32,
    /// Poses around the reference that a pose is held against.
    around: usize,
    /// The freedoms along which its neighbours are: three of position, right, down, forward, and three of rotation about
    /// the same.
    freedoms: &'static [usize],
}

impl Look {
    /// For a method that takes a tenth of a second.
    pub(super) const QUICK: Self = Self { shrink: 4, around: 48, freedoms: &[0, 1, 2, 3, 4, 5] };
    /// For one that takes its time: it doubts two right poses where a quick look doubts three.
    pub(super) const THOROUGH: Self = Self { shrink: 2, around: 64, freedoms: &[0, 1, 2, 3, 4, 5] };
    /// For a search in six freedoms, which has compared photos itself.
    pub(super) const GLANCE: Self = Self { shrink: 4, around: 16, freedoms: &[0, 2, 4] };
}

/// How far the poses around the reference go, at the scale of the paper \[m\].
const AROUND_M: f64 = 8.0;

/// Poses around the reference are turned by up to twice this to both sides \[°\].
const TURN_DEG: f64 = 5.0;

/// The golden angle, by which neighbours on a spiral that fills a disc evenly are turned \[rad\].
const GOLDEN_RAD: f64 = 2.399_963_229_728_653;

/// How far the neighbours of the pose are, in two rings, at the scale of the paper \[m\], and what turn goes with a
/// metre \[°\].
const RINGS_M: [f64; 2] = [0.5, 1.0];
const DEG_PER_M: f64 = 2.0;

/// A pose that covers less of what the reference pose covers has no say.
const MIN_COVERED: f64 = 0.25;

/// Smaller gains would dominate the logarithm.
const MIN_GAIN: f64 = 1e-3;

/// The signals at a pose of the query camera in the reference camera's frame, kept with the query: a method
/// and the hybrid that keeps its pose ask the same. None speaks for a pose where nothing can be compared.
pub(super) fn signals(
    problem: &Problem,
    params: &Params,
    reference_from_query: &Pose,
    look: Look,
) -> [(&'static str, f64); 6] {
    let scale = params.scale;
    let inputs = (&params.judge, &params.render, scale, look, reference_from_query);
    let seen = || {
        let judge = Judge::new(problem, &params.render, &params.judge, look.shrink);
        let mut poses = vec![*reference_from_query, Pose::identity()];
        poses.extend(neighbours(reference_from_query, look.freedoms, scale));
        let first_around = poses.len();
        poses.extend(around(look.around, scale));
        Ok(Appearance::among(&judge.score(&poses), first_around).unwrap_or_default())
    };
    let Ok::<_, Infallible>(seen) = problem.try_recall(inputs, |_| 0, seen);
    seen.value.signals()
}

/// The cost at a pose among the costs of others; all but the last in robust standard deviations of the
/// costs around the reference.
#[derive(Clone, Copy, Default)]
struct Appearance {
    /// How far below the median of those around the reference.
    depth: f64,
    /// How far below the least of them.
    margin: f64,
    /// How far below the mean of its neighbours in the nearer ring and in the farther.
    rises: [f64; 2],
    /// How far below the reference pose.
    below_start: f64,
    /// Share of the cost of independent photos that is saved.
    gain: f64,
}

impl Appearance {
    /// From the scores of the pose, the reference pose, both rings, and those around the reference.
    fn among(scores: &[Score], first_around: usize) -> Option<Self> {
        let (of_poses, around) = scores.split_at(first_around);
        let [pose, start, beside @ ..] = of_poses else {
            return None;
        };
        let least_covered = (MIN_COVERED * f64::from(start.covered)) as u32;
        let mut around: Vec<f64> =
            around.iter().filter_map(|score| score.eligible_cost(least_covered)).collect();
        let least = around.iter().copied().reduce(f64::min)?;
        let (centre, deviation) = median_and_deviation(&mut around)?;
        let cost = pose.cost?;
        let above = |other: f64| (other - cost) / deviation;
        // Neighbours that show nothing are no better than the pose.
        let mean = |ring: &[Score]| {
            let costs = ring.iter().map(|score| score.cost.unwrap_or(cost));
            costs.sum::<f64>() / ring.len().max(1) as f64
        };
        let (nearer, farther) = beside.split_at(beside.len() / 2);
        Some(Self {
            depth: above(centre),
            margin: above(least),
            rises: [above(mean(nearer)), above(mean(farther))],
            below_start: above(start.cost.unwrap_or(1.0)),
            gain: 1.0 - cost,
        })
    }

    fn signals(&self) -> [(&'static str, f64); 6] {
        [
            ("seen_depth", signed_log(self.depth)),
            ("seen_margin", signed_log(self.margin)),
            ("seen_rise", signed_log(self.rises[0])),
            ("seen_rise_farther", signed_log(self.rises[1])),
            ("seen_above_start", signed_log(self.below_start)),
            ("seen_gain", self.gain.max(MIN_GAIN).ln()),
        ]
    }
}

/// The pose moved along and turned about each of its axes, to both sides, by the step of each ring.
fn neighbours<'a>(
    pose: &'a Pose,
    freedoms: &'a [usize],
    scale: Scale,
) -> impl Iterator<Item = Pose> + 'a {
    RINGS_M.into_iter().flat_map(move |paper_m| {
        let step_rad = (DEG_PER_M * paper_m).to_radians();
        let step_m = scale.length(paper_m);
        let steps = [step_m, step_m, step_m, step_rad, step_rad, step_rad];
        let both = |axis: &usize| [(*axis, 1.0), (*axis, -1.0)];
        freedoms.iter().flat_map(both).map(move |(axis, sign)| {
            let mut by = [0.0; 6];
            by[axis] = sign * steps[axis];
            moved(pose, &by)
        })
    })
}

/// Poses on a spiral around the reference, in its plane.
fn around(count: usize, scale: Scale) -> impl Iterator<Item = Pose> {
    (0..count).map(move |k| {
        let distance_m = scale.length(AROUND_M) * ((k as f64 + 0.5) / count as f64).sqrt();
        let angle = GOLDEN_RAD * k as f64;
        let turn = TURN_DEG.to_radians() * ((k % 5) as f64 - 2.0);
        let mut pose = Pose::translation(distance_m * angle.sin(), 0.0, distance_m * angle.cos());
        pose.rotation = yaw(turn);
        pose
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn score(cost: f64, covered: u32) -> Score {
        Score { cost: Some(cost), covered }
    }

    #[test]
    fn a_pose_that_is_cheaper_than_all_others_stands_out_and_one_among_them_does_not() {
        let around = [0.96, 0.97, 0.98, 0.99, 1.0].map(|cost| score(cost, 100));
        let seen = |cost: f64| {
            let mut scores = vec![score(cost, 100), score(0.97, 100)];
            scores.extend([score(0.9, 100), score(0.94, 100)]);
            scores.extend(around);
            Appearance::among(&scores, 4).expect("costs")
        };
        // Their median is 0.98, and so are they spread by 1.4826 times 0.01.
        let (deviation, seen, among) = (0.014_826, seen(0.8), seen(0.98));
        assert!((seen.depth - 0.18 / deviation).abs() < 1e-9);
        assert!((seen.margin - 0.16 / deviation).abs() < 1e-9);
        assert!((seen.rises[0] - 0.1 / deviation).abs() < 1e-9);
        assert!((seen.rises[1] - 0.14 / deviation).abs() < 1e-9);
        assert!((seen.below_start - 0.17 / deviation).abs() < 1e-9);
        assert!(among.depth.abs() < 1e-9 && among.margin < 0.0);
    }

    #[test]
    fn what_covers_too_little_has_no_say_and_without_costs_nothing_speaks_for_a_pose() {
        let mut scores = vec![score(0.8, 100), score(0.97, 100), score(0.9, 100), score(0.9, 100)];
        scores.extend([score(0.1, 24), score(0.95, 25), score(0.97, 100), score(0.99, 100)]);
        let seen = Appearance::among(&scores, 4).expect("costs");
        // The cheap one covers less than a quarter of what the reference pose covers.
        assert!(seen.margin > 0.0);
        let nothing = Score { cost: None, covered: 0 };
        assert!(Appearance::among(&[nothing; 6], 4).is_none());
        assert!(Appearance::default().signals().iter().all(|(_, signal)| signal.is_finite()));
    }

    #[test]
    fn the_poses_around_a_reference_fill_its_disc_to_all_sides() {
        let poses: Vec<Pose> = around(48, Scale::PAPER).collect();
        assert_eq!(poses.len(), 48);
        let mut quarters = [0; 4];
        for pose in &poses {
            let at = pose.translation.vector;
            assert!(at.norm() < AROUND_M && at.y == 0.0);
            quarters[usize::from(at.x > 0.0) + 2 * usize::from(at.z > 0.0)] += 1;
        }
        assert!(quarters.iter().all(|&count| count >= 10), "{quarters:?}");
        assert_eq!(neighbours(&Pose::identity(), Look::QUICK.freedoms, Scale::PAPER).count(), 24);
    }
}
