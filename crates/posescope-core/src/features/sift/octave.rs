//! One octave of the scale space: its images, and the extrema of their differences.

use nalgebra::{Matrix3, Point2, Vector3};
use rayon::prelude::*;

use super::description::{descriptor, directions};
use super::{SiftDescriptor, SiftParams};
use crate::features::Keypoint;
use crate::image::FloatImage;

/// Smoothing of the first image of every octave (section 3.3) \[px of that octave\].
pub(super) const BASE_SIGMA: f64 = 1.6;
/// Steps of the interpolation of an extremum, after which it is dropped.
const MAX_STEPS: usize = 5;
/// Distance of extrema from the border \[px\].
const BORDER: u32 = 5;
/// The image convolved with a Gaussian of `sigma` \[px\], the outermost pixels repeated. An image library's
/// blur takes four times as long, and half of the time of all of SIFT is this.
pub(super) fn blurred(image: &FloatImage, sigma: f32) -> FloatImage {
    let reach = (4.0 * sigma).ceil().max(1.0) as usize;
    let weight = |away: usize| (-((away * away) as f32) / (2.0 * sigma * sigma)).exp();
    let sum: f32 = weight(0) + 2.0 * (1..=reach).map(weight).sum::<f32>();
    let kernel: Vec<f32> =
        (0..=2 * reach).map(|place| weight(place.abs_diff(reach)) / sum).collect();
    let (width, height) = (image.width() as usize, image.height() as usize);
    let values = image.as_raw();
    let mut along = vec![0.0; width * height];
    along.par_chunks_mut(width).zip(values.par_chunks(width)).for_each(|(to, from)| {
        let mut row = vec![from[0]; reach];
        row.extend_from_slice(from);
        row.extend(std::iter::repeat_n(from[width - 1], reach));
        for (place, weight) in kernel.iter().enumerate() {
            for (to, from) in to.iter_mut().zip(&row[place..]) {
                *to += weight * from;
            }
        }
    });
    let mut down = vec![0.0; width * height];
    down.par_chunks_mut(width).enumerate().for_each(|(y, to)| {
        for (place, weight) in kernel.iter().enumerate() {
            let row = (y + place).saturating_sub(reach).min(height - 1);
            let from = &along[row * width..][..width];
            for (to, from) in to.iter_mut().zip(from) {
                *to += weight * from;
            }
        }
    });
    FloatImage::from_raw(image.width(), image.height(), down).expect("as many values as pixels")
}

/// Every second pixel of every second row.
pub(super) fn halved(image: &FloatImage) -> FloatImage {
    FloatImage::from_fn(image.width() / 2, image.height() / 2, |x, y| {
        *image.get_pixel(2 * x, 2 * y)
    })
}

/// Images of one size, each smoother than the one before.
pub(super) struct Octave {
    /// Size of a pixel in those of the photo.
    pixel: f32,
    pub(super) smoothed: Vec<FloatImage>,
    /// Each of the smoothed less the one before it.
    differences: Vec<FloatImage>,
}

/// An extremum of the differences, in pixels of its octave.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extremum {
    pub(super) x: f32,
    pub(super) y: f32,
    /// The place among the smoothed images.
    level: f32,
    pub(super) response: f32,
    is_dark: bool,
}

impl Octave {
    pub(super) fn of<E>(
        base: FloatImage,
        pixel: f32,
        params: &SiftParams,
        checkpoint: &mut impl FnMut() -> Result<(), E>,
    ) -> Result<Self, E> {
        let step = 2.0_f64.powf(1.0 / params.intervals as f64);
        let mut smoothed = vec![base];
        let mut sigma = BASE_SIGMA;
        for level in 0..params.intervals + 2 {
            checkpoint()?;
            let more = sigma * (step * step - 1.0).sqrt();
            smoothed.push(blurred(&smoothed[level], more as f32));
            sigma *= step;
        }
        let differences = smoothed.windows(2).map(|pair| {
            let values = pair[1].as_raw().iter().zip(pair[0].as_raw());
            let values: Vec<f32> = values.map(|(after, before)| after - before).collect();
            FloatImage::from_raw(pair[0].width(), pair[0].height(), values)
                .expect("as many values as pixels")
        });
        Ok(Self { pixel, differences: differences.collect(), smoothed })
    }

    fn at(&self, level: usize, x: u32, y: u32) -> f32 {
        self.differences[level].get_pixel(x, y).0[0]
    }

    /// Extrema among their 26 neighbours, interpolated, distinct and not on an edge (sections 3.1, 4).
    pub(super) fn extrema(&self, params: &SiftParams) -> Vec<Extremum> {
        let (width, height) = self.differences[0].dimensions();
        if width <= 2 * BORDER || height <= 2 * BORDER {
            return Vec::new();
        }
        let least = (0.5 * params.contrast) as f32;
        let rows: Vec<(usize, u32)> = (1..=params.intervals)
            .flat_map(|level| (BORDER..height - BORDER).map(move |y| (level, y)))
            .collect();
        rows.par_iter()
            .flat_map_iter(|&(level, y)| {
                (BORDER..width - BORDER)
                    .filter(move |&x| self.is_extremum(level, x, y, least))
                    .filter_map(move |x| self.interpolated(level, x, y, params))
            })
            .collect()
    }

    fn is_extremum(&self, level: usize, x: u32, y: u32, least: f32) -> bool {
        let value = self.at(level, x, y);
        if value.abs() < least {
            return false;
        }
        let sign = value.signum();
        let mut neighbours = (level - 1..=level + 1).flat_map(|level| {
            (y - 1..=y + 1).flat_map(move |y| (x - 1..=x + 1).map(move |x| (level, x, y)))
        });
        neighbours
            .all(|(l, u, v)| (l, u, v) == (level, x, y) || sign * self.at(l, u, v) < sign * value)
    }

    /// The extremum of the parabola through the neighbours (section 4).
    fn interpolated(
        &self,
        mut level: usize,
        mut x: u32,
        mut y: u32,
        params: &SiftParams,
    ) -> Option<Extremum> {
        let (width, height) = self.differences[0].dimensions();
        for _ in 0..MAX_STEPS {
            let value = |dx: i32, dy: i32, ds: isize| {
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
            let moved = |place: u32, by: f32| place.checked_add_signed(by.round() as i32);
            (x, y) = (moved(x, by.x)?, moved(y, by.y)?);
            level = level.checked_add_signed(by.z.round() as isize)?;
            let is_inside = (1..=params.intervals).contains(&level)
                && (BORDER..width - BORDER).contains(&x)
                && (BORDER..height - BORDER).contains(&y);
            if !is_inside {
                return None;
            }
        }
        None
    }

    /// The features of an extremum: one for each of its dominant directions.
    pub(super) fn described(
        &self,
        extremum: &Extremum,
        params: &SiftParams,
    ) -> Vec<(Keypoint, SiftDescriptor)> {
        let step = 2.0_f32.powf(extremum.level / params.intervals as f32);
        let sigma = BASE_SIGMA as f32 * step;
        let level = (extremum.level.round() as usize).min(self.smoothed.len() - 1);
        let image = &self.smoothed[level];
        let at = Point2::new(extremum.x, extremum.y);
        let angles = if params.upright { vec![0.0] } else { directions(image, at, sigma) };
        // The first octave of an enlarged image has its pixels at even halves of the photo's.
        angles
            .into_iter()
            .map(|angle| {
                let keypoint = Keypoint {
                    x: extremum.x * self.pixel,
                    y: extremum.y * self.pixel,
                    scale: sigma * self.pixel,
                    angle,
                    response: extremum.response,
                    laplacian_positive: extremum.is_dark,
                };
                (keypoint, descriptor(image, at, sigma, angle))
            })
            .collect()
    }
}
