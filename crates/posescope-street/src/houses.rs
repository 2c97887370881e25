//! Houses along the streets, with roofs, balconies and whatever hangs on their walls.

use nalgebra::{Point2, Vector2, Vector3};
use rand::RngExt;

use super::appearance::{Rgb, grey};
use super::facade::{Facade, GroundFloor, Wall};
use super::frame::Frame;
use super::lamps;
use super::material::{Material, Sign};
use super::network::{HALF_WIDTH, PAVEMENT};
use super::path::right_of;
use super::plot::{Builder, Plot};
use super::shape::Shape;

/// How the houses of a stretch of street are built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Row {
    /// Wall to wall at the pavement.
    Terrace,
    /// Detached, behind front gardens.
    Villas,
}

/// Fills both sides of every street, and closes the view at the streets' ends.
pub(super) fn build(builder: &mut Builder) {
    for street in 0..builder.network.streets.len() {
        let length = builder.network.streets[street].axis.length();
        for side in [-1.0, 1.0] {
            line_street(builder, street, side, length);
        }
        for (station, sign) in [(0.0, -1.0), (length, 1.0)] {
            let end = builder.network.streets[street].axis.at(station);
            let plot = Plot {
                centre: end.position + end.heading * (sign * 13.5),
                ahead: -end.heading * sign,
                half: Vector2::new(6.0, 5.0),
            };
            if builder.is_free(&plot, PAVEMENT) {
                house(builder, plot, Row::Villas);
            }
        }
    }
}

fn line_street(builder: &mut Builder, street: usize, side: f64, length: f64) {
    let mut station = 0.0;
    let mut row = Row::Terrace;
    let mut row_end = 0.0;
    let mut setback = 0.0;
    while station < length {
        if station >= row_end {
            row_end = station + builder.rng.random_range(35.0..75.0);
            row = if builder.rng.random_bool(0.55) { Row::Terrace } else { Row::Villas };
            setback = match row {
                Row::Terrace => 0.1,
                Row::Villas => builder.rng.random_range(2.5..4.5),
            };
        }
        let (width, depth, gap) = match row {
            Row::Terrace => (
                builder.rng.random_range(8.5..14.0),
                builder.rng.random_range(9.0..12.0),
                if builder.rng.random_bool(0.25) { 3.5 } else { 0.02 },
            ),
            Row::Villas => (
                builder.rng.random_range(9.0..13.0),
                builder.rng.random_range(8.0..11.0),
                builder.rng.random_range(3.0..7.0),
            ),
        };
        let axis = &builder.network.streets[street].axis;
        let middle = axis.at(station + 0.5 * width);
        let lateral = HALF_WIDTH + PAVEMENT + setback + 0.5 * depth;
        let plot = Plot {
            centre: middle.beside(side * lateral),
            ahead: right_of(middle.heading) * -side,
            half: Vector2::new(0.5 * width, 0.5 * depth),
        };
        if builder.is_free(&plot, PAVEMENT) {
            house(builder, plot, row);
            station += width + gap;
        } else {
            station += 1.5;
        }
    }
}

/// A house on a plot.
fn house(builder: &mut Builder, plot: Plot, row: Row) {
    builder.take(plot);
    let facade = design(builder, &plot, row);
    builder.shade(plot, 1.3, 0.5);
    let eaves = facade.eaves;
    builder.add_block(&plot, [0.0, eaves], Material::Facade(Box::new(facade.clone())), facade.seed);
    roof(builder, &plot, eaves);
    if row == Row::Terrace {
        balconies(builder, &plot, &facade);
    }
    attachments(builder, &plot, &facade);
}

fn design(builder: &mut Builder, plot: &Plot, row: Row) -> Facade {
    /// Linear colours of plaster.
    const PLASTER: [[f64; 3]; 9] = [
        [0.72, 0.70, 0.64],
        [0.66, 0.60, 0.45],
        [0.52, 0.50, 0.46],
        [0.60, 0.42, 0.26],
        [0.36, 0.40, 0.42],
        [0.62, 0.48, 0.40],
        [0.74, 0.73, 0.71],
        [0.42, 0.44, 0.33],
        [0.30, 0.22, 0.17],
    ];
    const BRICK: [[f64; 3]; 3] = [[0.26, 0.10, 0.06], [0.20, 0.11, 0.08], [0.34, 0.22, 0.13]];
    let rng = &mut builder.rng;
    let wall = match rng.random_range(0..20_u32) {
        0..=4 => Wall::Brick,
        5..=6 => Wall::Timber,
        _ => Wall::Plaster,
    };
    let colour: Rgb = match wall {
        Wall::Brick => BRICK[rng.random_range(0..BRICK.len())].into(),
        Wall::Plaster | Wall::Timber => PLASTER[rng.random_range(0..PLASTER.len())].into(),
    };
    let storeys = match row {
        Row::Terrace => rng.random_range(2..=4_u32),
        Row::Villas => rng.random_range(1..=2_u32),
    };
    let storey = rng.random_range(2.75..3.3);
    let plinth: f64 = rng.random_range(0.3..1.0);
    let bay = rng.random_range(1.9..2.9);
    let bays = ((2.0 * plot.half.x - 0.5) / bay).floor().max(1.0) as i32;
    let ground = if row == Row::Terrace && storeys > 1 && rng.random_bool(0.3) {
        GroundFloor::Shop
    } else {
        GroundFloor::Flats
    };
    let sill = rng.random_range(0.8..1.0);
    let window_height = rng.random_range(1.2..1.65_f64).min(storey - sill - 0.4);
    Facade {
        width: 2.0 * plot.half.x,
        depth: 2.0 * plot.half.y,
        eaves: f64::from(storeys) * storey + plinth.min(0.4) + rng.random_range(0.2..0.6),
        storey,
        sill,
        bay,
        window: [rng.random_range(0.85..1.3_f64).min(bay - 0.7), window_height],
        wall,
        colour,
        trim: if rng.random_bool(0.6) { grey(0.6) } else { Rgb::new(0.33, 0.27, 0.21) },
        plinth,
        ground,
        door: rng.random_range(0..bays),
        shutters: bay > 2.3 && rng.random_bool(0.5),
        seed: rng.random(),
    }
}

fn roof(builder: &mut Builder, plot: &Plot, eaves: f64) {
    const TILES: [[f64; 3]; 4] =
        [[0.20, 0.075, 0.045], [0.13, 0.055, 0.040], [0.065, 0.065, 0.070], [0.16, 0.10, 0.075]];
    let rng = &mut builder.rng;
    let colour = TILES[rng.random_range(0..TILES.len())].into();
    let pitch = rng.random_range(0.6..1.05);
    let gable_to_street = plot.half.x < plot.half.y * 1.1 && rng.random_bool(0.35);
    let seed = rng.random();
    let (ahead, half_length, half_depth) = if gable_to_street {
        (right_of(plot.ahead), plot.half.y + 0.25, plot.half.x + 0.25)
    } else {
        (plot.ahead, plot.half.x + 0.01, plot.half.y + 0.35)
    };
    let rise = pitch * half_depth;
    let shape = Shape::Gable {
        frame: Frame::new(plot.centre, eaves, ahead),
        half: Vector3::new(half_length, rise, half_depth),
    };
    builder.add(shape, Material::Tiles(colour), seed);
    chimney(builder, plot, eaves + rise);
    if !gable_to_street && seed % 3 == 0 {
        dormers(builder, plot, eaves, pitch);
    }
}

fn chimney(builder: &mut Builder, plot: &Plot, ridge: f64) {
    let x = builder.rng.random_range(-0.6..0.6) * plot.half.x;
    let seed = builder.rng.random();
    let stack = Plot { centre: plot.at(x, 0.4), ahead: plot.ahead, half: Vector2::new(0.4, 0.3) };
    let material = Material::Wall { colour: Rgb::new(0.2, 0.1, 0.07), brick: true };
    builder.add_block(&stack, [ridge - 1.0, ridge + 0.8], material, seed);
}

/// Small houses on the slope towards the street, each with one window.
fn dormers(builder: &mut Builder, plot: &Plot, eaves: f64, pitch: f64) {
    let count = builder.rng.random_range(2..=3);
    let seed = builder.rng.random();
    for k in 0..count {
        let x = plot.half.x * (2.0 * (f64::from(k) + 0.5) / f64::from(count) - 1.0);
        let box_plot = Plot {
            centre: plot.at(x, plot.half.y - 1.9),
            ahead: plot.ahead,
            half: Vector2::new(0.75, 1.1),
        };
        let facade = Facade {
            width: 1.5,
            depth: 2.2,
            eaves: 2.6,
            storey: 1.9,
            sill: 0.35,
            bay: 1.4,
            window: [0.85, 1.0],
            wall: Wall::Plaster,
            colour: grey(0.4),
            trim: grey(0.6),
            plinth: 0.01,
            ground: GroundFloor::Flats,
            door: -1,
            shutters: false,
            seed,
        };
        let base = eaves + 0.55 * pitch;
        builder.add_block(&box_plot, [base, base + 1.75], Material::Facade(Box::new(facade)), seed);
        let lid = Plot { half: box_plot.half + Vector2::new(0.12, 0.15), ..box_plot };
        builder.add_block(&lid, [base + 1.75, base + 1.87], Material::Plain(grey(0.09)), seed);
    }
}

/// Balconies before the windows of one bay, above each other.
fn balconies(builder: &mut Builder, plot: &Plot, facade: &Facade) {
    if facade.seed % 5 > 1 || facade.eaves < 5.0 {
        return;
    }
    let bays = ((facade.width - 0.5) / facade.bay).floor().max(1.0);
    let at = 0.5 * facade.width - 0.5 * (facade.width - bays * facade.bay);
    let columns: &[f64] = if bays >= 4.0 { &[1.0, bays - 2.0] } else { &[1.0] };
    let storeys = ((facade.eaves - 0.5) / facade.storey).floor() as u32;
    for &column in columns {
        let x = at - (column + 0.5) * facade.bay;
        let slab = Plot {
            centre: plot.at(x, plot.half.y + 0.55),
            ahead: plot.ahead,
            half: Vector2::new(0.5 * facade.bay + 0.1, 0.55),
        };
        for floor in 1..storeys {
            let base = facade.plinth.min(0.4) + f64::from(floor) * facade.storey;
            builder.add_block(&slab, [base - 0.18, base], Material::Plain(grey(0.3)), facade.seed);
            balustrade(builder, &slab, base, facade.seed);
        }
    }
}

fn balustrade(builder: &mut Builder, slab: &Plot, base: f64, seed: u32) {
    let material = if seed & 8 == 0 {
        Material::Fence(grey(0.06))
    } else {
        Material::Wall { colour: grey(0.55), brick: false }
    };
    let front = Plot {
        centre: slab.at(0.0, slab.half.y - 0.03),
        half: Vector2::new(slab.half.x, 0.03),
        ..*slab
    };
    builder.add_block(&front, [base, base + 0.95], material.clone(), seed);
    for sign in [-1.0, 1.0] {
        let cheek = Plot {
            centre: slab.at(sign * (slab.half.x - 0.03), 0.0),
            half: Vector2::new(0.03, slab.half.y - 0.07),
            ..*slab
        };
        builder.add_block(&cheek, [base, base + 0.95], material.clone(), seed);
    }
}

/// Drain pipes, door steps, awnings and hanging signs.
fn attachments(builder: &mut Builder, plot: &Plot, facade: &Facade) {
    let front = plot.half.y;
    builder.add_post(plot.at(plot.half.x - 0.2, front + 0.07), 0.05, facade.eaves, grey(0.16));
    let bays = ((facade.width - 0.5) / facade.bay).floor().max(1.0);
    let margin = 0.5 * (facade.width - bays * facade.bay);
    let door_x = 0.5 * facade.width - margin - (f64::from(facade.door) + 0.5) * facade.bay;
    let on_front = |x: f64, half_width: f64, from: f64, to: f64| Plot {
        centre: plot.at(x, front + 0.5 * (from + to)),
        ahead: plot.ahead,
        half: Vector2::new(half_width, 0.5 * (to - from)),
    };
    let seed = facade.seed;
    match facade.ground {
        GroundFloor::Shop => {
            let blade = on_front(-0.7 * plot.half.x, 0.05, 0.15, 0.85);
            let turned =
                Plot { ahead: right_of(blade.ahead), half: Vector2::new(0.35, 0.05), ..blade };
            builder.add_block(&turned, [3.1, 3.8], Material::Sign(Sign::Board), seed);
            if seed & 2 == 0 {
                let awning = on_front(0.0, plot.half.x - 0.6, 0.0, 1.1);
                let top = facade.storey - 0.4;
                let cloth = Rgb::new(0.2 + 0.2 * f64::from(seed & 1), 0.08, 0.07);
                builder.add_block(&awning, [top, top + 0.14], Material::Plain(cloth), seed);
            }
        }
        GroundFloor::Flats => {
            let step = on_front(door_x, 0.8, 0.0, 0.6);
            builder.add_block(&step, [0.0, 0.3], Material::Plain(grey(0.2)), seed);
            let canopy = on_front(door_x, 0.85, 0.0, 0.8);
            builder.add_block(&canopy, [2.75, 2.85], Material::Plain(grey(0.12)), seed);
        }
    }
    wall_lamp(builder, plot.at(door_x - 0.9, front + 0.12));
}

fn wall_lamp(builder: &mut Builder, at: Point2<f64>) {
    let lamp = Plot { centre: at, ahead: Vector2::y(), half: Vector2::repeat(0.09) };
    let glow = lamps::COLOUR * 4.0;
    builder.add_block(&lamp, [2.1, 2.4], Material::Lamp(glow), 0);
}
