//! What a ray brings to the camera: the surface it meets, its light, and the air between.

use std::cell::Cell;

use nalgebra::{Point3, Vector3};

use super::appearance::{Appearance, Rgb};
use super::frame::Ray;
use super::headlamp::Headlamp;
use super::look::{Look, schlick};
use super::noise::{value2, value3};
use super::town::{Sight, Town};

/// How much coarser a wet road mirrors than the eye sees \[rad\].
const MIRROR_BLUR: f64 = 6e-3;

/// The light in the town at one moment.
pub(super) struct Shading<'a> {
    /// The town that is lit.
    pub(super) town: &'a Town,
    /// The weather that lights it.
    pub(super) look: &'a Look,
    /// The car's own lamps, if they are on.
    pub(super) headlamp: Option<Headlamp>,
    /// Seed of the clouds.
    pub(super) sky_seed: u32,
    /// Where something stood in the light last.
    pub(super) occluder: Cell<Option<u32>>,
}

/// Share of the light of street lamps that twigs and wires, which are not modelled, let through.
fn dappled(p: &Point3<f64>) -> f64 {
    let shadow = 4.0 * value3(&(p * 2.6), 0x7A16) - 0.6;
    1.0 - 0.7 * shadow.clamp(0.0, 1.0)
}

impl Shading<'_> {
    /// Radiance along a ray `pixel` radians wide that met what is in `sight`.
    pub(super) fn radiance(&self, ray: &Ray, sight: Option<&Sight>, pixel: f64) -> Rgb {
        let Some(sight) = sight else {
            return self.look.sky(&ray.direction, self.sky_seed);
        };
        let appearance = self.town.appearance(sight, ray, pixel, &self.look.cover);
        let surface = self.surface(ray, sight, &appearance);
        let seen = if appearance.film > 0.0 {
            let facing = -sight.normal.dot(&ray.direction);
            let share = appearance.film * schlick(facing, 0.03);
            surface * (1.0 - share) + self.mirrored(ray, sight) * share
        } else {
            surface
        };
        self.look.through_air(seen, sight.distance)
    }

    /// Radiance of a surface without what a film of water on it mirrors.
    fn surface(&self, ray: &Ray, sight: &Sight, appearance: &Appearance) -> Rgb {
        let open = self.town.openness(sight);
        let irradiance = self.irradiance(sight, open);
        self.look.radiance(
            appearance,
            &sight.point,
            &sight.normal,
            &ray.direction,
            &irradiance,
            open,
            self.sky_seed,
        )
    }

    fn irradiance(&self, sight: &Sight, open: f64) -> Rgb {
        let look = self.look;
        let shaded = look.shadows
            && sight.normal.dot(&look.key) > 0.0
            && self.town.is_shaded(sight, &look.key, &self.occluder);
        let mut sum = look.daylight(&sight.normal, open, if shaded { 0.0 } else { 1.0 });
        if look.lamps > 0.0 {
            let lamps = &self.town.lamps;
            let share = look.lamps * open * dappled(&sight.point);
            sum += lamps.irradiance(&sight.point, &sight.normal) * share;
        }
        if let Some(headlamp) = &self.headlamp {
            sum += headlamp.irradiance(&sight.point, &sight.normal) * look.headlamps;
        }
        sum
    }

    /// What wet ground mirrors. Ripples tilt the mirror, mostly seen as a stretch in height.
    fn mirrored(&self, ray: &Ray, sight: &Sight) -> Rgb {
        let ripple = |stream: u32, grain: f64| {
            let p = sight.point / grain;
            value2(p.x, p.z, self.sky_seed ^ stream)
        };
        let tilt = Vector3::new(
            0.008 * ripple(1, 0.05) + 0.006 * ripple(2, 0.4),
            1.0,
            0.008 * ripple(3, 0.05) + 0.006 * ripple(4, 0.4),
        );
        let facing = -tilt.dot(&ray.direction);
        let mut direction = ray.direction + tilt * (2.0 * facing);
        direction.y = direction.y.abs().max(0.01);
        let reflected =
            Ray { origin: sight.point + Vector3::y() * 0.01, direction: direction.normalize() };
        let met = self.town.look(&reflected, 0.02);
        let Some(met) = met else {
            return self.look.sky(&reflected.direction, self.sky_seed);
        };
        // The mirror image is as far from the eye as the whole way of the light.
        let width = MIRROR_BLUR * (1.0 + sight.distance / met.distance.max(0.5)).min(20.0);
        let appearance = self.town.appearance(&met, &reflected, width, &self.look.cover);
        let surface = self.surface(&reflected, &met, &appearance);
        self.look.through_air(surface, met.distance)
    }
}
