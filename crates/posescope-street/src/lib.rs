//! A town street made from a seed: images, laser scans registered with them, and exact poses.
//!
//! No data are needed. The streets, houses, trees and everything on the surfaces are pure
//! functions of a seed and of the point in the world, so that all frames see the same town.
//! Bytes depend on the seed, the [`Condition`], the [`Size`] and the frame only.
//!
//! Inside, the town has coordinates x right, y *up*, z forward with the road at y = 0; the public
//! interface is x right, y down, z forward everywhere (see [`Traversal::world_from_camera`]).

mod appearance;
mod beam;
mod box_tree;
mod cache;
mod camera_path;
mod car;
mod condition;
mod contact;
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
mod size;
mod town;
mod traversal;
mod walls;
mod weather;
mod world;

pub use cache::user_cache_folder;
pub use condition::Condition;
pub use dataset::{ENTRY, Street, WORLD_SEED};
pub use lidar::ScanPoint;
pub use size::Size;
pub use traversal::Traversal;
