//! Dominant directions of the gradient (section 4.1).

use std::array;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_3, PI, TAU};

use fearless_simd::{Level, dispatch};

use super::Keypoint;
use super::boxes::{Spans, Strips, aligned};
use super::integral::IntegralImage;

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

/// Wavelets in the disc.
const WAVELETS: usize = 109;

/// Sums over all cells left of and above each corner of the grid about a keypoint: an integral
/// image in units of its scale.
type CornerSums = [[f32; CELLS + 1]; CELLS + 1];

/// Estimates orientations from a disc of Haar wavelet responses.
pub(super) struct OrientationEstimator {
    level: Level,
    wavelets: [Wavelet; WAVELETS],
}

/// Place of a wavelet on the grid of cells, and its Gaussian weight.
#[derive(Clone, Copy)]
struct Wavelet {
    /// Cell corner at its centre.
    column: usize,
    row: usize,
    weight: f32,
}

/// Weighted wavelet responses, vectors, and their directions \[rad\].
struct HaarResponses {
    directions: [f32; WAVELETS],
    dx: [f32; WAVELETS],
    dy: [f32; WAVELETS],
}

impl OrientationEstimator {
    pub(super) fn new() -> Self {
        let positions = || -RADIUS..=RADIUS;
        let corner = |position: i32| (position + CELLS as i32 / 2) as usize;
        let mut places = positions()
            .flat_map(|y| positions().map(move |x| (x, y)))
            .filter(|(x, y)| x * x + y * y < RADIUS * RADIUS);
        let wavelets = array::from_fn(|_| {
            let (x, y) = places.next().expect("so many are in the disc");
            Wavelet {
                column: corner(x),
                row: corner(y),
                weight: (-((x * x + y * y) as f32) / (2.0 * SIGMA * SIGMA)).exp(),
            }
        });
        debug_assert!(places.next().is_none());
        Self { level: Level::new(), wavelets }
    }

    /// The direction of the longest sum of responses whose directions lie within a window of 60°
    /// \[rad\].
    pub(super) fn angle(
        &self,
        integral: &IntegralImage,
        keypoint: &Keypoint,
        strips: &mut Strips,
    ) -> f32 {
        let responses = dispatch!(self.level, _simd => self.responses(integral, keypoint, strips));
        let order = responses.in_order();

        // A window that starts at each response in turn: no other window holds more.
        let (mut dx, mut dy) = (0.0, 0.0);
        let (mut longest, mut angle) = (-1.0, 0.0);
        let mut entering = 0;
        for &leaving in &order {
            let end = responses.directions[leaving] + WINDOW;
            while entering < 2 * WAVELETS {
                let turns = if entering < WAVELETS { 0.0 } else { TAU };
                let next = order[entering % WAVELETS];
                if responses.directions[next] + turns >= end {
                    break;
                }
                dx += responses.dx[next];
                dy += responses.dy[next];
                entering += 1;
            }
            let length = dx * dx + dy * dy;
            if length > longest {
                longest = length;
                angle = f32::atan2(dy, dx);
            }
            dx -= responses.dx[leaving];
            dy -= responses.dy[leaving];
        }
        angle
    }

    #[inline(always)]
    fn responses(
        &self,
        integral: &IntegralImage,
        keypoint: &Keypoint,
        strips: &mut Strips,
    ) -> HaarResponses {
        let sums = corner_sums(integral, keypoint, strips);
        let mut responses =
            HaarResponses { directions: [0.0; WAVELETS], dx: [0.0; WAVELETS], dy: [0.0; WAVELETS] };
        for (i, wavelet) in self.wavelets.iter().enumerate() {
            [responses.dx[i], responses.dy[i]] = wavelet.response(&sums);
        }
        for i in 0..WAVELETS {
            responses.directions[i] = direction(responses.dy[i], responses.dx[i]);
        }
        for (i, wavelet) in self.wavelets.iter().enumerate() {
            responses.dx[i] *= wavelet.weight;
            responses.dy[i] *= wavelet.weight;
        }
        responses
    }
}

impl HaarResponses {
    /// The responses by their directions.
    fn in_order(&self) -> [usize; WAVELETS] {
        // Numbers in the order of the directions, with the responses' own below.
        let mut keys: [u64; WAVELETS] = array::from_fn(|i| {
            let bits = self.directions[i].to_bits();
            let ordered = if bits >> 31 == 0 { bits | 1 << 31 } else { !bits };
            (u64::from(ordered) << 32) | i as u64
        });
        keys.sort_unstable();
        keys.map(|key| key as u32 as usize)
    }
}

/// The angle of a vector as [`f32::atan2`] has it, to 3e-7, by operations that serve many vectors at
/// once and round alike on all processors: the polynomial of Hastings, *Approximations for Digital
/// Computers*, 1955, sheet 13, on the octant next to the x axis.
#[inline(always)]
pub(super) fn direction(y: f32, x: f32) -> f32 {
    const COEFFICIENTS: [f32; 8] = [
        -0.333_331_45,
        0.199_935_51,
        -0.142_089,
        0.106_562_64,
        -0.075_289_64,
        0.042_909_614,
        -0.016_165_737,
        0.002_866_225_7,
    ];
    let (across, along) = (y.abs(), x.abs());
    let (less, more) = (across.min(along), across.max(along));
    let slope = if more > 0.0 { less / more } else { 0.0 };
    let squared = slope * slope;
    let mut sum = 0.0;
    for coefficient in COEFFICIENTS.into_iter().rev() {
        sum = (sum + coefficient) * squared;
    }
    let octant = slope + slope * sum;
    let quadrant = if across > along { FRAC_PI_2 - octant } else { octant };
    let half = if x < 0.0 { PI - quadrant } else { quadrant };
    half.copysign(y)
}

#[inline(always)]
fn corner_sums(integral: &IntegralImage, keypoint: &Keypoint, strips: &mut Strips) -> CornerSums {
    let scale = keypoint.scale;
    let spans = |centre: f32, extent: usize| -> Spans<CELLS> {
        let middle = 0.5 * (CELLS as f32 - 1.0);
        let mut centres = [0.0; CELLS];
        for (cell, at) in centres.iter_mut().enumerate() {
            *at = centre + scale * (cell as f32 - middle);
        }
        Spans::new(&centres, scale, extent)
    };
    let columns = spans(keypoint.x, integral.width);
    let rows = spans(keypoint.y, integral.height);
    let cells = aligned(integral, &columns, &rows, strips);
    let mut sums = [[0.0; CELLS + 1]; CELLS + 1];
    for (y, cells) in cells.iter().enumerate() {
        let mut row_sum = 0.0;
        for (x, cell) in cells.iter().enumerate() {
            row_sum += cell;
            sums[y + 1][x + 1] = sums[y][x + 1] + row_sum;
        }
    }
    sums
}

impl Wavelet {
    /// Right half less left half, lower half less upper half, of a square of side 4 σ (figure 9).
    #[inline(always)]
    fn response(&self, sums: &CornerSums) -> [f32; 2] {
        let (left, right) = (self.column - HALF_WAVELET, self.column + HALF_WAVELET);
        let (top, bottom) = (self.row - HALF_WAVELET, self.row + HALF_WAVELET);
        let sum = |left: usize, top: usize, right: usize, bottom: usize| {
            sums[bottom][right] - sums[bottom][left] - sums[top][right] + sums[top][left]
        };
        let dx = sum(self.column, top, right, bottom) - sum(left, top, self.column, bottom);
        let dy = sum(left, self.row, right, bottom) - sum(left, top, right, self.row);
        [dx, dy]
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use image::{GrayImage, Luma};
    use proptest::prelude::*;

    use super::*;

    fn keypoint(x: f32, y: f32, scale: f32) -> Keypoint {
        Keypoint { x, y, scale, angle: 0.0, response: 1.0, laplacian_positive: false }
    }

    fn angle(image: &GrayImage, keypoint: &Keypoint) -> f32 {
        let integral = IntegralImage::new(image);
        OrientationEstimator::new().angle(&integral, keypoint, &mut Strips::default())
    }

    #[test]
    fn directions_are_those_of_the_standard_library() {
        for (y, x) in [(0.0, 0.0), (0.0, 2.0), (3.0, 0.0), (-3.0, 0.0), (2.0, -2.0)] {
            assert!((direction(y, x) - y.atan2(x)).abs() < 4e-7, "{y} {x}");
        }
        assert_eq!(direction(0.0, -1.0), PI);
        assert_eq!(direction(-0.0, -1.0), -PI);
    }

    /// Widths of a window: what lies on its edge is in it or not by a rounding.
    const WIDTHS: [f32; 3] = [WINDOW - 2e-6, WINDOW, WINDOW + 2e-6];

    /// The sum of the responses in the window that starts at each, of each of the widths, by the
    /// directions of the standard library.
    fn sums_in_windows(responses: &HaarResponses) -> Vec<[[f32; 2]; WIDTHS.len()]> {
        let HaarResponses { dx, dy, .. } = responses;
        let directions: Vec<f32> = (0..WAVELETS).map(|i| dy[i].atan2(dx[i])).collect();
        let sum_from = |start: f32, width: f32| {
            let inside = |i: &usize| (directions[*i] - start + 1e-6).rem_euclid(TAU) < width + 1e-6;
            let members = (0..WAVELETS).filter(inside);
            members.fold([0.0, 0.0], |[x, y], i| [x + dx[i], y + dy[i]])
        };
        let windows = directions.iter();
        windows.map(|&start| WIDTHS.map(|width| sum_from(start, width))).collect()
    }

    proptest! {
        #[test]
        fn directions_of_any_vector_are_those_of_the_standard_library(
            y in -300f32..300.0, x in -300f32..300.0,
        ) {
            prop_assert!((direction(y, x) - y.atan2(x)).abs() < 4e-7);
        }

        #[test]
        fn the_angle_is_that_of_the_longest_sum(
            pixels in prop::collection::vec(any::<u8>(), 40 * 40), scale in 1.2f32..3.0,
        ) {
            let image = GrayImage::from_raw(40, 40, pixels).expect("a full image");
            let integral = IntegralImage::new(&image);
            let estimator = OrientationEstimator::new();
            let keypoint = keypoint(20.0, 19.0, scale);
            let mut strips = Strips::default();
            let responses = estimator.responses(&integral, &keypoint, &mut strips);
            let sums = sums_in_windows(&responses);
            let surely = |of_widths: &[[f32; 2]; WIDTHS.len()]| {
                of_widths.iter().map(|[x, y]| x.hypot(*y)).fold(f32::MAX, f32::min)
            };
            let longest = sums.iter().map(surely).fold(0.0, f32::max);
            let angle = estimator.angle(&integral, &keypoint, &mut strips);
            // Of sums as long as each other any may be the longest.
            let is_longest = sums.iter().flatten().any(|&[x, y]| {
                let error = (angle - y.atan2(x)).rem_euclid(TAU);
                x.hypot(y) > longest * (1.0 - 1e-4) && error.min(TAU - error) < 1e-3
            });
            prop_assert!(is_longest, "{angle} {longest}");
        }

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
        let image =
            GrayImage::from_fn(61, 61, |x, y| Luma([((x * x + 7 * y + x * y / 3) % 251) as u8]));
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
