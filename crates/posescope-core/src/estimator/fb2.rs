//! `fb2`: the feature-based method with a better feature and a second look.
//!
//! As FB, but
//!
//! 1. features are SIFT, compared by the Hellinger kernel ([`crate::features::sift()`]),
//! 2. depth comes from the points alone that the reference camera sees,
//! 3. and after a first consensus, accepted or not, each reference feature with a depth is sought again
//!    where the pose says that it must be, at the scale that it must have there, among the few query
//!    features that are. Among so few the ratio may be loose.

use super::feature::{Detector, Guide};
use super::{DepthRule, Entry, Family, FeatureBased, FeatureParams};
use crate::method::Method;
use crate::params::Params;
use crate::robust::AcceptanceRule;

/// The method.
pub(super) const METHOD: Method = Method::named("fb2");

/// The estimator in the registry.
pub(super) fn entry() -> Entry {
    let about =
        "indirect: SIFT, depth of visible points, and a second matching where the first pose says";
    Entry {
        family: |_, _| Some(Family::Guided),
        groups: vec!["fb2", "render"],
        least_probability: |params| params.fb2.least_probability,
        ..Entry::new(METHOD, about, |params| Box::new(FeatureBased::guided(params)))
    }
}

impl FeatureBased {
    /// The method of a family: `fb2`, or FB.
    pub(crate) fn of(family: Family, params: &Params) -> Self {
        match family {
            Family::Guided => Self::guided(params),
            _ => Self::new(params),
        }
    }

    /// `fb2` with these parameters.
    pub fn guided(params: &Params) -> Self {
        let guide = &params.fb2;
        Self {
            method: METHOD,
            detector: Detector::Sift(guide.sift),
            params: FeatureParams {
                ratio: guide.ratio,
                unique: true,
                depth_radius_px: guide.depth_radius_px,
                depth: DepthRule::Guarded,
                depth_spread: guide.depth_spread,
                visible: true,
                mlesac: guide.mlesac,
                accept: AcceptanceRule::Consensus,
                once: false,
                radius_slack: guide.radius_slack,
            },
            render: params.render.clone(),
            purpose: "mlesac of fb2",
            guide: Some(Guide { params: guide.clone() }),
        }
    }
}
