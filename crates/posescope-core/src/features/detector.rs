//! The Fast-Hessian detector (sections 3.2 to 3.4): blobs as maxima over position and scale.

use std::ops::Range;

use fearless_simd::{Level, dispatch};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::hessian::{BoxFilter, Layer};
use super::integral::IntegralImage;
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
const LARGEST_LOBE: usize = 741;

/// Finds all blobs, in the order of octave, layer, row and column, upright. `checkpoint` is called
/// before each pass over the image.
pub(super) fn detect<E>(
    integral: &IntegralImage,
    params: &SurfParams,
    checkpoint: &mut impl FnMut() -> Result<(), E>,
) -> Result<Vec<Keypoint>, E> {
    let extent = integral.width().min(integral.height());
    let mut keypoints = Vec::new();
    let mut octave: Vec<Layer> = Vec::new();
    let mut step = params.initial_step.max(1);
    // Without a third layer that fits into the image, an octave has no maxima.
    let useful = |&octave: &usize| {
        3 * lobe(octave, 2) <= extent && lobe(octave, params.intervals) <= LARGEST_LOBE
    };
    for index in (0..params.octaves).take_while(useful) {
        octave = (0..params.intervals)
            .map(|interval| lobe(index, interval))
            .map(|lobe| {
                checkpoint()?;
                // Half of the sizes of an octave occur in the one below it already.
                Ok(
                    match octave.iter().find(|layer| layer.filter.lobe() == lobe) {
                        Some(finer) => finer.decimated(step),
                        None => Layer::new(integral, BoxFilter::new(lobe), step),
                    },
                )
            })
            .collect::<Result<_, E>>()?;
        for layers in octave.array_windows() {
            checkpoint()?;
            let neighbourhood = Neighbourhood {
                layers: layers.each_ref(),
                reach: (REACH / params.initial_step.max(1)).max(1),
            };
            keypoints.extend(neighbourhood.maxima(integral, params.threshold as f32));
        }
        step *= 2;
    }
    Ok(keypoints)
}

/// Lobe width of a filter \[px\]: a third of its size, which goes 9, 15, 21, 27 in the first
/// octave, 15, 27, 39, 51 in the second, 27, 51, 75, 99 in the third (section 3.3, figure 6).
fn lobe(octave: usize, interval: usize) -> usize {
    ((interval + 1) << (octave + 1)) + 1
}

/// Three layers with filters of successive sizes, the middle one searched for maxima.
struct Neighbourhood<'a> {
    layers: [&'a Layer; 3],
    /// [`REACH`] in samples.
    reach: usize,
}

impl Neighbourhood<'_> {
    /// Finds the maxima above a threshold (section 3.4).
    fn maxima(&self, integral: &IntegralImage, threshold: f32) -> Vec<Keypoint> {
        let [_, layer, above] = self.layers;
        // Responses of the largest filter exist this far from the border.
        let inside = |extent: usize| -> Range<usize> {
            let margin = above.filter.margin();
            let last = extent.saturating_sub(margin + 1) / layer.step;
            margin.div_ceil(layer.step) + self.reach..(last + 1).saturating_sub(self.reach)
        };
        let columns = inside(integral.width());
        let level = Level::new();
        inside(integral.height())
            .into_par_iter()
            .flat_map_iter(|row| {
                let peaks = dispatch!(
                    level,
                    _simd => peaks([row - 1, row, row + 1].map(|row| layer.row(row)), threshold)
                );
                columns
                    .clone()
                    .filter(move |&column| peaks[column])
                    .filter(move |&column| self.is_maximum(column, row))
                    .filter_map(move |column| self.localise(integral, column, row))
            })
            .collect()
    }

    /// Whether a sample of the middle layer exceeds those around it. Of equal ones, the first
    /// counts.
    fn is_maximum(&self, column: usize, row: usize) -> bool {
        let value = self.layers[1].at(column, row);
        for (index, radius) in [1, self.reach, 1].into_iter().enumerate() {
            for y in row - radius..=row + radius {
                for x in column - radius..=column + radius {
                    let other = self.layers[index].at(x, y);
                    let earlier = (index, y, x) < (1, row, column);
                    if other > value || (earlier && other == value) {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// Moves a maximum to the peak of the quadratic through the samples around it in position and
    /// scale (Brown and Lowe, BMVC 2002, equations 2 and 3). None where the peak is further
    /// away than those samples are, and so not supported by any.
    fn localise(&self, integral: &IntegralImage, column: usize, row: usize) -> Option<Keypoint> {
        let reach = self.reach as isize;
        let value = |dx: isize, dy: isize, ds: isize| {
            let x = column.wrapping_add_signed(dx * reach);
            let y = row.wrapping_add_signed(dy * reach);
            self.layers[(1 + ds) as usize].at(x, y)
        };
        let peak = value(0, 0, 0);
        let gradient = 0.5
            * Vector3::new(
                value(1, 0, 0) - value(-1, 0, 0),
                value(0, 1, 0) - value(0, -1, 0),
                value(0, 0, 1) - value(0, 0, -1),
            );
        let xx = value(1, 0, 0) + value(-1, 0, 0) - 2.0 * peak;
        let yy = value(0, 1, 0) + value(0, -1, 0) - 2.0 * peak;
        let ss = value(0, 0, 1) + value(0, 0, -1) - 2.0 * peak;
        let xy = 0.25 * (value(1, 1, 0) + value(-1, -1, 0) - value(1, -1, 0) - value(-1, 1, 0));
        let xs = 0.25 * (value(1, 0, 1) + value(-1, 0, -1) - value(1, 0, -1) - value(-1, 0, 1));
        let ys = 0.25 * (value(0, 1, 1) + value(0, -1, -1) - value(0, 1, -1) - value(0, -1, 1));
        #[rustfmt::skip]
        let hessian = Matrix3::new(
            xx, xy, xs,
            xy, yy, ys,
            xs, ys, ss,
        );
        let offset = -(hessian.try_inverse()? * gradient);
        if offset.amax() > 1.0 {
            return None;
        }
        let [below, layer, _] = self.layers;
        let (x, y) = (column * layer.step, row * layer.step);
        let spacing = (self.reach * layer.step) as f32;
        let scale = layer.filter.scale();
        Some(Keypoint {
            x: x as f32 + spacing * offset.x,
            y: y as f32 + spacing * offset.y,
            // Filter sizes within an octave are equally spaced.
            scale: scale + offset.z * (scale - below.filter.scale()),
            angle: 0.0,
            response: peak + 0.5 * gradient.dot(&offset),
            laplacian_positive: layer.filter.laplacian(integral, x, y) > 0,
        })
    }
}

/// Which samples of the middle one of three rows exceed a threshold and their neighbours right, left,
/// above and below, of equal ones the first: few others are left to be compared with all around them.
#[inline(always)]
fn peaks([above, row, below]: [&[f32]; 3], threshold: f32) -> Vec<bool> {
    let count = row.len();
    let mut peaks = vec![false; count];
    let inner = count.saturating_sub(2);
    let (above, below) = (&above[1..][..inner], &below[1..][..inner]);
    let (left, middle, right) = (&row[..inner], &row[1..][..inner], &row[2..][..inner]);
    for (i, peak) in peaks[1..][..inner].iter_mut().enumerate() {
        let value = middle[i];
        *peak = (value > threshold)
            & (value > above[i])
            & (value > left[i])
            & (value >= right[i])
            & (value >= below[i]);
    }
    peaks
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
        let Ok(keypoints) = detect(&IntegralImage::new(image), params, &mut || {
            Ok::<_, Infallible>(())
        });
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
        let found = found(
            &image,
            &SurfParams {
                octaves: 1,
                ..SurfParams::default()
            },
        );
        let central = found
            .iter()
            .filter(|k| (k.x - 29.5).hypot(k.y - 29.5) < 2.0);
        assert_eq!(central.count(), 1);
    }
}
