//! The look of parked cars.

use super::appearance::{Appearance, Rgb, blend, grey};
use super::contact::{Contact, Part};
use super::noise::{Footprint, derive, octaves, unit, value2};
use super::pattern::{bar, glyphs, rectangle, step};
use super::shape::Shape;

use super::car::CarShape;

/// How a car of this paint looks at a contact; black where the shape is no car.
pub(super) fn appearance(
    colour: Rgb,
    shape: &Shape,
    contact: &Contact,
    footprint: &Footprint,
    seed: u32,
) -> Appearance {
    let Shape::Car { shape: car, .. } = shape else {
        return Appearance::matt(grey(0.0));
    };
    let dirt = octaves(contact.uv.into(), 0.8, 3, 0.6, footprint, seed);
    let paint = Appearance {
        albedo: colour * (1.0 + 0.08 * dirt),
        gloss: 0.8,
        glass: 0.0,
        ..Appearance::default()
    };
    match contact.part {
        Part::Pane | Part::Screen => {
            paint.covered(glass(contact, seed), window(car, contact, footprint))
        }
        Part::Tread => rubber(),
        Part::Wheel => wheel(contact, footprint, seed),
        Part::Flank => flank(above_skirt(paint, contact, footprint), car, contact, footprint),
        Part::Nose | Part::Tail => {
            face(above_skirt(paint, contact, footprint), car, contact, footprint, seed)
        }
        _ => paint,
    }
}

fn width(footprint: &Footprint) -> (f64, f64) {
    (footprint.along.x, footprint.along.y)
}

/// Tinted glass, with the vague shapes of seats behind it.
fn glass(contact: &Contact, seed: u32) -> Appearance {
    let inside = value2(contact.uv.x * 3.1, contact.uv.y * 4.3, seed);
    Appearance {
        albedo: grey(0.006 + 0.04 * inside.max(0.0)),
        gloss: 0.85,
        glass: 1.0,
        ..Appearance::default()
    }
}

/// A matt near-black: gaps and shadows.
fn black() -> Appearance {
    Appearance::matt(grey(0.012))
}

fn trim() -> Appearance {
    Appearance { albedo: grey(0.03), gloss: 0.2, glass: 0.0, ..Appearance::default() }
}

fn rubber() -> Appearance {
    Appearance::matt(grey(0.018))
}

/// The body with its lowest part of dark plastic.
fn above_skirt(paint: Appearance, contact: &Contact, footprint: &Footprint) -> Appearance {
    paint.covered(trim(), 1.0 - step(contact.uv.y - 0.33, footprint.along.y))
}

/// Share of glass above the belt line.
fn window(car: &CarShape, contact: &Contact, footprint: &Footprint) -> f64 {
    let (u, v) = (contact.uv.x, contact.uv.y);
    let (du, dv) = width(footprint);
    let rise = (v - car.belt()) / (car.height() - car.belt());
    let tall = bar(v, car.belt() + 0.04, car.height() - 0.1, dv);
    if contact.part == Part::Screen {
        let reach = 0.5 * car.width() - 0.12 - 0.12 * rise;
        return tall * bar(u, -reach, reach, du);
    }
    // Pillars lean: the panes are narrower at the top.
    let reach = 0.5 * car.length() * (0.98 - 0.2 * rise);
    let pillars = bar(u, 0.10, 0.18, du) + bar(u, -0.83, -0.75, du) + bar(u, 0.95, 0.99, du);
    tall * bar(u, -reach, reach, du) * (1.0 - pillars.min(1.0))
}

fn flank(base: Appearance, car: &CarShape, contact: &Contact, footprint: &Footprint) -> Appearance {
    let (u, v) = (contact.uv.x, contact.uv.y);
    let widths = width(footprint);
    let arch = 1.0 - step(car.hub_distance(u, v) - 1.14, footprint.minor / 0.3);
    let gap = |at: f64| bar(u, at, at + 0.02, widths.0);
    let doors = (gap(0.93) + gap(-0.13) + gap(-1.0)) * step(v - 0.35, widths.1);
    let handles = rectangle(u, v, [0.0, 0.74, 0.2, 0.78], widths)
        + rectangle(u, v, [-0.95, 0.74, -0.75, 0.78], widths);
    let moulding = bar(v, 0.5, 0.56, widths.1);
    base.covered(trim(), 0.7 * moulding)
        .covered(black(), doors.min(1.0))
        .covered(trim(), handles.min(1.0))
        .covered(black(), arch)
}

/// The front or rear: lamps, number plate, grille or boot lid.
fn face(
    base: Appearance,
    car: &CarShape,
    contact: &Contact,
    footprint: &Footprint,
    seed: u32,
) -> Appearance {
    let (u, v) = (contact.uv.x, contact.uv.y);
    let widths = width(footprint);
    let nose = contact.part == Part::Nose;
    let edge = 0.5 * car.width();
    let lamps = {
        let inner = if nose { 0.42 } else { 0.25 };
        let (low, high) = if nose { (0.56, 0.72) } else { (0.62, 0.84) };
        rectangle(u.abs(), v, [edge - inner, low, edge - 0.04, high], widths)
    };
    let lamp = Appearance {
        albedo: if nose { grey(0.35) } else { Rgb::new(0.3, 0.012, 0.012) },
        gloss: 0.8,
        glass: 0.0,
        ..Appearance::default()
    };
    let low = if nose { 0.36 } else { 0.5 + 0.2 * unit(derive(seed, 7)) };
    let plate = rectangle(u, v, [-0.26, low, 0.26, low + 0.11], widths);
    let letters = glyphs(0.22 - u, low + 0.095 - v, 0.085, widths.1, derive(seed, 8))
        * bar(u, -0.22, 0.22, widths.0);
    let number = Appearance::matt(blend(grey(0.68), grey(0.02), letters));
    let bumper = bar(v, 0.33, 0.48, widths.1);
    let grille = if nose {
        rectangle(u, v, [-0.42, 0.58, 0.42, 0.7], widths)
    } else {
        // The gap around the boot lid.
        bar(u.abs(), 0.62, 0.635, widths.0) * step(v - 0.5, widths.1)
    };
    base.covered(Appearance::matt(grey(0.05)), 0.35 * bumper)
        .covered(black(), grille)
        .covered(lamp, lamps)
        .covered(number, plate)
}

fn wheel(contact: &Contact, footprint: &Footprint, seed: u32) -> Appearance {
    let (z, y) = (contact.uv.x, contact.uv.y);
    let radius = contact.uv.norm();
    let width = footprint.minor / 0.32;
    let rim = 1.0 - step(radius - 0.66, width);
    // Spokes: sectors around the hub, by the sign of sin 5φ, as a polynomial in y and z.
    let (y2, z2) = (y * y, z * z);
    let sine =
        y * (5.0 * z2 * z2 - 10.0 * z2 * y2 + y2 * y2) / (radius * (y2 + z2) * (y2 + z2)).max(1e-6);
    let open = step(sine - 0.1, width * 5.0) * bar(radius, 0.22, 0.55, width);
    let metal = Appearance {
        albedo: grey(0.2 + 0.2 * unit(derive(seed, 9))),
        gloss: 0.5,
        glass: 0.0,
        ..Appearance::default()
    };
    rubber().covered(metal, rim).covered(black(), open * rim)
}
