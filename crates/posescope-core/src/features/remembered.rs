//! Features that were found before.

use image::GrayImage;

use super::{Features, SurfParams, surf, surf_interruptible};
use crate::memo::{Exact, Memo, Recalled, Remembered};

impl Remembered for Features {
    fn heap_bytes(&self) -> usize {
        size_of_val(self.keypoints.as_slice()) + size_of_val(self.descriptors.as_slice())
    }
}

/// [`surf`] of the image that a memo belongs to, remembered there.
///
/// Many queries share their references, one query is matched with several references, and whoever
/// ranks references by their matches has found the features of those that are chosen: detecting and
/// describing takes half of the time of the feature-based method. 2,000 features take 0.6 MB.
pub fn remembered(image: &GrayImage, memo: &Memo, params: &SurfParams) -> Recalled<Features> {
    memo.recall(Exact::of(params), || surf(image, params))
}

/// Returns what [`remembered`] does; `checkpoint` can stop the search as in [`surf_interruptible`].
///
/// # Errors
/// The errors of `checkpoint`.
pub fn remembered_interruptible<E>(
    image: &GrayImage,
    memo: &Memo,
    params: &SurfParams,
    checkpoint: impl FnMut() -> Result<(), E>,
) -> Result<Recalled<Features>, E> {
    memo.try_recall(Exact::of(params), || surf_interruptible(image, params, checkpoint))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn features_are_those_of_the_parameters_that_are_asked_for() {
        let image = GrayImage::from_fn(80, 60, |x, y| {
            let block = (x / 6 + 20 * (y / 6)).wrapping_mul(2_654_435_761);
            Luma([(block >> 24) as u8])
        });
        let memo = Memo::of(2);
        let params = SurfParams::default();
        let few = SurfParams { max_keypoints: 3, ..params };
        for reused in [false, true] {
            for params in [params, few] {
                let found = remembered(&image, &memo, &params);
                assert_eq!(*found.value, surf(&image, &params));
                assert_eq!(found.reused, reused);
            }
        }
    }
}
