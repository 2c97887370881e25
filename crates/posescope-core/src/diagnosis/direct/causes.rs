//! What made a search end in the wrong place, each a test with its evidence.

use std::sync::PoisonError;

use nalgebra::{Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::{
    AgainstChance, BEYOND_CHANCE, HARDLY_COVERED, MORE_GAIN, OFF_PLANE_DEG, OFF_PLANE_M, Place,
    SHUFFLES, SearchedCost, TELLING_GAIN, TELLING_PIXELS,
};
use crate::camera::Intrinsics;
use crate::cost::shuffled;
use crate::diagnosis::descent::{Descended, compass_search};
use crate::diagnosis::{Code, Diagnosis, trust};
use crate::estimator;
use crate::geometry::{Pose, PoseError, yaw};
use crate::grid::{Offset, Phase, ScoredLattice};
use crate::render::{Score, Scorer};

impl SearchedCost<'_, '_> {
    /// From the true pose, another focal length explains the query much better than any pose does with
    /// the stated one.
    pub(super) fn suspect_camera(&self, near: Option<&Place>) -> Option<Diagnosis> {
        const TIMES: [f64; 8] = [0.7, 0.8, 0.9, 0.95, 1.05, 1.1, 1.25, 1.4];
        let stated = self.subject.problem.query.intrinsics;
        let camera = |at: &[f64; 3]| Intrinsics {
            fx: stated.fx * at[0].exp(),
            fy: stated.fy * at[0].exp(),
            cx: stated.cx + at[1],
            cy: stated.cy + at[2],
            ..stated
        };
        let stated_score = self.scorer.score(&[self.truth])[0];
        let stated_cost = stated_score.eligible_cost(self.least_covered())?;
        let costs = |places: &[[f64; 3]]| -> Vec<Option<f64>> {
            let cameras: Vec<Intrinsics> = places.iter().map(camera).collect();
            let scores = self.scorer.score_seen_by(&cameras, &self.truth);
            let costs = scores
                .iter()
                .map(|score| comparable_cost(score, &stated_score));
            costs.collect()
        };
        let focal_lengths = TIMES.map(|times| [times.ln(), 0.0, 0.0]);
        let best = focal_lengths
            .into_iter()
            .zip(costs(&focal_lengths))
            .filter_map(|(at, cost)| Some(Descended { at, cost: cost? }))
            .reduce(|best, next| if next.cost < best.cost { next } else { best })?;
        let chance = self.summary.shuffled?;
        let rival = near
            .map_or(f64::INFINITY, |near| near.cost)
            .min(self.summary.best);
        // Far behind is no reason to stop: only with its own centre does another camera catch up.
        if best.cost >= stated_cost {
            return None;
        }
        let best = compass_search(best.at, [0.02, 8.0, 8.0], 2, costs)?;
        if rival - best.cost <= TELLING_GAIN * chance {
            return None;
        }
        let camera = camera(&best.at);
        // A cost can also fall because dark falls on dark: pixels must go together better than the same
        // pixels shuffled do, and by more than they do with the stated camera.
        let otherwise = self.against_chance_of(&self.scorer.seen_by(&camera), &self.truth)?;
        let stated_gain = near
            .and_then(|near| self.gain(&near.offset))
            .into_iter()
            .chain(self.gain(&self.minimum.offset))
            .fold(0.0, f64::max);
        if otherwise.deviations() < BEYOND_CHANCE || otherwise.gain() < stated_gain + TELLING_GAIN {
            return None;
        }
        Some(Diagnosis::new(
            Code::X1,
            format!(
                "at the true pose the cost is {stated_cost:.4} with the stated camera and {:.4} with {}; \
                 the result costs {:.4}",
                best.cost,
                otherwise_stated(&camera, &stated),
                self.summary.best,
            ),
            json!({ "cost_at_truth": stated_cost, "cost_otherwise": best.cost, "camera": camera }),
        ))
    }

    /// The result is as certain as results ever are, and it is not the stated truth.
    /// Where the images agree at the truth too, though less, both are there, and the truth is not suspect.
    pub(super) fn suspect_truth(&self, near: Option<&Place>) -> Option<Diagnosis> {
        const NEARLY_CERTAIN: f64 = 0.97;
        const SUPPORTED: f64 = 0.5;
        let probability = self.subject.trust.as_ref()?.probability?;
        // Few wrong poses are so certain, and shuffling takes its time.
        if probability < NEARLY_CERTAIN {
            return None;
        }
        let error = self.subject.error()?;
        let gain = near.and_then(|near| self.gain(&near.offset)).unwrap_or(0.0);
        if gain > SUPPORTED * self.gain(&self.minimum.offset)? {
            return None;
        }
        Some(Diagnosis::new(
            Code::X1,
            format!(
                "poses like this one are right in {:.0} % of cases, and it is {error} from the \
                 stated truth: the truth is suspect",
                100.0 * probability
            ),
            json!({ "probability": probability, "error": error }),
        ))
    }

    pub(super) fn outside_grid(&self) -> Option<Diagnosis> {
        let (reach_m, reach_rad) = self.reach();
        let truth = self.truth_offset();
        let distance_m = truth.right_m.hypot(truth.forward_m);
        let yaw_deg = truth.yaw_rad.to_degrees();
        let radius_m = self.subject.problem.uncertainty_radius_m;
        let is_far = distance_m > reach_m + self.grid.coarse_step_m;
        let is_turned = yaw_deg.abs() > reach_rad.to_degrees() + self.grid.yaw_step_deg;
        let words = match (is_far, is_turned) {
            (true, _) => format!(
                "the truth is {distance_m:.1} m from the reference, and positions up to {radius_m:.1} m \
                 are searched"
            ),
            (false, true) => format!(
                "the truth is turned by {yaw_deg:.1}° against the reference, and ±{:.1}° are searched",
                self.grid.yaw_range_deg
            ),
            (false, false) => return None,
        };
        Some(Diagnosis::new(
            Code::D4,
            words,
            json!({
                "distance_m": distance_m,
                "radius_m": radius_m,
                "yaw_deg": yaw_deg,
                "yaw_range_deg": self.grid.yaw_range_deg,
            }),
        ))
    }

    /// No pose near the truth covers enough to have a say: the grid leaves it out.
    pub(super) fn truth_has_no_say(&self) -> Diagnosis {
        let score = self
            .scorer
            .score(&[self.nearest_reachable().reference_from_camera()])[0];
        let least_covered = self.least_covered();
        Diagnosis::new(
            Code::D4,
            format!(
                "near the truth the view covers {} px, and {least_covered} are needed to have a say \
                 (grid.coverage_floor)",
                score.covered
            ),
            json!({ "covered": score.covered, "least_covered": least_covered }),
        )
    }

    /// A pose near the truth that the search could have reached is cheaper than all others.
    pub(super) fn search_failed(&self, near: &Place) -> Diagnosis {
        let loss = self.lost_in(near);
        Diagnosis::new(
            Code::D3,
            format!(
                "the search failed, not the cost: {:.2} m from the truth it is {:.4}, and {:.4} at the \
                 result{}",
                self.distance_from_truth(&near.offset),
                near.cost,
                self.summary.best,
                loss.words
            ),
            json!({
                "cost_near_truth": near.cost,
                "cost_at_result": self.summary.best,
                "near_truth": offset_evidence(&near.offset),
                "lost_in": loss.phase,
                "rank": loss.rank,
                "margin": loss.margin,
            }),
        )
    }

    /// The phase that turned away from the truth.
    fn lost_in(&self, near: &Place) -> Loss {
        let at = |phase: Phase| {
            let surface = self.surface(phase)?;
            Some((surface, surface.lattice.offset(surface.minimum()?)?))
        };
        let Some((coarse, chosen)) = at(Phase::PositionCoarse) else {
            return Loss::default();
        };
        let target = near.offset;
        let away = |offset: &Offset| {
            let (right, forward) = (
                offset.right_m - target.right_m,
                offset.forward_m - target.forward_m,
            );
            right.hypot(forward)
        };
        let fine_reach = self.grid.fine_range_m.hypot(self.grid.fine_range_m);
        if away(&chosen) > fine_reach + self.grid.fine_step_m {
            return lost_among_coarse(coarse, &away);
        }
        let tolerance_m = self.subject.tolerance.translation_m;
        let lost = match at(Phase::PositionFine) {
            Some((surface, chosen)) if away(&chosen) > tolerance_m => Some(surface),
            _ => self.surface(Phase::YawCoarse),
        };
        lost.map_or_else(Loss::default, |surface| Loss {
            words: format!(
                "; it was lost in the phase “{}”",
                surface.lattice.phase.name()
            ),
            phase: Some(surface.lattice.phase.name()),
            ..Loss::default()
        })
    }

    fn distance_from_truth(&self, offset: &Offset) -> f64 {
        let pose = offset.reference_from_camera();
        PoseError::between(&self.truth, &pose).translation_m
    }

    /// What chance gives at a pose, and what the images cost there.
    fn against_chance(&self, offset: &Offset) -> Option<AgainstChance> {
        let shuffled = || self.shuffled.lock().unwrap_or_else(PoisonError::into_inner);
        let known = shuffled()
            .iter()
            .find(|(known, _)| known == offset)
            .copied();
        if let Some((_, against)) = known {
            return against;
        }
        let against = self.against_chance_of(self.scorer, &offset.reference_from_camera());
        shuffled().push((*offset, against));
        against
    }

    fn against_chance_of(&self, scorer: &Scorer<'_>, pose: &Pose) -> Option<AgainstChance> {
        let pairs = scorer.pairs(pose);
        let subject = self.subject;
        let responsible = trust::responsible(subject.method, subject.outcome);
        let entry = estimator::find(responsible)?.cost()?;
        let measure = subject.params.costs.of(entry)?.cost();
        let seed = subject.problem.random_seed("shuffled truth");
        let costs: Vec<Option<f64>> = (0..SHUFFLES)
            .into_par_iter()
            .map_init(
                || measure.evaluator(),
                |evaluator, k| evaluator.cost(&shuffled(&pairs, seed.wrapping_add(k))),
            )
            .collect();
        let costs: Vec<f64> = costs.into_iter().flatten().collect();
        let count = costs.len() as f64;
        let mean = costs.iter().sum::<f64>() / count;
        let squared: f64 = costs.iter().map(|cost| (cost - mean).powi(2)).sum();
        Some(AgainstChance {
            pixels: pairs.len(),
            cost: measure.evaluate(&pairs)?,
            mean,
            deviation: (squared / (count - 1.0)).sqrt(),
        })
        .filter(|_| costs.len() > 1)
    }

    fn gain(&self, offset: &Offset) -> Option<f64> {
        Some(self.against_chance(offset)?.gain())
    }

    fn is_beyond_chance(&self, offset: &Offset) -> bool {
        self.against_chance(offset)
            .is_some_and(|against| against.deviations() >= BEYOND_CHANCE)
    }

    /// Whether the basin of the result has its foot beyond where positions are searched.
    pub(super) fn goes_on_outside(&self) -> bool {
        let start = self.minimum.offset;
        let beyond_m = 2.0 * self.grid.coarse_step_m;
        let (reach_m, _) = self.reach();
        let distance = |offset: &Offset| offset.right_m.hypot(offset.forward_m);
        let is_allowed = |offset: &Offset| distance(offset) <= reach_m + beyond_m;
        let foot = self.descended(start, &is_allowed);
        foot.is_some_and(|foot| {
            let is_outside = distance(&foot.offset) > self.subject.problem.uncertainty_radius_m
                || foot.offset.yaw_rad.abs() > self.grid.yaw_range_deg.to_radians();
            is_outside && foot.cost < self.summary.best && self.is_beyond_chance(&foot.offset)
        })
    }

    /// The winner is cheap because so few pixels are cheap by chance.
    pub(super) fn too_few_pixels(&self, near: &Place, winner: &Place) -> Option<Diagnosis> {
        let covered = |place: &Place| {
            let score = self.scorer.score(&[place.offset.reference_from_camera()])[0];
            score.covered as usize
        };
        let (at_truth, at_winner) = (covered(near), covered(winner));
        if !is_hardly_covered(at_winner, at_truth) {
            return None;
        }
        let (gain_at_truth, gain_at_winner) =
            (self.gain(&near.offset)?, self.gain(&winner.offset)?);
        (gain_at_winner + MORE_GAIN < gain_at_truth).then(|| {
            Diagnosis::new(
                Code::D1,
                format!(
                    "the minimum covers {at_winner} px and the truth {at_truth}: so few cost little \
                     by chance, {:.1} % less than shuffled, and at the truth they save {:.1} %",
                    100.0 * gain_at_winner,
                    100.0 * gain_at_truth
                ),
                json!({
                    "covered_at_result": at_winner,
                    "covered_at_truth": at_truth,
                    "gain_at_result": gain_at_winner,
                    "gain_at_truth": gain_at_truth,
                }),
            )
        })
    }

    /// None of what is searched is right, because the truth is too far off the plane of the search.
    pub(super) fn out_of_the_plane(&self, near: &Place) -> Option<Diagnosis> {
        let frozen = self.off_the_plane();
        (!self.subject.tolerance.contains(&frozen)).then(|| {
            Diagnosis::new(
                Code::D7,
                format!(
                    "no pose that is searched is right: the truth is {frozen} off the plane of the search, \
                     in height, pitch and roll"
                ),
                self.frozen_evidence(&frozen, near, None),
            )
        })
    }

    /// With height, pitch and roll free, the truth would win; or none of what is searched is right.
    pub(super) fn frozen_freedoms(&self, near: &Place, winner: &Place) -> Option<Diagnosis> {
        let frozen = self.off_the_plane();
        if !self.subject.tolerance.contains(&frozen) {
            return self.out_of_the_plane(near);
        }
        // What is on the plane of the search has nothing to win by leaving it.
        if frozen.translation_m < OFF_PLANE_M && frozen.rotation_deg < OFF_PLANE_DEG {
            return None;
        }
        let best = self.best_in_six_freedoms(near)?;
        (best < winner.cost).then(|| {
            Diagnosis::new(
                Code::D7,
                format!(
                    "with height, pitch and roll free the cost near the truth falls from {:.4} to {best:.4}, \
                     below the {:.4} elsewhere; the truth is {frozen} off the plane of the search",
                    near.cost, winner.cost
                ),
                self.frozen_evidence(&frozen, near, Some(best)),
            )
        })
    }

    /// How far the truth is from the searched pose that is at its place, with its heading.
    fn off_the_plane(&self) -> PoseError {
        PoseError::between(&self.truth, &self.truth_offset().reference_from_camera())
    }

    fn frozen_evidence(&self, frozen: &PoseError, near: &Place, in_six: Option<f64>) -> Value {
        json!({
            "height_m": -self.truth.translation.y,
            "frozen_error": frozen,
            "cost_in_six_freedoms": in_six,
            "cost_near_truth": near.cost,
        })
    }

    /// The least cost near the truth in all six freedoms.
    fn best_in_six_freedoms(&self, near: &Place) -> Option<f64> {
        const HALVINGS: usize = 2;
        let from = |start: &Pose| {
            let degree = 1_f64.to_radians();
            let steps = [0.1, 0.1, 0.1, 0.5 * degree, 0.5 * degree, 0.5 * degree];
            let found = compass_search([0.0; 6], steps, HALVINGS, |places| {
                let poses: Vec<Pose> = places.iter().map(|at| moved(start, at)).collect();
                self.eligible(self.scorer.score(&poses))
            })?;
            let error = PoseError::between(&self.truth, &moved(start, &found.at));
            self.subject
                .tolerance
                .contains(&error)
                .then_some(found.cost)
        };
        let starts = [self.truth, lifted_to(&near.offset, &self.truth)];
        let found: Vec<Option<f64>> = starts.par_iter().map(from).collect();
        found.into_iter().flatten().reduce(f64::min)
    }

    /// The images share nothing, even at the truth.
    pub(super) fn changed_appearance(&self, near: &Place) -> Option<Diagnosis> {
        let against = self.against_chance(&near.offset)?;
        if against.pixels < TELLING_PIXELS {
            return None;
        }
        let deviations = against.deviations();
        (deviations < BEYOND_CHANCE).then(|| {
            Diagnosis::new(
                Code::D6,
                format!(
                    "even at the truth the images cost {:.4}, and shuffled pixels {:.4} ± {:.4}: they look \
                     too different",
                    against.cost, against.mean, against.deviation
                ),
                json!({
                    "cost_near_truth": near.cost,
                    "chance_level": against.mean,
                    "chance_deviation": against.deviation,
                    "deviations": deviations,
                }),
            )
        })
    }

    pub(super) fn cost_failed(&self, near: &Place, winner: &Place) -> Diagnosis {
        Diagnosis::new(
            Code::D2,
            format!(
                "the cost failed, not the search: of the poses that it can reach, one {:.1} m from the truth \
                 costs {:.4}, and near the truth none less than {:.4}; the result costs {:.4}",
                self.distance_from_truth(&winner.offset),
                winner.cost,
                near.cost,
                self.summary.best
            ),
            json!({
                "cost_near_truth": near.cost,
                "cost_at_result": self.summary.best,
                "cost_elsewhere": winner.cost,
                "near_truth": offset_evidence(&near.offset),
                "elsewhere": offset_evidence(&winner.offset),
            }),
        )
    }
}

/// In what a camera differs from the stated one, to the pixel.
fn otherwise_stated(camera: &Intrinsics, stated: &Intrinsics) -> String {
    let centre = |of: &Intrinsics| format!("({:.0}, {:.0})", of.cx, of.cy);
    let focal_length = format!(
        "a focal length of {:.0} px instead of {:.0}",
        camera.fx, stated.fx
    );
    match centre(camera) == centre(stated) {
        true => focal_length,
        false => format!(
            "{focal_length} and its centre at {} instead of {}",
            centre(camera),
            centre(stated)
        ),
    }
}

/// What another camera costs; `None` for one that sees so little of the cloud that it is cheap by
/// chance, as one of a much shorter focal length does.
fn comparable_cost(other: &Score, stated: &Score) -> Option<f64> {
    other.eligible_cost(stated.covered / 2)
}

/// Whether a minimum covers so few pixels beside the truth that this is a cause. Where the truth covers
/// next to nothing too, that the minimum covers less is none.
fn is_hardly_covered(at_winner: usize, at_truth: usize) -> bool {
    (at_winner as f64) < HARDLY_COVERED * at_truth as f64 && at_truth >= TELLING_PIXELS
}

/// Where the search turned away from the truth.
#[derive(Default)]
struct Loss {
    words: String,
    phase: Option<&'static str>,
    rank: Option<usize>,
    margin: Option<f64>,
}

/// The rank of the coarse cell nearest to the target, and what it costs more than the one chosen.
fn lost_among_coarse(coarse: &ScoredLattice, away: &dyn Fn(&Offset) -> f64) -> Loss {
    let phase = coarse.lattice.phase.name();
    let lost = Loss {
        words: format!("; it was lost in the phase “{phase}”"),
        phase: Some(phase),
        ..Loss::default()
    };
    let nearest = coarse
        .lattice
        .hypotheses()
        .filter_map(|(cell, offset)| Some((away(&offset), coarse.eligible_cost(cell)?)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let least = coarse.minimum().and_then(|cell| coarse.eligible_cost(cell));
    let (Some((_, cost)), Some(least)) = (nearest, least) else {
        return lost;
    };
    let cheaper = (0..coarse.scores.len())
        .filter_map(|cell| coarse.eligible_cost(cell))
        .filter(|other| *other < cost)
        .count();
    let (rank, margin) = (cheaper + 1, cost - least);
    Loss {
        words: format!(
            "; the step nearest to it came at rank {rank} in the phase “{phase}”, {margin:.4} dearer than \
             the one chosen"
        ),
        rank: Some(rank),
        margin: Some(margin),
        ..lost
    }
}

fn offset_evidence(offset: &Offset) -> Value {
    json!({
        "right_m": offset.right_m,
        "forward_m": offset.forward_m,
        "yaw_deg": offset.yaw_rad.to_degrees(),
    })
}

/// A camera moved along and turned about its own axes.
fn moved(pose: &Pose, by: &[f64; 6]) -> Pose {
    let [x, y, z, about_x, about_y, about_z] = *by;
    pose * Pose::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_scaled_axis(Vector3::new(about_x, about_y, about_z)),
    )
}

/// The searched pose with the height, pitch and roll of the truth.
fn lifted_to(offset: &Offset, truth: &Pose) -> Pose {
    let plane = Offset::of(truth);
    let mut pose = offset.reference_from_camera();
    pose.translation.y = truth.translation.y;
    pose.rotation = yaw(offset.yaw_rad) * (yaw(plane.yaw_rad).inverse() * truth.rotation);
    pose
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_that_sees_less_than_half_of_the_cloud_is_not_compared() {
        let score = |covered| Score {
            cost: Some(0.1),
            covered,
        };
        let stated = score(1000);
        assert_eq!(comparable_cost(&score(499), &stated), None);
        assert_eq!(comparable_cost(&score(500), &stated), Some(0.1));
    }

    #[test]
    fn a_minimum_is_hardly_covered_beside_a_truth_that_tells_something() {
        assert!(is_hardly_covered(249, 500));
        assert!(
            !is_hardly_covered(250, 500),
            "half of what the truth covers"
        );
        assert!(
            !is_hardly_covered(10, 499),
            "nothing to be told at the truth"
        );
        assert!(is_hardly_covered(4_999, 10_000));
    }
}
