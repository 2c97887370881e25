//! Descriptors: sums of gradients around a keypoint (section 4.2).

use std::array;

use fearless_simd::{Level, dispatch};

use super::boxes::{Spans, Strips, aligned, scattered};
use super::integral::IntegralImage;
use super::{Descriptor, Keypoint};

/// Sub-regions along each side of the window.
const REGIONS: usize = 4;

/// Gradients along each side of a sub-region, and from one sub-region to the next: neighbours
/// share four rows or columns.
///
/// In the paper each sub-region has its own 5 × 5 gradients, and a gradient on the edge between two
/// counts for one or the other as the window shifts a little. Overlapping sub-regions, each with a
/// weight that fades towards its edge, remove that step (Agrawal, Konolige and Blas, *CenSurE*,
/// ECCV 2008, section 3.5: modified upright SURF).
const REGION_SIDE: usize = 9;
const REGION_STRIDE: usize = 5;

/// Gradients along each side of the window, one scale unit apart.
const SIDE: usize = REGION_STRIDE * (REGIONS - 1) + REGION_SIDE;

/// Standard deviations of the weights on the gradients of a sub-region, in scale units, and on the
/// sub-regions, in strides (CenSurE, section 3.5).
const GRADIENT_SIGMA: f32 = 2.5;
const REGION_SIGMA: f32 = 1.5;

/// Side of the boxes between which gradients are taken, in scale units.
///
/// Four boxes of one unit make up the paper's wavelet of side 2. Boxes of two units overlap and
/// smooth more: from one frame of a moving car to another 5 or 10 later, 3 % more matches lie
/// on their epipolar lines, and 6 % more upright ones.
const BOX_SIDE: f32 = 2.0;

/// Sides of the square of boxes.
const BOXES: usize = SIDE + 1;

/// dx, |dx|, dy, |dy| in the frame of a keypoint, row by row.
type Gradients = [[[f32; 4]; SIDE]; SIDE];

/// Computes descriptors.
pub(super) struct SurfDescriber {
    level: Level,
    gradient_weights: [[f32; REGION_SIDE]; REGION_SIDE],
    region_weights: [[f32; REGIONS]; REGIONS],
}

impl SurfDescriber {
    pub(super) fn new() -> Self {
        Self {
            level: Level::new(),
            gradient_weights: gaussian(GRADIENT_SIGMA),
            region_weights: gaussian(REGION_SIGMA),
        }
    }

    /// Describes the window of 24 σ × 24 σ about a keypoint, turned to its angle.
    pub(super) fn describe(
        &self,
        integral: &IntegralImage,
        keypoint: &Keypoint,
        strips: &mut Strips,
    ) -> Descriptor {
        dispatch!(self.level, _simd => self.described(integral, keypoint, strips))
    }

    #[inline(always)]
    fn described(
        &self,
        integral: &IntegralImage,
        keypoint: &Keypoint,
        strips: &mut Strips,
    ) -> Descriptor {
        let gradients = gradients(integral, keypoint, strips);
        let mut descriptor = [0.0; 4 * REGIONS * REGIONS];
        for (row, entries) in descriptor.chunks_exact_mut(4 * REGIONS).enumerate() {
            let sums = self.sums_of_regions(&gradients, REGION_STRIDE * row);
            let entries = entries.chunks_exact_mut(4).zip(sums);
            for ((entries, sums), weight) in entries.zip(&self.region_weights[row]) {
                for (entry, sum) in entries.iter_mut().zip(sums) {
                    *entry = weight * sum;
                }
            }
        }
        let norm = descriptor.iter().map(|v| v * v).sum::<f32>().sqrt();
        if norm > 0.0 {
            descriptor.iter_mut().for_each(|entry| *entry /= norm);
        }
        descriptor
    }

    /// Weighted Σdx, Σ|dx|, Σdy, Σ|dy| of the four sub-regions from row `top` on.
    #[inline(always)]
    fn sums_of_regions(&self, gradients: &Gradients, top: usize) -> [[f32; 4]; REGIONS] {
        let mut sums = [[0.0; 4]; REGIONS];
        for (gradients, weights) in gradients[top..].iter().zip(&self.gradient_weights) {
            for (column, weight) in weights.iter().enumerate() {
                for (region, sums) in sums.iter_mut().enumerate() {
                    let gradient = &gradients[REGION_STRIDE * region + column];
                    for (sum, value) in sums.iter_mut().zip(gradient) {
                        *sum += weight * value;
                    }
                }
            }
        }
        sums
    }
}

/// A Gaussian bell of standard deviation `sigma`, in steps of the grid, about its middle.
fn gaussian<const N: usize>(sigma: f32) -> [[f32; N]; N] {
    let middle = 0.5 * (N as f32 - 1.0);
    let squared = |index: usize| (index as f32 - middle).powi(2);
    array::from_fn(|y| {
        array::from_fn(|x| (-(squared(x) + squared(y)) / (2.0 * sigma * sigma)).exp())
    })
}

/// Takes the gradients along the axes of the keypoint.
///
/// The paper responds to gradients along the image axes and turns those. Here the grid of
/// boxes itself is turned, though not each box; every box serves four gradients.
#[inline(always)]
fn gradients(integral: &IntegralImage, keypoint: &Keypoint, strips: &mut Strips) -> Gradients {
    let boxes = boxes(integral, keypoint, strips);
    let mut gradients = [[[0.0; 4]; SIDE]; SIDE];
    for (gradients, [above, below]) in gradients.iter_mut().zip(boxes.array_windows()) {
        for (column, gradient) in gradients.iter_mut().enumerate() {
            // The two diagonals of a square of boxes.
            let falling = below[column + 1] - above[column];
            let rising = above[column + 1] - below[column];
            let (dx, dy) = (falling + rising, falling - rising);
            *gradient = [dx, dx.abs(), dy, dy.abs()];
        }
    }
    gradients
}

/// Sums over the boxes of the window.
#[inline(always)]
fn boxes(
    integral: &IntegralImage,
    keypoint: &Keypoint,
    strips: &mut Strips,
) -> [[f32; BOXES]; BOXES] {
    let (width, height) = (integral.width, integral.height);
    let side = BOX_SIDE * keypoint.scale;
    let middle = 0.5 * SIDE as f32;
    // Plain loops: the closures of `map` would not be compiled for wide vectors.
    let mut steps = [0.0; BOXES];
    for (index, step) in steps.iter_mut().enumerate() {
        *step = index as f32 - middle;
    }
    let (mut xs, mut ys) = ([0.0; BOXES], [0.0; BOXES]);
    if keypoint.angle == 0.0 {
        for (i, step) in steps.iter().enumerate() {
            xs[i] = keypoint.x + keypoint.scale * step;
            ys[i] = keypoint.y + keypoint.scale * step;
        }
        let columns = Spans::new(&xs, side, width);
        let rows = Spans::new(&ys, side, height);
        return aligned(integral, &columns, &rows, strips);
    }
    let (sin, cos) = keypoint.angle.sin_cos();
    let (step_x, step_y) = (keypoint.scale * cos, keypoint.scale * sin);
    let mut boxes = [[0.0; BOXES]; BOXES];
    for (boxes, v) in boxes.iter_mut().zip(&steps) {
        for (i, u) in steps.iter().enumerate() {
            xs[i] = keypoint.x + step_x * u - step_y * v;
            ys[i] = keypoint.y + step_y * u + step_x * v;
        }
        let columns = Spans::new(&xs, side, width);
        let rows = Spans::new(&ys, side, height);
        *boxes = scattered(integral, &columns, &rows);
    }
    boxes
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, PI};

    use image::{GrayImage, Luma, imageops};
    use proptest::prelude::*;

    use super::*;

    fn keypoint(x: f32, y: f32, scale: f32, angle: f32) -> Keypoint {
        Keypoint { x, y, scale, angle, response: 1.0, laplacian_positive: false }
    }

    fn describe(image: &GrayImage, keypoint: Keypoint) -> Descriptor {
        let integral = IntegralImage::new(image);
        SurfDescriber::new().describe(&integral, &keypoint, &mut Strips::default())
    }

    fn distance(a: &Descriptor, b: &Descriptor) -> f32 {
        (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f32>()).sqrt()
    }

    /// Waves in several directions, with values from `low` to `high`.
    fn waves(low: f32, high: f32) -> GrayImage {
        GrayImage::from_fn(121, 121, |x, y| {
            let (x, y) = (x as f32, y as f32);
            let waves = (0.21 * x).sin() + (0.13 * x + 0.19 * y).cos() + (0.23 * y).sin();
            Luma([(low + (high - low) * (waves + 3.0) / 6.0).round() as u8])
        })
    }

    #[test]
    fn a_slope_fills_dx_only() {
        let image = GrayImage::from_fn(100, 100, |x, _| Luma([2 * x as u8]));
        let descriptor = describe(&image, keypoint(50.0, 50.0, 2.0, 0.0));
        for [dx, abs_dx, dy, abs_dy] in descriptor.as_chunks().0 {
            assert!(*dx > 0.0 && (dx - abs_dx).abs() < 1e-5);
            assert!(dy.abs() < 1e-5 && *abs_dy < 1e-5);
        }
        // Seen from a keypoint turned to the y axis, uphill is to the left: −v.
        let turned = describe(&image, keypoint(50.0, 50.0, 2.0, FRAC_PI_2));
        for [dx, _, dy, abs_dy] in turned.as_chunks().0 {
            assert!(dx.abs() < 1e-4);
            assert!(*dy < 0.0 && (dy + abs_dy).abs() < 1e-4);
        }
    }

    #[test]
    fn quarter_turns_of_image_and_angle_cancel() {
        let image = waves(0.0, 255.0);
        let before = describe(&image, keypoint(58.25, 63.5, 2.7, 0.4));
        // Rotated by 90° clockwise, (x, y) lies at (120 − y, x).
        let turned = imageops::rotate90(&image);
        let after = describe(&turned, keypoint(56.5, 58.25, 2.7, 0.4 + FRAC_PI_2));
        assert!(distance(&before, &after) < 1e-3);
    }

    #[test]
    fn brightness_and_contrast_do_not_matter() {
        let before = describe(&waves(0.0, 250.0), keypoint(60.0, 60.0, 2.0, 1.0));
        let after = describe(&waves(90.0, 215.0), keypoint(60.0, 60.0, 2.0, 1.0));
        assert!(distance(&before, &after) < 0.02);
    }

    #[test]
    fn flat_images_have_no_description() {
        let flat = GrayImage::from_pixel(50, 50, Luma([9]));
        assert_eq!(describe(&flat, keypoint(25.0, 25.0, 2.0, 0.0)), [0.0; 64]);
    }

    proptest! {
        #[test]
        fn descriptors_have_unit_norm_up_to_the_border(
            x in 0f32..120.0, y in 0f32..120.0, scale in 1.2f32..9.0, angle in -PI..PI,
        ) {
            let descriptor = describe(&waves(0.0, 255.0), keypoint(x, y, scale, angle));
            let norm = distance(&descriptor, &[0.0; 64]);
            prop_assert!((norm - 1.0).abs() < 1e-5);
        }
    }
}
