//! Collects the points of a cloud file relative to a local origin, and leaves out what is no point.

use std::fmt;

use nalgebra::{Point3, Vector3};

use super::super::lines::is_near;
use super::{MAX_POINTS, MapCloud};

/// The points whose median is the local origin: a few stray points among them do not move it.
const SAMPLE: usize = 65_536;

/// Takes the points of a file one by one.
#[derive(Default)]
pub(super) struct Collector {
    /// The points, until the origin is known.
    sample: Vec<[f64; 3]>,
    origin: Option<Vector3<f64>>,
    points: Vec<Point3<f32>>,
    axes: [Axis; 3],
    /// The number of points at 0 0 0, and how many points precede the first of them.
    zeros: usize,
    before_zero: usize,
    /// The number of points that the format itself calls beams without return.
    without_return: usize,
    /// The number of points without finite coordinates, or with those of no place.
    without_number: usize,
}

/// Something that a reader noticed and that its user should know.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::scene) enum Note {
    /// So many points at 0 0 0 were left out.
    NoReturn(usize),
    /// So many points without finite coordinates were left out.
    WithoutNumber(usize),
    /// Coordinates of about this size \[m\] have this step \[m\].
    Coarse { size: f64, step: f64 },
}

impl Note {
    /// The note on a file in a unit of this length \[m\], if it holds in metres.
    pub fn in_metres(self, unit_m: f64) -> Option<Self> {
        match self {
            Self::Coarse { size, step } => (step * unit_m >= FINE)
                .then_some(Self::Coarse { size: size * unit_m, step: step * unit_m }),
            other => Some(other),
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoReturn(count) => {
                write!(f, "points at 0 0 0 are beams without return and left out: {count}")
            }
            Self::WithoutNumber(count) => {
                write!(f, "points without finite coordinates are left out: {count}")
            }
            Self::Coarse { size, step } => write!(
                f,
                "coordinates near {size:.0} m have steps of {step} m, as 32-bit numbers of this size have; \
                 export the cloud in 64-bit numbers or with an offset"
            ),
        }
    }
}

impl Collector {
    /// Adds a point \[m\].
    pub fn add(&mut self, point: [f64; 3]) -> Result<(), String> {
        if self.zeros + self.without_return + self.without_number > MAX_POINTS {
            return Err(format!(
                "at most {MAX_POINTS} points to leave out expected; thin the cloud"
            ));
        }
        if !point.iter().all(is_near) {
            self.without_number += 1;
            return Ok(());
        }
        let before = self.sample.len() + self.points.len();
        if point == [0.0; 3] {
            if self.zeros == 0 {
                self.before_zero = before;
            }
            self.zeros += 1;
            return Ok(());
        }
        if before == MAX_POINTS {
            return Err(format!("at most {MAX_POINTS} points expected; split or thin the cloud"));
        }
        for (axis, coordinate) in self.axes.iter_mut().zip(point) {
            axis.add(coordinate);
        }
        match self.origin {
            Some(origin) => self.points.push(relative(point, origin)),
            None => {
                self.sample.push(point);
                if self.sample.len() == SAMPLE {
                    self.fix_origin();
                }
            }
        }
        Ok(())
    }

    /// Leaves out a beam that returned nothing, as a format says it.
    pub fn add_no_return(&mut self) {
        self.without_return += 1;
    }

    /// The origin is the median of the sample, rounded to metres.
    fn fix_origin(&mut self) -> Vector3<f64> {
        let median = |axis: usize| {
            let mut along: Vec<f64> = self.sample.iter().map(|point| point[axis]).collect();
            let middle = along.len() / 2;
            if along.is_empty() {
                return 0.0;
            }
            along.select_nth_unstable_by(middle, f64::total_cmp).1.round()
        };
        let origin = Vector3::from([0, 1, 2].map(median));
        self.points.extend(self.sample.drain(..).map(|point| relative(point, origin)));
        self.sample = Vec::new();
        self.origin = Some(origin);
        origin
    }

    /// The cloud of all points.
    pub fn finish(mut self) -> MapCloud {
        let origin = self.origin.unwrap_or_else(|| self.fix_origin());
        let mut notes = Vec::new();
        // One point at 0 0 0 may be a point like others. Several are beams without return.
        if self.zeros == 1 && self.axes.iter().all(Axis::is_near_zero) {
            self.points.insert(self.before_zero, relative([0.0; 3], origin));
            self.zeros = 0;
        }
        if self.zeros + self.without_return > 0 {
            notes.push(Note::NoReturn(self.zeros + self.without_return));
        }
        if self.without_number > 0 {
            notes.push(Note::WithoutNumber(self.without_number));
        }
        notes.extend(coarse(&self.axes));
        let extent = self.axes.map(|axis| (axis.least, axis.most));
        MapCloud { origin, points: self.points, extent, notes }
    }
}

fn relative(point: [f64; 3], origin: Vector3<f64>) -> Point3<f32> {
    Point3::from(Vector3::from(point) - origin).cast()
}

/// The coordinates along an axis.
struct Axis {
    least: f64,
    most: f64,
    /// All coordinates as multiples of [`FINE`], their bits combined; `None` if one is no multiple.
    multiples: Option<u64>,
}

/// Coordinates that are multiples of a coarser power of two are counted as coarse \[m\].
const FINE: f64 = 1.0 / 64.0;

impl Default for Axis {
    fn default() -> Self {
        Self { least: f64::INFINITY, most: f64::NEG_INFINITY, multiples: Some(0) }
    }
}

impl Axis {
    fn add(&mut self, coordinate: f64) {
        self.least = self.least.min(coordinate);
        self.most = self.most.max(coordinate);
        if let Some(bits) = self.multiples {
            let multiple = (coordinate / FINE).abs();
            self.multiples = (multiple.fract() == 0.0).then_some(bits | multiple as u64);
        }
    }

    /// Whether 0 is within the coordinates or no further from them than they are from each other.
    fn is_near_zero(&self) -> bool {
        let across = self.most - self.least;
        (self.least - across..=self.most + across).contains(&0.0)
    }

    /// The largest coordinate without its sign.
    fn size(&self) -> f64 {
        self.least.abs().max(self.most.abs())
    }

    /// The largest power of two that all coordinates are multiples of, if it is at least [`FINE`] \[m\].
    fn step(&self) -> Option<f64> {
        let bits = self.multiples.filter(|bits| *bits != 0)?;
        Some(FINE * 2_f64.powi(bits.trailing_zeros() as i32))
    }
}

/// The note on coordinates that 32-bit numbers rounded coarsely, if they did.
///
/// Their steps grow with the coordinates. Points on a grid have the same step along all axes.
fn coarse(axes: &[Axis; 3]) -> Option<Note> {
    let rounded = axes.iter().filter(|axis| single_step(axis.size()) >= FINE);
    let steps = rounded.map(|axis| {
        let step = axis.step().filter(|step| *step <= single_step(axis.size()))?;
        Some((axis.size(), step))
    });
    let steps: Vec<(f64, f64)> = steps.collect::<Option<_>>()?;
    let (size, step) = steps.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Note::Coarse { size, step })
}

/// The distance of a number from the next 32-bit number.
fn single_step(size: f64) -> f64 {
    let single = size as f32;
    f64::from(single.next_up()) - f64::from(single)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map as surveyors have it, a tenth of a millimetre fine.
    fn map() -> Vec<[f64; 3]> {
        let point = |at: i32| {
            let along = f64::from(at);
            [691_234.0 + 0.1237 * along, 5_334_567.0 - 0.0719 * along, 512.0 + 0.0013 * along]
        };
        (0..2_000).map(point).collect()
    }

    fn collected(points: &[[f64; 3]]) -> MapCloud {
        let mut collector = Collector::default();
        for point in points {
            collector.add(*point).expect("few points");
        }
        collector.finish()
    }

    fn worst_m(cloud: &MapCloud, expected: &[[f64; 3]]) -> f64 {
        assert_eq!(cloud.points.len(), expected.len());
        let pairs = cloud.positions().zip(expected);
        pairs.map(|(a, b)| (a - Point3::from(*b)).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn stray_points_before_a_map_do_not_make_it_coarser() {
        let map = map();
        let clean = collected(&map);
        assert_eq!(clean.notes, []);
        assert!(worst_m(&clean, &map) < 1e-3);
        for count in [1, 5, 500] {
            let with_zeros = [vec![[0.0; 3]; count], map.clone()].concat();
            let cloud = collected(&with_zeros);
            assert_eq!(cloud.notes, [Note::NoReturn(count)]);
            assert_eq!(cloud.points, clean.points);
            // Others are not known to be no points.
            let strays = [vec![[-9999.0, 0.5, 0.0]; count], map.clone()].concat();
            let cloud = collected(&strays);
            assert_eq!(cloud.notes, []);
            let kept: Vec<_> = cloud.positions().skip(count).collect();
            let worst = kept.iter().zip(&map).map(|(a, b)| (a - Point3::from(*b)).norm());
            assert!(worst.fold(0.0, f64::max) < 1e-3);
        }
    }

    #[test]
    fn a_point_at_the_origin_of_a_local_map_stays_where_it_is() {
        let local = [[1.0, 2.0, 0.5], [0.0; 3], [-1.0, 0.25, -0.5]];
        let cloud = collected(&local);
        assert_eq!(cloud.notes, []);
        assert!(worst_m(&cloud, &local) < 1e-6);
        let twice = collected(&[local[0], [0.0; 3], [0.0; 3], local[2]]);
        assert_eq!(twice.notes, [Note::NoReturn(2)]);
        assert!(worst_m(&twice, &[local[0], local[2]]) < 1e-6);
        let nothing = collected(&[[0.0; 3]]);
        assert_eq!((nothing.points.len(), nothing.notes), (0, vec![Note::NoReturn(1)]));
    }

    #[test]
    fn points_beyond_the_sample_have_the_same_origin() {
        let many: Vec<[f64; 3]> = map().into_iter().cycle().take(SAMPLE + 3_000).collect();
        let cloud = collected(&many);
        assert!(worst_m(&cloud, &many) < 1e-3);
    }

    #[test]
    fn points_without_numbers_are_counted() {
        let cloud = collected(&[[1.0, f64::NAN, 2.0], [f64::INFINITY; 3], [1.0, 2.0, 3.0]]);
        assert_eq!((cloud.points.len(), cloud.notes), (1, vec![Note::WithoutNumber(2)]));
    }

    #[test]
    fn the_steps_of_single_numbers_are_named_and_a_grid_is_left_alone() {
        let single = |point: [f64; 3]| point.map(|coordinate| f64::from(coordinate as f32));
        let rounded: Vec<_> = map().into_iter().map(single).collect();
        let notes = collected(&rounded).notes;
        assert!(
            matches!(notes[..], [Note::Coarse { size, step: 0.5 }] if (size - 5_334_567.0).abs() < 1.0),
            "{notes:?}"
        );
        let half_metres = |[x, y, z]: [f64; 3]| [x, y, z].map(|along| (2.0 * along).round() / 2.0);
        let grid: Vec<_> = map().into_iter().map(half_metres).collect();
        assert_eq!(collected(&grid).notes, []);
        let near: Vec<_> = map().iter().map(|[x, ..]| single([x - 691_000.0, 2.5, 1.0])).collect();
        assert_eq!(collected(&near).notes, []);
    }
}
