//! The application id, timelines and entity paths of recordings.

use crate::estimator;
use crate::event::Side;
use crate::method::Method;

/// The application that every recording belongs to.
pub const APPLICATION_ID: &str = "posescope";

/// One number per query of the run.
pub const QUERY_TIMELINE: &str = "query";
/// One number per decision of an estimator: few enough to step through by hand.
pub const STEP_TIMELINE: &str = "step";
/// One number per hypothesis: a trial of MLESAC, or an evaluation of the grid search.
pub const EVAL_TIMELINE: &str = "eval";

/// One number per event of an estimator, from 0 for each: all estimators advance together on it.
pub const LOCKSTEP_TIMELINE: &str = "lockstep";

/// The page of a lesson, as Markdown.
pub const LESSON: &str = "lesson";
/// Everything in the world.
pub const WORLD: &str = "world";
/// The roots of all entities of one query, for any methods.
pub fn of_a_query() -> impl Iterator<Item = &'static str> {
    let methods = estimator::methods().map(|method| method.name());
    [WORLD, PROOF, "query", "search", "fusion", "retrieval"].into_iter().chain(methods)
}
/// Inliers of the best trial so far, one row per improvement.
pub const RANSAC_BEST: &str = "fb/ransac/best";
/// Number of inliers of each trial.
pub const RANSAC_INLIERS: &str = "fb/ransac/inliers";
/// Log likelihood of each trial.
pub const RANSAC_LIKELIHOOD: &str = "fb/ransac/likelihood";
/// The number of query features that passed each step of FB.
pub const FUNNEL: &str = "fb/funnel";
/// The funnel with its labels, as Markdown.
pub const FUNNEL_TABLE: &str = "fb/funnel/table";
/// The query photo.
pub const QUERY_IMAGE: &str = "query/image";
/// Keypoints of the query before their states are known.
pub const QUERY_DETECTED: &str = "query/keypoints/detected";
/// The contribution of each reference to the fused poses, as Markdown.
pub const FUSION_TABLE: &str = "fusion/table";
/// The ranked frames with scores and inliers, as Markdown.
pub const RETRIEVAL_TABLE: &str = "retrieval/table";
/// The places of the ranked frames.
pub const RETRIEVAL_PLACES: &str = "world/retrieval";
/// Pictures that prove failures.
pub const PROOF: &str = "proof";
/// The results of the query, as Markdown.
pub const REPORT: &str = "report";
/// The decisions as sentences.
pub const LOG: &str = "log";

/// The name for matches without a state yet, besides those of
/// [`FeatureState::NAMES`](crate::features::FeatureState::NAMES).
pub const UNDECIDED: &str = "undecided";

/// The coloured cloud of a reference; that of the first one is `world/cloud` itself.
pub fn cloud(reference: usize) -> String {
    match reference {
        0 => format!("{WORLD}/cloud"),
        _ => format!("{WORLD}/cloud/{reference}"),
    }
}

/// The root of a reference.
pub fn reference(reference: usize) -> String {
    format!("{WORLD}/reference/{reference}")
}

/// The root of the query's true pose.
pub fn truth() -> String {
    format!("{WORLD}/truth")
}

/// What holds 95 % of the errors of a method's position, if its pose is right.
pub fn interval(method: Method) -> String {
    format!("{}/interval", estimate(method))
}

/// The root of the pose at which the photos agree, where a second opinion contradicts an estimate.
pub fn better(method: Method) -> String {
    format!("{}/better", estimate(method))
}

/// The root of a method's estimate.
pub fn estimate(method: Method) -> String {
    format!("{WORLD}/estimate/{}", method.name())
}

/// The camera of a reference, the truth or an estimate.
pub fn camera(owner: &str) -> String {
    format!("{owner}/camera")
}

/// The photo in the image plane of a camera.
pub fn camera_image(owner: &str) -> String {
    format!("{owner}/camera/image")
}

/// Keypoints of a photo, by side.
pub fn detected(side: Side, reference_index: usize) -> String {
    match side {
        Side::Query => QUERY_DETECTED.to_owned(),
        Side::Reference => format!("{}/camera/keypoints", reference(reference_index)),
    }
}

/// The query's keypoints in one state.
pub fn query_keypoints(state: &str) -> String {
    format!("query/keypoints/{state}")
}

/// The canvas with both photos.
pub fn matches(reference: usize) -> String {
    format!("fb/matches/{reference}")
}

/// The matches in one state.
pub fn matches_in_state(reference: usize, state: &str) -> String {
    format!("fb/matches/{reference}/{state}")
}

/// Rays from the estimated camera to the 3-D points, for `inlier` and `outlier`.
pub fn correspondences(state: &str) -> String {
    format!("{WORLD}/correspondences/{state}")
}

/// A surface or the path of a grid search: `cost`, `cost/fine`, `coverage`, `coverage/fine`, `path`.
pub fn search(method: Method, part: &str) -> String {
    format!("{WORLD}/search/{}/{part}", method.name())
}

/// The cost over the yaw angle.
pub fn yaw_curve(method: Method) -> String {
    format!("search/{}/yaw", method.name())
}

/// A picture or plot of a direct method: `synthetic`, `residual`, `weights`, `joint_histogram`,
/// `entropy`, `cost`, `coverage`, `best`.
pub fn direct(method: Method, part: &str) -> String {
    format!("{}/{part}", method.name())
}

/// The picture that proves a method's failure.
pub fn proof(method: Method) -> String {
    format!("{PROOF}/{}", method.name())
}

/// The current stage of a method.
pub fn stage(method: Method) -> String {
    format!("stage/{}", method.name())
}

/// The query above a ranked frame, by its rank from 0.
pub fn rank(rank: usize) -> String {
    format!("retrieval/rank/{rank}")
}

/// A part of a ranked frame: its verified `matches` or its `label`.
pub fn rank_part(rank: usize, part: &str) -> String {
    format!("retrieval/rank/{rank}/{part}")
}

/// The references' weights in a method's fused pose, in the order of the references.
pub fn fusion_weights(method: Method) -> String {
    format!("fusion/{}/weights", method.name())
}

/// The query's positions by each reference alone.
pub fn fusion_candidates(method: Method) -> String {
    format!("{WORLD}/fusion/{}", method.name())
}
