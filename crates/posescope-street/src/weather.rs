//! The five conditions: what each means for light, surfaces, sensor and trees.

use nalgebra::Vector3;

use super::appearance::{Rgb, grey};
use super::condition::Condition;
use super::cover::Cover;
use super::lens::Lens;
use super::look::Look;

/// What trees bear.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Season {
    /// Trees bear leaves.
    Summer,
    /// Trees are bare.
    Winter,
}

impl Condition {
    /// The season in which a traversal takes place.
    pub(super) fn season(self) -> Season {
        match self {
            Self::Snow => Season::Winter,
            Self::Overcast | Self::Sun | Self::Night | Self::Rain => Season::Summer,
        }
    }

    /// How the town looks.
    pub(super) fn look(self) -> Look {
        match self {
            Self::Overcast => overcast(),
            Self::Sun => sun(),
            Self::Night => night(),
            Self::Rain => rain(),
            Self::Snow => snow(),
        }
    }
}

/// An even grey-blue sky with soft clouds; nearly no shadows.
fn overcast() -> Look {
    Look {
        zenith: Rgb::new(0.44, 0.52, 0.64),
        horizon: Rgb::new(0.66, 0.70, 0.75),
        clouds: 0.30,
        sky_light: Rgb::new(0.86, 0.90, 0.95),
        bounce: Rgb::new(0.10, 0.10, 0.09),
        key: Vector3::new(0.48, 0.64, 0.6),
        key_light: Rgb::new(0.50, 0.48, 0.44),
        shadows: false,
        opposite: grey(0.14),
        lamps: 0.0,
        glow: 0.0,
        headlamps: 0.0,
        haze: 0.0,
        air: Rgb::zeros(),
        cover: Cover::default(),
        lens: Lens::default(),
        exposure: grey(1.12),
        noise: 3.0,
        vignetting: 0.12,
    }
}

/// A low sun obliquely over the streets: half of everything in blue shadow, the rest dazzling.
fn sun() -> Look {
    Look {
        zenith: Rgb::new(0.16, 0.30, 0.62),
        horizon: Rgb::new(0.62, 0.70, 0.80),
        clouds: 0.12,
        sky_light: Rgb::new(0.30, 0.37, 0.50),
        bounce: Rgb::new(0.13, 0.11, 0.08),
        key: Vector3::new(-0.7, 0.5, -0.51),
        key_light: Rgb::new(2.00, 1.68, 1.22),
        shadows: true,
        opposite: Rgb::new(0.16, 0.15, 0.13),
        exposure: Rgb::new(1.75, 1.70, 1.62),
        noise: 2.0,
        ..overcast()
    }
}

/// Sodium lamps, a few lit windows and the car's own beam; high gain, wide aperture.
fn night() -> Look {
    Look {
        zenith: Rgb::new(0.004, 0.005, 0.010),
        horizon: Rgb::new(0.022, 0.017, 0.014),
        clouds: 0.5,
        sky_light: Rgb::new(0.300, 0.235, 0.170),
        bounce: Rgb::new(0.080, 0.058, 0.036),
        key_light: Rgb::zeros(),
        opposite: Rgb::new(0.020, 0.015, 0.010),
        lamps: 0.32,
        glow: 1.0,
        headlamps: 0.2,
        haze: 0.002,
        air: Rgb::new(0.020, 0.015, 0.010),
        lens: Lens { motion: 0.35, blur: 6, glare: 0.25, ..Lens::default() },
        exposure: Rgb::new(2.00, 1.80, 1.60),
        noise: 20.0,
        vignetting: 0.45,
        ..overcast()
    }
}

/// A low dark sky, wet ground, rain in the air and on the lens.
fn rain() -> Look {
    Look {
        zenith: Rgb::new(0.34, 0.37, 0.41),
        horizon: Rgb::new(0.44, 0.46, 0.49),
        clouds: 0.2,
        sky_light: Rgb::new(0.58, 0.61, 0.65),
        bounce: Rgb::new(0.07, 0.07, 0.07),
        key_light: Rgb::new(0.16, 0.16, 0.15),
        opposite: grey(0.07),
        haze: 0.005,
        air: Rgb::new(0.40, 0.42, 0.45),
        cover: Cover { snow: 0.0, wet: 1.0 },
        lens: Lens { drops: 28, streaks: 700, ..Lens::default() },
        exposure: grey(1.15),
        noise: 3.5,
        vignetting: 0.15,
        ..overcast()
    }
}

/// Everything white below a white sky.
fn snow() -> Look {
    Look {
        zenith: Rgb::new(0.66, 0.68, 0.72),
        horizon: Rgb::new(0.74, 0.76, 0.79),
        clouds: 0.1,
        sky_light: Rgb::new(0.62, 0.65, 0.70),
        bounce: Rgb::new(0.36, 0.37, 0.39),
        key_light: Rgb::new(0.14, 0.14, 0.13),
        opposite: grey(0.34),
        glow: 0.7,
        haze: 0.003,
        air: Rgb::new(0.66, 0.68, 0.71),
        cover: Cover { snow: 1.0, wet: 0.0 },
        lens: Lens { flakes: 1800, ..Lens::default() },
        exposure: grey(1.30),
        noise: 2.0,
        ..overcast()
    }
}
