//! What stands between the houses: garden boundaries, trees, lamps, signs, bins and parked cars.

use nalgebra::{Point2, Point3, Vector2};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

use super::appearance::{Rgb, grey};
use super::car::CarShape;
use super::frame::Frame;
use super::lamps;
use super::material::{Material, Sign};
use super::network::{HALF_WIDTH, PAVEMENT};
use super::path::{Station, right_of};
use super::plot::{Builder, Plot};
use super::shape::Shape;
use super::weather::Season;

/// Distance of parked cars' middles from the kerb \[m\].
const PARKED: f64 = 1.08;
/// No car is parked nearer to a crossing \[m\].
const NO_PARKING: f64 = 17.0;

/// Places everything but the cars; leaves are those of the traversal.
pub(super) fn place(builder: &mut Builder, traversal: u32) {
    for street in 0..builder.network.streets.len() {
        for side in [-1.0, 1.0] {
            boundaries(builder, street, side, traversal);
            kerbside(builder, street, side, traversal);
        }
        lamps(builder, street);
    }
    background(builder, traversal);
}

/// The station on a street's axis, and how far the next crossing is.
fn station(builder: &Builder, street: usize, along: f64) -> (Station, f64) {
    let street = &builder.network.streets[street];
    (street.axis.at(along), street.to_crossing(along))
}

/// Walls, hedges and fences along the pavement, wherever no house stands there.
fn boundaries(builder: &mut Builder, street: usize, side: f64, traversal: u32) {
    let length = builder.network.streets[street].axis.length();
    let mut along = 0.0;
    while along < length {
        let run = builder.rng.random_range(6.0..16.0);
        let kind = builder.rng.random_range(0..5_u32);
        let height = builder.rng.random_range(0.8..1.9);
        let seed: u32 = builder.rng.random();
        let pieces = (run / 2.0) as u32;
        for piece in 0..pieces {
            let (middle, _) = station(builder, street, along + 2.0 * f64::from(piece) + 1.0);
            let plot = Plot {
                centre: middle.beside(side * (HALF_WIDTH + PAVEMENT + 0.25)),
                ahead: right_of(middle.heading) * -side,
                half: Vector2::new(1.02, 0.12),
            };
            if builder.is_free(&plot, PAVEMENT + 0.05) {
                boundary(builder, plot, kind, height, seed.wrapping_add(piece), traversal);
            }
            match builder.rng.random_range(0..10_u32) {
                0..=3 => bush(builder, plot.at(0.0, -1.2), traversal),
                4..=6 => garden_tree(builder, plot.at(0.0, -1.6), traversal),
                _ => (),
            }
        }
        // A gap to drive or walk through.
        along += 2.0 * f64::from(pieces) + builder.rng.random_range(1.0..3.2);
    }
}

fn boundary(builder: &mut Builder, plot: Plot, kind: u32, height: f64, seed: u32, traversal: u32) {
    builder.shade(plot, 0.6, 0.45);
    match kind {
        0 | 1 => {
            let green = Rgb::new(0.035, 0.06, 0.02);
            let thick =
                Plot { half: Vector2::new(1.02, 0.35), centre: plot.at(0.0, -0.25), ..plot };
            builder.add_block(&thick, [0.0, height], Material::Hedge(green), seed);
            // Shoots that the shears have missed since.
            for k in 0..3 {
                let x = builder.rng.random_range(-0.9..0.9);
                let at = thick.at(x, builder.rng.random_range(0.0..0.3));
                let radius = builder.rng.random_range(0.3..0.55);
                let level = height * builder.rng.random_range(0.35..1.0);
                let centre = Point3::new(at.x, level, at.y);
                let tone = green * builder.rng.random_range(0.8..1.8);
                let season = seed.wrapping_add(k) ^ traversal;
                clump(builder, centre, radius, tone, season);
            }
        }
        2 => {
            let colour = Rgb::new(0.36, 0.33, 0.28);
            let material = Material::Wall { colour, brick: seed & 64 == 0 };
            builder.add_block(&plot, [0.0, 0.75 * height], material, seed);
            let coping = Plot { half: plot.half + Vector2::new(0.0, 0.05), ..plot };
            let top = [0.75 * height, 0.75 * height + 0.07];
            builder.add_block(&coping, top, Material::Plain(grey(0.25)), seed);
        }
        _ => {
            let thin = Plot { half: Vector2::new(1.0, 0.02), ..plot };
            let brown = Rgb::new(0.13, 0.09, 0.06);
            builder.add_block(&thin, [0.1, 1.1], Material::Fence(brown), seed);
        }
    }
}

/// Trees, lamps, signs, bollards and bins on the pavement.
fn kerbside(builder: &mut Builder, street: usize, side: f64, traversal: u32) {
    let length = builder.network.streets[street].axis.length();
    let mut along = 4.0;
    let leafy = builder.rng.random_bool(0.8);
    while along < length {
        let (here, to_crossing) = station(builder, street, along);
        let foot = here.beside(side * (HALF_WIDTH + 0.55));
        if (0.3..PAVEMENT).contains(&builder.network.kerb_distance(foot)) {
            match builder.rng.random_range(0..10_u32) {
                0..=4 if leafy && to_crossing > 12.0 => tree(builder, foot, 1.0, traversal),
                5..=7 => sign(builder, foot, here.heading * -side),
                8 => bollards(builder, &here, side),
                _ => bin(builder, here.beside(side * (HALF_WIDTH + PAVEMENT - 0.45))),
            }
        }
        along += builder.rng.random_range(5.0..10.0);
    }
}

/// Lamps along a street, on alternating sides.
fn lamps(builder: &mut Builder, street: usize) {
    const SPACING: f64 = 24.0;
    let length = builder.network.streets[street].axis.length();
    let count = (length / SPACING).floor().max(1.0);
    for k in 0..count as u32 {
        let along = (f64::from(k) + 0.5) * length / count;
        let side = if k % 2 == 0 { 1.0 } else { -1.0 };
        let (here, _) = station(builder, street, along);
        let foot = here.beside(side * (HALF_WIDTH + 0.35));
        if (0.1..PAVEMENT).contains(&builder.network.kerb_distance(foot)) {
            lamp(builder, foot, right_of(here.heading) * -side);
        }
    }
}

fn lamp(builder: &mut Builder, foot: Point2<f64>, towards_road: Vector2<f64>) {
    let height = builder.rng.random_range(5.0..7.5);
    builder.add_post(foot, 0.07, height, grey(0.13));
    builder.add_post(foot, 0.11, 1.1, grey(0.11));
    let head = Plot {
        centre: foot + towards_road * 0.7,
        ahead: towards_road,
        half: Vector2::new(0.13, 0.75),
    };
    builder.add_block(&head, [height, height + 0.13], Material::Lamp(lamps::COLOUR * 12.0), 0);
    let light = foot + towards_road * 1.1;
    builder.lamps.push(Point3::new(light.x, height - 0.05, light.y));
}

fn sign(builder: &mut Builder, foot: Point2<f64>, facing: Vector2<f64>) {
    let kind = [Sign::Disc, Sign::Triangle, Sign::Square, Sign::Board]
        [builder.rng.random_range(0..4_usize)];
    let height = builder.rng.random_range(2.0..2.5);
    let seed = builder.rng.random();
    builder.add_post(foot, 0.032, height + 0.7, grey(0.25));
    let face =
        Plot { centre: foot + facing * 0.05, ahead: facing, half: Vector2::new(0.35, 0.012) };
    builder.add_block(&face, [height, height + 0.7], Material::Sign(kind), seed);
}

fn bollards(builder: &mut Builder, here: &Station, side: f64) {
    for k in -1..=2 {
        let shifted = here.position + here.heading * (1.3 * f64::from(k));
        let foot = shifted + right_of(here.heading) * (side * (HALF_WIDTH + 0.4));
        if builder.network.kerb_distance(foot) > 0.2 {
            let seed = builder.rng.random();
            builder.add_post(foot, 0.055, 0.95, grey(0.3));
            let base = Point3::new(foot.x, 0.7, foot.y);
            let band = Shape::Pole { base, radius: 0.06, height: 0.22 };
            builder.add(band, Material::Banded, seed);
        }
    }
}

fn bin(builder: &mut Builder, at: Point2<f64>) {
    if builder.network.kerb_distance(at) < 1.0 {
        return;
    }
    let colour = [grey(0.03), Rgb::new(0.02, 0.06, 0.14), Rgb::new(0.05, 0.04, 0.025)]
        [builder.rng.random_range(0..3_usize)];
    let seed = builder.rng.random();
    let plot = Plot { centre: at, ahead: Vector2::y(), half: Vector2::new(0.28, 0.33) };
    builder.shade(plot, 0.35, 0.5);
    builder.add_block(&plot, [0.05, 1.0], Material::Plain(colour), seed);
    let lid = Plot { half: plot.half + Vector2::repeat(0.03), ..plot };
    builder.add_block(&lid, [1.0, 1.08], Material::Plain(colour * 1.6), seed);
}

/// Clumps of leaves in a crown.
const CLUMPS: u32 = 14;

/// A tree: a trunk and a crown of leafy clumps.
fn tree(builder: &mut Builder, foot: Point2<f64>, size: f64, traversal: u32) {
    let size = size * builder.rng.random_range(0.8..1.25);
    let trunk = builder.rng.random_range(2.3..3.0) * size;
    let spread = builder.rng.random_range(1.3..2.0) * size;
    let seed: u32 = builder.rng.random();
    let brightness = builder.rng.random_range(0.6..1.5);
    let green = Rgb::new(0.045, 0.07, 0.022) * brightness;
    let shape = Shape::Pole {
        base: Point3::new(foot.x, 0.0, foot.y),
        radius: 0.13 * size,
        height: trunk + 0.8 * spread,
    };
    builder.add(shape, Material::Bark, seed);
    let below = |half: f64| Plot { centre: foot, ahead: Vector2::y(), half: Vector2::repeat(half) };
    builder.shade(below(0.1), 0.6, 0.4);
    builder.shade(below(0.5 * spread), 1.4 * spread, 0.3);
    for k in 0..CLUMPS {
        let level = f64::from(k) / f64::from(CLUMPS - 1);
        let bulge = 2.0 * level - 0.8;
        let ring = spread * (1.0 - bulge * bulge).max(0.1).sqrt() * 0.8;
        let angle = f64::from(k) * 2.4 + builder.rng.random_range(-0.5..0.5);
        let (sin, cos) = libm::sincos(angle);
        let radius = spread * builder.rng.random_range(0.35..0.66);
        let centre = Point3::new(
            foot.x + ring * cos,
            trunk + 0.3 * spread + 1.9 * spread * level,
            foot.y + ring * sin,
        );
        clump(builder, centre, radius, green, seed.wrapping_add(k) ^ traversal);
    }
}

fn clump(builder: &mut Builder, centre: Point3<f64>, radius: f64, green: Rgb, seed: u32) {
    let shape = Shape::Clump { centre, radius, half_height: 0.8 * radius };
    let (colour, density) = match builder.season {
        Season::Summer => (green, 1.0),
        Season::Winter => (Rgb::new(0.075, 0.062, 0.05), 0.42),
    };
    builder.add(shape, Material::Leaves { colour, density }, seed);
}

fn bush(builder: &mut Builder, foot: Point2<f64>, traversal: u32) {
    let plot = Plot { centre: foot, ahead: Vector2::y(), half: Vector2::repeat(0.4) };
    if !builder.is_free(&plot, PAVEMENT + 0.4) {
        return;
    }
    let green = Rgb::new(0.04, 0.065, 0.02) * builder.rng.random_range(0.7..1.6);
    let seed: u32 = builder.rng.random();
    builder.shade(plot, 0.8, 0.4);
    for k in 0..3 {
        let shift: [f64; 2] = std::array::from_fn(|_| builder.rng.random_range(-0.5..0.5));
        let radius = builder.rng.random_range(0.5..0.9);
        let centre = Point3::new(foot.x + shift[0], 0.7 * radius, foot.y + shift[1]);
        clump(builder, centre, radius, green, seed.wrapping_add(k) ^ traversal);
    }
}

/// A small tree behind the fence of a garden.
fn garden_tree(builder: &mut Builder, foot: Point2<f64>, traversal: u32) {
    let plot = Plot { centre: foot, ahead: Vector2::y(), half: Vector2::repeat(0.5) };
    if builder.is_free(&plot, PAVEMENT + 0.4) {
        tree(builder, foot, 0.75, traversal);
    }
}

/// Trees behind the houses, so that gaps do not show the bare horizon.
fn background(builder: &mut Builder, traversal: u32) {
    const STEP: f64 = 11.0;
    for row in -14..24 {
        for column in -9..30 {
            let jitter: [f64; 2] = std::array::from_fn(|_| builder.rng.random_range(-4.5..4.5));
            let size = builder.rng.random_range(1.3..2.2);
            let foot = Point2::new(
                f64::from(column) * STEP + jitter[0],
                f64::from(row) * STEP + jitter[1],
            );
            let plot = Plot { centre: foot, ahead: Vector2::y(), half: Vector2::repeat(2.0) };
            let keep = builder.rng.random_bool(0.3);
            if keep && builder.is_free(&plot, PAVEMENT + 2.5) {
                tree(builder, foot, size, traversal);
            }
        }
    }
}

/// Parks the cars of a traversal along both kerbs.
pub(super) fn park_cars(builder: &mut Builder, traversal: u32) {
    /// Share of the cars that stand where they stood on all other drives.
    const RESIDENT: f64 = 0.5;
    let mut rng = Pcg32::seed_from_u64(u64::from(traversal));
    for street in 0..builder.network.streets.len() {
        let length = builder.network.streets[street].axis.length();
        for side in [-1.0, 1.0] {
            let mut along = builder.rng.random_range(2.0..8.0);
            while along < length - 3.0 {
                let (here, to_crossing) = station(builder, street, along);
                let mut resident = Pcg32::seed_from_u64(builder.rng.random());
                let stays = resident.random_bool(RESIDENT);
                let driver = if stays { &mut resident } else { &mut rng };
                if to_crossing > NO_PARKING && driver.random_bool(0.6) {
                    park(builder, driver, &here, side);
                }
                along += builder.rng.random_range(5.6..7.2);
            }
        }
    }
}

fn park(builder: &mut Builder, rng: &mut Pcg32, here: &Station, side: f64) {
    /// Linear colours, most cars being black, grey or silver.
    const PAINT: [[f64; 3]; 9] = [
        [0.012, 0.012, 0.013],
        [0.03, 0.03, 0.033],
        [0.09, 0.09, 0.10],
        [0.26, 0.27, 0.28],
        [0.30, 0.30, 0.30],
        [0.62, 0.62, 0.60],
        [0.02, 0.035, 0.10],
        [0.22, 0.02, 0.02],
        [0.03, 0.06, 0.05],
    ];
    let colour: Rgb = PAINT[rng.random_range(0..PAINT.len())].into();
    let seed: u32 = rng.random();
    let lateral = side * (HALF_WIDTH - PARKED + rng.random_range(-0.1..0.1));
    let turn = rng.random_range(-0.03..0.03);
    // One parks on the right; a few do not.
    let sense = if rng.random_bool(0.9) { side } else { -side };
    let ahead = (here.heading + right_of(here.heading) * turn).normalize() * sense;
    let shape = Box::new(CarShape::new(seed));
    let plot = Plot {
        centre: here.beside(lateral),
        ahead,
        half: shape.half_plan() - Vector2::repeat(0.1),
    };
    builder.shade(plot, 0.55, 0.88);
    let frame = Frame::new(plot.centre, 0.0, ahead);
    builder.add(Shape::Car { frame, shape }, Material::Car(colour), seed);
}
