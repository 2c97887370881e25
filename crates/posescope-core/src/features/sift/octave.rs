//! One octave of the scale space: its images, and the extrema of their differences.

use fearless_simd::{Level, Simd, SimdBase as _, SimdFloat as _, SimdMask as _, dispatch, f32x8};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::SiftParams;
use super::plane::{Gaussian, Plane};

/// Smoothing of the first image of every octave (section 3.3) \[px of that octave\].
pub(super) const BASE_SIGMA: f64 = 1.6;
/// Steps of the interpolation of an extremum, after which it is dropped.
const MAX_STEPS: usize = 5;
/// Distance of extrema from the border \[px\].
const BORDER: usize = 5;
/// Rows that a thread searches at a time.
const ROWS: usize = 32;

/// Images of one size, each smoother than the one before.
pub(super) struct SiftOctave {
    /// Size of a pixel in those of the photo.
    pub(super) pixel: f32,
    pub(super) smoothed: Vec<Plane>,
}

/// An extremum of the differences, in pixels of its octave.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extremum {
    pub(super) x: f32,
    pub(super) y: f32,
    /// The place among the smoothed images.
    pub(super) level: f32,
    pub(super) response: f32,
    pub(super) is_dark: bool,
}

impl SiftOctave {
    pub(super) fn of<E>(
        base: Plane,
        pixel: f32,
        params: &SiftParams,
        checkpoint: &mut impl FnMut() -> Result<(), E>,
    ) -> Result<Self, E> {
        let step = 2.0_f64.powf(1.0 / params.intervals as f64);
        let mut smoothed = vec![base];
        let mut sigma = BASE_SIGMA;
        for level in 0..params.intervals + 2 {
            checkpoint()?;
            let more = Gaussian::new(sigma * (step * step - 1.0).sqrt());
            smoothed.push(more.smoothed(&smoothed[level]));
            sigma *= step;
        }
        Ok(Self { pixel, smoothed })
    }

    /// Drops what only the extrema are found with.
    pub(super) fn keep_described(&mut self, params: &SiftParams) {
        let last = params.intervals;
        for (level, plane) in self.smoothed.iter_mut().enumerate() {
            if level == 0 || level > last {
                *plane = Plane::new(0, 0);
            }
        }
    }

    /// The difference of two smoothed images: of one and the one before it.
    fn at(&self, level: usize, x: usize, y: usize) -> f32 {
        self.smoothed[level + 1].at(x, y) - self.smoothed[level].at(x, y)
    }

    fn size(&self) -> (usize, usize) {
        (self.smoothed[0].width, self.smoothed[0].height)
    }

    /// Extrema among their 26 neighbours, interpolated, distinct and not on an edge (sections 3.1, 4).
    pub(super) fn extrema(&self, params: &SiftParams) -> Vec<Extremum> {
        let (width, height) = self.size();
        if width <= 2 * BORDER || height <= 2 * BORDER {
            return Vec::new();
        }
        let least = (0.5 * params.contrast) as f32;
        let simd = Level::new();
        let bands: Vec<usize> = (BORDER..height - BORDER).step_by(ROWS).collect();
        let of_band = |differences: &mut DifferenceOfGaussians, &top: &usize| {
            let rows = top..(top + ROWS).min(height - BORDER);
            let mut found = Vec::new();
            dispatch!(simd, simd => self.among_neighbours(simd, rows, least, differences, &mut found));
            found
                .into_iter()
                .filter_map(|[level, x, y]| self.interpolated(level, x, y, params))
                .collect::<Vec<_>>()
        };
        bands
            .par_iter()
            .map_init(|| DifferenceOfGaussians::new(self.smoothed.len() - 1, width), of_band)
            .flatten_iter()
            .collect()
    }

    /// Level, column and row of what exceeds all its neighbours in some rows.
    #[inline(always)]
    fn among_neighbours<S: Simd>(
        &self,
        simd: S,
        rows: std::ops::Range<usize>,
        least: f32,
        differences: &mut DifferenceOfGaussians,
        found: &mut Vec<[usize; 3]>,
    ) {
        let last = self.size().0 - BORDER;
        for y in [rows.start - 1, rows.start] {
            differences.fill(&self.smoothed, y);
        }
        for y in rows {
            differences.fill(&self.smoothed, y + 1);
            for level in 1..self.smoothed.len() - 2 {
                let near = differences.around(level, y);
                for x in (BORDER..last).step_by(8) {
                    if !is_promising(simd, &near, x, least) {
                        continue;
                    }
                    let lanes = x..last.min(x + 8);
                    let extrema = lanes.filter(|&x| is_extremum(&near, x, least));
                    found.extend(extrema.map(|x| [level, x, y]));
                }
            }
        }
    }

    /// The extremum of the parabola through the neighbours (section 4).
    fn interpolated(
        &self,
        mut level: usize,
        mut x: usize,
        mut y: usize,
        params: &SiftParams,
    ) -> Option<Extremum> {
        let (width, height) = self.size();
        for _ in 0..MAX_STEPS {
            let value = |dx: isize, dy: isize, ds: isize| {
                let (x, y) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
                self.at(level.wrapping_add_signed(ds), x, y)
            };
            let here = value(0, 0, 0);
            let gradient = 0.5
                * Vector3::new(
                    value(1, 0, 0) - value(-1, 0, 0),
                    value(0, 1, 0) - value(0, -1, 0),
                    value(0, 0, 1) - value(0, 0, -1),
                );
            let xx = value(1, 0, 0) + value(-1, 0, 0) - 2.0 * here;
            let yy = value(0, 1, 0) + value(0, -1, 0) - 2.0 * here;
            let ss = value(0, 0, 1) + value(0, 0, -1) - 2.0 * here;
            let xy = 0.25 * (value(1, 1, 0) - value(-1, 1, 0) - value(1, -1, 0) + value(-1, -1, 0));
            let xs = 0.25 * (value(1, 0, 1) - value(-1, 0, 1) - value(1, 0, -1) + value(-1, 0, -1));
            let ys = 0.25 * (value(0, 1, 1) - value(0, -1, 1) - value(0, 1, -1) + value(0, -1, -1));
            let hessian = Matrix3::new(xx, xy, xs, xy, yy, ys, xs, ys, ss);
            let by = -(hessian.try_inverse()? * gradient);
            if by.amax() < 0.5 {
                let response = (here + 0.5 * gradient.dot(&by)).abs();
                let (trace, determinant) = (xx + yy, xx * yy - xy * xy);
                let edge = params.edge_ratio as f32;
                let is_edge = determinant <= 0.0
                    || trace * trace * edge >= (edge + 1.0) * (edge + 1.0) * determinant;
                return (f64::from(response) >= params.contrast && !is_edge).then_some(Extremum {
                    x: x as f32 + by.x,
                    y: y as f32 + by.y,
                    level: level as f32 + by.z,
                    response,
                    // The difference of a dark blob is that of its surroundings: positive.
                    is_dark: here > 0.0,
                });
            }
            let moved = |place: usize, by: f32| place.checked_add_signed(by.round() as isize);
            (x, y) = (moved(x, by.x)?, moved(y, by.y)?);
            level = moved(level, by.z)?;
            let is_inside = (1..=params.intervals).contains(&level)
                && (BORDER..width - BORDER).contains(&x)
                && (BORDER..height - BORDER).contains(&y);
            if !is_inside {
                return None;
            }
        }
        None
    }
}

/// Three rows of each difference of two smoothed images; whole images of them would be written and read once, in
/// more time than their numbers take to compute.
struct DifferenceOfGaussians {
    /// For each level the rows whose numbers leave 0, 1 and 2 when divided by three.
    rows: Vec<[Vec<f32>; 3]>,
}

/// The rows above, at and below a place, of the level before, its own and the level behind.
type Neighbourhood<'a> = [[&'a [f32]; 3]; 3];

impl DifferenceOfGaussians {
    fn new(levels: usize, width: usize) -> Self {
        // Eight columns at a time end behind the last.
        let row = || vec![0.0; width + 8];
        Self { rows: (0..levels).map(|_| std::array::from_fn(|_| row())).collect() }
    }

    #[inline(always)]
    fn fill(&mut self, smoothed: &[Plane], y: usize) {
        for (pair, rows) in smoothed.windows(2).zip(&mut self.rows) {
            let both = pair[1].row(y).iter().zip(pair[0].row(y));
            for (to, (after, before)) in rows[y % 3].iter_mut().zip(both) {
                *to = after - before;
            }
        }
    }

    fn around(&self, level: usize, y: usize) -> Neighbourhood<'_> {
        [level - 1, level, level + 1]
            .map(|level| [y - 1, y, y + 1].map(|y| self.rows[level][y % 3].as_slice()))
    }
}

/// Whether one of eight values is large and exceeds its six nearest neighbours. Few do, and of most that do not this
/// is seen at once.
#[inline(always)]
fn is_promising<S: Simd>(simd: S, near: &Neighbourhood<'_>, x: usize, least: f32) -> bool {
    let lanes = |row: &[f32], x: usize| f32x8::from_slice(simd, &row[x..][..8]);
    let [[_, before, _], [above, row, below], [_, behind, _]] = *near;
    let here = lanes(row, x);
    let (left, right) = (lanes(row, x - 1), lanes(row, x + 1));
    let (above, below) = (lanes(above, x), lanes(below, x));
    let (before, behind) = (lanes(before, x), lanes(behind, x));
    let most = left.max(right).max(above.max(below)).max(before.max(behind));
    let fewest = left.min(right).min(above.min(below)).min(before.min(behind));
    let is_outside = here.simd_gt(most) | here.simd_lt(fewest);
    (is_outside & here.abs().simd_ge(least)).any_true()
}

/// Whether a value is large and exceeds its 26 neighbours.
fn is_extremum(near: &Neighbourhood<'_>, x: usize, least: f32) -> bool {
    let value = near[1][1][x];
    if value.abs() < least {
        return false;
    }
    let sign = value.signum();
    let exceeds = |&other: &f32| sign * other < sign * value;
    near.iter().enumerate().all(|(level, rows)| {
        rows.iter().enumerate().all(|(y, row)| match (level, y) {
            (1, 1) => exceeds(&row[x - 1]) && exceeds(&row[x + 1]),
            _ => row[x - 1..=x + 1].iter().all(exceeds),
        })
    })
}
