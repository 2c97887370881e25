//! Oxford RobotCar as its SDK lays it out, with the SDK's own folder, `sdk`, beside the traversals. The
//! photos are those of the centre camera of the stereo rig, as the sensor took them: a value at each pixel
//! and moved by the lens, which the look-up table undoes. The 3-D scanner is the LD-MRS; the LMS at the
//! front has what lies in its plane.

use std::path::{Path, PathBuf};

use image::{GrayImage, Luma, RgbImage};
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion};
use posescope::geometry::Pose;
use posescope::scene::SceneError;
use posescope::scene::layout::{Drive, DriveWriter, Layout, Shot};

use super::{joined, make_folder, write};

pub const LAYOUT: Layout = Layout {
    name: "robotcar",
    place: |name| name.to_owned(),
    create: |root, name, drive| {
        let writer = Writer::create(root, name, drive);
        Ok(DriveWriter::new(move |shot| writer.frame(shot)))
    },
};

/// From x right, y down, z forward to the axes of the car: x forward, y right, z down; and so from the
/// drive's world to north, east, down.
const CAR_FROM_CAMERA: Matrix3<f64> = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
/// Where the drive's world begins, in the UTM zone of Oxford \[m\].
const ORIGIN: [f64; 3] = [5_735_000.0, 620_000.0, -110.0];
/// How far the lens moves every pixel \[px\].
const MOVED: (u32, u32) = (3, 2);
/// Position and roll, pitch, yaw of the INS and of the LMS at the front \[m, rad\].
const INS: [f64; 6] = [-1.7, 0.12, 1.19, -0.0125, 0.04, 0.005];
const LMS: [f64; 6] = [1.76, 0.23, 1.04, -0.0437, -1.4572, 0.0356];
/// Half the thickness of the plane that the LMS scans \[m\].
const PLANE_M: f64 = 0.03;

struct Writer {
    folder: PathBuf,
    drive: Drive,
}

fn microseconds(time_s: f64) -> u64 {
    (time_s * 1e6).round() as u64
}

fn car_from_camera() -> Pose {
    let turn = Rotation3::from_matrix_unchecked(CAR_FROM_CAMERA);
    Pose::from_parts(
        nalgebra::Translation3::identity(),
        UnitQuaternion::from_rotation_matrix(&turn),
    )
}

fn transform([x, y, z, roll, pitch, yaw]: [f64; 6]) -> Pose {
    Pose::from_parts(
        nalgebra::Translation3::new(x, y, z),
        UnitQuaternion::from_euler_angles(roll, pitch, yaw),
    )
}

fn six(pose: &Pose) -> [f64; 6] {
    let t = pose.translation.vector;
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    [t.x, t.y, t.z, roll, pitch, yaw]
}

impl Writer {
    fn create(root: &Path, name: &str, drive: Drive) -> Self {
        let folder = root.join(name);
        for part in ["stereo/centre", "ldmrs", "lms_front", "gps", "vo"] {
            make_folder(&folder.join(part));
        }
        let times = drive.times_s.iter().map(|&time| format!("{} 1\n", microseconds(time)));
        let times: String = times.collect();
        for list in ["stereo.timestamps", "ldmrs.timestamps", "lms_front.timestamps"] {
            write(&folder.join(list), &times);
        }
        let writer = Self { folder, drive };
        writer.sdk(&root.join("sdk"));
        write(&writer.folder.join("gps/ins.csv"), writer.ins());
        write(&writer.folder.join("vo/vo.csv"), writer.odometry());
        writer
    }

    fn sdk(&self, sdk: &Path) {
        let (models, extrinsics) = (sdk.join("models"), sdk.join("extrinsics"));
        make_folder(&models);
        make_folder(&extrinsics);
        let camera = &self.drive.intrinsics;
        let model = format!(
            "{}\n0 0 1 0\n1 0 0 0\n0 1 0 0\n0 0 0 1\n",
            joined(&[camera.fx, camera.fy, camera.cx, camera.cy], " ")
        );
        write(&models.join("stereo_narrow_left.txt"), model);
        let moved = |at: u32, by: u32, size: u32| f64::from((at + by).min(size - 1));
        let (width, height) = (camera.width, camera.height);
        let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let columns = pixels().map(|(x, _)| moved(x, MOVED.0, width));
        let rows = pixels().map(|(_, y)| moved(y, MOVED.1, height));
        let table: Vec<u8> = columns.chain(rows).flat_map(f64::to_le_bytes).collect();
        write(&models.join("stereo_narrow_left_distortion_lut.bin"), &table);
        let scanner = CAR_FROM_CAMERA * self.drive.scanner.coords;
        let ldmrs = [scanner.x, scanner.y, scanner.z, 0.0, 0.0, 0.0];
        for (sensor, numbers) in
            [("stereo", [0.0; 6]), ("ins", INS), ("ldmrs", ldmrs), ("lms_front", LMS)]
        {
            let text = joined(&numbers, " ") + "\n";
            write(&extrinsics.join(format!("{sensor}.txt")), text);
        }
    }

    /// The car in north, east, down.
    fn cars(&self) -> impl Iterator<Item = (u64, Pose)> {
        let origin = Pose::translation(ORIGIN[0], ORIGIN[1], ORIGIN[2]);
        let times = self.drive.times_s.iter().map(|&time| microseconds(time));
        let poses = self.drive.poses.iter();
        times.zip(
            poses.map(move |pose| origin * car_from_camera() * pose * car_from_camera().inverse()),
        )
    }

    /// The packets of all frames, and between them such as the receiver does not believe in itself.
    fn ins(&self) -> String {
        let mut text =
            "timestamp,ins_status,latitude,longitude,altitude,northing,easting,down,utm_zone,\
                        velocity_north,velocity_east,velocity_down,roll,pitch,yaw\n"
                .to_owned();
        for (time, car) in self.cars() {
            let [north, east, down, roll, pitch, yaw] = six(&(car * transform(INS)));
            let place = joined(&[north, east, down], ",");
            let angles = joined(&[roll, pitch, yaw], ",");
            text +=
                &format!("{time},INS_SOLUTION_GOOD,51.76,-1.26,110,{place},30U,0,0,0,{angles}\n");
            text +=
                &format!("{},INS_BAD_GPS_AGREEMENT,0,0,0,0,0,0,30U,0,0,0,0,0,0\n", time + 40_000);
        }
        text
    }

    fn odometry(&self) -> String {
        let mut text = "source_timestamp,destination_timestamp,x,y,z,roll,pitch,yaw\n".to_owned();
        let cars: Vec<(u64, Pose)> = self.cars().collect();
        for two in cars.windows(2) {
            let [(before, from), (after, to)] = two else {
                continue;
            };
            let moved = six(&(from.inverse() * to));
            text += &format!("{after},{before},{}\n", joined(&moved, ","));
        }
        text
    }
}

impl Writer {
    fn frame(&self, shot: &Shot<'_>) -> Result<(), SceneError> {
        let time = microseconds(self.drive.times_s[shot.index]);
        let raw = raw_photo(shot.photo);
        let path = self.folder.join(format!("stereo/centre/{time}.png"));
        raw.save(path).expect("writable");
        let scanner = CAR_FROM_CAMERA * self.drive.scanner.coords;
        let in_car = |point: &Point3<f32>| CAR_FROM_CAMERA * point.cast::<f64>().coords;
        let ldmrs = shot.scan.iter().flat_map(|(point, _)| {
            let point = in_car(point) - scanner;
            [point.x, point.y, point.z]
        });
        let bytes: Vec<u8> = ldmrs.flat_map(f64::to_le_bytes).collect();
        write(&self.folder.join(format!("ldmrs/{time}.bin")), bytes);
        let lms_from_car = transform(LMS).inverse();
        let in_plane = shot.scan.iter().filter_map(|(point, reflectance)| {
            let point = lms_from_car * Point3::from(in_car(point));
            (point.z.abs() < PLANE_M).then_some([point.x, point.y, f64::from(*reflectance)])
        });
        let bytes: Vec<u8> = in_plane.flatten().flat_map(f64::to_le_bytes).collect();
        write(&self.folder.join(format!("lms_front/{time}.bin")), bytes);
        Ok(())
    }
}

/// The photo as the sensor takes it: moved by the lens, one colour at each pixel (GBRG).
fn raw_photo(photo: &RgbImage) -> GrayImage {
    let (width, height) = photo.dimensions();
    GrayImage::from_fn(width, height, |x, y| {
        let from = (x.saturating_sub(MOVED.0), y.saturating_sub(MOVED.1));
        let channel = [[1, 2], [0, 1]][(y % 2) as usize][(x % 2) as usize];
        Luma([photo.get_pixel(from.0, from.1).0[channel]])
    })
}
