//! KITTI odometry, in `sequences/NAME` and `poses/NAME.txt`, with one colour camera.
//!
//! The only camera is the left colour camera, `image_2`, and all four projection matrices are the same. Its frame is
//! therefore also that of camera 0, which poses and `Tr` refer to. Scans are in the frame of the scanner, as in KITTI:
//! x forward, y left, z up. Reading a scan back rounds its points by a few micrometres.

use std::path::Path;

use nalgebra::{Matrix3x4, Point3, Vector3};

use super::{
    CAMERA_FROM_VELODYNE, Drive, DriveWriter, Layout, make_folder, make_frame_folder, row_by_row,
    write, write_image,
};
use crate::camera::Intrinsics;
use crate::geometry::matrix_from_pose;
use crate::scene::SceneError;

pub(super) const LAYOUT: Layout =
    Layout { name: "kitti", place: |name| format!("sequences/{name}"), create };

const IMAGES: &str = "image_2";
const SCANS: &str = "velodyne";

fn create(root: &Path, name: &str, drive: Drive) -> Result<DriveWriter, SceneError> {
    let folder = root.join("sequences").join(name);
    let poses = root.join("poses");
    make_folder(&poses)?;
    for (kind, extension) in [(IMAGES, "png"), (SCANS, "bin")] {
        make_frame_folder(&folder.join(kind), extension)?;
    }
    write(&folder.join("calib.txt"), calibration(&drive))?;
    let lines = drive.poses.iter().map(matrix_from_pose);
    let lines: String = lines.map(|pose| row_by_row(&pose) + "\n").collect();
    write(&poses.join(format!("{name}.txt")), lines)?;
    let times = drive.times_s.iter().map(|time| format!("{time:e}\n"));
    write(&folder.join("times.txt"), times.collect::<String>().as_bytes())?;
    Ok(DriveWriter::new(move |shot| {
        let name = &drive.names[shot.index];
        let scan = velodyne_bytes(shot.scan, &drive.scanner);
        // The scan first: a frame with a photo is complete.
        write(&folder.join(SCANS).join(format!("{name}.bin")), &scan)?;
        write_image(&folder.join(IMAGES).join(format!("{name}.png")), shot.photo)
    }))
}

fn calibration(drive: &Drive) -> String {
    let Intrinsics { fx, fy, cx, cy, .. } = drive.intrinsics;
    let projection = Matrix3x4::new(
        fx, 0.0, cx, 0.0, //
        0.0, fy, cy, 0.0, //
        0.0, 0.0, 1.0, 0.0,
    );
    let mut camera_from_velodyne = Matrix3x4::zeros();
    camera_from_velodyne.fixed_columns_mut::<3>(0).copy_from(&CAMERA_FROM_VELODYNE);
    camera_from_velodyne.set_column(3, &drive.scanner.coords);
    let mut text: String =
        (0..4).map(|camera| format!("P{camera}: {}\n", row_by_row(&projection))).collect();
    text += &format!("Tr: {}\n", row_by_row(&camera_from_velodyne));
    text
}

/// A scan in the frame of its scanner, given the scanner's position in the camera's frame \[m\].
fn velodyne_bytes(scan: &[(Point3<f32>, f32)], scanner: &Point3<f64>) -> Vec<u8> {
    let velodyne_from_camera = CAMERA_FROM_VELODYNE.transpose();
    let mut bytes = Vec::new();
    for (position, reflectance) in scan {
        let from_scanner = position.cast::<f64>() - scanner;
        let position: Vector3<f32> = (velodyne_from_camera * from_scanner).cast();
        let record = position.iter().chain([reflectance]);
        bytes.extend(record.flat_map(|value| value.to_le_bytes()));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::super::Shot;
    use super::*;
    use crate::geometry::Pose;
    use crate::scene;
    use crate::scene::street::Size;
    use image::RgbImage;
    use nalgebra::{Translation3, UnitQuaternion};
    use std::fs;

    /// Two frames at the origin.
    fn drive(scanner: Point3<f64>) -> Drive {
        Drive {
            intrinsics: Size::Half.intrinsics(),
            names: ["000000", "000001"].map(str::to_owned).into(),
            poses: vec![Pose::identity(); 2],
            times_s: vec![0.0; 2],
            written: vec![1],
            scanner,
        }
    }

    #[test]
    fn what_is_written_is_read_as_it_was() {
        let root = tempfile::tempdir().expect("a folder");
        let scanner = Point3::new(0.1, -0.08, -0.27);
        let intrinsics = Size::Half.intrinsics();
        let pose = Pose::from_parts(
            Translation3::new(0.1, -1.0 / 3.0, 712.3),
            UnitQuaternion::from_euler_angles(0.01, 1.2, -0.02),
        );
        let drive = Drive {
            poses: vec![Pose::identity(), pose],
            times_s: vec![0.0, 0.1],
            ..drive(scanner)
        };
        let writer = create(root.path(), "dusk", drive).expect("writable");
        let (width, height) = (intrinsics.width, intrinsics.height);
        let photo = RgbImage::from_fn(width, height, |x, y| image::Rgb([x as u8, y as u8, 9]));
        let points = [Point3::new(7.6, 2.85, 10.0), Point3::new(-3.1, 0.4, -41.7)];
        let scan: Vec<_> = points.into_iter().zip([0.25, 0.5]).collect();
        let shot = Shot { index: 1, photo: &photo, scan: &scan, depth: &|_| None };
        (writer.frame)(&shot).expect("writable");

        let folder = root.path().join("sequences/dusk");
        let argument = folder.to_str().expect("a plain path");
        let scene = scene::open(argument, None).unwrap_or_else(|e| panic!("{e}"));
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
        let first: Vec<f32> = numbers[..4].iter().map(|n| f32::from_le_bytes(*n)).collect();
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
        create(root.path(), "dusk", drive(Point3::origin())).expect("writable");
        let there = |name| images.join(name).exists();
        assert!(!there("000003.png"));
        assert!(there("notes.png") && there("000003.txt"));
    }
}
