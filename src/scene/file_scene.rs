//! A scene whose photos are files: all that its reader has to say is what the frames are and where
//! their clouds come from.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::lens::Lens;
use super::{Scene, SceneError, photo_file};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;
use crate::image::Photo;

/// What the format of a scene knows of a frame.
pub(super) struct Frame {
    /// Its name in results and recordings.
    pub name: String,
    /// The photo.
    pub photo: PathBuf,
    /// The camera, as the photo is handed out.
    pub intrinsics: Intrinsics,
    /// What takes the distortion out of the photo, if it has any.
    pub lens: Option<Arc<Lens>>,
    /// Where the camera stood, if that is known.
    pub world_from_camera: Option<Pose>,
    /// When the photo was taken \[s\], if that is known.
    pub time_s: Option<f64>,
}

/// Where the clouds of a scene come from.
pub(super) trait Clouds: Send + Sync {
    /// Whether a frame has one.
    fn has(&self, frame: usize) -> bool;

    /// Where the cloud of a frame is or should be, for whoever looks for it.
    fn place(&self, frame: usize) -> &Path;

    /// The cloud of a frame that has one, in the camera's frame \[m\].
    fn read(&self, index: usize, frame: &Frame) -> Result<Cloud, SceneError>;
}

/// A scene of photo files.
pub(super) struct FileScene<C> {
    name: String,
    names: Vec<String>,
    frames: Vec<Frame>,
    clouds: C,
}

impl<C: Clouds> FileScene<C> {
    /// The frames in their order, with their clouds by position.
    pub fn new(name: String, frames: Vec<Frame>, clouds: C) -> Self {
        Self {
            name,
            names: frames.iter().map(|frame| frame.name.clone()).collect(),
            frames,
            clouds,
        }
    }

    fn frames_with_cloud(&self) -> String {
        let all = self.names.iter().enumerate();
        let with: Vec<&str> = all
            .filter(|(frame, _)| self.clouds.has(*frame))
            .map(|(_, name)| name.as_str())
            .collect();
        match with.as_slice() {
            [] => "no frame of this scene has one".to_owned(),
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

    fn intrinsics(&self, frame: usize) -> Intrinsics {
        self.frames[frame].intrinsics
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        self.frames[frame].world_from_camera
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        self.frames[frame].time_s
    }

    fn has_cloud(&self, frame: usize) -> bool {
        self.clouds.has(frame)
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        let frame = &self.frames[frame];
        let photo = photo_file::read(&frame.photo, &frame.intrinsics)?;
        Ok(match &frame.lens {
            Some(lens) => lens.undistorted(&photo),
            None => photo,
        })
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        if !self.clouds.has(frame) {
            return Err(SceneError::NoCloud {
                path: self.clouds.place(frame).to_owned(),
                frame: self.names[frame].clone(),
                hint: self.frames_with_cloud(),
            });
        }
        self.clouds.read(frame, &self.frames[frame])
    }

    /// With the sizes of the photos' files: photos of the same size in bytes are hardly ever
    /// different ones, and times change when data are copied.
    fn fingerprint(&self) -> u64 {
        let size = |frame: &Frame| std::fs::metadata(&frame.photo).map_or(0, |file| file.len());
        let sizes = self.frames.iter().map(size);
        let bytes: Vec<u8> = sizes.flat_map(u64::to_le_bytes).collect();
        posescope_core::scene::fingerprint(self, &bytes)
    }
}

/// What a folder is called, wherever it is named from.
pub(super) fn folder_name(folder: &Path) -> String {
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    folder
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default()
}
