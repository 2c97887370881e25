//! R1 to R9 of a method that matches features as FB does, but with parameters of its own.

use super::{Diagnosis, Subject, feature};
use crate::estimator::FeatureParams;
use crate::params::Params;

/// The verdicts of FB, with the thresholds of `fb2`. Its first matching is what they speak of: whether the pose
/// is more than chance says that one alone.
pub(super) fn diagnose(subject: &Subject<'_>) -> Vec<Diagnosis> {
    let own = &subject.params.fb2;
    let params = Params {
        fb: FeatureParams {
            mlesac: own.mlesac,
            depth_radius_px: own.depth_radius_px,
            visible: true,
            ..subject.params.fb.clone()
        },
        ..subject.params.clone()
    };
    feature::diagnose(&Subject {
        params: &params,
        ..subject.clone()
    })
}
