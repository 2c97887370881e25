//! Matching again where a first pose says that features are.

mod params;
mod windows;

use std::collections::BTreeMap;
use std::sync::Arc;

pub use params::GuidedParams;
use windows::Windows;

use super::{Detected, MINIMUM, Pairing, Posed, correspondences};
use crate::camera::Intrinsics;
use crate::depth::LiftedMatch;
use crate::estimator::Halt;
use crate::event::{PoseRefined, Stage};
use crate::geometry::Pose;
use crate::problem::Problem;
use crate::robust::residuals;
use crate::solver::refine;
use crate::trace::{Cancelled, Trace};

/// Matchings after the first: each starts from the pose of the one before.
const GUIDED_ROUNDS: usize = 2;
/// Features that are sought again between two checkpoints.
const SOUGHT_AT_A_TIME: usize = 512;
/// Descriptors farther apart than this do not show the same thing, however alone they are.
const MAX_DISTANCE: f32 = 0.8;

/// Matches features again where a pose says that they are.
pub(in crate::estimator) struct Guide {
    pub(in crate::estimator) params: GuidedParams,
}

impl Guide {
    /// Matches again where the pose says, and refines it on what agrees, as long as more agree. `lifted` has the
    /// depth of each reference feature.
    pub(super) fn match_again(
        &self,
        problem: &Problem,
        detected: &Detected,
        lifted: &[LiftedMatch],
        first: Posed,
        trace: &mut Trace<'_>,
    ) -> Result<Posed, Halt> {
        let mut best = first;
        let rounds = if self.params.guided { GUIDED_ROUNDS } else { 0 };
        for _ in 0..rounds {
            let better = trace.stage(Stage::MatchGuided, |trace| {
                let guided = self.match_once(problem, detected, lifted, &best, trace)?;
                let better = guided.filter(|one| one.inliers > best.inliers);
                if let Some(guided) = &better {
                    trace.emit(|| PoseRefined {
                        reference_from_query: guided.pose.inverse(),
                        inliers: guided.inliers,
                        correspondences: guided.pairings.len(),
                        trials: guided.trials,
                    })?;
                }
                Ok::<_, Halt>(better)
            })?;
            let Some(better) = better else { break };
            best = better;
        }
        Ok(best)
    }

    /// Matches where the pose of an earlier matching says that features must be.
    fn match_once(
        &self,
        problem: &Problem,
        detected: &Detected,
        lifted: &[LiftedMatch],
        before: &Posed,
        trace: &mut Trace<'_>,
    ) -> Result<Option<Posed>, Cancelled> {
        let camera = &problem.query.intrinsics;
        let query = &detected.query.features;
        let windows = Windows::new(&query.keypoints, camera, self.params.window_px);
        // The best reference feature of each query feature.
        let mut best: Vec<Option<(usize, f32)>> = vec![None; query.keypoints.len()];
        for some in lifted.chunks(SOUGHT_AT_A_TIME) {
            trace.checkpoint()?;
            for lifted in some {
                let Some((query, distance)) =
                    self.sought(detected, &windows, camera, &before.pose, lifted)
                else {
                    continue;
                };
                if best[query].is_none_or(|(_, least)| distance < least) {
                    best[query] = Some((lifted.reference, distance));
                }
            }
        }
        let matched =
            best.iter().enumerate().filter_map(|(query, found)| Some((query, (*found)?.0)));
        let pairings: Vec<Pairing> = matched
            .filter_map(|(number, of)| {
                Pairing::of(query, &LiftedMatch { query: number, ..lifted[of] })
            })
            .collect();
        if pairings.len() < MINIMUM {
            return Ok(None);
        }
        let correspondences = correspondences(&pairings);
        let threshold = self.params.mlesac.inlier_threshold_px;
        let mut pose = before.pose;
        let mut residuals_px = residuals(&correspondences, camera, &pose);
        // From the window inwards, so that a first pose that is a few pixels off is pulled in.
        for reach in [0.5 * self.params.window_px, threshold, threshold] {
            trace.checkpoint()?;
            let agreeing: Vec<_> = correspondences
                .iter()
                .zip(&residuals_px)
                .filter(|(_, residual)| **residual < reach.max(threshold))
                .map(|(correspondence, _)| *correspondence)
                .collect();
            if agreeing.len() < MINIMUM {
                return Ok(None);
            }
            pose = refine(&agreeing, camera, &pose, self.params.mlesac.loss()).pose;
            residuals_px = residuals(&correspondences, camera, &pose);
        }
        let inliers = residuals_px.iter().filter(|&&residual| residual <= threshold).count();
        Ok(Some(Posed { pose, residuals_px, pairings, inliers, trials: before.trials }))
    }

    /// The query feature that a reference feature is, if one stands out where it must be.
    fn sought(
        &self,
        detected: &Detected,
        windows: &Windows,
        camera: &Intrinsics,
        pose: &Pose,
        lifted: &LiftedMatch,
    ) -> Option<(usize, f32)> {
        let (query, reference) = (detected.query.sift.as_ref()?, detected.reference.sift.as_ref()?);
        let point = lifted.point?;
        let seen = pose * point;
        let pixel = camera.project(&seen)?;
        let keypoint = reference.keypoints[lifted.reference];
        let scale = f64::from(keypoint.scale) * point.z / seen.z;
        let descriptor = &reference.descriptors[lifted.reference];
        let (mut nearest, mut second) = (None, f32::INFINITY);
        let mut least = f32::INFINITY;
        for number in windows.around(&pixel) {
            let candidate = query.keypoints[number];
            let ratio = f64::from(candidate.scale) / scale;
            if (candidate.pixel() - pixel).norm() > self.params.window_px
                || ratio.max(1.0 / ratio) > self.params.scale_ratio
            {
                continue;
            }
            let other = &query.descriptors[number];
            let product: f32 = descriptor.iter().zip(other).map(|(a, b)| a * b).sum();
            let distance = (2.0 - 2.0 * product).max(0.0).sqrt();
            // One feature with two directions is no rival of itself.
            let is_same = nearest.is_some_and(|known: usize| {
                (query.keypoints[known].pixel() - candidate.pixel()).norm() < 1.0
            });
            if distance < least {
                if !is_same {
                    second = least;
                }
                (nearest, least) = (Some(number), distance);
            } else if distance < second && !is_same {
                second = distance;
            }
        }
        let stands_out = least < self.params.window_ratio as f32 * second;
        nearest.filter(|_| stands_out && least < MAX_DISTANCE).map(|query| (query, least))
    }
}

/// The last match of each query feature that has a depth: where the pose says, else the free one.
pub(super) fn last_matches(
    free: &[Pairing],
    last: &[Pairing],
    lifted: &[LiftedMatch],
) -> Arc<[LiftedMatch]> {
    let matches: BTreeMap<usize, usize> =
        free.iter().chain(last).map(|pairing| (pairing.query, pairing.reference)).collect();
    let lifted = |(query, reference): (usize, usize)| LiftedMatch { query, ..lifted[reference] };
    matches.into_iter().map(lifted).collect()
}
