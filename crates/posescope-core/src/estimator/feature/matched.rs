//! The features of both photos, and which of them look alike.

use std::convert::Infallible;
use std::sync::Arc;

use super::{FeatureBased, FeatureParams, MINIMUM};
use crate::estimator::{Failure, Halt};
use crate::event::{FeaturesDetected, Side};
use crate::features::{
    Features, FoundMatches, Match, MatchVerdict, PairMatches, SiftFeatures, SiftParams, SurfParams,
    best_matches, kept_surf, sift_interruptible,
};
use crate::memo::Recalled;
use crate::problem::Problem;
use crate::trace::Trace;

/// What matching decided about each query feature.
type Decided = Arc<[Option<Match>]>;

/// What finds and describes features.
#[derive(Debug)]
pub(in crate::estimator) enum Detector {
    /// SURF, or the matches that the problem contains.
    Surf(SurfParams),
    Sift(SiftParams),
}

/// The features of one photo.
#[derive(Clone)]
pub(in crate::estimator) struct DescribedPhoto {
    /// Without descriptors where these are SIFT's.
    pub(in crate::estimator) features: Arc<Features>,
    pub(in crate::estimator) sift: Option<Arc<SiftFeatures>>,
    pub(super) reused: bool,
}

/// The features of both photos.
pub(in crate::estimator) struct Detected {
    pub(in crate::estimator) query: DescribedPhoto,
    pub(in crate::estimator) reference: DescribedPhoto,
}

impl Detected {
    /// Whether no pose can come of so few.
    pub(super) fn is_too_few(&self) -> bool {
        [&self.query, &self.reference].iter().any(|one| one.features.keypoints.len() < MINIMUM)
    }
}

impl FeatureBased {
    pub(super) fn detect(
        &self,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<Detected, Halt> {
        Ok(Detected {
            query: self.describe(Side::Query, problem, trace)?,
            reference: self.describe(Side::Reference, problem, trace)?,
        })
    }

    fn describe(
        &self,
        side: Side,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<DescribedPhoto, Halt> {
        let (photo, memo) = match side {
            Side::Query => (&problem.query.photo, &problem.query.memo),
            Side::Reference => (&problem.reference.photo, &problem.reference.memo),
        };
        let described = match &self.detector {
            Detector::Surf(surf) => {
                let found = match found_elsewhere(problem)? {
                    Some(found) => Recalled::made(Arc::clone(match side {
                        Side::Query => &found.query,
                        Side::Reference => &found.reference,
                    })),
                    None => kept_surf(&photo.gray, memo, surf, || trace.checkpoint())?,
                };
                DescribedPhoto { features: found.value, sift: None, reused: found.reused }
            }
            Detector::Sift(sift) => {
                let found = memo.try_recall(sift, SiftFeatures::heap_bytes, || {
                    sift_interruptible(&photo.gray, sift, || trace.checkpoint())
                })?;
                let (keypoints, descriptors) = (found.value.keypoints.clone(), Vec::new());
                let features = Arc::new(Features { keypoints, descriptors });
                DescribedPhoto { features, sift: Some(found.value), reused: found.reused }
            }
        };
        let features = &described.features;
        trace.emit(|| FeaturesDetected { side, features: Arc::clone(features) })?;
        Ok(described)
    }

    pub(super) fn best_matches(
        &self,
        problem: &Problem,
        Detected { query, reference }: &Detected,
        trace: &mut Trace<'_>,
    ) -> Result<Recalled<Decided>, Halt> {
        if let Detector::Surf(_) = self.detector
            && let Some(found) = found_elsewhere(problem)?
        {
            return Ok(Recalled::made(Arc::new(Arc::clone(&found.decisions))));
        }
        let FeatureParams { ratio, unique, .. } = self.params;
        let bytes = |decided: &Decided| size_of_val(&**decided);
        let found = problem.try_recall((&self.detector, ratio, unique), bytes, || {
            let checkpoint = || trace.checkpoint();
            match (&query.sift, &reference.sift) {
                (Some(query), Some(reference)) => {
                    let (query, reference) = (&query.descriptors, &reference.descriptors);
                    decided(query, reference, &self.params, checkpoint)
                }
                _ => {
                    let [query, reference] =
                        [query, reference].map(|one| &one.features.descriptors);
                    decided(query, reference, &self.params, checkpoint)
                }
            }
        });
        Ok(found?)
    }
}

/// The matches that the problem contains; `None` if features are to be detected and matched.
fn found_elsewhere(problem: &Problem) -> Result<Option<&FoundMatches>, Failure> {
    match problem.matches.as_deref() {
        None => Ok(None),
        Some(PairMatches::Found(found)) => Ok(Some(found)),
        Some(PairMatches::Absent) => Err(Failure::NotAnswered {
            answers: "the folder of matches".to_owned(),
            missing: format!("matches of {} with {}", problem.query.name, problem.reference.name),
        }),
    }
}

/// The best match of each query feature, and whether it stands out.
fn decided<const N: usize, E>(
    query: &[[f32; N]],
    reference: &[[f32; N]],
    params: &FeatureParams,
    checkpoint: impl FnMut() -> Result<(), E>,
) -> Result<Decided, E> {
    let ratio = params.ratio as f32;
    let mut matches = best_matches(query, reference, ratio, checkpoint)?;
    if !params.unique {
        for found in matches.iter_mut().flatten() {
            if let MatchVerdict::NotUnique { .. } = found.verdict {
                found.verdict = MatchVerdict::Candidate;
            }
        }
    }
    Ok(matches.into())
}

/// How many features of the query have a match in the reference: FB's count after the ratio test and
/// uniqueness, before any depth is looked up. Fusion weighs references by it.
pub fn count_matches(query: &Features, reference: &Features, params: &FeatureParams) -> usize {
    if query.keypoints.len() < MINIMUM || reference.keypoints.len() < MINIMUM {
        return 0;
    }
    let (query, reference) = (&query.descriptors, &reference.descriptors);
    let Ok(matches) = decided(query, reference, params, || Ok::<_, Infallible>(()));
    matches.iter().flatten().filter(|found| found.verdict == MatchVerdict::Candidate).count()
}
