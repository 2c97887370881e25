//! A scene's calibration file, with another place of its scanner.

use std::path::PathBuf;

/// A calibration file as it should be.
pub struct Recalibrated {
    /// The scene's own file, which is not changed.
    pub path: PathBuf,
    /// The whole text of the better one.
    pub text: String,
}
