//! The parameters of SURF.

use crate::describe::parameters;

parameters! {
    /// What [`super::surf()`] looks for.
    ///
    /// Four octaves of four filter sizes as in the paper, but sampled at every pixel at first, not
    /// at every second one, which loses a third of the features, and of the remaining ones finds
    /// fewer again in a turned and enlarged image: 0.64 in place of 0.68. The threshold gives
    /// about 2,000 features for a street scene of 1241 × 376 px. Upright, because cars do not roll:
    /// that gives more matches and smaller errors there.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SurfParams {
        /// Smallest response of a feature, the determinant of the Hessian.
        ///
        /// The response is the determinant of (2.5 σ)² times the Hessian of an image with values from
        /// 0 to 255, as for OpenCV's `hessianThreshold`. A Gaussian blob whose peak differs by a from
        /// the ground reaches about 0.8 a².
        pub threshold: f64 = 500.0 => number("threshold", "", 0.0..=1e6),
        /// Number of octaves; each doubles the scale.
        ///
        /// The first finds blobs with σ from 1.6 px to 3.2 px; each further one doubles the scale
        /// (section 3.3).
        pub octaves: usize = 4 => count("octaves", "", 1..=8),
        /// Number of filter sizes in each octave.
        ///
        /// Octaves join without a gap from 4 on; more make them overlap, and the features that are
        /// found twice fail the ratio test.
        pub intervals: usize = 4 => count("intervals", "", 3..=12),
        /// Whether features are upright (U-SURF): for cameras that do not roll, this is faster and more
        /// distinctive.
        pub upright: bool = true => flag("upright"),
        /// Sampling distance in the first octave; it doubles with each octave.
        pub initial_step: usize = 1 => count("initial_step", "px", 1..=8),
        /// Largest number of features to keep, the strongest; 0 keeps all.
        pub max_keypoints: usize = 0 => count("max_keypoints", "", 0..=1_000_000),
    }
}
