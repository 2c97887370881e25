//! The turn, the shift and more that put depth edges on image edges.

use nalgebra::{Point2, Point3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::depth_edges::{Across, DepthEdge, depth_edges};
use super::view::{LEVELS, View};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;

/// A turn about x, y and z \[rad\], a shift along them \[m\], the logarithm of the focal length, and a delay \[s\].
const FREEDOMS: usize = 8;
pub(super) type Values = SVector<f64, FREEDOMS>;
type Squares = SMatrix<f64, FREEDOMS, FREEDOMS>;

pub(super) const POSE: [usize; 6] = [0, 1, 2, 3, 4, 5];
pub(super) const WITH_FOCAL_LENGTH: [usize; 7] = [0, 1, 2, 3, 4, 5, FOCAL_LENGTH];
pub(super) const FOCAL_LENGTH: usize = 6;
pub(super) const DELAY: usize = 7;

/// A view with its cloud and its depth edges, and how its camera moves.
pub(super) struct Frame {
    /// Its place in the scene.
    pub(super) at: usize,
    pub(super) view: View,
    /// In the camera's frame as stated \[m\].
    pub(super) points: Vec<Point3<f64>>,
    pub(super) edges: Vec<DepthEdge>,
    /// The camera's speed and turning in its own frame \[m/s, rad/s\].
    pub(super) motion: Option<[Vector3<f64>; 2]>,
}

impl Frame {
    /// Where its cloud is in the camera's frame, with these values.
    fn change(&self, values: &Values) -> Pose {
        let turn = UnitQuaternion::from_scaled_axis(values.fixed_rows::<3>(0));
        let change =
            Pose::from_parts(Translation3::from(values.fixed_rows::<3>(3).into_owned()), turn);
        match self.motion {
            // By then the camera has moved on.
            Some([speed, turning]) => {
                let by = -values[DELAY];
                change
                    * Pose::from_parts(
                        Translation3::from(speed * by),
                        UnitQuaternion::from_scaled_axis(turning * by),
                    )
            }
            None => change,
        }
    }

    fn camera(&self, values: &Values) -> Intrinsics {
        let times = values[FOCAL_LENGTH].exp();
        let camera = self.view.camera;
        Intrinsics { fx: camera.fx * times, fy: camera.fy * times, ..camera }
    }

    /// With the depth edges that these values show. The points of the edges stay as stated.
    pub(super) fn look(&mut self, values: &Values) {
        let change = self.change(values);
        let moved: Vec<Point3<f64>> = self.points.iter().map(|point| change * point).collect();
        self.edges = depth_edges(&self.camera(values), &moved);
        for edge in &mut self.edges {
            edge.point = change.inverse_transform_point(&edge.point);
        }
    }

    /// The depth edges of another cloud as stated.
    pub(super) fn edges_of(&self, cloud: &Cloud) -> Vec<DepthEdge> {
        let points: Vec<Point3<f64>> = cloud.points.iter().map(|point| point.cast()).collect();
        depth_edges(&self.view.camera, &points)
    }

    /// Where the photo shows the depth edges, with their depths \[m\].
    #[cfg(feature = "rerun")]
    pub(super) fn seen(
        &self,
        values: &Values,
    ) -> impl Iterator<Item = (nalgebra::Point2<f64>, f64)> {
        let (change, camera) = (self.change(values), self.camera(values));
        self.edges.iter().filter_map(move |edge| {
            let point = change * edge.point;
            Some((camera.project(&point)?, point.z))
        })
    }

    /// The strength of the photo's edges at the depth edges, summed.
    fn score(&self, level: usize, values: &Values) -> f64 {
        self.score_of(&self.edges, level, values)
    }

    /// The same at other depth edges.
    fn score_of(&self, edges: &[DepthEdge], level: usize, values: &Values) -> f64 {
        let (change, camera) = (self.change(values), self.camera(values));
        let (rotation, shift) = (change.rotation.to_rotation_matrix(), change.translation.vector);
        let strength = |edge: &DepthEdge| {
            let pixel = camera.project(&(rotation * edge.point + shift))?;
            Some(edge.weight * self.view.strength(level, edge.across, &pixel))
        };
        edges.iter().filter_map(strength).sum()
    }

    /// Where the depth edges are in the photo \[px\].
    fn pixels(&self, values: &Values) -> Vec<Option<Point2<f64>>> {
        let (change, camera) = (self.change(values), self.camera(values));
        let (rotation, shift) = (change.rotation.to_rotation_matrix(), change.translation.vector);
        let pixel = |edge: &DepthEdge| camera.project(&(rotation * edge.point + shift));
        self.edges.iter().map(pixel).collect()
    }

    /// The strength of the photo's edges on the finest map, where depth edges move across themselves alone, from these
    /// pixels. Along itself, an outline looks alike but for its ends, and these would draw it.
    fn score_across(&self, from: &[Option<Point2<f64>>], values: &Values) -> f64 {
        let mut sum = 0.0;
        for ((edge, from), to) in self.edges.iter().zip(from).zip(self.pixels(values)) {
            let (Some(from), Some(to)) = (from, to) else { continue };
            let pixel = match edge.across {
                Across::Columns => Point2::new(to.x, from.y),
                Across::Rows => Point2::new(from.x, to.y),
            };
            sum += edge.weight * self.view.strength(0, edge.across, &pixel);
        }
        sum
    }
}

/// All frames.
pub(super) fn total(frames: &[&Frame], level: usize, values: &Values) -> f64 {
    let scores: Vec<f64> = frames.par_iter().map(|frame| frame.score(level, values)).collect();
    scores.iter().sum()
}

/// The mean strength of a frame's photo at these depth edges.
pub(super) fn strength_in(frame: &Frame, edges: &[DepthEdge], values: &Values) -> f64 {
    let weights: f64 = edges.iter().map(|edge| edge.weight).sum();
    frame.score_of(edges, 0, values) / weights.max(f64::MIN_POSITIVE)
}

/// The mean strength at the depth edges.
pub(super) fn mean(frames: &[&Frame], values: &Values) -> f64 {
    let weights = frames.iter().flat_map(|frame| &frame.edges).map(|edge| edge.weight);
    total(frames, 0, values) / weights.sum::<f64>().max(f64::MIN_POSITIVE)
}

/// How much stronger the edges are with these values than as stated.
pub(super) fn gain(frames: &[&Frame], values: &Values) -> f64 {
    total(frames, 0, values) - total(frames, 0, &Values::zeros())
}

/// The value of each freedom that moves depth edges by a pixel of the finest map, on average; 0 if none does.
pub(super) fn units(frames: &[&Frame]) -> Values {
    let (mut sums, mut count) = (Values::zeros(), 0.0);
    for frame in frames {
        let f = frame.view.camera.fx / frame.view.reduced;
        let speed = frame.motion.map_or(0.0, |[speed, _]| speed.norm());
        for edge in &frame.edges {
            let z = edge.point.z;
            let aside = (edge.point.x / z).hypot(edge.point.y / z);
            let moves = [1.0, 1.0, aside, 1.0 / z, 1.0 / z, aside / z, aside, aside / z * speed];
            sums += Values::from(moves) * f;
            count += 1.0;
        }
    }
    sums.map(|sum| if sum > 0.0 { count / sum } else { 0.0 })
}

/// The values that fit best, with all frames' depth edges as these values show them. Several starts are tried, since a
/// photo has more edges than those of depths.
pub(super) fn best(frames: &mut [Frame], free: &[usize]) -> Values {
    /// Starts of the search, and of those the ones that are looked at anew.
    const STARTS: usize = 6;
    const LOOKED_AT: usize = 3;
    const LOOKS: usize = 3;
    let all: Vec<&Frame> = frames.iter().collect();
    let starts = turns(&all, STARTS).into_iter().map(|start| climbed(&all, free, start, LEVELS));
    let near = start_focal_lengths(free).map(|start| climbed(&all, free, start, 2));
    let found = starts.chain(near);
    let mut found: Vec<Values> = found.map(|start| refined(&all, free, start)).collect();
    let unit = units(&all);
    found.sort_by(|one, other| total(&all, 0, other).total_cmp(&total(&all, 0, one)));
    found.dedup_by(|next, kept| free.iter().all(|&at| (next[at] - kept[at]).abs() < unit[at]));
    found.truncate(LOOKED_AT);
    let mut best: Option<(f64, Values)> = None;
    for start in found {
        let mut values = start;
        for _ in 0..LOOKS {
            frames.par_iter_mut().for_each(|frame| frame.look(&values));
            let all: Vec<&Frame> = frames.iter().collect();
            values = refined(&all, free, climbed(&all, free, values, 1));
        }
        let score = total(&frames.iter().collect::<Vec<_>>(), 0, &values);
        if best.is_none_or(|(most, _)| score > most) {
            best = Some((score, values));
        }
    }
    let values = best.map_or_else(Values::zeros, |(_, values)| values);
    frames.par_iter_mut().for_each(|frame| frame.look(&values));
    values
}

/// The calibration as stated, with several focal lengths if that is free.
fn start_focal_lengths(free: &[usize]) -> impl Iterator<Item = Values> {
    const TIMES: [f64; 5] = [0.0, -0.03, 0.03, -0.06, 0.06];
    let count = if free.contains(&FOCAL_LENGTH) { TIMES.len() } else { 1 };
    TIMES.into_iter().take(count).map(|times| {
        let mut start = Values::zeros();
        start[FOCAL_LENGTH] = times;
        start
    })
}

/// The delay that fits best, if nothing else is off.
pub(super) fn delay(frames: &mut [Frame]) -> Values {
    /// From here the search begins, in pixels.
    const STARTS_PX: [f64; 7] = [-18.0, -12.0, -6.0, 0.0, 6.0, 12.0, 18.0];
    let mut values = Values::zeros();
    for starts in [&STARTS_PX[..], &[0.0]] {
        let all: Vec<&Frame> = frames.iter().collect();
        let unit = units(&all)[DELAY];
        let ends = starts.iter().map(|start| {
            let mut start_values = values;
            start_values[DELAY] += start * unit;
            let end = refined(&all, &[DELAY], climbed(&all, &[DELAY], start_values, 2));
            (mean(&all, &end), end)
        });
        if let Some((_, end)) = ends.reduce(|best, next| if next.0 > best.0 { next } else { best })
        {
            values = end;
        }
        frames.par_iter_mut().for_each(|frame| frame.look(&values));
    }
    values
}

/// The best turns of a coarse grid. A shift looks like a turn from afar.
pub(super) fn turns(frames: &[&Frame], count: usize) -> Vec<Values> {
    const LEVEL: usize = LEVELS - 1;
    const REACH: [f64; 3] = [0.07, 0.07, 0.06];
    /// Starts that are closer in steps lead to the same end.
    const BESIDE: f64 = 1.5;
    let unit = units(frames) * f64::from(1 << LEVEL);
    let steps = |axis: usize| {
        let most = if unit[axis] > 0.0 { (REACH[axis] / unit[axis]).ceil() as i32 } else { 0 };
        (-most..=most).map(move |step| f64::from(step) * unit[axis])
    };
    let grid = steps(0).flat_map(|x| steps(1).map(move |y| (x, y)));
    let grid = grid.flat_map(|(x, y)| steps(2).map(move |z| [x, y, z]));
    let grid: Vec<[f64; 3]> = grid.collect();
    let scored = grid.par_iter().map(|turn| {
        let mut values = Values::zeros();
        values.as_mut_slice()[..3].copy_from_slice(turn);
        let scores = frames.iter().map(|frame| frame.score(LEVEL, &values));
        (scores.sum::<f64>(), values)
    });
    let mut scored: Vec<(f64, Values)> = scored.collect();
    scored.sort_by(|one, other| other.0.total_cmp(&one.0));
    let mut found: Vec<Values> = Vec::new();
    for (_, values) in scored {
        let is_beside = |known: &Values| {
            (0..3).all(|axis| (values[axis] - known[axis]).abs() < BESIDE * unit[axis])
        };
        if found.len() < count && !found.iter().any(is_beside) {
            found.push(values);
        }
    }
    found
}

/// Climbs along single freedoms, and along the way of the last round as long as that helps: on the most blurred of so
/// many levels first.
pub(super) fn climbed(frames: &[&Frame], free: &[usize], start: Values, levels: usize) -> Values {
    /// In pixels of the level's map.
    const FIRST_STEP: f64 = 2.0;
    const LAST_STEP: f64 = 0.5;
    const ROUNDS: usize = 100;
    let unit = units(frames);
    let mut best = start;
    for level in (0..levels).rev() {
        let pixel = f64::from(1 << level);
        let of = |values: &Values| total(frames, level, values);
        let (mut step, mut most) = (FIRST_STEP, of(&best));
        for _ in 0..ROUNDS {
            let before = best;
            for &freedom in free {
                for sign in [1.0, -1.0] {
                    let mut tried = best;
                    tried[freedom] += sign * step * pixel * unit[freedom];
                    let score = of(&tried);
                    if score > most {
                        (best, most) = (tried, score);
                        break;
                    }
                }
            }
            let way = best - before;
            if way == Values::zeros() {
                step /= 2.0;
                if step < LAST_STEP {
                    break;
                }
            }
            for _ in 0..ROUNDS {
                let tried = best + way;
                let score = of(&tried);
                if score <= most {
                    break;
                }
                (best, most) = (tried, score);
            }
        }
    }
    best
}

/// Newton's method, from values that are a pixel or two off. Differences over a pixel smooth the score.
pub(super) fn refined(frames: &[&Frame], free: &[usize], start: Values) -> Values {
    const STEPS: usize = 12;
    const LONGEST_PX: f64 = 1.0;
    const EXACT_PX: f64 = 0.01;
    let unit = units(frames);
    let mut values = start;
    for _ in 0..STEPS {
        let (slope, bend) = derivatives(frames, free, &unit, &values);
        let mut step = inverted(&bend, free) * slope;
        let longest = step.amax();
        step *= (LONGEST_PX / longest.max(LONGEST_PX)).min(1.0);
        values += step.component_mul(&unit);
        if longest < EXACT_PX {
            break;
        }
    }
    values
}

/// The first and the negative second derivatives of the score, by differences \[per pixel\].
fn derivatives(frames: &[&Frame], free: &[usize], unit: &Values, at: &Values) -> (Values, Squares) {
    /// \[px\]
    const STEP: f64 = 0.75;
    let each = |frame: &&Frame| {
        let from = frame.pixels(at);
        let of = |changes: &[(usize, f64)]| {
            let mut values = *at;
            for &(freedom, by) in changes {
                values[freedom] += by * STEP * unit[freedom];
            }
            frame.score_across(&from, &values)
        };
        let here = of(&[]);
        let (mut slope, mut bend) = (Values::zeros(), Squares::zeros());
        for (place, &one) in free.iter().enumerate() {
            let (up, down) = (of(&[(one, 1.0)]), of(&[(one, -1.0)]));
            slope[one] = (up - down) / (2.0 * STEP);
            bend[(one, one)] = -(up - 2.0 * here + down) / STEP.powi(2);
            for &other in &free[..place] {
                let side = |a: f64, b: f64| of(&[(one, a), (other, b)]);
                let mixed = side(1.0, 1.0) - side(1.0, -1.0) - side(-1.0, 1.0) + side(-1.0, -1.0);
                bend[(one, other)] = -mixed / (4.0 * STEP.powi(2));
                bend[(other, one)] = bend[(one, other)];
            }
        }
        (slope, bend)
    };
    let each: Vec<(Values, Squares)> = frames.par_iter().map(each).collect();
    each.into_iter()
        .fold((Values::zeros(), Squares::zeros()), |sum, one| (sum.0 + one.0, sum.1 + one.1))
}

/// The inverse among the free freedoms, damped until there is one.
fn inverted(bend: &Squares, free: &[usize]) -> Squares {
    const FIRST_DAMPING: f64 = 0.01;
    const TIMES: f64 = 4.0;
    const TRIES: usize = 20;
    let mut damping = FIRST_DAMPING;
    for _ in 0..TRIES {
        let mut damped = Squares::identity();
        for &one in free {
            for &other in free {
                damped[(one, other)] = bend[(one, other)];
            }
            damped[(one, one)] += damping * bend[(one, one)].abs() + f64::EPSILON;
        }
        if let Some(found) = damped.cholesky() {
            let whole = found.inverse();
            let mut inverse = Squares::zeros();
            for &one in free {
                for &other in free {
                    inverse[(one, other)] = whole[(one, other)];
                }
            }
            return inverse;
        }
        damping *= TIMES;
    }
    Squares::zeros()
}

/// The standard deviations of the best values by how they change without one block of frames after the other; frames
/// beside each other see the same things.
pub(super) fn spread(frames: &[&Frame], free: &[usize], at: &Values) -> Values {
    const BLOCKS: usize = 10;
    let blocks = BLOCKS.min(frames.len());
    let without = |block: usize| {
        let rest =
            frames.iter().enumerate().filter(|(place, _)| place * blocks / frames.len() != block);
        let rest: Vec<&Frame> = rest.map(|(_, frame)| *frame).collect();
        refined(&rest, free, *at)
    };
    let found: Vec<Values> = (0..blocks).map(without).collect();
    let mean = found.iter().sum::<Values>() / blocks as f64;
    let squares: Values = found.iter().map(|one| (one - mean).component_mul(&(one - mean))).sum();
    (squares * (blocks as f64 - 1.0) / blocks as f64).map(f64::sqrt)
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};

    use super::*;

    /// An outline on an edge of a photo, down to where the edge ends.
    fn frame() -> Frame {
        let (width, height) = (400, 200);
        let camera = Intrinsics { fx: 300.0, fy: 300.0, cx: 199.5, cy: 99.5, width, height };
        let photo = GrayImage::from_fn(width, height, |x, y| {
            Luma([if x < 200 || y >= 100 { 40 } else { 200 }])
        });
        let outline = |row: i32| DepthEdge {
            point: camera.unproject(&Point2::new(199.5, f64::from(row)), 10.0),
            across: Across::Columns,
            weight: 1.0,
        };
        Frame {
            at: 0,
            view: View::new(&photo, camera),
            points: Vec::new(),
            edges: (40..98).map(outline).collect(),
            motion: None,
        }
    }

    fn turned(axis: usize) -> Values {
        let mut values = Values::zeros();
        values[axis] = -0.01;
        values
    }

    #[test]
    fn an_outline_is_not_drawn_along_itself() {
        let frame = frame();
        let from = frame.pixels(&Values::zeros());
        let change = |values: &Values| {
            let across =
                frame.score_across(&from, values) - frame.score_across(&from, &Values::zeros());
            [across, frame.score(0, values) - frame.score(0, &Values::zeros())]
        };
        let [across, all] = change(&turned(0));
        assert!(across.abs() < 1e-6 && all.abs() > 0.1, "down: {across} of {all}");
        let [across, all] = change(&turned(1));
        assert!(across < -10.0 && (across - all).abs() < 0.1, "aside: {across} of {all}");
    }

    #[test]
    fn the_search_begins_at_turns_that_lie_apart() {
        let frame = frame();
        let all = [&frame];
        let step = units(&all) * f64::from(1 << (LEVELS - 1));
        let starts = turns(&all, 6);
        assert_eq!(starts.len(), 6);
        for (place, one) in starts.iter().enumerate() {
            for other in &starts[..place] {
                let is_apart =
                    (0..3).any(|axis| (one[axis] - other[axis]).abs() > 1.4 * step[axis]);
                assert!(is_apart, "{one} and {other}");
            }
        }
    }
}
