//! A rotating laser scanner with 64 beams.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

use super::beam::Beam;
use super::box_tree::{BoxTree, Sector};
use super::look::Look;
use super::noise::{derive, hash2, normal, unit};
use super::town::Town;
use super::world::town_ray;
use posescope_core::geometry::Pose;

/// Where the scanner is in the camera frame \[m\]: above and behind.
pub(super) const SCANNER: Point3<f64> = Point3::new(0.0, -0.08, -0.27);

const BEAMS: u32 = 64;
/// Shots per turn: 0.17° apart.
const STEPS: u32 = 2118;
/// Least and greatest range \[m\].
const RANGE: [f64; 2] = [2.7, 80.0];
/// Standard deviation of the range \[m\].
const RANGE_NOISE: f64 = 0.02;
/// Share of shots that are lost for no reason.
const LOST: f64 = 0.015;
/// Share of shots at glass that go through.
const THROUGH_GLASS: f64 = 0.9;

/// A point of a laser scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanPoint {
    /// Position in the camera frame \[m\].
    pub position: Point3<f32>,
    /// Share of the light that came back, 0 … 1.
    pub reflectance: f32,
}

/// Beams and steps of the shots that are searched for together.
const TILE: [u32; 2] = [4, 32];

/// The scan taken at a camera pose, beam after beam.
pub(super) fn scan(town: &Town, look: &Look, pose: &Pose, seed: u32) -> Vec<ScanPoint> {
    let circle: Vec<(f64, f64)> = (0..STEPS)
        .map(|step| libm::sincos(f64::from(step) / f64::from(STEPS) * std::f64::consts::TAU))
        .collect();
    let shooter = Shooter { town, look, pose, seed };
    let sides: Vec<Side> =
        circle.par_chunks(TILE[1] as usize).map(|steps| shooter.side(steps)).collect();
    (0..BEAMS)
        .into_par_iter()
        .step_by(TILE[0] as usize)
        .flat_map_iter(|first| shooter.turn(&sides, first..first + TILE[0]))
        .collect()
}

/// Directions of the shots of a beam in the camera frame.
fn bearings(beam: u32, steps: &[(f64, f64)]) -> impl Iterator<Item = Vector3<f64>> {
    let (up, level) = libm::sincos(elevation(beam).to_radians());
    steps.iter().map(move |(sin, cos)| Vector3::new(level * sin, -up, level * cos))
}

/// Elevation of a beam \[°\]: the upper 32 a third of a degree apart, the lower 32 half a degree.
fn elevation(beam: u32) -> f64 {
    let (block, index) = (beam / 32, f64::from(beam % 32) / 31.0);
    if block == 0 { 2.0 - 10.4 * index } else { -8.9 - 15.9 * index }
}

/// A scanner at a place.
struct Shooter<'a> {
    town: &'a Town,
    look: &'a Look,
    pose: &'a Pose,
    seed: u32,
}

/// What is on one side of the scanner.
struct Side<'a> {
    /// Sines and cosines of its steps.
    steps: &'a [(f64, f64)],
    solids: Arc<BoxTree>,
}

impl Shooter<'_> {
    fn side<'a>(&self, steps: &'a [(f64, f64)]) -> Side<'a> {
        let solids = self.town.solids_in(&self.beam(steps, &(0..BEAMS)));
        Side { steps, solids: Arc::new(solids) }
    }

    /// The points that a full turn of some beams yields, beam after beam.
    fn turn(&self, sides: &[Side<'_>], beams: Range<u32>) -> impl Iterator<Item = ScanPoint> {
        let mut points = vec![Vec::new(); beams.len()];
        for (first, side) in (0_u32..).step_by(TILE[1] as usize).zip(sides) {
            let sector = Sector::new(&side.solids, self.beam(side.steps, &beams));
            for (beam, points) in beams.clone().zip(&mut points) {
                for (step, bearing) in (first..).zip(bearings(beam, side.steps)) {
                    let roll = hash2(step.cast_signed(), beam.cast_signed(), self.seed);
                    points.extend(self.shoot(&sector, &bearing, roll));
                }
            }
        }
        points.into_iter().flatten()
    }

    /// All shots of these steps and beams: none is outside of those of the first and the last beam.
    fn beam(&self, steps: &[(f64, f64)], beams: &Range<u32>) -> Beam {
        let outer = [beams.start, beams.end - 1].into_iter();
        let bearings = outer.flat_map(|beam| bearings(beam, steps));
        let directions: Vec<Vector3<f64>> =
            bearings.map(|bearing| town_ray(self.pose, &SCANNER, &bearing).direction).collect();
        let origin = town_ray(self.pose, &SCANNER, &Vector3::z()).origin;
        Beam::around(origin, &directions)
    }

    /// The point that a shot in a direction of the camera frame yields, if any.
    fn shoot(&self, sector: &Sector, direction: &Vector3<f64>, roll: u32) -> Option<ScanPoint> {
        if unit(derive(roll, 1)) < LOST {
            return None;
        }
        let ray = town_ray(self.pose, &SCANNER, direction);
        let (town, look) = (self.town, self.look);
        let sight = town.look_within(sector, &ray, None)?;
        let [least, greatest] = RANGE;
        if !(least..greatest).contains(&sight.distance) {
            return None;
        }
        let appearance = town.appearance(&sight, &ray, 1.5e-3, &look.cover);
        if unit(derive(roll, 2)) < THROUGH_GLASS * appearance.glass {
            return None;
        }
        let facing = -sight.normal.dot(&ray.direction);
        let reflectance = look.infrared(&appearance);
        if unit(derive(roll, 3)) > returned(facing, reflectance, sight.distance) {
            return None;
        }
        let range = sight.distance + RANGE_NOISE * normal(derive(roll, 4));
        Some(ScanPoint {
            position: (SCANNER + direction * range).cast(),
            reflectance: reflectance as f32,
        })
    }
}

/// Probability that enough light comes back for a return.
fn returned(facing: f64, reflectance: f64, distance: f64) -> f64 {
    /// Energy at which every shot returns, in units of a white wall at 1 m.
    const ENOUGH: f64 = 6e-6;
    let energy = facing.max(0.0) * (0.05 + reflectance) / (distance * distance);
    (energy / ENOUGH).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_beams_descend_from_2_to_minus_24_8_degrees() {
        assert_eq!(elevation(0), 2.0);
        assert!((elevation(63) + 24.8).abs() < 1e-9);
        for beam in 1..BEAMS {
            let step = elevation(beam - 1) - elevation(beam);
            assert!((0.3..0.55).contains(&step), "{beam}: {step}");
        }
    }

    #[test]
    fn weak_returns_are_lost() {
        assert_eq!(returned(1.0, 0.3, 10.0), 1.0);
        assert!(returned(0.02, 0.1, 60.0) < 0.5);
        assert_eq!(returned(-0.1, 0.5, 5.0), 0.0);
    }
}
