//! How the walls of houses look: plaster, brick and timber, with the windows, doors and shops in them.

use nalgebra::Vector2;

use super::appearance::{Appearance, Rgb, blend, grey};
use super::contact::Part;
use super::facade::{Facade, GroundFloor, Wall};
use super::noise::{Footprint, floor, hash2, octaves, unit, value2};
use super::openings::{self, Spot};
use super::pattern::{bar, step, stripes};

/// The look of the wall at a point of one of its faces.
pub(super) fn appearance(
    facade: &Facade,
    part: Part,
    uv: Vector2<f64>,
    footprint: &Footprint,
) -> Appearance {
    if part == Part::Flat {
        return Appearance::matt(grey(0.1));
    }
    let wall = Appearance::matt(wall(facade, uv, footprint));
    let spot = Spot::new(facade, part, uv, footprint);
    let fitted = if !(0..spot.bays).contains(&spot.bay) {
        wall
    } else if spot.floor == 0 && facade.ground == GroundFloor::Shop && part == Part::Front {
        openings::shop(facade, wall, &spot)
    } else if spot.floor == 0 && part == Part::Front && spot.bay == facade.door {
        openings::door(facade, wall, &spot)
    } else if spot.is_blind(facade, part) {
        wall
    } else {
        openings::window(facade, wall, &spot)
    };
    // The eaves keep the sky off the wall below them.
    let below = ((facade.eaves - uv.y) / 0.9).clamp(0.0, 1.0);
    Appearance { albedo: fitted.albedo * (0.45 + 0.55 * below), ..fitted }
}

/// Painted plaster with stains.
pub(super) fn plaster(colour: Rgb, uv: Vector2<f64>, footprint: &Footprint, seed: u32) -> Rgb {
    let blotches = octaves(uv.into(), 2.5, 3, 0.45, footprint, seed);
    let grain = octaves(uv.into(), 0.11, 3, 1.0, footprint, seed ^ 5);
    let streaked = Vector2::new(uv.x, 0.06 * uv.y);
    let streaks = octaves(streaked.into(), 0.35, 2, 0.7, footprint, seed ^ 6);
    colour * (0.92 + 0.15 * blotches + 0.10 * grain + 0.14 * streaks.min(0.0))
}

/// Bricks in running bond.
pub(super) fn brick(colour: Rgb, uv: Vector2<f64>, footprint: &Footprint, seed: u32) -> Rgb {
    const COURSE: f64 = 0.083;
    const LENGTH: f64 = 0.25;
    let row = floor(uv.y / COURSE);
    let shifted = uv.x / LENGTH + 0.5 * f64::from(row & 1);
    let single = unit(hash2(floor(shifted), row, seed)) - 0.5;
    let joints = stripes(uv.y, COURSE, 0.012, footprint.along.y).max(stripes(
        shifted * LENGTH,
        LENGTH,
        0.012,
        footprint.along.x,
    ));
    let stain = octaves(uv.into(), 2.0, 4, 0.6, footprint, seed ^ 3);
    let clay = colour * (1.0 + 0.4 * single * footprint.contrast(0.12) + 0.2 * stain).max(0.2);
    blend(clay, grey(0.26), 0.6 * joints)
}

fn wall(facade: &Facade, uv: Vector2<f64>, footprint: &Footprint) -> Rgb {
    let colour = match facade.wall {
        Wall::Plaster => plaster(facade.colour, uv, footprint, facade.seed),
        Wall::Brick => brick(facade.colour, uv, footprint, facade.seed),
        Wall::Timber => {
            let wood = Rgb::new(0.06, 0.04, 0.03)
                * (1.0 + 0.4 * octaves(uv.into(), 0.2, 3, 0.8, footprint, facade.seed));
            let plaster = plaster(facade.colour, uv, footprint, facade.seed);
            blend(plaster, wood, timbers(facade, uv, footprint))
        }
    };
    let dv = footprint.along.y;
    let band_of = |v: f64| bar(v, -0.12, 0.1, dv) * facade.trim;
    let first = facade.plinth.min(0.4) + facade.storey;
    let banded = if facade.seed & 1 == 0 && facade.storey * 1.5 < facade.eaves {
        let cover = bar(uv.y - first, -0.12, 0.1, dv);
        colour * (1.0 - cover) + band_of(uv.y - first) * (0.9 + 0.2 * value2(uv.x, 0.0, 1))
    } else {
        colour
    };
    let stones = grey(0.17)
        * (1.0 + 0.35 * octaves(uv.into(), 0.5, 4, 0.75, footprint, facade.seed ^ 8)).max(0.3);
    let joints = stripes(uv.x, 0.62, 0.02, footprint.along.x) * 0.4;
    let based = blend(stones * (1.0 - joints), banded, step(uv.y - facade.plinth, dv));
    // Splashed dirt just above the ground.
    based * (0.62 + 0.38 * (uv.y / 0.7).min(1.0))
}

/// Share of timber: posts between the bays, rails at the floors and sills, braces in some panels.
fn timbers(facade: &Facade, uv: Vector2<f64>, footprint: &Footprint) -> f64 {
    let (du, dv) = (footprint.along.x, footprint.along.y);
    let v = uv.y - facade.plinth.min(0.4) + 0.1;
    let u = uv.x + 0.1;
    let half_bay = 0.5 * facade.bay;
    let posts = stripes(u, half_bay, 0.16, du);
    let rails = stripes(v, facade.storey, 0.2, dv)
        + stripes(v - facade.sill + 0.15, facade.storey, 0.14, dv);
    let (panel, floor_index) = (floor(u / half_bay), floor(v / facade.storey));
    let x = u - f64::from(panel) * half_bay;
    let y = v - f64::from(floor_index) * facade.storey;
    let roll = hash2(panel, floor_index, facade.seed ^ 21);
    let slanted = match roll % 4 {
        0 => x * facade.storey / half_bay - y,
        1 => (half_bay - x) * facade.storey / half_bay - y,
        _ => f64::INFINITY,
    };
    let brace = bar(slanted, -0.16, 0.16, du + dv);
    posts.max(rails).max(brace).min(1.0)
}
