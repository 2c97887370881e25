//! Photos that are files of a scene's folder.

use std::path::{Component, Path, PathBuf};

use super::SceneError;
use crate::camera::Intrinsics;
use crate::image::Photo;

/// The size of an image \[px\], from its header alone.
pub(super) fn dimensions(path: &Path) -> Result<(u32, u32), SceneError> {
    image::image_dimensions(path).map_err(SceneError::image(path))
}

/// Reads a photo, which must be of the camera's size.
pub(super) fn read(path: &Path, camera: &Intrinsics) -> Result<Photo, SceneError> {
    let photo = Photo::read(path).map_err(SceneError::image(path))?;
    expect_size(path, photo.dimensions(), (camera.width, camera.height))?;
    Ok(photo)
}

/// Says which size was expected where an image has another.
pub(super) fn expect_size(
    path: &Path,
    (width, height): (u32, u32),
    (expected_width, expected_height): (u32, u32),
) -> Result<(), SceneError> {
    if (width, height) == (expected_width, expected_height) {
        return Ok(());
    }
    Err(SceneError::expected(
        path,
        format!(
            "{expected_width}x{expected_height} pixels expected, as its camera has, \
             {width}x{height} found"
        ),
    ))
}

/// The path of a file that is named in a scene's own files, and lies in the scene's folder.
pub(super) fn within(folder: &Path, name: &str) -> Result<PathBuf, String> {
    let leaves = |part: Component<'_>| !matches!(part, Component::Normal(_) | Component::CurDir);
    let name = Path::new(name);
    if name.as_os_str().is_empty() || name.components().any(leaves) {
        return Err(format!(
            "a file in the scene's folder expected, `{}` found",
            name.display()
        ));
    }
    Ok(folder.join(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_leads_out_of_the_folder() {
        let folder = Path::new("scene");
        assert_eq!(
            within(folder, "./rgb/1.png"),
            Ok(folder.join("./rgb/1.png"))
        );
        for name in ["../other.png", "rgb/../../other.png", "/etc/passwd", ""] {
            assert!(within(folder, name).is_err(), "{name}");
        }
    }
}
