//! For posescope's own crates: may change in any version.
//!
//! Synthetic views: the reference cloud, coloured by the reference photo and splatted into a camera
//! elsewhere (paper, appendix B, "generation of synthetic views").

mod color;
mod device;
mod points;
mod pool;
mod projection;
mod score;
mod scorer;
mod splat;
mod z_buffer;

pub use color::{ColoredCloud, ColoredPoint, ColoringCounts, VisibleCloud, color_cloud};
pub(crate) use device::leave_out;
pub use device::{Device, Loaded, Tally, Workload, use_device};
pub use points::{PointArrays, Values};
pub use pool::MAX_AT_A_TIME;
pub(crate) use pool::{Pool, ShownPoints, at_a_time};
pub use projection::ProjectionRows;
pub use score::{Objective, Score};
pub use scorer::{Comparison, Scorer};
pub use splat::{Rasterizer, SplattedPixel, SyntheticView};
pub use z_buffer::ZBuffer;

use crate::describe::parameters;

parameters! {
    /// How the cloud is coloured and splatted.
    #[derive(Clone, Debug, PartialEq)]
    pub struct RenderParams {
        /// Side of the square that a point covers in the synthetic view.
        ///
        /// One pixel is the default: over 40 real pairs 10 m apart it served the photometric cost
        /// best (30 of 30 within 2 m, 28 for 3 px) and mutual information equally.
        pub splat_px: usize = 1 => odd("splat_px", "px", 1..=15),
        /// Whether points that the reference camera cannot see are left uncoloured.
        pub visibility: bool = true => flag("visibility"),
        /// A point counts as hidden when a surface nearer by more than this share of its depth lies
        /// before it.
        pub visibility_margin: f64 = 0.10 => number("visibility_margin", "", 0.0..=1.0),
        /// Side of the window in which a nearer surface hides a point.
        pub visibility_window_px: usize = 5 => odd("visibility_window_px", "px", 1..=31),
    }
}

/// The camera that the tests of this room look through.
#[cfg(test)]
fn small_camera() -> crate::camera::Intrinsics {
    crate::camera::Intrinsics { fx: 10.0, fy: 10.0, cx: 4.0, cy: 3.0, width: 9, height: 7 }
}
