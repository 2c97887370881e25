//! Frames that were made before: a full-size photo takes two cores a quarter of a second, a cloud
//! 40 ms; their files take 15 ms and 11 ms.

use std::io::Cursor;
use std::sync::{Arc, LazyLock};

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageFormat, RgbImage};
use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion};

use crate::cache::{Cache, DiskCache, Stored};
use posescope_core::cloud::Cloud;
use posescope_core::geometry::Pose;
use posescope_core::image::Photo;

/// In memory. A full-size frame is 3 MB: photo with its grey values, and cloud. Few, because whoever
/// localises keeps the frames in use anyway.
const FRAMES_IN_MEMORY: usize = 4;
/// On disk \[bytes\]: 240 full-size frames.
const DISK_LIMIT: u64 = 512 << 20;
/// Of the renderer's sources.
const FINGERPRINT: &str = env!("POSESCOPE_STREET_FINGERPRINT");

/// The frames of all streets of this process.
pub(super) static SHARED: LazyLock<Arc<FrameCache>> = LazyLock::new(|| {
    let disk = DiskCache::of_user("street", DISK_LIMIT);
    Arc::new(FrameCache::new(disk))
});

/// Photos, clouds and poses by their key.
pub(super) struct FrameCache {
    pub(super) photos: Cache<Photo>,
    pub(super) clouds: Cache<Cloud>,
    pub(super) poses: Cache<Poses>,
}

impl FrameCache {
    pub(super) fn new(disk: Option<DiskCache>) -> Self {
        let disk = disk.map(Arc::new);
        Self {
            photos: Cache::new(FRAMES_IN_MEMORY, disk.clone()),
            clouds: Cache::new(FRAMES_IN_MEMORY, disk.clone()),
            poses: Cache::new(FRAMES_IN_MEMORY, disk),
        }
    }
}

/// A key that another renderer does not share; `what` names everything else.
pub(super) fn key(what: &str) -> String {
    format!("{FINGERPRINT}-{what}")
}

impl Stored for Photo {
    fn to_bytes(&self) -> Option<Vec<u8>> {
        png(self.color.as_ref()?)
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let image = image::load_from_memory_with_format(bytes, ImageFormat::Png).ok()?;
        Some(Self::from_color(image.into_rgb8()))
    }
}

/// The image as a PNG file, made quickly rather than small.
fn png(image: &RgbImage) -> Option<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    let encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    image.write_with_encoder(encoder).ok()?;
    Some(bytes.into_inner())
}

impl Stored for Cloud {
    fn to_bytes(&self) -> Option<Vec<u8>> {
        let coordinates = self.points.iter().flat_map(|point| point.iter());
        Some(coordinates.flat_map(|value| value.to_le_bytes()).collect())
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (coordinates, []) = bytes.as_chunks() else {
            return None;
        };
        let (points, []) = coordinates.as_chunks() else {
            return None;
        };
        let point = |point: &[[u8; 4]; 3]| Point3::from(point.map(f32::from_le_bytes));
        Some(Self { points: points.iter().map(point).collect() })
    }
}

/// The poses of a whole traversal, which would need the town to be built otherwise.
pub(super) struct Poses(pub(super) Vec<Pose>);

impl Stored for Poses {
    fn to_bytes(&self) -> Option<Vec<u8>> {
        let numbers = self.0.iter().flat_map(|pose| {
            let rotation = pose.rotation.coords.iter();
            rotation.chain(pose.translation.vector.iter())
        });
        Some(numbers.flat_map(|number| number.to_le_bytes()).collect())
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (numbers, []) = bytes.as_chunks() else {
            return None;
        };
        let (poses, []) = numbers.as_chunks() else {
            return None;
        };
        let pose = |pose: &[[u8; 8]; 7]| {
            let [i, j, k, w, x, y, z] = pose.map(f64::from_le_bytes);
            // Normalising again would change the last bit.
            let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
            Pose::from_parts(Translation3::new(x, y, z), rotation)
        };
        Some(Self(poses.iter().map(pose).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_the_same_after_the_way_through_its_bytes() {
        let image = RgbImage::from_fn(31, 17, |x, y| image::Rgb([x as u8 * 8, y as u8, 255]));
        let photo = Photo::from_color(image);
        let bytes = photo.to_bytes().expect("has colours");
        let read = Photo::from_bytes(&bytes).expect("just written");
        assert_eq!((read.color, read.gray), (photo.color, photo.gray));

        let cloud =
            Cloud { points: vec![Point3::new(1.5, -0.1, 1e-20), Point3::new(0.3, 7.0, -80.25)] };
        let bytes = cloud.to_bytes().expect("always");
        assert_eq!(bytes.len(), 2 * 12);
        let read = Cloud::from_bytes(&bytes).expect("just written");
        assert_eq!(read.points, cloud.points);
        assert!(Cloud::from_bytes(&bytes[..20]).is_none());

        let rotation = UnitQuaternion::from_euler_angles(0.1, 0.2, 0.3);
        let pose = Pose::from_parts(Translation3::new(0.1, -7e3, 1.0 / 3.0), rotation);
        let bytes = Poses(vec![pose]).to_bytes().expect("always");
        assert_eq!(Poses::from_bytes(&bytes).expect("just written").0, [pose]);
        assert!(Poses::from_bytes(&bytes[8..]).is_none());
    }
}
