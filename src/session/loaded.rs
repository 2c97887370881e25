//! What a job has read.

use crate::geometry::Pose;
use crate::problem::Problem;

/// The photos and clouds of a job.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The query and each of its references.
    pub problems: Vec<Problem>,
    /// Where the query camera was, if that is known. The estimators do not see it.
    pub truth: Option<Pose>,
}
