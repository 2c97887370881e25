//! Layouts that readers are tested with, beside those that `posescope synth` writes.

mod kitti_raw;
mod robotcar;

use std::fs;
use std::path::Path;

use nalgebra::Matrix3;
use posescope::scene::layout::{LAYOUTS, Layout};

pub use robotcar::LAYOUT as ROBOTCAR;

/// Every layout in which the street can be written.
pub fn all() -> impl Iterator<Item = &'static Layout> {
    let more: &'static [Layout] = &[kitti_raw::LAYOUT, robotcar::LAYOUT];
    LAYOUTS.iter().chain(more)
}

/// The rotation from the axes of scanners and cars (x forward, y left, z up) to those of cameras.
const CAMERA_FROM_VELODYNE: Matrix3<f64> =
    Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);

fn make_folder(folder: &Path) {
    fs::create_dir_all(folder).expect("writable");
}

fn write(path: &Path, bytes: impl AsRef<[u8]>) {
    fs::write(path, bytes).expect("writable");
}

/// Numbers with as many digits as they need to be read as they were.
fn joined<'a>(numbers: impl IntoIterator<Item = &'a f64>, by: &str) -> String {
    let words = numbers.into_iter().map(|number| format!("{number:e}"));
    words.collect::<Vec<_>>().join(by)
}
