//! The whole way from an image to its features.

use std::convert::Infallible;

use image::GrayImage;
use rayon::prelude::*;

use super::boxes::Strips;
use super::descriptor::SurfDescriber;
use super::detector::detect;
use super::integral::IntegralImage;
use super::orientation::OrientationEstimator;
use super::{Features, Keypoint, SurfParams};
use crate::memo::{Memo, Recalled};

/// Finds the SURF features of an image.
///
/// The strongest come first; of equally strong ones, the topmost and then leftmost. Images too
/// small for the filters have none. A feature has to be at least its filter's half width away from
/// the border, while its descriptor may look beyond, where the outermost pixels repeat.
///
/// ```
/// use image::{GrayImage, Luma};
/// # use posescope_core::features::{SurfParams, surf};
///
/// // A white disc of radius 5 px.
/// let image = GrayImage::from_fn(64, 48, |x, y| {
///     let inside = (x as f32 - 30.0).hypot(y as f32 - 20.0) < 5.0;
///     Luma([if inside { 255 } else { 0 }])
/// });
/// let features = surf(&image, &SurfParams::default());
/// let strongest = features.keypoints[0];
/// assert!((strongest.x - 30.0).abs() < 0.5 && (strongest.y - 20.0).abs() < 0.5);
/// assert!(!strongest.laplacian_positive);
/// ```
pub fn surf(image: &GrayImage, params: &SurfParams) -> Features {
    let Ok(features) = surf_interruptible(image, params, || Ok::<_, Infallible>(()));
    features
}

/// Keypoints turned and described between two checkpoints: hundreds for each of sixteen threads, and some
/// 40 ms of one.
const KEYPOINTS_AT_A_TIME: usize = 4096;

/// Finds what [`surf`] does. `checkpoint` is called on the caller's thread before each octave
/// and every few thousand keypoints, and can stop the search.
///
/// # Errors
/// The errors of `checkpoint`.
pub fn surf_interruptible<E>(
    image: &GrayImage,
    params: &SurfParams,
    mut checkpoint: impl FnMut() -> Result<(), E>,
) -> Result<Features, E> {
    checkpoint()?;
    let integral = IntegralImage::new(image);
    let mut keypoints = detect(&integral, params, &mut checkpoint)?;
    keypoints.sort_unstable_by(strongest_first);
    if params.max_keypoints > 0 {
        keypoints.truncate(params.max_keypoints);
    }
    let estimator = OrientationEstimator::new();
    let describer = SurfDescriber::new();
    let mut descriptors = Vec::with_capacity(keypoints.len());
    for keypoints in keypoints.chunks_mut(KEYPOINTS_AT_A_TIME) {
        checkpoint()?;
        let described = keypoints.par_iter_mut().map_init(Strips::default, |strips, keypoint| {
            if !params.upright {
                keypoint.angle = estimator.angle(&integral, keypoint, strips);
            }
            describer.describe(&integral, keypoint, strips)
        });
        descriptors.par_extend(described);
    }
    Ok(Features { keypoints, descriptors })
}

/// The features of the photo that a memo belongs to, kept there: many queries share their references, and one
/// query is matched with several. Detecting and describing takes half of FB's time; 2,000 features take 0.6 MB.
///
/// # Errors
/// The errors of `checkpoint`.
pub(crate) fn kept_surf<E>(
    image: &GrayImage,
    memo: &Memo,
    params: &SurfParams,
    checkpoint: impl FnMut() -> Result<(), E>,
) -> Result<Recalled<Features>, E> {
    memo.try_recall(params, Features::heap_bytes, || surf_interruptible(image, params, checkpoint))
}

pub(super) fn strongest_first(a: &Keypoint, b: &Keypoint) -> std::cmp::Ordering {
    (b.response.total_cmp(&a.response))
        .then(a.y.total_cmp(&b.y))
        .then(a.x.total_cmp(&b.x))
        .then(a.scale.total_cmp(&b.scale))
}

#[cfg(test)]
mod tests {
    use image::Luma;
    use proptest::prelude::*;

    use super::*;

    /// Discs and bars of many sizes on a slope.
    fn scene() -> GrayImage {
        GrayImage::from_fn(160, 120, |x, y| {
            let size = 7 + 3 * (x / 40) + 2 * (y / 30);
            let near =
                (x % 40).abs_diff(20).pow(2) + (y % 30).abs_diff(15).pow(2) < size * size / 4;
            Luma([(40 + x / 2 + if near { 90 } else { 0 } + 60 * u32::from(x % 53 < 4)) as u8])
        })
    }

    #[test]
    fn kept_features_are_those_of_the_parameters_that_are_asked_for() {
        let memo = Memo::new();
        let params = SurfParams::default();
        let few = SurfParams { max_keypoints: 3, ..params };
        for reused in [false, true] {
            for params in [params, few] {
                let Ok(found) = kept_surf(&scene(), &memo, &params, || Ok::<_, Infallible>(()));
                assert_eq!(*found.value, surf(&scene(), &params));
                assert_eq!(found.reused, reused);
            }
        }
    }

    #[test]
    fn features_are_sorted_and_limited() {
        let all = surf(&scene(), &SurfParams::default());
        assert!(all.keypoints.len() > 10);
        assert_eq!(all.keypoints.len(), all.descriptors.len());
        assert!(all.keypoints.is_sorted_by(|a, b| a.response >= b.response));
        let params = SurfParams { max_keypoints: 7, ..SurfParams::default() };
        let few = surf(&scene(), &params);
        assert_eq!(few.keypoints, all.keypoints[..7]);
        assert_eq!(few.descriptors, all.descriptors[..7]);
        assert_eq!(few, all.strongest(7));
        assert_eq!(all.strongest(1_000_000), all);
    }

    #[test]
    fn upright_features_have_the_same_places() {
        let [turned, upright] = [false, true].map(|upright| {
            let params = SurfParams { upright, ..SurfParams::default() };
            surf(&scene(), &params)
        });
        for (turned, upright) in turned.keypoints.iter().zip(&upright.keypoints) {
            assert_eq!(upright.angle, 0.0);
            assert_eq!((upright.x, upright.y), (turned.x, turned.y));
        }
    }

    #[test]
    fn thread_count_does_not_matter() {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a thread pool").install(|| surf(&scene(), &SurfParams::default()))
        };
        assert_eq!(on(1), on(5));
    }

    #[test]
    fn every_pass_can_be_stopped_and_stopping_none_changes_nothing() {
        for upright in [true, false] {
            let params = SurfParams { upright, ..SurfParams::default() };
            let mut passes = 0;
            let all = surf_interruptible(&scene(), &params, || {
                passes += 1;
                Ok::<_, ()>(())
            });
            assert_eq!(all, Ok(surf(&scene(), &params)));
            // The sums, two octaves or more that fit, the descriptors.
            assert!(passes >= 4, "{passes}");
            for stop in 0..passes {
                let mut pass = 0;
                let stopped = surf_interruptible(&scene(), &params, || {
                    pass += 1;
                    if pass > stop { Err(pass) } else { Ok(()) }
                });
                assert_eq!(stopped, Err(stop + 1), "nothing follows the pass that was stopped");
            }
        }
    }

    #[test]
    fn flat_images_have_no_features() {
        let flat = GrayImage::from_pixel(200, 100, Luma([128]));
        assert_eq!(surf(&flat, &SurfParams::default()), Features::default());
    }

    proptest! {
        #[test]
        fn no_image_is_too_small(
            width in 0u32..60, height in 0u32..60, seed in any::<u32>(),
            octaves in 0usize..6, intervals in 0usize..6, initial_step in 0usize..5,
        ) {
            let image = GrayImage::from_fn(width, height, |x, y| {
                Luma([((x / 5 + 31 * (y / 5)).wrapping_mul(2_654_435_761).wrapping_add(seed) >> 24) as u8])
            });
            let params = SurfParams { octaves, intervals, initial_step, ..SurfParams::default() };
            let features = surf(&image, &params);
            prop_assert!(width.min(height) >= 21 || features.keypoints.is_empty());
            for keypoint in &features.keypoints {
                prop_assert!((0.0..width as f32).contains(&keypoint.x));
                prop_assert!((0.0..height as f32).contains(&keypoint.y));
                prop_assert!(keypoint.scale > 0.0);
            }
        }
    }
}
