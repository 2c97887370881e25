//! Where the panels of a proof are.

use super::{Panel, ProofPicture};

/// Half the size of a mark \[px\].
pub const MARK: f32 = 7.0;
/// Between two panels \[px\].
const GAP: f32 = 8.0;
/// Height of a title \[px\].
const TITLE: f32 = 18.0;
/// What the large panel and the strip below it may take of the width, where something is beside them.
const LARGE_SHARES: [f32; 2] = [0.52, 0.62];

/// A rectangle: left, top, width and height \[px\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// From the left edge.
    pub left: f32,
    /// From the upper edge.
    pub top: f32,
    /// Its width.
    pub width: f32,
    /// Its height.
    pub height: f32,
}

impl Place {
    fn area(&self) -> f32 {
        self.width * self.height
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.left < other.left + other.width
            && other.left < self.left + self.width
            && self.top < other.top + other.height
            && other.top < self.top + self.height
    }

    /// The largest place for a panel inside, at its upper left corner.
    fn fitted(self, panel: &Panel) -> Self {
        let aspect = panel.aspect();
        let mut width = self.width.min(self.height * aspect);
        if panel.is_plain {
            width = width.min(panel.picture.width() as f32);
        }
        Self { width, height: width / aspect, ..self }
    }

    /// Without the title above.
    fn below_title(self) -> Self {
        Self { top: self.top + TITLE, height: (self.height - TITLE).max(1.0), ..self }
    }
}

impl ProofPicture {
    /// The place of each panel's picture in an area of this size, in the order of [`Self::panels`]; titles stand
    /// right above. The others stand below the large panel or to its right, wherever all become larger.
    pub fn places(&self, width: f32, height: f32) -> Vec<Place> {
        self.better(width, height, score)
    }

    /// The places on a page of this width, and the height that they take: those that fill more of it.
    pub fn on_page(&self, width: f32) -> (Vec<Place>, f32) {
        const MAX: f32 = 1.2;
        // Cells are seen as well on a part of the width, and photos beside them are not.
        let most =
            if self.large.has_cells { (LARGE_SHARES[1] * width).powi(2) } else { f32::INFINITY };
        let filled = |places: &[Place]| {
            let large = places.first().map_or(0.0, Place::area).min(most);
            let small = places.iter().skip(1).map(Place::area).sum::<f32>();
            (large + small) / bottom(places)
        };
        let places = self.better(width, MAX * width, filled);
        let height = bottom(&places).ceil();
        (places, height)
    }

    fn better(&self, width: f32, height: f32, score: impl Fn(&[Place]) -> f32) -> Vec<Place> {
        let all = Place { left: 0.0, top: 0.0, width, height };
        if self.beside.is_empty() {
            return self.side_by_side(all, 1.0, 1);
        }
        let mut best = self.stacked(all);
        let mut hold = |places: Vec<Place>| {
            if score(&places) >= score(&best) {
                best = places;
            }
        };
        for columns in 1..=self.beside.len().min(2) {
            for share in LARGE_SHARES {
                hold(self.side_by_side(all, share, columns));
            }
            if let Some(below) = &self.below {
                hold(self.large_alone(all, below, columns));
            }
        }
        best
    }

    /// The large panel on a share of the width with its strip below, the small ones beside them in columns.
    fn side_by_side(&self, all: Place, share: f32, columns: usize) -> Vec<Place> {
        let left = Place { width: (all.width - GAP) * share, ..all };
        let strip = self.below.as_ref().map(|below| left.width / below.aspect() + TITLE + GAP);
        let strip = strip.unwrap_or(0.0).min(0.3 * all.height);
        let large = Place { height: all.height - strip, ..left };
        let large = large.below_title().fitted(&self.large);
        let mut places = vec![large];
        if let Some(below) = &self.below {
            let place = Place { top: large.top + large.height + GAP, height: strip, ..left };
            places.push(place.below_title().fitted(below));
        }
        let taken = places.iter().fold(0.0, |taken: f32, place| taken.max(place.width));
        places.extend(self.columns(right_of(all, taken), columns));
        places
    }

    /// The large panel on the whole height, all others beside it: the small ones in columns, below them the strip.
    fn large_alone(&self, all: Place, strip: &Panel, columns: usize) -> Vec<Place> {
        let most = Place { width: (all.width - GAP) * LARGE_SHARES[0], ..all };
        let large = most.below_title().fitted(&self.large);
        let right = right_of(all, large.width);
        let strip_height = (right.width / strip.aspect() + TITLE).min(0.4 * all.height);
        let upper = Place { height: all.height - strip_height - GAP, ..right };
        let small = self.columns(upper, columns);
        let place = Place { top: bottom(&small) + GAP, height: strip_height, ..right };
        [vec![large, place.below_title().fitted(strip)], small].concat()
    }

    /// The small panels in columns.
    fn columns(&self, all: Place, columns: usize) -> Vec<Place> {
        let width = (all.width - GAP * (columns - 1) as f32) / columns as f32;
        let column = |at: usize| Place { left: all.left + at as f32 * (width + GAP), width, ..all };
        let chunks = self.beside.chunks(self.beside.len().div_ceil(columns).max(1)).enumerate();
        chunks.flat_map(|(at, panels)| column_of(panels, column(at))).collect()
    }

    fn stacked(&self, all: Place) -> Vec<Place> {
        let rows = self.below.iter().map(Panel::aspect);
        let below_height: f32 =
            rows.map(|aspect| (all.width / aspect).min(0.2 * all.height) + TITLE + GAP).sum();
        let count = self.beside.len().max(1) as f32;
        let cell = (all.width - GAP * (count - 1.0)) / count;
        let tallest = self.beside.iter().map(|panel| cell / panel.aspect() + TITLE);
        // No small panel is higher than the large one.
        let half = (all.height - below_height - GAP) / 2.0;
        let row_height = tallest.fold(0.0, f32::max).min(half);
        let large =
            Place { height: (all.height - below_height - row_height - GAP).max(1.0), ..all };
        let large = large.below_title().fitted(&self.large);
        let mut top = large.top + large.height + GAP;
        let mut places = vec![large];
        if let Some(below) = &self.below {
            let place = Place { top, height: below_height - GAP, ..all };
            let place = place.below_title().fitted(below);
            top = place.top + place.height + GAP;
            places.push(place);
        }
        for (at, panel) in self.beside.iter().enumerate() {
            let place =
                Place { left: at as f32 * (cell + GAP), top, width: cell, height: row_height };
            places.push(place.below_title().fitted(panel));
        }
        places
    }
}

/// What places show: their area. A small panel counts half, because it may be small.
fn score(places: &[Place]) -> f32 {
    let small: f32 = places.iter().skip(1).map(Place::area).sum();
    places.first().map_or(0.0, Place::area) + 0.5 * small
}

/// What a panel of this width at the left leaves.
fn right_of(all: Place, taken: f32) -> Place {
    Place { left: all.left + taken + GAP, width: (all.width - taken - GAP).max(1.0), ..all }
}

/// The lower end of the lowest place.
fn bottom(places: &[Place]) -> f32 {
    let bottoms = places.iter().map(|place| place.top + place.height);
    bottoms.fold(1.0, f32::max)
}

/// Panels below each other that share a height, each as wide as it may be.
fn column_of(panels: &[Panel], column: Place) -> Vec<Place> {
    let gaps = GAP * panels.len().saturating_sub(1) as f32;
    let wanted: f32 = panels.iter().map(|panel| column.width / panel.aspect() + TITLE).sum();
    let shrink = ((column.height - gaps) / wanted.max(1.0)).min(1.0);
    let mut top = column.top;
    let mut places = Vec::new();
    for panel in panels {
        let place =
            Place { top, height: (column.width / panel.aspect() + TITLE) * shrink, ..column };
        top += place.height + GAP;
        places.push(place.below_title().fitted(panel));
    }
    places
}

/// The ground of a label of this size beside its mark: inside the panel, upon no other label and not upon the mark.
pub fn label_place(
    at: [f32; 2],
    [width, height]: [f32; 2],
    panel: &Place,
    taken: &mut Vec<Place>,
) -> Place {
    const ROWS: [f32; 7] = [0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0];
    const APART: f32 = 2.0;
    let gap = MARK + 3.0;
    let right = at[0] + gap;
    let left = if right + width <= panel.left + panel.width {
        right
    } else {
        (at[0] - gap - width).max(panel.left)
    };
    let row = |rows: f32| Place {
        left,
        top: at[1] - height / 2.0 + rows * (height + APART),
        width,
        height,
    };
    let mark =
        Place { left: at[0] - MARK, top: at[1] - MARK, width: 2.0 * MARK, height: 2.0 * MARK };
    let is_free = |place: &Place| {
        let is_inside = place.top >= panel.top && place.top + height <= panel.top + panel.height;
        is_inside && !place.overlaps(&mark) && !taken.iter().any(|other| place.overlaps(other))
    };
    let place = ROWS.map(row).into_iter().find(is_free).unwrap_or(row(0.0));
    taken.push(place);
    place
}

/// The upper left end of a box in a corner of a panel that covers no mark; the lower left corner if all do.
pub fn free_corner(
    panel: &Place,
    [width, height]: [f32; 2],
    marks: impl Iterator<Item = [f32; 2]> + Clone,
) -> [f32; 2] {
    const EDGE: f32 = 4.0;
    let (left, top) = (panel.left + EDGE, panel.top + EDGE);
    let right = (panel.left + panel.width - EDGE - width).max(left);
    let bottom = (panel.top + panel.height - EDGE - height).max(top);
    let corners = [[left, bottom], [right, bottom], [left, top], [right, top]];
    let room = MARK + 3.0;
    let is_free = |corner: &&[f32; 2]| {
        marks.clone().all(|mark| {
            let [x, y] = [mark[0] - corner[0], mark[1] - corner[1]];
            x < -room || x > width + room || y < -room || y > height + room
        })
    };
    *corners.iter().find(is_free).unwrap_or(&corners[0])
}

/// Where the title above a place has to end: before the next place in the same row.
pub fn title_end(place: &Place, places: &[Place], width: f32) -> f32 {
    let rows = |other: &&Place| other.left > place.left && (other.top - place.top).abs() < 20.0;
    let next = places.iter().filter(rows).map(|other| other.left - GAP);
    next.fold(width, f32::min)
}
