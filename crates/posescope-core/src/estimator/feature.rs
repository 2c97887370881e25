//! FB, the indirect feature-based method (paper, section 2.1 and appendix A).

mod params;
mod several;
pub(super) mod states;

use std::convert::Infallible;
use std::sync::Arc;

use nalgebra::Point2;

pub use self::params::{DepthRule, FeatureParams};
pub(super) use self::several::Gathered;
use self::states::FeatureStates;
use super::consensus::FoundConsensus;
use super::{Estimator, Failure, FeatureCounts, Halt, Outcome, separate_failure};
use crate::cloud::Cloud;
use crate::depth::LiftedMatch;
use crate::depth::{DepthReading, ProjectedCloudIndex};
use crate::event::{
    DepthsLifted, FeaturesClassified, FeaturesDetected, HypothesisTried, MatchesDecided,
    PoseRefined, ProjectedCloud, Side, Stage,
};
use crate::features::{
    self, Features, FoundMatches, Match, MatchVerdict, PairMatches, SurfParams, kept_surf,
};
use crate::geometry::Pose;
use crate::memo::Recalled;
use crate::method::Method;
use crate::params::Params;
use crate::problem::{Problem, ReferenceTuple};
use crate::render::RenderParams;
use crate::robust::{Consensus, Trial, mlesac};
use crate::solver::Correspondence;
use crate::trace::{Cancelled, Trace};

/// The fewest correspondences that fix a pose: three for P3P, one to choose among its solutions.
pub(super) const MINIMUM: usize = 4;

/// Trials that are remembered at most, 5 MB: all that the parameters ask for by default. Where there
/// were more, they are drawn again when somebody wants to hear them.
const REMEMBERED_TRIALS: usize = 20_000;

/// What matching decided about each query feature.
type Decided = Arc<[Option<Match>]>;

/// Matches lifted between two checkpoints.
const LIFTED_AT_A_TIME: usize = 256;

/// The feature-based estimator.
pub struct FeatureBased {
    surf: SurfParams,
    params: FeatureParams,
    render: RenderParams,
}

impl Estimator for FeatureBased {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        Ok(self.propose(problem, trace)?.outcome)
    }
}

/// What FB makes of a problem, and the pose that it judged.
pub(super) struct Proposal {
    /// The answer.
    pub(super) outcome: Outcome,
    /// The consensus that was accepted or refused; `None` where there was none.
    pub(super) consensus: Option<Agreed>,
}

/// A consensus, in short.
#[derive(Clone, Copy, Debug)]
pub(super) struct Agreed {
    /// The query camera in the reference camera's frame.
    pub(super) reference_from_query: Pose,
}

/// What is known of a run, up to where it stops.
struct Found<'a> {
    counts: &'a mut FeatureCounts,
    agreed: &'a mut Option<Agreed>,
}

/// What MLESAC found.
struct Solved {
    outcome: Result<Consensus, Failure>,
    /// All it tried on the way, if a sink wants it and it is not too much.
    trials: Option<Vec<Trial>>,
}

impl Solved {
    fn heap_bytes(&self) -> usize {
        let found = self.outcome.as_ref().map_or(0, |consensus| {
            size_of_val(consensus.inliers.as_slice())
                + size_of_val(consensus.residuals_px.as_slice())
        });
        self.trials.as_deref().map_or(0, size_of_val) + found
    }
}

impl FeatureBased {
    /// The estimator with these parameters.
    pub fn new(params: &Params) -> Self {
        Self { surf: params.surf, params: params.fb.clone(), render: params.render.clone() }
    }

    /// What [`Estimator::estimate`] answers, with the consensus behind it.
    pub(super) fn propose(
        &self,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<Proposal, Cancelled> {
        let mut counts = FeatureCounts::default();
        let mut consensus = None;
        let pose = trace.stage(Stage::Estimator(Method::FB), |trace| {
            self.localize(problem, &mut counts, &mut consensus, trace)
        });
        Ok(Proposal {
            outcome: Outcome {
                pose: separate_failure(pose)?,
                counts: Some(counts),
                cost: None,
                fell_back: false,
            },
            consensus,
        })
    }

    /// The four steps of the paper. `counts` and `agreed` are true up to where it stops.
    fn localize(
        &self,
        problem: &Problem,
        counts: &mut FeatureCounts,
        agreed: &mut Option<Agreed>,
        trace: &mut Trace<'_>,
    ) -> Result<Pose, Halt> {
        let (query, reference) = trace.stage(Stage::Detect, |trace| {
            let query = self.detect(Side::Query, problem, trace)?;
            let reference = self.detect(Side::Reference, problem, trace)?;
            trace.note_reuse(query.reused && reference.reused);
            let (query, reference) = (query.value, reference.value);
            counts.query_keypoints = query.keypoints.len();
            counts.reference_keypoints = reference.keypoints.len();
            Ok::<_, Halt>((query, reference))
        })?;
        let mut states = FeatureStates::new(query.keypoints.len());
        let found = Found { counts, agreed };
        let outcome = self.match_and_solve(problem, &query, &reference, &mut states, found, trace);
        // The states are told for a failed query too: they show where its features went.
        if !matches!(outcome, Err(Halt::Cancelled)) {
            trace.emit(|| FeaturesClassified { states: states.shared() })?;
        }
        outcome
    }

    fn match_and_solve(
        &self,
        problem: &Problem,
        query: &Features,
        reference: &Features,
        states: &mut FeatureStates,
        Found { counts, agreed }: Found<'_>,
        trace: &mut Trace<'_>,
    ) -> Result<Pose, Halt> {
        if query.keypoints.len() < MINIMUM || reference.keypoints.len() < MINIMUM {
            return Err(Halt::from(Failure::TooFewFeatures {
                query: query.keypoints.len(),
                reference: reference.keypoints.len(),
            }));
        }

        let matches = trace.stage(Stage::Match, |trace| {
            let decisions = self.best_matches(problem, query, reference, trace)?;
            trace.note_reuse(decisions.reused);
            let decisions = Arc::clone(&decisions.value);
            trace.emit(|| MatchesDecided { decisions: Arc::clone(&decisions) })?;
            Ok::<_, Halt>(states.after_matching(&decisions))
        })?;
        counts.ratio_passed = states.passed_ratio_test();
        counts.unique = matches.len();
        if matches.len() < MINIMUM {
            return Err(Halt::from(Failure::TooFewMatches {
                unique: matches.len(),
                keypoints: query.keypoints.len(),
            }));
        }

        let lifted = trace.stage(Stage::DepthLift, |trace| {
            let lifted = self.lift(&matches, reference, &problem.reference, trace)?;
            trace.emit(|| DepthsLifted { matches: Arc::clone(&lifted) })?;
            Ok::<_, Halt>(lifted)
        })?;
        states.after_depth_lift(&lifted);
        let (members, correspondences): (Vec<usize>, Vec<Correspondence>) = lifted
            .iter()
            .filter_map(|lifted| {
                let pixel = query.keypoints[lifted.query].pixel();
                let point = lifted.point?;
                Some((lifted.query, Correspondence { pixel, point }))
            })
            .unzip();
        counts.with_depth = correspondences.len();
        if correspondences.len() < MINIMUM {
            return Err(Halt::from(Failure::TooFewDepths {
                with_depth: correspondences.len(),
                unique: matches.len(),
            }));
        }

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
        states.after_consensus(&members, &consensus);
        counts.inliers = consensus.inliers.len();
        *agreed = Some(Agreed { reference_from_query: consensus.pose.inverse() });

        trace
            .stage(Stage::Accept, |trace| self.accept(problem, &correspondences, &consensus, trace))
    }

    fn detect(
        &self,
        side: Side,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<Recalled<Features>, Halt> {
        let (photo, memo) = match side {
            Side::Query => (&problem.query.photo, &problem.query.memo),
            Side::Reference => (&problem.reference.photo, &problem.reference.memo),
        };
        let features = match found_elsewhere(problem)? {
            Some(found) => Recalled::made(Arc::clone(match side {
                Side::Query => &found.query,
                Side::Reference => &found.reference,
            })),
            None => {
                let checkpoint = || trace.checkpoint();
                kept_surf(&photo.gray, memo, &self.surf, checkpoint)?
            }
        };
        trace.emit(|| FeaturesDetected { side, features: Arc::clone(&features.value) })?;
        Ok(features)
    }

    fn best_matches(
        &self,
        problem: &Problem,
        query: &Features,
        reference: &Features,
        trace: &mut Trace<'_>,
    ) -> Result<Recalled<Decided>, Halt> {
        if let Some(found) = found_elsewhere(problem)? {
            return Ok(Recalled::made(Arc::new(Arc::clone(&found.decisions))));
        }
        let FeatureParams { ratio, unique, .. } = self.params;
        let bytes = |decided: &Decided| size_of_val(&**decided);
        let found = problem.try_recall((self.surf, ratio, unique), bytes, || {
            matches_of(query, reference, &self.params, || trace.checkpoint())
        });
        Ok(found?)
    }

    /// P = K⁻¹ p_R z: the keypoint's own pixel at the depth of the nearest projected point.
    fn lift(
        &self,
        matches: &[(usize, usize)],
        reference: &Features,
        tuple: &ReferenceTuple,
        trace: &mut Trace<'_>,
    ) -> Result<Arc<[LiftedMatch]>, Cancelled> {
        let cloud = projected_cloud(tuple, self.params.visible.then_some(&self.render));
        trace.emit(|| ProjectedCloud { points: tuple.cloud.len(), in_view: cloud.len() })?;
        let mut lifted = Vec::with_capacity(matches.len());
        for matches in matches.chunks(LIFTED_AT_A_TIME) {
            trace.checkpoint()?;
            lifted.extend(matches.iter().map(|&(query_index, reference_index)| {
                let pixel: Point2<f64> = reference.keypoints[reference_index].pixel();
                let reading = cloud.read(&pixel, self.params.depth_radius_px);
                LiftedMatch {
                    query: query_index,
                    reference: reference_index,
                    lidar_distance_px: reading.distance_px,
                    depth_range_m: reading.within.map(|depths| (depths.least, depths.greatest)),
                    point: self.depth(&reading).map(|z| tuple.intrinsics.unproject(&pixel, z)),
                }
            }));
        }
        Ok(lifted.into())
    }

    fn depth(&self, reading: &DepthReading) -> Option<f64> {
        let depths = reading.within?;
        match self.params.depth {
            DepthRule::Guarded if depths.relative_spread() > self.params.depth_spread => None,
            DepthRule::Guarded | DepthRule::Nearest => Some(depths.nearest),
        }
    }

    fn consensus(
        &self,
        problem: &Problem,
        correspondences: &[Correspondence],
        trace: &mut Trace<'_>,
    ) -> Result<Consensus, Halt> {
        let intrinsics = &problem.query.intrinsics;
        let params = &self.params.mlesac;
        let seed = problem.random_seed("mlesac");
        // Whoever does not listen has no use for the trials.
        let is_heard = trace.wants::<HypothesisTried>();
        let inputs = (intrinsics, params, seed, correspondences, is_heard);
        let solved = problem.query.memo.try_recall(inputs, Solved::heap_bytes, || {
            let trials = is_heard.then(Vec::new);
            self.solve(problem, correspondences, trials, trace)
        })?;
        let outcome = match &solved.value.trials {
            None if solved.reused && is_heard => {
                let again = self.solve(problem, correspondences, None, trace)?;
                return Ok(again.outcome?);
            }
            Some(trials) if solved.reused => {
                for &trial in trials {
                    trace.emit(|| HypothesisTried { trial })?;
                }
                &solved.value.outcome
            }
            _ => &solved.value.outcome,
        };
        trace.note_reuse(solved.reused);
        Ok(outcome.clone()?)
    }

    /// Runs MLESAC and tells its trials as it goes; `trials` takes them, unless there are too many.
    fn solve(
        &self,
        problem: &Problem,
        correspondences: &[Correspondence],
        mut trials: Option<Vec<Trial>>,
        trace: &mut Trace<'_>,
    ) -> Result<Solved, Cancelled> {
        let intrinsics = &problem.query.intrinsics;
        let params = &self.params.mlesac;
        let seed = problem.random_seed("mlesac");
        let found = mlesac(correspondences, intrinsics, params, seed, |trial| {
            trials.take_if(|trials| trials.len() == REMEMBERED_TRIALS);
            if let Some(trials) = &mut trials {
                trials.push(*trial);
            }
            trace.emit(|| HypothesisTried { trial: *trial })
        });
        let outcome = match found.map_err(|error| Self::halt(error, correspondences.len())) {
            Ok(consensus) => Ok(consensus),
            Err(Halt::Failed(failure)) => Err(failure),
            Err(Halt::Cancelled) => return Err(Cancelled),
        };
        Ok(Solved { outcome, trials })
    }

    fn accept(
        &self,
        problem: &Problem,
        correspondences: &[Correspondence],
        consensus: &Consensus,
        trace: &mut Trace<'_>,
    ) -> Result<Pose, Halt> {
        let intrinsics = &problem.query.intrinsics;
        let beyond =
            self.beyond_chance(correspondences, &consensus.inliers, intrinsics, f64::NEG_INFINITY);
        let found = FoundConsensus {
            reference_from_query: consensus.pose.inverse(),
            acceptance: beyond.acceptance,
            tested: beyond.tested,
            counted: beyond.counted,
            is_enough: self.accepts(&beyond.acceptance),
            slack: self.slack(),
        };
        found.judged(problem, trace)
    }
}

/// The matches that somebody brought, if any: what finds and matches features else.
fn found_elsewhere(problem: &Problem) -> Result<Option<&FoundMatches>, Failure> {
    match problem.matches.as_deref() {
        None => Ok(None),
        Some(PairMatches::Found(found)) => Ok(Some(found)),
        Some(PairMatches::Absent) => Err(Failure::NotAnswered {
            answers: "the folder of matches".to_owned(),
            missing: format!("matches of {} with {}", problem.query.name, problem.reference.name),
        }),
    }
}

/// The best match of each query feature, and whether it stands out.
fn matches_of<E>(
    query: &Features,
    reference: &Features,
    params: &FeatureParams,
    checkpoint: impl FnMut() -> Result<(), E>,
) -> Result<Decided, E> {
    let (query, reference) = (&query.descriptors, &reference.descriptors);
    let ratio = params.ratio as f32;
    let mut matches = features::best_matches(query, reference, ratio, checkpoint)?;
    if !params.unique {
        for found in matches.iter_mut().flatten() {
            if let MatchVerdict::NotUnique { .. } = found.verdict {
                found.verdict = MatchVerdict::Candidate;
            }
        }
    }
    Ok(matches.into())
}

/// The cloud of a reference tuple projected into its own photo, remembered with the tuple; where
/// `visible` says how, without the points that something nearer hides from the camera, which the scanner
/// beside it may have met all the same.
pub fn projected_cloud(
    tuple: &ReferenceTuple,
    visible: Option<&RenderParams>,
) -> Arc<ProjectedCloudIndex> {
    let visible = visible.map(|render| RenderParams { visibility: true, ..render.clone() });
    let cloud = tuple.memo.recall(&visible, ProjectedCloudIndex::heap_bytes, || match &visible {
        None => ProjectedCloudIndex::new(&tuple.cloud, &tuple.intrinsics),
        Some(render) => {
            let points = tuple.visible_cloud(render).positions().collect();
            ProjectedCloudIndex::new(&Cloud { points }, &tuple.intrinsics)
        }
    });
    cloud.value
}

/// How many features of the query have a match in the reference: FB's count after the ratio test and
/// uniqueness, before any depth is looked up. Fusion weighs references by it.
pub fn count_matches(query: &Features, reference: &Features, params: &FeatureParams) -> usize {
    if query.keypoints.len() < MINIMUM || reference.keypoints.len() < MINIMUM {
        return 0;
    }
    let Ok(matches) = matches_of(query, reference, params, || Ok::<_, Infallible>(()));
    matches.iter().flatten().filter(|found| found.verdict == MatchVerdict::Candidate).count()
}
