//! For posescope's own crates: may change in any version.
//!
//! Scenes: anything that yields frames (photo, intrinsics, perhaps a pose, perhaps a cloud).

mod degraded;
mod error;
mod frames;
mod inner;
mod measured;

use std::sync::Arc;

use nalgebra::{Point2, Point3};
use xxhash_rust::xxh3::Xxh3;

pub use degraded::{DegradedScene, degraded};
pub use error::SceneError;
pub use frames::{CachedScene, FrameStore};
pub use measured::SceneSize;

use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;
use crate::image::Photo;
use crate::problem::{Query, ReferenceTuple};
use crate::scale::LengthUnit;

/// A sequence of frames in one world frame. Frames are addressed by position, `0..frames().len()`.
pub trait Scene: Send + Sync {
    /// What the scene is called in results and recordings: no path, so that results do not depend on
    /// where the data lie.
    fn name(&self) -> &str;

    /// The frames' names, as their files are called, in their order.
    fn frames(&self) -> &[String];

    /// Another name of a frame: the path of its photo without extension, where that is more than the frame's name says
    /// and other programs call it so.
    fn other_name(&self, _frame: usize) -> Option<&str> {
        None
    }

    /// The camera of the frame, and with it the size of its photo.
    fn intrinsics(&self, frame: usize) -> Intrinsics;

    /// Where pixels of the frame's photo are in the image of its file, if the photo was undistorted.
    fn pixel_map(&self, _frame: usize) -> Option<Arc<dyn PixelMap>> {
        None
    }

    /// `world_from_camera`, where it is known.
    fn pose(&self, frame: usize) -> Option<Pose>;

    /// Where references of the frame are sought, in the world \[m\]: at its pose, or at a rough position
    /// such as that of a GPS.
    fn position(&self, frame: usize) -> Option<Point3<f64>> {
        self.pose(frame).map(|pose| Point3::from(pose.translation.vector))
    }

    /// When the frame was taken \[s\], where it is known.
    fn time_s(&self, frame: usize) -> Option<f64>;

    /// Whether a cloud was scanned with this frame.
    fn has_cloud(&self, frame: usize) -> bool;

    /// The photo.
    ///
    /// # Errors
    /// When it cannot be read or is not of the size that its camera has.
    fn photo(&self, frame: usize) -> Result<Photo, SceneError>;

    /// The cloud, in the camera's frame.
    ///
    /// # Errors
    /// When there is none, or it cannot be used.
    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError>;

    /// The cloud of a frame as if its camera had another pose: the part of a map that it would see. `None` for a cloud that
    /// was scanned with the frame and is the same at any pose, and where there is none.
    fn cloud_at(&self, _frame: usize, _world_from_camera: &Pose) -> Option<Cloud> {
        None
    }

    /// The frame as a query.
    ///
    /// # Errors
    /// The errors of [`Scene::photo`].
    fn query(&self, frame: usize) -> Result<Arc<Query>, SceneError> {
        Ok(Arc::new(Query::unchecked(
            self.frames()[frame].clone(),
            self.photo(frame)?,
            self.intrinsics(frame),
        )))
    }

    /// The frame as a reference tuple: the photo of [`Scene::query`], and pose and cloud.
    ///
    /// # Errors
    /// The errors of [`Scene::photo`] and [`Scene::cloud`], and [`SceneError::NoPose`].
    fn reference(&self, frame: usize) -> Result<Arc<ReferenceTuple>, SceneError> {
        let world_from_camera = pose_of(self, frame)?;
        let query = self.query(frame)?;
        reference_of(self, frame, world_from_camera, &query)
    }

    /// What its lengths are.
    fn lengths(&self) -> Lengths {
        Lengths::Street
    }

    /// What is known of the clouds' files, once a cloud was read.
    fn cloud_facts(&self) -> CloudFacts {
        CloudFacts::default()
    }

    /// The scene as one whose photos are degraded, if they are.
    fn as_degraded(&self) -> Option<&DegradedScene> {
        None
    }

    /// A hash that changes with the photos, as far as is known without reading them. What was made from
    /// other photos is stale.
    fn fingerprint(&self) -> u64 {
        fingerprint(self, &[])
    }
}

/// Moves pixels between the image in a file and the photo without distortion that is made of it. Pixel centres are at
/// integers.
pub trait PixelMap: Send + Sync {
    /// The pixel of the photo for one of the file; `None` where no pinhole camera sees it.
    fn to_photo(&self, in_file: Point2<f64>) -> Option<Point2<f64>>;

    /// The pixel of the file for one of the photo.
    fn to_file(&self, in_photo: Point2<f64>) -> Point2<f64>;
}

/// What the files of clouds say beside their points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CloudFacts {
    /// The step of the coordinates \[m\], if it is so coarse that clouds and photos cannot be compared.
    pub coarse_step_m: Option<f64>,
    /// The one cloud of all frames, before anything was left out that a camera does not see.
    pub map: Option<MapFacts>,
}

/// A cloud in the world's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapFacts {
    /// The number of its points.
    pub points: usize,
    /// The least and the greatest x, y and z \[m\].
    pub extent: [(f64, f64); 3],
}

/// What the lengths of a scene are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lengths {
    /// Metres on a street, as in the paper.
    Street,
    /// Metres.
    Metres,
    /// The unit of a model that was made from photos alone.
    Model,
}

impl Lengths {
    /// The unit that sentences name.
    pub fn unit(self) -> LengthUnit {
        match self {
            Self::Street | Self::Metres => LengthUnit::Metre,
            Self::Model => LengthUnit::Model,
        }
    }
}

fn pose_of(scene: &(impl Scene + ?Sized), frame: usize) -> Result<Pose, SceneError> {
    scene.pose(frame).ok_or_else(|| SceneError::NoPose {
        scene: scene.name().to_owned(),
        frame: scene.frames()[frame].clone(),
    })
}

/// The reference tuple of a frame whose photo is read already.
fn reference_of(
    scene: &(impl Scene + ?Sized),
    frame: usize,
    world_from_camera: Pose,
    query: &Query,
) -> Result<Arc<ReferenceTuple>, SceneError> {
    Ok(Arc::new(ReferenceTuple {
        name: query.name.clone(),
        photo: Arc::clone(&query.photo),
        intrinsics: query.intrinsics,
        world_from_camera,
        cloud: scene.cloud(frame)?,
        memo: query.memo.shared(),
    }))
}

/// Hash of a scene's name, frames and cameras, and of `more`. Only cameras that change are hashed, which
/// keeps old indices valid.
pub fn fingerprint(scene: &(impl Scene + ?Sized), more: &[u8]) -> u64 {
    let mut sum = Xxh3::new();
    let mut add = |part: &str| {
        sum.update(part.as_bytes());
        sum.update(b"\n");
    };
    let frames = scene.frames();
    let cameras = (0..frames.len()).map(|frame| (frame, scene.intrinsics(frame)));
    let mut last = None;
    let changes: Vec<_> =
        cameras.filter(|(_, camera)| last.replace(*camera) != Some(*camera)).collect();
    add(scene.name());
    if let Some((_, first)) = changes.first() {
        add(&format!("{first:?}"));
    }
    for name in frames {
        add(name);
    }
    for (frame, camera) in changes.iter().skip(1) {
        add(&format!("{frame} {camera:?}"));
    }
    sum.update(more);
    sum.digest()
}

impl dyn Scene + '_ {
    /// The frame of a name: that of its photo, with the folder below the scene's images or without, as long as only
    /// one frame fits. It may lack leading zeros (`3823` finds `003823`), what stands before the number
    /// (`frame-003823`) or decimals of a time, and may have the extension of a photo and further folders in front.
    ///
    /// # Errors
    /// [`SceneError::UnknownFrame`] says which frames there are, [`SceneError::SeveralFrames`] which ones fit.
    pub fn find(&self, name: &str) -> Result<usize, SceneError> {
        let frames = self.frames();
        let path = without_extension(name);
        let number = path.parse::<u64>().ok();
        let ends_path = |frame: &str| {
            frame.len() < path.len() && path.ends_with(frame) && {
                let before = &path[..path.len() - frame.len()];
                before.ends_with(['/', '\\'])
            }
        };
        let begins_a_time = |frame: &str| {
            let rest = frame.strip_prefix(path).unwrap_or_default();
            path.parse::<f64>().is_ok()
                && (rest.starts_with('.') || path.contains('.') && !rest.is_empty())
        };
        let is_other = |at: usize| {
            let path = without_kind(path);
            let other = self.other_name(at);
            other.is_some_and(|other| ends_with_path(other, path) || ends_with_path(path, other))
        };
        let readings: [&dyn Fn(usize) -> bool; 9] = [
            &|at| frames[at] == name,
            &|at| frames[at] == path,
            &|at| frames[at].contains('/') && frames[at].replace('/', "-") == path,
            &|at| ends_path(&frames[at]),
            &|at| is_other(at),
            &|at| number.is_some() && frames[at].parse().ok() == number,
            &|at| stem(&frames[at]) == path,
            &|at| number.is_some() && trailing_number(&frames[at]) == number,
            &|at| begins_a_time(&frames[at]),
        ];
        for is_meant in readings {
            let fitting: Vec<usize> = (0..frames.len()).filter(|&at| is_meant(at)).collect();
            match fitting.as_slice() {
                [] => {}
                [only] => return Ok(*only),
                several => {
                    let named = several.iter().take(SHOWN).map(|&at| frames[at].as_str());
                    let mut known = named.collect::<Vec<_>>().join(", ");
                    if several.len() > SHOWN {
                        known += &format!(" and {} more", several.len() - SHOWN);
                    }
                    let (scene, frame) = (self.name().to_owned(), name.to_owned());
                    return Err(SceneError::SeveralFrames { scene, frame, known });
                }
            }
        }
        Err(SceneError::UnknownFrame {
            scene: self.name().to_owned(),
            frame: name.to_owned(),
            known: frame_range(self),
        })
    }
}

/// The most frames that an error lists.
const SHOWN: usize = 5;

/// The first and the last frame of a scene and their number, for messages.
pub fn frame_range(scene: &dyn Scene) -> String {
    match scene.frames() {
        [] => "none".to_owned(),
        [only] => only.clone(),
        [first, .., last] => format!("{first} … {last}, {} in all", scene.frames().len()),
    }
}

/// The number at the end of a name.
pub fn trailing_number(name: &str) -> Option<u64> {
    let before = name.trim_end_matches(|c: char| c.is_ascii_digit());
    name[before.len()..].parse().ok()
}

/// Whether a path ends with another one.
fn ends_with_path(path: &str, end: &str) -> bool {
    path.strip_suffix(end).is_some_and(|before| before.is_empty() || before.ends_with('/'))
}

/// A name without what 7-Scenes puts before the extension of its photos.
pub fn without_kind(name: &str) -> &str {
    name.strip_suffix(".color").unwrap_or(name)
}

/// A name without folder and extension of a photo.
pub fn stem(name: &str) -> &str {
    without_extension(name.rsplit(['/', '\\']).next().unwrap_or(name))
}

/// A name without the extension of a photo.
pub fn without_extension(name: &str) -> &str {
    const ENDINGS: [&str; 6] = ["png", "jpg", "jpeg", "bmp", "tif", "tiff"];
    match name.rsplit_once('.') {
        Some((stem, ending)) if ENDINGS.contains(&ending.to_ascii_lowercase().as_str()) => stem,
        _ => name,
    }
}

/// A format's place in the registry.
pub struct SceneFormat {
    /// The name that `--format` takes.
    pub name: &'static str,
    /// What a scene argument of this format looks like.
    pub about: &'static str,
    /// Whether a scene argument is of this format, judged by its content.
    pub recognizes: fn(&str) -> bool,
    /// Opens the scene.
    pub open: fn(&str) -> Result<Box<dyn Scene>, SceneError>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use xxhash_rust::xxh3::xxh3_64;

    /// Frames `a`, `b`, `c` with these focal lengths, and nothing else.
    struct Bare([String; 3], [f64; 3]);

    impl Scene for Bare {
        fn name(&self) -> &str {
            "bare"
        }
        fn frames(&self) -> &[String] {
            &self.0
        }
        fn intrinsics(&self, frame: usize) -> Intrinsics {
            Intrinsics { fx: self.1[frame], fy: 1.5, cx: 2.0, cy: 1.0, width: 5, height: 3 }
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
        fn photo(&self, _frame: usize) -> Result<Photo, SceneError> {
            Ok(Photo::from_gray(crate::image::GrayImage::new(5, 3)))
        }
        fn cloud(&self, _frame: usize) -> Result<Cloud, SceneError> {
            Ok(Cloud::default())
        }
    }

    fn bare(focal_lengths: [f64; 3]) -> Bare {
        Bare(["a", "b", "c"].map(str::to_owned), focal_lengths)
    }

    #[test]
    fn the_fingerprint_of_a_scene_with_one_camera_stays_what_it_was() {
        let camera = "Intrinsics { fx: 1.5, fy: 1.5, cx: 2.0, cy: 1.0, width: 5, height: 3 }";
        let written = format!("bare\n{camera}\na\nb\nc\nmore");
        let scene = bare([1.5; 3]);
        assert_eq!(fingerprint(&scene, b"more"), xxh3_64(written.as_bytes()));
        assert_eq!(scene.fingerprint(), fingerprint(&scene, b""));
    }

    #[test]
    fn a_frame_is_found_by_what_people_call_it_if_only_one_is_called_so() {
        let found = |names: [&str; 3], name: &str| {
            let scene = Bare(names.map(str::to_owned), [1.5; 3]);
            let scene: &dyn Scene = &scene;
            scene.find(name).ok()
        };
        let numbers = ["000016", "000160", "000161"];
        for name in ["000016", "16", "16.png", "image_0/000016.jpg"] {
            assert_eq!(found(numbers, name), Some(0), "{name}");
        }
        assert_eq!(found(numbers, "17"), None);
        assert_eq!(found(["frame-000025", "frame-000026", "a-25b"], "25"), Some(0));
        assert_eq!(found(["left-25", "right-25", "left-26"], "25"), None);
        assert_eq!(found(["left-25", "right-25", "left-26"], "26"), Some(2));
        let times = ["12.25", "12.75", "13.5"];
        assert_eq!(found(times, "13"), Some(2));
        assert_eq!(found(times, "12.7"), Some(1));
        assert_eq!(found(times, "12"), None);
        assert_eq!(found(times, "1"), None);
        assert_eq!(found(["a/b.png", "c/b.png", "c/d.png"], "d"), Some(2));
        assert_eq!(found(["a/b.png", "c/b.png", "c/d.png"], "b.png"), None);
        let rig = ["cam0/000003", "cam1/000003", "cam1/000004"];
        for name in ["cam1/000003", "cam1/000003.jpg", "cam1-000003", "data/images/cam1/000003.jpg"]
        {
            assert_eq!(found(rig, name), Some(1), "{name}");
        }
        for name in ["4", "000004", "000004.jpg"] {
            assert_eq!(found(rig, name), Some(2), "{name}");
        }
        for name in ["3", "000003", "cam2/000004", "xcam1/000003"] {
            assert_eq!(found(rig, name), None, "{name}");
        }
        let scene = Bare(rig.map(str::to_owned), [1.5; 3]);
        let scene: &dyn Scene = &scene;
        let error = scene.find("3").expect_err("two").to_string();
        assert!(
            error.ends_with("`3` may be cam0/000003, cam1/000003; name one of them"),
            "{error}"
        );
    }

    #[test]
    fn a_fingerprint_tells_which_frame_has_which_camera() {
        let all =
            [[1.5, 1.5, 1.5], [1.5, 1.5, 2.0], [1.5, 2.0, 1.5], [1.5, 2.0, 2.0], [2.0, 1.5, 1.5]];
        let mut sums = all.map(|lengths| bare(lengths).fingerprint());
        sums.sort_unstable();
        assert!(sums.windows(2).all(|two| two[0] != two[1]));
    }

    #[test]
    fn a_store_of_frames_forgets_scenes_that_nobody_holds_any_more() {
        let store: Arc<FrameStore> = Arc::default();
        let held: Arc<dyn Scene> = Arc::new(bare([1.5; 3]));
        for gamma in 1..10 {
            let text = format!("gamma=0.{gamma}5");
            let degradation = text.parse().expect("a degradation");
            let tried = degraded(&held, degradation, 0);
            store.of(&tried);
            store.of(&held);
        }
        assert!(store.scene_count() <= 2, "{}", store.scene_count());
    }
}
