//! Where the depth of a cloud jumps: at the outlines of things.

use std::collections::BTreeMap;

use nalgebra::{Point2, Point3};

use crate::camera::Intrinsics;

/// Which way the depth changes across a depth edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Across {
    /// From left to right, as at the trunk of a tree.
    Columns,
    /// From top to bottom, as at the roof of a car.
    Rows,
}

impl Across {
    /// Edges across rows count less: horizons, kerbs and the rings of a scan are beside many other edges of photos.
    fn weight(self) -> f64 {
        match self {
            Self::Columns => 1.0,
            Self::Rows => 0.3,
        }
    }
}

/// A place on the outline of the nearer of two things.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthEdge {
    /// In the camera's frame \[m\].
    pub(super) point: Point3<f64>,
    pub(super) across: Across,
    /// How much it counts: less where the points beside it are far apart.
    pub(super) weight: f64,
}

/// A point in the photo.
#[derive(Clone, Copy)]
struct Seen {
    pixel: Point2<f64>,
    depth: f64,
}

/// One of the coordinates of a point \[px\].
type Coordinate = fn(&Seen) -> f64;

/// Strips along the photo's width: rings of a scan of 64 beams are hardly closer.
const STRIPS: f64 = 400.0;
/// The depths of neighbouring points of one surface differ by less, as a share.
const SMOOTH: f64 = 0.05;
/// The least depth of an edge, as a share.
const JUMP: f64 = 0.12;
/// The greatest distance of neighbours, in strips.
const FARTHEST: f64 = 5.0;
/// An outline goes on within so many strips: the rings of a scan are not in each.
const GOES_ON: i64 = 5;
/// What an edge counts at the end of an outline.
const END: f64 = 0.4;
/// Points that are closer are one, in strips: a strip may show a ring twice.
const APART: f64 = 0.5;

/// The depth edges of the points of a cloud, sought along narrow strips of rows and of columns.
pub(super) fn depth_edges(camera: &Intrinsics, points: &[Point3<f64>]) -> Vec<DepthEdge> {
    /// Points just outside of the photo are inside of it after a small turn; a share of its size.
    const MARGIN: f64 = 0.05;
    let is_near = |at: f64, size: u32| {
        let size = f64::from(size);
        (-MARGIN * size..(1.0 + MARGIN) * size).contains(&at)
    };
    let seen = points.iter().filter_map(|point| {
        let pixel = camera.project(point)?;
        (is_near(pixel.x, camera.width) && is_near(pixel.y, camera.height))
            .then_some(Seen { pixel, depth: point.z })
    });
    let seen: Vec<Seen> = seen.collect();
    let across = [Across::Columns, Across::Rows].into_iter();
    across.flat_map(|across| edges_across(camera, &seen, across)).collect()
}

fn edges_across(camera: &Intrinsics, seen: &[Seen], across: Across) -> Vec<DepthEdge> {
    let strip = f64::from(camera.width) / STRIPS;
    let (along, beside): (Coordinate, Coordinate) = match across {
        Across::Columns => (|one| one.pixel.x, |one| one.pixel.y),
        Across::Rows => (|one| one.pixel.y, |one| one.pixel.x),
    };
    let mut sorted: Vec<(i64, Seen)> =
        seen.iter().map(|one| ((beside(one) / strip).floor() as i64, *one)).collect();
    sorted.sort_by(|(strip, one), (other_strip, other)| {
        strip.cmp(other_strip).then(along(one).total_cmp(&along(other)))
    });
    let mut found: BTreeMap<i64, Vec<(Seen, f64)>> = BTreeMap::new();
    for row in sorted.chunk_by(|one, next| one.0 == next.0) {
        let strip_of = row[0].0;
        let row: Vec<Seen> = row.iter().map(|(_, one)| *one).collect();
        let mut row = visible(&row, along, FARTHEST * strip);
        row.dedup_by(|next, kept| {
            let is_one = along(next) - along(kept) < APART * strip;
            if is_one && next.depth < kept.depth {
                *kept = *next;
            }
            is_one
        });
        let forward = outlines(&row, along, strip);
        row.reverse();
        let both = forward.into_iter().chain(outlines(&row, along, strip)).collect();
        found.insert(strip_of, both);
    }
    // Where an outline ends, the photo's edge may go on: an end says less.
    let goes_on = |one: &Seen, strip_of: i64, way: i64| {
        (1..=GOES_ON).any(|by| {
            let beside = found.get(&(strip_of + way * by)).into_iter().flatten();
            beside.map(|(other, _)| other).any(|other| {
                (along(other) - along(one)).abs() <= strip * by as f64
                    && (other.depth - one.depth).abs() <= JUMP * one.depth
            })
        })
    };
    let all =
        found.iter().flat_map(|(strip_of, edges)| edges.iter().map(move |edge| (*strip_of, edge)));
    let edge = |(strip_of, (near, by)): (i64, &(Seen, f64))| {
        let is_inner = goes_on(near, strip_of, 1) && goes_on(near, strip_of, -1);
        let of_place = if is_inner { 1.0 } else { END };
        let mut pixel = near.pixel;
        match across {
            Across::Columns => pixel.x += by,
            Across::Rows => pixel.y += by,
        }
        let spread = 2.0 * by / strip;
        DepthEdge {
            point: camera.unproject(&pixel, near.depth),
            across,
            weight: of_place * across.weight() / (1.0 + spread * spread),
        }
    };
    all.map(edge).collect()
}

/// The points of a strip without those that nearer points hide on both sides: a scanner that is not where the camera is
/// sees behind the outlines.
fn visible(row: &[Seen], along: Coordinate, reach: f64) -> Vec<Seen> {
    let is_hidden = |at: usize| {
        let one = &row[at];
        let is_near = |other: &&Seen| (along(other) - along(one)).abs() < reach;
        let hides = |other: &Seen| other.depth * (1.0 + JUMP) < one.depth;
        row[..at].iter().rev().take_while(is_near).any(hides)
            && row[at + 1..].iter().take_while(is_near).any(hides)
    };
    (0..row.len()).filter(|&at| !is_hidden(at)).map(|at| row[at]).collect()
}

/// The last points of a nearer thing in a strip, each with how many pixels further along the outline is: half of the
/// step between the points before it, on average.
fn outlines(row: &[Seen], along: Coordinate, strip: f64) -> Vec<(Seen, f64)> {
    /// The step is the median of so many.
    const STEPS: usize = 5;
    let is_smooth = |one: &Seen, other: &Seen| {
        (one.depth - other.depth).abs() < SMOOTH * one.depth.min(other.depth)
    };
    let ends = row.windows(4).enumerate().filter(|(_, four)| {
        let [before, near, far, behind] = four else { return false };
        let is_close = (along(far) - along(near)).abs() <= FARTHEST * strip;
        let is_jump = far.depth >= (1.0 + JUMP) * near.depth;
        is_close && is_jump && is_smooth(before, near) && is_smooth(far, behind)
    });
    let outline = |(at, four): (usize, &[Seen])| {
        let back = row[..=at + 1].windows(2).rev().take(STEPS);
        let steps = back.take_while(|two| is_smooth(&two[0], &two[1]));
        let mut steps: Vec<f64> = steps.map(|two| along(&two[1]) - along(&two[0])).collect();
        steps.sort_by(f64::total_cmp);
        (four[1], steps[steps.len() / 2] / 2.0)
    };
    ends.map(outline).collect()
}
