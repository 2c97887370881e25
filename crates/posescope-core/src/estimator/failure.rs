//! Why a query could not be localised.

use crate::code::Code;
use crate::grid::LatticeTooLarge;
use crate::method::Method;
use crate::robust::Counted;

/// A typed reason with its evidence. In statistics it counts as an infinite error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Failure {
    /// A photo shows hardly any texture.
    #[error(
        "too few features: {query} in the query, {reference} in the reference, at least 4 are needed"
    )]
    TooFewFeatures {
        /// Keypoints of the query photo.
        query: usize,
        /// Keypoints of the reference photo.
        reference: usize,
    },
    /// Fewer than four matches survived the ratio test and uniqueness.
    #[error(
        "too few matches: {unique} unique of {keypoints} query features, at least 4 are needed"
    )]
    TooFewMatches {
        /// Mutually best matches.
        unique: usize,
        /// Query keypoints.
        keypoints: usize,
    },
    /// Fewer than four matches have a depth.
    #[error("too few matches have a LiDAR depth: {with_depth} of {unique}, at least 4 are needed")]
    TooFewDepths {
        /// Matches with a 3-D point.
        with_depth: usize,
        /// Mutually best matches.
        unique: usize,
    },
    /// No hypothesis is consistent with four correspondences.
    #[error(
        "no pose is consistent with 4 of the {correspondences} correspondences \
         (best {best_inliers}, after {trials} trials)"
    )]
    NoConsensus {
        /// Correspondences tried.
        correspondences: usize,
        /// Support of the best hypothesis.
        best_inliers: usize,
        /// Hypotheses tried.
        trials: usize,
    },
    /// The consensus is one that chance gives as well.
    #[error(
        "{inliers} of {tested} {} agree on a pose, which chance explains; {needed} are needed",
        counted.name()
    )]
    ChanceConsensus {
        /// Inliers of the returned pose.
        inliers: usize,
        /// How many they are of.
        tested: usize,
        /// Inliers that would be accepted.
        needed: usize,
        /// What was counted.
        counted: Counted,
    },
    /// The pose is farther from the reference than the query can be.
    #[error(
        "the consensus pose is {distance_m:.1} m from the reference, \
         outside the uncertainty radius of {radius_m:.1} m"
    )]
    OutsideRadius {
        /// Distance of the pose from the reference \[m\].
        distance_m: f64,
        /// The problem's uncertainty radius \[m\].
        radius_m: f64,
    },
    /// The reference camera sees no point of its cloud.
    #[error("none of the cloud's {points} points is in view of the reference camera")]
    NothingInView {
        /// Points of the cloud.
        points: usize,
    },
    /// No hypothesis has a cost: nothing covered enough, or the images are constant there.
    #[error("none of {hypotheses} hypotheses could be compared with the query")]
    NothingComparable {
        /// Hypotheses scored.
        hypotheses: usize,
    },
    /// Every hypothesis costs the same, so none is better than another.
    #[error("the cost is {cost:.4} at each of {hypotheses} hypotheses: nothing tells them apart")]
    FlatCost {
        /// The one cost.
        cost: f64,
        /// Hypotheses that could be compared with the query.
        hypotheses: usize,
    },
    /// Wherever the search went down, it left the disc.
    #[error(
        "all of {minima} minima that were refined lead out of the disc, more than {reach_m:.2} m from the reference"
    )]
    LedOutside {
        /// Minima that were refined.
        minima: usize,
        /// How far from the reference an answer may be \[m\].
        reach_m: f64,
    },
    /// The least cost is one that wrong poses have as well.
    #[error(
        "the least cost, {cost:.4}, is {deviations:.1} standard deviations below those of other poses, \
         which chance explains; {needed:.1} are needed"
    )]
    ChanceMinimum {
        /// The least cost.
        cost: f64,
        /// How far it is below the middle of the coarse positions' costs.
        deviations: f64,
        /// How far it would have to be.
        needed: f64,
    },
    /// The parameters ask for more hypotheses than can be scored and kept.
    #[error(transparent)]
    LatticeTooLarge(#[from] LatticeTooLarge),
    /// There is nothing to localise against.
    #[error("no reference frame{}", radius_m.map(|radius| format!(" with pose and scan within {radius} m")).unwrap_or_default())]
    NoReference {
        /// Where references were sought, around the query's known position \[m\].
        radius_m: Option<f64>,
    },
    /// Several references were to be fused, and each failed by itself.
    #[error(
        "none of {weighed} references gave a pose (of {references}, the others have too few matches); \
         the best, {best}: {failure}"
    )]
    NoReferenceSucceeded {
        /// References that the fusion gave a weight.
        weighed: usize,
        /// References in all.
        references: usize,
        /// The name of the one with the most matches.
        best: String,
        /// Why that one failed.
        failure: Box<Failure>,
    },
    /// Several references were to give one pose at once, and the method takes one at a time.
    #[error("{method} takes one reference at a time, so that it has no joint pose of several")]
    NotJoint {
        /// The method.
        method: Method,
    },
    /// Another system was asked, and its answers have none here.
    #[error("{answers} has no {missing}")]
    NotAnswered {
        /// Whose answers.
        answers: String,
        /// What is not among them.
        missing: String,
    },
    /// The pose is less certain than somebody asked for.
    #[error(
        "the pose is within 1 m with a probability of {probability:.2}, and {needed:.2} is asked for"
    )]
    LowConfidence {
        /// Its probability of being within 1 m.
        probability: f64,
        /// The probability that is asked for.
        needed: f64,
    },
    /// A bug: an estimator panicked.
    #[error("internal error: {message}")]
    Internal {
        /// What it said.
        message: String,
    },
}

impl Failure {
    /// The code of the reason in results.
    pub fn code(&self) -> Code {
        match self {
            Self::NothingInView { .. } | Self::NoReference { .. } => Code::R1,
            Self::TooFewFeatures { .. } => Code::R2,
            Self::TooFewMatches { .. }
            | Self::NoConsensus { .. }
            | Self::ChanceConsensus { .. } => Code::R3,
            Self::TooFewDepths { .. } => Code::R4,
            Self::OutsideRadius { .. } => Code::R9,
            Self::NothingComparable { .. } | Self::FlatCost { .. } => Code::D5,
            Self::LedOutside { .. } => Code::D8,
            Self::ChanceMinimum { .. } => Code::D6,
            Self::LatticeTooLarge(_) => Code::D9,
            Self::NoReferenceSucceeded { failure, .. } => failure.code(),
            Self::NotJoint { .. } => Code::F2,
            Self::NotAnswered { .. } => Code::E1,
            Self::LowConfidence { .. } => Code::L1,
            Self::Internal { .. } => Code::X9,
        }
    }
}
