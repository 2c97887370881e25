//! The joint hybrid: the joint pose of one method, and of another where that has none.

use super::{JointEstimator, JointOutcome, JointReference};
use crate::estimator::{HybridParts, entry};
use crate::event::BranchTaken;
use crate::params::Params;
use crate::trace::{Cancelled, Trace};

/// The hybrid of two methods that each take several references at once.
pub struct JointHybrid {
    parts: HybridParts,
    first: Box<dyn JointEstimator>,
    second: Box<dyn JointEstimator>,
}

impl JointHybrid {
    /// The hybrid of both with these parameters; `None` if one takes one reference at a time.
    pub fn new(parts: HybridParts, params: &Params) -> Option<Self> {
        let part = |method| entry(method).make_joint(params);
        Some(Self { parts, first: part(parts.first)?, second: part(parts.second)? })
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
