//! Depth images as clouds.

use std::path::{Path, PathBuf};

use image::DynamicImage;
use nalgebra::{Point2, Point3};

use super::file_scene::{Clouds, Frame};
use super::lines::TextFile;
use super::{SceneError, photo_file};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;

/// The most points from a depth image, about as many as a scan of 64 beams has in view. All 307,200 pixels of a
/// 640 × 480 image would make a search fifteen times slower without gain: a view is splatted with discs of several
/// pixels.
const MAX_POINTS: u32 = 20_000;

/// The depth images of a scene: 16-bit grey PNG.
pub(super) struct DepthImages {
    /// The image of each frame, if it has one.
    pub images: Vec<Option<PathBuf>>,
    /// The file that lists the images, for errors of frames without one.
    pub listed_in: PathBuf,
    /// The depth camera, and the photos' camera from it. `None` if the depth images are registered with the photos,
    /// pixel by pixel.
    pub beside: Option<(Intrinsics, Pose)>,
    /// The depth of a value of 1 \[m\].
    pub unit_m: f64,
}

impl Clouds for DepthImages {
    fn has(&self, index: usize) -> bool {
        self.images[index].is_some()
    }

    fn place<'a>(&'a self, index: usize, _frame: &'a Frame) -> &'a Path {
        self.images[index].as_deref().unwrap_or(&self.listed_in)
    }

    fn read(&self, index: usize, frame: &Frame) -> Result<Cloud, SceneError> {
        let registered = (frame.intrinsics, Pose::identity());
        let (camera, camera_from_depth) = self.beside.unwrap_or(registered);
        cloud_of(self.place(index, frame), &camera, &camera_from_depth, self.unit_m)
    }
}

/// The points of a depth image \[m\], from its camera, where that is, and the depth of a value of 1 \[m\].
pub(super) fn cloud_of(
    path: &Path,
    camera: &Intrinsics,
    camera_from_depth: &Pose,
    unit_m: f64,
) -> Result<Cloud, SceneError> {
    photo_file::expect_size(path, photo_file::dimensions(path)?, (camera.width, camera.height))?;
    points(path, unit_m, |pixel, depth| Some(camera_from_depth * camera.unproject(&pixel, depth)))
}

/// The points of an image: for a pixel and its depth \[m\], where they are in the camera's frame, if it sees them.
pub(super) fn points(
    path: &Path,
    unit_m: f64,
    place: impl Fn(Point2<f64>, f64) -> Option<Point3<f64>>,
) -> Result<Cloud, SceneError> {
    let image = read_depth(path)?;
    let (width, height) = image.dimensions();
    let step = step((width, height));
    let offset = step / 2;
    let columns = (offset..width).step_by(step as usize);
    let rows = (offset..height).step_by(step as usize);
    let points = rows
        .flat_map(|y| columns.clone().map(move |x| (x, y)))
        .filter_map(|(x, y)| {
            let value = image.get_pixel(x, y).0[0];
            if matches!(value, 0 | u16::MAX) {
                return None;
            }
            let pixel = Point2::new(f64::from(x), f64::from(y));
            Some(place(pixel, f64::from(value) * unit_m)?.cast())
        })
        .collect();
    Ok(Cloud { points })
}

/// The depth of a value of 1 \[m\], where the folder of a data set with a convention of its own has a file
/// `depth_per_metre.txt` with another one.
pub(super) fn unit_m(folder: &Path, usual_m: f64) -> Result<f64, SceneError> {
    let path = folder.join(DEPTH_PER_METRE);
    if !path.is_file() {
        return Ok(usual_m);
    }
    let file = TextFile::read(&path)?;
    match file.rows::<1, 1>()? {
        [[value]] if value.is_finite() && value > 0.0 => Ok(1.0 / value),
        [[value]] => {
            Err(file.error(format!("the value of a metre in depth images expected, {value} found")))
        }
    }
}

/// The file with the value of a metre in the depth images of a folder.
pub(super) const DEPTH_PER_METRE: &str = "depth_per_metre.txt";

/// The step in pixels, along both axes, between points.
pub(super) fn step((width, height): (u32, u32)) -> u32 {
    let pixels = f64::from(width) * f64::from(height);
    (pixels / f64::from(MAX_POINTS)).sqrt().ceil().max(1.0) as u32
}

type DepthImage = image::ImageBuffer<image::Luma<u16>, Vec<u16>>;

fn read_depth(path: &Path) -> Result<DepthImage, SceneError> {
    match photo_file::decode_any(path)? {
        DynamicImage::ImageLuma16(depth) => Ok(depth),
        other => Err(SceneError::expected(
            path,
            format!("a depth image of 16-bit grey values expected, {:?} found", other.color()),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_of_any_size_makes_about_as_many_points() {
        for size in [(640, 480), (1280, 720), (1920, 1080), (8000, 8000)] {
            let step = step(size);
            let points = (size.0 / step) * (size.1 / step);
            assert!((10_000..=MAX_POINTS).contains(&points), "{size:?}: {points}");
        }
        assert_eq!(step((100, 100)), 1);
    }
}
