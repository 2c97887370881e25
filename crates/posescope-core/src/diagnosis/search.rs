//! A finished search on a grid beside the truth: did the search fail, or the cost?
//!
//! That a result costs more than the exact truth says nothing: right results do too, because height, pitch
//! and roll are not searched and the grid has steps. So the result is compared with the best pose near the
//! truth that the search could have reached, and with the best in all six freedoms.

use std::sync::{Mutex, OnceLock, PoisonError};

use rayon::prelude::*;

use super::Family;
use super::Subject;
use super::confidence;
use crate::cost::shuffled;
use crate::estimator::{self, Estimator};
use crate::geometry::{Pose, PoseError, yaw};
use crate::grid::{GridParams, Offset, Phase};
use crate::render::{Score, Scorer};
use crate::search::compass::compass_search;
use crate::search::moved;
use crate::stats::mean_and_squares;

/// Coarse minima beside the result from which the cost is descended, to see whether a better search
/// would have found the truth or only another wrong place.
const OTHER_PLACES: usize = 4;

/// How many standard deviations of the cost of shuffled pixels images must be below it to have anything
/// to do with each other.
pub(super) const BEYOND_CHANCE: f64 = 6.0;

/// With fewer pixels, a low cost can be chance.
pub(super) const TELLING_PIXELS: usize = 500;

/// How often pixels are shuffled to see what chance gives.
const SHUFFLES: u64 = 12;

/// A pose and what it costs.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseCost {
    pub(super) offset: Offset,
    pub(super) cost: f64,
}

impl PoseCost {
    /// The one of lower cost, of equals this.
    fn lower(self, next: Self) -> Self {
        if next.cost < self.cost { next } else { self }
    }
}

/// The cost at a pose beside that of its shuffled pixels.
#[derive(Clone, Copy)]
pub(super) struct AgainstChance {
    /// Covered pixels.
    pub(super) pixels: usize,
    pub(super) cost: f64,
    pub(super) mean: f64,
    pub(super) deviation: f64,
}

impl AgainstChance {
    /// How far below chance, in its standard deviations.
    pub(super) fn deviations(&self) -> f64 {
        (self.mean - self.cost) / self.deviation.max(1e-12)
    }

    /// The share of the cost of shuffled pixels that is saved.
    pub(super) fn gain(&self) -> f64 {
        1.0 - self.cost / self.mean
    }
}

/// What became of the truth in the search.
pub(super) struct Rivals {
    /// The best pose near the truth that the search could have reached.
    pub(super) near: PoseCost,
    /// The pose that beats it: the result, or one that a better search would have ended in.
    pub(super) winner: PoseCost,
    /// Whether the photos share nothing even at the truth.
    pub(super) is_changed: bool,
    /// Whether a better search would have found the truth.
    pub(super) is_missed: bool,
}

/// A finished search, and the truth in the reference camera's frame.
pub(super) struct FinishedSearch<'a> {
    pub(super) subject: &'a Subject<'a>,
    pub(super) scorer: Scorer<'a>,
    pub(super) grid: &'a GridParams,
    pub(super) truth: Pose,
    /// The pose that it ended in.
    pub(super) result: Offset,
    /// The cost there.
    pub(super) result_cost: f64,
    /// Pixels that a pose must cover.
    pub(super) least_covered: u32,
    near_truth: OnceLock<Option<PoseCost>>,
    rivals: OnceLock<Option<Rivals>>,
    /// What was shuffled already: several rules ask for the same poses.
    against_chance: Mutex<Vec<(Offset, Option<AgainstChance>)>>,
}

/// The estimator whose cost is compared at the result and the truth.
pub(super) fn estimator_of(subject: &Subject<'_>, family: Family) -> Option<Box<dyn Estimator>> {
    let method = match family {
        Family::Grid => confidence::responsible(subject.method, subject.outcome),
        _ => return None,
    };
    Some(estimator::find(method)?.make(subject.params))
}

impl<'a> FinishedSearch<'a> {
    /// The search that the subject's method ended; `None` without the truth.
    pub(super) fn of(subject: &'a Subject<'a>, estimator: &'a dyn Estimator) -> Option<Self> {
        let truth = subject.reference_from_truth()?;
        let scorer = estimator.scorer(subject.problem)?;
        let (result, result_cost, least_covered) = ended(subject)?;
        Some(Self {
            subject,
            scorer,
            grid: &subject.params.grid,
            truth,
            result,
            result_cost,
            least_covered,
            near_truth: OnceLock::new(),
            rivals: OnceLock::new(),
            against_chance: Mutex::default(),
        })
    }

    /// What beat the truth; `None` where the truth is out of reach, or covers too little.
    pub(super) fn rivals(&self) -> Option<&Rivals> {
        let rivals = || {
            if self.out_of_reach() != (false, false) {
                return None;
            }
            let (near, result_cost) = (self.near_truth()?, self.result_cost);
            let is_lower = near.cost < result_cost;
            let elsewhere = is_lower.then(|| self.lower_elsewhere(near.cost)).flatten();
            let is_changed = self.is_changed(&near);
            let can_win = self.can_be_right(&near.offset) && !is_changed;
            let winner = elsewhere.unwrap_or(PoseCost { offset: self.result, cost: result_cost });
            Some(Rivals {
                near,
                winner,
                is_changed,
                is_missed: is_lower && elsewhere.is_none() && can_win,
            })
        };
        self.rivals.get_or_init(rivals).as_ref()
    }

    fn eligible(&self, scores: Vec<Score>) -> Vec<Option<f64>> {
        let costs = scores.into_iter();
        costs.map(|score| score.eligible_cost(self.least_covered)).collect()
    }

    pub(super) fn truth_offset(&self) -> Offset {
        Offset::of(&self.truth)
    }

    /// How far the search can go from the reference \[m, rad\].
    pub(super) fn reach(&self) -> (f64, f64) {
        let grid = self.grid;
        (
            self.subject.problem.uncertainty_radius_m + grid.fine_range_m,
            (grid.yaw_range_deg + grid.yaw_fine_range_deg).to_radians(),
        )
    }

    /// Whether the truth is too far from the reference, and whether it is turned too far.
    pub(super) fn out_of_reach(&self) -> (bool, bool) {
        let (reach_m, reach_rad) = self.reach();
        let truth = self.truth_offset();
        let yaw_deg = truth.yaw_rad.to_degrees();
        (
            truth.distance_m() > reach_m + self.grid.coarse_step_m,
            yaw_deg.abs() > reach_rad.to_degrees() + self.grid.yaw_step_deg,
        )
    }

    fn is_reachable(&self, offset: &Offset) -> bool {
        let (reach_m, reach_rad) = self.reach();
        offset.distance_m() <= reach_m + 1e-9 && offset.yaw_rad.abs() <= reach_rad + 1e-9
    }

    /// The reachable pose nearest to the truth.
    pub(super) fn nearest_reachable(&self) -> Offset {
        let (reach_m, reach_rad) = self.reach();
        let truth = self.truth_offset();
        let shrink = (reach_m / truth.distance_m()).min(1.0);
        Offset {
            right_m: truth.right_m * shrink,
            forward_m: truth.forward_m * shrink,
            yaw_rad: truth.yaw_rad.clamp(-reach_rad, reach_rad),
        }
    }

    /// Whether a searched pose is right.
    fn can_be_right(&self, offset: &Offset) -> bool {
        let error = PoseError::between(&self.truth, &offset.reference_from_camera());
        self.subject.tolerance.contains(&error)
    }

    /// The lowest cost near the truth that the search could have reached, of eligible poses: from the best
    /// of a small lattice of positions around it, and from the nearest reachable pose itself, as far as the
    /// fine steps go.
    pub(super) fn near_truth(&self) -> Option<PoseCost> {
        *self.near_truth.get_or_init(|| self.descended_near_truth())
    }

    fn descended_near_truth(&self) -> Option<PoseCost> {
        const AROUND: [f64; 5] = [-0.8, -0.4, 0.0, 0.4, 0.8];
        let centre = self.nearest_reachable();
        let within_m = self.subject.tolerance.translation_m;
        let within_rad = self.subject.tolerance.rotation_deg.to_radians();
        let is_near = |offset: &Offset| {
            offset.distance_from(&centre) <= within_m
                && (offset.yaw_rad - centre.yaw_rad).abs() <= within_rad
                && self.is_reachable(offset)
        };
        let lattice: Vec<Offset> = AROUND
            .iter()
            .flat_map(|forward| AROUND.iter().map(move |right| (forward, right)))
            .map(|(forward, right)| Offset {
                right_m: centre.right_m + right * within_m,
                forward_m: centre.forward_m + forward * within_m,
                ..centre
            })
            .filter(is_near)
            .collect();
        let costs = self.costs(&lattice);
        let scored = lattice.iter().zip(costs);
        let scored = scored.filter_map(|(&offset, cost)| Some(PoseCost { offset, cost: cost? }));
        let best = scored.reduce(PoseCost::lower).map(|place| place.offset);
        let starts: Vec<Offset> =
            std::iter::once(centre).chain(best.filter(|best| *best != centre)).collect();
        self.lowest(&starts, &is_near)
    }

    /// The lowest of the minima that some starts lead to, of equals that of the first. They are descended at
    /// the same time: the few steps of one leave threads idle.
    fn lowest(
        &self,
        starts: &[Offset],
        is_allowed: &(dyn Fn(&Offset) -> bool + Sync),
    ) -> Option<PoseCost> {
        let minima: Vec<Option<PoseCost>> =
            starts.par_iter().map(|start| self.descended(*start, is_allowed)).collect();
        minima.into_iter().flatten().reduce(PoseCost::lower)
    }

    fn costs(&self, offsets: &[Offset]) -> Vec<Option<f64>> {
        let poses: Vec<Pose> = offsets.iter().map(Offset::reference_from_camera).collect();
        self.eligible(self.scorer.score(&poses))
    }

    /// The local minimum that a start leads to, in the freedoms and steps that the search has.
    pub(super) fn descended(
        &self,
        start: Offset,
        is_allowed: &dyn Fn(&Offset) -> bool,
    ) -> Option<PoseCost> {
        const HALVINGS: usize = 2;
        let grid = self.grid;
        let steps =
            [grid.fine_step_m, grid.fine_step_m, (4.0 * grid.yaw_fine_step_deg).to_radians()];
        let offset = |at: &[f64; 3]| Offset { right_m: at[0], forward_m: at[1], yaw_rad: at[2] };
        let Offset { right_m, forward_m, yaw_rad } = start;
        let found = compass_search([right_m, forward_m, yaw_rad], steps, HALVINGS, |places| {
            let offsets: Vec<Offset> = places.iter().map(offset).collect();
            let costs = self.costs(&offsets).into_iter().zip(&offsets);
            costs.map(|(cost, offset)| cost.filter(|_| is_allowed(offset))).collect()
        })?;
        Some(PoseCost { offset: offset(&found.at), cost: found.cost })
    }

    /// A pose away from the truth that costs less than this: the minimum of the result's own basin, or,
    /// where that does not, the lowest of those that the best coarse minima lead to.
    fn lower_elsewhere(&self, than: f64) -> Option<PoseCost> {
        let is_elsewhere = |offset: &Offset| !self.can_be_right(offset);
        let is_allowed = |offset: &Offset| self.is_reachable(offset) && is_elsewhere(offset);
        let lower = |starts: &[Offset]| {
            let lowest = self.lowest(starts, &is_allowed);
            lowest.filter(|place| place.cost < than)
        };
        lower(&[self.result]).or_else(|| {
            let coarse = self.subject.evidence.surface(Phase::PositionCoarse)?;
            let minima: Vec<Offset> = coarse
                .local_minima()
                .into_iter()
                .filter_map(|(cell, _)| coarse.lattice.offset(cell))
                .filter(is_elsewhere)
                .take(OTHER_PLACES)
                .collect();
            lower(&minima)
        })
    }

    pub(super) fn distance_from_truth(&self, offset: &Offset) -> f64 {
        let pose = offset.reference_from_camera();
        PoseError::between(&self.truth, &pose).translation_m
    }

    /// Covered pixels at a pose.
    pub(super) fn covered(&self, offset: &Offset) -> usize {
        self.scorer.score(&[offset.reference_from_camera()])[0].covered as usize
    }

    /// What chance gives at a pose, and what the images cost there.
    pub(super) fn against_chance(&self, offset: &Offset) -> Option<AgainstChance> {
        let known = || {
            let known = self.against_chance.lock();
            known.unwrap_or_else(PoisonError::into_inner)
        };
        let found = known().iter().find(|(at, _)| at == offset).copied();
        if let Some((_, against)) = found {
            return against;
        }
        let against = self.against_chance_of(&offset.reference_from_camera());
        known().push((*offset, against));
        against
    }

    fn against_chance_of(&self, pose: &Pose) -> Option<AgainstChance> {
        let pairs = self.scorer.pairs(pose);
        let measure = self.scorer.statistic();
        let seed = self.subject.problem.random_seed("shuffled truth");
        let costs: Vec<Option<f64>> = (0..SHUFFLES)
            .into_par_iter()
            .map(|k| measure.cost(&shuffled(&pairs, seed.wrapping_add(k))))
            .collect();
        let costs: Vec<f64> = costs.into_iter().flatten().collect();
        let (mean, squares) = mean_and_squares(&costs)?;
        let deviation = (squares / (costs.len() as f64 - 1.0)).sqrt();
        let cost = measure.cost(&pairs)?;
        (costs.len() > 1).then_some(AgainstChance { pixels: pairs.len(), cost, mean, deviation })
    }

    pub(super) fn gain(&self, offset: &Offset) -> Option<f64> {
        Some(self.against_chance(offset)?.gain())
    }

    /// Whether the images share nothing at a pose.
    fn is_changed(&self, near: &PoseCost) -> bool {
        self.against_chance(&near.offset).is_some_and(|against| {
            against.pixels >= TELLING_PIXELS && against.deviations() < BEYOND_CHANCE
        })
    }

    /// Whether the basin of the result goes on outside of what is searched.
    pub(super) fn goes_on_outside(&self) -> bool {
        let beyond_m = 2.0 * self.grid.coarse_step_m;
        let (reach_m, _) = self.reach();
        let is_allowed = |offset: &Offset| offset.distance_m() <= reach_m + beyond_m;
        let minimum = self.descended(self.result, &is_allowed);
        minimum.is_some_and(|minimum| {
            let is_outside = minimum.offset.distance_m()
                > self.subject.problem.uncertainty_radius_m
                || minimum.offset.yaw_rad.abs() > self.grid.yaw_range_deg.to_radians();
            let against = self.against_chance(&minimum.offset);
            let is_beyond = against.is_some_and(|against| against.deviations() >= BEYOND_CHANCE);
            is_outside && minimum.cost < self.result_cost && is_beyond
        })
    }

    /// How far the truth is from the searched pose that is at its place, with its heading.
    pub(super) fn off_the_plane(&self) -> PoseError {
        PoseError::between(&self.truth, &self.truth_offset().reference_from_camera())
    }

    /// The least cost near the truth in all six freedoms.
    pub(super) fn best_in_six_freedoms(&self, near: &PoseCost) -> Option<f64> {
        const HALVINGS: usize = 2;
        let from = |start: &Pose| {
            let degree = 1_f64.to_radians();
            let steps = [0.1, 0.1, 0.1, 0.5 * degree, 0.5 * degree, 0.5 * degree];
            let found = compass_search([0.0; 6], steps, HALVINGS, |places| {
                let poses: Vec<Pose> = places.iter().map(|at| moved(start, at)).collect();
                self.eligible(self.scorer.score(&poses))
            })?;
            let error = PoseError::between(&self.truth, &moved(start, &found.at));
            self.subject.tolerance.contains(&error).then_some(found.cost)
        };
        let starts = [self.truth, lifted_to(&near.offset, &self.truth)];
        let found: Vec<Option<f64>> = starts.par_iter().map(from).collect();
        found.into_iter().flatten().reduce(f64::min)
    }
}

/// Where a search ended: the pose, its cost, and the pixels that a pose must cover.
type Ended = (Offset, f64, u32);

fn ended(subject: &Subject<'_>) -> Option<Ended> {
    subject.outcome.pose.as_ref().ok()?;
    let offset = subject.evidence.minimum?.offset;
    let surface = subject.evidence.surfaces.first();
    let least_covered = surface.map_or(0, |surface| surface.least_covered);
    Some((offset, subject.outcome.cost?.best, least_covered))
}

/// The searched pose with the height, pitch and roll of the truth.
fn lifted_to(offset: &Offset, truth: &Pose) -> Pose {
    let plane = Offset::of(truth);
    let mut pose = offset.reference_from_camera();
    pose.translation.y = truth.translation.y;
    pose.rotation = yaw(offset.yaw_rad) * (yaw(plane.yaw_rad).inverse() * truth.rotation);
    pose
}
