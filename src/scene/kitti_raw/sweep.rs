//! The motion of the car during one turn of the scanner, about 1.2 m at 12 m/s.

use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};

use super::oxts::Packet;
use crate::geometry::Pose;

/// The default duration of a sweep \[s\]: the scanner turns ten times per second.
pub(super) const USUAL_S: f64 = 0.1;

/// The motion of the car during a sweep, constant as in the packet of the frame.
///
/// The scanner turns clockwise seen from above, and faces forward when the photo is taken. Points on the left are
/// therefore measured before the photo, points on the right after it.
#[derive(Clone, Debug)]
pub(super) struct Sweep {
    duration_s: f64,
    /// In the frame of the IMU \[m/s\].
    velocity: Vector3<f64>,
    /// About the axes of the IMU \[rad/s\].
    angular_rate: Vector3<f64>,
}

impl Sweep {
    /// A sweep of a duration \[s\]; an implausible duration is replaced by the default.
    pub fn new(packet: &Packet, duration_s: f64) -> Self {
        let is_likely = (0.02..0.5).contains(&duration_s);
        Self {
            duration_s: if is_likely { duration_s } else { USUAL_S },
            velocity: packet.velocity,
            angular_rate: packet.angular_rate,
        }
    }

    /// The point as measured from the position of the scanner at the time of the photo.
    pub fn corrected(&self, point: &Point3<f64>, velodyne_from_imu: &Pose) -> Point3<f64> {
        let azimuth = point.y.atan2(point.x);
        let time_s = -azimuth / std::f64::consts::TAU * self.duration_s;
        let photo_from_then = self.imu_motion(time_s);
        velodyne_from_imu * (photo_from_then * (velodyne_from_imu.inverse() * point))
    }

    /// The IMU at the photo from the IMU `time_s` later.
    fn imu_motion(&self, time_s: f64) -> Pose {
        // The velocity turns with the car; half-way it equals the mean to second order.
        let half_way = UnitQuaternion::from_scaled_axis(self.angular_rate * (time_s / 2.0));
        Pose::from_parts(Translation3::from(half_way * self.velocity * time_s), half_way * half_way)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    const SWEEP: Sweep = Sweep {
        duration_s: 0.1,
        velocity: Vector3::new(12.0, 0.0, 0.0),
        angular_rate: Vector3::new(0.0, 0.0, 0.0),
    };

    #[test]
    fn what_is_ahead_stays_and_what_is_beside_moves_by_a_quarter_of_the_way() {
        let corrected = |x, y| SWEEP.corrected(&Point3::new(x, y, 1.0), &Pose::identity());
        assert_eq!(corrected(10.0, 0.0), Point3::new(10.0, 0.0, 1.0));
        // The left was measured 25 ms before the photo, when the car was 0.3 m farther back.
        let left = corrected(0.0, 5.0) - Point3::new(-0.3, 5.0, 1.0);
        let right = corrected(0.0, -5.0) - Point3::new(0.3, -5.0, 1.0);
        assert!(left.norm() < 1e-12 && right.norm() < 1e-12);
    }

    #[test]
    fn a_wall_that_is_scanned_from_a_turning_car_is_straight_again() {
        let sweep = Sweep { angular_rate: Vector3::new(0.0, 0.0, 0.4), ..SWEEP };
        let velodyne_from_imu = Pose::from_parts(
            Translation3::new(-0.8, 0.3, -0.8),
            UnitQuaternion::from_euler_angles(0.0, 0.0, 0.01),
        );
        // Points of a wall on the left as the scanner sees them on its way: found by iterating the
        // time at which it faces them.
        for step in 0..40 {
            let on_wall = Point3::new(-10.0 + 0.5 * f64::from(step), 6.0, 0.5);
            let mut azimuth = FRAC_PI_2;
            let mut seen = on_wall;
            for _ in 0..30 {
                let time_s = -azimuth / std::f64::consts::TAU * sweep.duration_s;
                let motion = sweep.imu_motion(time_s);
                let photo_from_then = velodyne_from_imu * motion * velodyne_from_imu.inverse();
                seen = photo_from_then.inverse() * on_wall;
                azimuth = seen.y.atan2(seen.x);
            }
            assert!((seen - on_wall).norm() > 0.05);
            let error = sweep.corrected(&seen, &velodyne_from_imu) - on_wall;
            assert!(error.norm() < 1e-6, "{error}");
        }
    }

    #[test]
    fn the_motion_is_the_integral_of_the_velocities() {
        let sweep = Sweep { angular_rate: Vector3::new(0.02, -0.03, 0.5), ..SWEEP };
        let steps = 10_000;
        let time_s = 0.05;
        let step_s = time_s / f64::from(steps);
        let step = Pose::from_parts(
            Translation3::from(sweep.velocity * step_s),
            UnitQuaternion::from_scaled_axis(sweep.angular_rate * step_s),
        );
        let integral = (0..steps).fold(Pose::identity(), |pose, _| pose * step);
        let difference = integral.inverse() * sweep.imu_motion(time_s);
        assert!(difference.translation.vector.norm() < 1e-4);
        assert!(difference.rotation.angle() < 1e-9);
    }
}
