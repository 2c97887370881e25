//! Pose from correspondences: the minimal solver and the non-linear refinement.
//!
//! | file | problem | method |
//! |---|---|---|
//! | [`p3p()`] | three bearings, three points, up to four poses | two conics met by a line pair (Ding et al. 2023) |
//! | [`refine()`] | pixels and points, one pose near the answer | Levenberg–Marquardt on a robust reprojection error |
//! | `zoom` | pixels and points, one pose and one focal length | the same with a seventh freedom |
//! | [`Loss`] | how much may a large residual say? | Huber, Cauchy |

mod conic;
mod loss;
mod p3p;
mod refine;
mod reprojection;
mod zoom;

pub use loss::{Loss, LossShape};
pub use p3p::{MAX_SOLUTIONS, p3p};
#[doc(hidden)]
pub use refine::pose_covariance;
pub use refine::{Refinement, Termination, refine};
pub(crate) use zoom::{Zoomed, refine_zoomed};

use nalgebra::{Point2, Point3};

/// A pixel and the 3-D point that is believed to be seen there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correspondence {
    /// Where the point is seen \[px\].
    pub pixel: Point2<f64>,
    /// The point \[m\], in the frame that the pose maps to the camera.
    pub point: Point3<f64>,
}

/// A camera for tests, with focal lengths that differ.
#[cfg(test)]
const KITTI: crate::camera::Intrinsics = crate::camera::Intrinsics {
    fx: 718.856,
    fy: 700.0,
    cx: 607.1928,
    cy: 185.2157,
    width: 1241,
    height: 376,
};
