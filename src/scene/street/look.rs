//! Light, sky and the response of the sensor.

use nalgebra::{Point2, Vector3};

use super::material::{Appearance, Rgb, blend, grey};
use super::noise::{Footprint, octaves};

/// How the town is lit and exposed. Shading reads nothing else of the weather.
#[derive(Clone, Debug)]
pub(super) struct Look {
    /// Radiance of the sky overhead.
    zenith: Rgb,
    /// Radiance of the sky at the horizon.
    horizon: Rgb,
    /// Contrast of the clouds, 0 … 1.
    clouds: f64,
    /// Irradiance of an unobstructed horizontal surface by the sky.
    sky_light: Rgb,
    /// Irradiance of a surface that faces the ground.
    bounce: Rgb,
    /// Where the brightest part of the sky is; unit vector.
    key: Vector3<f64>,
    /// Irradiance from there.
    key_light: Rgb,
    /// Radiance that saturates the sensor is 1 / `exposure`.
    exposure: f64,
    /// Standard deviation of the sensor's noise \[grey levels\].
    pub(super) noise: f64,
    /// Loss of light in the corners of the image, 0 … 1.
    pub(super) vignetting: f64,
}

impl Look {
    /// An even grey-blue sky with soft clouds; nearly no shadows.
    pub(super) fn overcast() -> Self {
        Self {
            zenith: Rgb::new(0.44, 0.52, 0.64),
            horizon: Rgb::new(0.66, 0.70, 0.75),
            clouds: 0.30,
            sky_light: Rgb::new(0.86, 0.90, 0.95),
            bounce: Rgb::new(0.10, 0.10, 0.09),
            key: Vector3::new(0.48, 0.64, 0.6),
            key_light: Rgb::new(0.50, 0.48, 0.44),
            exposure: 1.12,
            noise: 1.5,
            vignetting: 0.12,
        }
    }

    /// Radiance of the sky in a direction that points upwards.
    pub(super) fn sky(&self, direction: &Vector3<f64>, seed: u32) -> Rgb {
        let up = direction.y.max(0.0);
        let base = blend(self.horizon, self.zenith, (up * 1.8).min(1.0));
        // Clouds lie on a plane; towards the horizon they are too far away to be told apart.
        let height = up + 0.12;
        let p = Point2::new(direction.x / height, direction.z / height);
        let fine = Footprint {
            along: nalgebra::Vector2::repeat(0.01),
            minor: 0.01,
            major: 0.01 / height,
        };
        let clouds = octaves(p, 1.3, 4, 0.5, &fine, seed);
        base * (1.0 + self.clouds * clouds * (up * 4.0).min(1.0))
    }

    /// What a mirror shows that reflects into a direction: the sky above the roofs, else the
    /// far side of the street, which is not traced but made up.
    fn mirrored(&self, direction: &Vector3<f64>, seed: u32) -> Rgb {
        let above = ((direction.y - 0.28) * 8.0).clamp(0.0, 1.0);
        let street = grey(0.09 + 0.1 * direction.y.max(0.0));
        if above == 0.0 {
            street
        } else {
            blend(street, self.sky(direction, seed), above)
        }
    }

    /// Radiance of a surface towards where `direction` comes from; `open` is the share of the
    /// surroundings' light that reaches it.
    pub(super) fn radiance(
        &self,
        appearance: &Appearance,
        normal: &Vector3<f64>,
        direction: &Vector3<f64>,
        open: f64,
        seed: u32,
    ) -> Rgb {
        let sky_share = 0.5 + 0.5 * normal.y;
        let key_share = normal.dot(&self.key).max(0.0);
        let irradiance = (self.sky_light * sky_share + self.key_light * key_share) * open
            + self.bounce * (1.0 - sky_share);
        let diffuse = appearance.albedo.component_mul(&irradiance);
        if appearance.gloss < 0.05 {
            return diffuse;
        }
        let facing = -normal.dot(direction);
        let grazing = 1.0 - facing.clamp(0.0, 1.0);
        let fifth = grazing * grazing * grazing * grazing * grazing;
        let share = appearance.gloss * (0.06 + 0.94 * fifth);
        let reflected = direction + normal * (2.0 * facing);
        diffuse * (1.0 - share) + self.mirrored(&reflected, seed) * (share * open.max(0.3))
    }

    /// Reflectance at the wavelength of a laser scanner, 0 … 1: leaves are bright there.
    pub(super) fn infrared(&self, appearance: &Appearance) -> f64 {
        let [red, green, blue] = appearance.albedo.into();
        let leafy = (green - 0.5 * (red + blue)).max(0.0);
        (0.4 * red + 0.4 * green + 0.2 * blue + 10.0 * leafy)
            .clamp(0.0, 1.0)
            .sqrt()
    }

    /// The sensor's response to a radiance, in grey levels 0 … 255: the square root, steepened
    /// about the middle.
    pub(super) fn levels(&self, radiance: &Rgb) -> Vector3<f64> {
        const STEEPENING: f64 = 0.6;
        radiance.map(|r| {
            let t = (self.exposure * r).clamp(0.0, 1.0).sqrt();
            255.0 * (t + STEEPENING * t * (1.0 - t) * (2.0 * t - 1.0))
        })
    }
}
