//! Local image features: where they are, what they look like, and which of them look alike.
//!
//! SURF after Bay, Ess, Tuytelaars and Van Gool, *Speeded-Up Robust Features*, CVIU 110(3), 2008.
//! Section and equation numbers in this module are those of that paper. [`surf`] goes through it
//! from front to back:
//!
//! 1. `integral` sums the image so that the sum over any box takes four look-ups (3.1),
//! 2. `detector` finds blobs octave by octave, the maxima (`blob`) of the determinant of a box-filter
//!    Hessian (`hessian`) over position and scale (3.2 to 3.4),
//! 3. `orientation` turns each blob to its dominant gradient (4.1), unless the camera is known to
//!    stay upright,
//! 4. `descriptor` summarises the gradients around it in 64 numbers (4.2).
//!
//! [`sift`] is another: Lowe, *Distinctive Image Features from Scale-Invariant Keypoints*, IJCV 60(2), 2004.
//!
//! `nearest` and `matching` then compare the descriptors of two images: [`nearest_neighbours`] finds
//! the two nearest of every descriptor, and [`best_matches`] says of each whether its best match is distinct,
//! mutual, or neither.
//!
//! All of it runs on all threads of the current [`rayon`] pool and gives the same result
//! on any number of them. [`surf_interruptible`] and [`nearest_neighbours_interruptible`] can be
//! stopped on the way.

mod blob;
mod boxes;
mod descriptor;
mod detector;
mod found;
mod hessian;
mod integral;
mod matching;
mod nearest;
mod octave;
mod orientation;
mod params;
mod responses;
mod sift;
mod state;
mod surf;

use nalgebra::Point2;

pub use found::{FoundMatches, PairMatches};
pub use matching::{Match, MatchVerdict, best_matches};
pub use nearest::{Neighbours, nearest_neighbours, nearest_neighbours_interruptible};
pub use params::SurfParams;
pub use sift::{SiftDescriptor, SiftFeatures, SiftParams, sift, sift_interruptible};
pub use state::FeatureState;
pub(crate) use surf::kept_surf;
pub use surf::{surf, surf_interruptible};

/// A blob: the place in an image that a descriptor describes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// Column \[px\]; the centre of the top-left pixel is (0, 0).
    pub x: f32,
    /// Row \[px\], growing downwards.
    pub y: f32,
    /// Standard deviation σ of the Gaussian whose derivatives the filters stand for \[px\]: 1.2 for
    /// filters of size 9 (section 3.3). A Gaussian blob is found at about 0.78 times its own.
    pub scale: f32,
    /// Direction of the dominant gradient \[rad\], from the x axis towards the y axis, so clockwise
    /// on the screen, in −π to π; 0 where features are upright.
    pub angle: f32,
    /// Determinant of the Hessian, normalised for scale, of an image with values from 0 to 255;
    /// see [`SurfParams::threshold`].
    pub response: f32,
    /// Whether the trace of the Hessian is positive: true for a dark blob on a bright ground, false
    /// for a bright one on dark.
    pub laplacian_positive: bool,
}

impl Keypoint {
    /// The position as a point \[px\].
    pub fn pixel(&self) -> Point2<f64> {
        Point2::new(f64::from(self.x), f64::from(self.y))
    }
}

/// 4 × 4 sub-regions times Σdx, Σ|dx|, Σdy, Σ|dy|, with unit Euclidean norm (section 4.2).
pub type Descriptor = [f32; 64];

/// The features of one image, the strongest first, with descriptors of `N` numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Features<const N: usize = 64> {
    /// Where the features are.
    pub keypoints: Vec<Keypoint>,
    /// What they look like: `descriptors[i]` belongs to `keypoints[i]`. Empty for features whose
    /// descriptors are of another kind.
    pub descriptors: Vec<[f32; N]>,
}

impl<const N: usize> Features<N> {
    /// Memory that they take \[bytes\].
    pub(crate) fn heap_bytes(&self) -> usize {
        size_of_val(self.keypoints.as_slice()) + size_of_val(self.descriptors.as_slice())
    }

    /// The `count` strongest, as [`SurfParams::max_keypoints`] keeps them.
    #[must_use]
    pub fn strongest(&self, count: usize) -> Self {
        let first = |length: usize| ..count.min(length);
        Self {
            keypoints: self.keypoints[first(self.keypoints.len())].to_vec(),
            descriptors: self.descriptors[first(self.descriptors.len())].to_vec(),
        }
    }
}
