//! The packets of the GPS/IMU: `oxts/data/NNNNNNNNNN.txt`, 30 numbers each.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::super::SceneError;
use super::super::folder::numbered;
use super::super::gps::EARTH_RADIUS_M;
use super::super::lines::TextFile;
use crate::geometry::Pose;

/// The used parts of a packet. The frame of the IMU is x forward, y left, z up.
#[derive(Clone, Debug)]
pub(super) struct Packet {
    /// \[°\]
    latitude_deg: f64,
    /// \[°\]
    longitude_deg: f64,
    /// \[m\]
    altitude_m: f64,
    /// World from IMU, from roll, pitch, yaw \[rad\]; 0 is level and east.
    rotation: UnitQuaternion<f64>,
    /// Velocity in the frame of the IMU \[m/s\].
    pub velocity: Vector3<f64>,
    /// Angular rate about the axes of the IMU \[rad/s\].
    pub angular_rate: Vector3<f64>,
}

/// The packets of a drive by number; empty if the drive has no such folder.
pub(super) fn read(folder: &Path) -> Result<BTreeMap<usize, Packet>, SceneError> {
    let data = folder.join("data");
    if !data.is_dir() {
        return Ok(BTreeMap::new());
    }
    numbered(&data, "txt")?
        .into_iter()
        .map(|(number, path)| {
            let file = TextFile::read(&path)?;
            let [numbers] = file.rows::<1, 30>()?;
            if numbers[0].abs() >= 90.0 {
                let expected =
                    format!("a latitude below 90 degrees expected, {} found", numbers[0]);
                return Err(file.error(expected));
            }
            Ok((number, Packet::new(&numbers)))
        })
        .collect()
}

impl Packet {
    fn new(numbers: &[f64; 30]) -> Self {
        let [latitude_deg, longitude_deg, altitude_m, roll, pitch, yaw] =
            [0, 1, 2, 3, 4, 5].map(|i| numbers[i]);
        // Velocities are forward, left and up along the ground; rates are about the axes of the IMU.
        let along_ground = Vector3::new(numbers[8], numbers[9], numbers[10]);
        let ground_from_imu = UnitQuaternion::from_euler_angles(roll, pitch, 0.0);
        Self {
            latitude_deg,
            longitude_deg,
            altitude_m,
            rotation: UnitQuaternion::from_euler_angles(roll, pitch, yaw),
            velocity: ground_from_imu.inverse() * along_ground,
            angular_rate: Vector3::new(numbers[17], numbers[18], numbers[19]),
        }
    }

    /// The pose in a Mercator projection with this scale: x east, y north, z up \[m\].
    fn mercator_from_imu(&self, scale: f64) -> Pose {
        let x = scale * EARTH_RADIUS_M * self.longitude_deg.to_radians();
        let y = scale * EARTH_RADIUS_M * ((90.0 + self.latitude_deg).to_radians() / 2.0).tan().ln();
        Pose::from_parts(Translation3::new(x, y, self.altitude_m), self.rotation)
    }
}

/// The poses of the rectified camera 0 by number, in its own frame at the first packet.
pub(super) fn world_from_camera0(
    packets: &BTreeMap<usize, Packet>,
    camera0_from_imu: &Pose,
) -> BTreeMap<usize, Pose> {
    let Some((_, first)) = packets.first_key_value() else {
        return BTreeMap::new();
    };
    let scale = first.latitude_deg.to_radians().cos();
    let first_from_mercator = first.mercator_from_imu(scale).inverse();
    let imu_from_camera0 = camera0_from_imu.inverse();
    let pose = |packet: &Packet| {
        let first_from_imu = first_from_mercator * packet.mercator_from_imu(scale);
        camera0_from_imu * first_from_imu * imu_from_camera0
    };
    packets.iter().map(|(&n, packet)| (n, pose(packet))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packet(latitude_deg: f64, longitude_deg: f64, yaw: f64) -> Packet {
        let mut numbers = [0.0; 30];
        numbers[..6].copy_from_slice(&[latitude_deg, longitude_deg, 112.0, 0.0, 0.0, yaw]);
        numbers[8] = 10.0;
        Packet::new(&numbers)
    }

    #[test]
    fn a_second_of_arc_is_as_long_as_on_the_ground() {
        // One second of arc of the meridian is 30.92 m on the devkit's sphere, everywhere; one of
        // the parallel is shorter by the cosine of the latitude.
        let second: f64 = 1.0 / 3600.0;
        let length = EARTH_RADIUS_M * second.to_radians();
        for (latitude, longitude, expected) in [
            (49.0 + second, 8.0, Vector3::new(0.0, length, 0.0)),
            (49.0, 8.0 + second, Vector3::new(length * 49_f64.to_radians().cos(), 0.0, 0.0)),
        ] {
            let packets = BTreeMap::from([
                (0, packet(49.0, 8.0, 0.0)),
                (7, packet(latitude, longitude, 0.5)),
            ]);
            let poses = world_from_camera0(&packets, &Pose::identity());
            assert_eq!(poses[&0], Pose::identity());
            let moved = poses[&7].translation.vector - expected;
            assert!(moved.norm() < 1e-3, "{moved}");
            assert!((poses[&7].rotation.angle() - 0.5).abs() < 1e-12);
        }
    }

    #[test]
    fn the_velocity_is_along_the_car_when_it_drives_uphill() {
        let mut numbers = [0.0; 30];
        // Pitched up by 0.1: pitch is positive nose down, as z is up and y left.
        numbers[4] = -0.1;
        numbers[8] = 10.0 * 0.1_f64.cos();
        numbers[10] = 10.0 * 0.1_f64.sin();
        let velocity = Packet::new(&numbers).velocity;
        assert!((velocity - Vector3::new(10.0, 0.0, 0.0)).norm() < 1e-12);
    }
}
