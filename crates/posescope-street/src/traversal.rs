//! A drive: frames of one town in one condition.

use image::RgbImage;
use nalgebra::Point2;

use super::camera_path;
use super::condition::Condition;
use super::lidar::{self, ScanPoint};
use super::look::Look;
use super::noise::{derive, mix};
use super::render::View;
use super::size::Size;
use super::town::Town;
use posescope_core::camera::Intrinsics;
use posescope_core::geometry::Pose;

/// One drive around the circuit of a town.
#[derive(Debug)]
pub struct Traversal {
    town: Town,
    look: Look,
    intrinsics: Intrinsics,
    poses: Vec<Pose>,
    seed: u32,
}

impl Traversal {
    /// A drive through the town of `world_seed`. Two traversals of one town share its streets and
    /// houses; parked cars, leaves and the line driven differ with the condition.
    pub fn new(world_seed: u64, condition: Condition, size: Size) -> Self {
        let world = mix(world_seed as u32) ^ mix((world_seed >> 32) as u32).rotate_left(7);
        let seed = derive(world, condition as u32);
        let town = Town::new(world_seed, seed, condition.season());
        let poses = camera_path::poses(&town.network, seed);
        Self { town, look: condition.look(), intrinsics: size.intrinsics(), poses, seed }
    }

    /// Number of frames; they are about 1 m apart, and the last is about 1 m before the first.
    pub fn frame_count(&self) -> usize {
        self.poses.len()
    }

    /// The camera that takes all images of the drive.
    pub fn intrinsics(&self) -> Intrinsics {
        self.intrinsics
    }

    /// The exact pose of the camera. World: x right, y down, z forward \[m\], with the first
    /// camera near the origin.
    ///
    /// # Panics
    /// When `frame` is not below [`Self::frame_count`], as in all methods that take a frame.
    pub fn world_from_camera(&self, frame: usize) -> Pose {
        self.poses[frame]
    }

    /// The image of a frame.
    pub fn image(&self, frame: usize) -> RgbImage {
        self.view(frame, &self.poses[frame]).image()
    }

    /// The image that the camera would have taken at this time from another pose.
    pub fn image_from(&self, frame: usize, world_from_camera: &Pose) -> RgbImage {
        self.view(frame, world_from_camera).image()
    }

    /// The laser scan of a frame, all around the car.
    pub fn cloud(&self, frame: usize) -> Vec<ScanPoint> {
        let seed = derive(self.seed, 0x11DA).wrapping_add(mix(frame as u32));
        lidar::scan(&self.town, &self.look, &self.poses[frame], seed)
    }

    /// Exact z-depth of the surface seen through a pixel \[m\]; `None` for the sky.
    pub fn depth(&self, frame: usize, pixel: Point2<f64>) -> Option<f64> {
        self.view(frame, &self.poses[frame]).depth(&pixel)
    }

    fn view<'a>(&'a self, frame: usize, world_from_camera: &'a Pose) -> View<'a> {
        View {
            town: &self.town,
            look: &self.look,
            intrinsics: &self.intrinsics,
            world_from_camera,
            frame_seed: derive(self.seed, 0xF4A3).wrapping_add(mix(frame as u32)),
            sky_seed: derive(self.seed, 0x5C1),
            // What is on the lens stays there for a while.
            lens_seed: derive(self.seed, 0x1E45).wrapping_add(mix(frame as u32 / 6)),
        }
    }
}

#[cfg(test)]
mod tests;
