//! Several references at once: one pose that their evidence agrees on together.
//!
//! The fusions of the paper average poses, each found by itself. In a joint estimate no reference decides
//! for itself: all correspondences are drawn from together, or the costs of all views are added up at each
//! hypothesis, and what a reference found alone is one hypothesis more. A problem has one reference here
//! too; a joint estimate is one of several problems that share their query.

mod direct;
mod feature;
mod hybrid;
#[cfg(test)]
mod tests;

pub use direct::JointDirect;
pub use feature::JointFeatures;
pub use hybrid::JointHybrid;

use std::sync::Arc;

use super::Failure;
use crate::fusion::share::{Share, ShareOutcome, Support};
use crate::geometry::{Pose, PoseError};
use crate::problem::Problem;
use crate::trace::{Cancelled, Trace};

/// A reference whose own pose is farther from the joint one than this was outvoted \[m\]: as far off as a
/// pose may be that the probability of being right is about.
const ELSEWHERE_M: f64 = 1.0;

/// One of the references of a joint estimate.
#[derive(Clone, Copy, Debug)]
pub struct JointReference<'a> {
    /// The query with this reference.
    pub problem: &'a Problem,
    /// Feature matches between both: ratio test and uniqueness passed.
    pub matches: usize,
    /// The pose that this reference alone gave, `world_from_camera`: where a search may start from too.
    pub alone: Option<&'a Pose>,
}

/// What several references have to say together.
#[derive(Clone, Debug)]
pub struct JointOutcome {
    /// `world_from_camera` of the query, or why there is none.
    pub pose: Result<Pose, Failure>,
    /// What each reference has to do with it, in their order; nothing without a pose.
    pub supports: Vec<Option<Support>>,
}

/// A way to find the query's pose from several references at once.
pub trait JointEstimator: Send + Sync {
    /// Localises the query against all of the references, of which there is at least one.
    ///
    /// # Errors
    /// Only [`Cancelled`].
    fn estimate(
        &self,
        references: &[JointReference<'_>],
        trace: &mut Trace<'_>,
    ) -> Result<JointOutcome, Cancelled>;
}

impl JointOutcome {
    /// No pose from so many references.
    pub fn failed(failure: Failure, references: usize) -> Self {
        Self { pose: Err(failure), supports: vec![None; references] }
    }

    /// The share of each reference in the pose: as much of it as it supports.
    ///
    /// One that supports nothing of it is an outlier; so is one that alone puts the query elsewhere, but
    /// what it has in common with the pose keeps its weight.
    pub fn shares(&self, references: &[JointReference<'_>]) -> Vec<Share> {
        let amount = |support: &Option<Support>| support.map_or(0.0, |support| support.amount());
        let total: f64 = self.supports.iter().map(amount).sum();
        references
            .iter()
            .zip(&self.supports)
            .map(|(reference, support)| {
                let weight = amount(support);
                let outcome = match (&self.pose, reference.alone) {
                    (Err(_), _) => ShareOutcome::Failed,
                    (Ok(_), _) if weight <= 0.0 => ShareOutcome::Unsupportive,
                    (Ok(pose), Some(alone)) if is_elsewhere(pose, alone) => ShareOutcome::Outvoted,
                    (Ok(_), _) => ShareOutcome::Kept,
                };
                Share {
                    reference: reference.problem.reference.name.clone(),
                    matches: reference.matches,
                    weight: if weight > 0.0 { weight / total } else { 0.0 },
                    outcome,
                    pose: reference.alone.copied(),
                    support: *support,
                }
            })
            .collect()
    }
}

fn is_elsewhere(pose: &Pose, alone: &Pose) -> bool {
    PoseError::between(pose, alone).translation_m > ELSEWHERE_M
}

/// The reference with the most matches, of equals the first: where one would start from with one alone.
fn lead(references: &[JointReference<'_>]) -> usize {
    let most = references.iter().map(|reference| reference.matches).max();
    let is_lead = |reference: &JointReference<'_>| Some(reference.matches) == most;
    references.iter().position(is_lead).unwrap_or_default()
}

/// The frame of a reference's camera seen from that of another; exactly the identity for the same.
fn between(to: &Problem, from: &Problem) -> Pose {
    if Arc::ptr_eq(&to.reference, &from.reference) {
        Pose::identity()
    } else {
        to.reference.world_from_camera.inverse() * from.reference.world_from_camera
    }
}
