//! The ground: a carriageway between raised pavements, and the land beyond.

use nalgebra::{Point2, Point3, Vector3};

use super::appearance::{Appearance, Rgb, blend, grey};
use super::frame::Ray;
use super::network::{HALF_WIDTH, Network, PAVEMENT, Place};
use super::noise::{Footprint, derive, floor, hash2, octaves, unit, value2};
use super::pattern::{bar, step, stripes};

/// Height of the pavements above the carriageway \[m\].
pub(super) const KERB: f64 = 0.12;
/// Nothing is seen of the ground beyond this \[m\].
const HORIZON: f64 = 500.0;
/// Distance from the axis to the line along parked cars \[m\].
const BAY_LINE: f64 = HALF_WIDTH - 2.05;

/// Where a ray met the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct GroundContact {
    /// Along the ray \[m\].
    pub(super) distance: f64,
    /// Normal: up, or away from a kerb.
    pub(super) normal: Vector3<f64>,
    /// Where it is; `None` on land that no street reaches.
    pub(super) place: Option<Place>,
}

/// Where a ray from above meets the ground before `limit`.
pub(super) fn meet(network: &Network, ray: &Ray, limit: f64) -> Option<GroundContact> {
    if ray.direction.y >= 0.0 {
        return None;
    }
    let reach = |height: f64| (height - ray.origin.y) / ray.direction.y;
    let (upper, lower) = (reach(KERB), reach(0.0));
    if upper >= limit.min(HORIZON) || upper <= 0.0 {
        return None;
    }
    let place_at = |distance| network.place(plan(&ray.at(distance)));
    let raised = |place: &Option<Place>| place.is_none_or(|p| p.from_kerb >= 0.0);
    let contact = |distance, normal, place| GroundContact { distance, normal, place };
    let above = place_at(upper);
    let found = if raised(&above) {
        contact(upper, Vector3::y(), above)
    } else {
        let below = place_at(lower);
        if raised(&below) {
            let distance = kerb_face(network, ray, upper, lower);
            let place = place_at(distance);
            contact(distance, away_from_kerb(network, &ray.at(distance)), place)
        } else {
            contact(lower, Vector3::y(), below)
        }
    };
    (found.distance < limit).then_some(found)
}

fn plan(p: &Point3<f64>) -> Point2<f64> {
    Point2::new(p.x, p.z)
}

/// Where a ray that is above the carriageway at `outside` and below a pavement at `inside`
/// crosses the kerb.
fn kerb_face(network: &Network, ray: &Ray, mut outside: f64, mut inside: f64) -> f64 {
    for _ in 0..24 {
        let middle = 0.5 * (outside + inside);
        if network.kerb_distance(plan(&ray.at(middle))) < 0.0 {
            outside = middle;
        } else {
            inside = middle;
        }
    }
    outside
}

/// The horizontal direction from the kerb to the carriageway.
fn away_from_kerb(network: &Network, p: &Point3<f64>) -> Vector3<f64> {
    const STEP: f64 = 0.01;
    let at = |dx: f64, dz: f64| network.kerb_distance(Point2::new(p.x + dx, p.z + dz));
    let gradient =
        Vector3::new(at(STEP, 0.0) - at(-STEP, 0.0), 0.0, at(0.0, STEP) - at(0.0, -STEP));
    gradient.try_normalize(1e-12).map_or_else(Vector3::y, |outward| -outward)
}

/// The look of the ground at a point.
pub(super) fn appearance(
    network: &Network,
    contact: &GroundContact,
    point: &Point3<f64>,
    footprint: &Footprint,
    seed: u32,
) -> Appearance {
    let p = plan(point);
    let Some(place) = contact.place else {
        return Appearance::matt(land(p, footprint, seed));
    };
    let from_kerb = place.from_kerb;
    let albedo = if contact.normal.y < 0.5 {
        kerb_stone(&place, p, footprint, seed) * 0.75
    } else if from_kerb < 0.0 {
        carriageway(network, &place, p, footprint, seed)
    } else if from_kerb < 0.15 {
        kerb_stone(&place, p, footprint, seed)
    } else if from_kerb < PAVEMENT {
        pavement(&place, p, footprint, seed)
    } else {
        land(p, footprint, seed)
    };
    Appearance::matt(albedo)
}

/// Grass and soil.
fn land(p: Point2<f64>, footprint: &Footprint, seed: u32) -> Rgb {
    let patches = octaves(p, 3.0, 3, 0.6, footprint, seed ^ 21);
    let blades = octaves(p, 0.16, 3, 0.9, footprint, seed ^ 22);
    let grass = Rgb::new(0.055, 0.08, 0.028) * (1.0 + 0.3 * blades).max(0.15);
    let soil = Rgb::new(0.11, 0.09, 0.065) * (1.0 + 0.3 * blades);
    blend(grass, soil, (0.35 + 0.9 * patches).clamp(0.0, 1.0))
}

fn kerb_stone(place: &Place, p: Point2<f64>, footprint: &Footprint, seed: u32) -> Rgb {
    let stone = floor(place.station);
    let single = unit(hash2(stone, place.street as i32, seed ^ 31)) - 0.5;
    let joint = stripes(place.station, 1.0, 0.02, footprint.major.min(1.0));
    let tone = octaves(p, 0.3, 4, 0.75, footprint, seed ^ 32);
    grey(0.25) * (1.0 + 0.3 * single + 0.25 * tone - 0.6 * joint)
}

fn pavement(place: &Place, p: Point2<f64>, footprint: &Footprint, seed: u32) -> Rgb {
    const SLAB: f64 = 0.5;
    let (s, l) = (place.station, place.from_kerb);
    let (i, j) = (floor(s / SLAB), floor(l / SLAB));
    let single = unit(hash2(i, j, seed ^ 41)) - 0.5;
    let clarity = footprint.contrast(0.25);
    let joints =
        stripes(s, SLAB, 0.025, footprint.minor).max(stripes(l, SLAB, 0.025, footprint.minor))
            * clarity;
    let dirt = octaves(p, 1.5, 4, 0.65, footprint, seed ^ 42);
    let grain = octaves(p, 0.07, 2, 1.0, footprint, seed ^ 43);
    grey(0.25) * (1.0 + 0.2 * single * clarity + 0.3 * dirt + 0.2 * grain - 0.55 * joints).max(0.1)
}

fn asphalt(p: Point2<f64>, footprint: &Footprint, seed: u32) -> f64 {
    let grain = octaves(p, 0.11, 3, 1.0, footprint, seed ^ 51);
    let wear = octaves(p, 4.0, 3, 0.4, footprint, seed ^ 52);
    let cracked = cracks(p, footprint, seed);
    0.118 * (1.0 + 0.20 * grain + 0.3 * wear - 0.6 * cracked).max(0.1)
}

/// Share of the pixel that is a crack; whole stretches have none.
fn cracks(p: Point2<f64>, footprint: &Footprint, seed: u32) -> f64 {
    let here = step(value2(p.x / 9.0, p.y / 9.0, seed ^ 55) - 0.05, 0.1);
    if here == 0.0 {
        return 0.0;
    }
    let coarse = value2(p.x / 1.7, p.y / 1.7, seed ^ 53);
    let distance = coarse + 0.3 * value2(p.x / 0.3, p.y / 0.3, seed ^ 54);
    let width = 0.012 + 0.35 * footprint.minor;
    here * (1.0 - distance.abs() / width).max(0.0) * (0.012 / width).sqrt()
}

/// Asphalt with patches, manhole covers and markings.
fn carriageway(
    network: &Network,
    place: &Place,
    p: Point2<f64>,
    footprint: &Footprint,
    seed: u32,
) -> Rgb {
    let blur = footprint.minor + 0.3 * (footprint.major - footprint.minor).min(1.0);
    let mut level = asphalt(p, footprint, seed);
    level = patched(level, place, blur, seed);
    level = with_manhole(level, place, footprint, seed);
    let gutter = bar(place.from_kerb, -0.32, 0.0, blur);
    level *= 1.0 - 0.3 * gutter;
    let painted = marking(network, place, blur);
    let tarmac = Rgb::new(0.99, 1.0, 1.02) * level;
    if painted == 0.0 {
        return tarmac;
    }
    let wear = 0.5 * value2(p.x * 2.5, p.y * 2.5, seed ^ 61)
        - 0.25 * value2(p.x * 9.0, p.y * 9.0, seed ^ 62);
    blend(tarmac, grey(0.52), painted * (0.85 + wear).clamp(0.15, 1.0))
}

/// Repaired rectangles, darker and edged with tar.
fn patched(level: f64, place: &Place, blur: f64, seed: u32) -> f64 {
    const CELL: f64 = 7.0;
    let cell = floor(place.station / CELL);
    let lane = floor(place.lateral / 2.2);
    let roll = hash2(cell, lane, seed ^ derive(71, place.street as u32));
    if !roll.is_multiple_of(3) {
        return level;
    }
    let random = |stream| unit(derive(roll, stream));
    let (half_length, half_width) = (0.5 + 2.2 * random(1), 0.3 + 0.7 * random(2));
    let s = place.station - (f64::from(cell) + 0.5) * CELL;
    let l = place.lateral - (f64::from(lane) + 0.5) * 2.2;
    let inside = (half_length - s.abs()).min(half_width - l.abs());
    let tone = 0.7 + 0.5 * random(3);
    let tar = bar(inside, -0.03, 0.03, blur);
    let covered = level * (1.0 + (tone - 1.0) * step(inside, blur));
    covered * (1.0 - 0.65 * tar)
}

fn with_manhole(level: f64, place: &Place, footprint: &Footprint, seed: u32) -> f64 {
    const CELL: f64 = 17.0;
    const RADIUS: f64 = 0.33;
    let cell = floor(place.station / CELL);
    let roll = hash2(cell, place.street as i32, seed ^ 81);
    let s = place.station - (f64::from(cell) + 0.2 + 0.6 * unit(roll)) * CELL;
    let l = place.lateral - 2.6 * (unit(derive(roll, 1)) - 0.5);
    let square = s * s + l * l;
    if square > 0.36 {
        return level;
    }
    let radius = square.sqrt();
    let blur = footprint.minor;
    let studs = stripes(s, 0.09, 0.045, blur) * stripes(l, 0.09, 0.045, blur);
    let iron = 0.05 + 0.06 * studs;
    let ring = bar(radius, RADIUS, RADIUS + 0.05, blur);
    let cover = 1.0 - step(radius - RADIUS, blur);
    level + (iron - level) * cover + (0.03 - level) * 0.7 * ring
}

/// Share of white paint: zebra crossings, stop lines, the middle line, the edge of parking bays.
fn marking(network: &Network, place: &Place, blur: f64) -> f64 {
    let street = &network.streets[place.street];
    let to_crossing = street.to_crossing(place.station);
    let l = place.lateral;
    let zebra = bar(to_crossing, 10.5, 13.7, blur) * stripes(l, 1.0, 0.5, blur);
    let stop = bar(to_crossing, 14.6, 15.0, blur) * bar(l.abs(), 0.15, HALF_WIDTH - 0.3, blur);
    let beyond = step(to_crossing - 15.0, blur);
    let dashes = stripes(place.station, 6.0, 3.0, blur);
    let dashed_here = place.street.is_multiple_of(2) || to_crossing < 40.0;
    let middle = if dashed_here { bar(l, -0.06, 0.06, blur) * dashes } else { 0.0 };
    let edge = bar(l.abs(), BAY_LINE - 0.05, BAY_LINE + 0.05, blur);
    let bays = bar(l.abs(), BAY_LINE, HALF_WIDTH, blur) * stripes(place.station, 6.2, 0.1, blur);
    (zebra + stop + beyond * (middle + edge + bays)).min(1.0)
}
