//! Several references at once: one pose that their evidence agrees on together.
//!
//! The fusions of the paper average poses, each found by itself. In a joint estimate no reference decides
//! for itself: all correspondences are drawn from together, or the costs of all views are added up at each
//! hypothesis, and what a reference found alone is one hypothesis more. A problem has one reference here
//! too; a joint estimate is one of several problems that share their query.

mod direct;
mod feature;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use super::{Direct, Failure, Family, FeatureBased, Halt, HybridParts, find, separate_failure};
use crate::event::{BranchTaken, ReferencesFused, Stage};
use crate::fusion::JOINT;
use crate::fusion::share::{Share, ShareOutcome, Support};
use crate::geometry::{Pose, PoseError};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::trace::{Cancelled, Trace};

/// A reference whose own pose is farther from the joint one than this was outvoted \[m\]: as far off as a
/// pose may be that the probability of being right is about, at the paper's scale.
const ELSEWHERE_M: f64 = 1.0;

/// One of the references of a joint estimate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct JointReference<'a> {
    /// The query with this reference.
    pub(crate) problem: &'a Problem,
    /// Feature matches between both: ratio test and uniqueness passed.
    pub(crate) matches: usize,
    /// The pose that this reference alone gave, `world_from_camera`: where a search may start from too.
    pub(crate) alone: Option<&'a Pose>,
}

/// A pose of the query, `world_from_camera`, and what each reference has to do with it, in their order.
type JointPose = (Pose, Vec<Option<Support>>);

/// The pose that several references give together, and what each has to do with it, in their order.
///
/// A method or a search that takes one reference at a time fails with [`Failure::NotJoint`].
///
/// # Errors
/// Only [`Cancelled`].
pub(crate) fn estimate_jointly(
    method: Method,
    params: &Params,
    references: &[JointReference<'_>],
    trace: &mut Trace<'_>,
) -> Result<(Result<Pose, Failure>, Vec<Share>), Cancelled> {
    trace.stage(Stage::Fuse, |trace| {
        let agreed = match references {
            [] => Err(Failure::NoReference { radius_m: None }),
            _ => separate_failure(agree(method, params, references, trace))?,
        };
        let (pose, supports) = match agreed {
            Ok((pose, supports)) => (Ok(pose), supports),
            Err(failure) => (Err(failure), vec![None; references.len()]),
        };
        let found = pose.as_ref().ok().copied();
        let elsewhere_m = params.scale.length(ELSEWHERE_M);
        let shares = shares(found.as_ref(), &supports, references, elsewhere_m);
        trace.emit(|| ReferencesFused {
            fusion: JOINT,
            shares: Arc::from(shares.as_slice()),
            pose: found,
        })?;
        Ok((pose, shares))
    })
}

/// Localises the query against all of the references, of which there is at least one.
fn agree(
    method: Method,
    params: &Params,
    references: &[JointReference<'_>],
    trace: &mut Trace<'_>,
) -> Result<JointPose, Halt> {
    let entry = find(method).ok_or_else(|| Failure::unknown(method))?;
    if let Some(HybridParts { first, second }) = entry.hybrid {
        let agreed = separate_failure(agree(first, params, references, trace))?;
        let Err(failure) = &agreed else {
            trace.emit(|| BranchTaken {
                method: first,
                why: "the joint feature-based pose was accepted".to_owned(),
            })?;
            return Ok(agreed?);
        };
        trace.emit(|| BranchTaken { method: second, why: failure.to_string() })?;
        return agree(second, params, references, trace);
    }
    match (entry.family(params), entry.cost) {
        (Some(Family::Features), _) => FeatureBased::new(params).agree(references, trace),
        (Some(Family::Grid), Some(cost)) => Direct::new(cost, params).agree(references, trace),
        (_, cost) => {
            // Of a cost of its own only another search than that on the grid is in the way.
            let own = cost.filter(|cost| cost.name == method.name());
            let search = own.map(|cost| params.costs.search(cost));
            Err(Halt::from(Failure::NotJoint { method, search }))
        }
    }
}

/// The share of each reference in the pose: as much of it as it supports.
///
/// One that supports nothing of it is an outlier; so is one that alone puts the query elsewhere, but
/// what it has in common with the pose keeps its weight.
fn shares(
    pose: Option<&Pose>,
    supports: &[Option<Support>],
    references: &[JointReference<'_>],
    elsewhere_m: f64,
) -> Vec<Share> {
    let amount = |support: &Option<Support>| support.map_or(0.0, |support| support.amount());
    let total: f64 = supports.iter().map(amount).sum();
    references
        .iter()
        .zip(supports)
        .map(|(reference, support)| {
            let weight = amount(support);
            let outcome = match (pose, reference.alone) {
                (None, _) => ShareOutcome::Failed,
                (Some(_), _) if weight <= 0.0 => ShareOutcome::Unsupportive,
                (Some(pose), Some(alone))
                    if PoseError::between(pose, alone).translation_m > elsewhere_m =>
                {
                    ShareOutcome::Outvoted
                }
                (Some(_), _) => ShareOutcome::Kept,
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
