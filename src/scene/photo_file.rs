//! Photo files.

use std::path::Path;

use super::SceneError;
use crate::image::Photo;

/// The size of an image \[px\], from its header alone.
pub(super) fn dimensions(path: &Path) -> Result<(u32, u32), SceneError> {
    image::image_dimensions(path).map_err(SceneError::image(path))
}

/// Reads a photo, which must have this size \[px\].
pub(super) fn read(path: &Path, size: (u32, u32)) -> Result<Photo, SceneError> {
    let photo = Photo::read(path).map_err(SceneError::image(path))?;
    expect_size(path, photo.dimensions(), size)?;
    Ok(photo)
}

/// An error if an image has another size than its camera.
pub(super) fn expect_size(
    path: &Path,
    found: (u32, u32),
    expected: (u32, u32),
) -> Result<(), SceneError> {
    if found == expected {
        return Ok(());
    }
    Err(SceneError::expected(
        path,
        format!(
            "{}x{} pixels expected by its camera, {}x{} found",
            expected.0, expected.1, found.0, found.1
        ),
    ))
}
