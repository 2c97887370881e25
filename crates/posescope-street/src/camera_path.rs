//! The journey: where the camera is at every frame.

use nalgebra::{Quaternion, Translation3, Unit, UnitQuaternion, Vector3};

use super::network::Network;
use super::noise::{derive, unit, value1};
use posescope_core::geometry::Pose;

/// Height of the camera above the road \[m\].
pub(super) const CAMERA_HEIGHT: f64 = 1.65;
/// Distance to the right of the street's axis that a driver keeps \[m\].
pub(super) const LANE: f64 = 0.7;
/// Aimed distance of two frames \[m\].
const STRIDE: f64 = 1.0;

/// The poses of the frames, `world_from_camera`.
pub(super) fn poses(network: &Network, traversal: u32) -> Vec<Pose> {
    let length = network.circuit.length();
    let count = (length / STRIDE).floor();
    (0..count as u32)
        .map(|frame| pose(network, f64::from(frame) * length / count, traversal))
        .collect()
}

fn pose(network: &Network, along: f64, traversal: u32) -> Pose {
    let wobble = |wavelength: f64, amplitude: f64, stream: u32| {
        amplitude * value1(along / wavelength, derive(traversal, stream))
    };
    // No two drivers keep quite the same line, and no two cameras sit quite alike.
    let habit =
        |amplitude: f64, stream: u32| amplitude * (2.0 * unit(derive(traversal, stream)) - 1.0);
    let here = network.circuit.at(along);
    let plan = here.beside(LANE + habit(0.06, 6) + wobble(18.0, 0.10, 1));
    let height = wobble(3.1, 0.025, 2);
    let heading = libm::atan2(here.heading.x, here.heading.y);
    let heading = heading + habit(0.004, 7) + wobble(9.0, 0.005, 3);
    let pitch = wobble(3.7, 0.007, 4);
    let roll = wobble(5.3, 0.007, 5);
    // World y points down and is 0 at the camera's nominal height.
    Pose::from_parts(
        Translation3::new(plan.x, -height, plan.y),
        turn(Vector3::y_axis(), heading)
            * turn(Vector3::x_axis(), pitch)
            * turn(Vector3::z_axis(), roll),
    )
}

/// A turn about an axis, the same to the last bit on every platform.
fn turn(axis: Unit<Vector3<f64>>, angle: f64) -> UnitQuaternion<f64> {
    let (sin, cos) = libm::sincos(0.5 * angle);
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cos, axis.into_inner() * sin))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_a_metre_apart_and_the_camera_is_nearly_level() {
        let poses = poses(&Network::new(1), 5);
        assert!(poses.len() > 600);
        assert!(poses[0].translation.vector.norm() < 1.0);
        for (a, b) in poses.iter().zip(poses.iter().cycle().skip(1)) {
            let step = (b.translation.vector - a.translation.vector).norm();
            assert!((0.7..1.3).contains(&step), "{step}");
            let forward = a.rotation * Vector3::z();
            assert!(forward.y.abs() < 0.6_f64.to_radians());
            assert!((a.rotation * Vector3::x()).y.abs() < 0.6_f64.to_radians());
            assert!(a.translation.vector.y.abs() < 0.03);
            // The car drives where it looks.
            let travel = (b.translation.vector - a.translation.vector) / step;
            assert!(travel.dot(&forward) > 0.98);
        }
    }
}
