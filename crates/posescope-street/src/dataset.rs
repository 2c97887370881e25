//! A traversal of the street as a scene.

use std::sync::{Arc, OnceLock};

use nalgebra::Point3;

use super::condition::Condition;
use super::frame_cache::{self, FrameCache, Poses};
use super::lidar::{self, ScanPoint};
use super::size::Size;
use super::traversal::Traversal;
use posescope_core::camera::Intrinsics;
use posescope_core::cloud::Cloud;
use posescope_core::geometry::Pose;
use posescope_core::image::Photo;
use posescope_core::scene::{Scene, SceneError, SceneFormat, fingerprint};

/// The street among the scene formats.
pub const ENTRY: SceneFormat = SceneFormat {
    name: "street",
    about: "the built-in street: street, or one of its conditions such as street:night",
    recognizes: |argument| argument.split(':').next() == Some(NAME),
    open: |argument| Ok(Box::new(Street::open(argument)?)),
};

const NAME: &str = "street";

/// The town that everybody sees: results on the street can be compared because it is one street.
pub const WORLD_SEED: u64 = 7;

/// Time between two frames, about 1 m apart at the speed of a town \[s\].
const FRAME_INTERVAL_S: f64 = 0.1;

/// A traversal of the street. Nothing is made before it is asked for, and what was made before comes
/// from the cache: a second look at a frame does not even build the town.
pub struct Street {
    name: String,
    world_seed: u64,
    condition: Condition,
    size: Size,
    /// What every key of this traversal begins with.
    key: String,
    cache: Arc<FrameCache>,
    traversal: OnceLock<Traversal>,
    poses: OnceLock<Arc<Poses>>,
    frames: OnceLock<Vec<String>>,
}

impl Street {
    /// Opens `street` or `street:CONDITION`, in full size.
    ///
    /// # Errors
    /// When there is no such condition.
    pub fn open(argument: &str) -> Result<Self, SceneError> {
        let wanted = argument.split_once(':').map(|(_, condition)| condition);
        Self::new(wanted.unwrap_or(Condition::Overcast.name()), Size::Full)
    }

    /// The traversal in a condition, with images of a size.
    ///
    /// # Errors
    /// When there is no such condition.
    pub fn new(condition: &str, size: Size) -> Result<Self, SceneError> {
        Self::of_town(WORLD_SEED, condition, size)
    }

    /// The same through another town.
    ///
    /// # Errors
    /// When there is no such condition.
    pub fn of_town(world_seed: u64, condition: &str, size: Size) -> Result<Self, SceneError> {
        Self::with_cache(world_seed, condition, size, Arc::clone(&frame_cache::SHARED))
    }

    fn with_cache(
        world_seed: u64,
        wanted: &str,
        size: Size,
        cache: Arc<FrameCache>,
    ) -> Result<Self, SceneError> {
        let known = Condition::ALL.into_iter().find(|known| known.name() == wanted);
        let condition = known.ok_or_else(|| SceneError::UnknownCondition {
            argument: format!("{NAME}:{wanted}"),
            known: Self::conditions().collect::<Vec<_>>().join(", "),
        })?;
        Ok(Self {
            name: format!("{NAME}:{wanted}"),
            world_seed,
            condition,
            size,
            key: frame_cache::key(&format!("{world_seed}-{wanted}-{}", size.name())),
            cache,
            traversal: OnceLock::new(),
            poses: OnceLock::new(),
            frames: OnceLock::new(),
        })
    }

    /// The names of all conditions.
    pub fn conditions() -> impl Iterator<Item = &'static str> {
        Condition::ALL.into_iter().map(Condition::name)
    }

    /// Where the laser scanner is in the camera's frame \[m\].
    pub fn scanner_position() -> Point3<f64> {
        lidar::SCANNER
    }

    /// What makes the frames, past the cache.
    pub fn traversal(&self) -> &Traversal {
        self.traversal.get_or_init(|| Traversal::new(self.world_seed, self.condition, self.size))
    }

    fn poses(&self) -> &[Pose] {
        let make = || {
            let traversal = self.traversal();
            let frames = 0..traversal.frame_count();
            Poses(frames.map(|i| traversal.world_from_camera(i)).collect())
        };
        let key = || format!("{}-poses", self.key);
        let poses = self.poses.get_or_init(|| self.cache.poses.get_or_make(&key(), make));
        &poses.0
    }

    fn frame_key(&self, frame: usize, what: &str) -> String {
        format!("{}-{}-{what}", self.key, self.frames()[frame])
    }
}

impl Scene for Street {
    fn name(&self) -> &str {
        &self.name
    }

    fn frames(&self) -> &[String] {
        self.frames.get_or_init(|| {
            let numbers = 0..self.poses().len();
            numbers.map(|number| format!("{number:06}")).collect()
        })
    }

    fn intrinsics(&self, _frame: usize) -> Intrinsics {
        self.size.intrinsics()
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        Some(self.poses()[frame])
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        Some(frame as f64 * FRAME_INTERVAL_S)
    }

    fn has_cloud(&self, _frame: usize) -> bool {
        true
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        let make = || Photo::from_color(self.traversal().image(frame));
        let key = self.frame_key(frame, "photo");
        let photo = self.cache.photos.get_or_make(&key, make);
        Ok(Photo::clone(&photo))
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        let make = || Cloud { points: positions(&self.traversal().cloud(frame)) };
        let key = self.frame_key(frame, "cloud");
        let cloud = self.cache.clouds.get_or_make(&key, make);
        Ok(Cloud::clone(&cloud))
    }

    fn fingerprint(&self) -> u64 {
        fingerprint(self, self.key.as_bytes())
    }
}

fn positions(scan: &[ScanPoint]) -> Vec<Point3<f32>> {
    scan.iter().map(|point| point.position).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::cache::DiskCache;

    #[test]
    fn the_street_is_overcast_unless_told_otherwise() {
        let plain = (ENTRY.open)("street").unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(plain.name(), "street:overcast");
        assert!(plain.frames().len() > 600);
        let error = (ENTRY.open)("street:fog").err().map(|e| e.to_string());
        let error = error.unwrap_or_default();
        assert!(error.contains("overcast"), "{error}");
    }

    #[test]
    fn frames_are_about_a_metre_apart_and_have_everything() {
        let street = Street::open("street").unwrap_or_else(|error| panic!("{error}"));
        let at = |frame| street.pose(frame).map(|pose| pose.translation.vector);
        let step = at(101).zip(at(100)).map(|(a, b)| (a - b).norm());
        assert!(step.is_some_and(|step| (0.5..1.5).contains(&step)), "{step:?}");
        let scene: &dyn Scene = &street;
        let tuple = scene.reference(100).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(tuple.photo().dimensions(), (1241, 376));
        assert!(tuple.cloud().len() > 50_000);
    }

    /// A half-size street with nothing in memory and this folder on disk.
    fn cached_in(folder: Option<&Path>) -> Street {
        let disk = folder.map(|folder| DiskCache::new(folder.to_owned(), 100 << 20));
        let cache = Arc::new(FrameCache::new(disk));
        Street::with_cache(WORLD_SEED, "overcast", Size::Half, cache)
            .unwrap_or_else(|e| panic!("{e}"))
    }

    fn bytes(street: &Street, frame: usize) -> (Photo, Cloud) {
        let photo = street.photo(frame).unwrap_or_else(|e| panic!("{e}"));
        let cloud = street.cloud(frame).unwrap_or_else(|e| panic!("{e}"));
        (photo, cloud)
    }

    fn assert_fresh(street: &Street, frame: usize) {
        let (photo, cloud) = bytes(street, frame);
        let drive = Traversal::new(WORLD_SEED, Condition::Overcast, Size::Half);
        let fresh = Photo::from_color(drive.image(frame));
        assert_eq!((photo.color, photo.gray), (fresh.color, fresh.gray));
        assert_eq!(cloud.points, positions(&drive.cloud(frame)));
        let poses: Vec<_> =
            (0..drive.frame_count()).map(|frame| drive.world_from_camera(frame)).collect();
        assert_eq!(street.poses(), poses);
    }

    #[test]
    fn a_frame_from_the_cache_is_the_fresh_one_and_needs_no_town() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_fresh(&cached_in(None), 40);
        assert_fresh(&cached_in(Some(folder.path())), 40);
        let second = cached_in(Some(folder.path()));
        assert_fresh(&second, 40);
        assert!(second.traversal.get().is_none());
    }

    #[test]
    fn damaged_files_are_made_again() {
        let folder = tempfile::tempdir().expect("a folder");
        bytes(&cached_in(Some(folder.path())), 40);
        let files = || std::fs::read_dir(folder.path()).expect("made").flatten();
        assert_eq!(files().count(), 3);
        for file in files() {
            let half = file.metadata().expect("is there").len() / 2;
            let file = std::fs::File::options().write(true).open(file.path());
            file.and_then(|file| file.set_len(half)).expect("writable");
        }
        assert_fresh(&cached_in(Some(folder.path())), 40);
        let remade = cached_in(Some(folder.path()));
        assert_fresh(&remade, 40);
        assert!(remade.traversal.get().is_none());
    }

    #[test]
    fn opening_makes_nothing() {
        let street = Street::open("street").unwrap_or_else(|error| panic!("{error}"));
        assert!(street.traversal.get().is_none() && street.poses.get().is_none());
    }
}
