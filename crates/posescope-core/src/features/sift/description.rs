//! What is around a feature: the directions of its gradients.
//!
//! Gradients are taken on a grid that turns and grows with the feature, as in the paper's figure 7, and not at every
//! pixel: neighbours on the grid are ¾ σ apart, closer than the image at the feature's scale has detail. So every
//! feature takes the same time, and the weights of all samples are constants.

use std::f32::consts::{FRAC_PI_4, PI, TAU};

use fearless_simd::{Level, Simd, SimdBase as _, SimdFloat as _, dispatch, f32x8, i32x8};

use super::octave::{BASE_SIGMA, Extremum};
use super::plane::Plane;
use super::{SiftDescriptor, SiftParams};
use crate::features::Keypoint;
use crate::features::orientation::direction;

/// Distance between neighbours on the grid \[σ\].
const SPACING: f32 = 0.75;
/// Fields along each side of the descriptor, each as wide as four samples (section 6.1).
const FIELDS: usize = 4;
const SAMPLES_PER_FIELD: usize = 4;
/// Samples along each side: half a field more on both sides, as each counts for the fields on both sides of it.
const SIDE: usize = (FIELDS + 1) * SAMPLES_PER_FIELD;
/// Samples along each side for the direction, in a disc of 4.5 σ, which is three times the σ of its weights (section 5).
const ROUND: usize = 13;
/// Directions of a descriptor, and of the histogram for the feature's own.
const DIRECTIONS: usize = 8;
const BINS: usize = 36;
/// No direction of a field gets more of the descriptor's length, before that is made 1 again (section 6.1).
const MAX_SHARE: f32 = 0.2;
/// Room for the values of a row: samples by eights, and one more on both sides.
const ROW: usize = 32;

/// The weights of the samples.
pub(super) struct SiftDescriber {
    level: Level,
    /// A Gaussian over the descriptor, with half its width.
    of_samples: [[f32; ROW]; SIDE],
    /// How much a sample counts for a field, from half a field before its begin.
    of_fields: [f32; 2 * SAMPLES_PER_FIELD],
    /// A Gaussian of 1.5 σ, cut to a disc.
    of_round: [[f32; ROW]; ROUND],
}

/// Values of the image on a grid, and its gradients there: magnitudes, and directions from −π to π.
pub(super) struct Grid {
    values: [[f32; ROW]; SIDE + 2],
    magnitudes: [[f32; ROW]; SIDE],
    directions: [[f32; ROW]; SIDE],
}

impl Default for Grid {
    fn default() -> Self {
        Self {
            values: [[0.0; ROW]; SIDE + 2],
            magnitudes: [[0.0; ROW]; SIDE],
            directions: [[0.0; ROW]; SIDE],
        }
    }
}

impl SiftDescriber {
    pub(super) fn new() -> Self {
        let half_field = SAMPLES_PER_FIELD as f32;
        Self {
            level: Level::new(),
            of_samples: bell(0.5 * (FIELDS * SAMPLES_PER_FIELD) as f64, f64::INFINITY),
            of_fields: std::array::from_fn(|sample| {
                1.0 - (sample as f32 + 0.5 - half_field).abs() / half_field
            }),
            of_round: bell(1.5 / f64::from(SPACING), 0.5 * ROUND as f64),
        }
    }

    /// The features of an extremum: one for each of its dominant directions. `image` is the smoothed image of its
    /// level.
    pub(super) fn describe(
        &self,
        image: &Plane,
        pixel: f32,
        extremum: &Extremum,
        params: &SiftParams,
        grid: &mut Grid,
        into: &mut Vec<(Keypoint, SiftDescriptor)>,
    ) {
        let step = 2.0_f64.powf(f64::from(extremum.level) / params.intervals as f64);
        let sigma = (BASE_SIGMA * step) as f32;
        let at = [extremum.x, extremum.y];
        let angles = if params.upright {
            vec![0.0]
        } else {
            let spacing = SPACING * sigma;
            let histogram =
                dispatch!(self.level, simd => self.histogram(simd, image, at, spacing, grid));
            peaks(&histogram)
        };
        for angle in angles {
            // In double precision, so that single precision is the same with all mathematical libraries.
            let (sin, cos) = f64::from(angle).sin_cos();
            let along = [cos, sin].map(|part| SPACING * sigma * part as f32);
            let descriptor =
                dispatch!(self.level, simd => self.descriptor(simd, image, at, along, grid));
            let keypoint = Keypoint {
                // The first octave of an enlarged image has its pixels at even halves of the photo's.
                x: extremum.x * pixel,
                y: extremum.y * pixel,
                scale: sigma * pixel,
                angle,
                response: extremum.response,
                laplacian_positive: extremum.is_dark,
            };
            into.push((keypoint, descriptor));
        }
    }

    /// How strong the gradients around are in each direction.
    #[inline(always)]
    fn histogram<S: Simd>(
        &self,
        simd: S,
        image: &Plane,
        at: [f32; 2],
        spacing: f32,
        grid: &mut Grid,
    ) -> [f32; BINS] {
        grid.sample::<_, { ROUND + 2 }>(simd, image, at, [spacing, 0.0]);
        grid.differentiate(&self.of_round);
        // Directions from −π to π, and the last once more, as the share of what lies before it.
        let mut turns = [0.0; BINS + 2];
        let rows = grid.magnitudes.iter().zip(&grid.directions).take(ROUND);
        for (magnitudes, directions) in rows {
            for (&magnitude, &direction) in magnitudes.iter().zip(directions).take(ROUND) {
                let place = ((direction + PI) * (BINS as f32 / TAU)).clamp(0.0, BINS as f32);
                let bin = (place as usize).min(BINS);
                let share = place - bin as f32;
                turns[bin] += magnitude * (1.0 - share);
                turns[bin + 1] += magnitude * share;
            }
        }
        std::array::from_fn(|bin| {
            let place = (bin + BINS / 2) % BINS;
            turns[place] + if place < 2 { turns[place + BINS] } else { 0.0 }
        })
    }

    /// Histograms of the gradients in 4 × 4 fields around the extremum (section 6), as their roots. `along` leads
    /// from one sample of a row to the next.
    #[inline(always)]
    fn descriptor<S: Simd>(
        &self,
        simd: S,
        image: &Plane,
        at: [f32; 2],
        along: [f32; 2],
        grid: &mut Grid,
    ) -> SiftDescriptor {
        grid.sample::<_, { SIDE + 2 }>(simd, image, at, along);
        grid.differentiate(&self.of_samples);
        let (nothing, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
        let own = f32x8::from_slice(simd, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        let mut fields = [[nothing; FIELDS]; FIELDS];
        for row in 0..SIDE {
            // What each sample adds to the eight directions: linearly less for those farther from its own.
            let mut shares = [nothing; SIDE];
            for (column, shares) in shares.iter_mut().enumerate() {
                let turn = grid.directions[row][column] * (1.0 / FRAC_PI_4);
                let away = (own - turn).abs();
                let away = away.min((away - DIRECTIONS as f32).abs());
                *shares = (one - away).max(nothing) * grid.magnitudes[row][column];
            }
            let mut of_row = [nothing; FIELDS];
            for (field, sum) in of_row.iter_mut().enumerate() {
                let shares = &shares[field * SAMPLES_PER_FIELD..];
                for (shares, weight) in shares.iter().zip(&self.of_fields) {
                    *sum += *shares * *weight;
                }
            }
            for (field, sums) in fields.iter_mut().enumerate() {
                let place = row.wrapping_sub(field * SAMPLES_PER_FIELD);
                let Some(&weight) = self.of_fields.get(place) else { continue };
                for (sum, of_row) in sums.iter_mut().zip(&of_row) {
                    *sum += *of_row * weight;
                }
            }
        }
        let fields = fields.as_flattened();
        let mut squares = nothing;
        for field in fields {
            squares += *field * *field;
        }
        let most = MAX_SHARE * total(&squares).sqrt();
        let mut sums = nothing;
        for field in fields {
            sums += field.min(most);
        }
        let sum = total(&sums);
        let mut descriptor = [0.0; 128];
        if sum > 0.0 {
            for (field, into) in fields.iter().zip(descriptor.as_chunks_mut::<8>().0) {
                (field.min(most) / sum).sqrt().store_slice(into);
            }
        }
        descriptor
    }
}

/// The sum of eight values, in an order that is the same everywhere.
#[inline(always)]
fn total(values: &[f32; 8]) -> f32 {
    let [a, b, c, d, e, f, g, h] = *values;
    ((a + b) + (c + d)) + ((e + f) + (g + h))
}

/// A Gaussian of standard deviation `sigma` about the middle of a grid, cut at a distance from it.
fn bell<const N: usize>(sigma: f64, end: f64) -> [[f32; ROW]; N] {
    let away = |place: usize| place as f64 - 0.5 * (N as f64 - 1.0);
    std::array::from_fn(|y| {
        std::array::from_fn(|x| {
            let square = away(x).powi(2) + away(y).powi(2);
            let is_inside = x < N && square.sqrt() < end;
            if is_inside { (-square / (2.0 * sigma * sigma)).exp() as f32 } else { 0.0 }
        })
    })
}

impl Grid {
    /// Takes the values of an image on a grid of `M` × `M` around a place, between its pixels linearly; beyond its
    /// border those of the nearest pixels. `along` leads from one sample of a row to the next.
    #[inline(always)]
    fn sample<S: Simd, const M: usize>(
        &mut self,
        simd: S,
        image: &Plane,
        at: [f32; 2],
        along: [f32; 2],
    ) {
        let middle = 0.5 * (M as f32 - 1.0);
        let ([cos, sin], width) = (along, image.width);
        let lanes = f32x8::from_slice(simd, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]) - middle;
        let last_x = f32x8::splat(simd, (width - 1) as f32);
        let last_y = f32x8::splat(simd, (image.height - 1) as f32);
        let nothing = f32x8::splat(simd, 0.0);
        for (row, values) in self.values.iter_mut().take(M).enumerate() {
            let v = row as f32 - middle;
            let (x, y) = (at[0] - sin * v, at[1] + cos * v);
            let blocks = values.as_chunks_mut::<8>().0.iter_mut().take(M.div_ceil(8));
            for (block, values) in blocks.enumerate() {
                let u = lanes + (8 * block) as f32;
                let x = (u * cos + x).max(nothing).min(last_x);
                let y = (u * sin + y).max(nothing).min(last_y);
                // The last pixel is the right one of two.
                let (left, top) = (x.floor().min(last_x - 1.0), y.floor().min(last_y - 1.0));
                let places: i32x8<S> =
                    top.to_int::<i32x8<S>>() * width as i32 + left.to_int::<i32x8<S>>();
                let places = simd.as_array_i32x8(places);
                let mut corners = [[0.0; 8]; 4];
                for lane in 0..8 {
                    let place = places[lane] as usize;
                    let near = &image.values[place..][..width + 2];
                    corners[0][lane] = near[0];
                    corners[1][lane] = near[1];
                    corners[2][lane] = near[width];
                    corners[3][lane] = near[width + 1];
                }
                let corner = |which: usize| f32x8::from_slice(simd, &corners[which]);
                let (right, down) = (x - left, y - top);
                let above = corner(0) + (corner(1) - corner(0)) * right;
                let below = corner(2) + (corner(3) - corner(2)) * right;
                (above + (below - above) * down).store_slice(values);
            }
        }
    }

    /// Takes the gradients at `N` × `N` places within the grid, by central differences, their magnitudes weighted.
    #[inline(always)]
    fn differentiate<const N: usize>(&mut self, weights: &[[f32; ROW]; N]) {
        let into = self.magnitudes.iter_mut().zip(&mut self.directions).zip(weights);
        for (rows, ((magnitudes, directions), weights)) in self.values.array_windows().zip(into) {
            let ([above, here, below], count) = (rows, N.next_multiple_of(8));
            let into = magnitudes[..count].iter_mut().zip(&mut directions[..count]);
            for (column, (into, weight)) in into.zip(&weights[..count]).enumerate() {
                let along = here[column + 2] - here[column];
                let down = below[column + 1] - above[column + 1];
                let magnitude = weight * (along * along + down * down).sqrt();
                (*into.0, *into.1) = (magnitude, direction(down, along));
            }
        }
    }
}

/// The directions that most gradients have, and others with at least 80 % as much (section 5) \[rad\].
fn peaks(histogram: &[f32; BINS]) -> Vec<f32> {
    let smooth: [f32; BINS] = std::array::from_fn(|bin| {
        let near = |by: usize| histogram[(bin + by) % BINS];
        0.25 * near(BINS - 1) + 0.5 * near(0) + 0.25 * near(1)
    });
    let most = smooth.iter().copied().fold(0.0, f32::max);
    let mut angles = Vec::new();
    for bin in 0..BINS {
        let (before, here, behind) =
            (smooth[(bin + BINS - 1) % BINS], smooth[bin], smooth[(bin + 1) % BINS]);
        if here > before && here >= behind && here >= 0.8 * most {
            let by = 0.5 * (before - behind) / (before - 2.0 * here + behind);
            let angle = (bin as f32 + by) / BINS as f32 * TAU;
            angles.push(if angle > 0.5 * TAU { angle - TAU } else { angle });
        }
    }
    if angles.is_empty() {
        angles.push(0.0);
    }
    angles
}
