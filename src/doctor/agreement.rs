//! Two measures of how well clouds, photos, cameras and poses fit together, for any reading of a scene.
//!
//! - *Edges*: depth edges of a cloud should fall on edges of its photo (Levinson and Thrun, *Automatic
//!   Online Calibration of Cameras and Lasers*, RSS 2013). Finds errors within a frame.
//! - *Carried values*: points should have the same grey values in their own photo and where the pose of another
//!   frame projects them. Finds errors of poses, scale and depth.

use image::{GrayImage, ImageBuffer, Luma, Primitive};
use nalgebra::{Point2, Point3};

use crate::camera::Intrinsics;

/// The fewest points in view for a measurement.
const MIN_POINTS: usize = 150;

/// The strength of image edges. It fades with the distance, so edges a few pixels away still count.
pub(super) type EdgeMap = ImageBuffer<Luma<f32>, Vec<f32>>;

/// Finds the edges of a photo.
pub(super) fn edge_map(photo: &GrayImage) -> EdgeMap {
    /// The share of an edge's strength one pixel away.
    const FADING: f32 = 0.80;
    /// The weight of the unfaded edge, which keeps the ridge sharp.
    const SHARP: f32 = 1.0 / 3.0;
    /// Stronger edges count as this much [grey values].
    const STRONGEST: f32 = 60.0;
    /// The neighbours that a pass in row order visits before a pixel.
    const BEFORE: [(isize, isize); 4] = [(-1, 0), (-1, -1), (0, -1), (1, -1)];
    let (width, height) = (photo.width() as usize, photo.height() as usize);
    let values = photo.as_raw();
    let at = |x: usize, y: usize| f32::from(values[y * width + x]);
    let mut edges = vec![0.0_f32; width * height];
    for y in 1..height.saturating_sub(1) {
        for x in 1..width.saturating_sub(1) {
            let horizontal = at(x + 1, y - 1) + 2.0 * at(x + 1, y) + at(x + 1, y + 1)
                - at(x - 1, y - 1)
                - 2.0 * at(x - 1, y)
                - at(x - 1, y + 1);
            let vertical = at(x - 1, y + 1) + 2.0 * at(x, y + 1) + at(x + 1, y + 1)
                - at(x - 1, y - 1)
                - 2.0 * at(x, y - 1)
                - at(x + 1, y - 1);
            edges[y * width + x] = (horizontal.hypot(vertical) / 4.0).min(STRONGEST);
        }
    }
    let mut faded = edges.clone();
    let there = (0..width * height).map(|index| (index, 1));
    let back = there.clone().rev().map(|(index, _)| (index, -1));
    for (index, side) in there.chain(back) {
        let (x, y) = (index % width, index / width);
        for (dx, dy) in BEFORE {
            let beside = (x.checked_add_signed(side * dx), y.checked_add_signed(side * dy));
            if let (Some(nx), Some(ny)) = beside
                && nx < width
                && ny < height
            {
                faded[index] = faded[index].max(FADING * faded[ny * width + nx]);
            }
        }
    }
    let strength = edges.iter().zip(&faded);
    let strength = strength.map(|(edge, faded)| SHARP * edge + (1.0 - SHARP) * faded);
    EdgeMap::from_raw(photo.width(), photo.height(), strength.collect()).unwrap_or_default()
}

/// The bilinearly interpolated value of an image.
fn value<T: Primitive + Into<f64>>(
    image: &ImageBuffer<Luma<T>, Vec<T>>,
    pixel: &Point2<f64>,
) -> Option<f64> {
    let (x, y) = (pixel.x, pixel.y);
    let (width, height) = (image.width() as usize, image.height() as usize);
    let is_inside = x >= 0.0 && y >= 0.0 && x < (width - 1) as f64 && y < (height - 1) as f64;
    is_inside.then(|| {
        let (left, top) = (x as usize, y as usize);
        let (right, down) = (x - left as f64, y - top as f64);
        let at = |x: usize, y: usize| -> f64 { image.as_raw()[y * width + x].into() };
        let upper = at(left, top) * (1.0 - right) + at(left + 1, top) * right;
        let lower = at(left, top + 1) * (1.0 - right) + at(left + 1, top + 1) * right;
        upper * (1.0 - down) + lower * down
    })
}

/// A point in a camera's image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) pixel: Point2<f64>,
    /// Depth \[m\].
    pub(super) depth: f64,
}

/// The logarithm of the ratio of image-edge strength at depth edges to that at all points; `None` if too few
/// points are in view.
pub(super) fn edge_agreement(map: &EdgeMap, seen: &[Seen]) -> Option<f64> {
    let inside: Vec<(Seen, f64)> =
        seen.iter().filter_map(|seen| Some((*seen, value(map, &seen.pixel)?))).collect();
    if inside.len() < MIN_POINTS {
        return None;
    }
    let weights = depth_edges(map.width() as usize, map.height() as usize, &inside);
    let (mut weight_sum, mut at_edges, mut at_all) = (0.0, 0.0, 0.0);
    for ((_, strength), weight) in inside.iter().zip(&weights) {
        weight_sum += weight;
        at_edges += weight * strength;
        at_all += strength;
    }
    let mean = at_all / inside.len() as f64;
    if weight_sum < MIN_POINTS as f64 / 10.0 || mean <= 0.0 {
        return None;
    }
    Some((at_edges / weight_sum / mean).max(1e-3).ln())
}

/// How far each point is in front of its neighbours, as a share of its depth, 0 … 1.
fn depth_edges(width: usize, height: usize, inside: &[(Seen, f64)]) -> Vec<f64> {
    /// The cell size at which a scan of 64 beams has a point in most cells.
    const CELLS_ACROSS: usize = 250;
    const NEIGHBOURS: [(isize, isize); 6] = [(-1, 0), (1, 0), (-2, 0), (2, 0), (0, -1), (0, -2)];
    let cell = (width / CELLS_ACROSS).max(1);
    let (columns, rows) = (width / cell + 1, height / cell + 1);
    let mut nearest = vec![f64::INFINITY; columns * rows];
    let place = |seen: &Seen| {
        let (x, y) = (seen.pixel.x as usize / cell, seen.pixel.y as usize / cell);
        (x, y)
    };
    for (seen, _) in inside {
        let (x, y) = place(seen);
        let here = &mut nearest[y * columns + x];
        *here = here.min(seen.depth);
    }
    inside
        .iter()
        .map(|(seen, _)| {
            let (x, y) = place(seen);
            // Points behind the nearest one of their cell are hidden.
            if seen.depth > 1.05 * nearest[y * columns + x] {
                return 0.0;
            }
            let behind = NEIGHBOURS.iter().filter_map(|&(dx, dy)| {
                let (nx, ny) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
                let beside = (nx < columns && ny < rows).then(|| nearest[ny * columns + nx])?;
                (beside.is_finite() && beside > 1.15 * seen.depth)
                    .then(|| ((beside - seen.depth) / seen.depth).min(1.0))
            });
            behind.fold(0.0, f64::max)
        })
        .collect()
}

/// The correlation of the points' grey values in two photos, as Fisher's z; `None` if fewer than `least`
/// points are in view of both.
pub(super) fn carried_agreement(
    from: (&GrayImage, &[Option<Seen>]),
    to: (&GrayImage, &[Option<Seen>]),
    least: usize,
) -> Option<f64> {
    let pairs: Vec<(f64, f64)> = from
        .1
        .iter()
        .zip(to.1)
        .filter_map(|(a, b)| {
            let a = value(from.0, &a.as_ref()?.pixel)?;
            let b = value(to.0, &b.as_ref()?.pixel)?;
            Some((a, b))
        })
        .collect();
    if pairs.len() < least.max(MIN_POINTS) {
        return None;
    }
    let count = pairs.len() as f64;
    let mean_a = pairs.iter().map(|pair| pair.0).sum::<f64>() / count;
    let mean_b = pairs.iter().map(|pair| pair.1).sum::<f64>() / count;
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in pairs {
        let (a, b) = (a - mean_a, b - mean_b);
        aa += a * a;
        bb += b * b;
        ab += a * b;
    }
    let correlation = ab / (aa * bb).sqrt();
    correlation.is_finite().then(|| correlation.clamp(-0.999, 0.999).atanh())
}

/// Projects a point with an additional radial distortion `k1`.
pub(super) fn project(camera: &Intrinsics, k1: f64, point: &Point3<f64>) -> Option<Seen> {
    /// Nearer points cannot be projected \[m\].
    const NEAREST_M: f64 = 1e-6;
    if point.z <= NEAREST_M {
        return None;
    }
    let (x, y) = (point.x / point.z, point.y / point.z);
    let bent = 1.0 + k1 * (x * x + y * y);
    // Beyond the fold of the polynomial, a point would be projected twice.
    let is_folded = 1.0 + 3.0 * k1 * (x * x + y * y) <= 0.0;
    (!is_folded).then(|| Seen {
        pixel: Point2::new(camera.fx * x * bent + camera.cx, camera.fy * y * bent + camera.cy),
        depth: point.z,
    })
}
