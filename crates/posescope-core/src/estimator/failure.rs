//! Why a query could not be localised.

use super::methods;
use crate::cost::SearchRule;
use crate::grid::LatticeTooLarge;
use crate::method::Method;
use crate::params::ParamError;
use crate::robust::Counted;
use crate::text::similar;

/// A typed reason with its evidence. In statistics it counts as an infinite error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Failure {
    /// A photo shows hardly any texture.
    #[error(
        "Too few keypoints: {query} in the query, {reference} in the reference, at least 4 needed."
    )]
    TooFewFeatures {
        /// Keypoints of the query photo.
        query: usize,
        /// Keypoints of the reference photo.
        reference: usize,
    },
    /// Fewer than four matches survived the ratio test and uniqueness.
    #[error(
        "Too few matches: {unique} of {keypoints} query keypoints have a unique one, at least 4 needed."
    )]
    TooFewMatches {
        /// Mutually best matches.
        unique: usize,
        /// Query keypoints.
        keypoints: usize,
    },
    /// Fewer than four matches have a depth.
    #[error("Too few matches have a depth: {with_depth} of {unique}, at least 4 needed.")]
    TooFewDepths {
        /// Matches with a 3-D point.
        with_depth: usize,
        /// Mutually best matches.
        unique: usize,
    },
    /// No hypothesis is consistent with four correspondences.
    #[error(
        "No pose has 4 inliers: the best of {trials} trials has {best_inliers} of {correspondences} correspondences."
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
        "Too few inliers: {inliers} of {tested} {}, at least {needed} needed to rule out chance.",
        counted.words()
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
        "The pose is too far from the reference: {distance_m:.2} m, where {allowed_m:.2} m is allowed."
    )]
    OutsideRadius {
        /// Distance of the pose from the reference \[m\].
        distance_m: f64,
        /// The greatest distance that is allowed: what the problem believes, and the slack of the method \[m\].
        allowed_m: f64,
    },
    /// The reference camera sees no point of its cloud.
    #[error("The reference camera sees none of the {points} points of its cloud.")]
    NothingInView {
        /// Points of the cloud.
        points: usize,
    },
    /// No hypothesis has a cost: nothing covered enough, or the images are constant there.
    #[error(
        "Nothing to compare: none of {hypotheses} hypotheses covers enough of the query, or an image is constant."
    )]
    NothingComparable {
        /// Hypotheses scored.
        hypotheses: usize,
    },
    /// Every hypothesis costs the same, so none is better than another.
    #[error("No pose stands out: the cost is {cost:.4} at all {hypotheses} hypotheses.")]
    FlatCost {
        /// The one cost.
        cost: f64,
        /// Hypotheses that could be compared with the query.
        hypotheses: usize,
    },
    /// Every minimum that was refined lies outside of the disc.
    #[error(
        "{} outside the search, more than {reach_m:.1} m from the reference.",
        if *.minima == 1 { "The minimum lies".to_owned() } else { format!("All {minima} refined minima lie") }
    )]
    LedOutside {
        /// Minima that were refined.
        minima: usize,
        /// How far from the reference an answer may be \[m\].
        reach_m: f64,
    },
    /// The least cost is one that wrong poses have as well.
    #[error(
        "The lowest cost does not stand out: {deviations:.1} σ below other poses, at least {needed:.1} σ needed."
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
    #[error("No reference frame{}.", radius_m.map(|radius| format!(" with pose and scan within {radius} m of the query")).unwrap_or_default())]
    NoReference {
        /// Where references were sought, around the query's known position \[m\].
        radius_m: Option<f64>,
    },
    /// Retrieval ranked frames, and none resembles the query enough.
    #[error(
        "No place recognised: the best of {ranked} ranked frames, {best}, has {inliers} inliers, at least {needed} needed."
    )]
    NotRecognised {
        /// Frames that were ranked.
        ranked: usize,
        /// The name of the first one.
        best: String,
        /// Its inliers.
        inliers: usize,
        /// How many it would need.
        needed: usize,
    },
    /// Several references were to be fused, and each failed by itself.
    #[error(
        "No reference gave a pose; {weighed} of {references} had enough matches. The best, {best}: {failure}"
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
    #[error(
        "{method}{} takes one reference at a time, so it has no joint pose.",
        search.map(|search| format!(" with search={}", search.name())).unwrap_or_default()
    )]
    NotJoint {
        /// The method.
        method: Method,
        /// How it searches, if it would have a joint pose with another search.
        search: Option<SearchRule>,
    },
    /// No estimator has this name.
    #[error("There is no method `{method}`{}.", perhaps(*.nearest))]
    UnknownMethod {
        /// The name.
        method: Method,
        /// The method whose name is most like it, if one is.
        nearest: Option<Method>,
    },
    /// A parameter has a value outside its range.
    #[error("A parameter is not possible: {0}.")]
    Parameter(#[from] ParamError),
    /// Another system has no answer here.
    #[error("There is nothing to judge: {answers} has no {missing}.")]
    NotAnswered {
        /// Whose answers.
        answers: String,
        /// What is not among them.
        missing: String,
    },
    /// The confidence of the pose is below what the user or the method requires.
    #[error(
        "The pose was refused: only {} likely right, {:.0} % required{}.",
        percent(*.probability),
        100.0 * .needed,
        .because.as_ref().map(|why| format!(", because {why}")).unwrap_or_default()
    )]
    LowConfidence {
        /// Its probability of being right.
        probability: f64,
        /// The probability that is required.
        needed: f64,
        /// What speaks against it, beside its own evidence.
        because: Option<String>,
    },
    /// A file of the query or of its references cannot be read.
    #[error("{message}")]
    Unreadable {
        /// The file and what is wrong with it.
        message: String,
    },
    /// A bug: an estimator panicked.
    #[error("Internal error, please report it: {message}")]
    Internal {
        /// What it said.
        message: String,
    },
}

impl Failure {
    /// That no estimator is called so.
    pub(crate) fn unknown(method: Method) -> Self {
        let names = methods().map(Method::name);
        let nearest = similar(method.name(), names).map(Method::named);
        Self::UnknownMethod { method, nearest }
    }
}

fn perhaps(nearest: Option<Method>) -> String {
    nearest.map(|nearest| format!(" (did you mean `{nearest}`?)")).unwrap_or_default()
}

/// Rounded down, so that a limit that was missed never reads as reached.
fn percent(probability: f64) -> String {
    format!("{:.0} %", (100.0 * probability).floor())
}
