//! KITTI raw, in `NAME/NAME_drive_0001_sync`, with one colour camera, `image_02`, which is camera 0 as
//! well. Scans have no distortion of a sweep, and so the packets say that the car stands still.

use std::path::{Path, PathBuf};

use chrono::DateTime;
use nalgebra::Vector3;
use posescope::camera::Intrinsics;
use posescope::geometry::Pose;
use posescope::scene::SceneError;
use posescope::scene::layout::{Drive, DriveWriter, Layout, Shot};

use super::{CAMERA_FROM_VELODYNE, joined, make_folder, write};

pub const LAYOUT: Layout = Layout {
    name: "kitti-raw",
    place: |name| format!("{name}/{name}_drive_0001_sync"),
    create: |root, name, drive| {
        let writer = Writer::create(root, name, drive);
        Ok(DriveWriter::new(move |shot| writer.frame(shot)))
    },
};

/// Radius of the earth in the devkit's projection \[m\].
const EARTH_RADIUS_M: f64 = 6_378_137.0;
/// Where the first packet is: in Karlsruhe \[°\].
const FIRST: [f64; 2] = [49.0, 8.4];

struct Writer {
    drive_folder: PathBuf,
    drive: Drive,
}

/// What frames are called.
fn stem(frame: usize) -> String {
    format!("{frame:010}")
}

impl Writer {
    fn create(root: &Path, name: &str, drive: Drive) -> Self {
        let day = root.join(name);
        let drive_folder = root.join((LAYOUT.place)(name));
        for sensor in ["image_02", "velodyne_points", "oxts"] {
            make_folder(&drive_folder.join(sensor).join("data"));
            let times = drive.times_s.iter().map(|&time| timestamp(time) + "\n");
            let path = drive_folder.join(sensor).join("timestamps.txt");
            write(&path, times.collect::<String>());
        }
        let Intrinsics { fx, fy, cx, cy, width, height } = drive.intrinsics;
        let one = "1 0 0 0 1 0 0 0 1";
        let mut cameras = String::new();
        for number in 0..4 {
            cameras += &format!(
                "S_rect_0{number}: {width} {height}\nR_rect_0{number}: {one}\n\
                 P_rect_0{number}: {fx:e} 0 {cx:e} 0 0 {fy:e} {cy:e} 0 0 0 1 0\n"
            );
        }
        write(&day.join("calib_cam_to_cam.txt"), cameras);
        let rotation = joined(&CAMERA_FROM_VELODYNE.transpose(), " ");
        let scanner = joined(drive.scanner.coords.iter(), " ");
        let velodyne = format!("R: {rotation}\nT: {scanner}\n");
        write(&day.join("calib_velo_to_cam.txt"), velodyne);
        let imu = format!("R: {one}\nT: 0 0 0\n");
        write(&day.join("calib_imu_to_velo.txt"), imu);
        let writer = Self { drive_folder, drive };
        writer.packets();
        writer
    }

    /// The packets of all frames. The IMU is where the scanner is, and the world of the packets is the
    /// drive's with the axes of a car.
    fn packets(&self) {
        let camera_from_imu = Pose::from_parts(
            self.drive.scanner.into(),
            nalgebra::UnitQuaternion::from_matrix(&CAMERA_FROM_VELODYNE),
        );
        let imu_pose = |pose: &Pose| camera_from_imu.inverse() * pose * camera_from_imu;
        let Some(first) = self.drive.poses.first().map(imu_pose) else {
            return;
        };
        let [latitude, longitude] = FIRST.map(f64::to_radians);
        let scale = latitude.cos() * EARTH_RADIUS_M;
        let first_y = scale * (std::f64::consts::FRAC_PI_4 + latitude / 2.0).tan().ln();
        for (frame, pose) in self.drive.poses.iter().enumerate() {
            let pose = imu_pose(pose);
            let moved: Vector3<f64> = pose.translation.vector - first.translation.vector;
            let y = (first_y + moved.y) / scale;
            let (roll, pitch, yaw) = pose.rotation.euler_angles();
            let mut numbers = [0.0; 30];
            numbers[0] = (2.0 * y.exp().atan() - std::f64::consts::FRAC_PI_2).to_degrees();
            numbers[1] = (longitude + moved.x / scale).to_degrees();
            numbers[2] = pose.translation.vector.z;
            numbers[3..6].copy_from_slice(&[roll, pitch, yaw]);
            let path = format!("oxts/data/{}.txt", stem(frame));
            let text = joined(&numbers, " ") + "\n";
            write(&self.drive_folder.join(path), text);
        }
    }
}

fn timestamp(time_s: f64) -> String {
    let nanoseconds = (time_s * 1e9).round() as i64;
    let time = DateTime::from_timestamp_nanos(nanoseconds);
    time.format("%Y-%m-%d %H:%M:%S%.9f").to_string()
}

impl Writer {
    fn frame(&self, shot: &Shot<'_>) -> Result<(), SceneError> {
        let name = stem(shot.index);
        let file = |path: String| self.drive_folder.join(path);
        let records = shot.scan.iter().flat_map(|(position, reflectance)| {
            let from_scanner = position.cast::<f64>() - self.drive.scanner;
            let position: Vector3<f32> = (CAMERA_FROM_VELODYNE.transpose() * from_scanner).cast();
            [position.x, position.y, position.z, *reflectance]
        });
        let scan: Vec<u8> = records.flat_map(f32::to_le_bytes).collect();
        write(&file(format!("velodyne_points/data/{name}.bin")), scan);
        let photo = file(format!("image_02/data/{name}.png"));
        shot.photo.save(photo).expect("writable");
        Ok(())
    }
}
