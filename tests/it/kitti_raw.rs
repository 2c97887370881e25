//! The reader of KITTI raw drives, on a small one and on a real one.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use nalgebra::{Matrix3x4, Point3};
use posescope::geometry::{Pose, PoseError, pose_from_matrix};
use posescope::localize::localize;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::scene::Scene;
use tempfile::TempDir;

use crate::binary::{arg, run_in};
use crate::damage::open;
use crate::small_sequence::{HEIGHT, WIDTH, scan_of_the_wall, wall};
use crate::{damage, data};

/// A rectification that swaps nothing, a scanner at the camera, and an IMU at the scanner.
const CAMERAS: &str = "\
calib_time: 09-Jan-2012 13:57:47
S_rect_00: 160 64
R_rect_00: 1 0 0 0 1 0 0 0 1
P_rect_00: 100 0 80 0 0 100 32 0 0 0 1 0
S_rect_02: 160 64
R_rect_02: 1 0 0 0 1 0 0 0 1
P_rect_02: 100 0 80 6 0 100 32 0 0 0 1 0
";
const VELODYNE: &str = "calib_time: x\nR: 0 -1 0 0 0 -1 1 0 0\nT: 0 0 0\n";
const IMU: &str = "calib_time: x\nR: 1 0 0 0 1 0 0 0 1\nT: 0 0 0\n";

/// Metres per degree of longitude at the equator of the devkit's sphere.
const METRES_PER_DEGREE: f64 = 6_378_137.0 * std::f64::consts::PI / 180.0;

/// Writes a drive below a day's folder: frames 3, 4 and 6 of a car that drives east at 10 m/s.
pub fn write(day: &Path) -> PathBuf {
    let drive = day.join("2011_09_26_drive_0001_sync");
    for folder in ["image_00/data", "image_02/data", "velodyne_points/data", "oxts/data"] {
        fs::create_dir_all(drive.join(folder)).expect("writable");
    }
    fs::write(day.join("calib_cam_to_cam.txt"), CAMERAS).expect("writable");
    fs::write(day.join("calib_velo_to_cam.txt"), VELODYNE).expect("writable");
    fs::write(day.join("calib_imu_to_velo.txt"), IMU).expect("writable");
    for frame in 0..7 {
        let mut numbers = [0.0; 30];
        numbers[1] = f64::from(frame) / METRES_PER_DEGREE;
        numbers[2] = 100.0;
        numbers[8] = 10.0;
        let words: Vec<String> = numbers.iter().map(|n| format!("{n:.15}")).collect();
        let path = drive.join(format!("oxts/data/{frame:010}.txt"));
        fs::write(path, words.join(" ")).expect("writable");
    }
    for frame in [3, 4, 6] {
        for camera in ["image_00", "image_02"] {
            let path = drive.join(format!("{camera}/data/{frame:010}.png"));
            wall(WIDTH, HEIGHT).save(path).expect("writable");
        }
        let path = drive.join(format!("velodyne_points/data/{frame:010}.bin"));
        fs::write(path, scan_of_the_wall()).expect("writable");
    }
    let times = |offset: f64| -> String {
        let time = |frame: u32| 51.0 + 0.1 * f64::from(frame) + offset;
        let line = |frame| format!("2011-09-26 13:10:{:012.9}\n", time(frame));
        (0..7).map(line).collect()
    };
    for (file, offset) in [
        ("image_00/timestamps.txt", 0.0),
        ("image_02/timestamps.txt", 0.0),
        ("velodyne_points/timestamps_start.txt", -0.05),
        ("velodyne_points/timestamps_end.txt", 0.05),
    ] {
        fs::write(drive.join(file), times(offset)).expect("writable");
    }
    drive
}

#[test]
fn poses_are_those_of_the_camera_from_its_place_at_the_first_packet() {
    let day = TempDir::new().expect("a folder");
    let drive = write(day.path());
    let scene = open(&drive);
    assert_eq!(scene.name(), "kitti-raw/2011_09_26_drive_0001_sync");
    assert_eq!(scene.frames(), ["0000000003", "0000000004", "0000000006"]);
    assert_eq!(scene.find("6").expect("is there"), 2);
    // The car drives along z of the camera.
    let pose = scene.pose(2).expect("is known");
    let error = PoseError::between(&Pose::translation(0.0, 0.0, 6.0), &pose);
    assert!(error.translation_m < 1e-6 && error.rotation_deg < 1e-9);
    let times: Vec<f64> = (0..3).filter_map(|frame| scene.time_s(frame)).collect();
    assert!((times[2] - times[0] - 0.3).abs() < 1e-6, "{times:?}");
    let midnight = 15_243.0 * 86_400.0;
    assert!((times[0] - midnight - (13.0 * 3600.0 + 10.0 * 60.0 + 51.3)).abs() < 1e-5);

    let color = open(drive.join("image_02"));
    assert_eq!(color.name(), "kitti-raw/2011_09_26_drive_0001_sync/image_02");
    let pose = color.pose(0).expect("is known");
    assert!((pose.translation.vector.x + 0.06).abs() < 1e-6, "{pose}");
}

#[test]
fn scans_are_corrected_unless_told_otherwise() {
    let day = TempDir::new().expect("a folder");
    let drive = write(day.path());
    let corrected = open(&drive);
    let raw = open(format!("{}:uncorrected", arg(&drive)));
    assert!(raw.name().ends_with("_sync:uncorrected"), "{}", raw.name());
    let [corrected, raw] = [corrected, raw].map(|scene| scene.cloud(1).expect("is there").points);
    assert_eq!(corrected.len(), raw.len());
    for (corrected, raw) in corrected.iter().zip(&raw) {
        // 1 m in a sweep; what is to the left (negative x) was measured before, from farther back.
        let share = f64::from(-raw.x).atan2(f64::from(raw.z)) / std::f64::consts::TAU;
        let expected = Point3::new(raw.x, raw.y, raw.z - share as f32);
        assert!((corrected - expected).norm() < 1e-4);
    }
}

#[test]
fn a_lost_line_of_times_shifts_no_time() {
    let day = TempDir::new().expect("a folder");
    let drive = write(day.path());
    let times = drive.join("image_00/timestamps.txt");
    let whole = fs::read_to_string(&times).expect("readable");
    let known = |path: &Path| -> Vec<Option<f64>> {
        let scene = open(path);
        (0..scene.frames().len()).map(|frame| scene.time_s(frame)).collect()
    };
    let stated = known(&drive);
    assert!(stated.iter().all(Option::is_some));
    // A blank line stands for a frame that was lost.
    let lines: Vec<&str> = whole.lines().collect();
    let blank = |lost: usize| -> String {
        let line = |(frame, line)| if frame == lost { "\n".into() } else { format!("{line}\n") };
        lines.iter().copied().enumerate().map(line).collect()
    };
    fs::write(&times, blank(2)).expect("writable");
    assert_eq!(known(&drive), stated);
    fs::write(&times, blank(4)).expect("writable");
    assert_eq!(known(&drive), [stated[0], None, stated[2]]);
    // Without its first line, line k is no longer the time of frame k.
    fs::write(&times, lines[1..].join("\n")).expect("writable");
    assert_eq!(known(&drive), [None; 3]);
    let told = run_in(day.path(), &format!("doctor {}", arg(&drive))).err;
    let line = "line k is the time of frame k, so 7 lines expected for frames up to 6, 6 found";
    assert!(told.contains(line), "{told}");
}

#[test]
fn what_is_wrong_with_a_drive_is_named() {
    damage::expect(
        |day| arg(&write(day)).to_owned(),
        r#"
        calib_cam_to_cam.txt | text a: 1\n | calib_cam_to_cam.txt ~ `P_rect_00:`
        calib_velo_to_cam.txt | text R: 1 0 0 0 2 0 0 0 1\nT: 0 0 0\n | calib_velo_to_cam.txt ~ not a rotation
        calib_imu_to_velo.txt | text R: 1 0 0 0 1 0 0 0 1\nT: 0 0\n | calib_imu_to_velo.txt:2 ~ 3 numbers expected, 2 found
        2011_09_26_drive_0001_sync/oxts/data/0000000002.txt | text 1 2 3\n | 0000000002.txt:1 ~ 30 numbers expected, 3 found
        2011_09_26_drive_0001_sync/image_00/timestamps.txt | text yesterday\n | timestamps.txt:1 ~ `yesterday`
        2011_09_26_drive_0001_sync/image_00/data/0000000003.png | image 170x64 | 0000000003.png ~ 160x64
        2011_09_26_drive_0001_sync/velodyne_points/data/0000000003.bin | cut 3 | 0000000003.bin ~ cut off
        "#,
    );
}

/// The poses of camera 0 that were found by registering the scans, by frame number.
fn derived() -> Option<BTreeMap<usize, Pose>> {
    let path = data::sample("derived/kitti_raw_2011_09_26_drive_0013.txt")?;
    let text = fs::read_to_string(path).expect("readable");
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let pose = |line: &str| {
        let (number, matrix) = line.split_once(' ').expect("a number and a matrix");
        let matrix: Vec<f64> =
            matrix.split_whitespace().map(|word| word.parse().expect("a number")).collect();
        let pose = pose_from_matrix(&Matrix3x4::from_row_slice(&matrix)).expect("rigid");
        (number.parse().expect("a number"), pose)
    };
    Some(lines.map(pose).collect())
}

const REAL: &str = "kitti_raw/2011_09_26/2011_09_26_drive_0013_sync";

#[test]
fn the_real_drive_is_where_its_scans_say() {
    let (Some(folder), Some(derived)) = (data::sample(REAL), derived()) else {
        return;
    };
    let scene = open(&folder);
    assert_eq!(scene.frames().len(), 8);
    let pose = |number: usize| {
        let frame = scene.find(&number.to_string()).expect("is there");
        scene.pose(frame).expect("is known")
    };
    let first = pose(4);
    for (&number, derived) in &derived {
        // The rectified colour camera moves as camera 0 beside it does, but for 6 cm of lever.
        let error = PoseError::between(derived, &(first.inverse() * pose(number)));
        let way_m = derived.translation.vector.norm();
        println!("{number}, {way_m:.1} m: {error}");
        // GPS drifts by some centimetres a second.
        assert!(
            error.translation_m < 0.05 + 0.025 * way_m && error.rotation_deg < 0.3,
            "{number}: {error}"
        );
    }
}

/// How far points beside the car are from the nearest point of another scan, once both are in one
/// frame by the poses that registration found: the median \[m\].
fn gap_beside_the_car(scene: &dyn Scene, derived: &BTreeMap<usize, Pose>) -> f32 {
    let (a, b) = (8, 12);
    let points = |number: usize| {
        let frame = scene.find(&number.to_string()).expect("is there");
        scene.cloud(frame).expect("is there").points
    };
    let a_from_b = (derived[&a].inverse() * derived[&b]).cast::<f32>();
    let is_beside = |point: &&Point3<f32>| {
        let above_ground = point.y < 1.0;
        above_ground && (3.0..15.0).contains(&point.x.abs()) && point.z.abs() < 5.0
    };
    let in_a = points(a);
    let in_b = points(b);
    let mut gaps: Vec<f32> = in_b
        .iter()
        .filter(is_beside)
        .step_by(10)
        .map(|point| {
            let point = a_from_b * point;
            let squares = in_a.iter().map(|other| (other - point).norm_squared());
            squares.fold(f32::INFINITY, f32::min).sqrt()
        })
        .collect();
    assert!(gaps.len() > 200, "{}", gaps.len());
    gaps.sort_by(f32::total_cmp);
    gaps[gaps.len() / 2]
}

#[test]
fn corrected_scans_of_the_real_drive_fit_each_other_better() {
    let (Some(folder), Some(derived)) = (data::sample(REAL), derived()) else {
        return;
    };
    let corrected = gap_beside_the_car(open(&folder).as_ref(), &derived);
    let uncorrected = format!("{}:uncorrected", arg(&folder));
    let uncorrected = gap_beside_the_car(open(&uncorrected).as_ref(), &derived);
    println!("median gap {corrected:.3} m corrected, {uncorrected:.3} m as scanned");
    assert!(corrected < 0.85 * uncorrected, "{corrected} {uncorrected}");
}

#[test]
fn fb_localises_on_the_real_drive() {
    let (Some(folder), Some(derived)) = (data::sample(REAL), derived()) else {
        return;
    };
    let scene = open(&folder);
    let frame = |name| scene.find(name).expect("is there");
    let (reference, query) = (frame("4"), frame("8"));
    let problem = Problem::new(
        scene.query(query).expect("readable"),
        scene.reference(reference).expect("readable"),
        10.0,
    )
    .expect("a radius");
    let outcome = localize(&problem, Method::FB, &Params::default());
    let pose = outcome.pose.unwrap_or_else(|failure| panic!("{failure}"));
    let truth = scene.pose(reference).expect("is known") * derived[&8];
    let error = PoseError::between(&truth, &pose);
    println!("{error}");
    assert!(error.translation_m < 0.15 && error.rotation_deg < 0.3);
}
