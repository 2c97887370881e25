//! Writes a sequence in the layout that [`KittiOdometry`](super::KittiOdometry) reads, with one
//! colour camera.
//!
//! The left colour camera, `image_2`, is the only one, and all four projection matrices are its: so
//! its frame is also that of camera 0, of which poses and `Tr` speak. Scans are in the frame of the
//! scanner, as KITTI's are, x forward, y left, z up: reading a scan back rounds its points once, by
//! a few micrometres. Numbers in text files are written such that they are read as they were.

use std::fs;
use std::path::{Path, PathBuf};

use image::{ImageFormat, RgbImage};
use nalgebra::{Matrix3, Matrix3x4, Point3, Vector3};

use super::SceneError;
use crate::camera::Intrinsics;
use crate::geometry::{Pose, matrix_from_pose};
use posescope_core::files::write_whole;

const IMAGES: &str = "image_2";
const SCANS: &str = "velodyne";

/// The rotation from Velodyne axes (x forward, y left, z up) to camera axes.
const CAMERA_FROM_VELODYNE: Matrix3<f64> =
    Matrix3::new(0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0);

/// A sequence in `ROOT/sequences/NAME`, with its poses in `ROOT/poses/NAME.txt`. Files are whole or
/// not there; one that exists is replaced.
pub struct SequenceWriter {
    folder: PathBuf,
    poses: PathBuf,
    /// The position of the scanner in the camera's frame \[m\].
    scanner: Vector3<f64>,
}

impl SequenceWriter {
    /// Makes the folders of a sequence whose scanner is at a place in the camera's frame \[m\].
    /// Frames that an earlier sequence of this name has left there are removed.
    ///
    /// # Errors
    /// [`SceneError::Io`], as in all methods, when the disk is full or a folder is not writable.
    pub fn create(root: &Path, name: &str, scanner: Point3<f64>) -> Result<Self, SceneError> {
        let folder = root.join("sequences").join(name);
        let poses = root.join("poses");
        for made in [&folder.join(IMAGES), &folder.join(SCANS), &poses] {
            fs::create_dir_all(made).map_err(io(made))?;
        }
        remove_frames(&folder.join(IMAGES), "png")?;
        remove_frames(&folder.join(SCANS), "bin")?;
        Ok(Self {
            folder,
            poses: poses.join(format!("{name}.txt")),
            scanner: scanner.coords,
        })
    }

    /// Writes `calib.txt`.
    ///
    /// # Errors
    /// [`SceneError::Io`].
    pub fn calibration(&self, intrinsics: &Intrinsics) -> Result<(), SceneError> {
        let Intrinsics { fx, fy, cx, cy, .. } = *intrinsics;
        let projection = Matrix3x4::new(
            fx, 0.0, cx, 0.0, //
            0.0, fy, cy, 0.0, //
            0.0, 0.0, 1.0, 0.0,
        );
        let mut camera_from_velodyne = Matrix3x4::zeros();
        camera_from_velodyne
            .fixed_columns_mut::<3>(0)
            .copy_from(&CAMERA_FROM_VELODYNE);
        camera_from_velodyne.set_column(3, &self.scanner);
        let mut text: String = (0..4)
            .map(|camera| format!("P{camera}: {}\n", row_by_row(&projection)))
            .collect();
        text += &format!("Tr: {}\n", row_by_row(&camera_from_velodyne));
        write(&self.folder.join("calib.txt"), text.as_bytes())
    }

    /// Writes the poses of all frames, whether or not their photos are written, as
    /// `world_from_camera`; and their times \[s\].
    ///
    /// # Errors
    /// [`SceneError::Io`].
    pub fn poses(&self, poses: &[Pose], times_s: &[f64]) -> Result<(), SceneError> {
        let lines = poses.iter().map(matrix_from_pose);
        let lines: String = lines.map(|pose| row_by_row(&pose) + "\n").collect();
        write(&self.poses, lines.as_bytes())?;
        let times: String = times_s.iter().map(|time| format!("{time:e}\n")).collect();
        write(&self.folder.join("times.txt"), times.as_bytes())
    }

    /// Writes scan and photo of a frame by its name: points in the camera's frame \[m\] with their
    /// reflectance.
    ///
    /// # Errors
    /// [`SceneError::Io`], or [`SceneError::Image`] when the photo cannot be encoded.
    pub fn frame(
        &self,
        name: &str,
        photo: &RgbImage,
        scan: impl Iterator<Item = (Point3<f32>, f32)>,
    ) -> Result<(), SceneError> {
        let velodyne_from_camera = CAMERA_FROM_VELODYNE.transpose();
        let mut bytes = Vec::new();
        for (position, reflectance) in scan {
            let from_scanner = position.coords.cast::<f64>() - self.scanner;
            let position: Vector3<f32> = (velodyne_from_camera * from_scanner).cast();
            let record = position.iter().chain([&reflectance]);
            bytes.extend(record.flat_map(|value| value.to_le_bytes()));
        }
        // The scan first: where there is a photo, the frame is complete.
        write(&self.folder.join(SCANS).join(format!("{name}.bin")), &bytes)?;

        let path = self.folder.join(IMAGES).join(format!("{name}.png"));
        let mut png = std::io::Cursor::new(Vec::new());
        photo
            .write_to(&mut png, ImageFormat::Png)
            .map_err(|source| SceneError::Image {
                path: path.clone(),
                source,
            })?;
        write(&path, png.get_ref())
    }
}

/// Removes the files NNNNNN.EXTENSION, and no others.
fn remove_frames(folder: &Path, extension: &str) -> Result<(), SceneError> {
    for entry in fs::read_dir(folder).map_err(io(folder))? {
        let path = entry.map_err(io(folder))?.path();
        let stem = path.file_stem().and_then(|stem| stem.to_str());
        let is_frame = stem
            .is_some_and(|stem| stem.len() == 6 && stem.bytes().all(|byte| byte.is_ascii_digit()));
        if is_frame && path.extension().is_some_and(|end| end == extension) {
            fs::remove_file(&path).map_err(io(&path))?;
        }
    }
    Ok(())
}

/// Twelve numbers with as many digits as they need.
fn row_by_row(matrix: &Matrix3x4<f64>) -> String {
    let rows = matrix.transpose();
    let numbers: Vec<String> = rows.iter().map(|number| format!("{number:e}")).collect();
    numbers.join(" ")
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), SceneError> {
    write_whole(path, bytes).map_err(io(path))
}

fn io(path: &Path) -> impl FnOnce(std::io::Error) -> SceneError + '_ {
    |source| SceneError::Io {
        path: path.to_owned(),
        source,
    }
}

#[cfg(test)]
mod tests {
    use super::super::KittiOdometry;
    use super::*;
    use crate::scene::Scene as _;
    use crate::scene::street::Size;
    use nalgebra::{Translation3, UnitQuaternion};

    #[test]
    fn what_is_written_is_read_as_it_was() {
        let root = tempfile::tempdir().expect("a folder");
        let scanner = Point3::new(0.1, -0.08, -0.27);
        let writer = SequenceWriter::create(root.path(), "dusk", scanner).expect("writable");
        let intrinsics = Size::Half.intrinsics();
        writer.calibration(&intrinsics).expect("writable");
        let pose = Pose::from_parts(
            Translation3::new(0.1, -1.0 / 3.0, 712.3),
            UnitQuaternion::from_euler_angles(0.01, 1.2, -0.02),
        );
        let poses = [Pose::identity(), pose];
        writer.poses(&poses, &[0.0, 0.1]).expect("writable");
        let (width, height) = (intrinsics.width, intrinsics.height);
        let photo = RgbImage::from_fn(width, height, |x, y| image::Rgb([x as u8, y as u8, 9]));
        let points = [Point3::new(7.6, 2.85, 10.0), Point3::new(-3.1, 0.4, -41.7)];
        let scan = points.into_iter().zip([0.25, 0.5]);
        writer.frame("000001", &photo, scan).expect("writable");

        let folder = root.path().join("sequences/dusk");
        let scene = KittiOdometry::open(&folder).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(scene.frames(), ["000001"]);
        assert_eq!(scene.intrinsics(0), intrinsics);
        assert_eq!(scene.time_s(0), Some(0.1));
        let read = scene.pose(0).expect("was written");
        assert!((read.to_homogeneous() - pose.to_homogeneous()).amax() < 1e-12);
        let read = scene.photo(0).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(read.color, Some(photo));
        let read = scene.cloud(0).unwrap_or_else(|e| panic!("{e}"));
        for (read, point) in read.points.iter().zip(points) {
            assert!((read - point).norm() < 1e-5, "{read} {point}");
        }
        // On disk: forward, left, up of the scanner, and the reflectance.
        let bytes = fs::read(folder.join("velodyne/000001.bin")).expect("was written");
        let (numbers, _) = bytes.as_chunks();
        let first: Vec<f32> = numbers[..4]
            .iter()
            .map(|n| f32::from_le_bytes(*n))
            .collect();
        for (read, expected) in first.iter().zip([10.27, -7.5, -2.93, 0.25]) {
            assert!((read - expected).abs() < 1e-5, "{first:?}");
        }
    }

    #[test]
    fn a_second_sequence_of_the_name_replaces_the_frames_and_nothing_else() {
        let root = tempfile::tempdir().expect("a folder");
        let images = root.path().join("sequences/dusk/image_2");
        fs::create_dir_all(&images).expect("writable");
        for name in ["000003.png", "notes.png", "000003.txt"] {
            fs::write(images.join(name), b"").expect("writable");
        }
        SequenceWriter::create(root.path(), "dusk", Point3::origin()).expect("writable");
        let there = |name| images.join(name).exists();
        assert!(!there("000003.png"));
        assert!(there("notes.png") && there("000003.txt"));
    }
}
