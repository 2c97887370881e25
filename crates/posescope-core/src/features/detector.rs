//! The Fast-Hessian detector (sections 3.2 to 3.4): blobs as maxima over position and scale.

use super::blob::Sampling;
use super::hessian::BoxFilter;
use super::integral::IntegralImage;
use super::octave::{Known, Octave};
use super::{Keypoint, SurfParams};

/// Distance in the first octave \[px\], doubled with each further one, to which a maximum exceeds
/// all other responses of its filter, and between the responses through which its peak is
/// interpolated.
///
/// The paper compares 3 × 3 samples 1 px or 2 px apart. Box filters see the image through whole
/// pixels, so from one pixel to the next their responses are jagged: one blob has several maxima,
/// and derivatives over 1 px are noise. Over four street scenes against copies turned by 15° and
/// enlarged 1.3 times, with samples at every pixel, 2 px in place of 1 px raise the share of blobs
/// found again from 0.645 to 0.682, and of right matches from 0.850 to 0.882; 3 px between the
/// interpolated responses are worse again, 0.649 and 0.855.
const REACH: usize = 2;

/// Largest lobe of a filter \[px\]: box sums of larger ones may exceed 31 bits in white images.
const MAX_LOBE: usize = 741;

/// Finds all blobs, upright, octave by octave. `checkpoint` is called before each octave.
pub(super) fn detect<E>(
    integral: &IntegralImage,
    params: &SurfParams,
    checkpoint: &mut impl FnMut() -> Result<(), E>,
) -> Result<Vec<Keypoint>, E> {
    let extent = integral.width.min(integral.height);
    let initial_step = params.initial_step.max(1);
    let mut keypoints = Vec::new();
    let mut known = Known::default();
    // Without a third layer that fits into the image, an octave has no maxima.
    let useful = |&octave: &usize| {
        3 * lobe(octave, 2) <= extent && lobe(octave, params.intervals) <= MAX_LOBE
    };
    for index in (0..params.octaves).take_while(useful) {
        checkpoint()?;
        let lobes = |octave| (0..params.intervals).map(move |interval| lobe(octave, interval));
        let octave = Octave {
            sampling: Sampling {
                integral,
                step: initial_step << index,
                reach: (REACH / initial_step).max(1),
                threshold: params.threshold as f32,
            },
            filters: lobes(index).map(BoxFilter::new).collect(),
            known,
        };
        let next: Vec<usize> = lobes(index + 1).collect();
        let found;
        (found, known) = octave.search(&next);
        keypoints.extend(found);
    }
    Ok(keypoints)
}

/// Lobe width of a filter \[px\]: a third of its size, which goes 9, 15, 21, 27 in the first
/// octave, 15, 27, 39, 51 in the second, 27, 51, 75, 99 in the third (section 3.3, figure 6).
fn lobe(octave: usize, interval: usize) -> usize {
    ((interval + 1) << (octave + 1)) + 1
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};

    use std::convert::Infallible;

    use super::*;

    /// A Gaussian blob of standard deviation `sigma` at (`x`, `y`), `contrast` above 100.
    fn blob(x: f32, y: f32, sigma: f32, contrast: f32) -> GrayImage {
        GrayImage::from_fn(161, 141, |column, row| {
            let (dx, dy) = (column as f32 - x, row as f32 - y);
            let value = contrast * (-(dx * dx + dy * dy) / (2.0 * sigma * sigma)).exp();
            Luma([(100.0 + value).round() as u8])
        })
    }

    fn found(image: &GrayImage, params: &SurfParams) -> Vec<Keypoint> {
        let Ok(keypoints) =
            detect(&IntegralImage::new(image), params, &mut || Ok::<_, Infallible>(()));
        keypoints
    }

    fn strongest(image: &GrayImage) -> Keypoint {
        found(image, &SurfParams::default())
            .into_iter()
            .max_by(|a, b| a.response.total_cmp(&b.response))
            .expect("a blob")
    }

    #[test]
    fn filter_sizes_are_those_of_the_paper() {
        let sizes = |octave| [0, 1, 2, 3].map(|interval| 3 * lobe(octave, interval));
        assert_eq!(sizes(0), [9, 15, 21, 27]);
        assert_eq!(sizes(1), [15, 27, 39, 51]);
        assert_eq!(sizes(2), [27, 51, 75, 99]);
        assert_eq!(sizes(3), [51, 99, 147, 195]);
    }

    #[test]
    fn blobs_are_found_at_their_place_and_scale() {
        for sigma in [2.5, 3.5, 5.0, 7.0, 9.0] {
            for contrast in [140.0, -90.0] {
                let keypoint = strongest(&blob(80.3, 70.8, sigma, contrast));
                assert!((keypoint.x - 80.3).abs() < 0.05 * sigma);
                assert!((keypoint.y - 70.8).abs() < 0.05 * sigma);
                assert!((keypoint.scale / sigma - 0.78).abs() < 0.05);
                assert_eq!(keypoint.laplacian_positive, contrast < 0.0);
                let relative = keypoint.response / (contrast * contrast);
                assert!((relative - 0.8).abs() < 0.1);
            }
        }
    }

    #[test]
    fn twins_count_once() {
        // Two equal samples side by side: an even number of columns and rows, mirrored.
        let image = GrayImage::from_fn(60, 60, |x, y| {
            let near = (x as f32 - 29.5).hypot(y as f32 - 29.5) < 4.0;
            Luma([if near { 220 } else { 40 }])
        });
        let found = found(&image, &SurfParams { octaves: 1, ..SurfParams::default() });
        let central = found.iter().filter(|k| (k.x - 29.5).hypot(k.y - 29.5) < 2.0);
        assert_eq!(central.count(), 1);
    }
}
