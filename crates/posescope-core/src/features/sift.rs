//! SIFT: extrema of differences of Gaussians, described by histograms of gradients (Lowe, *Distinctive
//! Image Features from Scale-Invariant Keypoints*, IJCV 60(2), 2004; section numbers are those of that
//! paper), with the descriptors' roots in their place (RootSIFT: Arandjelović, Zisserman, *Three things
//! everyone should know to improve object retrieval*, CVPR 2012).

use std::convert::Infallible;
use std::f32::consts::TAU;

use image::{GrayImage, Luma};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::Keypoint;
use crate::describe::parameters;
use crate::image::FloatImage;
use crate::memo::Remembered;

parameters! {
    /// What [`sift`] looks for.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SiftParams {
        /// Smallest contrast of a feature: the magnitude of the difference of Gaussians, of grey values
        /// from 0 to 1.
        pub contrast: f64 = number("contrast", "", 0.0..=1.0),
        /// Largest ratio of the principal curvatures of a feature: what lies on an edge has a larger one.
        pub edge_ratio: f64 = number("edge_ratio", "", 1.0..=1000.0),
        /// Scales that are searched in each octave.
        pub intervals: usize = count("intervals", "", 1..=8),
        /// Whether the image is enlarged to twice its size first, which finds the smallest features.
        pub enlarge: bool = flag("enlarge"),
        /// Whether to leave features upright: for cameras that do not roll.
        pub upright: bool = flag("upright"),
        /// Largest number of features to keep, the strongest; 0 keeps all.
        pub max_keypoints: usize = count("max_keypoints", "", 0..=1_000_000),
    }
}

impl Default for SiftParams {
    fn default() -> Self {
        Self {
            contrast: 0.012,
            edge_ratio: 10.0,
            intervals: 3,
            enlarge: true,
            upright: true,
            max_keypoints: 4000,
        }
    }
}

/// 4 × 4 histograms of eight directions, as the roots of their shares: a unit vector, whose product with
/// another is the Hellinger kernel of the two.
pub type SiftDescriptor = [f32; 128];

/// The SIFT features of one image, the strongest first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SiftFeatures {
    /// Where the features are; their response is the magnitude of the difference of Gaussians.
    pub keypoints: Vec<Keypoint>,
    /// What they look like: `descriptors[i]` belongs to `keypoints[i]`.
    pub descriptors: Vec<SiftDescriptor>,
}

impl Remembered for SiftFeatures {
    fn heap_bytes(&self) -> usize {
        size_of_val(self.keypoints.as_slice()) + size_of_val(self.descriptors.as_slice())
    }
}

/// Smoothing of the first image of every octave (section 3.3) \[px of that octave\].
const BASE_SIGMA: f64 = 1.6;
/// Smoothing that photos have by themselves \[px\].
const CAMERA_SIGMA: f64 = 0.5;
/// Octaves end before their images have a side shorter than this \[px\].
const SMALLEST_SIDE: u32 = 16;
/// Steps of the interpolation of an extremum, after which it is dropped.
const MOST_STEPS: usize = 5;
/// Distance of extrema from the border \[px\].
const BORDER: u32 = 5;
/// Keypoints described between two checkpoints.
const KEYPOINTS_AT_A_TIME: usize = 1024;

/// Finds the SIFT features of an image. The strongest come first; of equally strong ones, the topmost
/// and then leftmost.
pub fn sift(image: &GrayImage, params: &SiftParams) -> SiftFeatures {
    let Ok(features) = sift_interruptible(image, params, || Ok::<_, Infallible>(()));
    features
}

/// Finds what [`sift`] does. `checkpoint` is called before each pass over the image and each thousand
/// keypoints, and can stop the search.
///
/// # Errors
/// The errors of `checkpoint`.
pub fn sift_interruptible<E>(
    image: &GrayImage,
    params: &SiftParams,
    mut checkpoint: impl FnMut() -> Result<(), E>,
) -> Result<SiftFeatures, E> {
    checkpoint()?;
    let (mut base, mut pixel) = base(image, params);
    let mut octaves = Vec::new();
    while base.width().min(base.height()) >= SMALLEST_SIDE {
        let octave = Octave::of(base, pixel, params, &mut checkpoint)?;
        base = halved(&octave.smoothed[params.intervals]);
        pixel *= 2.0;
        octaves.push(octave);
    }
    let mut found: Vec<(usize, Extremum)> = Vec::new();
    for (number, octave) in octaves.iter().enumerate() {
        checkpoint()?;
        found.extend(
            octave
                .extrema(params)
                .into_iter()
                .map(|extremum| (number, extremum)),
        );
    }
    found.sort_by(|(_, a), (_, b)| {
        let strength = b.response.total_cmp(&a.response);
        strength.then(a.y.total_cmp(&b.y)).then(a.x.total_cmp(&b.x))
    });
    if params.max_keypoints > 0 {
        found.truncate(params.max_keypoints);
    }
    let mut features = SiftFeatures::default();
    for some in found.chunks(KEYPOINTS_AT_A_TIME) {
        checkpoint()?;
        let described: Vec<Vec<(Keypoint, SiftDescriptor)>> = some
            .par_iter()
            .map(|(number, extremum)| octaves[*number].described(extremum, params))
            .collect();
        for (keypoint, descriptor) in described.into_iter().flatten() {
            features.keypoints.push(keypoint);
            features.descriptors.push(descriptor);
        }
    }
    Ok(features)
}

/// The image as the first octave wants it, 0 … 1, and the size of its pixels in those of the photo.
fn base(image: &GrayImage, params: &SiftParams) -> (FloatImage, f32) {
    let value = |x: u32, y: u32| f32::from(image.get_pixel(x, y).0[0]) / 255.0;
    if image.width() == 0 || image.height() == 0 {
        return (FloatImage::new(0, 0), 1.0);
    }
    let (enlarged, pixel, has) = if params.enlarge {
        let (last_x, last_y) = (image.width() - 1, image.height() - 1);
        let enlarged = FloatImage::from_fn(2 * image.width(), 2 * image.height(), |x, y| {
            let (left, top) = (x / 2, y / 2);
            let (right, bottom) = ((left + x % 2).min(last_x), (top + y % 2).min(last_y));
            let sum = value(left, top) + value(right, top) + value(left, bottom);
            Luma([0.25 * (sum + value(right, bottom))])
        });
        (enlarged, 0.5, 2.0 * CAMERA_SIGMA)
    } else {
        let same = FloatImage::from_fn(image.width(), image.height(), |x, y| Luma([value(x, y)]));
        (same, 1.0, CAMERA_SIGMA)
    };
    let missing = (BASE_SIGMA * BASE_SIGMA - has * has).sqrt();
    (blurred(&enlarged, missing as f32), pixel)
}

/// The image convolved with a Gaussian of `sigma` \[px\], the outermost pixels repeated. An image library's
/// blur takes four times as long, and half of the time of all of SIFT is this.
fn blurred(image: &FloatImage, sigma: f32) -> FloatImage {
    let reach = (4.0 * sigma).ceil().max(1.0) as usize;
    let weight = |away: usize| (-((away * away) as f32) / (2.0 * sigma * sigma)).exp();
    let sum: f32 = weight(0) + 2.0 * (1..=reach).map(weight).sum::<f32>();
    let kernel: Vec<f32> = (0..=2 * reach)
        .map(|place| weight(place.abs_diff(reach)) / sum)
        .collect();
    let (width, height) = (image.width() as usize, image.height() as usize);
    let values = image.as_raw();
    let mut along = vec![0.0; width * height];
    along
        .par_chunks_mut(width)
        .zip(values.par_chunks(width))
        .for_each(|(to, from)| {
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
fn halved(image: &FloatImage) -> FloatImage {
    FloatImage::from_fn(image.width() / 2, image.height() / 2, |x, y| {
        *image.get_pixel(2 * x, 2 * y)
    })
}

/// Images of one size, each smoother than the one before.
struct Octave {
    /// Size of a pixel in those of the photo.
    pixel: f32,
    smoothed: Vec<FloatImage>,
    /// Each of the smoothed less the one before it.
    differences: Vec<FloatImage>,
}

/// An extremum of the differences, in pixels of its octave.
#[derive(Clone, Copy, Debug)]
struct Extremum {
    x: f32,
    y: f32,
    /// The place among the smoothed images.
    level: f32,
    response: f32,
    is_dark: bool,
}

impl Octave {
    fn of<E>(
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
        Ok(Self {
            pixel,
            differences: differences.collect(),
            smoothed,
        })
    }

    fn at(&self, level: usize, x: u32, y: u32) -> f32 {
        self.differences[level].get_pixel(x, y).0[0]
    }

    /// Extrema among their 26 neighbours, interpolated, distinct and not on an edge (sections 3.1, 4).
    fn extrema(&self, params: &SiftParams) -> Vec<Extremum> {
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
        for _ in 0..MOST_STEPS {
            let here = self.at(level, x, y);
            let gradient = 0.5
                * Vector3::new(
                    self.at(level, x + 1, y) - self.at(level, x - 1, y),
                    self.at(level, x, y + 1) - self.at(level, x, y - 1),
                    self.at(level + 1, x, y) - self.at(level - 1, x, y),
                );
            let xx = self.at(level, x + 1, y) + self.at(level, x - 1, y) - 2.0 * here;
            let yy = self.at(level, x, y + 1) + self.at(level, x, y - 1) - 2.0 * here;
            let ss = self.at(level + 1, x, y) + self.at(level - 1, x, y) - 2.0 * here;
            let xy = 0.25
                * (self.at(level, x + 1, y + 1)
                    - self.at(level, x - 1, y + 1)
                    - self.at(level, x + 1, y - 1)
                    + self.at(level, x - 1, y - 1));
            let xs = 0.25
                * (self.at(level + 1, x + 1, y)
                    - self.at(level + 1, x - 1, y)
                    - self.at(level - 1, x + 1, y)
                    + self.at(level - 1, x - 1, y));
            let ys = 0.25
                * (self.at(level + 1, x, y + 1)
                    - self.at(level + 1, x, y - 1)
                    - self.at(level - 1, x, y + 1)
                    + self.at(level - 1, x, y - 1));
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
    fn described(
        &self,
        extremum: &Extremum,
        params: &SiftParams,
    ) -> Vec<(Keypoint, SiftDescriptor)> {
        let step = 2.0_f32.powf(extremum.level / params.intervals as f32);
        let sigma = BASE_SIGMA as f32 * step;
        let level = (extremum.level.round() as usize).min(self.smoothed.len() - 1);
        let image = &self.smoothed[level];
        let angles = match params.upright {
            true => vec![0.0],
            false => directions(image, extremum, sigma),
        };
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
                (keypoint, descriptor(image, extremum, sigma, angle))
            })
            .collect()
    }
}

/// Magnitude and direction of the gradient at a pixel, by central differences.
fn gradient(image: &FloatImage, x: i32, y: i32) -> Option<(f32, f32)> {
    let (width, height) = (image.width() as i32, image.height() as i32);
    if x < 1 || y < 1 || x >= width - 1 || y >= height - 1 {
        return None;
    }
    let at = |x: i32, y: i32| image.get_pixel(x as u32, y as u32).0[0];
    let along = at(x + 1, y) - at(x - 1, y);
    let down = at(x, y + 1) - at(x, y - 1);
    Some((along.hypot(down), down.atan2(along)))
}

/// The direction that most gradients around have, and others with at least 80 % as much (section 5)
/// \[rad\].
fn directions(image: &FloatImage, extremum: &Extremum, sigma: f32) -> Vec<f32> {
    const BINS: usize = 36;
    let spread = 1.5 * sigma;
    let radius = (3.0 * spread).round() as i32;
    let (x, y) = (extremum.x.round() as i32, extremum.y.round() as i32);
    let mut histogram = [0.0_f32; BINS];
    for v in -radius..=radius {
        for u in -radius..=radius {
            let Some((magnitude, angle)) = gradient(image, x + u, y + v) else {
                continue;
            };
            let weight = (-((u * u + v * v) as f32) / (2.0 * spread * spread)).exp();
            let bin = (angle.rem_euclid(TAU) / TAU * BINS as f32).round() as usize % BINS;
            histogram[bin] += weight * magnitude;
        }
    }
    let smooth: [f32; BINS] = std::array::from_fn(|bin| {
        let near = |by: usize| histogram[(bin + by) % BINS];
        0.25 * near(BINS - 1) + 0.5 * near(0) + 0.25 * near(1)
    });
    let most = smooth.iter().copied().fold(0.0, f32::max);
    let mut angles = Vec::new();
    for bin in 0..BINS {
        let (before, here, behind) = (
            smooth[(bin + BINS - 1) % BINS],
            smooth[bin],
            smooth[(bin + 1) % BINS],
        );
        if here > before && here >= behind && here >= 0.8 * most {
            let by = 0.5 * (before - behind) / (before - 2.0 * here + behind);
            let angle = (bin as f32 + by) / BINS as f32 * TAU;
            angles.push(if angle > 0.5 * TAU {
                angle - TAU
            } else {
                angle
            });
        }
    }
    if angles.is_empty() {
        angles.push(0.0);
    }
    angles
}

/// Histograms of the gradients in 4 × 4 fields around the extremum (section 6), as their roots.
fn descriptor(image: &FloatImage, extremum: &Extremum, sigma: f32, angle: f32) -> SiftDescriptor {
    const FIELDS: i32 = 4;
    const DIRECTIONS: i32 = 8;
    const MOST_SHARE: f32 = 0.2;
    let field = 3.0 * sigma;
    let (sin, cos) = angle.sin_cos();
    let radius = (field * std::f32::consts::SQRT_2 * 2.5).round() as i32;
    let (x, y) = (extremum.x.round() as i32, extremum.y.round() as i32);
    let mut histograms = [0.0_f32; 128];
    for v in -radius..=radius {
        for u in -radius..=radius {
            let (along, down) = ((x + u) as f32 - extremum.x, (y + v) as f32 - extremum.y);
            let column = (cos * along + sin * down) / field;
            let row = (cos * down - sin * along) / field;
            let (c, r) = (column + 1.5, row + 1.5);
            if c <= -1.0 || r <= -1.0 || c >= 4.0 || r >= 4.0 {
                continue;
            }
            let Some((magnitude, direction)) = gradient(image, x + u, y + v) else {
                continue;
            };
            let weight = magnitude * (-(column * column + row * row) / 8.0).exp();
            let turned = (direction - angle).rem_euclid(TAU) / TAU * DIRECTIONS as f32;
            let (c0, r0, d0) = (c.floor(), r.floor(), turned.floor());
            let (dc, dr, dd) = (c - c0, r - r0, turned - d0);
            for (r, of_row) in [(r0 as i32, 1.0 - dr), (r0 as i32 + 1, dr)] {
                for (c, of_column) in [(c0 as i32, 1.0 - dc), (c0 as i32 + 1, dc)] {
                    if !(0..FIELDS).contains(&r) || !(0..FIELDS).contains(&c) {
                        continue;
                    }
                    for (d, of_direction) in [(d0 as i32, 1.0 - dd), (d0 as i32 + 1, dd)] {
                        let place = (r * FIELDS + c) * DIRECTIONS + d % DIRECTIONS;
                        histograms[place as usize] += weight * of_row * of_column * of_direction;
                    }
                }
            }
        }
    }
    let norm = |values: &[f32; 128]| values.iter().map(|v| v * v).sum::<f32>().sqrt();
    let most = MOST_SHARE * norm(&histograms);
    let clipped = histograms.map(|value| value.min(most));
    let sum: f32 = clipped.iter().sum();
    if sum <= 0.0 {
        return [0.0; 128];
    }
    clipped.map(|value| (value / sum).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::features::nearest_neighbours;

    /// A dark and a bright Gaussian blob.
    fn blobs(places: &[(f32, f32, f32, f32)]) -> GrayImage {
        GrayImage::from_fn(120, 90, |x, y| {
            let value = places.iter().fold(128.0, |sum, &(u, v, sigma, height)| {
                let square = (x as f32 - u).powi(2) + (y as f32 - v).powi(2);
                sum + height * (-square / (2.0 * sigma * sigma)).exp()
            });
            Luma([value.round() as u8])
        })
    }

    #[test]
    fn blobs_are_found_where_they_are_at_their_scale() {
        // Off the middle between pixels of any octave, where two of them would be equally extreme.
        let image = blobs(&[(40.3, 30.6, 3.0, 90.0), (80.4, 54.4, 6.0, -90.0)]);
        for enlarge in [false, true] {
            let params = SiftParams {
                enlarge,
                ..SiftParams::default()
            };
            let found = sift(&image, &params).keypoints;
            for (x, y, sigma, is_dark) in [(40.3, 30.6, 3.0, false), (80.4, 54.4, 6.0, true)] {
                let near = found
                    .iter()
                    .find(|k| (k.x - x).hypot(k.y - y) < 0.3 && k.laplacian_positive == is_dark)
                    .unwrap_or_else(|| panic!("{enlarge} {sigma}: {found:?}"));
                assert!(
                    (near.scale / sigma).ln().abs() < 0.35,
                    "{enlarge}: {}",
                    near.scale
                );
            }
        }
    }

    fn texture(x: f32, y: f32) -> f32 {
        let wave = |a: f32, b: f32, c: f32| (a * x + b * y + c).sin();
        128.0
            + 30.0 * wave(0.31, 0.17, 0.0)
            + 30.0 * wave(-0.11, 0.37, 1.0)
            + 25.0 * wave(0.53, -0.29, 2.0)
            + 20.0 * wave(0.07, 0.61, 3.0)
    }

    fn image(of: impl Fn(f32, f32) -> f32) -> GrayImage {
        GrayImage::from_fn(160, 120, |x, y| {
            Luma([of(x as f32, y as f32).round() as u8])
        })
    }

    /// The share of features that match a feature at the place where `moved` puts it.
    fn repeated(params: &SiftParams, moved: impl Fn(f32, f32) -> (f32, f32)) -> f64 {
        let before = sift(&image(texture), params);
        let after = sift(
            &image(|x, y| {
                let (u, v) = moved(x, y);
                texture(u, v)
            }),
            params,
        );
        let matches = nearest_neighbours(&after.descriptors, &before.descriptors);
        let good = after
            .keypoints
            .iter()
            .zip(&matches)
            .filter(|(keypoint, found)| {
                let Some(found) = found else { return false };
                let (u, v) = moved(keypoint.x, keypoint.y);
                let known = before.keypoints[found.nearest];
                (known.x - u).hypot(known.y - v) < 1.5
            });
        good.count() as f64 / after.keypoints.len().max(1) as f64
    }

    #[test]
    fn a_shifted_image_has_the_same_features_and_a_turned_one_without_upright() {
        let params = SiftParams::default();
        let shifted = repeated(&params, |x, y| (x + 6.0, y + 3.0));
        assert!(shifted > 0.7, "{shifted}");
        let turned = |x: f32, y: f32| {
            let (sin, cos) = 0.9_f32.sin_cos();
            let (u, v) = (x - 80.0, y - 60.0);
            (80.0 + cos * u - sin * v, 60.0 + sin * u + cos * v)
        };
        let free = SiftParams {
            upright: false,
            ..params
        };
        let (free, upright) = (repeated(&free, turned), repeated(&params, turned));
        assert!(free > 0.4 && upright < 0.1, "{free} {upright}");
    }

    #[test]
    fn descriptors_are_unit_vectors_and_the_same_on_any_number_of_threads() {
        let image = image(texture);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads")
                .install(|| sift(&image, &SiftParams::default()))
        };
        let features = on(1);
        assert!(features.keypoints.len() > 20);
        assert_eq!(features, on(3));
        for descriptor in &features.descriptors {
            let norm: f32 = descriptor.iter().map(|v| v * v).sum();
            assert!((norm - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn what_shows_nothing_has_no_features() {
        for (width, height) in [(0, 0), (7, 9), (60, 40)] {
            let grey = GrayImage::from_pixel(width, height, Luma([90]));
            assert_eq!(sift(&grey, &SiftParams::default()), SiftFeatures::default());
        }
    }
}
