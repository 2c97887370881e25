//! The joint hybrid: the joint pose of one method, and of another where that has none.

use super::{JointEstimator, JointOutcome, JointReference};
use crate::estimator::HybridParts;
use crate::event::BranchTaken;
use crate::trace::{Cancelled, Trace};

/// The hybrid of two methods that each take several references at once.
pub struct JointHybrid {
    parts: HybridParts,
    first: Box<dyn JointEstimator>,
    second: Box<dyn JointEstimator>,
}

impl JointHybrid {
    /// The hybrid of these, which are the joint estimators of its methods.
    pub fn new(
        parts: HybridParts,
        first: Box<dyn JointEstimator>,
        second: Box<dyn JointEstimator>,
    ) -> Self {
        Self { parts, first, second }
    }
}

impl JointEstimator for JointHybrid {
    fn estimate(
        &self,
        references: &[JointReference<'_>],
        trace: &mut Trace<'_>,
    ) -> Result<JointOutcome, Cancelled> {
        let HybridParts { first, second } = self.parts;
        let outcome = self.first.estimate(references, trace)?;
        let Err(failure) = &outcome.pose else {
            trace.emit(|| BranchTaken {
                method: first,
                why: "the joint feature-based pose was accepted".to_owned(),
            })?;
            return Ok(outcome);
        };
        trace.emit(|| BranchTaken { method: second, why: failure.to_string() })?;
        self.second.estimate(references, trace)
    }
}
