//! Photos of no scene: files that somebody wants localised in one, each with a camera, and nothing that
//! says where they were taken.

mod camera;
mod exif;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::DynamicImage;
use image::metadata::Orientation;
use serde::{Deserialize, Serialize};

pub use camera::CameraArgument;

use self::exif::Exif;
use super::lens::Lens;
use super::{Scene, SceneError, photo_file};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;
use crate::image::Photo;

/// What a command line says of loose photos.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LoosePhotos {
    /// The files.
    pub paths: Vec<PathBuf>,
    /// Their camera; without it, that which EXIF tells of each.
    pub camera: Option<CameraArgument>,
}

impl LoosePhotos {
    /// What the photos' scene is called.
    pub const NAME: &str = "photo";

    /// What a photo is called in results, as photos of a scene are: by its file, without folder and
    /// ending.
    pub fn name(path: &Path) -> String {
        path.file_stem()
            .unwrap_or(path.as_os_str())
            .to_string_lossy()
            .into_owned()
    }

    /// The file of the photo that is called so.
    pub fn path_of(&self, name: &str) -> Option<&Path> {
        let mut paths = self.paths.iter();
        paths
            .find(|path| Self::name(path) == name)
            .map(PathBuf::as_path)
    }

    /// Opens the photos as a scene without poses and clouds.
    ///
    /// # Errors
    /// A file that is no photo, a camera that is not that of its size, or none that anything tells of;
    /// and two files of the same name.
    pub fn open(&self) -> Result<Arc<dyn Scene>, SceneError> {
        let names: Vec<String> = self.paths.iter().map(|path| Self::name(path)).collect();
        let twice = (1..names.len()).find(|&at| names[..at].contains(&names[at]));
        if let Some(twice) = twice {
            return Err(SceneError::expected(
                &self.paths[twice],
                format!(
                    "a name of its own expected, another photo is called {} too",
                    names[twice]
                ),
            ));
        }
        let photos = self.paths.iter().map(|path| self.loose_photo(path));
        Ok(Arc::new(LooseScene {
            photos: photos.collect::<Result<_, _>>()?,
            names,
        }))
    }

    fn loose_photo(&self, path: &Path) -> Result<LoosePhoto, SceneError> {
        let stored = photo_file::dimensions(path)?;
        let exif = Exif::read(path);
        let photo = |taken: Intrinsics, lens: Option<Lens>, turned: Orientation| LoosePhoto {
            path: path.to_owned(),
            stored,
            intrinsics: lens.as_ref().map_or(taken, Lens::pinhole),
            lens,
            turned,
        };
        let Some(camera) = &self.camera else {
            let turned = exif.orientation();
            let (width, height) = match is_on_its_side(turned) {
                true => (stored.1, stored.0),
                false => stored,
            };
            let (focal_px, how) = exif.focal_px(stored).ok_or_else(|| {
                SceneError::expected(
                    path,
                    "a focal length in EXIF expected, none found; --camera fx,fy,cx,cy, a camera \
                           line of COLMAP or its cameras.txt says what the camera is",
                )
            })?;
            log::warn!(
                "{}: a focal length of {focal_px:.0} px by EXIF ({how}), no distortion; --camera says more",
                path.display()
            );
            let taken = Intrinsics {
                fx: focal_px,
                fy: focal_px,
                cx: (f64::from(width) - 1.0) / 2.0,
                cy: (f64::from(height) - 1.0) / 2.0,
                width,
                height,
            };
            return Ok(photo(taken, None, turned));
        };
        // A camera is calibrated on pixels as they are stored.
        if exif.orientation() != Orientation::NoTransforms {
            log::warn!(
                "{}: EXIF says to turn this photo; it is taken as it is stored, as --camera is",
                path.display()
            );
        }
        let (taken, distortion) = camera.of_photo(path, stored)?;
        let lens = match distortion == Default::default() {
            true => None,
            false => Some(
                Lens::new(taken, distortion)
                    .map_err(|expected| SceneError::expected(path, expected))?,
            ),
        };
        Ok(photo(taken, lens, Orientation::NoTransforms))
    }
}

fn is_on_its_side(turned: Orientation) -> bool {
    matches!(
        turned,
        Orientation::Rotate90
            | Orientation::Rotate270
            | Orientation::Rotate90FlipH
            | Orientation::Rotate270FlipH
    )
}

struct LooseScene {
    names: Vec<String>,
    photos: Vec<LoosePhoto>,
}

struct LoosePhoto {
    path: PathBuf,
    /// The size of the file's image \[px\].
    stored: (u32, u32),
    /// The camera, as the photo is handed out.
    intrinsics: Intrinsics,
    lens: Option<Lens>,
    /// How the file's image is to be turned.
    turned: Orientation,
}

impl Scene for LooseScene {
    fn name(&self) -> &str {
        LoosePhotos::NAME
    }

    fn frames(&self) -> &[String] {
        &self.names
    }

    fn intrinsics(&self, frame: usize) -> Intrinsics {
        self.photos[frame].intrinsics
    }

    fn pose(&self, _frame: usize) -> Option<Pose> {
        None
    }

    fn time_s(&self, _frame: usize) -> Option<f64> {
        None
    }

    fn has_cloud(&self, _frame: usize) -> bool {
        false
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        let LoosePhoto {
            path,
            stored,
            lens,
            turned,
            ..
        } = &self.photos[frame];
        let photo = Photo::read(path).map_err(SceneError::image(path))?;
        photo_file::expect_size(path, photo.dimensions(), *stored)?;
        let photo = match turned {
            Orientation::NoTransforms => photo,
            _ => self::turned(photo, *turned),
        };
        Ok(match lens {
            Some(lens) => lens.undistorted(&photo),
            None => photo,
        })
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        Err(SceneError::NoCloud {
            path: self.photos[frame].path.clone(),
            frame: self.names[frame].clone(),
            hint: "a loose photo is a query only".to_owned(),
        })
    }
}

fn turned(photo: Photo, turned: Orientation) -> Photo {
    match photo.color {
        Some(color) => {
            let mut image = DynamicImage::ImageRgb8(color);
            image.apply_orientation(turned);
            Photo::from_color(image.into_rgb8())
        }
        None => {
            let mut image = DynamicImage::ImageLuma8(photo.gray);
            image.apply_orientation(turned);
            Photo::from_gray(image.into_luma8())
        }
    }
}
