//! Light, sky and the response of the sensor.

use nalgebra::{Point2, Point3, Vector3};

use super::appearance::{Appearance, Rgb, blend};
use super::cover::Cover;
use super::lens::Lens;
use super::noise::{Footprint, octaves, value2, value3};

/// How the town is lit, what lies on it, and how it is exposed. Shading reads nothing else of the
/// weather.
#[derive(Clone, Debug)]
pub(super) struct Look {
    /// Radiance of the sky overhead.
    pub(super) zenith: Rgb,
    /// Radiance of the sky at the horizon.
    pub(super) horizon: Rgb,
    /// Contrast of the clouds, 0 … 1.
    pub(super) clouds: f64,
    /// Irradiance of an unobstructed horizontal surface by the sky.
    pub(super) sky_light: Rgb,
    /// Irradiance of a surface that faces the ground.
    pub(super) bounce: Rgb,
    /// Where the brightest part of the sky is; unit vector.
    pub(super) key: Vector3<f64>,
    /// Irradiance from there.
    pub(super) key_light: Rgb,
    /// Whether that light is a sun's, which casts shadows.
    pub(super) shadows: bool,
    /// Radiance of the far side of the street, which glossy things mirror.
    pub(super) opposite: Rgb,
    /// Strength of street lamps; 0 when they are off.
    pub(super) lamps: f64,
    /// Strength of lit rooms and of what else shines by itself; 0 when the lights are off.
    pub(super) glow: f64,
    /// Strength of the car's own head lamps; 0 when they are off.
    pub(super) headlamps: f64,
    /// Share of the light that the air scatters away in a metre.
    pub(super) haze: f64,
    /// Radiance of the air.
    pub(super) air: Rgb,
    /// Snow and water on the surfaces.
    pub(super) cover: Cover,
    /// What the air before the lens and the lens do to the image.
    pub(super) lens: Lens,
    /// Radiance that saturates the sensor is 1 / `exposure`, by colour.
    pub(super) exposure: Rgb,
    /// Standard deviation of the sensor's noise at a middle level \[grey levels\].
    pub(super) noise: f64,
    /// Loss of light in the corners of the image, 0 … 1.
    pub(super) vignetting: f64,
}

impl Look {
    /// Radiance of the sky in a direction that points upwards.
    pub(super) fn sky(&self, direction: &Vector3<f64>, seed: u32) -> Rgb {
        let up = direction.y.max(0.0);
        let base = blend(self.horizon, self.zenith, (up * 1.8).min(1.0));
        // Clouds lie on a plane; towards the horizon they are too far away to be told apart.
        let height = up + 0.12;
        let p = Point2::new(direction.x / height, direction.z / height);
        let fine = Footprint {
            along: nalgebra::Vector2::repeat(0.01),
            slant: nalgebra::Vector2::zeros(),
            minor: 0.01,
            major: 0.01 / height,
        };
        let clouds = octaves(p, 1.3, 4, 0.5, &fine, seed);
        let sky = base * (1.0 + self.clouds * clouds * (up * 4.0).min(1.0));
        if !self.shadows {
            return sky;
        }
        // The sun dazzles: a glare around it.
        let near = direction.dot(&self.key).max(0.0);
        let square = near * near;
        let eighth = square * square * square * square;
        sky + self.key_light * (0.35 * eighth * eighth * eighth)
    }

    /// What a mirror at a point shows that reflects into a direction: the sky above the roofs, else
    /// the far side of the street, which is not traced but made up of patches of light and dark.
    fn mirrored(&self, point: &Point3<f64>, direction: &Vector3<f64>, seed: u32) -> Rgb {
        /// How far the far side is \[m\].
        const ACROSS: f64 = 11.0;
        /// Size of the patches: walls, windows, cars \[m\].
        const PATCH: f64 = 1.4;
        let there = (point + direction * ACROSS) / PATCH;
        let patch = value3(&there, 0x0FF5);
        let roofs = 0.28 + 0.16 * value2(0.2 * there.x, 0.2 * there.z, 0x0FF6);
        let above = ((direction.y - roofs) * 14.0).clamp(0.0, 1.0);
        let street = self.opposite * (1.0 + 2.2 * patch).clamp(0.15, 2.6);
        if above == 0.0 { street } else { blend(street, self.sky(direction, seed), above) }
    }

    /// Irradiance of a surface by the sky and what it lights; `open` is the share of the
    /// surroundings' light that reaches it, `sunny` that of the brightest part of the sky.
    pub(super) fn daylight(&self, normal: &Vector3<f64>, open: f64, sunny: f64) -> Rgb {
        let sky_share = 0.5 + 0.5 * normal.y;
        let key_share = normal.dot(&self.key).max(0.0) * sunny;
        (self.sky_light * sky_share + self.key_light * key_share) * open
            + self.bounce * (1.0 - sky_share)
    }

    /// Radiance of a surface under an irradiance, towards where `direction` comes from.
    #[expect(
        clippy::too_many_arguments,
        reason = "each is one thing that light depends on at one point"
    )]
    pub(super) fn radiance(
        &self,
        appearance: &Appearance,
        point: &Point3<f64>,
        normal: &Vector3<f64>,
        direction: &Vector3<f64>,
        irradiance: &Rgb,
        open: f64,
        seed: u32,
    ) -> Rgb {
        let diffuse = appearance.albedo.component_mul(irradiance) + appearance.emission * self.glow;
        if appearance.gloss < 0.05 {
            return diffuse;
        }
        let facing = -normal.dot(direction);
        let share = appearance.gloss * schlick(facing, 0.06);
        let reflected = direction + normal * (2.0 * facing);
        diffuse * (1.0 - share) + self.mirrored(point, &reflected, seed) * (share * open.max(0.3))
    }

    /// A radiance as it is after a way through the air \[m\].
    pub(super) fn through_air(&self, radiance: Rgb, way: f64) -> Rgb {
        if self.haze == 0.0 {
            return radiance;
        }
        // The inverse of the exponential's series: no platform's own exponential is called.
        let depth = self.haze * way;
        let left = 1.0 / (1.0 + depth * (1.0 + depth * (0.5 + depth / 6.0)));
        blend(self.air, radiance, left)
    }

    /// Reflectance at the wavelength of a laser scanner, 0 … 1: leaves are bright there.
    pub(super) fn infrared(&self, appearance: &Appearance) -> f64 {
        let [red, green, blue] = appearance.albedo.into();
        let leafy = (green - 0.5 * (red + blue)).max(0.0);
        (0.4 * red + 0.4 * green + 0.2 * blue + 10.0 * leafy).clamp(0.0, 1.0).sqrt()
    }

    /// The sensor's response to a radiance, in grey levels 0 … 255: the square root, steepened
    /// about the middle.
    pub(super) fn levels(&self, radiance: &Rgb) -> Vector3<f64> {
        const STEEPENING: f64 = 0.6;
        radiance.component_mul(&self.exposure).map(|r| {
            let t = r.clamp(0.0, 1.0).sqrt();
            255.0 * (t + STEEPENING * t * (1.0 - t) * (2.0 * t - 1.0))
        })
    }
}

/// Schlick's approximation of the share of light that a surface mirrors; `least` is that at
/// normal incidence.
pub(super) fn schlick(cosine: f64, least: f64) -> f64 {
    let grazing = 1.0 - cosine.clamp(0.0, 1.0);
    let fifth = grazing * grazing * grazing * grazing * grazing;
    least + (1.0 - least) * fifth
}
