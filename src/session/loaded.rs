//! The input of a job.

use crate::geometry::Pose;
use crate::problem::Problem;

/// The photos and clouds of a job.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The query and each of its references.
    pub problems: Vec<Problem>,
    /// The true pose of the query, if known. The estimators do not see it.
    pub truth: Option<Pose>,
}
