//! Drawing one hypothesis after the other, faster, where the order of the pixels does not matter.

use std::hint::select_unpredictable;

use fearless_simd::{Level, Simd, SimdBase as _, dispatch, f32x4};

use super::points::{MAX_ROWS, PointArrays, ProjectedPoints, ROW_BITS, Values};
use super::projection::{OUT_OF_VIEW, Projection};
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// The most pixels, those of the margin included: 64 MB.
const MAX_PIXELS: usize = 1 << 24;

/// The depth of a pixel on which no point fell.
const NOTHING: f32 = f32::INFINITY;

/// Streams of points that are drawn in turns: neighbours fall on the same pixels, and each would wait for
/// what the last one wrote there.
const STREAMS: usize = 4;

/// Draws points for one hypothesis after the other, and keeps what is made of what query and synthetic view show
/// where both exist: of the pairs of [`Rasterizer`](super::Rasterizer), bit by bit, in an order of their own.
///
/// First the least depth of each pixel is found, rows of several pixels at once; then each point takes the
/// pixels where the depth is its own, and leaves them empty, so that of two at the same depth the first
/// takes them, and nothing is to be cleared. Neither has a branch: which of several points is the nearest cannot
/// be foreseen, and a third of a drawing's time went into guessing it.
pub struct ZBuffer<K> {
    level: Level,
    intrinsics: Intrinsics,
    reach: usize,
    /// Depths \[m\], row by row, with a margin of twice the reach on all sides: every square lies within.
    nearest: Vec<f32>,
    /// Where the points fall: of squares the upper left pixel, the margin's counted.
    projected: ProjectedPoints,
    kept: Vec<K>,
}

impl<K: Copy + Default> ZBuffer<K> {
    /// Whether there is a canvas for a camera: not for more than 16 million pixels, or 65,000 in a row.
    pub fn can_draw(intrinsics: &Intrinsics, splat_px: usize) -> bool {
        let sides = Self::sides(intrinsics, splat_px / 2);
        sides[0] * sides[1] <= MAX_PIXELS && sides[0].max(sides[1]) < MAX_ROWS
    }

    /// An empty canvas for a camera; each point covers a square of `splat_px` (odd) pixels.
    ///
    /// # Panics
    /// Where the image is too large ([`Self::can_draw`]).
    pub fn new(intrinsics: &Intrinsics, splat_px: usize) -> Self {
        assert!(Self::can_draw(intrinsics, splat_px), "no canvas is so large");
        let reach = splat_px / 2;
        let sides = Self::sides(intrinsics, reach);
        Self {
            level: Level::new(),
            intrinsics: *intrinsics,
            reach,
            // A row of three is written as one of four.
            nearest: vec![NOTHING; sides[0] * sides[1] + 1],
            projected: ProjectedPoints::default(),
            kept: Vec::new(),
        }
    }

    /// Columns and rows, those of the margin included.
    fn sides(intrinsics: &Intrinsics, reach: usize) -> [usize; 2] {
        [intrinsics.width, intrinsics.height].map(|side| side as usize + 4 * reach)
    }

    /// What `keep` makes of what the query, first, and a camera at `camera_from_points` show, at each pixel on
    /// which points fall.
    pub fn draw<T: Copy>(
        &mut self,
        points: &PointArrays,
        values: Values<'_, T>,
        camera_from_points: &Pose,
        keep: impl Fn(T, T) -> K,
    ) -> &[K] {
        let projection = Projection::new(&self.intrinsics, self.reach as i32, camera_from_points);
        let projection = match self.reach {
            0 => projection,
            _ => projection.with_stride(1 << ROW_BITS),
        };
        let (level, projected) = (self.level, &mut self.projected);
        dispatch!(level, simd => projected.project(simd, points, &projection));
        let side = 2 * self.reach + 1;
        let most = (values.points.len() * side * side).min(values.query.len());
        // One more, where what does not count is written.
        if self.kept.len() <= most {
            self.kept.resize(most + 1, K::default());
        }
        let count = match self.reach {
            0 => dispatch!(level, _simd => self.draw_points(values, keep)),
            1 => dispatch!(level, simd => self.draw_squares::<_, _, 3>(simd, values, keep)),
            _ => dispatch!(level, simd => self.draw_squares::<_, _, 0>(simd, values, keep)),
        };
        &self.kept[..count]
    }

    #[inline(always)]
    fn draw_points<T: Copy>(&mut self, values: Values<'_, T>, keep: impl Fn(T, T) -> K) -> usize {
        let ProjectedPoints { pixels, depths, .. } = &self.projected;
        let nearest = &mut self.nearest[..values.query.len()];
        // So that the compiler knows that both have the same length.
        let query = &values.query[..nearest.len()];
        for (&pixel, &depth) in pixels.iter().zip(depths) {
            if let Some(there) = nearest.get_mut(pixel as usize) {
                *there = lesser(depth, *there);
            }
        }
        let mut taken = Taken::new(&mut self.kept);
        for ((&pixel, &depth), &synthetic) in pixels.iter().zip(depths).zip(values.points) {
            let pixel = pixel as usize;
            if pixel < nearest.len() {
                let kept = keep(query[pixel], synthetic);
                taken.take(&mut nearest[pixel], depth, kept);
            }
        }
        taken.count
    }

    /// Draws squares of `SIDE` pixels, or 0 for such as the canvas was made for.
    #[inline(always)]
    fn draw_squares<S: Simd, T: Copy, const SIDE: usize>(
        &mut self,
        simd: S,
        values: Values<'_, T>,
        keep: impl Fn(T, T) -> K,
    ) -> usize {
        let side = if SIDE == 0 { 2 * self.reach + 1 } else { SIDE };
        let [width, height] =
            [self.intrinsics.width, self.intrinsics.height].map(|side| side as usize);
        let margin = 2 * self.reach;
        let stride = width + 2 * margin;
        let ProjectedPoints { pixels, depths, .. } = &self.projected;
        let nearest = self.nearest.as_mut_slice();

        let stream = pixels.len().div_ceil(STREAMS);
        for place in 0..stream {
            for first in (0..pixels.len()).step_by(stream) {
                let Some(&corner) = pixels.get(first + place) else {
                    break;
                };
                if corner != OUT_OF_VIEW {
                    let (row, column) = row_and_column(corner);
                    let square = &mut nearest[row * stride + column..];
                    put_square::<_, SIDE>(simd, square, [side, stride], depths[first + place]);
                }
            }
        }

        let query = values.query;
        let mut taken = Taken::new(&mut self.kept);
        for ((&corner, &depth), &synthetic) in pixels.iter().zip(depths).zip(values.points) {
            if corner == OUT_OF_VIEW {
                continue;
            }
            let (row, column) = row_and_column(corner);
            let is_inside = row >= margin
                && column >= margin
                && row + side <= margin + height
                && column + side <= margin + width;
            if is_inside {
                let begin = row * stride + column;
                let square = &mut nearest[begin..begin + (side - 1) * stride + side];
                let begin = (row - margin) * width + column - margin;
                let query = &query[begin..begin + (side - 1) * width + side];
                for row in 0..side {
                    let there = &mut square[row * stride..][..side];
                    let query = &query[row * width..][..side];
                    for (there, &query) in there.iter_mut().zip(query) {
                        taken.take(there, depth, keep(query, synthetic));
                    }
                }
                continue;
            }
            for row in row..row + side {
                for column in column..column + side {
                    let there = &mut nearest[row * stride + column];
                    let (row, column) = (row.wrapping_sub(margin), column.wrapping_sub(margin));
                    if row < height && column < width {
                        let query = query[row * width + column];
                        taken.take(there, depth, keep(query, synthetic));
                    } else {
                        *there = NOTHING;
                    }
                }
            }
        }
        taken.count
    }
}

/// Row and column of the upper left pixel of a square, the margin's counted.
#[inline(always)]
fn row_and_column(corner: u32) -> (usize, usize) {
    let (row, column) = (corner >> ROW_BITS, corner & MAX_ROWS as u32);
    (row as usize, column as usize)
}

/// Puts a depth into a square at the beginning of `there`, with `side` and, from one row to the next, `stride`
/// \[px\].
#[inline(always)]
fn put_square<S: Simd, const SIDE: usize>(
    simd: S,
    there: &mut [f32],
    [side, stride]: [usize; 2],
    depth: f32,
) {
    if SIDE == 3 {
        let square = &mut there[..2 * stride + 4];
        let depths = simd.load_array_f32x4([depth, depth, depth, NOTHING]);
        for row in 0..3 {
            let four = &mut square[row * stride..][..4];
            let before = f32x4::from_slice(simd, four);
            simd.min_f32x4(depths, before).store_slice(four);
        }
        return;
    }
    for row in 0..side {
        for there in &mut there[row * stride..][..side] {
            *there = lesser(depth, *there);
        }
    }
}

/// The lesser of two numbers, in one instruction.
#[inline(always)]
fn lesser(new: f32, old: f32) -> f32 {
    if new < old { new } else { old }
}

/// What is kept of a drawing, so far.
struct Taken<'a, K> {
    kept: &'a mut [K],
    count: usize,
}

impl<'a, K> Taken<'a, K> {
    fn new(kept: &'a mut [K]) -> Self {
        Self { kept, count: 0 }
    }

    /// Keeps this of a pixel if what is seen there is at this depth.
    #[inline(always)]
    fn take(&mut self, there: &mut f32, depth: f32, kept: K) {
        let bits = there.to_bits();
        let is_seen = bits == depth.to_bits();
        self.kept[self.count] = kept;
        self.count += usize::from(is_seen);
        *there = f32::from_bits(select_unpredictable(is_seen, NOTHING.to_bits(), bits));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{ColoredPoint, Rasterizer, small_camera};
    use nalgebra::Point3;
    use proptest::prelude::*;

    /// Points before, beside and behind the camera, some of them exactly behind each other and some at
    /// equal depths.
    fn some_points() -> impl Strategy<Value = Vec<ColoredPoint>> {
        let coordinate = || (-40..40_i32).prop_map(|tenths| tenths as f32 / 20.0);
        let point = (coordinate(), coordinate(), 0..60_i32, 0_u8..=255);
        prop::collection::vec(point, 0..80).prop_map(|points| {
            let made = points.into_iter().map(|(x, y, depth, intensity)| {
                let z = depth as f32 / 10.0 - 1.0;
                ColoredPoint {
                    position: Point3::new(x * z, y * z, z),
                    intensity: f32::from(intensity),
                }
            });
            made.collect()
        })
    }

    proptest! {
        #[test]
        fn it_shows_what_the_plain_way_draws_pixel_by_pixel_in_any_order(
            points in some_points(),
            shifts in prop::collection::vec((-2.0_f64..2.0, -1.0_f64..1.0), 1..4),
            splat_px in prop_oneof![Just(1_usize), Just(3), Just(5), Just(15)],
            baseline: bool,
        ) {
            let arrays = PointArrays::new(points.iter().map(|point| point.position));
            let level = if baseline { Level::baseline() } else { Level::new() };
            let mut canvas = ZBuffer {
                level,
                ..ZBuffer::new(&small_camera(), splat_px)
            };
            let pixels: Vec<f32> = (0..63).map(|pixel| pixel as f32).collect();
            let intensities: Vec<f32> = points.iter().map(|point| point.intensity).collect();
            let values = Values { query: &pixels, points: &intensities };
            for (right, forward) in shifts {
                let pose = Pose::translation(right, 0.0, forward);
                let kept = |query: f32, synthetic: f32| (query as u32, synthetic as u32);
                let mut seen = canvas.draw(&arrays, values, &pose, kept).to_vec();
                seen.sort_unstable();
                let mut plainly = Rasterizer::new(&small_camera(), splat_px);
                let mut drawn: Vec<_> = plainly
                    .splat(&points, &pose)
                    .iter()
                    .map(|pixel| (pixel.index, pixel.intensity as u32))
                    .collect();
                drawn.sort_unstable();
                prop_assert_eq!(seen, drawn);
            }
        }
    }

    #[test]
    fn a_point_so_far_away_that_no_number_says_how_far_is_not_seen() {
        let point = ColoredPoint { position: Point3::new(0.0, 0.0, f32::MAX), intensity: 7.0 };
        let twice_as_far = Pose::translation(0.0, 0.0, f64::from(f32::MAX));
        let arrays = PointArrays::new([point.position].into_iter());
        let values = Values { query: &[0.0; 63], points: &[7.0] };
        for splat_px in [1, 3] {
            let mut canvas = ZBuffer::new(&small_camera(), splat_px);
            assert!(canvas.draw(&arrays, values, &twice_as_far, |_, seen| seen).is_empty());
            let mut plainly = Rasterizer::new(&small_camera(), splat_px);
            assert!(plainly.splat(&[point], &twice_as_far).is_empty());
        }
    }

    #[test]
    fn a_huge_image_has_no_canvas() {
        let huge = Intrinsics { width: 1 << 13, height: (1 << 11) + 1, ..small_camera() };
        assert!(!ZBuffer::<u8>::can_draw(&huge, 1));
        assert!(ZBuffer::<u8>::can_draw(&small_camera(), 1));
    }
}
