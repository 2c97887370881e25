//! A scene whose photos are files. The reader of a format provides frames and clouds.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Once, OnceLock};

use image::metadata::Orientation;
use image::{DynamicImage, GenericImageView as _};

use super::folder::{Bounds, stem};
use super::photo_file::GrayRange;
use super::{CloudFacts, Lengths, PixelMap, Scene, SceneError, photo_file};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;
use crate::image::Photo;

/// The hint of a scene whose format may have clouds, but here has none.
pub(super) const NO_CLOUD: &str = "no frame of this scene has one";

/// A frame of a scene.
#[derive(Clone)]
pub(super) struct Frame {
    /// Its name in results and recordings.
    pub name: String,
    /// Another name by which other programs call it: the path of its photo without extension.
    pub other_name: Option<String>,
    pub photo: PathBuf,
    /// The camera of the developed photo.
    pub intrinsics: Intrinsics,
    /// How the image in the file is turned; by default as its EXIF data say, if the camera has the size of the
    /// turned image only.
    pub turned: Option<Orientation>,
    /// Converts the turned image to the photo, if they differ.
    pub develop: Option<Arc<dyn Develop>>,
    pub world_from_camera: Option<Pose>,
    /// The time of the photo \[s\], if known.
    pub time_s: Option<f64>,
}

impl Frame {
    /// A frame with the name of its photo, without pose and time.
    pub fn new(photo: PathBuf, intrinsics: Intrinsics) -> Self {
        Self {
            name: stem(&photo),
            other_name: None,
            photo,
            intrinsics,
            turned: None,
            develop: None,
            world_from_camera: None,
            time_s: None,
        }
    }
}

/// Converts images in files to photos: removes distortion, for example.
pub(super) trait Develop: Send + Sync {
    fn developed(&self, image: Photo) -> Photo;

    /// Where pixels of the photo are in the image, if the photo is undistorted.
    fn pixel_map(&self) -> Option<Arc<dyn PixelMap>> {
        None
    }

    /// The size of the image in the file \[px\], from that of the photo.
    fn size_in_file(&self, photo: (u32, u32)) -> (u32, u32) {
        photo
    }
}

/// The clouds of a scene.
pub(super) trait Clouds: Send + Sync {
    /// Whether a frame has a cloud.
    fn has(&self, index: usize) -> bool;

    /// The path in the error of a frame without a cloud.
    fn place<'a>(&'a self, _index: usize, frame: &'a Frame) -> &'a Path {
        &frame.photo
    }

    /// What a frame without a cloud lacks, if that is more than the file at its path.
    fn missing(&self) -> Option<&str> {
        None
    }

    /// What the lengths of the scene are.
    fn lengths(&self) -> Lengths {
        Lengths::Metres
    }

    /// What is known of the files, once a cloud was read.
    fn facts(&self) -> CloudFacts {
        CloudFacts::default()
    }

    /// Whether the cloud of a frame is in the world's frame, so that the pose decides what of it the camera sees.
    fn is_in_world(&self, _index: usize) -> bool {
        false
    }

    /// Reads the cloud of a frame that has one, in the camera's frame \[m\].
    fn read(&self, index: usize, frame: &Frame) -> Result<Cloud, SceneError>;
}

/// Warns of a photo that its EXIF data turn into one of the same size.
fn warn_of_either(path: &Path, size: (u32, u32)) {
    let turned = photo_file::orientation(path);
    if turned != Orientation::NoTransforms && photo_file::turned_size(size, turned) == size {
        log::warn!(
            "{}: the EXIF orientation is ignored, here and in other photos of the scene: the camera fits the \
             stored image and the turned one; if it is that of the turned one, turn the files, for example by \
             `exiftran -ai`",
            path.display()
        );
    }
}

pub(super) struct FileScene<C> {
    name: String,
    names: Vec<String>,
    frames: Vec<Frame>,
    clouds: C,
    /// What grey values of 16 bits become 0 and 255, once a photo has such.
    gray_range: OnceLock<GrayRange>,
    /// Whether an EXIF orientation was looked for that the size of the camera does not decide.
    is_warned: Once,
    /// Where photos and clouds may lie.
    bounds: Bounds,
}

impl<C: Clouds> FileScene<C> {
    /// A scene of frames, with their clouds by position.
    pub fn new(name: String, frames: Vec<Frame>, clouds: C) -> Self {
        Self {
            name,
            names: frames.iter().map(|frame| frame.name.clone()).collect(),
            frames,
            clouds,
            gray_range: OnceLock::new(),
            is_warned: Once::new(),
            bounds: Bounds::Layout,
        }
    }

    /// The scene with other bounds than those of a data set's layout.
    pub fn within(self, bounds: Bounds) -> Self {
        Self { bounds, ..self }
    }

    /// The image in a file, turned to the size that its camera has.
    fn image(&self, frame: &Frame, size: (u32, u32)) -> Result<DynamicImage, SceneError> {
        let path = &frame.photo;
        self.bounds.check(path)?;
        let mut image = photo_file::decode(path)?;
        let stored = image.dimensions();
        let turned = match frame.turned {
            Some(turned) => turned,
            None if stored == size => {
                self.is_warned.call_once(|| warn_of_either(path, size));
                Orientation::NoTransforms
            }
            None => photo_file::orientation(path),
        };
        if photo_file::turned_size(stored, turned) == size {
            image.apply_orientation(turned);
        }
        photo_file::expect_size(path, image.dimensions(), size)?;
        Ok(image)
    }

    /// One range for all photos: the estimators compare their grey values.
    fn gray_range(&self) -> GrayRange {
        *self.gray_range.get_or_init(|| {
            let range = GrayRange::of(self.frames.iter().map(|frame| frame.photo.as_path()));
            if !range.is_full() {
                log::warn!(
                    "{}: photos of 16 bits that use the values {} to {}, which become 0 to 255 in all of them",
                    self.name,
                    range.low,
                    range.high
                );
            }
            range
        })
    }

    fn frames_with_cloud(&self) -> String {
        let all = self.names.iter().enumerate();
        let with: Vec<&str> = all
            .filter(|(frame, _)| self.has_cloud(*frame))
            .map(|(_, name)| name.as_str())
            .collect();
        match with.as_slice() {
            [] => NO_CLOUD.to_owned(),
            [only] => format!("frame {only} has one"),
            [first, .., last] => format!("{} frames have one: {first} … {last}", with.len()),
        }
    }
}

impl<C: Clouds> Scene for FileScene<C> {
    fn name(&self) -> &str {
        &self.name
    }

    fn frames(&self) -> &[String] {
        &self.names
    }

    fn pixel_map(&self, frame: usize) -> Option<Arc<dyn PixelMap>> {
        self.frames[frame].develop.as_ref()?.pixel_map()
    }

    fn other_name(&self, frame: usize) -> Option<&str> {
        self.frames[frame].other_name.as_deref()
    }

    fn intrinsics(&self, frame: usize) -> Intrinsics {
        self.frames[frame].intrinsics
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        self.frames[frame].world_from_camera
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        self.frames[frame].time_s
    }

    /// Of a map, a frame without a pose has no part.
    fn has_cloud(&self, frame: usize) -> bool {
        let is_placed =
            self.frames[frame].world_from_camera.is_some() || !self.clouds.is_in_world(frame);
        is_placed && self.clouds.has(frame)
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        let frame = &self.frames[frame];
        let size = (frame.intrinsics.width, frame.intrinsics.height);
        let develop = frame.develop.as_ref();
        let in_file = develop.map_or(size, |develop| develop.size_in_file(size));
        let image = photo_file::photo(self.image(frame, in_file)?, || self.gray_range());
        Ok(match develop {
            Some(develop) => develop.developed(image),
            None => image,
        })
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        if !self.clouds.has(frame) {
            let missing = self.clouds.missing().map(str::to_owned);
            return Err(SceneError::NoCloud {
                path: self.clouds.place(frame, &self.frames[frame]).to_owned(),
                frame: self.names[frame].clone(),
                hint: missing.unwrap_or_else(|| self.frames_with_cloud()),
            });
        }
        self.bounds.check(self.clouds.place(frame, &self.frames[frame]))?;
        self.clouds.read(frame, &self.frames[frame])
    }

    fn cloud_at(&self, frame: usize, world_from_camera: &Pose) -> Option<Cloud> {
        if !self.clouds.has(frame) || !self.clouds.is_in_world(frame) {
            return None;
        }
        let moved =
            Frame { world_from_camera: Some(*world_from_camera), ..self.frames[frame].clone() };
        self.clouds.read(frame, &moved).ok()
    }

    fn lengths(&self) -> Lengths {
        self.clouds.lengths()
    }

    fn cloud_facts(&self) -> CloudFacts {
        self.clouds.facts()
    }

    /// Includes the sizes of the photos' files: different photos rarely have the same size in bytes. Modification times
    /// change when data are copied.
    fn fingerprint(&self) -> u64 {
        let size = |frame: &Frame| std::fs::metadata(&frame.photo).map_or(0, |file| file.len());
        let sizes = self.frames.iter().map(size);
        let bytes: Vec<u8> = sizes.flat_map(u64::to_le_bytes).collect();
        posescope_core::scene::fingerprint(self, &bytes)
    }
}
