//! A town street made from a seed: images, laser scans registered with them, and exact poses.
//!
//! No data are needed. The streets, houses, trees and everything on the surfaces are pure
//! functions of a seed and of the point in the world, so that all frames see the same town.
//! Bytes depend on the seed, the [`Condition`], the [`Size`] and the frame only.
//!
//! Inside, the town has coordinates x right, y *up*, z forward with the road at y = 0; the public
//! interface is x right, y down, z forward everywhere (see [`Traversal::world_from_camera`]).

mod beam;
mod box_tree;
mod cache;
mod camera_path;
mod car;
mod cover;
mod dataset;
mod facade;
mod frame;
mod frame_cache;
mod furniture;
mod ground;
mod headlamp;
mod houses;
mod intersect;
mod lamps;
mod lens;
mod lidar;
mod look;
mod material;
mod network;
mod noise;
mod openings;
mod paint;
mod path;
mod pattern;
mod plot;
mod render;
mod shade;
mod shading;
mod shape;
mod town;
mod weather;

use image::RgbImage;
use nalgebra::Point2;

use look::Look;
use noise::{derive, mix};
use posescope_core::camera::Intrinsics;
use posescope_core::geometry::Pose;
use render::View;
use town::Town;

pub use dataset::ENTRY;
pub use dataset::{Street, WORLD_SEED};
pub use lidar::ScanPoint;

/// Weather and time of day of a traversal. It also decides which cars are parked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Condition {
    /// An even grey sky, no shadows.
    Overcast,
    /// A low sun in a blue sky: long shadows, dazzling walls.
    Sun,
    /// Street lamps, lit windows, the car's own head lamps, and a noisy, blurred image.
    Night,
    /// A wet road that mirrors the street, falling rain, drops on the lens.
    Rain,
    /// Snow on the ground, on roofs and cars; bare trees, falling flakes.
    Snow,
}

impl Condition {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Overcast,
        Self::Sun,
        Self::Night,
        Self::Rain,
        Self::Snow,
    ];

    /// Its name, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Overcast => "overcast",
            Self::Sun => "sun",
            Self::Night => "night",
            Self::Rain => "rain",
            Self::Snow => "snow",
        }
    }
}

/// Size of the images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Size {
    /// 620 × 188 pixels.
    Half,
    /// 1241 × 376 pixels.
    Full,
}

impl Size {
    /// The camera that takes images of this size.
    pub fn intrinsics(self) -> Intrinsics {
        let full = Intrinsics {
            fx: 718.856,
            fy: 718.856,
            cx: 607.1928,
            cy: 185.2157,
            width: 1241,
            height: 376,
        };
        // Pixel (0, 0) is the centre of a pixel: the image begins at −0.5.
        let half = |c: f64| (c + 0.5) / 2.0 - 0.5;
        match self {
            Self::Full => full,
            Self::Half => Intrinsics {
                fx: full.fx / 2.0,
                fy: full.fy / 2.0,
                cx: half(full.cx),
                cy: half(full.cy),
                width: full.width / 2,
                height: full.height / 2,
            },
        }
    }
}

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
        Self {
            town,
            look: condition.look(),
            intrinsics: size.intrinsics(),
            poses,
            seed,
        }
    }

    /// Number of frames; they are about 1 m apart, and the last is about 1 m before the first.
    pub fn frame_count(&self) -> usize {
        self.poses.len()
    }

    /// The camera.
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
        self.view(frame).image()
    }

    /// The laser scan of a frame, all around the car.
    pub fn cloud(&self, frame: usize) -> Vec<ScanPoint> {
        let seed = derive(self.seed, 0x11DA).wrapping_add(mix(frame as u32));
        lidar::scan(&self.town, &self.look, &self.poses[frame], seed)
    }

    /// Exact z-depth of the surface seen through a pixel \[m\]; `None` for the sky.
    pub fn depth(&self, frame: usize, pixel: Point2<f64>) -> Option<f64> {
        self.view(frame).depth(&pixel)
    }

    fn view(&self, frame: usize) -> View<'_> {
        View {
            town: &self.town,
            look: &self.look,
            intrinsics: &self.intrinsics,
            world_from_camera: &self.poses[frame],
            frame_seed: derive(self.seed, 0xF4A3).wrapping_add(mix(frame as u32)),
            sky_seed: derive(self.seed, 0x5C1),
            // What is on the lens stays there for a while.
            lens_seed: derive(self.seed, 0x1E45).wrapping_add(mix(frame as u32 / 6)),
        }
    }
}

#[cfg(test)]
mod tests;
