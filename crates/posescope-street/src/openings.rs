//! Windows, doors and shops, as fitted into a facade.

use nalgebra::Vector2;

use super::appearance::{Appearance, Rgb, blend, grey};
use super::contact::Part;
use super::facade::Facade;
use super::noise::{Footprint, derive, floor, hash2, unit, value2};
use super::pattern::{bar, glyphs, rectangle, step, stripes};

/// How far windows are set back from the wall \[m\].
const RECESS: f64 = 0.12;

/// A point of a facade, relative to the bay and the storey that it is in.
pub(super) struct Spot {
    /// Number of bays of the face.
    pub(super) bays: i32,
    /// The bay, from the left; none if not in 0 … `bays`.
    pub(super) bay: i32,
    /// The storey, 0 on the ground.
    pub(super) floor: i32,
    /// Distance from the middle of the bay, to the right.
    x: f64,
    /// Height above the floor of the storey.
    y: f64,
    /// Distance from the left edge of the facade.
    u: f64,
    /// Extent of the pixel, horizontally and vertically.
    width: (f64, f64),
    /// Shift of what is seen a metre behind the wall.
    slant: Vector2<f64>,
    seed: u32,
}

impl Spot {
    /// Where `uv` of a face is.
    pub(super) fn new(
        facade: &Facade,
        part: Part,
        uv: Vector2<f64>,
        footprint: &Footprint,
    ) -> Self {
        let width = match part {
            Part::Side => facade.depth,
            _ => facade.width,
        };
        let bays = floor((width - 0.5) / facade.bay).max(1);
        let margin = 0.5 * (width - f64::from(bays) * facade.bay);
        let bay = floor((uv.x - margin) / facade.bay);
        let floor = floor((uv.y - facade.plinth.min(0.4)) / facade.storey);
        let left = margin + f64::from(bay) * facade.bay;
        Self {
            bays,
            bay,
            floor,
            x: uv.x - left - 0.5 * facade.bay,
            y: uv.y - facade.plinth.min(0.4) - f64::from(floor) * facade.storey,
            u: uv.x,
            width: (footprint.along.x, footprint.along.y),
            slant: footprint.slant,
            seed: hash2(bay, floor, facade.seed ^ part as u32),
        }
    }

    /// Whether there is no window here: in gables, and at most places of the side walls.
    pub(super) fn is_blind(&self, facade: &Facade, part: Part) -> bool {
        let top = f64::from(self.floor) * facade.storey + facade.sill + facade.window[1] + 0.6;
        let skipped = part == Part::Side && unit(derive(facade.seed, self.bay as u32)) < 0.35;
        self.floor < 0 || top > facade.eaves || skipped
    }

    /// What one sees through this spot at a distance behind the wall \[m\].
    fn behind(&self, depth: f64) -> Self {
        let shift = self.slant * depth;
        Self { x: self.x + shift.x, y: self.y + shift.y, u: self.u + shift.x, ..*self }
    }

    fn rectangle(&self, half_width: f64, low: f64, high: f64) -> f64 {
        let bounds = [-half_width, low, half_width, high];
        rectangle(self.x, self.y, bounds, self.width)
    }
}

/// The panes: dark rooms, curtains, the frame and its bars.
fn glazing(spot: &Spot, half: f64, low: f64, high: f64) -> Appearance {
    let (x, y) = (spot.x, spot.y);
    let (du, dv) = spot.width;
    let height = high - low;
    let room = 0.012 + 0.03 * unit(derive(spot.seed, 1));
    let mut behind = grey(room);
    let choice = derive(spot.seed, 2) % 8;
    if choice < 4 {
        // Curtains, drawn apart by a random gap.
        let gap = half * (0.15 + 0.7 * unit(derive(spot.seed, 3)));
        let folds = 0.75 + 0.25 * stripes(x + 3.0, 0.14, 0.07, du);
        let cloth = grey(0.22 + 0.25 * unit(derive(spot.seed, 4))) * folds;
        behind = blend(behind, cloth, step(x.abs() - gap, du));
    } else if choice == 4 {
        // A plant on the sill.
        let top = low + height * (0.3 + 0.15 * value2(x * 9.0, 0.0, spot.seed));
        behind = blend(Rgb::new(0.03, 0.06, 0.02), behind, step(y - top, dv));
    }
    let pane = Appearance {
        albedo: behind,
        gloss: 0.9,
        glass: 1.0,
        emission: room_light(spot.seed).component_mul(&(behind * 1.6 + grey(0.3))),
        ..Appearance::default()
    };
    let blind_height = if derive(spot.seed, 5).is_multiple_of(3) {
        height * unit(derive(spot.seed, 6))
    } else {
        0.0
    };
    let slats = 0.3 + 0.14 * stripes(y, 0.08, 0.06, dv);
    let blind = Appearance::matt(grey(slats));
    let frame =
        Appearance::matt(grey(if derive(spot.seed >> 9, 7).is_multiple_of(4) { 0.1 } else { 0.6 }));
    let border = 1.0 - spot.rectangle(half - 0.07, low + 0.07, high - 0.07);
    let mullion = bar(x, -0.04, 0.04, du);
    pane.covered(frame, border.max(mullion)).covered(blind, step(y - (high - blind_height), dv))
}

/// Radiance of a room behind a window when lights are on; every third room is dark.
fn room_light(seed: u32) -> Rgb {
    if derive(seed, 11).is_multiple_of(3) {
        return Rgb::zeros();
    }
    let warmth = unit(derive(seed, 12));
    let strength = 0.5 + 1.2 * unit(derive(seed, 13));
    Rgb::new(1.0, 0.62 + 0.25 * warmth, 0.25 + 0.5 * warmth) * strength
}

/// A window with its surround, sill and shutters.
pub(super) fn window(facade: &Facade, wall: Appearance, spot: &Spot) -> Appearance {
    let [width, height] = facade.window;
    let (low, high, half) = (facade.sill, facade.sill + height, 0.5 * width);
    let reach = if facade.shutters { 1.2 + width } else { 0.3 + half };
    if spot.rectangle(reach, low - 0.3, high + 0.3) == 0.0 {
        return wall;
    }
    let surround = spot.rectangle(half + 0.13, low - 0.1, high + 0.16);
    let trimmed = wall.covered(Appearance::matt(facade.trim), surround);
    let shuttered = if facade.shutters {
        let shutter = spot.rectangle(half + 0.08 + 0.5 * width, low, high)
            * (1.0 - spot.rectangle(half + 0.04, low - 1.0, high + 1.0));
        let slats = 0.7 + 0.3 * stripes(spot.y, 0.09, 0.06, spot.width.1);
        let wood = facade.trim.component_mul(&Rgb::new(0.25, 0.4, 0.3)) * slats;
        trimmed.covered(Appearance::matt(wood), shutter)
    } else {
        trimmed
    };
    let sill = spot.rectangle(half + 0.12, low - 0.09, low);
    let sill_shadow = spot.rectangle(half + 0.12, low - 0.22, low - 0.09);
    let opening = spot.rectangle(half, low, high);
    let inner = spot.behind(RECESS);
    let glazed = inner.rectangle(half, low, high);
    let reveal = Appearance::matt(facade.trim * 0.55);
    // It is dark at the top, where the lintel hangs over it.
    let lintel = inner.rectangle(half, high - 0.1, high) * opening;
    let (flowers, planted) = flower_box(facade, spot);
    shuttered
        .covered(Appearance::matt(wall.albedo * 0.45), 0.8 * sill_shadow)
        .covered(Appearance { ledge: 1.0, ..Appearance::matt(grey(0.42)) }, sill)
        .covered(reveal.covered(glazing(&inner, half, low, high), glazed), opening)
        .covered(Appearance::matt(grey(0.02)), 0.8 * lintel)
        .covered(flowers, planted)
}

/// A box of flowers on the sill of some windows, and the share of the pixel it covers.
fn flower_box(facade: &Facade, spot: &Spot) -> (Appearance, f64) {
    let leaves = Appearance::matt(Rgb::new(0.03, 0.06, 0.02));
    if !derive(spot.seed, 61).is_multiple_of(4) {
        return (leaves, 0.0);
    }
    let (x, y) = (spot.x, spot.y - facade.sill);
    let blossom = value2(x * 17.0, y * 17.0, spot.seed);
    let hue = Rgb::new(0.5, 0.4 * unit(derive(spot.seed, 62)), 0.15);
    let coloured = leaves.covered(Appearance::matt(hue), step(blossom - 0.25, 0.3));
    let top = 0.24 + 0.08 * value2(x * 11.0, 0.0, spot.seed);
    let share = spot.rectangle(0.5 * facade.window[0], facade.sill, facade.sill + top);
    let trough = bar(y, -0.02, 0.1, spot.width.1);
    (coloured.covered(Appearance::matt(grey(0.1)), trough), share)
}

/// A house door with its number.
pub(super) fn door(facade: &Facade, wall: Appearance, spot: &Spot) -> Appearance {
    let paint = Rgb::new(
        0.04 + 0.2 * unit(derive(facade.seed, 31)),
        0.04 + 0.12 * unit(derive(facade.seed, 32)),
        0.04 + 0.1 * unit(derive(facade.seed, 33)),
    );
    let (half, high) = (0.5, 2.1);
    let surround = spot.rectangle(half + 0.15, -0.5, high + 0.18);
    let leaf = spot.rectangle(half, -0.5, high);
    let panels = spot.rectangle(0.32, 0.25, 0.85) + spot.rectangle(0.32, 1.0, 1.85);
    let edges = spot.rectangle(0.27, 0.3, 0.8) + spot.rectangle(0.27, 1.05, 1.8);
    let pane = Appearance { albedo: grey(0.02), gloss: 0.9, glass: 1.0, ..Appearance::default() };
    let lintel = spot.rectangle(half, high - 0.12, high);
    let plate = rectangle(spot.x, spot.y, [0.72, 1.3, 0.95, 1.6], spot.width);
    let number = glyphs(spot.x - 0.75, 1.52 - spot.y, 0.16, spot.width.1, facade.seed);
    wall.covered(Appearance::matt(facade.trim), surround)
        .covered(Appearance::matt(paint), leaf)
        .covered(Appearance::matt(paint * 0.4), (panels - edges).clamp(0.0, 1.0))
        .covered(pane, spot.rectangle(0.24, 1.1, 1.75))
        .covered(Appearance::matt(grey(0.015)), lintel)
        .covered(Appearance::matt(blend(grey(0.6), grey(0.03), number)), plate)
}

/// A shop: large panes with posters, and a sign with letters above them.
pub(super) fn shop(facade: &Facade, wall: Appearance, spot: &Spot) -> Appearance {
    let (du, dv) = spot.width;
    let half = 0.5 * facade.bay - 0.14;
    let top = facade.storey - 0.75;
    let base = Rgb::new(
        0.04 + 0.5 * unit(derive(facade.seed, 41)),
        0.04 + 0.3 * unit(derive(facade.seed, 42)),
        0.04 + 0.4 * unit(derive(facade.seed, 43)),
    );
    let letters = glyphs(spot.u - 0.9, facade.storey - 0.2 - spot.y, 0.42, dv, facade.seed)
        * bar(spot.u, 0.9, facade.width - 1.2, du);
    let ink = if base.sum() > 0.8 { grey(0.03) } else { grey(0.7) };
    let board = Appearance::matt(blend(base, ink, letters));
    let sign = bar(spot.y, top + 0.08, facade.storey - 0.1, dv);
    shop_window(facade, wall, spot, half, top).covered(board, sign)
}

fn shop_window(facade: &Facade, wall: Appearance, spot: &Spot, half: f64, top: f64) -> Appearance {
    let low = if spot.bay == facade.door { 0.02 } else { 0.45 };
    let opening = spot.rectangle(half, low, top);
    if opening == 0.0 {
        return wall;
    }
    let goods = goods(facade, spot);
    let pane = Appearance {
        albedo: goods,
        gloss: 0.8,
        glass: 1.0,
        emission: (goods * 4.0 + grey(0.15)) * (1.5 * unit(derive(facade.seed, 44))),
        ..Appearance::default()
    };
    let frame = 1.0 - spot.rectangle(half - 0.06, low + 0.06, top - 0.06);
    let (poster, posted) = poster(spot);
    wall.covered(pane.covered(Appearance::matt(grey(0.12)), frame), opening)
        .covered(poster, posted * opening)
}

/// What lies behind the panes of a shop: shelves of boxes in the half-light.
fn goods(facade: &Facade, spot: &Spot) -> Rgb {
    const SHELF: f64 = 0.42;
    let (du, dv) = spot.width;
    let shelf = floor(spot.y / SHELF);
    let article = floor(spot.u / 0.23);
    let roll = hash2(article, shelf, facade.seed ^ 77);
    let high = SHELF * (0.3 + 0.6 * unit(roll));
    let here = step(high - (spot.y - f64::from(shelf) * SHELF), dv);
    let channel = |stream| 0.02 + 0.3 * unit(derive(roll, stream)) * unit(derive(roll, 4));
    let gap = stripes(spot.u, 0.23, 0.03, du);
    let colour = Rgb::new(channel(1), channel(2), channel(3)) * (1.0 - gap);
    let board = stripes(spot.y, SHELF, 0.035, dv);
    blend(blend(grey(0.015), colour, here), grey(0.08), board)
}

/// A poster in a shop window, and the share of the pixel it covers.
fn poster(spot: &Spot) -> (Appearance, f64) {
    let low = 0.7 + 0.4 * unit(derive(spot.seed, 51));
    let left = -0.7 + 0.5 * unit(derive(spot.seed, 52));
    let bounds = [left, low, left + 0.6, low + 0.85];
    let paper = grey(0.25 + 0.4 * unit(derive(spot.seed, 53)));
    let picture = value2(spot.x * 7.0, spot.y * 7.0, spot.seed);
    let line = |k: u32| {
        let top = low + 0.8 - 0.2 * f64::from(k);
        glyphs(spot.x - left - 0.05, top - spot.y, 0.14, spot.width.1, derive(spot.seed, k))
    };
    let words = line(0) + line(1);
    let printed = blend(paper * (1.0 + 0.6 * picture), grey(0.03), words.min(1.0));
    let share = rectangle(spot.x, spot.y, bounds, spot.width);
    (Appearance::matt(printed), share)
}
