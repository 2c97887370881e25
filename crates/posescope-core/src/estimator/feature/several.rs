//! What an estimate from several references has in common with that from one.

use super::states::FeatureStates;
use super::{FeatureBased, Pairing};
use crate::camera::Intrinsics;
use crate::estimator::{Failure, Halt};
use crate::event::ConsensusJudged;
use crate::geometry::Pose;
use crate::problem::Problem;
use crate::robust::{
    Acceptance, AcceptanceRule, Counted, MlesacError, Places, effective_area_px,
    inliers_beyond_chance, places_beyond_chance,
};
use crate::solver::Correspondence;
use crate::trace::{Cancelled, Trace};

/// What speaks for a consensus.
pub(in crate::estimator) struct BeyondChance {
    pub(in crate::estimator) acceptance: Acceptance,
    /// How many the inliers are of.
    pub(in crate::estimator) tested: usize,
    /// What was counted.
    pub(in crate::estimator) counted: Counted,
}

/// The correspondences with one reference.
pub(in crate::estimator) struct Gathered {
    /// Pixels of the query, and points in the frame of the reference camera.
    pub(in crate::estimator) correspondences: Vec<Correspondence>,
    /// The matches that they are of, before any depth is looked up.
    pub(in crate::estimator) unique: usize,
    /// Keypoints of the query photo.
    pub(in crate::estimator) query_keypoints: usize,
}

impl FeatureBased {
    /// The correspondences of a problem, as [`Estimator::estimate`] comes to them. No event is
    /// emitted: a run on the problem alone has done so.
    pub(in crate::estimator) fn gather(&self, problem: &Problem) -> Result<Gathered, Failure> {
        let gathered = || {
            let trace = &mut Trace::off();
            let detected = self.detect(problem, trace)?;
            let query = &detected.query.features;
            let matches = if detected.is_too_few() {
                Vec::new()
            } else {
                let decisions = self.best_matches(problem, &detected, trace)?;
                FeatureStates::new(query.keypoints.len()).after_matching(&decisions.value)
            };
            let reference = &detected.reference.features;
            let lifted = self.lift(&matches, reference, &problem.reference, trace)?.matches;
            let pairings = lifted.iter().filter_map(|lifted| Pairing::of(query, lifted));
            Ok::<_, Halt>(Gathered {
                correspondences: pairings.map(|pairing| pairing.correspondence).collect(),
                unique: matches.len(),
                query_keypoints: query.keypoints.len(),
            })
        };
        gathered().map_err(|halt| match halt {
            Halt::Failed(failure) => failure,
            Halt::Cancelled => unreachable!("a trace that is off cancels nothing"),
        })
    }

    /// Why MLESAC has no consensus of this many correspondences.
    pub(in crate::estimator) fn halt(
        error: MlesacError<Cancelled>,
        correspondences: usize,
    ) -> Halt {
        let (trials, best_inliers) = match error {
            MlesacError::TooFewCorrespondences { .. } => (0, 0),
            MlesacError::NoModel { trials, best_inliers } => (trials, best_inliers),
            MlesacError::Cancelled(Cancelled) => return Halt::Cancelled,
        };
        Halt::Failed(Failure::NoConsensus { correspondences, best_inliers, trials })
    }

    /// Whether the inliers of a consensus are more than chance gives: pixels of the query
    /// that are at one place count once where `fb.once` says so, and in any case those that are at most
    /// `least_reach_px` apart.
    pub(in crate::estimator) fn beyond_chance(
        &self,
        correspondences: &[Correspondence],
        inliers: &[usize],
        intrinsics: &Intrinsics,
        least_reach_px: f64,
    ) -> BeyondChance {
        let threshold_px = self.params.mlesac.inlier_threshold_px;
        // The paper's rule counts whatever there is.
        let is_once = self.params.once && self.params.accept == AcceptanceRule::Consensus;
        let reach_px = if is_once { threshold_px } else { least_reach_px };
        let (pixels, area_px) = (correspondences.iter().map(|c| c.pixel), intrinsics.area());
        // False matches gather where the texture is, so chance has less room than the whole image.
        if reach_px < 0.0 {
            let area_px = effective_area_px(&pixels.collect::<Vec<_>>(), area_px);
            let (inliers, tested) = (inliers.len(), correspondences.len());
            return BeyondChance {
                acceptance: inliers_beyond_chance(inliers, tested, threshold_px, area_px),
                tested,
                counted: Counted::Correspondences,
            };
        }
        let places = Places::of(pixels, reach_px);
        BeyondChance {
            acceptance: places_beyond_chance(inliers, &places, threshold_px, area_px),
            tested: places.count(),
            counted: Counted::Places,
        }
    }

    /// Whether a pose with these inliers among the correspondences would be accepted, its place aside.
    pub(crate) fn would_accept(
        &self,
        correspondences: &[Correspondence],
        inliers: &[usize],
        intrinsics: &Intrinsics,
    ) -> bool {
        let beyond = self.beyond_chance(correspondences, inliers, intrinsics, f64::NEG_INFINITY);
        self.accepts(&beyond.acceptance)
    }

    /// Whether the rule accepts a verdict.
    fn accepts(&self, acceptance: &Acceptance) -> bool {
        self.params.accept.accepts(acceptance)
    }

    /// The query's pose in the world, if a consensus becomes one.
    ///
    /// # Errors
    /// [`Failure::ChanceConsensus`], [`Failure::OutsideRadius`], or a run that was cancelled.
    pub(in crate::estimator) fn accepted(
        &self,
        reference_from_query: &Pose,
        &BeyondChance { acceptance, tested, counted }: &BeyondChance,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<Pose, Halt> {
        let distance_m = reference_from_query.translation.vector.norm();
        let allowed_m = problem.believed_within_m() * (1.0 + self.params.radius_slack);
        // The paper's rule asks for inliers alone.
        let is_bounded = self.params.accept == AcceptanceRule::Consensus;
        let verdict = if !self.accepts(&acceptance) {
            let needed = acceptance.needed.unwrap_or(tested + 1);
            let inliers = acceptance.inliers;
            Err(Failure::ChanceConsensus { inliers, tested, needed, counted })
        } else if is_bounded && distance_m > allowed_m {
            Err(Failure::OutsideRadius { distance_m, allowed_m })
        } else {
            Ok(())
        };
        trace.emit(|| {
            let accepted = verdict.is_ok();
            ConsensusJudged { acceptance, counted, distance_m, accepted }
        })?;
        verdict?;
        Ok(problem.world_from_query(reference_from_query))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point2, Point3};

    use super::*;
    use crate::params::Params;

    #[test]
    fn inliers_at_one_place_are_accepted_as_one() {
        let intrinsics =
            Intrinsics { fx: 700.0, fy: 700.0, cx: 600.0, cy: 180.0, width: 1200, height: 360 };
        let at = |x: f64, y: f64| Correspondence {
            pixel: Point2::new(x, y),
            point: Point3::new(0.0, 0.0, 10.0),
        };
        let inliers: Vec<usize> = (0..12).collect();
        let spread: Vec<_> = (0..12).map(|i| at(90.0 * f64::from(i), 30.0)).collect();
        let gathered = vec![at(300.0, 100.0); 12];
        let mut params = Params::default();
        let accepts = |params: &Params, all: &[Correspondence]| {
            FeatureBased::new(params).would_accept(all, &inliers, &intrinsics)
        };

        assert!(accepts(&params, &spread));
        assert!(!accepts(&params, &gathered));
        params.fb.once = false;
        assert!(accepts(&params, &gathered));
    }
}
