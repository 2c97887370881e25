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
    let (width, height) = photo.dimensions();
    let mut map = vec![0.0_f32; width as usize * height as usize];
    each_edge(photo, &mut map, |_, edge| edge);
    for _ in 0..2 {
        fade(&mut map, width as usize, FADING);
        map.reverse();
    }
    // Photos may have 67 million pixels, so the edges are found again, and not kept beside the map.
    map.iter_mut().for_each(|strength| *strength *= 1.0 - SHARP);
    each_edge(photo, &mut map, |faded, edge| SHARP * edge + faded);
    EdgeMap::from_raw(width, height, map).unwrap_or_default()
}

/// Changes the value of each pixel, but of those on the border, by the strength of the edge there.
fn each_edge(photo: &GrayImage, map: &mut [f32], change: impl Fn(f32, f32) -> f32) {
    /// Stronger edges count as this much [grey values].
    const STRONGEST: f32 = 60.0;
    let (width, height) = (photo.width() as usize, photo.height() as usize);
    let inside = width.saturating_sub(2);
    for y in 1..height.saturating_sub(1) {
        // The pixels of the row inside of the border, and those beside them.
        let [a, b, c, d, e, f, g, h] =
            [(0, 0), (1, 0), (2, 0), (0, 1), (2, 1), (0, 2), (1, 2), (2, 2)]
                .map(|(dx, dy)| &photo.as_raw()[(y - 1 + dy) * width..][dx.min(width)..][..inside]);
        let here = &mut map[y * width..][1.min(width)..][..inside];
        for x in 0..inside {
            let at = |pixels: &[u8]| i32::from(pixels[x]);
            let horizontal = at(c) + 2 * at(e) + at(h) - at(a) - 2 * at(d) - at(f);
            let vertical = at(f) + 2 * at(g) + at(h) - at(a) - 2 * at(b) - at(c);
            let length = ((horizontal * horizontal + vertical * vertical) as f32).sqrt();
            here[x] = change(here[x], (length / 4.0).min(STRONGEST));
        }
    }
}

/// Carries the strength of each pixel to the next ones in row order, and to those below.
fn fade(strengths: &mut [f32], width: usize, fading: f32) {
    for start in (0..strengths.len()).step_by(width.max(1)) {
        let (before, from_here) = strengths.split_at_mut(start);
        let row = &mut from_here[..width];
        let above = &before[start.saturating_sub(width)..];
        // From above on the right, in the middle and on the left.
        for (skipped_above, skipped) in [(1, 0), (0, 0), (0, 1)] {
            let from = above.iter().skip(skipped_above);
            for (strength, one) in row.iter_mut().skip(skipped).zip(from) {
                *strength = larger(*strength, fading * one);
            }
        }
        let mut left = 0.0;
        for strength in row {
            left = larger(*strength, fading * left);
            *strength = left;
        }
    }
}

/// The larger of two strengths: `f32::max` asks for numbers that there are none of.
fn larger(one: f32, other: f32) -> f32 {
    if one < other { other } else { one }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_fades_alike_in_all_directions() {
        let mut photo = GrayImage::new(9, 7);
        photo.put_pixel(4, 3, Luma([200]));
        let map = edge_map(&photo);
        let at = |x: u32, y: u32| map.get_pixel(x, y).0[0];
        // The pixels around the bright one are edges as strong as any.
        assert!((at(3, 3) - 60.0).abs() < 1e-3);
        for (steps, places) in [
            (1, [(2, 3), (6, 3), (4, 1), (4, 5)]),
            (2, [(1, 3), (7, 3), (4, 0), (4, 6)]),
            (3, [(0, 3), (8, 3), (0, 0), (8, 6)]),
        ] {
            let faded = 60.0 * 0.8_f32.powi(steps) * 2.0 / 3.0;
            for (x, y) in places {
                assert!((at(x, y) - faded).abs() < 1e-3, "{x} {y}: {} for {faded}", at(x, y));
            }
        }
        assert_eq!(edge_map(&GrayImage::new(3, 1)).as_raw(), &[0.0; 3]);
    }
}
