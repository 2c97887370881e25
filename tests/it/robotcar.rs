//! Oxford RobotCar: a small drive in the layout of its SDK, and the SDK's own calibration.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

use image::{Rgb, RgbImage};
use nalgebra::{Point3, Vector3};
use posescope::camera::Intrinsics;
use posescope::geometry::Pose;
use posescope::scene::layout::{Drive, Shot};
use posescope::scene::{self, Scene};
use tempfile::TempDir;

use crate::binary::arg;
use crate::damage::open;
use crate::{damage, data, layouts};

const CAMERA: Intrinsics =
    Intrinsics { fx: 60.0, fy: 60.0, cx: 39.5, cy: 29.5, width: 80, height: 60 };
const FRAMES: usize = 100;
/// Parked before the first and behind the second.
const DRIVES: (usize, usize) = (30, 80);

/// Ten frames a second; 5 m/s while it drives.
fn pose(frame: usize) -> Pose {
    let way_m = 0.5 * frame.clamp(DRIVES.0, DRIVES.1) as f64;
    Pose::translation(0.0, 0.0, way_m)
}

/// A wall across the road 60 m from the start, seen from where the car is.
fn scan(frame: usize) -> Vec<(Point3<f32>, f32)> {
    let depth = 60.0 - pose(frame).translation.vector.z as f32;
    let beams = (-20..=20).flat_map(|row| (-40..=40).map(move |column| (row, column)));
    beams
        .map(|(row, column)| (Point3::new(column as f32 * 0.5, row as f32 * 0.5, depth), 0.5))
        .collect()
}

/// Writes the drive below a folder; the traversal is called `drive`.
pub fn write(root: &Path) -> PathBuf {
    write_part(root, 0..FRAMES)
}

/// The same drive, of which only some frames have photos and scans.
pub fn write_part(root: &Path, frames: Range<usize>) -> PathBuf {
    let layout = layouts::ROBOTCAR;
    let drive = Drive {
        intrinsics: CAMERA,
        names: (0..FRAMES).map(|frame| frame.to_string()).collect(),
        poses: (0..FRAMES).map(pose).collect(),
        times_s: (0..FRAMES).map(|frame| 1_000.0 + frame as f64 / 10.0).collect(),
        written: frames.clone().collect(),
        scanner: Point3::new(0.0, -0.5, 0.3),
    };
    let writer = (layout.create)(root, "drive", drive).expect("writable");
    let photo = RgbImage::from_fn(80, 60, |x, y| {
        let block = ((x / 8) * 37 + (y / 8) * 91) as u8;
        Rgb([block, block.wrapping_mul(3), 255 - block])
    });
    for index in frames {
        let shot = Shot { index, photo: &photo, scan: &scan(index), depth: &|_| None };
        (writer.frame)(&shot).expect("writable");
    }
    (writer.finish)().expect("writable");
    root.join((layout.place)("drive"))
}

#[test]
fn one_frame_in_ten_is_kept_while_the_car_moves() {
    let folder = TempDir::new().expect("a folder");
    let traversal = write(folder.path());
    let kept = open(&traversal);
    assert_eq!(kept.name(), "robotcar/drive");
    let frames: Vec<f64> = (0..kept.frames().len())
        .map(|frame| 10.0 * (kept.time_s(frame).expect("is known") - 1_000.0))
        .collect();
    assert!((6..=7).contains(&frames.len()), "{frames:?}");
    assert!(frames.windows(2).all(|two| (two[1] - two[0] - 10.0).abs() < 1e-6), "{frames:?}");
    assert!(frames[0] >= 20.0 && frames[frames.len() - 1] <= 90.0, "{frames:?}");
    let all = open(format!("{}:all", arg(&traversal)));
    assert_eq!(all.frames().len(), FRAMES);
    let camera = open(traversal.join("stereo/centre"));
    assert_eq!(camera.frames(), kept.frames());
}

#[test]
fn rows_without_a_good_solution_are_left_out() {
    let folder = TempDir::new().expect("a folder");
    let traversal = write(folder.path());
    let file = traversal.join("gps/ins.csv");
    let good = fs::read_to_string(&file).expect("text");
    let all = format!("{}:all", arg(&traversal));
    let scene = open(&all);
    // The world is north, east, down; the car drives north.
    let [a, b] = [40, 60].map(|frame| scene.pose(frame).expect("is known"));
    let way = b.translation.vector - a.translation.vector;
    assert!((way - Vector3::new(10.0, 0.0, 0.0)).norm() < 1e-6, "{way}");
    assert!((a * Vector3::z() - Vector3::x()).norm() < 1e-6);
    let bad = good.replace("INS_SOLUTION_GOOD", "INS_BAD_GPS_AGREEMENT");
    fs::write(&file, bad).expect("writable");
    let scene = open(&all);
    assert!(scene.pose(40).is_none());
    assert!(scene.has_cloud(40), "odometry moves the scans");
}

#[test]
fn scans_around_a_frame_are_gathered_in_its_camera() {
    let folder = TempDir::new().expect("a folder");
    let scene = open(format!("{}:all", arg(&write(folder.path()))));
    let cloud = scene.cloud(50).expect("is there");
    assert!(cloud.len() > 200, "{}", cloud.len());
    // The wall of every scan is the same wall.
    let depth = 60.0 - pose(50).translation.vector.z as f32;
    let off = cloud.points.iter().filter(|point| (point.z - depth).abs() > 0.2).count();
    assert!(off * 50 < cloud.len(), "{off} of {}", cloud.len());
}

/// A traversal with the SDK's own calibration, and no lens to speak of.
fn with_real_sdk(root: &Path, sdk: &Path) -> PathBuf {
    let traversal = write(root);
    for part in ["models", "extrinsics"] {
        for entry in fs::read_dir(sdk.join(part)).expect("readable") {
            let file = entry.expect("readable").path();
            let to = root.join("sdk").join(part).join(file.file_name().expect("a file"));
            let _ = fs::remove_file(&to);
            fs::write(&to, fs::read(&file).expect("readable")).expect("writable");
        }
    }
    let table = |model: &str, width: u32, height: u32| {
        let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let columns = pixels().map(|(x, _)| f64::from(x));
        let rows = pixels().map(|(_, y)| f64::from(y));
        let bytes: Vec<u8> = columns.chain(rows).flat_map(f64::to_le_bytes).collect();
        let path = root.join(format!("sdk/models/{model}_distortion_lut.bin"));
        fs::write(path, bytes).expect("writable");
    };
    table("stereo_narrow_left", 80, 60);
    table("mono_rear", 80, 60);
    fs::create_dir(traversal.join("mono_rear")).expect("writable");
    for entry in fs::read_dir(traversal.join("stereo/centre")).expect("readable") {
        let photo = entry.expect("readable").path();
        let to = traversal.join("mono_rear").join(photo.file_name().expect("a file"));
        fs::copy(photo, to).expect("writable");
    }
    traversal
}

#[test]
fn the_cameras_of_the_sdk_stand_where_the_sdk_puts_them() {
    let Some(sdk) = data::sample("robotcar_sdk") else {
        return;
    };
    let folder = TempDir::new().expect("a folder");
    let traversal = with_real_sdk(folder.path(), &sdk);
    let camera = |folder: &str| open(format!("{}:all", arg(&traversal.join(folder))));
    let (front, rear) = (camera("stereo/centre"), camera("mono_rear"));
    assert_eq!(front.intrinsics(0).fx, 964.828979);
    assert_eq!((rear.intrinsics(0).fx, rear.intrinsics(0).cx), (400.0, 508.222931));
    let at = |scene: &dyn Scene| scene.pose(40).expect("is known");
    let (front, rear) = (at(front.as_ref()), at(rear.as_ref()));
    // North is ahead; the rear camera looks back and down, 15° as its extrinsics say.
    let ahead = front * Vector3::z();
    let behind = rear * Vector3::z();
    assert!(ahead.angle(&Vector3::x()) < 0.1, "{ahead}");
    assert!(behind.angle(&-Vector3::x()) < 0.35 && behind.z > 0.1, "{behind}");
    // Both hold their heads up: down is down.
    for pose in [front, rear] {
        assert!((pose * Vector3::y()).angle(&Vector3::z()) < 0.35);
    }
    // Two metres behind the stereo camera.
    let apart = front.inverse() * rear;
    let apart = apart.translation.vector;
    assert!((-2.3..-1.6).contains(&apart.z) && apart.x.abs() < 0.6, "{apart}");
}

#[test]
fn what_is_wrong_with_a_traversal_is_named() {
    let write = |root: &Path| format!("{}:all", arg(&write_part(root, 40..42)));
    damage::expect(
        write,
        r#"
        sdk/models/stereo_narrow_left_distortion_lut.bin | cut 76700 | 76800 bytes ~ 100 bytes found
        sdk/models/stereo_narrow_left.txt | text 1 2 3 4\n0 0 1 0\n | stereo_narrow_left.txt ~ cut off
        sdk/extrinsics/ldmrs.txt | gone | extrinsics/ldmrs.txt
        drive/stereo.timestamps | text soon 1\n | stereo.timestamps:1 ~ `timestamp chunk`
        drive/gps/ins.csv | text a,b\n | ins.csv:1 ~ `timestamp`
        drive/vo/vo.csv | text a\n1,2,3\n | vo.csv:1 ~ a column `source_timestamp` expected
        drive/vo/vo.csv | text source_timestamp,destination_timestamp,x,y,z,roll,pitch,yaw\n1,2,3\n | vo.csv:2 ~ 8 columns expected, 3 found
        drive/stereo/centre/1004000000.png | cut 200 | 1004000000.png
        drive/ldmrs/1004000000.bin | cut 5 | 1004000000.bin ~ 24 bytes
        "#,
    );
    let root = TempDir::new().expect("a folder");
    let traversal = write_part(root.path(), 40..42);
    fs::remove_dir_all(root.path().join("sdk")).expect("was written");
    let opened = scene::open(arg(&traversal), Some("robotcar"));
    let error = opened.err().expect("no SDK").to_string();
    damage::expect_words(&error, "models and extrinsics of the SDK");
}
