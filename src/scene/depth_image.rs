//! Depth images as clouds.

use std::path::{Path, PathBuf};

use image::DynamicImage;
use nalgebra::Point2;

use super::file_scene::{Clouds, Frame};
use super::{SceneError, photo_file};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;

/// At most as many pixels of a depth image become points: about as many as a scan of 64 beams has in
/// view of a camera. All 307,200 of a 640 × 480 image would make a search fifteen times as slow and
/// add nothing, as a view is splatted with discs of several pixels.
const MOST_POINTS: u32 = 20_000;

/// The depth images of a scene: 16-bit grey PNG.
pub(super) struct DepthImages {
    /// The image of each frame, if it has one.
    pub images: Vec<Option<PathBuf>>,
    /// What names the images, for frames without one.
    pub listed_in: PathBuf,
    /// The camera that took them, and that of the photos from it. Without one they are registered with the
    /// photos: pixel by pixel, seen by the same camera.
    pub beside: Option<(Intrinsics, Pose)>,
    /// What a value of 1 means \[m\].
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

/// Every how many pixels along both axes a point is made.
pub(super) fn step((width, height): (u32, u32)) -> u32 {
    let pixels = f64::from(width) * f64::from(height);
    (pixels / f64::from(MOST_POINTS)).sqrt().ceil().max(1.0) as u32
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
            format!(
                "a depth image of 16-bit grey values expected, {:?} found",
                other.color()
            ),
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
            assert!(
                (10_000..=MOST_POINTS).contains(&points),
                "{size:?}: {points}"
            );
        }
        assert_eq!(step((100, 100)), 1);
    }
}
