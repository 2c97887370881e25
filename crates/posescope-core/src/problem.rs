//! For posescope's own crates: may change in any version.
//!
//! The input of an estimator: one query photo, one reference tuple, and no ground truth.

use std::borrow::Cow;
use std::convert::Infallible;
use std::fmt;
use std::sync::Arc;

use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::features::{Features, PairMatches, SurfParams, kept_surf};
use crate::geometry::Pose;
use crate::image::Photo;
use crate::input::InputError;
use crate::memo::{Memo, Recalled};
use crate::render::{RenderParams, VisibleCloud};

/// The photo whose pose is sought.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Query {
    pub(crate) name: String,
    pub(crate) photo: Arc<Photo>,
    pub(crate) intrinsics: Intrinsics,
    /// What estimators computed of this frame.
    pub(crate) memo: Memo,
}

impl Query {
    /// A photo and the camera that took it.
    ///
    /// # Errors
    /// [`InputError`] when the photo is not of the camera's size, or no camera is like that.
    pub fn new(
        name: impl Into<String>,
        photo: impl Into<Arc<Photo>>,
        intrinsics: Intrinsics,
    ) -> Result<Self, InputError> {
        let query = Self::unchecked(name, photo, intrinsics);
        check_camera(&query.name, &query.photo, &intrinsics)?;
        Ok(query)
    }

    pub(crate) fn unchecked(
        name: impl Into<String>,
        photo: impl Into<Arc<Photo>>,
        intrinsics: Intrinsics,
    ) -> Self {
        Self { name: name.into(), photo: photo.into(), intrinsics, memo: Memo::off() }
    }

    /// The same query, with which estimators keep what they compute of it, so that the next run is faster.
    #[must_use]
    pub fn remembering(self) -> Self {
        Self { memo: Memo::new(), ..self }
    }

    /// The frame's name in its scene.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The photo I_Q.
    pub fn photo(&self) -> &Arc<Photo> {
        &self.photo
    }

    /// The query camera.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// The SURF features of the photo.
    pub fn features(&self, params: &SurfParams) -> Arc<Features> {
        features_of(&self.photo, &self.memo, params)
    }
}

/// A photo with known pose and the cloud registered with it: the paper's reference tuple (I_R, P_R).
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ReferenceTuple {
    pub(crate) name: String,
    pub(crate) photo: Arc<Photo>,
    pub(crate) intrinsics: Intrinsics,
    pub(crate) world_from_camera: Pose,
    pub(crate) cloud: Cloud,
    /// What estimators computed of this frame.
    pub(crate) memo: Memo,
}

impl ReferenceTuple {
    /// A photo, the camera that took it and its pose, and a cloud in the frame of that camera.
    ///
    /// # Errors
    /// [`InputError`] when the photo is not of the camera's size, no camera is like that, or the pose
    /// is not finite. An empty cloud is no error: every method says that nothing is in view.
    pub fn new(
        name: impl Into<String>,
        photo: impl Into<Arc<Photo>>,
        intrinsics: Intrinsics,
        world_from_camera: Pose,
        cloud: Cloud,
    ) -> Result<Self, InputError> {
        let (name, photo) = (name.into(), photo.into());
        check_camera(&name, &photo, &intrinsics)?;
        if !world_from_camera.to_homogeneous().iter().all(|x| x.is_finite()) {
            return Err(InputError::Pose { frame: name });
        }
        Ok(Self { name, photo, intrinsics, world_from_camera, cloud, memo: Memo::off() })
    }

    /// The same reference, with which estimators keep what they compute of it, so that the next run is faster.
    #[must_use]
    pub fn remembering(self) -> Self {
        Self { memo: Memo::new(), ..self }
    }

    /// The same reference by another name.
    #[must_use]
    pub fn with_name(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), ..self }
    }

    /// The frame's name in its scene.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The photo I_R.
    pub fn photo(&self) -> &Arc<Photo> {
        &self.photo
    }

    /// The reference camera.
    pub fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    /// Where the reference camera stood.
    pub fn world_from_camera(&self) -> &Pose {
        &self.world_from_camera
    }

    /// The cloud P_R, in the reference camera's frame.
    pub fn cloud(&self) -> &Cloud {
        &self.cloud
    }

    /// The SURF features of the photo.
    pub fn features(&self, params: &SurfParams) -> Arc<Features> {
        features_of(&self.photo, &self.memo, params)
    }

    /// The points that the reference camera sees, cached: all methods use them.
    #[doc(hidden)]
    pub fn visible_cloud(&self, render: &RenderParams) -> Arc<VisibleCloud> {
        let visible = || VisibleCloud::new(&self.cloud, &self.intrinsics, render);
        self.memo.recall(render, VisibleCloud::heap_bytes, visible).value
    }
}

fn features_of(photo: &Photo, memo: &Memo, params: &SurfParams) -> Arc<Features> {
    let Ok(found) = kept_surf(&photo.gray, memo, params, || Ok::<_, Infallible>(()));
    found.value
}

fn check_camera(name: &str, photo: &Photo, intrinsics: &Intrinsics) -> Result<(), InputError> {
    let Intrinsics { fx, fy, cx, cy, width, height } = *intrinsics;
    let is_focal = |length: f64| length.is_finite() && length > 0.0;
    let is_camera = [fx, fy].into_iter().all(is_focal) && [cx, cy].into_iter().all(f64::is_finite);
    if !is_camera || width == 0 || height == 0 {
        return Err(InputError::Camera { frame: name.to_owned() });
    }
    if photo.dimensions() != (width, height) {
        return Err(InputError::PhotoSize {
            frame: name.to_owned(),
            photo: photo.dimensions(),
            camera: (width, height),
        });
    }
    Ok(())
}

fn is_length(length_m: f64) -> bool {
    length_m.is_finite() && length_m > 0.0
}

/// One query to localise against one reference tuple.
///
/// Several references are several problems that share their query.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Problem {
    pub(crate) query: Arc<Query>,
    pub(crate) reference: Arc<ReferenceTuple>,
    pub(crate) uncertainty_radius_m: f64,
    pub(crate) prior_m: Option<f64>,
    pub(crate) seed: u64,
    pub(crate) matches: Option<Arc<PairMatches>>,
}

impl Problem {
    /// A query that is at most `uncertainty_radius_m` from the reference, with seed 0.
    ///
    /// # Errors
    /// [`InputError::Radius`] when the radius is not a finite number above 0.
    pub fn new(
        query: impl Into<Arc<Query>>,
        reference: impl Into<Arc<ReferenceTuple>>,
        uncertainty_radius_m: f64,
    ) -> Result<Self, InputError> {
        let problem = Self {
            query: query.into(),
            reference: reference.into(),
            uncertainty_radius_m,
            prior_m: None,
            seed: 0,
            matches: None,
        };
        problem.with_radius(uncertainty_radius_m)
    }

    /// The same problem with another query.
    #[must_use]
    pub fn with_query(self, query: impl Into<Arc<Query>>) -> Self {
        Self { query: query.into(), ..self }
    }

    /// The same problem with another reference.
    #[must_use]
    pub fn with_reference(self, reference: impl Into<Arc<ReferenceTuple>>) -> Self {
        Self { reference: reference.into(), ..self }
    }

    /// The same problem with another [uncertainty radius](Self::uncertainty_radius_m).
    ///
    /// # Errors
    /// [`InputError::Radius`] when it is not a finite number above 0.
    pub fn with_radius(self, uncertainty_radius_m: f64) -> Result<Self, InputError> {
        if is_length(uncertainty_radius_m) {
            Ok(Self { uncertainty_radius_m, ..self })
        } else {
            Err(InputError::Radius { radius_m: uncertainty_radius_m })
        }
    }

    /// The same problem with another [prior](Self::prior_m).
    ///
    /// # Errors
    /// [`InputError::Prior`] when it is not a finite number above 0.
    pub fn with_prior(self, prior_m: Option<f64>) -> Result<Self, InputError> {
        match prior_m {
            Some(prior_m) if !is_length(prior_m) => Err(InputError::Prior { prior_m }),
            _ => Ok(Self { prior_m, ..self }),
        }
    }

    /// The same problem with another [seed](Self::seed).
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// The same problem with other [matches](Self::matches).
    #[must_use]
    pub fn with_matches(self, matches: Option<Arc<PairMatches>>) -> Self {
        Self { matches, ..self }
    }

    /// The photo whose pose is sought.
    pub fn query(&self) -> &Arc<Query> {
        &self.query
    }

    /// The photo, pose and cloud that are known.
    pub fn reference(&self) -> &Arc<ReferenceTuple> {
        &self.reference
    }

    /// How far from the reference the direct methods search \[m\].
    pub fn uncertainty_radius_m(&self) -> f64 {
        self.uncertainty_radius_m
    }

    /// Prior on the query's distance from the reference \[m\]. FB rejects poses beyond it. `None`: the search
    /// radius.
    pub fn prior_m(&self) -> Option<f64> {
        self.prior_m
    }

    /// Every random choice of an estimator derives from this.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// Matches of another system; without them, features are detected and matched.
    pub fn matches(&self) -> Option<&Arc<PairMatches>> {
        self.matches.as_ref()
    }

    /// The greatest plausible distance of the query from the reference \[m\].
    pub fn believed_within_m(&self) -> f64 {
        self.prior_m.unwrap_or(self.uncertainty_radius_m)
    }

    /// The pose of a camera whose pose in the reference camera's frame is `reference_from_query`.
    pub fn world_from_query(&self, reference_from_query: &Pose) -> Pose {
        self.reference.world_from_camera * reference_from_query
    }

    /// A seed for one random choice: it depends on the problem and the purpose, and on nothing else.
    pub fn random_seed(&self, purpose: &str) -> u64 {
        let Self { query, reference, .. } = self;
        let text = format!("{}/{}/{}/{purpose}", self.seed, query.name, reference.name);
        xxhash_rust::xxh3::xxh3_64(text.as_bytes())
    }

    /// The seed of the pixels that are shuffled to see what chance costs.
    pub(crate) fn shuffle_seed(&self) -> u64 {
        self.random_seed("shuffled pixels")
    }

    /// The same problem with a place for what a run prepares of it, such as the coloured cloud and the depths of
    /// features, so that estimator and confidence make each once; itself where its frames keep that longer.
    pub(crate) fn prepared(&self) -> Cow<'_, Self> {
        let keeps = |memo: &Memo| memo.id().is_some();
        let Self { query, reference, .. } = self;
        if keeps(&query.memo) && keeps(&reference.memo) {
            return Cow::Borrowed(self);
        }
        let query = if keeps(&query.memo) {
            Arc::clone(query)
        } else {
            Arc::new(Query::clone(query).remembering())
        };
        let reference = if keeps(&reference.memo) {
            Arc::clone(reference)
        } else {
            Arc::new(ReferenceTuple::clone(reference).remembering())
        };
        Cow::Owned(Self { query, reference, ..self.clone() })
    }

    /// A value that depends on these inputs, the query and the reference, kept with the query where both keep
    /// what is computed of them; else made now.
    pub(crate) fn try_recall<T: Send + Sync + 'static, E>(
        &self,
        inputs: impl fmt::Debug,
        heap_bytes: fn(&T) -> usize,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Recalled<T>, E> {
        match self.reference.memo.id() {
            Some(id) => self.query.memo.try_recall((id, inputs), heap_bytes, make),
            None => Ok(Recalled::made(Arc::new(make()?))),
        }
    }

    /// The inverse of [`Self::world_from_query`].
    pub fn reference_from_query(&self, world_from_query: &Pose) -> Pose {
        self.reference.world_from_camera.inverse() * world_from_query
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::GrayImage;

    const CAMERA: Intrinsics =
        Intrinsics { fx: 30.0, fy: 30.0, cx: 15.5, cy: 11.5, width: 32, height: 24 };

    fn photo(width: u32, height: u32) -> Photo {
        Photo::from_gray(GrayImage::new(width, height))
    }

    #[test]
    fn a_photo_of_another_size_than_its_camera_is_refused_by_name() {
        let refused = Query::new("a", photo(24, 32), CAMERA).expect_err("turned");
        assert_eq!(refused.to_string(), "the photo of a has 24x32 px, its camera 32x24");
        let pose = Pose::identity();
        let cloud = Cloud::default();
        let refused = ReferenceTuple::new("b", photo(31, 24), CAMERA, pose, cloud);
        assert!(matches!(refused, Err(InputError::PhotoSize { .. })));
    }

    #[test]
    fn what_is_no_camera_no_pose_or_no_radius_is_refused() {
        for wrong in [
            Intrinsics { fx: 0.0, ..CAMERA },
            Intrinsics { fy: f64::NAN, ..CAMERA },
            Intrinsics { cx: f64::INFINITY, ..CAMERA },
        ] {
            let refused = Query::new("a", photo(32, 24), wrong);
            assert!(matches!(refused, Err(InputError::Camera { .. })), "{wrong:?}");
        }
        let empty = Intrinsics { width: 0, ..CAMERA };
        let refused = Query::new("a", photo(0, 24), empty);
        assert!(matches!(refused, Err(InputError::Camera { .. })));

        let nowhere = Pose::translation(f64::NAN, 0.0, 0.0);
        let reference =
            |pose| ReferenceTuple::new("b", photo(32, 24), CAMERA, pose, Cloud::default());
        assert!(matches!(reference(nowhere), Err(InputError::Pose { .. })));

        let query = Arc::new(Query::new("a", photo(32, 24), CAMERA).expect("fits"));
        let reference = Arc::new(reference(Pose::identity()).expect("fits"));
        for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let refused = Problem::new(Arc::clone(&query), Arc::clone(&reference), radius);
            assert!(matches!(refused, Err(InputError::Radius { .. })), "{radius}");
        }
        let problem = Problem::new(query, reference, 3.0).expect("a problem");
        for length in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let refused = problem.clone().with_radius(length);
            assert!(matches!(refused, Err(InputError::Radius { .. })), "{length}");
            let refused = problem.clone().with_prior(Some(length));
            assert!(matches!(refused, Err(InputError::Prior { .. })), "{length}");
        }
        let problem = problem.with_radius(5.0).and_then(|problem| problem.with_prior(Some(9.0)));
        let problem = problem.expect("a problem").with_seed(7);
        assert_eq!((problem.uncertainty_radius_m(), problem.believed_within_m()), (5.0, 9.0));
        assert_eq!(problem.seed(), 7);
    }
}
