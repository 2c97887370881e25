//! What comes between the street and the sensor: rain and snow in the air, drops on the lens,
//! blur and glare.

use rayon::prelude::*;

use super::noise::{derive, unit};

/// Width of the image for which lengths in pixels are given.
const FULL_WIDTH: f32 = 1241.0;
/// Side of the squares of which drops show the mean \[px\].
const COARSE: usize = 4;

/// The grey levels of a pixel.
pub(super) type Levels = [f32; 3];

/// What is in the air and on the lens.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Lens {
    /// Number of times that a binomial blur is applied at full size.
    pub(super) blur: u32,
    /// Share of saturated light that is spread around.
    pub(super) glare: f32,
    /// Number of drops on the lens.
    pub(super) drops: u32,
    /// Number of falling drops in the image.
    pub(super) streaks: u32,
    /// Number of falling flakes in the image.
    pub(super) flakes: u32,
}

/// Levels of the pixels of an image, row after row.
pub(super) struct Plane {
    /// The levels.
    pub(super) levels: Vec<Levels>,
    /// Pixels in a row.
    pub(super) columns: usize,
}

impl Plane {
    fn rows(&self) -> usize {
        self.levels.len() / self.columns
    }

    /// Size of a pixel of full size in pixels of this image.
    fn scale(&self) -> f32 {
        self.columns as f32 / FULL_WIDTH
    }

    /// The level nearest to a position, the border repeated.
    fn nearest(&self, x: f32, y: f32) -> Levels {
        let column = x.clamp(0.0, self.columns as f32 - 1.0) as usize;
        let row = y.clamp(0.0, self.rows() as f32 - 1.0) as usize;
        self.levels[row * self.columns + column]
    }

    /// Between the four pixels around a position.
    fn bilinear(&self, x: f32, y: f32) -> Levels {
        let (x, y) = (x.max(0.0), y.max(0.0));
        let (left, top) = (x.floor(), y.floor());
        let (u, v) = (x - left, y - top);
        let above = mixed(self.nearest(left, top), self.nearest(left + 1.0, top), u);
        let below = mixed(
            self.nearest(left, top + 1.0),
            self.nearest(left + 1.0, top + 1.0),
            u,
        );
        mixed(above, below, v)
    }

    /// Means of squares of pixels.
    fn coarse(&self) -> Self {
        let columns = self.columns.div_ceil(COARSE);
        let rows = self.rows().div_ceil(COARSE);
        let mean = |index: usize| {
            let (left, top) = (index % columns * COARSE, index / columns * COARSE);
            let mut sum = [0.0; 3];
            let mut count = 0.0;
            for row in top..(top + COARSE).min(self.rows()) {
                for column in left..(left + COARSE).min(self.columns) {
                    let levels = self.levels[row * self.columns + column];
                    sum = std::array::from_fn(|c| sum[c] + levels[c]);
                    count += 1.0;
                }
            }
            sum.map(|s| s / count)
        };
        Self {
            levels: (0..columns * rows).map(mean).collect(),
            columns,
        }
    }

    fn blurred(&self) -> Self {
        let at = |row: usize, column: usize| self.levels[row * self.columns + column];
        let (last_row, last_column) = (self.rows() - 1, self.columns - 1);
        let line = |row: usize| {
            let vertical = move |column: usize| -> Levels {
                let (a, b) = (at(row.saturating_sub(1), column), at(row, column));
                let c = at((row + 1).min(last_row), column);
                std::array::from_fn(|k| 0.25 * a[k] + 0.5 * b[k] + 0.25 * c[k])
            };
            (0..self.columns).map(move |column| {
                let a = vertical(column.saturating_sub(1));
                let b = vertical(column);
                let c = vertical((column + 1).min(last_column));
                std::array::from_fn(|k| 0.25 * a[k] + 0.5 * b[k] + 0.25 * c[k])
            })
        };
        Self {
            levels: (0..=last_row).into_par_iter().flat_map_iter(line).collect(),
            columns: self.columns,
        }
    }

    fn blend(&mut self, row: usize, column: usize, over: Levels, share: f32) {
        let pixel = &mut self.levels[row * self.columns + column];
        *pixel = mixed(*pixel, over, share);
    }
}

fn mixed(a: Levels, b: Levels, share: f32) -> Levels {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * share)
}

/// A number in 0 … 1 for the `stream`-th trait of the `index`-th particle.
fn draw(seed: u32, index: u32, stream: u32) -> f32 {
    unit(derive(
        seed.wrapping_add(index.wrapping_mul(0x9E37_79B1)),
        stream,
    )) as f32
}

impl Lens {
    /// The image as it falls on the sensor. What falls differs from frame to frame, the drops on
    /// the lens stay for as long as `lens_seed` does.
    pub(super) fn project(&self, mut plane: Plane, frame_seed: u32, lens_seed: u32) -> Plane {
        if self.glare > 0.0 {
            self.add_glare(&mut plane);
        }
        for _ in 0..(self.blur as f32 * plane.scale()).round() as u32 {
            plane = plane.blurred();
        }
        for index in 0..self.streaks {
            streak(&mut plane, index, frame_seed);
        }
        for index in 0..self.flakes {
            flake(&mut plane, index, frame_seed);
        }
        if self.drops > 0 {
            let coarse = plane.coarse();
            for index in 0..self.drops {
                drop(&mut plane, &coarse, index, lens_seed);
            }
        }
        plane
    }

    /// Spreads light from saturated spots.
    fn add_glare(&self, plane: &mut Plane) {
        let mut spread = plane.coarse();
        for levels in &mut spread.levels {
            // Only what is brighter than walls under a lamp.
            *levels = levels.map(|level| (level - 190.0).max(0.0));
        }
        for _ in 0..(16.0 * plane.scale()).round() as u32 {
            spread = spread.blurred();
        }
        let columns = plane.columns;
        let to_coarse = |i: usize| (i as f32 + 0.5) / COARSE as f32 - 0.5;
        plane
            .levels
            .par_chunks_mut(columns)
            .enumerate()
            .for_each(|(row, line)| {
                for (column, levels) in line.iter_mut().enumerate() {
                    let glow = spread.bilinear(to_coarse(column), to_coarse(row));
                    *levels = std::array::from_fn(|k| levels[k] + self.glare * 4.0 * glow[k]);
                }
            });
    }
}

/// A falling drop: a pale upright line.
fn streak(plane: &mut Plane, index: u32, seed: u32) {
    let random = |stream| draw(seed, index, stream);
    let scale = plane.scale();
    let (columns, rows) = (plane.columns as f32, plane.rows() as f32);
    let near = random(1) * random(1);
    let length = (10.0 + 70.0 * near) * scale;
    let (x, y) = (random(2) * columns, random(3) * (rows + length) - length);
    let slant = 0.05 * (random(4) - 0.3);
    let strength = 0.10 + 0.22 * random(5);
    for step in 0..length as usize {
        let along = step as f32;
        let (row, column) = (y + along, x + slant * along);
        if row < 0.0 || row >= rows || column < 0.0 || column >= columns - 1.0 {
            continue;
        }
        let middle = 1.0 - (2.0 * along / length - 1.0).abs();
        let right = column - column.floor();
        let share = strength * middle;
        let pale = [176.0, 180.0, 186.0];
        plane.blend(row as usize, column as usize, pale, share * (1.0 - right));
        plane.blend(row as usize, column as usize + 1, pale, share * right);
    }
}

/// A falling flake: a soft white disc; near ones are large and faint.
fn flake(plane: &mut Plane, index: u32, seed: u32) {
    let random = |stream| draw(seed, index, stream);
    let (columns, rows) = (plane.columns as f32, plane.rows() as f32);
    let near = random(1) * random(2) * random(3);
    let radius = (0.9 + 13.0 * near) * plane.scale();
    let (x, y) = (random(4) * columns, random(5) * rows);
    let strength = (0.85 - 0.5 * near.sqrt()) * (radius / (radius + 0.35));
    disc(plane, x, y, radius + 0.7, |distance| {
        let share = ((radius + 0.7 - distance) / (0.5 * radius + 0.7)).clamp(0.0, 1.0);
        ([246.0, 248.0, 250.0], strength * share)
    });
}

/// A drop on the lens: a small wide-angle picture of the scene, upside down and out of focus.
fn drop(plane: &mut Plane, coarse: &Plane, index: u32, seed: u32) {
    let random = |stream| draw(seed, index, stream);
    let (columns, rows) = (plane.columns as f32, plane.rows() as f32);
    let size = random(1);
    let radius = (5.0 + 24.0 * size * size * size) * plane.scale();
    let (cx, cy) = (random(2) * columns, random(3) * rows);
    let squeeze = 0.85 + 0.3 * random(4);
    let reach = (radius * 1.2) as i32 + 1;
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            let (row, column) = (cy as i32 + dy, cx as i32 + dx);
            if row < 0 || column < 0 || row >= rows as i32 || column >= columns as i32 {
                continue;
            }
            let (u, v) = (dx as f32 / squeeze, dy as f32 * squeeze);
            let distance = (u * u + v * v).sqrt() / radius;
            if distance >= 1.0 {
                continue;
            }
            let turn = -3.5 * (1.0 + distance * distance);
            let seen = coarse.bilinear(
                (cx + dx as f32 * turn) / COARSE as f32,
                (cy + dy as f32 * turn) / COARSE as f32,
            );
            let rim = 1.0 - 0.35 * distance * distance * distance;
            let share = ((1.0 - distance) * 3.5).min(0.92);
            plane.blend(row as usize, column as usize, seen.map(|l| l * rim), share);
        }
    }
}

/// Paints every pixel of a disc as its distance from the middle says.
fn disc(plane: &mut Plane, x: f32, y: f32, radius: f32, paint: impl Fn(f32) -> (Levels, f32)) {
    let span = |middle: f32, count: usize| {
        let low = (middle - radius).max(0.0) as usize;
        low..((middle + radius).max(0.0) as usize + 1).min(count)
    };
    for row in span(y, plane.rows()) {
        for column in span(x, plane.columns) {
            let (dx, dy) = (column as f32 - x, row as f32 - y);
            let (levels, share) = paint((dx * dx + dy * dy).sqrt());
            if share > 0.0 {
                plane.blend(row, column, levels, share);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clear_lens_changes_nothing_and_a_blur_keeps_the_mean() {
        let levels: Vec<Levels> = (0..600).map(|i| [(i % 97) as f32, 50.0, 9.0]).collect();
        let plane = || Plane {
            levels: levels.clone(),
            columns: 30,
        };
        let same = Lens::default().project(plane(), 1, 2);
        assert_eq!(same.levels, levels);
        let blurred = plane().blurred();
        assert!(blurred.levels.iter().all(|l| (l[1] - 50.0).abs() < 1e-3));
    }
}
