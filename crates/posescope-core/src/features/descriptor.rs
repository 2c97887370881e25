//! Descriptors: sums of gradients around a keypoint (section 4.2).

use std::array;

use super::integral::{IntegralImage, Span};
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

/// Gradients in the frame of a keypoint, row by row.
type Gradients = [[[f32; 2]; SIDE]; SIDE];

/// Computes descriptors.
pub(super) struct Describer {
    gradient_weights: [[f32; REGION_SIDE]; REGION_SIDE],
    region_weights: [[f32; REGIONS]; REGIONS],
}

impl Describer {
    pub(super) fn new() -> Self {
        Self {
            gradient_weights: gaussian(GRADIENT_SIGMA),
            region_weights: gaussian(REGION_SIGMA),
        }
    }

    /// Describes the window of 24 σ × 24 σ about a keypoint, turned to its angle.
    pub(super) fn describe(&self, integral: &IntegralImage, keypoint: &Keypoint) -> Descriptor {
        let gradients = gradients(integral, keypoint);
        let mut descriptor = [0.0; 4 * REGIONS * REGIONS];
        for (index, entries) in descriptor.chunks_exact_mut(4).enumerate() {
            let (row, column) = (index / REGIONS, index % REGIONS);
            let sums = self.region_sums(&gradients, REGION_STRIDE * column, REGION_STRIDE * row);
            for (entry, sum) in entries.iter_mut().zip(sums) {
                *entry = self.region_weights[row][column] * sum;
            }
        }
        let norm = descriptor.iter().map(|v| v * v).sum::<f32>().sqrt();
        if norm > 0.0 {
            descriptor.iter_mut().for_each(|entry| *entry /= norm);
        }
        descriptor
    }

    /// Weighted Σdx, Σ|dx|, Σdy, Σ|dy| of the sub-region from gradient (`left`, `top`).
    #[inline]
    fn region_sums(&self, gradients: &Gradients, left: usize, top: usize) -> [f32; 4] {
        let mut sums = [0.0; 4];
        for (row, weights) in self.gradient_weights.iter().enumerate() {
            let gradients = &gradients[top + row][left..][..REGION_SIDE];
            for (weight, [dx, dy]) in weights.iter().zip(gradients) {
                let (dx, dy) = (weight * dx, weight * dy);
                sums[0] += dx;
                sums[1] += dx.abs();
                sums[2] += dy;
                sums[3] += dy.abs();
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
fn gradients(integral: &IntegralImage, keypoint: &Keypoint) -> Gradients {
    let (width, height) = (integral.width(), integral.height());
    let (sin, cos) = keypoint.angle.sin_cos();
    let (step_x, step_y) = (keypoint.scale * cos, keypoint.scale * sin);
    let side = BOX_SIDE * keypoint.scale;
    let middle = 0.5 * SIDE as f32;
    let mut boxes = [[0.0; SIDE + 1]; SIDE + 1];
    for (row, boxes) in boxes.iter_mut().enumerate() {
        let v = row as f32 - middle;
        for (column, sum) in boxes.iter_mut().enumerate() {
            let u = column as f32 - middle;
            let x = keypoint.x + step_x * u - step_y * v;
            let y = keypoint.y + step_y * u + step_x * v;
            *sum = integral.area(Span::new(x, side, width), Span::new(y, side, height));
        }
    }
    let mut gradients = [[[0.0; 2]; SIDE]; SIDE];
    for (row, gradients) in gradients.iter_mut().enumerate() {
        let (above, below) = (&boxes[row], &boxes[row + 1]);
        for (column, gradient) in gradients.iter_mut().enumerate() {
            // The two diagonals of a square of boxes.
            let falling = below[column + 1] - above[column];
            let rising = above[column + 1] - below[column];
            *gradient = [falling + rising, falling - rising];
        }
    }
    gradients
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, PI};

    use image::{GrayImage, Luma, imageops};
    use proptest::prelude::*;

    use super::*;

    fn keypoint(x: f32, y: f32, scale: f32, angle: f32) -> Keypoint {
        Keypoint {
            x,
            y,
            scale,
            angle,
            response: 1.0,
            laplacian_positive: false,
        }
    }

    fn describe(image: &GrayImage, keypoint: Keypoint) -> Descriptor {
        Describer::new().describe(&IntegralImage::new(image), &keypoint)
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
