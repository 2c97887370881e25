//! What the solids of the town are made of, and which of them have holes.

use nalgebra::{Point3, Vector2};

use super::appearance::{Appearance, Rgb, blend, grey};
use super::contact::{Contact, Part};
use super::facade::Facade;
use super::frame::Ray;
use super::noise::{Footprint, derive, floor, hash2, octaves, unit, value2, value3};
use super::paint;
use super::pattern::{bar, glyphs, rectangle, step, stripes};
use super::shape::Shape;
use super::walls;

/// The shape of a traffic sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sign {
    /// A disc with a red rim.
    Disc,
    /// A triangle with a red rim.
    Triangle,
    /// A blue square.
    Square,
    /// A board with letters.
    Board,
}

/// What a solid is made of.
#[derive(Clone, Debug)]
pub(super) enum Material {
    /// A wall with windows; boxed, as it is far larger than the others.
    Facade(Box<Facade>),
    /// Roof tiles.
    Tiles(Rgb),
    /// Plaster, or brick where `brick`.
    Wall {
        /// Colour of plaster or bricks.
        colour: Rgb,
        /// Whether it is of brick.
        brick: bool,
    },
    /// A clipped hedge.
    Hedge(Rgb),
    /// The leaves of a tree or a bush, or its twigs.
    Leaves {
        /// Colour of the leaves.
        colour: Rgb,
        /// Share of them that is there: 1 in summer.
        density: f64,
    },
    /// The bark of a tree.
    Bark,
    /// Something painted in one colour.
    Plain(Rgb),
    /// A lamp's head: its radiance when it is on.
    Lamp(Rgb),
    /// Red and white bands.
    Banded,
    /// A fence of vertical pickets with gaps.
    Fence(Rgb),
    /// A traffic sign.
    Sign(Sign),
    /// A parked car of this paint.
    Car(Rgb),
}

/// A solid of the town.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    /// Where its surface is.
    pub(super) shape: Shape,
    /// What it is made of.
    pub(super) material: Material,
    /// Distinguishes it from others of the same make.
    pub(super) seed: u32,
}

impl Solid {
    /// Whether a contact with the shape is with a hole of the material.
    #[inline]
    pub(super) fn has_hole(&self, contact: &Contact, ray: &Ray) -> bool {
        let (u, v) = (contact.uv.x, contact.uv.y);
        match &self.material {
            Material::Leaves { density, .. } => {
                let facing = contact.normal.dot(&ray.direction).abs();
                leaf_gap(&ray.at(contact.distance), facing, *density, self.seed)
            }
            Material::Fence(_) => {
                let rail = (0.18..0.26).contains(&v) || (0.78..0.86).contains(&v);
                let picket = u - f64::from(floor(u / 0.13)) * 0.13 < 0.07;
                contact.part != Part::Flat && !rail && !picket
            }
            Material::Sign(sign) if contact.part != Part::Flat => !inside(*sign, u, v),
            _ => false,
        }
    }

    /// How the solid looks at a contact.
    pub(super) fn appearance(
        &self,
        contact: &Contact,
        point: &Point3<f64>,
        footprint: &Footprint,
    ) -> Appearance {
        let uv = contact.uv;
        match &self.material {
            Material::Facade(facade) => walls::appearance(facade, contact.part, uv, footprint),
            Material::Tiles(colour) => tiles(*colour, contact.part, uv, footprint, self.seed),
            Material::Wall { colour, brick: false } => {
                Appearance::matt(walls::plaster(*colour, uv, footprint, self.seed))
            }
            Material::Wall { colour, .. } => {
                Appearance::matt(walls::brick(*colour, uv, footprint, self.seed))
            }
            Material::Hedge(colour) | Material::Leaves { colour, .. } => {
                leaves(*colour, contact, point, footprint, self.seed)
            }
            Material::Bark => Appearance::matt(bark(uv, footprint, self.seed)),
            Material::Plain(colour) => plain(*colour, uv, footprint, self.seed),
            Material::Lamp(radiance) => {
                Appearance { emission: *radiance, ..plain(grey(0.4), uv, footprint, self.seed) }
            }
            Material::Banded => {
                let red = stripes(uv.y, 0.5, 0.25, footprint.along.y);
                plain(blend(grey(0.7), Rgb::new(0.5, 0.03, 0.03), red), uv, footprint, self.seed)
            }
            Material::Fence(colour) => Appearance::matt(
                colour * (0.9 + 0.3 * octaves(uv.into(), 0.4, 3, 0.7, footprint, self.seed)),
            ),
            Material::Sign(sign) => sign_face(*sign, contact, footprint, self.seed),
            Material::Car(colour) => {
                paint::appearance(*colour, &self.shape, contact, footprint, self.seed)
            }
        }
    }
}

/// Whether one looks through between the leaves at a point.
///
/// Mostly a function of the point alone, as the camera and the scanner must agree on it; but a
/// clump is thin near its outline (where `facing`, the cosine of the view with the normal, is
/// small), and without more gaps there, all clumps would have smooth round edges.
fn leaf_gap(p: &Point3<f64>, facing: f64, density: f64, seed: u32) -> bool {
    let level = 0.8 * density - 0.64 - 1.5 * (0.62 - facing).max(0.0);
    let coarse = level + 0.8 * value3(&(p * 3.7), seed);
    if coarse.abs() > 1.0 {
        return coarse < 0.0;
    }
    coarse + 1.2 * value3(&(p * 11.0), seed ^ 1) < 0.0
}

fn leaves(
    colour: Rgb,
    contact: &Contact,
    p: &Point3<f64>,
    footprint: &Footprint,
    seed: u32,
) -> Appearance {
    let tone = |grain: f64, stream| {
        let contrast = footprint.contrast(grain);
        if contrast > 0.0 { contrast * value3(&(p / grain), derive(seed, stream)) } else { 0.0 }
    };
    // Leaves have edges: the noise is steepened.
    let leaf = |grain, stream| (2.2 * tone(grain, stream)).clamp(-1.0, 1.0);
    let light = 0.45 + 0.55 * contact.normal.y;
    let level =
        0.6 + 0.5 * light + 0.5 * tone(0.45, 3) + 0.5 * leaf(0.12, 4) + 0.4 * leaf(0.055, 5);
    let tint = 0.12 * tone(0.7, 6);
    let colour = colour.component_mul(&Rgb::new(1.0 + tint, 1.0, 1.0 - tint));
    Appearance::matt(colour * level.max(0.12))
}

fn bark(uv: Vector2<f64>, footprint: &Footprint, seed: u32) -> Rgb {
    let stretched = Vector2::new(uv.x, 0.25 * uv.y);
    let tone = octaves(stretched.into(), 0.12, 3, 0.8, footprint, seed);
    let blotch = octaves(uv.into(), 0.5, 2, 0.7, footprint, seed ^ 9);
    Rgb::new(0.085, 0.075, 0.06) * (1.0 + 0.45 * tone + 0.35 * blotch).max(0.2)
}

fn plain(colour: Rgb, uv: Vector2<f64>, footprint: &Footprint, seed: u32) -> Appearance {
    let tone = octaves(uv.into(), 0.6, 4, 0.7, footprint, seed);
    Appearance {
        albedo: colour * (1.0 + 0.15 * tone),
        gloss: 0.15,
        glass: 0.0,
        ..Appearance::default()
    }
}

fn tiles(
    colour: Rgb,
    part: Part,
    uv: Vector2<f64>,
    footprint: &Footprint,
    seed: u32,
) -> Appearance {
    if part == Part::Flat {
        return Appearance::matt(grey(0.16));
    }
    if part == Part::Side {
        // The gable under the roof: boards.
        let joint = stripes(uv.x, 0.16, 0.02, footprint.along.x);
        let tone = octaves(uv.into(), 0.5, 4, 0.7, footprint, seed);
        return Appearance::matt(colour.map(|c| 0.5 * c + 0.12) * (1.0 + 0.2 * tone - 0.5 * joint));
    }
    const ROW: f64 = 0.34;
    let row = floor(uv.y / ROW);
    let column = floor(uv.x / 0.28 + 0.5 * f64::from(row & 1));
    let single = (unit(hash2(column, row, seed)) - 0.5) * footprint.contrast(0.3);
    let shadow = stripes(uv.y, ROW, 0.06, footprint.along.y);
    let moss = octaves(uv.into(), 1.8, 4, 0.6, footprint, seed);
    let level = 1.0 + 0.4 * single + 0.35 * moss - 0.6 * shadow;
    Appearance::matt(colour * level.max(0.15))
}

/// Whether a point of the face of a sign (0.7 m wide and high) is inside its outline.
fn inside(sign: Sign, u: f64, v: f64) -> bool {
    match sign {
        Sign::Disc | Sign::Triangle => rim(sign, u, v) > 0.0,
        Sign::Square | Sign::Board => true,
    }
}

/// Distance inwards from the outline of a sign \[m\].
fn rim(sign: Sign, u: f64, v: f64) -> f64 {
    let x = (u - 0.35).abs();
    match sign {
        Sign::Disc => 0.35 - Vector2::new(x, v - 0.35).norm(),
        Sign::Triangle => (0.866 * (0.35 - x) - 0.5 * v + 0.035).min(v - 0.03),
        Sign::Square | Sign::Board => (0.35 - x).min(v).min(0.7 - v),
    }
}

fn sign_face(sign: Sign, contact: &Contact, footprint: &Footprint, seed: u32) -> Appearance {
    let (u, v) = (contact.uv.x, contact.uv.y);
    let (du, dv) = (footprint.along.x, footprint.along.y);
    let enamel = |albedo| Appearance { albedo, gloss: 0.2, glass: 0.0, ..Appearance::default() };
    if contact.part != Part::Front {
        return enamel(grey(0.22));
    }
    let inner = step(rim(sign, u, v) - 0.07, du.max(dv));
    let white = grey(0.68);
    let ink = glyphs(u - 0.18, 0.5 - v, 0.3, dv, seed)
        * rectangle(u, v, [0.17, 0.2, 0.55, 0.5], (du, dv));
    let red = Rgb::new(0.45, 0.02, 0.025);
    match sign {
        Sign::Disc | Sign::Triangle => {
            let field = blend(white, grey(0.03), 0.8 * ink);
            enamel(blend(red, field, inner))
        }
        Sign::Square => {
            let blue = Rgb::new(0.02, 0.08, 0.32);
            enamel(blend(white, blend(blue, white, ink), step(rim(sign, u, v) - 0.03, du)))
        }
        Sign::Board => {
            let frame = 1.0 - step(rim(sign, u, v) - 0.03, du.max(dv));
            let base = Rgb::new(
                0.1 + 0.6 * unit(derive(seed, 1)),
                0.1 + 0.6 * unit(derive(seed, 2)),
                0.1 + 0.5 * unit(derive(seed, 3)),
            );
            let lines = (0..4_u32).map(|k| {
                glyphs(u - 0.06, 0.62 - 0.15 * f64::from(k) - v, 0.1, dv, derive(seed, 10 + k))
            });
            let text = lines.sum::<f64>().min(1.0) * bar(u, 0.06, 0.62, du);
            let picture = 0.25 * value2(u * 5.0, v * 5.0, seed);
            let printed = blend(base * (1.0 + picture), grey(0.04), text);
            enamel(blend(printed, grey(0.15), frame))
        }
    }
}
