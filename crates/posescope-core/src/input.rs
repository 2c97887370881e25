//! Errors of input data.

/// Why a photo, a camera, a pose or a radius cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// The grey values are not as many as the image has pixels.
    #[error("{given} grey values given, {width} x {height} px need {}", u64::from(*width) * u64::from(*height))]
    PixelCount {
        /// Image width \[px\].
        width: u32,
        /// Image height \[px\].
        height: u32,
        /// Values given.
        given: usize,
    },
    /// The photo was not taken by that camera, or was resized since.
    #[error(
        "the photo of {frame} has {}x{} px, its camera {}x{}",
        photo.0, photo.1, camera.0, camera.1
    )]
    PhotoSize {
        /// The frame's name.
        frame: String,
        /// Width and height of the photo \[px\].
        photo: (u32, u32),
        /// Width and height that the intrinsics say \[px\].
        camera: (u32, u32),
    },
    /// No camera has such intrinsics.
    #[error(
        "the camera of {frame} needs focal lengths above 0, a finite principal point, and pixels"
    )]
    Camera {
        /// The frame's name.
        frame: String,
    },
    /// The pose has an entry that is NaN or infinite.
    #[error("the pose of {frame} has an entry that is not a finite number")]
    Pose {
        /// The frame's name.
        frame: String,
    },
    /// The query cannot be believed at such a distance from the reference.
    #[error("the prior is {prior_m} m; a finite number above 0 is needed")]
    Prior {
        /// The prior \[m\].
        prior_m: f64,
    },
    /// The query cannot be at such a distance from the reference.
    #[error("the uncertainty radius is {radius_m} m; a finite number above 0 is needed")]
    Radius {
        /// The radius \[m\].
        radius_m: f64,
    },
}
