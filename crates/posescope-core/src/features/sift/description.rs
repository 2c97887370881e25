//! What is around a feature: the directions of its gradients.

use std::f32::consts::{SQRT_2, TAU};

use nalgebra::Point2;

use super::SiftDescriptor;
use crate::image::FloatImage;

/// Magnitude and direction of the gradient at a pixel, by central differences.
fn gradient(image: &FloatImage, x: i32, y: i32) -> Option<(f32, f32)> {
    let (width, height) = (image.width() as i32, image.height() as i32);
    if x < 1 || y < 1 || x >= width - 1 || y >= height - 1 {
        return None;
    }
    let at = |x: i32, y: i32| image.get_pixel(x as u32, y as u32).0[0];
    let along = at(x + 1, y) - at(x - 1, y);
    let down = at(x, y + 1) - at(x, y - 1);
    Some((along.hypot(down), down.atan2(along)))
}

/// The direction that most gradients around have, and others with at least 80 % as much (section 5)
/// \[rad\].
pub(super) fn directions(image: &FloatImage, at: Point2<f32>, sigma: f32) -> Vec<f32> {
    const BINS: usize = 36;
    let spread = 1.5 * sigma;
    let radius = (3.0 * spread).round() as i32;
    let (x, y) = (at.x.round() as i32, at.y.round() as i32);
    let mut histogram = [0.0_f32; BINS];
    for v in -radius..=radius {
        for u in -radius..=radius {
            let Some((magnitude, angle)) = gradient(image, x + u, y + v) else {
                continue;
            };
            let weight = (-((u * u + v * v) as f32) / (2.0 * spread * spread)).exp();
            let bin = (angle.rem_euclid(TAU) / TAU * BINS as f32).round() as usize % BINS;
            histogram[bin] += weight * magnitude;
        }
    }
    let smooth: [f32; BINS] = std::array::from_fn(|bin| {
        let near = |by: usize| histogram[(bin + by) % BINS];
        0.25 * near(BINS - 1) + 0.5 * near(0) + 0.25 * near(1)
    });
    let most = smooth.iter().copied().fold(0.0, f32::max);
    let mut angles = Vec::new();
    for bin in 0..BINS {
        let (before, here, behind) =
            (smooth[(bin + BINS - 1) % BINS], smooth[bin], smooth[(bin + 1) % BINS]);
        if here > before && here >= behind && here >= 0.8 * most {
            let by = 0.5 * (before - behind) / (before - 2.0 * here + behind);
            let angle = (bin as f32 + by) / BINS as f32 * TAU;
            angles.push(if angle > 0.5 * TAU { angle - TAU } else { angle });
        }
    }
    if angles.is_empty() {
        angles.push(0.0);
    }
    angles
}

/// Histograms of the gradients in 4 × 4 fields around the extremum (section 6), as their roots.
pub(super) fn descriptor(
    image: &FloatImage,
    at: Point2<f32>,
    sigma: f32,
    angle: f32,
) -> SiftDescriptor {
    const FIELDS: i32 = 4;
    const DIRECTIONS: i32 = 8;
    const MAX_SHARE: f32 = 0.2;
    let field = 3.0 * sigma;
    let (sin, cos) = angle.sin_cos();
    let radius = (field * SQRT_2 * 2.5).round() as i32;
    let (x, y) = (at.x.round() as i32, at.y.round() as i32);
    let mut histograms = [0.0_f32; 128];
    for v in -radius..=radius {
        for u in -radius..=radius {
            let (along, down) = ((x + u) as f32 - at.x, (y + v) as f32 - at.y);
            let column = (cos * along + sin * down) / field;
            let row = (cos * down - sin * along) / field;
            let (c, r) = (column + 1.5, row + 1.5);
            if c <= -1.0 || r <= -1.0 || c >= 4.0 || r >= 4.0 {
                continue;
            }
            let Some((magnitude, direction)) = gradient(image, x + u, y + v) else {
                continue;
            };
            let weight = magnitude * (-(column * column + row * row) / 8.0).exp();
            let turned = (direction - angle).rem_euclid(TAU) / TAU * DIRECTIONS as f32;
            let (c0, r0, d0) = (c.floor(), r.floor(), turned.floor());
            let (dc, dr, dd) = (c - c0, r - r0, turned - d0);
            for (r, of_row) in [(r0 as i32, 1.0 - dr), (r0 as i32 + 1, dr)] {
                for (c, of_column) in [(c0 as i32, 1.0 - dc), (c0 as i32 + 1, dc)] {
                    if !(0..FIELDS).contains(&r) || !(0..FIELDS).contains(&c) {
                        continue;
                    }
                    for (d, of_direction) in [(d0 as i32, 1.0 - dd), (d0 as i32 + 1, dd)] {
                        let place = (r * FIELDS + c) * DIRECTIONS + d % DIRECTIONS;
                        histograms[place as usize] += weight * of_row * of_column * of_direction;
                    }
                }
            }
        }
    }
    let norm = |values: &[f32; 128]| values.iter().map(|v| v * v).sum::<f32>().sqrt();
    let most = MAX_SHARE * norm(&histograms);
    let clipped = histograms.map(|value| value.min(most));
    let sum: f32 = clipped.iter().sum();
    if sum <= 0.0 {
        return [0.0; 128];
    }
    clipped.map(|value| (value / sum).sqrt())
}
