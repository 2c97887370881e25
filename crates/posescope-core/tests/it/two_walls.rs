//! A small world: two textured walls, seen by two cameras one behind the other.

use posescope_core::camera::Intrinsics;
use posescope_core::cloud::Cloud;
use posescope_core::geometry::Pose;
use posescope_core::image::Photo;
use posescope_core::image_crate::{GrayImage, Luma};
use posescope_core::problem::{Problem, Query, ReferenceTuple};

pub const CAMERA: Intrinsics =
    Intrinsics { fx: 180.0, fy: 180.0, cx: 119.5, cy: 49.5, width: 240, height: 100 };

/// Two textured walls at different depths, seen from `forward_m` in front of the reference.
pub fn photo(forward_m: f64, seed: u32) -> GrayImage {
    GrayImage::from_fn(CAMERA.width, CAMERA.height, |x, y| {
        let depth = depth_at(f64::from(x)) - forward_m;
        let right = (f64::from(x) - CAMERA.cx) / CAMERA.fx * depth;
        let down = (f64::from(y) - CAMERA.cy) / CAMERA.fy * depth;
        let cell = |v: f64, size: f64| (v / size + 1000.0).floor() as u32;
        let hash = |a: u32, b: u32| {
            let mixed = a.wrapping_mul(0x9E37_79B9) ^ b.wrapping_mul(0x85EB_CA6B) ^ seed;
            let mixed = (mixed ^ (mixed >> 15)).wrapping_mul(0x2C1B_3C6D);
            f64::from((mixed ^ (mixed >> 12)) >> 24)
        };
        let coarse = hash(cell(right, 0.9), cell(down, 0.7));
        let fine = hash(cell(right, 0.31), cell(down, 0.29));
        Luma([(0.6 * coarse + 0.4 * fine) as u8])
    })
}

fn depth_at(x: f64) -> f64 {
    if x < 110.0 { 12.0 } else { 17.0 }
}

/// A problem with the reference somewhere in the world.
pub fn problem(query: GrayImage, reference: GrayImage, cloud: Cloud) -> Problem {
    let pose = Pose::translation(100.0, -2.0, 30.0);
    let query = Query::new("query", Photo::from_gray(query), CAMERA).expect("fits");
    let reference =
        ReferenceTuple::new("reference", Photo::from_gray(reference), CAMERA, pose, cloud);
    Problem::new(query, reference.expect("fits"), 3.0).expect("a radius").with_seed(7)
}

/// A point in every other pixel of the reference.
pub fn cloud_of_the_walls() -> Cloud {
    let mut points = Vec::new();
    for y in 0..CAMERA.height {
        for x in (0..CAMERA.width).step_by(2) {
            let pixel = nalgebra::Point2::new(f64::from(x), f64::from(y));
            points.push(CAMERA.unproject(&pixel, depth_at(pixel.x)).cast());
        }
    }
    Cloud { points }
}

/// The query is 1 m ahead of the reference.
pub fn solvable() -> Problem {
    problem(photo(1.0, 5), photo(0.0, 5), cloud_of_the_walls())
}
