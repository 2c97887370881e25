//! The car's own head lamps: a low beam with a cut-off.

use nalgebra::{Point3, Vector3};

use super::appearance::Rgb;
use super::world::town_ray;
use posescope_core::geometry::Pose;

/// Between the two lamps, in the camera frame \[m\].
const PLACE: Point3<f64> = Point3::new(0.0, 0.95, 1.3);
/// Irradiance at 1 m in the middle of the beam.
const INTENSITY: f64 = 170.0;
const COLOUR: Rgb = Rgb::new(1.0, 0.93, 0.80);

/// The beam of a car at one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct Headlamp {
    origin: Point3<f64>,
    ahead: Vector3<f64>,
    right: Vector3<f64>,
    up: Vector3<f64>,
}

impl Headlamp {
    /// The beam of the car whose camera is at a pose.
    pub(super) fn new(pose: &Pose) -> Self {
        let beam = town_ray(pose, &PLACE, &Vector3::z());
        let right = town_ray(pose, &PLACE, &Vector3::x()).direction;
        Self {
            origin: beam.origin,
            ahead: beam.direction,
            right,
            up: -town_ray(pose, &PLACE, &Vector3::y()).direction,
        }
    }

    /// Irradiance of a surface.
    pub(super) fn irradiance(&self, p: &Point3<f64>, normal: &Vector3<f64>) -> Rgb {
        let offset = p - self.origin;
        let forward = offset.dot(&self.ahead);
        let facing = -normal.dot(&offset);
        if forward <= 0.1 || facing <= 0.0 {
            return Rgb::zeros();
        }
        let across = offset.dot(&self.right) / forward / 0.42;
        let above = offset.dot(&self.up) / forward + 0.01;
        let spread = 1.0 / (1.0 + across * across * across * across);
        let vertical = if above > 0.0 {
            // Stray light, and a soft edge.
            0.035 + 0.965 * (1.0 - above / 0.03).max(0.0)
        } else {
            let depth = above / 0.16;
            1.0 / (1.0 + depth * depth)
        };
        let square = offset.norm_squared().max(1.0);
        COLOUR * (INTENSITY * spread * vertical * facing / (square * square.sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_beam_is_below_the_cut_off_and_ahead() {
        let beam = Headlamp::new(&Pose::identity());
        let at = |y: f64, z: f64| beam.irradiance(&Point3::new(0.0, y, z), &-Vector3::z()).x;
        assert!(at(0.4, 15.0) > 5.0 * at(3.0, 15.0));
        assert!(at(0.4, 15.0) > 3.0 * at(0.4, 40.0));
        assert_eq!(at(0.4, -5.0), 0.0);
    }
}
