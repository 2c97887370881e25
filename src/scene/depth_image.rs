//! Depth images as clouds.

use std::path::{Path, PathBuf};

use image::DynamicImage;
use nalgebra::Point2;

use super::file_scene::{Clouds, Frame};
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
        let path = self.place(index, frame);
        let depth = read_depth(path)?;
        let registered = (frame.intrinsics, Pose::identity());
        let (intrinsics, camera_from_depth) = self.beside.unwrap_or(registered);
        let size = (intrinsics.width, intrinsics.height);
        photo_file::expect_size(path, depth.dimensions(), size)?;
        let step = step(size);
        let offset = step / 2;
        let columns = (offset..intrinsics.width).step_by(step as usize);
        let rows = (offset..intrinsics.height).step_by(step as usize);
        let points = rows
            .flat_map(|y| columns.clone().map(move |x| (x, y)))
            .filter_map(|(x, y)| {
                let value = depth.get_pixel(x, y).0[0];
                if matches!(value, 0 | u16::MAX) {
                    return None;
                }
                let pixel = Point2::new(f64::from(x), f64::from(y));
                let point = intrinsics.unproject(&pixel, f64::from(value) * self.unit_m);
                Some((camera_from_depth * point).cast())
            })
            .collect();
        Ok(Cloud { points })
    }
}

/// The step in pixels, along both axes, between points.
pub(super) fn step((width, height): (u32, u32)) -> u32 {
    let pixels = f64::from(width) * f64::from(height);
    (pixels / f64::from(MAX_POINTS)).sqrt().ceil().max(1.0) as u32
}

type DepthImage = image::ImageBuffer<image::Luma<u16>, Vec<u16>>;

fn read_depth(path: &Path) -> Result<DepthImage, SceneError> {
    let image = image::ImageReader::open(path)
        .and_then(image::ImageReader::with_guessed_format)
        .map_err(SceneError::io(path))?
        .decode()
        .map_err(SceneError::image(path))?;
    match image {
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
