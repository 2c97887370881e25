//! D1 to D8: did the search fail, or the cost, or what it was not allowed to move?
//!
//! That a result costs more than the exact truth says nothing: right results do too, because height,
//! pitch and roll are not searched and the grid has steps. So the result is compared with the best pose
//! near the truth that the search could have reached, and with the best in all six freedoms.

mod causes;
mod findings;

use std::sync::Mutex;

use rayon::prelude::*;
use serde_json::json;

use super::descent::compass_search;
use super::{Code, Diagnosis, Subject, failure_alone, suspicion};
use crate::estimator::{self, CostSummary};
use crate::event::MinimumAssessed;
use crate::geometry::{Pose, PoseError};
use crate::grid::{GridParams, Offset, Phase, ScoredLattice};
use crate::render::{Score, Scorer};
use findings::Findings;

/// Coarse minima beside the result from which the cost is descended, to see whether a better search
/// would have found the truth or only another wrong place.
const OTHER_PLACES: usize = 4;

/// A minimum that covers less than this share of what the truth covers is hardly covered.
const HARDLY_COVERED: f64 = 0.5;

/// How many standard deviations of the cost of shuffled pixels images must be below it to have anything
/// to do with each other.
const BEYOND_CHANCE: f64 = 6.0;

/// So few pixels do not tell whether images have anything to do with each other.
const TELLING_PIXELS: usize = 500;

/// How often pixels are shuffled to see what chance gives.
const SHUFFLES: u64 = 12;

/// What the truth must save more than the result, as a share of the cost of shuffled pixels, if the
/// result is cheap by chance.
const MORE_GAIN: f64 = 0.02;

/// How far the truth must be off the plane of the search for that to be a cause.
const OFF_PLANE_M: f64 = 0.1;
const OFF_PLANE_DEG: f64 = 0.5;

/// Standard deviation of grey values below which a photo shows nothing.
const TEXTURELESS: f64 = 2.0;

/// What another reading of the camera must save beyond the best pose, as a share of the cost of
/// shuffled pixels.
const TELLING_GAIN: f64 = 0.02;

/// The verdicts of a method that searches a cost, in the order in which they are tried.
pub(super) fn diagnose(subject: &Subject<'_>) -> Vec<Diagnosis> {
    if let Some(finding) = textureless(subject) {
        return vec![finding];
    }
    let (Some(truth), Some(summary), Some(minimum)) = (
        subject.reference_from_truth(),
        subject.outcome.cost,
        subject.evidence.minimum,
    ) else {
        return without_truth(subject);
    };
    let Some(estimator) = estimator::find(subject.method).map(|entry| entry.make(subject.params))
    else {
        return failure_alone(subject);
    };
    let mut found = Vec::new();
    estimator.with_scorer(subject.problem, &mut |scorer| {
        let search = SearchedCost {
            subject,
            scorer,
            grid: &subject.params.grid,
            truth,
            summary,
            minimum,
            shuffled: Mutex::default(),
        };
        found = search.verdicts();
    });
    found
}

/// What can be said of a pose that is hardly to be believed, and of none.
fn without_truth(subject: &Subject<'_>) -> Vec<Diagnosis> {
    let (Some(summary), Some(minimum)) = (subject.outcome.cost, subject.evidence.minimum) else {
        return failure_alone(subject);
    };
    if !subject
        .trust
        .as_ref()
        .is_some_and(|trust| trust.is_doubtful())
    {
        return Vec::new();
    }
    let radius_m = subject.problem.uncertainty_radius_m;
    on_rim(&minimum, radius_m, &subject.params.grid)
        .into_iter()
        .chain(hardly_covered(&summary))
        .collect()
}

/// A query that is the same everywhere: costs may differ, but by nothing that it shows.
pub(super) fn textureless(subject: &Subject<'_>) -> Option<Diagnosis> {
    const STRIDE: usize = 7;
    subject.outcome.pose.as_ref().ok()?;
    let photo = &subject.problem.query.photo.gray;
    let values = photo
        .as_raw()
        .iter()
        .step_by(STRIDE)
        .map(|&value| f64::from(value));
    let count = values.len() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let deviation = (values.map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt();
    (deviation < TEXTURELESS).then(|| {
        Diagnosis::new(
            Code::D5,
            format!(
                "the grey values of the query differ by {deviation:.1} only: it shows nothing that tells \
                 one hypothesis from another"
            ),
            json!({ "deviation": deviation }),
        )
    })
}

/// The result lies where the grid ends, so its basin may go on outside.
fn on_rim(minimum: &MinimumAssessed, radius_m: f64, grid: &GridParams) -> Option<Diagnosis> {
    let Offset {
        right_m,
        forward_m,
        yaw_rad,
    } = minimum.offset;
    if !grid.is_on_rim(&minimum.offset, radius_m) {
        return None;
    }
    let distance_m = right_m.hypot(forward_m);
    let yaw_deg = yaw_rad.to_degrees().abs();
    let place = if distance_m > radius_m - 0.5 * grid.coarse_step_m {
        format!("{distance_m:.1} m from the reference, where the disc of {radius_m:.1} m ends")
    } else {
        format!(
            "at a yaw of {yaw_deg:.1}°, where the range of {:.1}° ends",
            grid.yaw_range_deg
        )
    };
    Some(Diagnosis::new(
        Code::D8,
        format!("the minimum lies on the rim of the grid, {place}"),
        json!({ "distance_m": distance_m, "radius_m": radius_m, "yaw_deg": yaw_deg }),
    ))
}

/// Without the truth, only a minimum of next to nothing is hardly covered.
fn hardly_covered(summary: &CostSummary) -> Option<Diagnosis> {
    const NEXT_TO_NOTHING: f64 = 0.15;
    let share = summary.coverage_best / summary.coverage_reference;
    (share < NEXT_TO_NOTHING).then(|| {
        Diagnosis::new(
            Code::D1,
            format!(
                "the minimum covers {:.2} % of the image, {:.0} % of what the reference pose covers; \
                 shuffled pixels cost {} there",
                100.0 * summary.coverage_best,
                100.0 * share,
                summary.shuffled.map_or("nothing".to_owned(), |cost| format!("{cost:.4}")),
            ),
            json!({ "coverage": summary.coverage_best, "share_of_reference": share, "chance_level": summary.shuffled }),
        )
    })
}

/// What a place costs, and what shuffled pixels cost there.
#[derive(Clone, Copy)]
struct AgainstChance {
    /// Covered pixels.
    pixels: usize,
    cost: f64,
    mean: f64,
    deviation: f64,
}

impl AgainstChance {
    /// How far below chance, in its standard deviations.
    fn deviations(&self) -> f64 {
        (self.mean - self.cost) / self.deviation.max(1e-12)
    }

    /// The share of the cost of shuffled pixels that is saved.
    fn gain(&self) -> f64 {
        1.0 - self.cost / self.mean
    }
}

/// A place and what it costs.
#[derive(Clone, Copy, Debug)]
struct Place {
    offset: Offset,
    cost: f64,
}

/// A finished search, and the truth in the reference camera's frame.
struct SearchedCost<'a, 'cost> {
    subject: &'a Subject<'a>,
    scorer: &'a Scorer<'cost>,
    grid: &'a GridParams,
    truth: Pose,
    summary: CostSummary,
    minimum: MinimumAssessed,
    /// What was shuffled already: several tests ask for the same places.
    shuffled: Mutex<Vec<(Offset, Option<AgainstChance>)>>,
}

impl SearchedCost<'_, '_> {
    fn verdicts(&self) -> Vec<Diagnosis> {
        let findings = self.recalled(|| {
            let near = self.best_near_truth();
            Findings {
                near,
                camera: self.suspect_camera(near.as_ref()),
                causes: self.causes(near),
            }
        });
        let Findings {
            near,
            camera,
            causes,
        } = findings.as_ref();
        let mut found = Vec::new();
        found.extend(suspicion::of_poses(self.subject));
        found.extend(camera.clone());
        found.extend(self.suspect_truth(near.as_ref()));
        found.extend_from_slice(causes);
        found
    }

    /// What made the search end in the wrong place, in the order in which it is tried.
    fn causes(&self, near: Option<Place>) -> Vec<Diagnosis> {
        if let Some(outside) = self.outside_grid() {
            return vec![outside];
        }
        let Some(near) = near else {
            return vec![self.truth_has_no_say()];
        };
        let mut causes = Vec::new();
        let is_cheaper = near.cost < self.summary.best;
        let elsewhere = is_cheaper.then(|| self.cheaper_elsewhere(near.cost));
        let elsewhere = elsewhere.flatten();
        let appearance = self.changed_appearance(&near);
        let can_win = self.can_be_right(&near.offset) && appearance.is_none();
        if is_cheaper && elsewhere.is_none() && can_win {
            return vec![self.search_failed(&near)];
        }
        let winner = elsewhere.unwrap_or(Place {
            offset: self.minimum.offset,
            cost: self.summary.best,
        });
        causes.extend(self.too_few_pixels(&near, &winner));
        if appearance.is_none() {
            let radius_m = self.subject.problem.uncertainty_radius_m;
            let rim = on_rim(&self.minimum, radius_m, self.grid);
            causes.extend(rim.filter(|_| self.goes_on_outside()));
        }
        // Where photos share nothing, a pose that is off the plane could win by chance alone.
        causes.extend(match appearance {
            None => self.frozen_freedoms(&near, &winner),
            Some(_) => self.out_of_the_plane(&near),
        });
        causes.extend(appearance);
        causes.push(self.cost_failed(&near, &winner));
        causes
    }

    fn least_covered(&self) -> u32 {
        let surfaces = &self.subject.evidence.surfaces;
        surfaces.first().map_or(0, |surface| surface.least_covered)
    }

    fn eligible(&self, scores: Vec<Score>) -> Vec<Option<f64>> {
        let least_covered = self.least_covered();
        let costs = scores.into_iter();
        costs
            .map(|score| score.eligible_cost(least_covered))
            .collect()
    }

    fn truth_offset(&self) -> Offset {
        Offset::of(&self.truth)
    }

    /// How far the search can go from the reference \[m, rad\].
    fn reach(&self) -> (f64, f64) {
        let grid = self.grid;
        (
            self.subject.problem.uncertainty_radius_m + grid.fine_range_m,
            (grid.yaw_range_deg + grid.yaw_fine_range_deg).to_radians(),
        )
    }

    fn is_reachable(&self, offset: &Offset) -> bool {
        let (reach_m, reach_rad) = self.reach();
        offset.right_m.hypot(offset.forward_m) <= reach_m + 1e-9
            && offset.yaw_rad.abs() <= reach_rad + 1e-9
    }

    /// The reachable pose nearest to the truth.
    fn nearest_reachable(&self) -> Offset {
        let (reach_m, reach_rad) = self.reach();
        let truth = self.truth_offset();
        let shrink = (reach_m / truth.right_m.hypot(truth.forward_m)).min(1.0);
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

    /// The cheapest pose near the truth that the search could have reached, of those that have a say:
    /// from the best of a small lattice of positions around it, and from the nearest reachable pose
    /// itself, as far as the fine steps go.
    fn best_near_truth(&self) -> Option<Place> {
        const AROUND: [f64; 5] = [-0.8, -0.4, 0.0, 0.4, 0.8];
        let centre = self.nearest_reachable();
        let within_m = self.subject.tolerance.translation_m;
        let within_rad = self.subject.tolerance.rotation_deg.to_radians();
        let is_near = |offset: &Offset| {
            let (right, forward) = (
                offset.right_m - centre.right_m,
                offset.forward_m - centre.forward_m,
            );
            right.hypot(forward) <= within_m
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
        let best = lattice
            .iter()
            .zip(costs)
            .filter_map(|(offset, cost)| {
                Some(Place {
                    offset: *offset,
                    cost: cost?,
                })
            })
            .reduce(|best, next| if next.cost < best.cost { next } else { best });
        let best = best.map(|place| place.offset);
        let starts: Vec<Offset> = std::iter::once(centre)
            .chain(best.filter(|best| *best != centre))
            .collect();
        self.deepest(&starts, &is_near)
    }

    /// The cheapest foot of the basins of some starts, of equals that of the first. They are descended at
    /// the same time: the few steps of one leave threads idle.
    fn deepest(
        &self,
        starts: &[Offset],
        is_allowed: &(dyn Fn(&Offset) -> bool + Sync),
    ) -> Option<Place> {
        let feet: Vec<Option<Place>> = starts
            .par_iter()
            .map(|start| self.descended(*start, is_allowed))
            .collect();
        feet.into_iter()
            .flatten()
            .reduce(|best, next| if next.cost < best.cost { next } else { best })
    }

    fn costs(&self, offsets: &[Offset]) -> Vec<Option<f64>> {
        let poses: Vec<Pose> = offsets.iter().map(Offset::reference_from_camera).collect();
        self.eligible(self.scorer.score(&poses))
    }

    /// The foot of the basin of a start, in the freedoms and steps that the search has.
    fn descended(&self, start: Offset, is_allowed: &dyn Fn(&Offset) -> bool) -> Option<Place> {
        const HALVINGS: usize = 2;
        let grid = self.grid;
        let steps = [
            grid.fine_step_m,
            grid.fine_step_m,
            (4.0 * grid.yaw_fine_step_deg).to_radians(),
        ];
        let offset = |at: &[f64; 3]| Offset {
            right_m: at[0],
            forward_m: at[1],
            yaw_rad: at[2],
        };
        let Offset {
            right_m,
            forward_m,
            yaw_rad,
        } = start;
        let found = compass_search([right_m, forward_m, yaw_rad], steps, HALVINGS, |places| {
            let offsets: Vec<Offset> = places.iter().map(offset).collect();
            let costs = self.costs(&offsets).into_iter().zip(&offsets);
            costs
                .map(|(cost, offset)| cost.filter(|_| is_allowed(offset)))
                .collect()
        })?;
        Some(Place {
            offset: offset(&found.at),
            cost: found.cost,
        })
    }

    /// A place away from the truth that is cheaper than this: the foot of the result's own basin, or, where
    /// that is not, the cheapest of those of the best coarse minima.
    fn cheaper_elsewhere(&self, than: f64) -> Option<Place> {
        let is_elsewhere = |offset: &Offset| !self.can_be_right(offset);
        let is_allowed = |offset: &Offset| self.is_reachable(offset) && is_elsewhere(offset);
        let cheaper = |starts: &[Offset]| {
            let foot = self.deepest(starts, &is_allowed);
            foot.filter(|place| place.cost < than)
        };
        cheaper(&[self.minimum.offset]).or_else(|| {
            let coarse = self.surface(Phase::PositionCoarse)?;
            let minima: Vec<Offset> = coarse
                .local_minima()
                .into_iter()
                .filter_map(|(cell, _)| coarse.lattice.offset(cell))
                .filter(is_elsewhere)
                .take(OTHER_PLACES)
                .collect();
            cheaper(&minima)
        })
    }

    fn surface(&self, phase: Phase) -> Option<&ScoredLattice> {
        let mut surfaces = self.subject.evidence.surfaces.iter();
        let found = surfaces.find(|surface| surface.lattice.phase == phase);
        found.map(AsRef::as_ref)
    }
}
