//! Writing a drive in the layout of a data set, for any program that reads it.
//!
//! A new layout is one file, its `mod` line and its entry in [`LAYOUTS`].

mod colmap;
mod kitti;
mod toml;
mod tum;

use std::fs;
use std::path::Path;

use image::{EncodableLayout, ImageBuffer, ImageFormat, Luma, PixelWithColorType, RgbImage};
use nalgebra::{Matrix3, Matrix3x4, Point2, Point3};
use posescope_core::files::write_whole;

use super::SceneError;
use super::folder::{entries, stem};
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// A drive: the data of all frames that are known in advance.
pub struct Drive {
    /// The camera of all photos.
    pub intrinsics: Intrinsics,
    /// The names of the frames, which are their numbers.
    pub names: Vec<String>,
    /// `world_from_camera` of all frames, whether or not they are written.
    pub poses: Vec<Pose>,
    /// The times of all frames \[s\].
    pub times_s: Vec<f64>,
    /// The frames whose photos and clouds are written, by position.
    pub written: Vec<usize>,
    /// The position of the laser scanner in the camera's frame \[m\].
    pub scanner: Point3<f64>,
}

/// A frame with everything that a layout may need.
pub struct Shot<'a> {
    /// The frame's position in the drive.
    pub index: usize,
    /// The photo.
    pub photo: &'a RgbImage,
    /// The scan: positions in the camera's frame \[m\], and reflectances.
    pub scan: &'a [(Point3<f32>, f32)],
    /// The depth of the surface at a pixel \[m\]; `None` for the sky.
    pub depth: &'a (dyn Fn(Point2<f64>) -> Option<f64> + Sync),
}

/// Writes a frame.
pub type WriteFrame = dyn Fn(&Shot<'_>) -> Result<(), SceneError> + Send + Sync;

/// Writes the frames of one drive. Files are written atomically and replace existing ones. The errors are
/// [`SceneError::Io`] when the disk is full or a folder not writable, [`SceneError::Image`] when an image cannot be
/// encoded.
pub struct DriveWriter {
    /// Writes a frame. Called in any order and concurrently.
    pub frame: Box<WriteFrame>,
    /// Writes the files that need all frames.
    pub finish: Box<dyn FnOnce() -> Result<(), SceneError>>,
}

impl DriveWriter {
    /// A writer of frames, none of whose files needs all of them.
    pub fn new(
        frame: impl Fn(&Shot<'_>) -> Result<(), SceneError> + Send + Sync + 'static,
    ) -> Self {
        Self { frame: Box::new(frame), finish: Box::new(|| Ok(())) }
    }
}

/// The entry of a layout in the registry.
pub struct Layout {
    /// The name of the scene format that reads it.
    pub name: &'static str,
    /// The folder of a drive with this name, below the target folder.
    pub place: fn(&str) -> String,
    /// Creates the folders of a drive, and writes the data that are known in advance.
    pub create: fn(&Path, &str, Drive) -> Result<DriveWriter, SceneError>,
}

/// Every layout; the first is the default.
pub const LAYOUTS: &[Layout] = &[kitti::LAYOUT, tum::LAYOUT, colmap::LAYOUT, toml::LAYOUT];

/// The rotation from the axes of scanners and vehicles (x forward, y left, z up) to those of cameras.
const CAMERA_FROM_VELODYNE: Matrix3<f64> =
    Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);

fn make_folder(folder: &Path) -> Result<(), SceneError> {
    fs::create_dir_all(folder).map_err(SceneError::io(folder))
}

/// Creates a folder for frames, and removes the frames (`NNNNNN.EXTENSION`) of an earlier drive.
fn make_frame_folder(folder: &Path, extension: &str) -> Result<(), SceneError> {
    make_folder(folder)?;
    for path in entries(folder)? {
        let stem = stem(&path);
        let is_number = stem.len() == 6 && stem.bytes().all(|byte| byte.is_ascii_digit());
        if is_number && path.extension().is_some_and(|found| found == extension) {
            fs::remove_file(&path).map_err(SceneError::io(&path))?;
        }
    }
    Ok(())
}

fn write(path: &Path, bytes: impl AsRef<[u8]>) -> Result<(), SceneError> {
    write_whole(path, bytes.as_ref()).map_err(SceneError::io(path))
}

/// Writes an image as PNG.
fn write_image<P>(path: &Path, image: &ImageBuffer<P, Vec<P::Subpixel>>) -> Result<(), SceneError>
where
    P: PixelWithColorType,
    [P::Subpixel]: EncodableLayout,
{
    let mut png = std::io::Cursor::new(Vec::new());
    let encoded = image.write_to(&mut png, ImageFormat::Png);
    encoded.map_err(SceneError::image(path))?;
    write(path, png.get_ref())
}

/// Writes the depths of all pixels in units of `unit_m`; 0 for pixels without a depth or beyond the range.
fn write_depth(
    path: &Path,
    camera: &Intrinsics,
    unit_m: f64,
    depth: &(dyn Fn(Point2<f64>) -> Option<f64> + Sync),
) -> Result<(), SceneError> {
    let image: ImageBuffer<Luma<u16>, Vec<u16>> =
        ImageBuffer::from_fn(camera.width, camera.height, |x, y| {
            let depth_m = depth(Point2::new(f64::from(x), f64::from(y)));
            let value = depth_m.map_or(0.0, |depth_m| (depth_m / unit_m).round());
            Luma([if value < f64::from(u16::MAX) { value as u16 } else { 0 }])
        });
    write_image(path, &image)
}

/// Numbers with enough digits to be read back exactly.
fn joined<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> String {
    let words = numbers.into_iter().map(|number| format!("{number:e}"));
    words.collect::<Vec<_>>().join(" ")
}

/// Twelve numbers, row by row.
fn row_by_row(matrix: &Matrix3x4<f64>) -> String {
    joined(&matrix.transpose())
}
