//! `fb2`: the feature-based method with a better feature and a second look.
//!
//! As FB, but
//!
//! 1. features are SIFT, compared by the Hellinger kernel ([`crate::features::sift()`]),
//! 2. depth comes from the points alone that the reference camera sees,
//! 3. and after a first consensus, accepted or not, each reference feature with a depth is sought again
//!    where the pose says that it must be, at the scale that it must have there, among the few query
//!    features that are. Among so few the ratio may be loose.

mod params;
mod windows;

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Point2;

pub use params::GuidedParams;
use windows::Windows;

use super::consensus::FoundConsensus;
use super::feature::Agreed;
use super::feature::states::FeatureStates;
use super::{Estimator, Failure, FeatureCounts, Halt, Outcome, own, separate_failure};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::depth::{LiftedMatch, ProjectedCloudIndex};
use crate::event::{
    DepthsLifted, FeaturesClassified, FeaturesDetected, HypothesisTried, MatchesDecided,
    MatchesGuided, PoseRefined, ProjectedCloud, Side, Stage,
};
use crate::features::{Features, Keypoint, Match, SiftFeatures, best_matches, sift_interruptible};
use crate::geometry::Pose;
use crate::image::Photo;
use crate::memo::Memo;
use crate::method::Method;
use crate::params::Params;
use crate::problem::{Problem, ReferenceTuple};
use crate::render::RenderParams;
use crate::robust::{
    Acceptance, Counted, MlesacError, effective_area_px, inliers_beyond_chance, mlesac, residuals,
};
use crate::solver::{Correspondence, refine};
use crate::trace::{Cancelled, Trace};

/// The estimator in the registry.
pub(super) const ENTRY: super::Entry = super::Entry {
    method: Method::named("fb2"),
    about: "indirect: SIFT, depth of visible points, and a second matching where the first pose says",
    parts: super::Parts::Own(own::Own {
        make: |params| Box::new(Guided::new(params)),
        shows: None,
        has_features: true,
        least_probability: |params| Some(params.fb2.least_probability),
    }),
};

/// The fewest correspondences that fix a pose.
const MINIMUM: usize = 4;
/// Matchings after the first: each starts from the pose of the one before.
const GUIDED_ROUNDS: usize = 2;
/// Features that are sought again between two checkpoints.
const SOUGHT_AT_A_TIME: usize = 512;

/// The estimator with two matchings.
pub struct Guided {
    params: GuidedParams,
    render: RenderParams,
}

/// Both photos' features, and what is known of the reference's.
pub(super) struct Detected {
    query: Arc<SiftFeatures>,
    reference: Arc<SiftFeatures>,
    /// The 3-D point of each reference feature, where it has one.
    lifted: Arc<Vec<LiftedMatch>>,
}

/// What is known of a run, up to where it stops.
struct Run<'a> {
    counts: &'a mut FeatureCounts,
    agreed: &'a mut Option<Agreed>,
    states: &'a mut FeatureStates,
}

/// A match and the pixels that it says belong together.
#[derive(Clone, Copy)]
struct Pairing {
    query: usize,
    reference: usize,
    correspondence: Correspondence,
}

/// A pose with the matches that it was found among.
struct Solved {
    /// `camera_from_reference`.
    pose: Pose,
    pairings: Vec<Pairing>,
    residuals_px: Vec<f64>,
    inliers: Vec<usize>,
    trials: usize,
    /// Whether the inliers are more than chance explains.
    acceptance: Acceptance,
}

impl Guided {
    /// The estimator with these parameters.
    pub fn new(params: &Params) -> Self {
        Self { params: params.fb2.clone(), render: params.render.clone() }
    }

    /// What the estimator answers, with the consensus behind it, accepted or not.
    pub(super) fn propose(
        &self,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<(Outcome, Option<Agreed>), Cancelled> {
        let mut counts = FeatureCounts::default();
        let mut agreed = None;
        let pose = trace.stage(Stage::Estimator(ENTRY.method), |trace| {
            let detected = self.detect(problem, &mut counts, trace)?;
            let mut states = FeatureStates::new(detected.query.keypoints.len());
            let run = Run { counts: &mut counts, agreed: &mut agreed, states: &mut states };
            let outcome = self.match_and_solve(problem, &detected, run, trace);
            // A failed query has states too: they show where its features went.
            if !matches!(outcome, Err(Halt::Cancelled)) {
                trace.emit(|| FeaturesClassified { states: states.shared() })?;
            }
            outcome
        });
        let outcome = Outcome {
            pose: separate_failure(pose)?,
            counts: Some(counts),
            cost: None,
            fell_back: false,
        };
        Ok((outcome, agreed))
    }

    fn match_and_solve(
        &self,
        problem: &Problem,
        detected: &Detected,
        mut run: Run<'_>,
        trace: &mut Trace<'_>,
    ) -> Result<Pose, Halt> {
        let first = self.match_freely(problem, detected, &mut run, trace)?;
        let free = first.pairings.clone();
        let solved = self.match_again(problem, detected, first, trace)?;
        let camera = &problem.query.intrinsics;
        let correspondences: Vec<_> = free.iter().map(|p| p.correspondence).collect();
        let residuals_px = residuals(&correspondences, camera, &solved.pose);
        let threshold_px = self.params.mlesac.inlier_threshold_px;
        // A feature that was matched again ends in the state of its last match.
        let queries = |pairings: &[Pairing]| pairings.iter().map(|p| p.query).collect::<Vec<_>>();
        for (queries, residuals_px) in [
            (queries(&free), residuals_px),
            (queries(&solved.pairings), solved.residuals_px.clone()),
        ] {
            let each = queries.into_iter().zip(residuals_px);
            run.states.after_pose(each, threshold_px);
        }
        *run.counts = run.states.counts(detected.reference.keypoints.len());
        *run.agreed = Some(Agreed { reference_from_query: solved.pose.inverse() });
        trace.emit(|| MatchesGuided { matches: detected.last_matches(&free, &solved.pairings) })?;
        trace.stage(Stage::Accept, |trace| self.accept(problem, &solved, trace))
    }

    fn detect(
        &self,
        problem: &Problem,
        counts: &mut FeatureCounts,
        trace: &mut Trace<'_>,
    ) -> Result<Detected, Halt> {
        trace.stage(Stage::Detect, |trace| {
            let mut of = |side, photo: &Photo, memo: &Memo| -> Result<_, Cancelled> {
                let sift = &self.params.sift;
                let found = memo.try_recall(sift, SiftFeatures::heap_bytes, || {
                    sift_interruptible(&photo.gray, sift, || trace.checkpoint())
                })?;
                trace.emit(|| FeaturesDetected {
                    side,
                    features: Arc::new(Features {
                        keypoints: found.value.keypoints.clone(),
                        descriptors: Vec::new(),
                    }),
                })?;
                Ok(found)
            };
            let query = of(Side::Query, &problem.query.photo, &problem.query.memo)?;
            let tuple = &problem.reference;
            let reference = of(Side::Reference, &tuple.photo, &tuple.memo)?;
            trace.note_reuse(query.reused && reference.reused);
            counts.query_keypoints = query.value.keypoints.len();
            counts.reference_keypoints = reference.value.keypoints.len();
            if counts.query_keypoints < MINIMUM || counts.reference_keypoints < MINIMUM {
                return Err(Halt::from(Failure::TooFewFeatures {
                    query: counts.query_keypoints,
                    reference: counts.reference_keypoints,
                }));
            }
            Ok(Detected {
                lifted: self.lifted(tuple, &reference.value),
                query: query.value,
                reference: reference.value,
            })
        })
    }

    /// The point of each reference feature, by the visible points alone.
    fn lifted(&self, tuple: &ReferenceTuple, features: &SiftFeatures) -> Arc<Vec<LiftedMatch>> {
        let GuidedParams { sift, depth_radius_px, depth_spread, .. } = &self.params;
        let bytes = |lifted: &Vec<LiftedMatch>| size_of_val(lifted.as_slice());
        let inputs = (sift, &self.render, depth_radius_px, depth_spread);
        let lifted = tuple.memo.recall(inputs, bytes, || {
            let visible = Cloud { points: tuple.visible_cloud(&self.render).positions().collect() };
            let index = ProjectedCloudIndex::new(&visible, &tuple.intrinsics);
            let lift = |(number, keypoint): (usize, &Keypoint)| {
                let pixel = keypoint.pixel();
                let reading = index.read(&pixel, *depth_radius_px);
                let depths = reading.within;
                let even = depths.filter(|depths| depths.relative_spread() <= *depth_spread);
                LiftedMatch {
                    query: 0,
                    reference: number,
                    lidar_distance_px: reading.distance_px,
                    depth_range_m: depths.map(|depths| (depths.least, depths.greatest)),
                    point: even.map(|depths| tuple.intrinsics.unproject(&pixel, depths.nearest)),
                }
            };
            features.keypoints.iter().enumerate().map(lift).collect()
        });
        lifted.value
    }

    /// The first matching, over the whole image, and its consensus.
    fn match_freely(
        &self,
        problem: &Problem,
        detected: &Detected,
        Run { counts, states, .. }: &mut Run<'_>,
        trace: &mut Trace<'_>,
    ) -> Result<Solved, Halt> {
        let decisions = trace.stage(Stage::Match, |trace| {
            let (query, reference) = (&detected.query, &detected.reference);
            let checkpoint = || trace.checkpoint();
            let (query, reference) = (&query.descriptors, &reference.descriptors);
            let ratio = self.params.ratio as f32;
            let decisions: Arc<[Option<Match>]> =
                best_matches(query, reference, ratio, checkpoint)?.into();
            trace.emit(|| MatchesDecided { decisions: Arc::clone(&decisions) })?;
            Ok::<_, Halt>(decisions)
        })?;
        let unique = states.after_matching(&decisions);
        counts.ratio_passed = states.passed_ratio_test();
        counts.unique = unique.len();
        if unique.len() < MINIMUM {
            return Err(Halt::from(Failure::TooFewMatches {
                unique: unique.len(),
                keypoints: counts.query_keypoints,
            }));
        }
        let pairings = trace.stage(Stage::DepthLift, |trace| {
            trace.emit(|| ProjectedCloud {
                points: problem.reference.cloud.len(),
                in_view: problem.reference.visible_cloud(&self.render).positions().len(),
            })?;
            let lifted: Arc<[LiftedMatch]> = unique
                .iter()
                .map(|&(query, reference)| LiftedMatch { query, ..detected.lifted[reference] })
                .collect();
            trace.emit(|| DepthsLifted { matches: Arc::clone(&lifted) })?;
            states.after_depth_lift(&lifted);
            let pairings =
                lifted.iter().filter_map(|lifted| detected.pairing(lifted.query, lifted.reference));
            Ok::<_, Halt>(pairings.collect::<Vec<_>>())
        })?;
        counts.with_depth = pairings.len();
        if pairings.len() < MINIMUM {
            return Err(Halt::from(Failure::TooFewDepths {
                with_depth: pairings.len(),
                unique: unique.len(),
            }));
        }
        let pixels: Vec<Point2<f64>> = pairings.iter().map(|p| p.correspondence.pixel).collect();
        let area_px = effective_area_px(&pixels, problem.query.intrinsics.area());
        trace.stage(Stage::Consensus, |trace| self.consensus(problem, pairings, area_px, trace))
    }

    fn consensus(
        &self,
        problem: &Problem,
        pairings: Vec<Pairing>,
        area_px: f64,
        trace: &mut Trace<'_>,
    ) -> Result<Solved, Halt> {
        let correspondences: Vec<_> = pairings.iter().map(|p| p.correspondence).collect();
        let found = mlesac(
            &correspondences,
            &problem.query.intrinsics,
            &self.params.mlesac,
            problem.random_seed("mlesac of fb2"),
            |trial| trace.emit(|| HypothesisTried { trial: *trial }),
        );
        let no_consensus = |best_inliers, trials| {
            Halt::from(Failure::NoConsensus {
                correspondences: correspondences.len(),
                best_inliers,
                trials,
            })
        };
        let consensus = match found {
            Ok(consensus) => consensus,
            Err(MlesacError::TooFewCorrespondences { .. }) => return Err(no_consensus(0, 0)),
            Err(MlesacError::NoModel { trials, best_inliers }) => {
                return Err(no_consensus(best_inliers, trials));
            }
            Err(MlesacError::Cancelled(cancelled)) => return Err(Halt::from(cancelled)),
        };
        trace.emit(|| PoseRefined {
            reference_from_query: consensus.pose.inverse(),
            inliers: consensus.inliers.len(),
            correspondences: correspondences.len(),
            trials: consensus.trials,
        })?;
        let acceptance = self.chance(consensus.inliers.len(), pairings.len(), area_px);
        Ok(Solved {
            pose: consensus.pose,
            pairings,
            residuals_px: consensus.residuals_px,
            inliers: consensus.inliers,
            trials: consensus.trials,
            acceptance,
        })
    }

    /// Matches again where the pose says, and refines it on what agrees, as long as more agree.
    ///
    /// Whether the pose is more than chance says the first matching alone: what is sought where a pose
    /// wants it agrees with that pose, and between unrelated streets every second pose would pass.
    fn match_again(
        &self,
        problem: &Problem,
        detected: &Detected,
        first: Solved,
        trace: &mut Trace<'_>,
    ) -> Result<Solved, Halt> {
        let mut best = first;
        if self.params.guided {
            for _ in 0..GUIDED_ROUNDS {
                let better = trace.stage(Stage::MatchGuided, |trace| {
                    let guided = self.guided(problem, detected, &best, trace)?;
                    let better = guided.filter(|one| one.inliers.len() > best.inliers.len());
                    if let Some(guided) = &better {
                        trace.emit(|| PoseRefined {
                            reference_from_query: guided.pose.inverse(),
                            inliers: guided.inliers.len(),
                            correspondences: guided.pairings.len(),
                            trials: guided.trials,
                        })?;
                    }
                    Ok::<_, Halt>(better)
                })?;
                match better {
                    Some(guided) => best = guided,
                    None => break,
                }
            }
        }
        Ok(best)
    }

    /// Matches where the pose of an earlier matching says that features must be.
    fn guided(
        &self,
        problem: &Problem,
        detected: &Detected,
        before: &Solved,
        trace: &mut Trace<'_>,
    ) -> Result<Option<Solved>, Cancelled> {
        let Solved { pose, acceptance, .. } = before;
        let camera = &problem.query.intrinsics;
        let windows = Windows::new(&detected.query.keypoints, camera, self.params.window_px);
        // The best reference feature of each query feature.
        let mut best: Vec<Option<(usize, f32)>> = vec![None; detected.query.keypoints.len()];
        let numbers: Vec<usize> = (0..detected.reference.keypoints.len()).collect();
        for some in numbers.chunks(SOUGHT_AT_A_TIME) {
            trace.checkpoint()?;
            for &number in some {
                let Some((query, distance)) = self.sought(detected, &windows, camera, pose, number)
                else {
                    continue;
                };
                if best[query].is_none_or(|(_, least)| distance < least) {
                    best[query] = Some((number, distance));
                }
            }
        }
        let pairings: Vec<Pairing> = best
            .iter()
            .enumerate()
            .filter_map(|(query, found)| detected.pairing(query, (*found)?.0))
            .collect();
        if pairings.len() < MINIMUM {
            return Ok(None);
        }
        let correspondences: Vec<_> = pairings.iter().map(|p| p.correspondence).collect();
        let threshold = self.params.mlesac.inlier_threshold_px;
        let mut pose = *pose;
        let mut residuals_px = residuals(&correspondences, camera, &pose);
        // From the window inwards, so that a first pose that is a few pixels off is pulled in.
        for reach in [0.5 * self.params.window_px, threshold, threshold] {
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
        let inliers: Vec<usize> =
            (0..pairings.len()).filter(|&i| residuals_px[i] <= threshold).collect();
        Ok(Some(Solved {
            pose,
            acceptance: *acceptance,
            residuals_px,
            pairings,
            inliers,
            trials: before.trials,
        }))
    }

    /// The query feature that a reference feature is, if one stands out where it must be.
    fn sought(
        &self,
        detected: &Detected,
        windows: &Windows,
        camera: &Intrinsics,
        pose: &Pose,
        number: usize,
    ) -> Option<(usize, f32)> {
        let point = detected.lifted[number].point?;
        let seen = pose * point;
        let pixel = camera.project(&seen)?;
        let keypoint = detected.reference.keypoints[number];
        let scale = f64::from(keypoint.scale) * point.z / seen.z;
        let descriptor = &detected.reference.descriptors[number];
        let (mut nearest, mut second) = (None, f32::INFINITY);
        let mut least = f32::INFINITY;
        for query in windows.around(&pixel) {
            let candidate = detected.query.keypoints[query];
            let ratio = f64::from(candidate.scale) / scale;
            if (candidate.pixel() - pixel).norm() > self.params.window_px
                || ratio.max(1.0 / ratio) > self.params.scale_ratio
            {
                continue;
            }
            let other = &detected.query.descriptors[query];
            let product: f32 = descriptor.iter().zip(other).map(|(a, b)| a * b).sum();
            let distance = (2.0 - 2.0 * product).max(0.0).sqrt();
            // One feature with two directions is no rival of itself.
            let is_same = nearest.is_some_and(|known: usize| {
                (detected.query.keypoints[known].pixel() - candidate.pixel()).norm() < 1.0
            });
            if distance < least {
                if !is_same {
                    second = least;
                }
                (nearest, least) = (Some(query), distance);
            } else if distance < second && !is_same {
                second = distance;
            }
        }
        let stands_out = least < self.params.window_ratio as f32 * second;
        nearest.filter(|_| stands_out && least < MOST_DISTANCE).map(|query| (query, least))
    }

    /// Whether so many inliers are more than chance explains, where a false match lies anywhere in an
    /// area \[px²\].
    fn chance(&self, inliers: usize, correspondences: usize, area_px: f64) -> Acceptance {
        let threshold = self.params.mlesac.inlier_threshold_px;
        inliers_beyond_chance(inliers, correspondences, threshold, area_px)
    }

    /// Whether a pose with these inliers in the first matching would be accepted, its place aside.
    pub(crate) fn would_accept(
        &self,
        correspondences: &[Correspondence],
        inliers: &[usize],
        intrinsics: &Intrinsics,
    ) -> bool {
        let pixels: Vec<_> = correspondences.iter().map(|c| c.pixel).collect();
        let area_px = effective_area_px(&pixels, intrinsics.area());
        let acceptance = self.chance(inliers.len(), correspondences.len(), area_px);
        acceptance.needed.is_some_and(|needed| inliers.len() >= needed)
    }

    fn accept(
        &self,
        problem: &Problem,
        solved: &Solved,
        trace: &mut Trace<'_>,
    ) -> Result<Pose, Halt> {
        let acceptance = solved.acceptance;
        let found = FoundConsensus {
            reference_from_query: solved.pose.inverse(),
            acceptance,
            tested: solved.pairings.len(),
            counted: Counted::Correspondences,
            is_enough: acceptance.needed.is_some_and(|needed| acceptance.inliers >= needed),
            slack: Some(self.params.radius_slack),
        };
        found.judged(problem, trace)
    }
}

/// Descriptors farther apart than this do not show the same thing, however alone they are.
const MOST_DISTANCE: f32 = 0.8;

impl Estimator for Guided {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        Ok(self.propose(problem, trace)?.0)
    }
}

impl Detected {
    fn pairing(&self, query: usize, reference: usize) -> Option<Pairing> {
        Some(Pairing {
            query,
            reference,
            correspondence: Correspondence {
                pixel: self.query.keypoints[query].pixel(),
                point: self.lifted[reference].point?,
            },
        })
    }

    /// The last match of each query feature that has a depth: where the pose says, else the free one.
    fn last_matches(&self, free: &[Pairing], last: &[Pairing]) -> Arc<[LiftedMatch]> {
        let by_query = |pairings: &[Pairing]| -> BTreeMap<usize, usize> {
            pairings.iter().map(|p| (p.query, p.reference)).collect()
        };
        let mut matches = by_query(free);
        matches.extend(by_query(last));
        let lifted =
            |(query, reference): (usize, usize)| LiftedMatch { query, ..self.lifted[reference] };
        matches.into_iter().map(lifted).collect()
    }
}
