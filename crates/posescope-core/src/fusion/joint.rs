//! *joint*: one estimate from all references, no poses averaged.

use std::sync::Arc;

use super::{JOINT, Share};
use crate::estimator::{self, Failure, JointOutcome, JointReference};
use crate::event::{ReferencesFused, Stage};
use crate::geometry::Pose;
use crate::method::Method;
use crate::params::Params;
use crate::trace::{Cancelled, Trace};

/// The pose that several references give together, and what each has to do with it, in their order.
///
/// A method that takes one reference at a time, or is in no registry, fails with [`Failure::NotJoint`].
///
/// # Errors
/// Only [`Cancelled`].
pub fn fuse_jointly(
    method: Method,
    params: &Params,
    references: &[JointReference<'_>],
    trace: &mut Trace<'_>,
) -> Result<(Result<Pose, Failure>, Vec<Share>), Cancelled> {
    trace.stage(Stage::Fuse, |trace| {
        let estimator = estimator::find(method).and_then(|entry| entry.make_joint(params));
        let outcome = match estimator {
            _ if references.is_empty() => {
                JointOutcome::failed(Failure::NoReference { radius_m: None }, 0)
            }
            None => JointOutcome::failed(Failure::NotJoint { method }, references.len()),
            Some(estimator) => estimator.estimate(references, trace)?,
        };
        let shares = outcome.shares(references);
        trace.emit(|| ReferencesFused {
            fusion: JOINT,
            shares: Arc::from(shares.as_slice()),
            pose: outcome.pose.as_ref().ok().copied(),
        })?;
        Ok((outcome.pose, shares))
    })
}
