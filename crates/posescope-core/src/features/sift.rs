//! SIFT: extrema of differences of Gaussians, described by histograms of gradients (Lowe, *Distinctive
//! Image Features from Scale-Invariant Keypoints*, IJCV 60(2), 2004; section numbers are those of that
//! paper), with the descriptors' roots in their place (RootSIFT: Arandjelović, Zisserman, *Three things
//! everyone should know to improve object retrieval*, CVPR 2012).

mod description;
mod octave;
mod plane;

use std::convert::Infallible;

use image::GrayImage;
use rayon::prelude::*;

use super::surf::strongest_first;
use super::{Features, Keypoint};
use crate::describe::parameters;
use description::{Grid, SiftDescriber};
use octave::{BASE_SIGMA, Extremum, SiftOctave};
use plane::{Gaussian, Plane, SMALLEST_SIDE};

parameters! {
    /// What [`sift`] looks for.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SiftParams {
        /// Smallest contrast of a feature: the magnitude of the difference of Gaussians, of grey values
        /// from 0 to 1.
        pub contrast: f64 = 0.012 => number("contrast", "", 0.0..=1.0),
        /// Largest ratio of the principal curvatures of a feature; points on edges have a larger one.
        pub edge_ratio: f64 = 10.0 => number("edge_ratio", "", 1.0..=1000.0),
        /// Scales per octave.
        pub intervals: usize = 3 => count("intervals", "", 1..=8),
        /// Whether to double the size of the image first, which finds the smallest features.
        pub enlarge: bool = true => flag("enlarge"),
        /// Whether features are upright, for cameras that do not roll.
        pub upright: bool = true => flag("upright"),
        /// Largest number of features to keep, the strongest; 0 keeps all.
        pub max_keypoints: usize = 4000 => count("max_keypoints", "", 0..=1_000_000),
    }
}

/// 4 × 4 histograms of eight directions, as the roots of their shares: a unit vector, whose product with
/// another is the Hellinger kernel of the two.
pub type SiftDescriptor = [f32; 128];

/// The SIFT features of one image; their response is the magnitude of the difference of Gaussians.
pub type SiftFeatures = Features<128>;

/// Smoothing that photos have by themselves \[px\].
const CAMERA_SIGMA: f64 = 0.5;
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
    let (mut base, mut pixel) = enlarged(image, params);
    let has_room = |base: &Plane| base.width.min(base.height) >= SMALLEST_SIDE;
    if has_room(&base) {
        let has = CAMERA_SIGMA / f64::from(pixel);
        base = Gaussian::new((BASE_SIGMA * BASE_SIGMA - has * has).sqrt()).smoothed(&base);
    }
    let mut octaves = Vec::new();
    let mut found: Vec<(usize, Extremum)> = Vec::new();
    while has_room(&base) {
        let mut octave = SiftOctave::of(base, pixel, params, &mut checkpoint)?;
        checkpoint()?;
        let number = octaves.len();
        found.extend(octave.extrema(params).into_iter().map(|extremum| (number, extremum)));
        base = octave.smoothed[params.intervals].halved();
        pixel *= 2.0;
        octave.keep_described(params);
        octaves.push(octave);
    }
    if params.max_keypoints > 0 {
        found.sort_by(|(_, a), (_, b)| b.response.total_cmp(&a.response));
        found.truncate(params.max_keypoints);
    }
    // In the order of the images' rows, whose pixels then are still in the cache.
    found.sort_by(|(a, one), (b, other)| a.cmp(b).then(one.y.total_cmp(&other.y)));
    let describer = SiftDescriber::new();
    let mut described: Vec<(Keypoint, SiftDescriptor)> = Vec::new();
    for some in found.chunks(KEYPOINTS_AT_A_TIME) {
        checkpoint()?;
        let of_some = some.par_iter().fold(Default::default, |(mut grid, mut into), of| {
            let (number, extremum) = of;
            let level = (extremum.level.round() as usize).clamp(1, params.intervals);
            let SiftOctave { smoothed, pixel } = &octaves[*number];
            describer.describe(&smoothed[level], *pixel, extremum, params, &mut grid, &mut into);
            (grid, into)
        });
        described.par_extend(of_some.flat_map_iter(|(_, of_some): (Grid, Vec<_>)| of_some));
    }
    let mut order: Vec<usize> = (0..described.len()).collect();
    order.sort_by(|&a, &b| strongest_first(&described[a].0, &described[b].0));
    Ok(Features {
        keypoints: order.iter().map(|&place| described[place].0).collect(),
        descriptors: order.iter().map(|&place| described[place].1).collect(),
    })
}

/// The image of the first octave before any smoothing, 0 … 1, and the size of its pixels in those of the photo.
fn enlarged(image: &GrayImage, params: &SiftParams) -> (Plane, f32) {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let values = image.as_raw().iter().map(|&value| f32::from(value) / 255.0).collect();
    let same = Plane { width, height, values };
    if !params.enlarge || width == 0 || height == 0 {
        return (same, 1.0);
    }
    let mut twice = Plane::new(2 * width, 2 * height);
    twice.values.par_chunks_mut(2 * width).enumerate().for_each(|(y, into)| {
        let (above, below) = (same.row(y / 2), same.row((y / 2 + y % 2).min(height - 1)));
        let down = |x: usize| above[x] + below[x];
        for (x, into) in into.as_chunks_mut::<2>().0.iter_mut().enumerate() {
            let (left, right) = (down(x), down((x + 1).min(width - 1)));
            *into = [0.5 * left, 0.25 * (left + right)];
        }
    });
    (twice, 0.5)
}

#[cfg(test)]
mod tests {
    use image::Luma;

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
            let params = SiftParams { enlarge, ..SiftParams::default() };
            let found = sift(&image, &params).keypoints;
            for (x, y, sigma, is_dark) in [(40.3, 30.6, 3.0, false), (80.4, 54.4, 6.0, true)] {
                let near = found
                    .iter()
                    .find(|k| (k.x - x).hypot(k.y - y) < 0.3 && k.laplacian_positive == is_dark)
                    .unwrap_or_else(|| panic!("{enlarge} {sigma}: {found:?}"));
                assert!((near.scale / sigma).ln().abs() < 0.35, "{enlarge}: {}", near.scale);
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
        GrayImage::from_fn(160, 120, |x, y| Luma([of(x as f32, y as f32).round() as u8]))
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
        let good = after.keypoints.iter().zip(&matches).filter(|(keypoint, found)| {
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
        let free = SiftParams { upright: false, ..params };
        let (free, upright) = (repeated(&free, turned), repeated(&params, turned));
        assert!(free > 0.4 && upright < 0.1, "{free} {upright}");
    }

    #[test]
    fn descriptors_are_unit_vectors_and_the_same_on_any_number_of_threads() {
        let image = image(texture);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("threads").install(|| sift(&image, &SiftParams::default()))
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
