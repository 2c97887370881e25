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
    /// How far the car moves while the shutter is open \[m\].
    pub(super) motion: f32,
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
    rows: usize,
}

impl Plane {
    /// The plane of rows of `columns` pixels.
    pub(super) fn new(levels: Vec<Levels>, columns: usize) -> Self {
        let rows = levels.len() / columns;
        Self { levels, columns, rows }
    }

    /// Size of a pixel of full size in pixels of this image.
    fn scale(&self) -> f32 {
        self.columns as f32 / FULL_WIDTH
    }

    /// Between the four pixels around a position, the border repeated.
    #[inline]
    fn bilinear(&self, x: f32, y: f32) -> Levels {
        let (x, y) = (x.max(0.0), y.max(0.0));
        // Truncation, which is several times as fast as `f32::floor` on the base x86-64 target.
        let (left, top) = (x as usize, y as usize);
        let (u, v) = (x - left as f32, y - top as f32);
        let (last_column, last_row) = (self.columns - 1, self.rows - 1);
        let [left, right] = [left, left + 1].map(|column| column.min(last_column));
        let [top, bottom] = [top, top + 1].map(|row| row.min(last_row) * self.columns);
        let at = |row: usize, column: usize| self.levels[row + column];
        mixed(
            mixed(at(top, left), at(top, right), u),
            mixed(at(bottom, left), at(bottom, right), u),
            v,
        )
    }

    /// Means of squares of pixels.
    fn coarse(&self) -> Self {
        let columns = self.columns.div_ceil(COARSE);
        let rows = self.rows.div_ceil(COARSE);
        let mean = |index: usize| {
            let (left, top) = (index % columns * COARSE, index / columns * COARSE);
            let mut sum = [0.0; 3];
            let mut count = 0.0;
            for row in top..(top + COARSE).min(self.rows) {
                for column in left..(left + COARSE).min(self.columns) {
                    let levels = self.levels[row * self.columns + column];
                    sum = std::array::from_fn(|c| sum[c] + levels[c]);
                    count += 1.0;
                }
            }
            sum.map(|s| s / count)
        };
        Self::new((0..columns * rows).map(mean).collect(), columns)
    }

    fn blurred(&self) -> Self {
        let last_row = self.rows - 1;
        let row = |index: usize| &self.levels[index * self.columns..][..self.columns];
        let line = |index: usize| {
            let (above, here) = (row(index.saturating_sub(1)), row(index));
            let below = row((index + 1).min(last_row));
            let vertical: Vec<Levels> = (0..self.columns)
                .map(|column| smoothed(above[column], here[column], below[column]))
                .collect();
            let last = self.columns - 1;
            (0..self.columns).map(move |column| {
                let left = vertical[column.saturating_sub(1)];
                smoothed(left, vertical[column], vertical[(column + 1).min(last)])
            })
        };
        let levels = (0..=last_row).into_par_iter().flat_map_iter(line).collect();
        Self::new(levels, self.columns)
    }

    /// Blurred by a way straight ahead \[m\].
    ///
    /// What is seen `r` pixels from the point where the car is heading moves outwards by `r` times
    /// the way over the depth. A street is a corridor: its depth is taken for that of a tube.
    fn moved(&self, way: f32) -> Self {
        /// Radius of the tube \[m\].
        const TUBE: f32 = 4.5;
        /// Focal length at full size \[px\].
        const FOCAL: f32 = 719.0;
        /// Distance of two samples, and the most of them.
        const STEP: f32 = 1.7;
        const MAX: f32 = 15.0;
        let focal = FOCAL * self.scale();
        let (cx, cy) = (0.49 * self.columns as f32, 0.49 * self.rows as f32);
        let pixel = |row: usize, column: usize| {
            let (dx, dy) = (column as f32 - cx, row as f32 - cy);
            // The length is `r` times this.
            let share = (dx * dx + dy * dy).sqrt() * way / (TUBE * focal);
            let length = (dx * dx + dy * dy).sqrt() * share;
            let steps = (length / STEP).min(MAX) as u32 as f32;
            if steps < 1.0 {
                return self.levels[row * self.columns + column];
            }
            let mut sum = [0.0; 3];
            for k in 0..=steps as u32 {
                let at = share * (k as f32 / steps - 0.5);
                let seen = self.bilinear(column as f32 + dx * at, row as f32 + dy * at);
                sum = std::array::from_fn(|c| sum[c] + seen[c]);
            }
            sum.map(|s| s / (steps + 1.0))
        };
        let levels = (0..self.rows)
            .into_par_iter()
            .flat_map_iter(|row| (0..self.columns).map(move |column| (row, column)))
            .map(|(row, column)| pixel(row, column))
            .collect();
        Self::new(levels, self.columns)
    }

    fn blend(&mut self, row: usize, column: usize, over: Levels, share: f32) {
        let pixel = &mut self.levels[row * self.columns + column];
        *pixel = mixed(*pixel, over, share);
    }
}

/// The binomial mean of three neighbours.
#[inline]
fn smoothed(a: Levels, b: Levels, c: Levels) -> Levels {
    std::array::from_fn(|k| 0.25 * a[k] + 0.5 * b[k] + 0.25 * c[k])
}

fn mixed(a: Levels, b: Levels, share: f32) -> Levels {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * share)
}

/// A number in 0 … 1 for the `stream`-th trait of the `index`-th particle.
fn draw(seed: u32, index: u32, stream: u32) -> f32 {
    unit(derive(seed.wrapping_add(index.wrapping_mul(0x9E37_79B1)), stream)) as f32
}

impl Lens {
    /// The image as it falls on the sensor. What falls differs from frame to frame, the drops on
    /// the lens stay for as long as `lens_seed` does.
    pub(super) fn project(&self, mut plane: Plane, frame_seed: u32, lens_seed: u32) -> Plane {
        if self.glare > 0.0 {
            self.add_glare(&mut plane);
        }
        if self.motion > 0.0 {
            plane = plane.moved(self.motion);
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
        plane.levels.par_chunks_mut(columns).enumerate().for_each(|(row, line)| {
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
    let (columns, rows) = (plane.columns as f32, plane.rows as f32);
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
    let (columns, rows) = (plane.columns as f32, plane.rows as f32);
    let near = random(1) * random(2) * random(3);
    let radius = (0.9 + 6.0 * near) * plane.scale();
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
    let (columns, rows) = (plane.columns as f32, plane.rows as f32);
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
    for row in span(y, plane.rows) {
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
        let plane = || Plane::new(levels.clone(), 30);
        let same = Lens::default().project(plane(), 1, 2);
        assert_eq!(same.levels, levels);
        let blurred = plane().blurred();
        assert!(blurred.levels.iter().all(|l| (l[1] - 50.0).abs() < 1e-3));
    }

    #[test]
    fn motion_blurs_away_from_where_the_car_is_heading_and_not_there() {
        let (columns, rows) = (400, 120);
        let stripes: Vec<Levels> = (0..columns * rows)
            .map(|i| [if i % columns % 8 < 4 { 0.0 } else { 200.0 }, 70.0, 0.0])
            .collect();
        let moved = Plane::new(stripes.clone(), columns).moved(2.0);
        let middle = rows / 2 * columns;
        let change =
            |column: usize| (moved.levels[middle + column][0] - stripes[middle + column][0]).abs();
        assert!((190..202).all(|column| change(column) == 0.0));
        assert!((380..392).map(change).fold(0.0, f32::max) > 50.0);
        assert!(moved.levels.iter().all(|l| (l[1] - 70.0).abs() < 1e-3));
    }
}
