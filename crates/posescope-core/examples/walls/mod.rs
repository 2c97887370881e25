//! A small world for the examples: two textured walls, and photos and scans of them as arrays.

use posescope_core::Intrinsics;
use posescope_core::nalgebra::Point2;

/// The camera of both photos.
pub const CAMERA: Intrinsics =
    Intrinsics { fx: 180.0, fy: 180.0, cx: 119.5, cy: 49.5, width: 240, height: 100 };

/// How far away the wall in a column of the reference photo is [m].
fn wall_m(x: f64) -> f64 {
    if x < 110.0 { 12.0 } else { 17.0 }
}

/// The grey values of a photo, row by row, from a place `ahead_m` metres ahead of the reference.
pub fn photo(ahead_m: f64) -> Vec<u8> {
    let pixels = (0..CAMERA.height).flat_map(|y| (0..CAMERA.width).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let pixel = Point2::new(f64::from(x), f64::from(y));
            let point = CAMERA.unproject(&pixel, wall_m(pixel.x) - ahead_m);
            let coarse = tile(point.x / 0.9, point.y / 0.7);
            let fine = tile(point.x / 0.31, point.y / 0.29);
            (0.6 * coarse + 0.4 * fine) as u8
        })
        .collect()
}

/// A scan of the walls: x right, y down, z forward of the reference camera [m].
pub fn scan() -> impl Iterator<Item = [f32; 3]> {
    let columns = |y| (0..CAMERA.width).step_by(2).map(move |x| (x, y));
    (0..CAMERA.height).flat_map(columns).map(|(x, y)| {
        let pixel = Point2::new(f64::from(x), f64::from(y));
        let point = CAMERA.unproject(&pixel, wall_m(pixel.x));
        [point.x as f32, point.y as f32, point.z as f32]
    })
}

/// The brightness of the tile at a place of the wall, 0 … 255.
fn tile(right: f64, down: f64) -> f64 {
    let number = |place: f64| (place + 1000.0).floor() as u32;
    let mixed = number(right).wrapping_mul(0x9E37_79B9) ^ number(down).wrapping_mul(0x85EB_CA6B);
    let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x2C1B_3C6D);
    f64::from((mixed ^ (mixed >> 12)) >> 24)
}
