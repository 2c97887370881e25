//! Where things are in a recording: its application, its timelines, its entity paths.

use crate::estimator;
use crate::event::Side;
use crate::method::Method;

/// The application that every recording belongs to.
pub const APPLICATION_ID: &str = "posescope";

/// One number per query of the run.
pub const QUERY_TIMELINE: &str = "query";
/// One number per decision of an estimator: few enough to walk through by hand.
pub const STEP_TIMELINE: &str = "step";
/// One number per hypothesis: a trial of MLESAC, or an evaluation of the grid search.
pub const EVAL_TIMELINE: &str = "eval";

/// One number per event of an estimator, from 0 for each of them: on it all of them advance together.
pub const LOCKSTEP_TIMELINE: &str = "lockstep";

/// The page of a lesson, as Markdown.
pub const LESSON: &str = "lesson";
/// Everything that has a place in the world.
pub const WORLD: &str = "world";
/// The roots of all that belongs to one query, whichever methods were asked.
pub fn of_a_query() -> impl Iterator<Item = &'static str> {
    let methods = estimator::methods().map(|method| method.name());
    [WORLD, PROOF, "query", "search", "fusion", "retrieval"]
        .into_iter()
        .chain(methods)
}
/// Inliers of the best trial so far, one row per improvement.
pub const RANSAC_BEST: &str = "fb/ransac/best";
/// Number of inliers of each trial.
pub const RANSAC_INLIERS: &str = "fb/ransac/inliers";
/// Log likelihood of each trial.
pub const RANSAC_LIKELIHOOD: &str = "fb/ransac/likelihood";
/// How many query features passed each step of FB.
pub const FUNNEL: &str = "fb/funnel";
/// The funnel with its labels, as Markdown.
pub const FUNNEL_TABLE: &str = "fb/funnel/table";
/// The query photo.
pub const QUERY_IMAGE: &str = "query/image";
/// Keypoints of the query before their states are known.
pub const QUERY_DETECTED: &str = "query/keypoints/detected";
/// What each reference had to say in the fused poses, as Markdown.
pub const FUSION_TABLE: &str = "fusion/table";
/// The ranked frames with scores and inliers, as Markdown.
pub const RETRIEVAL_TABLE: &str = "retrieval/table";
/// Where the ranked frames are.
pub const RETRIEVAL_PLACES: &str = "world/retrieval";
/// Pictures that prove what is wrong.
pub const PROOF: &str = "proof";
/// The results of the query, as Markdown.
pub const REPORT: &str = "report";
/// The decisions, in words.
pub const LOG: &str = "log";

/// The name of a match whose state is not yet decided, beside those of
/// [`FeatureState::NAMES`](crate::features::FeatureState::NAMES).
pub const UNDECIDED: &str = "undecided";

/// The coloured cloud of a reference; that of the first one is `world/cloud` itself.
pub fn cloud(reference: usize) -> String {
    match reference {
        0 => format!("{WORLD}/cloud"),
        _ => format!("{WORLD}/cloud/{reference}"),
    }
}

/// What is known about a reference.
pub fn reference(reference: usize) -> String {
    format!("{WORLD}/reference/{reference}")
}

/// What is known about the true pose of the query.
pub fn truth() -> String {
    format!("{WORLD}/truth")
}

/// What a method found.
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

/// Something that a direct method shows: `synthetic`, `residual`, `weights`, `joint_histogram`,
/// `entropy`, `cost`, `coverage`, `best`.
pub fn direct(method: Method, part: &str) -> String {
    format!("{}/{part}", method.name())
}

/// The picture that proves what is wrong with a method's result.
pub fn proof(method: Method) -> String {
    format!("{PROOF}/{}", method.name())
}

/// The stage that a method is in.
pub fn stage(method: Method) -> String {
    format!("stage/{}", method.name())
}

/// The query above a frame that was ranked as a reference, by its rank from 0.
pub fn rank(rank: usize) -> String {
    format!("retrieval/rank/{rank}")
}

/// What is drawn on a ranked frame: its verified `matches`, a `label`.
pub fn rank_part(rank: usize, part: &str) -> String {
    format!("retrieval/rank/{rank}/{part}")
}

/// The references' weights in a method's fused pose, in the order of the references.
pub fn fusion_weights(method: Method) -> String {
    format!("fusion/{}/weights", method.name())
}

/// Where each reference alone puts the query.
pub fn fusion_candidates(method: Method) -> String {
    format!("{WORLD}/fusion/{}", method.name())
}
