//! How a point of a surface looks, whatever the light: its colours, its gloss, what it lets through.

use nalgebra::Vector3;

/// A colour, linear, red green blue, 0 … 1.
pub(super) type Rgb = Vector3<f64>;

/// A grey.
pub(super) fn grey(level: f64) -> Rgb {
    Rgb::repeat(level)
}

/// `a` where `share` is 0, `b` where it is 1.
#[inline]
pub(super) fn blend(a: Rgb, b: Rgb, share: f64) -> Rgb {
    a + (b - a) * share
}

/// How a point of a surface looks, whatever the light.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Appearance {
    /// Diffuse reflectance.
    pub(super) albedo: Rgb,
    /// Strength of the mirror-like reflection, 0 … 1.
    pub(super) gloss: f64,
    /// Share of glass in the pixel: light of a laser goes through.
    pub(super) glass: f64,
    /// Radiance of its own when lights are on.
    pub(super) emission: Rgb,
    /// Share of ledges too small to be solids, on which snow lies.
    pub(super) ledge: f64,
    /// Strength of a film of water that mirrors the surroundings, 0 … 1.
    pub(super) film: f64,
}

impl Appearance {
    /// A matt surface.
    pub(super) fn matt(albedo: Rgb) -> Self {
        Self { albedo, ..Self::default() }
    }

    /// This with `share` of it covered by `over`.
    pub(super) fn covered(self, over: Self, share: f64) -> Self {
        Self {
            albedo: blend(self.albedo, over.albedo, share),
            gloss: self.gloss + (over.gloss - self.gloss) * share,
            glass: self.glass + (over.glass - self.glass) * share,
            emission: blend(self.emission, over.emission, share),
            ledge: self.ledge + (over.ledge - self.ledge) * share,
            film: self.film + (over.film - self.film) * share,
        }
    }
}
