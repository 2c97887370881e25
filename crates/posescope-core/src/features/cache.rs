//! Features that were found before.

use std::convert::Infallible;
use std::sync::Arc;

use image::GrayImage;
use xxhash_rust::xxh3::xxh3_128;

use super::{Features, SurfParams, surf_interruptible};
use crate::recent::Recent;

/// The features of the images asked for last.
///
/// Many queries share their references, and one query is matched with several references: detecting
/// and describing takes half of the time of the feature-based method. Bounded, so that memory does
/// not grow with the number of queries: 2,000 features take 0.6 MB.
pub struct FeatureCache(Recent<Features>);

impl FeatureCache {
    /// Keeps the features of as many images.
    pub fn new(images: usize) -> Self {
        Self(Recent::new(images))
    }

    /// [`surf`] of the image, remembered by its pixels and the parameters.
    pub fn surf(&self, image: &GrayImage, params: &SurfParams) -> Arc<Features> {
        let Ok(features) = self.surf_interruptible(image, params, || Ok::<_, Infallible>(()));
        features
    }

    /// As [`Self::surf`], of which `checkpoint` can stop the search as in [`surf_interruptible`].
    ///
    /// # Errors
    /// Those of `checkpoint`.
    pub fn surf_interruptible<E>(
        &self,
        image: &GrayImage,
        params: &SurfParams,
        checkpoint: impl FnMut() -> Result<(), E>,
    ) -> Result<Arc<Features>, E> {
        let key = format!(
            "{:032x}-{:?}-{params:?}",
            xxh3_128(image.as_raw()),
            image.dimensions()
        );
        if let Some(features) = self.0.get(&key) {
            return Ok(features);
        }
        let features = Arc::new(surf_interruptible(image, params, checkpoint)?);
        self.0.insert(&key, Arc::clone(&features));
        Ok(features)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::surf;
    use image::Luma;

    #[test]
    fn features_are_those_of_the_image_and_the_parameters_that_are_asked_for() {
        let image = |seed: u32| {
            GrayImage::from_fn(80, 60, |x, y| {
                let block = (x / 6 + 20 * (y / 6) + seed).wrapping_mul(2_654_435_761);
                Luma([(block >> 24) as u8])
            })
        };
        let cache = FeatureCache::new(2);
        let params = SurfParams::default();
        let few = SurfParams {
            max_keypoints: 3,
            ..params
        };
        for _ in 0..2 {
            for (seed, params) in [(1, params), (2, params), (1, few)] {
                let found = cache.surf(&image(seed), &params);
                assert_eq!(*found, surf(&image(seed), &params));
            }
        }
        let again = cache.surf(&image(1), &few);
        assert!(Arc::ptr_eq(&again, &cache.surf(&image(1), &few)));
    }
}
