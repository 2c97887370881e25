//! Features of an image and of a copy that is turned by 15° and enlarged 1.3 times: how many are
//! found again, and how many matches are right.

use image::{GrayImage, Luma};
use nalgebra::{Point2, Rotation2, Similarity2, Vector2};
use posescope_core::features::{Features, SurfParams, nearest_neighbours, surf};

use crate::data;

/// A keypoint is found again if there is one within this distance of its place in the copy \[px\].
const REPEATED: f32 = 2.0;

/// A match is right if it is within this distance of its place in the copy \[px\].
const CORRECT: f32 = 3.0;

const MAX_RATIO: f32 = 0.8;

/// A pseudo-random number from 0 to 1 (Knuth's MMIX generator).
fn random(state: &mut u64) -> f32 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*state >> 40) as f32 / (1u64 << 24) as f32
}

/// Bars of all sizes, brightnesses and directions on top of each other, with softened edges and
/// noise.
fn synthetic_image() -> GrayImage {
    let (width, height) = (640, 400);
    let mut state = 7;
    let mut values = vec![128.0; width * height];
    for _ in 0..900 {
        let mut random = |low: f32, high: f32| low + (high - low) * random(&mut state);
        let centre = Point2::new(random(0.0, width as f32), random(0.0, height as f32));
        let rotation = Rotation2::new(random(0.0, 3.2));
        let half = Vector2::new(random(0.5, 4.5).exp2(), random(0.5, 4.0).exp2());
        let value = random(10.0, 245.0);
        let reach = half.norm() + 1.0;
        let columns = (centre.x - reach).max(0.0) as usize..width.min((centre.x + reach) as usize);
        for y in (centre.y - reach).max(0.0) as usize..height.min((centre.y + reach) as usize) {
            for x in columns.clone() {
                let offset = rotation * (Point2::new(x as f32, y as f32) - centre);
                let inside = half - offset.abs();
                let cover = (inside.min() + 0.5).clamp(0.0, 1.0);
                let pixel = &mut values[y * width + x];
                *pixel += cover * (value - *pixel);
            }
        }
    }
    let pixels = values
        .into_iter()
        .map(|value| (value + 6.0 * (random(&mut state) - 0.5)).round() as u8)
        .collect();
    GrayImage::from_raw(width as u32, height as u32, pixels).expect("a full image")
}

/// Bicubic interpolation (Keys 1981, a = −1/2), the image mirrored at its border.
fn bicubic(image: &GrayImage, at: Point2<f32>) -> u8 {
    let weights = |t: f32| {
        let near = |t: f32| (1.5 * t - 2.5) * t * t + 1.0;
        let far = |t: f32| ((-0.5 * t + 2.5) * t - 4.0) * t + 2.0;
        [far(1.0 + t), near(t), near(1.0 - t), far(2.0 - t)]
    };
    let mirror = |index: i64, size: u32| {
        let last = i64::from(size) - 1;
        let folded = index.rem_euclid(2 * last);
        folded.min(2 * last - folded) as u32
    };
    let (left, top) = (at.x.floor(), at.y.floor());
    let mut value = 0.0;
    for (j, row_weight) in weights(at.y - top).into_iter().enumerate() {
        let y = mirror(top as i64 + j as i64 - 1, image.height());
        for (i, weight) in weights(at.x - left).into_iter().enumerate() {
            let x = mirror(left as i64 + i as i64 - 1, image.width());
            value += row_weight * weight * f32::from(image.get_pixel(x, y).0[0]);
        }
    }
    value.round() as u8
}

/// The turned and enlarged copy, large enough for all of the image, and the map from pixels of the
/// image to pixels of the copy.
fn warp(image: &GrayImage) -> (GrayImage, Similarity2<f32>) {
    let turn = Similarity2::new(Vector2::zeros(), 15f32.to_radians(), 1.3);
    let (right, bottom) = (image.width() as f32 - 1.0, image.height() as f32 - 1.0);
    let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)]
        .map(|(x, y)| turn * Point2::new(x, y));
    let low = corners[1..].iter().fold(corners[0], |low, c| low.inf(c));
    let high = corners[1..].iter().fold(corners[0], |high, c| high.sup(c));
    let size = (high - low).map(|side| side.ceil() as u32 + 1);
    let map = Similarity2::new(-low.coords, 15f32.to_radians(), 1.3);
    let back = map.inverse();
    let copy = GrayImage::from_fn(size.x, size.y, |x, y| {
        Luma([bicubic(image, back * Point2::new(x as f32, y as f32))])
    });
    (copy, map)
}

#[derive(Debug)]
struct Quality {
    keypoints: usize,
    /// Share of the keypoints of the image that are found again in the copy.
    repeatability: f32,
    /// Share of right ones among the matches that pass the ratio test.
    correct_share: f32,
    /// Right matches per keypoint of the image.
    recall: f32,
}

/// Features that turn with the image; upright ones would not survive the warp.
fn turning() -> SurfParams {
    let mut params = SurfParams::default();
    params.upright = false;
    params
}

fn measure(image: &GrayImage, params: &SurfParams) -> Quality {
    let (copy, map) = warp(image);
    let (features, copied) = (surf(image, params), surf(&copy, params));
    let points = |features: &Features| -> Vec<Point2<f32>> {
        let keypoints = features.keypoints.iter();
        keypoints.map(|k| Point2::new(k.x, k.y)).collect()
    };
    let truth: Vec<_> = points(&features).iter().map(|point| map * point).collect();
    let found = points(&copied);
    let close = |a: &Point2<f32>, b: &Point2<f32>, limit: f32| (a - b).norm() < limit;
    let repeated = truth
        .iter()
        .filter(|truth| found.iter().any(|found| close(truth, found, REPEATED)))
        .count();
    let neighbours = nearest_neighbours(&features.descriptors, &copied.descriptors);
    let matches: Vec<bool> = truth
        .iter()
        .zip(neighbours)
        .filter_map(|(truth, neighbours)| Some((truth, neighbours?)))
        .filter(|(_, neighbours)| neighbours.ratio() < MAX_RATIO)
        .map(|(truth, neighbours)| close(truth, &found[neighbours.nearest], CORRECT))
        .collect();
    let correct = matches.iter().filter(|&&correct| correct).count();
    let share = |part: usize, whole: usize| part as f32 / whole as f32;
    Quality {
        keypoints: truth.len(),
        repeatability: share(repeated, truth.len()),
        correct_share: share(correct, matches.len()),
        recall: share(correct, truth.len()),
    }
}

#[test]
fn synthetic_features_survive_a_turn() {
    let quality = measure(&synthetic_image(), &turning());
    println!("{quality:?}");
    assert!(quality.keypoints > 1_000);
    assert!(quality.repeatability > 0.66);
    assert!(quality.correct_share > 0.9);
    assert!(quality.recall > 0.57);
}

/// Each figure has to reach the best of OpenCV's, dlib's and BoofCV's on the same warp: 0.654
/// (dlib), 0.887 (dlib), 0.531 (BoofCV).
#[test]
fn street_features_survive_a_turn() {
    let Some(path) = data::sample("kitti/sequences/00/image_0/003814.png") else {
        return;
    };
    let image = image::open(path).expect("a readable image").to_luma8();
    let quality = measure(&image, &turning());
    println!("{quality:?}");
    assert!((1_500..=2_500).contains(&quality.keypoints));
    assert!(quality.repeatability >= 0.654);
    assert!(quality.correct_share >= 0.887);
    assert!(quality.recall >= 0.531);
}
