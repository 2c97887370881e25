//! FB, the indirect feature-based method (paper, section 2.2 and appendix A).

use std::sync::Arc;

use nalgebra::Point2;

use super::{Estimator, Failure, FeatureCounts, Halt, Outcome, settle};
use crate::depth::{DepthReading, ProjectedCloudIndex};
use crate::event::{
    ConsensusJudged, DepthsLifted, FeatureState, FeaturesClassified, FeaturesDetected,
    HypothesisTried, LiftedMatch, MatchesDecided, Method, PoseRefined, ProjectedCloud, Side, Stage,
};
use crate::features::{
    Features, Match, MatchVerdict, SurfParams, classify, nearest_neighbours, surf,
};
use crate::geometry::Pose;
use crate::params::{About, Choice, Describe, ParamVisitor, Params};
use crate::problem::{Problem, ReferenceTuple};
use crate::robust::{
    AcceptanceRule, Consensus, MlesacError, MlesacParams, effective_area_px, inliers_beyond_chance,
    mlesac,
};
use crate::solver::Correspondence;
use crate::trace::{Cancelled, Trace};

/// The fewest correspondences that fix a pose: three for P3P, one to choose among its solutions.
const MINIMUM: usize = 4;

/// Which depth a reference keypoint takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthRule {
    /// That of the nearest projected point.
    Nearest,
    /// The same, refused where the depths around it differ too much: near a depth edge the nearest
    /// point may belong to the other surface.
    Guarded,
}

macro_rules! choice {
    ($type:ty, $($variant:path => $name:literal),+) => {
        impl Choice for $type {
            fn names(&self) -> &'static [&'static str] { &[$($name),+] }
            fn index(&self) -> usize { *self as usize }
            fn choose(&mut self, index: usize) { *self = [$($variant),+][index]; }
        }
    };
}
choice!(AcceptanceRule, AcceptanceRule::Consensus => "consensus", AcceptanceRule::Paper => "paper");
choice!(DepthRule, DepthRule::Nearest => "nearest", DepthRule::Guarded => "guarded");

/// Parameters of matching, depth lift, consensus and acceptance.
#[derive(Clone, Debug, PartialEq)]
pub struct FeatureParams {
    /// Greatest ratio of nearest to second-nearest descriptor distance.
    ///
    /// On distances, not squared. 0.89 gave the smallest errors on a real pair in both directions;
    /// 0.6 on squared distances, a common default, is 0.775 here.
    pub ratio: f64,
    /// Whether a match must be the best in both directions.
    pub unique: bool,
    /// How far a projected point may be from the keypoint it lends its depth \[px\].
    pub depth_radius_px: f64,
    /// Which depth a keypoint takes.
    pub depth: DepthRule,
    /// Greatest spread of depths within the radius that the guarded rule accepts, as a share.
    pub depth_spread: f64,
    /// MLESAC.
    pub mlesac: MlesacParams,
    /// When a consensus becomes a pose.
    pub accept: AcceptanceRule,
    /// How far outside the uncertainty radius a pose is still accepted, as a share of it: the
    /// reference is taken within the radius of the true position, which is itself uncertain.
    pub radius_slack: f64,
}

impl Default for FeatureParams {
    fn default() -> Self {
        Self {
            ratio: 0.89,
            unique: true,
            depth_radius_px: 3.0,
            depth: DepthRule::Nearest,
            depth_spread: 0.1,
            mlesac: MlesacParams::default(),
            accept: AcceptanceRule::Consensus,
            radius_slack: 0.1,
        }
    }
}

impl Describe for FeatureParams {
    fn visit(&mut self, visitor: &mut dyn ParamVisitor) {
        let about = |name, unit, help| About { name, unit, help };
        visitor.number(
            about(
                "ratio",
                "",
                "greatest ratio of nearest to second-nearest distance",
            ),
            &mut self.ratio,
            0.1..=1.0,
        );
        visitor.flag(
            about("unique", "", "a match must be the best in both directions"),
            &mut self.unique,
        );
        visitor.number(
            about(
                "depth_radius",
                "px",
                "how far a LiDAR point may be from its keypoint",
            ),
            &mut self.depth_radius_px,
            0.1..=50.0,
        );
        visitor.choice(
            about(
                "depth",
                "",
                "depth of a keypoint: the nearest point's, guarded against edges or not",
            ),
            &mut self.depth,
        );
        visitor.number(
            about(
                "depth_spread",
                "",
                "guarded: greatest spread of depths around, as a share",
            ),
            &mut self.depth_spread,
            0.0..=10.0,
        );
        visitor.number(
            about(
                "sigma",
                "px",
                "MLESAC: standard deviation of an inlier's reprojection error",
            ),
            &mut self.mlesac.sigma_px,
            0.05..=20.0,
        );
        visitor.number(
            about(
                "inlier",
                "px",
                "MLESAC: greatest reprojection error of an inlier",
            ),
            &mut self.mlesac.inlier_threshold_px,
            0.1..=50.0,
        );
        visitor.number(
            about(
                "confidence",
                "",
                "MLESAC: probability of drawing one clean sample",
            ),
            &mut self.mlesac.confidence,
            0.5..=0.999_999,
        );
        visitor.count(
            about("max_trials", "", "MLESAC: greatest number of hypotheses"),
            &mut self.mlesac.max_trials,
            1..=10_000_000,
        );
        visitor.choice(
            about(
                "accept",
                "",
                "when a consensus becomes a pose: beyond chance, or the paper's four",
            ),
            &mut self.accept,
        );
        visitor.number(
            about(
                "radius_slack",
                "",
                "share of the uncertainty radius that a pose may lie beyond it",
            ),
            &mut self.radius_slack,
            0.0..=100.0,
        );
    }
}

/// The feature-based estimator.
pub struct FeatureBased {
    surf: SurfParams,
    params: FeatureParams,
}

impl Estimator for FeatureBased {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        let mut counts = FeatureCounts::default();
        let pose = trace.stage(Stage::Estimator(Method::Feature), |trace| {
            self.localize(problem, &mut counts, trace)
        });
        Ok(Outcome {
            pose: settle(pose)?,
            counts: Some(counts),
            cost: None,
        })
    }
}

impl FeatureBased {
    /// The estimator with these parameters.
    pub fn new(params: &Params) -> Self {
        Self {
            surf: params.surf,
            params: params.fb.clone(),
        }
    }

    /// The four steps of the paper. `counts` is true up to where it stops.
    fn localize(
        &self,
        problem: &Problem,
        counts: &mut FeatureCounts,
        trace: &mut Trace<'_>,
    ) -> Result<Pose, Halt> {
        let (query, reference) = trace.stage(Stage::Detect, |trace| {
            let query = self.detect(Side::Query, problem, trace)?;
            let reference = self.detect(Side::Reference, problem, trace)?;
            counts.query_keypoints = query.keypoints.len();
            counts.reference_keypoints = reference.keypoints.len();
            Ok::<_, Halt>((query, reference))
        })?;
        let mut journey = Journey::new(query.keypoints.len());
        let outcome =
            self.match_and_solve(problem, &query, &reference, &mut journey, counts, trace);
        // The states are told for a failed query too: they show where its features went.
        if !matches!(outcome, Err(Halt::Cancelled)) {
            trace.emit(|| FeaturesClassified {
                states: journey.states(),
            })?;
        }
        outcome
    }

    fn match_and_solve(
        &self,
        problem: &Problem,
        query: &Features,
        reference: &Features,
        journey: &mut Journey,
        counts: &mut FeatureCounts,
        trace: &mut Trace<'_>,
    ) -> Result<Pose, Halt> {
        if query.keypoints.len() < MINIMUM || reference.keypoints.len() < MINIMUM {
            return Err(Halt::from(Failure::TooFewFeatures {
                query: query.keypoints.len(),
                reference: reference.keypoints.len(),
            }));
        }

        let matches = trace.stage(Stage::Match, |trace| {
            let decisions = self.best_matches(query, reference);
            trace.emit(|| MatchesDecided {
                decisions: Arc::clone(&decisions),
            })?;
            Ok::<_, Halt>(journey.after_matching(&decisions))
        })?;
        counts.ratio_passed = journey.passed_ratio_test();
        counts.unique = matches.len();
        if matches.len() < MINIMUM {
            return Err(Halt::from(Failure::TooFewMatches {
                unique: matches.len(),
                keypoints: query.keypoints.len(),
            }));
        }

        let lifted = trace.stage(Stage::DepthLift, |trace| {
            let lifted = self.lift(&matches, reference, &problem.reference, trace)?;
            trace.emit(|| DepthsLifted {
                matches: Arc::clone(&lifted),
            })?;
            Ok::<_, Halt>(lifted)
        })?;
        journey.after_depth_lift(&lifted);
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
        journey.after_consensus(&members, &consensus);
        counts.inliers = consensus.inliers.len();

        trace.stage(Stage::Accept, |trace| {
            self.accept(problem, &correspondences, &consensus, trace)
        })
    }

    fn detect(
        &self,
        side: Side,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<Arc<Features>, Cancelled> {
        let photo = match side {
            Side::Query => &problem.query.photo,
            Side::Reference => &problem.reference.photo,
        };
        let features = Arc::new(surf(&photo.gray, &self.surf));
        trace.emit(|| FeaturesDetected {
            side,
            features: Arc::clone(&features),
        })?;
        Ok(features)
    }

    /// The best match of each query feature, and whether it stands out.
    fn best_matches(&self, query: &Features, reference: &Features) -> Arc<[Option<Match>]> {
        let forward = nearest_neighbours(&query.descriptors, &reference.descriptors);
        let backward = nearest_neighbours(&reference.descriptors, &query.descriptors);
        let mut matches = classify(&forward, &backward, self.params.ratio as f32);
        if !self.params.unique {
            for found in matches.iter_mut().flatten() {
                if let MatchVerdict::NotUnique { .. } = found.verdict {
                    found.verdict = MatchVerdict::Candidate;
                }
            }
        }
        matches.into()
    }

    /// P = K⁻¹ p_R z: the keypoint's own pixel at the depth of the nearest projected point.
    fn lift(
        &self,
        matches: &[(usize, usize)],
        reference: &Features,
        tuple: &ReferenceTuple,
        trace: &mut Trace<'_>,
    ) -> Result<Arc<[LiftedMatch]>, Cancelled> {
        let cloud = ProjectedCloudIndex::new(&tuple.cloud, &tuple.intrinsics);
        trace.emit(|| ProjectedCloud {
            points: tuple.cloud.len(),
            in_view: cloud.len(),
        })?;
        Ok(matches
            .iter()
            .map(|&(query_index, reference_index)| {
                let pixel: Point2<f64> = reference.keypoints[reference_index].pixel();
                let reading = cloud.read(&pixel, self.params.depth_radius_px);
                LiftedMatch {
                    query: query_index,
                    reference: reference_index,
                    lidar_distance_px: reading.distance_px,
                    depth_range_m: reading.within.map(|depths| (depths.least, depths.greatest)),
                    point: self
                        .depth(&reading)
                        .map(|z| tuple.intrinsics.unproject(&pixel, z)),
                }
            })
            .collect())
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
        mlesac(
            correspondences,
            &problem.query.intrinsics,
            &self.params.mlesac,
            problem.random_seed("mlesac"),
            |trial| trace.emit(|| HypothesisTried { trial: *trial }),
        )
        .map_err(|error| match error {
            MlesacError::TooFewCorrespondences { found, .. } => Halt::from(Failure::NoConsensus {
                correspondences: found,
                best_inliers: 0,
                trials: 0,
            }),
            MlesacError::NoModel {
                trials,
                best_inliers,
            } => Halt::from(Failure::NoConsensus {
                correspondences: correspondences.len(),
                best_inliers,
                trials,
            }),
            MlesacError::Cancelled(cancelled) => Halt::from(cancelled),
        })
    }

    fn accept(
        &self,
        problem: &Problem,
        correspondences: &[Correspondence],
        consensus: &Consensus,
        trace: &mut Trace<'_>,
    ) -> Result<Pose, Halt> {
        let reference_from_query = consensus.pose.inverse();
        let inliers = consensus.inliers.len();
        // False matches gather where the texture is, so chance has less room than the whole image.
        let pixels: Vec<_> = correspondences.iter().map(|c| c.pixel).collect();
        let acceptance = inliers_beyond_chance(
            inliers,
            correspondences.len(),
            self.params.mlesac.inlier_threshold_px,
            effective_area_px(&pixels, problem.query.intrinsics.area()),
        );
        let distance_m = reference_from_query.translation.vector.norm();
        let radius_m = problem.uncertainty_radius_m;
        let too_far = distance_m > radius_m * (1.0 + self.params.radius_slack);
        let verdict = if !self.params.accept.accepts(&acceptance) {
            Err(Failure::ChanceConsensus {
                inliers,
                correspondences: correspondences.len(),
                needed: acceptance.needed.unwrap_or(correspondences.len() + 1),
            })
        } else if too_far && self.params.accept == AcceptanceRule::Consensus {
            Err(Failure::OutsideRadius {
                distance_m,
                radius_m,
            })
        } else {
            Ok(())
        };
        trace.emit(|| ConsensusJudged {
            acceptance,
            distance_m,
            accepted: verdict.is_ok(),
        })?;
        verdict?;
        Ok(problem.world_from_query(&reference_from_query))
    }
}

/// Follows every query feature to the one state it ends in.
struct Journey {
    states: Vec<FeatureState>,
}

impl Journey {
    /// At first no feature has a match at all.
    fn new(keypoints: usize) -> Self {
        Self {
            states: vec![
                FeatureState::RatioFailed {
                    ratio: f32::INFINITY
                };
                keypoints
            ],
        }
    }

    /// Returns the unique matches as (query, reference) indices.
    fn after_matching(&mut self, decisions: &[Option<Match>]) -> Vec<(usize, usize)> {
        let mut matches = Vec::new();
        for decision in decisions.iter().flatten() {
            self.states[decision.query] = match decision.verdict {
                MatchVerdict::Ambiguous => FeatureState::RatioFailed {
                    ratio: decision.ratio,
                },
                MatchVerdict::NotUnique { rival } => FeatureState::NotUnique { rival },
                MatchVerdict::Candidate => {
                    matches.push((decision.query, decision.reference));
                    // Until a pose explains it, nothing does.
                    FeatureState::Outlier {
                        residual_px: f64::INFINITY,
                    }
                }
            };
        }
        matches
    }

    fn passed_ratio_test(&self) -> usize {
        self.states
            .iter()
            .filter(|state| !matches!(state, FeatureState::RatioFailed { .. }))
            .count()
    }

    fn after_depth_lift(&mut self, lifted: &[LiftedMatch]) {
        for lifted in lifted.iter().filter(|lifted| lifted.point.is_none()) {
            self.states[lifted.query] = FeatureState::NoDepth {
                distance_px: lifted.lidar_distance_px,
            };
        }
    }

    fn after_consensus(&mut self, members: &[usize], consensus: &Consensus) {
        for (&query, &residual_px) in members.iter().zip(&consensus.residuals_px) {
            self.states[query] = FeatureState::Outlier { residual_px };
        }
        for &inlier in &consensus.inliers {
            self.states[members[inlier]] = FeatureState::Inlier {
                residual_px: consensus.residuals_px[inlier],
            };
        }
    }

    fn states(&self) -> Arc<[FeatureState]> {
        self.states.as_slice().into()
    }
}
