//! Dominant directions of the gradient (section 4.1).

use std::array;
use std::f32::consts::{FRAC_PI_3, TAU};

use super::Keypoint;
use super::integral::{IntegralImage, Span};

/// Radius of the disc of wavelet responses, in units of the scale.
const RADIUS: i32 = 6;

/// Half the side of a Haar wavelet, in units of the scale.
const HALF_WAVELET: usize = 2;

/// Cells of one scale unit per side along the square that all wavelets cover: the disc is open, so
/// its outermost wavelets are centred `RADIUS` − 1 units away.
const CELLS: usize = 2 * (RADIUS as usize - 1 + HALF_WAVELET);

/// Standard deviation of the weight on the responses, in units of the scale.
const SIGMA: f32 = 2.0;

/// Width of the sliding window over the directions of the responses \[rad\].
const WINDOW: f32 = FRAC_PI_3;

/// Estimates orientations from a disc of Haar wavelet responses.
pub(super) struct OrientationEstimator {
    wavelets: Vec<Wavelet>,
}

/// Place of a wavelet on the grid of cells, and its Gaussian weight.
struct Wavelet {
    /// Cell corner at its centre.
    column: usize,
    row: usize,
    weight: f32,
}

/// A weighted wavelet response: a vector, and its direction \[rad\].
#[derive(Clone, Copy)]
struct Response {
    direction: f32,
    dx: f32,
    dy: f32,
}

impl OrientationEstimator {
    pub(super) fn new() -> Self {
        let positions = || -RADIUS..=RADIUS;
        let corner = |position: i32| (position + CELLS as i32 / 2) as usize;
        let wavelets = positions()
            .flat_map(|y| positions().map(move |x| (x, y)))
            .filter(|(x, y)| x * x + y * y < RADIUS * RADIUS)
            .map(|(x, y)| Wavelet {
                column: corner(x),
                row: corner(y),
                weight: (-((x * x + y * y) as f32) / (2.0 * SIGMA * SIGMA)).exp(),
            })
            .collect();
        Self { wavelets }
    }

    /// The direction of the longest sum of responses whose directions lie within a window of 60°
    /// \[rad\].
    pub(super) fn angle(&self, integral: &IntegralImage, keypoint: &Keypoint) -> f32 {
        let sums = cell_sums(integral, keypoint);
        let mut responses: Vec<Response> = self
            .wavelets
            .iter()
            .map(|wavelet| wavelet.response(&sums))
            .collect();
        responses.sort_unstable_by(|a, b| a.direction.total_cmp(&b.direction));

        // A window that starts at each response in turn: no other window holds more.
        let turned = responses.iter().map(|response| Response {
            direction: response.direction + TAU,
            ..*response
        });
        let mut entering = responses.iter().copied().chain(turned).peekable();
        let (mut dx, mut dy) = (0.0, 0.0);
        let (mut longest, mut angle) = (-1.0, 0.0);
        for leaving in &responses {
            let end = leaving.direction + WINDOW;
            while let Some(response) = entering.next_if(|response| response.direction < end) {
                dx += response.dx;
                dy += response.dy;
            }
            let length = dx * dx + dy * dy;
            if length > longest {
                longest = length;
                angle = f32::atan2(dy, dx);
            }
            dx -= leaving.dx;
            dy -= leaving.dy;
        }
        angle
    }
}

/// Sums over all cells left of and above each corner of the grid about a keypoint: an integral
/// image in units of its scale.
fn cell_sums(integral: &IntegralImage, keypoint: &Keypoint) -> [[f32; CELLS + 1]; CELLS + 1] {
    let scale = keypoint.scale;
    let spans = |centre: f32, extent: usize| -> [Span; CELLS] {
        let middle = 0.5 * (CELLS as f32 - 1.0);
        array::from_fn(|cell| Span::new(centre + scale * (cell as f32 - middle), scale, extent))
    };
    let columns = spans(keypoint.x, integral.width());
    let rows = spans(keypoint.y, integral.height());
    let mut sums = [[0.0; CELLS + 1]; CELLS + 1];
    for (y, &row) in rows.iter().enumerate() {
        let mut row_sum = 0.0;
        for (x, &column) in columns.iter().enumerate() {
            row_sum += integral.area(column, row);
            sums[y + 1][x + 1] = sums[y][x + 1] + row_sum;
        }
    }
    sums
}

impl Wavelet {
    /// Right half less left half, lower half less upper half, of a square of side 4 σ (figure 9).
    #[inline]
    fn response(&self, sums: &[[f32; CELLS + 1]; CELLS + 1]) -> Response {
        let (left, right) = (self.column - HALF_WAVELET, self.column + HALF_WAVELET);
        let (top, bottom) = (self.row - HALF_WAVELET, self.row + HALF_WAVELET);
        let sum = |left: usize, top: usize, right: usize, bottom: usize| {
            sums[bottom][right] - sums[bottom][left] - sums[top][right] + sums[top][left]
        };
        let dx = sum(self.column, top, right, bottom) - sum(left, top, self.column, bottom);
        let dy = sum(left, self.row, right, bottom) - sum(left, top, right, self.row);
        Response {
            direction: dy.atan2(dx),
            dx: self.weight * dx,
            dy: self.weight * dy,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use image::{GrayImage, Luma};
    use proptest::prelude::*;

    use super::*;

    fn keypoint(x: f32, y: f32, scale: f32) -> Keypoint {
        Keypoint {
            x,
            y,
            scale,
            angle: 0.0,
            response: 1.0,
            laplacian_positive: false,
        }
    }

    fn angle(image: &GrayImage, keypoint: &Keypoint) -> f32 {
        OrientationEstimator::new().angle(&IntegralImage::new(image), keypoint)
    }

    #[test]
    fn a_disc_of_radius_6_has_109_wavelets() {
        assert_eq!(OrientationEstimator::new().wavelets.len(), 109);
    }

    proptest! {
        #[test]
        fn slopes_point_uphill(direction in -PI..PI, scale in 1.6f32..4.0) {
            let (sin, cos) = direction.sin_cos();
            let image = GrayImage::from_fn(80, 80, |x, y| {
                let along = cos * (x as f32 - 40.0) + sin * (y as f32 - 40.0);
                Luma([(128.0 + 3.0 * along).round() as u8])
            });
            let error = (angle(&image, &keypoint(40.0, 40.0, scale)) - direction).rem_euclid(TAU);
            prop_assert!(error.min(TAU - error) < 0.03, "{error}");
        }
    }

    #[test]
    fn quarter_turns_of_the_image_turn_the_angle() {
        let image = GrayImage::from_fn(61, 61, |x, y| {
            Luma([((x * x + 7 * y + x * y / 3) % 251) as u8])
        });
        let turned = image::imageops::rotate90(&image);
        let before = angle(&image, &keypoint(28.0, 33.0, 2.3));
        // Rotated by 90° clockwise, (x, y) lies at (60 − y, x).
        let after = angle(&turned, &keypoint(27.0, 28.0, 2.3));
        let error = (after - before - 0.5 * PI).rem_euclid(TAU);
        assert!(error.min(TAU - error) < 1e-3, "{before} {after}");
    }

    #[test]
    fn flat_images_have_some_angle() {
        let flat = GrayImage::from_pixel(40, 40, Luma([77]));
        assert!(angle(&flat, &keypoint(2.0, 39.0, 3.0)).is_finite());
    }
}
