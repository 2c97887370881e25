//! The events of the estimators, one struct each.
//!
//! Large payloads are shared (`Arc`), so keeping an event is cheap. Written as data, an event has one array
//! for each property of its items, and for a picture or a cloud the number of its pixels or points.

mod columns;

use std::sync::Arc;

use serde::{Serialize, Serializer};

pub use crate::depth::{DepthReading, DepthsWithin, LiftedMatch};
pub use crate::render::{ColoredCloud, ColoredPoint, ColoringCounts};
pub use crate::render::{Comparison, SplattedPixel, SyntheticView};
pub use crate::search::{Freedoms, Refined, Start};

use crate::features::{FeatureState, Features, Match, MatchVerdict};
use crate::fusion::share::Share;
use crate::geometry::{Pose, PoseError};
use crate::grid::{Offset, Phase, Score, Scored, ScoredLattice};
use crate::image::Photo;
use crate::method::Method;
use crate::retrieval::ReferenceRanking;
use crate::robust::{Acceptance, Counted, Trial};

/// One of the two photos of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The query photo.
    Query,
    /// The reference photo.
    Reference,
}

/// A named part of an estimator, which an observer can step over.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Stage {
    /// A whole estimator; within the hybrid also the one it runs inside.
    Estimator(Method),
    /// References are chosen by what they look like.
    Retrieve,
    /// FB: features of both photos.
    Detect,
    /// FB: exhaustive matching, ratio test, uniqueness.
    Match,
    /// FB: depth of the matched reference keypoints.
    DepthLift,
    /// `fb2`: matching again where a pose says that features must be.
    MatchGuided,
    /// FB: MLESAC over P3P hypotheses, refinement.
    Consensus,
    /// FB: is the result more than chance?
    Accept,
    /// PM, MI: colour the cloud.
    Color,
    /// PM, MI: one phase of the grid search.
    Search(Phase),
    /// PM, MI: downhill from the reference pose.
    Descend,
    /// `mi6`: smaller copies of the photos are searched.
    SearchCoarse,
    /// `mi6`: the best coarse minima are refined in right, forward and yaw.
    RefinePlane,
    /// `mi6`, `robust`: poses are refined in all six freedoms.
    RefineSix,
    /// `robust`: the poses of several methods are compared.
    Judge,
    /// PM, MI: what the result is worth.
    Assess,
    /// One pose from those of several references.
    Fuse,
    /// A second opinion on another system's pose, once the own answers are known.
    Opinion,
}

impl Stage {
    /// A short name, the same in `--break`, in timings and in recordings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Estimator(method) => method.name(),
            Self::Retrieve => "retrieve",
            Self::Detect => "detect",
            Self::Match => "match",
            Self::DepthLift => "depth",
            Self::MatchGuided => "match_guided",
            Self::Consensus => "ransac",
            Self::Accept => "accept",
            Self::Color => "color",
            Self::Search(Phase::PositionCoarse) => "position_coarse",
            Self::Search(Phase::PositionFine) => "position_fine",
            Self::Search(Phase::YawCoarse) => "yaw_coarse",
            Self::Search(Phase::YawFine) => "yaw_fine",
            Self::Descend => "descend",
            Self::SearchCoarse => "search_coarse",
            Self::RefinePlane => "refine_plane",
            Self::RefineSix => "refine_six",
            Self::Judge => "judge",
            Self::Assess => "assess",
            Self::Fuse => "fusion",
            Self::Opinion => "opinion",
        }
    }
}

impl Serialize for Stage {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// An event type: convertible into [`Event`], with its kind.
pub trait DebugEvent: Into<Event> + Sized {
    /// The kind of this type.
    const KIND: Kind;
    /// The event as this type, if it is of this kind.
    fn from_event(event: &Event) -> Option<&Self>;
}

/// A set of event kinds: one bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KindSet(u32);

impl KindSet {
    /// Every kind.
    pub const ALL: Self = Self(u32::MAX);
    /// No kind; stage events come all the same.
    pub const NONE: Self = Self(0);

    /// Just these kinds.
    pub const fn of(kinds: &[Kind]) -> Self {
        let mut bits = 0;
        let mut i = 0;
        while i < kinds.len() {
            bits |= 1 << kinds[i] as u32;
            i += 1;
        }
        Self(bits)
    }

    /// The kinds of either set.
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether a kind is in the set.
    #[inline]
    pub const fn contains(self, kind: Kind) -> bool {
        self.0 & (1 << kind as u32) != 0
    }
}

macro_rules! events {
    ($($(#[$attribute:meta])* pub struct $name:ident { $($fields:tt)+ })+) => {
        $(
            $(#[$attribute])*
            #[derive(Clone, Debug, Serialize)]
            pub struct $name { $($fields)+ }
        )+

        /// Any event of an estimator.
        #[derive(Clone, Debug, Serialize)]
        #[serde(tag = "kind")]
        #[allow(missing_docs, reason = "each variant is named after the struct it holds")]
        #[non_exhaustive]
        pub enum Event { $($name($name)),+ }

        /// The kinds of event, one per struct.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[allow(missing_docs, reason = "each kind is named after its struct")]
        #[non_exhaustive]
        pub enum Kind { $($name),+ }

        impl Kind {
            /// Every kind.
            #[doc(hidden)]
            pub const ALL: &[Self] = &[$(Self::$name),+];
        }

        const _: () =
            assert!(Kind::ALL.len() <= u32::BITS as usize, "a KindSet has a bit for each kind");

        impl Event {
            /// The kind of this event.
            pub fn kind(&self) -> Kind {
                match self { $(Self::$name(_) => Kind::$name),+ }
            }
        }

        $(
            impl From<$name> for Event {
                fn from(event: $name) -> Self { Self::$name(event) }
            }
            impl DebugEvent for $name {
                const KIND: Kind = Kind::$name;
                fn from_event(event: &Event) -> Option<&Self> {
                    match event {
                        Event::$name(event) => Some(event),
                        _ => None,
                    }
                }
            }
        )+
    };
}

events! {
    /// A stage begins.
    #[derive(Copy, PartialEq)]
    pub struct StageStarted {
        /// The stage.
        pub stage: Stage,
    }

    /// A stage is over.
    #[derive(Copy, PartialEq)]
    pub struct StageEnded {
        /// The stage.
        pub stage: Stage,
        /// Whether it did what it was for.
        pub succeeded: bool,
        /// Whether its result is from an earlier run.
        pub reused: bool,
    }

    /// SURF features of one photo.
    pub struct FeaturesDetected {
        /// The photo that the features are of.
        pub side: Side,
        /// Keypoints and descriptors.
        #[serde(flatten, serialize_with = "columns::features")]
        pub features: Arc<Features>,
    }

    /// What matching decided about each query keypoint.
    pub struct MatchesDecided {
        /// One per query keypoint, in their order; `None` where the reference has no feature.
        #[serde(flatten, serialize_with = "columns::decisions")]
        pub decisions: Arc<[Option<Match>]>,
    }

    /// The cloud was projected into the reference photo.
    #[derive(Copy, PartialEq)]
    pub struct ProjectedCloud {
        /// Points of the scan.
        pub points: usize,
        /// Points that the reference camera has in view.
        pub in_view: usize,
    }

    /// Depths of the unique matches.
    pub struct DepthsLifted {
        /// One per unique match, in the order of the query keypoints.
        #[serde(flatten, serialize_with = "columns::lifted")]
        pub matches: Arc<[LiftedMatch]>,
    }

    /// One trial of MLESAC.
    pub struct HypothesisTried {
        /// Sample, likelihood, support.
        #[serde(flatten)]
        pub trial: Trial,
    }

    /// The best hypothesis after refinement on its inliers.
    pub struct PoseRefined {
        /// The query camera in the reference camera's frame.
        #[serde(serialize_with = "columns::rows")]
        pub reference_from_query: Pose,
        /// Correspondences with a residual within the threshold, for this pose.
        pub inliers: usize,
        /// Correspondences in all.
        pub correspondences: usize,
        /// Trials that MLESAC made.
        pub trials: usize,
    }

    /// Whether the consensus was accepted, and why.
    pub struct ConsensusJudged {
        /// The test for more inliers than chance explains.
        #[serde(flatten)]
        pub acceptance: Acceptance,
        /// What it counted.
        pub counted: Counted,
        /// Distance of the pose from the reference \[m\].
        pub distance_m: f64,
        /// Whether the pose is returned.
        pub accepted: bool,
    }

    /// Every query feature with the state it ended in.
    pub struct FeaturesClassified {
        /// One per query keypoint, in their order.
        #[serde(flatten, serialize_with = "columns::states")]
        pub states: Arc<[FeatureState]>,
    }

    /// The matches that a pose is judged by after features were matched again where it says they must be.
    pub struct MatchesGuided {
        /// The last match with a depth of each query feature that has one, in the order of the features.
        #[serde(flatten, serialize_with = "columns::lifted")]
        pub matches: Arc<[LiftedMatch]>,
    }

    /// The cloud took the reference photo's grey values.
    pub struct CloudColored {
        /// The coloured points, and how many were left out and why.
        #[serde(rename = "points", serialize_with = "columns::points")]
        pub cloud: Arc<ColoredCloud>,
    }

    /// One hypothesis of the grid search.
    #[derive(Copy, PartialEq)]
    pub struct PoseScored {
        /// Part of the search.
        pub phase: Phase,
        /// Number of this evaluation within the estimator's run.
        pub evaluation: u64,
        /// Where the hypothesis is.
        pub offset: Offset,
        /// Cost and covered pixels.
        pub score: Score,
        /// Covered pixels over those covered at the reference pose.
        pub coverage: f64,
        /// Whether it is the best of the phase so far.
        pub is_best: bool,
    }

    /// One phase of the grid search is complete.
    pub struct PhaseSearched {
        /// The cost and coverage surfaces.
        #[serde(flatten, serialize_with = "columns::surface")]
        pub surface: Arc<ScoredLattice>,
        /// The best offset, if any hypothesis had a cost.
        pub best: Option<Offset>,
    }

    /// A synthetic view and its comparison with the query.
    pub struct ViewRendered {
        /// Why it was rendered.
        pub moment: Moment,
        /// The evaluation it belongs to.
        pub evaluation: u64,
        /// Where the camera is.
        pub offset: Offset,
        /// The view, its cost and what made it.
        #[serde(flatten, serialize_with = "columns::comparison")]
        pub comparison: Arc<Comparison>,
    }

    /// How the minimum of the search compares with other poses.
    #[derive(Copy, PartialEq)]
    pub struct MinimumAssessed {
        /// Where the minimum is.
        pub offset: Offset,
        /// Cost at the reference pose.
        pub initial: Option<f64>,
        /// Cost at the minimum.
        pub best: f64,
        /// Cost at the minimum with the view's pixels shuffled: what no relation at all costs.
        pub shuffled: Option<f64>,
        /// Cost of the second-best local minimum of the coarse positions.
        pub runner_up: Option<f64>,
    }

    /// Which way the hybrid went.
    #[derive(PartialEq)]
    pub struct BranchTaken {
        /// The method whose pose the hybrid returns.
        #[serde(rename = "taken")]
        pub method: Method,
        /// Why FB's pose was kept or not.
        pub why: String,
    }

    /// Several references gave a pose each, and a fusion made one of them.
    pub struct ReferencesFused {
        /// The fusion's name.
        pub fusion: &'static str,
        /// What each reference alone gave, and its weight, in the order of the references.
        #[serde(flatten, serialize_with = "columns::shares")]
        pub shares: Arc<[Share]>,
        /// The fused pose, `world_from_camera`; `None` where every reference with a weight failed.
        #[serde(rename = "world_from_camera", serialize_with = "columns::rows_if_any")]
        pub pose: Option<Pose>,
    }

    /// Frames were ranked by what they look like, and the first of them became references.
    pub struct ReferencesRanked {
        /// The best frames with their scores, and what verification made of them.
        #[serde(flatten, serialize_with = "columns::ranking")]
        pub ranking: Arc<ReferenceRanking>,
        /// The photos of [`ReferenceRanking::pictured`], in that order; `None` for one that cannot be
        /// read.
        #[serde(skip)]
        pub photos: Arc<[Option<Arc<Photo>>]>,
    }

    /// Several starts were refined side by side.
    pub struct StartsRefined {
        /// The directions in which they moved.
        pub freedoms: Freedoms,
        /// Where each started and ended, the best first: that of least cost, where none of those that cost
        /// about as little is likelier.
        #[serde(flatten, serialize_with = "columns::refinements")]
        pub refinements: Arc<[Refined]>,
    }

    /// The poses of several methods were refined under one cost and compared.
    pub struct CandidatesJudged {
        /// The candidates, the answer first.
        #[serde(flatten, serialize_with = "columns::candidates")]
        pub candidates: Arc<[JudgedPose]>,
        /// How far the answer is below the costs of the coarse positions, in robust standard deviations.
        pub deviations: f64,
        /// How far it must be below them to be the answer.
        pub needed: f64,
        /// What the best candidate of each method costs, in words.
        pub why: String,
    }

    /// Posescope's own answer to the query from one reference, for a second opinion on another system's pose.
    pub struct OwnAnswered {
        /// The method that was asked.
        pub by: Method,
        /// The reference that it was asked about.
        pub from: String,
        /// The pose, `world_from_camera`; `None` where there is none.
        #[serde(serialize_with = "columns::rows_if_any")]
        pub world_from_camera: Option<Pose>,
        /// How likely it is right; `None` where that cannot be known.
        pub probability: Option<f64>,
        /// How far the other system's pose is from it.
        pub apart: Option<PoseError>,
    }

    /// The second opinion on another system's pose.
    pub struct OpinionFormed {
        /// What it comes to: `confirmed`, `contradicted` or `undecided`.
        pub standing: &'static str,
        /// How likely the other system's pose is right.
        pub probability: f64,
        /// The pose at which the photos agree, `world_from_camera`, if that is another one.
        #[serde(serialize_with = "columns::rows_if_any")]
        pub better: Option<Pose>,
        /// What it comes to, with how far off the pose is, in words.
        pub words: String,
        /// Why, in a sentence.
        pub because: String,
    }

    /// A step downhill by the derivatives of a smooth cost.
    #[derive(Copy, PartialEq)]
    pub struct DescentStepped {
        /// The copy of the photos, 0 the finest; each is twice as coarse as the one below.
        pub level: usize,
        /// Number of the step on this level, from 1.
        pub step: usize,
        /// The query camera in the reference camera's frame, after the step.
        #[serde(serialize_with = "columns::rows")]
        pub reference_from_camera: Pose,
        /// The smooth cost there.
        pub smooth_cost: f64,
        /// The method's own cost there, and the pixels that it is of.
        pub score: Score,
    }
}

impl MatchesDecided {
    /// Number of matches that are distinct and unique.
    pub fn candidates(&self) -> usize {
        let is_candidate = |found: &&Match| found.verdict == MatchVerdict::Candidate;
        self.decisions.iter().flatten().filter(is_candidate).count()
    }
}

impl DepthsLifted {
    /// Number of matches with a depth.
    pub fn with_depth(&self) -> usize {
        let matches = self.matches.iter();
        matches.filter(|lifted| lifted.point.is_some()).count()
    }
}

impl PoseScored {
    /// The event of a scored hypothesis; `covered_at_reference` are the pixels that the reference pose covers.
    pub fn new(phase: Phase, evaluation: u64, scored: Scored, covered_at_reference: u32) -> Self {
        let Scored { offset, score, is_best } = scored;
        let coverage = f64::from(score.covered) / f64::from(covered_at_reference.max(1));
        Self { phase, evaluation, offset, score, coverage, is_best }
    }
}

/// Why a synthetic view was rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Moment {
    /// It is the view at the reference pose.
    Start,
    /// A hypothesis is better than all before.
    NewBest,
    /// It is the view at the result.
    End,
}

/// A pose among several that were compared.
#[derive(Clone, Debug)]
pub struct JudgedPose {
    /// The method whose pose it was.
    pub method: Method,
    /// The pose as the method gave it, and refined.
    pub refined: Refined,
    /// Whether its method matches features.
    pub from_features: bool,
    /// Whether its own method would have answered it.
    pub accepted: bool,
}
