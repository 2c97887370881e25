//! The streets of the town: their axes, and where a point of the plan lies relative to the kerb.

use nalgebra::{Point2, Vector2};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

use super::path::{Path, Vertex, right_of};

/// Half the width of the carriageway, kerb to kerb \[m\].
pub(super) const HALF_WIDTH: f64 = 4.4;
/// Width of the pavement, kerb included \[m\].
pub(super) const PAVEMENT: f64 = 2.2;

/// Points farther from the kerb than this are plain land \[m\].
const REACH: f64 = 8.0;
const CELL: f64 = 8.0;
/// How far streets go on beyond the crossings at their ends \[m\].
const SIDE_STREET: f64 = 42.0;
/// Kerbs at crossings are rounded where the distances to two streets differ by less \[m\].
const ROUNDING: f64 = 7.0;
/// Radius at which a car turns off \[m\].
const TURN_RADIUS: f64 = 9.0;
const BEND_RADIUS: f64 = 70.0;

/// A street: its axis and where others cross it.
#[derive(Debug)]
pub(super) struct Street {
    /// The axis.
    pub(super) axis: Path,
    /// Stations of the crossings with other streets \[m\].
    pub(super) crossings: [f64; 2],
}

impl Street {
    /// Distance along the axis to the nearest crossing \[m\].
    pub(super) fn to_crossing(&self, station: f64) -> f64 {
        let [first, second] = self.crossings;
        (station - first).abs().min((station - second).abs())
    }
}

#[derive(Clone, Copy, Debug)]
struct Segment {
    from: Point2<f64>,
    heading: Vector2<f64>,
    length: f64,
    station: f64,
    street: u16,
}

impl Segment {
    /// Distance of `p`, and the position along the segment nearest to it.
    #[inline]
    fn nearest(&self, p: Point2<f64>) -> (f64, f64) {
        let offset = p - self.from;
        let along = offset.dot(&self.heading).clamp(0.0, self.length);
        ((offset - self.heading * along).norm(), along)
    }
}

/// Where a point lies relative to the nearest street.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// Distance from the kerb \[m\], negative on the carriageway.
    pub(super) from_kerb: f64,
    /// Index of the nearest street.
    pub(super) street: usize,
    /// Station on its axis \[m\].
    pub(super) station: f64,
    /// Distance to the right of its axis \[m\].
    pub(super) lateral: f64,
}

/// All streets, with an index for [`Network::place`].
#[derive(Debug)]
pub(super) struct Network {
    /// The streets.
    pub(super) streets: Vec<Street>,
    /// The closed line along the street axes which the car follows.
    pub(super) circuit: Path,
    segments: Vec<Segment>,
    origin: Point2<f64>,
    columns: usize,
    rows: usize,
    /// Per cell, the range of `members` that lists the segments near it.
    cells: Vec<(u32, u32)>,
    members: Vec<u16>,
}

impl Network {
    /// The network of a seed: an L-shaped circuit of six bent streets that cross at its corners.
    pub(super) fn new(seed: u64) -> Self {
        let corners = corners(seed);
        let circuit = Path::closed(&corners);
        let streets = streets(&corners);
        let segments = segments(&streets);
        let mut network = Self {
            streets,
            circuit,
            segments,
            origin: Point2::origin(),
            columns: 0,
            rows: 0,
            cells: Vec::new(),
            members: Vec::new(),
        };
        network.index();
        network
    }

    /// Where `p` lies, or `None` on land that no street reaches.
    #[inline]
    pub(super) fn place(&self, p: Point2<f64>) -> Option<Place> {
        let cell = (p - self.origin) / CELL;
        if cell.x < 0.0 || cell.y < 0.0 {
            return None;
        }
        let (column, row) = (cell.x as usize, cell.y as usize);
        if column >= self.columns || row >= self.rows {
            return None;
        }
        let (begin, end) = self.cells[row * self.columns + column];
        let mut best: Option<(f64, f64, &Segment)> = None;
        let mut other = f64::INFINITY;
        for &member in &self.members[begin as usize..end as usize] {
            let segment = &self.segments[usize::from(member)];
            let (distance, along) = segment.nearest(p);
            match best {
                Some((least, _, nearest)) if distance >= least => {
                    if nearest.street != segment.street {
                        other = other.min(distance);
                    }
                }
                _ => {
                    if let Some((least, _, nearest)) = best
                        && nearest.street != segment.street
                    {
                        other = other.min(least);
                    }
                    best = Some((distance, along, segment));
                }
            }
        }
        best.map(|(distance, along, segment)| {
            let overlap = (1.0 - (other - distance) / ROUNDING).max(0.0);
            let offset = p - segment.from;
            Place {
                from_kerb: distance - 0.25 * ROUNDING * overlap * overlap - HALF_WIDTH,
                street: usize::from(segment.street),
                station: segment.station + along,
                lateral: offset.dot(&right_of(segment.heading)),
            }
        })
    }

    /// Distance of `p` from the nearest kerb \[m\], negative on the carriageway; infinite far off.
    pub(super) fn kerb_distance(&self, p: Point2<f64>) -> f64 {
        self.place(p).map_or(f64::INFINITY, |place| place.from_kerb)
    }

    /// Lists for every cell the segments that matter there.
    fn index(&mut self) {
        let margin = HALF_WIDTH + REACH;
        let ends = || self.segments.iter().flat_map(|s| [s.from, s.from + s.heading * s.length]);
        let low = ends().fold(Point2::new(f64::MAX, f64::MAX), |a, b| a.inf(&b));
        let high = ends().fold(Point2::new(f64::MIN, f64::MIN), |a, b| a.sup(&b));
        self.origin = low - Vector2::repeat(margin);
        let extent = (high - low + Vector2::repeat(2.0 * margin)) / CELL;
        self.columns = extent.x.ceil() as usize;
        self.rows = extent.y.ceil() as usize;
        let half_diagonal = CELL * std::f64::consts::FRAC_1_SQRT_2;
        for cell in 0..self.columns * self.rows {
            let (column, row) = (cell % self.columns, cell / self.columns);
            let centre = self.origin + Vector2::new(column as f64 + 0.5, row as f64 + 0.5) * CELL;
            let begin = self.members.len() as u32;
            for (i, segment) in (0_u16..).zip(&self.segments) {
                if segment.nearest(centre).0 < margin + half_diagonal {
                    self.members.push(i);
                }
            }
            self.cells.push((begin, self.members.len() as u32));
        }
    }
}

/// The vertices of the circuit; those with [`TURN_RADIUS`] are crossings.
fn corners(seed: u64) -> Vec<Vertex> {
    const PLAN: [(f64, f64, f64); 10] = [
        (0.0, 55.0, BEND_RADIUS),
        (-14.0, 125.0, TURN_RADIUS),
        (70.0, 135.0, BEND_RADIUS),
        (150.0, 118.0, TURN_RADIUS),
        (140.0, 48.0, TURN_RADIUS),
        (215.0, 40.0, TURN_RADIUS),
        (222.0, -15.0, BEND_RADIUS),
        (210.0, -70.0, TURN_RADIUS),
        (105.0, -55.0, BEND_RADIUS),
        (0.0, -55.0, TURN_RADIUS),
    ];
    let mut rng = Pcg32::seed_from_u64(seed);
    let vertex = |(i, &(x, z, radius)): (usize, &(f64, f64, f64))| {
        // The first side stays where it is: the journey begins on it, at the origin.
        let slack = if i == 0 || i + 1 == PLAN.len() { 0.0 } else { 4.0 };
        let jitter: [f64; 2] = std::array::from_fn(|_| rng.random_range(-1.0..1.0) * slack);
        Vertex { position: Point2::new(x + jitter[0], z + jitter[1]), radius }
    };
    PLAN.iter().enumerate().map(vertex).collect()
}

/// One street for every stretch of the circuit between two crossings.
fn streets(corners: &[Vertex]) -> Vec<Street> {
    let crossings: Vec<usize> =
        (0..corners.len()).filter(|&i| corners[i].radius == TURN_RADIUS).collect();
    let between = |k: usize| {
        let begin = crossings[k];
        let end = crossings[(k + 1) % crossings.len()];
        let count = (end + corners.len() - begin) % corners.len();
        let mut chain: Vec<Vertex> =
            (0..=count).map(|i| corners[(begin + i) % corners.len()]).collect();
        let outward = |from: &Vertex, to: &Vertex| Vertex {
            position: to.position + (to.position - from.position).normalize() * SIDE_STREET,
            radius: 0.0,
        };
        chain[0] = outward(&chain[1], &chain[0]);
        chain[count] = outward(&chain[count - 1], &chain[count]);
        let axis = Path::open(&chain);
        let crossings = [SIDE_STREET, axis.length() - SIDE_STREET];
        Street { axis, crossings }
    };
    (0..crossings.len()).map(between).collect()
}

fn segments(streets: &[Street]) -> Vec<Segment> {
    let of_street = |(index, street): (u16, &Street)| -> Vec<Segment> {
        let chord = |ends: &[f64]| {
            let from = street.axis.at(ends[0]).position;
            let chord = street.axis.at(ends[1]).position - from;
            Segment {
                from,
                heading: chord.normalize(),
                length: chord.norm(),
                station: ends[0],
                street: index,
            }
        };
        street.axis.knots().windows(2).map(chord).collect()
    };
    (0_u16..).zip(streets).flat_map(of_street).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_beside_the_axis_is_placed_where_it_is() {
        let network = Network::new(3);
        for (index, street) in network.streets.iter().enumerate() {
            let station = 0.5 * street.axis.length();
            let place = network.place(street.axis.at(station).beside(3.0)).expect("near a street");
            assert_eq!(place.street, index);
            assert!((place.station - station).abs() < 0.2);
            assert!((place.lateral - 3.0).abs() < 0.02);
            assert!((place.from_kerb - (3.0 - HALF_WIDTH)).abs() < 0.02);
        }
    }

    #[test]
    fn the_circuit_has_sharp_turns_both_ways_and_gentle_bends() {
        for seed in 0..10 {
            let vertices = corners(seed);
            let at = |i: usize| vertices[i % vertices.len()];
            let mut turns: Vec<f64> = Vec::new();
            for i in 0..vertices.len() {
                let into = at(i + 1).position - at(i).position;
                let out = at(i + 2).position - at(i + 1).position;
                let turn = out.dot(&right_of(into)).atan2(out.dot(&into)).to_degrees();
                let sharp = at(i + 1).radius == TURN_RADIUS;
                assert!(if sharp { turn.abs() >= 60.0 } else { turn.abs() < 40.0 });
                turns.push(turn);
            }
            assert!(turns.iter().any(|&t| t > 60.0) && turns.iter().any(|&t| t < -60.0));
            assert!((turns.iter().sum::<f64>() - 360.0).abs() < 1e-6);
        }
    }

    #[test]
    fn the_circuit_stays_on_the_carriageway() {
        for seed in 0..10 {
            let network = Network::new(seed);
            let length = network.circuit.length();
            assert!(length > 600.0);
            let mut along = 0.0;
            while along < length {
                let station = network.circuit.at(along);
                assert!(network.kerb_distance(station.position) < -2.5, "at {along} m");
                along += 1.0;
            }
        }
    }

    #[test]
    fn land_far_from_streets_has_no_place() {
        let network = Network::new(3);
        assert!(network.place(Point2::new(1e4, 0.0)).is_none());
        assert!(network.place(Point2::new(-1e4, 0.0)).is_none());
        assert_eq!(network.kerb_distance(Point2::new(60.0, 40.0)), f64::INFINITY);
    }
}
