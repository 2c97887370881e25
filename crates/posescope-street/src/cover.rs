//! What the weather lays on surfaces: snow, and water.

use nalgebra::{Point2, Point3, Vector3};

use super::appearance::{Appearance, Rgb, blend};
use super::camera_path::LANE;
use super::contact::{Contact, Part};
use super::ground::GroundContact;
use super::material::{Material, Solid};
use super::noise::{Footprint, octaves, value2};
use super::pattern::step;

/// Half the distance of a car's wheels \[m\].
const HALF_TRACK: f64 = 0.75;

/// How much snow and water lies about.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cover {
    /// Share of open ground under snow, 0 … 1.
    pub(super) snow: f64,
    /// Wetness, 0 … 1.
    pub(super) wet: f64,
}

/// A layer of snow on a pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    snow: Appearance,
    /// Share of the pixel that it covers.
    pub(super) share: f64,
}

impl Layer {
    const NONE: Self = Self {
        snow: Appearance {
            albedo: Rgb::new(0.0, 0.0, 0.0),
            gloss: 0.0,
            glass: 0.0,
            emission: Rgb::new(0.0, 0.0, 0.0),
            ledge: 0.0,
            film: 0.0,
        },
        share: 0.0,
    };

    /// What is seen where this lies on something.
    pub(super) fn over(&self, below: Appearance) -> Appearance {
        if self.share > 0.0 { below.covered(self.snow, self.share) } else { below }
    }
}

impl Cover {
    /// The snow on the ground: all over, but dark slush where cars drive, thin in the wheel tracks.
    pub(super) fn hides_ground(
        &self,
        contact: &GroundContact,
        point: &Point3<f64>,
        footprint: &Footprint,
        seed: u32,
    ) -> Layer {
        if self.snow == 0.0 {
            return Layer::NONE;
        }
        let p = Point2::new(point.x, point.z);
        let white = fresh(p, footprint, seed);
        let Some(place) = &contact.place else {
            return Layer { snow: Appearance::matt(white), share: 1.0 };
        };
        if contact.normal.y < 0.5 {
            return Layer { snow: Appearance::matt(white * 0.8), share: 0.75 * self.snow };
        }
        // Cars have driven to and fro in two pairs of ruts, pressed and soiled the snow between them.
        let from_rut = (((place.lateral - LANE).abs() - HALF_TRACK).abs() - 0.16)
            + 0.12 * value2(p.x * 0.9, p.y * 0.9, seed ^ 91);
        let edge = -0.9 - 0.3 * value2(p.x * 0.6, p.y * 0.6, seed ^ 96);
        let driven = 1.0 - step(place.from_kerb - edge, 0.4 + footprint.minor);
        let rut = driven * (1.0 - step(from_rut, 0.14 + footprint.minor));
        let slush = Rgb::new(0.185, 0.18, 0.175)
            * (1.0 + 0.2 * octaves(p, 0.5, 3, 0.7, footprint, seed ^ 92));
        let thin = 0.5 + 0.5 * octaves(p, 1.1, 3, 0.6, footprint, seed ^ 93);
        Layer {
            snow: Appearance::matt(blend(white, slush, (0.8 * driven + 0.2 * rut).min(1.0))),
            share: (1.0 - (0.15 * driven + 0.35 * rut) * thin.clamp(0.0, 1.0)) * self.snow,
        }
    }

    /// Wet ground is dark and mirrors; puddles more than the rest.
    pub(super) fn wetted_ground(
        &self,
        bare: Appearance,
        contact: &GroundContact,
        point: &Point3<f64>,
        footprint: &Footprint,
        seed: u32,
    ) -> Appearance {
        let paved = contact.place.is_some_and(|place| place.from_kerb < 2.2);
        if self.wet == 0.0 || contact.normal.y < 0.5 {
            return bare;
        }
        if !paved {
            return Appearance { albedo: bare.albedo * (1.0 - 0.35 * self.wet), ..bare };
        }
        let p = Point2::new(point.x, point.z);
        let puddle = step(octaves(p, 2.3, 3, 0.6, footprint, seed ^ 95) - 0.15, 0.5);
        Appearance {
            albedo: bare.albedo * (1.0 - (0.45 + 0.2 * puddle) * self.wet),
            film: self.wet * (0.20 + 0.60 * puddle),
            ..bare
        }
    }

    /// A solid's surface with snow where it looks up, or darkened by water.
    pub(super) fn on_solid(
        &self,
        bare: Appearance,
        solid: &Solid,
        contact: &Contact,
        point: &Point3<f64>,
        footprint: &Footprint,
    ) -> Appearance {
        if self.wet > 0.0 {
            let soaks = !matches!(solid.material, Material::Car(_) | Material::Lamp(_));
            let share = if soaks { 0.3 * self.wet } else { 0.0 };
            return Appearance { albedo: bare.albedo * (1.0 - share * (1.0 - bare.glass)), ..bare };
        }
        if self.snow == 0.0 {
            return bare;
        }
        let p = Point2::new(point.x, point.z);
        let up = contact.normal.y;
        let ragged = 0.25 * value2(p.x * 2.9, point.y * 2.9 + p.y, solid.seed);
        let lies = match (&solid.material, contact.part) {
            (Material::Leaves { .. }, _) => 0.55 * step(up - 0.15 + ragged, 0.6),
            (Material::Hedge(_), _) => step(up - 0.6 + ragged, 0.3).max(0.2),
            // The driver's last trip has blown it off the glass in part.
            (Material::Car(_), Part::Screen) => 0.7 + ragged,
            (Material::Car(_), _) => step(up - 0.5 + 0.3 * ragged, 0.12),
            _ => step(up - 0.4, 0.1),
        };
        let blown = blown(solid, point, footprint);
        // On panes it sticks and freezes.
        let frost = bare.glass * (0.55 + 0.5 * ragged);
        let share = lies.max(bare.ledge).max(blown).max(frost).clamp(0.0, 1.0) * self.snow;
        let white = fresh(p, footprint, solid.seed);
        bare.covered(Appearance::matt(white), share)
    }
}

/// Share of a wall or a sign to which snow clings, blown there by the wind: a breath of it all over,
/// and ragged patches.
///
/// The patches are why local features differ between snow and any other weather, while a bright wall
/// stays brighter than a dark one.
fn blown(solid: &Solid, p: &Point3<f64>, footprint: &Footprint) -> f64 {
    let drift = value2(1.1 * (p.x + p.z), p.y * 1.3, solid.seed ^ 97);
    let breath = 0.04 + 0.1 * drift.max(0.0);
    if matches!(solid.material, Material::Car(_)) {
        return breath;
    }
    let along_wall = Point2::new(p.x + p.z, p.y);
    let patches = octaves(along_wall, 0.42, 3, 0.8, footprint, solid.seed ^ 98);
    breath + 0.55 * step(patches - 0.36, 0.5)
}

/// Colour of fresh snow, hardly textured.
fn fresh(p: Point2<f64>, footprint: &Footprint, seed: u32) -> Vector3<f64> {
    let tone = octaves(p, 2.7, 3, 0.5, footprint, seed ^ 94);
    Rgb::new(0.80, 0.83, 0.88) * (1.0 + 0.06 * tone)
}

#[cfg(test)]
mod tests {
    use super::super::network::Place;
    use super::*;

    #[test]
    fn the_carriageway_is_slush_and_the_pavement_is_white() {
        let cover = Cover { snow: 1.0, wet: 0.0 };
        let footprint = Footprint {
            along: nalgebra::Vector2::repeat(0.02),
            slant: nalgebra::Vector2::zeros(),
            minor: 0.02,
            major: 0.05,
        };
        let mean_red = |from_kerb: f64| {
            let at = |k: u32| {
                let station = 0.37 * f64::from(k);
                let contact = GroundContact {
                    distance: 10.0,
                    normal: Vector3::y(),
                    place: Some(Place { from_kerb, street: 0, station, lateral: from_kerb + 4.4 }),
                };
                let point = Point3::new(from_kerb, 0.0, station);
                let layer = cover.hides_ground(&contact, &point, &footprint, 5);
                layer.over(Appearance::matt(Rgb::repeat(0.12))).albedo.x
            };
            (0..100).map(at).sum::<f64>() / 100.0
        };
        assert!(mean_red(1.0) > 0.7);
        assert!((0.12..0.4).contains(&mean_red(-2.5)));
    }
}
