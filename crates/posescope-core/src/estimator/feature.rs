//! FB, the indirect feature-based method (paper, section 2.1 and appendix A).

mod guide;
mod lifted;
mod matched;
mod params;
mod several;
pub(super) mod states;

use std::sync::Arc;

pub(super) use self::guide::Guide;
pub use self::guide::GuidedParams;
use self::guide::last_matches;
use self::lifted::Lifted;
pub use self::lifted::projected_cloud;
pub use self::matched::count_matches;
pub(super) use self::matched::{Detected, Detector};
pub use self::params::{DepthRule, FeatureParams};
use self::states::FeatureStates;
use super::{Estimator, Failure, FeatureCounts, Halt, Outcome, separate_failure};
use crate::depth::LiftedMatch;
use crate::event::{
    DepthsLifted, FeaturesClassified, HypothesisTried, MatchesDecided, MatchesGuided, PoseRefined,
    Stage,
};
use crate::features::Features;
use crate::geometry::Pose;
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::RenderParams;
use crate::robust::{Consensus, Trial, mlesac, residuals};
use crate::solver::Correspondence;
use crate::trace::{Cancelled, Trace};

/// The fewest correspondences that fix a pose: three for P3P, one to choose among its solutions.
pub(super) const MINIMUM: usize = 4;

/// The feature-based estimator.
pub struct FeatureBased {
    pub(super) method: Method,
    pub(super) detector: Detector,
    pub(crate) params: FeatureParams,
    /// Which points lend their depth, where only visible ones do.
    pub(super) render: RenderParams,
    /// What the random samples are drawn for.
    pub(super) purpose: &'static str,
    /// How features are matched again where the first pose says that they are.
    pub(super) guide: Option<Guide>,
}

/// A match and the pixels that it says belong together.
#[derive(Clone, Copy)]
pub(super) struct Pairing {
    pub(super) query: usize,
    pub(super) reference: usize,
    pub(super) correspondence: Correspondence,
}

/// A pose with the matches that it was found among.
pub(super) struct Posed {
    /// `camera_from_reference`.
    pub(super) pose: Pose,
    pub(super) pairings: Vec<Pairing>,
    pub(super) residuals_px: Vec<f64>,
    pub(super) inliers: usize,
    pub(super) trials: usize,
}

impl Estimator for FeatureBased {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        Ok(self.propose(problem, trace)?.outcome)
    }
}

/// What FB makes of a problem, and the pose that it accepted or refused.
pub(super) struct Proposal {
    /// The answer.
    pub(super) outcome: Outcome,
    /// The pose `reference_from_query` of the consensus that was accepted or refused; `None` where there was none.
    pub(super) consensus: Option<Pose>,
}

/// What is known of a run, up to where it stops.
#[derive(Default)]
struct Progress {
    counts: FeatureCounts,
    agreed: Option<Pose>,
    states: FeatureStates,
}

impl FeatureBased {
    /// FB with these parameters.
    pub fn new(params: &Params) -> Self {
        Self {
            method: Method::FB,
            detector: Detector::Surf(params.surf),
            params: params.fb.clone(),
            render: RenderParams { visibility: true, ..params.render.clone() },
            purpose: "mlesac",
            guide: None,
        }
    }

    /// What [`Estimator::estimate`] answers, with the consensus behind it.
    pub(super) fn propose(
        &self,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<Proposal, Cancelled> {
        let mut progress = Progress::default();
        let pose = trace.stage(Stage::Estimator(self.method), |trace| {
            let detected = trace.stage(Stage::Detect, |trace| {
                let detected = self.detect(problem, trace)?;
                trace.note_reuse(detected.query.reused && detected.reference.reused);
                Ok::<_, Halt>(detected)
            })?;
            let pose = self.match_and_solve(problem, &detected, &mut progress, trace);
            // A failed query emits its states too: they show where its features went.
            if !matches!(pose, Err(Halt::Cancelled)) {
                trace.emit(|| FeaturesClassified { states: progress.states.shared() })?;
            }
            pose
        });
        Ok(Proposal {
            outcome: Outcome {
                counts: Some(progress.counts),
                ..Outcome::of(separate_failure(pose)?)
            },
            consensus: progress.agreed,
        })
    }

    /// The four steps of the paper, and a second look where there is a guide.
    fn match_and_solve(
        &self,
        problem: &Problem,
        detected: &Detected,
        Progress { counts, agreed, states }: &mut Progress,
        trace: &mut Trace<'_>,
    ) -> Result<Pose, Halt> {
        let [query, reference] = [&detected.query, &detected.reference].map(|one| &one.features);
        counts.query_keypoints = query.keypoints.len();
        counts.reference_keypoints = reference.keypoints.len();
        *states = FeatureStates::new(query.keypoints.len());
        if detected.is_too_few() {
            return Err(Halt::from(Failure::TooFewFeatures {
                query: query.keypoints.len(),
                reference: reference.keypoints.len(),
            }));
        }

        let matches = trace.stage(Stage::Match, |trace| {
            let decisions = self.best_matches(problem, detected, trace)?;
            trace.note_reuse(decisions.reused);
            let decisions = Arc::clone(&decisions.value);
            trace.emit(|| MatchesDecided { decisions: Arc::clone(&decisions) })?;
            Ok::<_, Halt>(states.after_matching(&decisions))
        })?;
        counts.ratio_passed = states.counts(0).ratio_passed;
        counts.unique = matches.len();
        if matches.len() < MINIMUM {
            return Err(Halt::from(Failure::TooFewMatches {
                unique: matches.len(),
                keypoints: query.keypoints.len(),
            }));
        }

        let lifted = trace.stage(Stage::DepthLift, |trace| {
            let lifted = self.lift(&matches, reference, &problem.reference, trace)?;
            trace.emit(|| DepthsLifted { matches: Arc::clone(&lifted.matches) })?;
            Ok::<_, Halt>(lifted)
        })?;
        let Lifted { matches: lifted, all } = lifted;
        states.after_depth_lift(&lifted);
        let pairings: Vec<Pairing> =
            lifted.iter().filter_map(|lifted| Pairing::of(query, lifted)).collect();
        counts.with_depth = pairings.len();
        if pairings.len() < MINIMUM {
            return Err(Halt::from(Failure::TooFewDepths {
                with_depth: pairings.len(),
                unique: matches.len(),
            }));
        }

        let (free, correspondences) = (pairings.clone(), correspondences(&pairings));
        let consensus = trace.stage(Stage::Consensus, |trace| {
            let consensus = self.consensus(problem, &correspondences, trace)?;
            trace.emit(|| PoseRefined {
                reference_from_query: consensus.pose.inverse(),
                inliers: consensus.inliers.len(),
                correspondences: correspondences.len(),
                trials: consensus.trials,
            })?;
            Ok::<_, Halt>(consensus)
        })?;
        // Acceptance uses the first matching only. Guided matches agree with the pose by construction and would
        // accept half of all poses between unrelated streets.
        let camera = &problem.query.intrinsics;
        let beyond =
            self.beyond_chance(&correspondences, &consensus.inliers, camera, f64::NEG_INFINITY);
        let mut best = Posed {
            pose: consensus.pose,
            pairings,
            residuals_px: consensus.residuals_px,
            inliers: consensus.inliers.len(),
            trials: consensus.trials,
        };
        let threshold_px = self.params.mlesac.inlier_threshold_px;
        if let (Some(guide), Some(all)) = (&self.guide, all) {
            let last = guide.match_again(problem, detected, &all, best, trace)?;
            let residuals_px = residuals(&correspondences, camera, &last.pose);
            states.after_pose(&free, &residuals_px, threshold_px);
            trace.emit(|| MatchesGuided { matches: last_matches(&free, &last.pairings, &all) })?;
            best = last;
        }
        // A feature that was matched again ends in the state of its last match.
        states.after_pose(&best.pairings, &best.residuals_px, threshold_px);
        *counts = states.counts(reference.keypoints.len());
        *agreed = Some(best.pose.inverse());
        trace.stage(Stage::Accept, |trace| {
            self.accepted(&best.pose.inverse(), &beyond, problem, trace)
        })
    }

    fn consensus(
        &self,
        problem: &Problem,
        correspondences: &[Correspondence],
        trace: &mut Trace<'_>,
    ) -> Result<Consensus, Halt> {
        let (camera, params) = (&problem.query.intrinsics, &self.params.mlesac);
        let seed = problem.random_seed(self.purpose);
        let solve = |trace: &mut Trace<'_>| {
            let tell = |trial: Option<&Trial>| match trial {
                Some(trial) => trace.emit(|| HypothesisTried { trial: *trial }),
                None => trace.checkpoint(),
            };
            let found = mlesac(correspondences, camera, params, seed, tell);
            separate_failure(found.map_err(|error| Self::halt(error, correspondences.len())))
        };
        let bytes = |found: &Result<Consensus, Failure>| {
            found.as_ref().map_or(0, |found| {
                size_of_val(found.inliers.as_slice()) + size_of_val(found.residuals_px.as_slice())
            })
        };
        let inputs = (camera, params, seed, correspondences);
        let found = problem.query.memo.try_recall(inputs, bytes, || solve(trace))?;
        // Trials are not kept: a sink that wants them has them drawn again.
        if found.reused && trace.wants::<HypothesisTried>() {
            solve(trace)?.ok();
        }
        trace.note_reuse(found.reused);
        Ok((*found.value).clone()?)
    }
}

impl Pairing {
    /// That of a match; `None` where it has no depth.
    pub(super) fn of(query: &Features, lifted: &LiftedMatch) -> Option<Self> {
        let pixel = query.keypoints[lifted.query].pixel();
        let correspondence = Correspondence { pixel, point: lifted.point? };
        Some(Self { query: lifted.query, reference: lifted.reference, correspondence })
    }
}

/// The correspondences of pairings, in their order.
pub(super) fn correspondences(pairings: &[Pairing]) -> Vec<Correspondence> {
    pairings.iter().map(|pairing| pairing.correspondence).collect()
}
