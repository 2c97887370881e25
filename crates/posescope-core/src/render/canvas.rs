//! Drawing one hypothesis after the other, fast: what the direct methods spend their time on.

use std::sync::atomic::{AtomicU64, Ordering};

use fearless_simd::{Level, Simd, dispatch};
use nalgebra::Point3;

use super::projection::{Eight, Projection, Turn, loaded};
use crate::camera::Intrinsics;
use crate::cost::Pair;
use crate::geometry::Pose;

/// Points that are projected at once.
const LANES: usize = 8;

/// Positions of points as a structure of arrays, so that several are projected at once.
pub struct PointArrays {
    /// No other points have it.
    number: u64,
    /// Coordinates along x, y and z \[m\], filled up to whole vectors with points that no camera sees.
    coordinates: [Vec<f32>; 3],
}

impl PointArrays {
    /// The positions of the points, in their order.
    pub fn new(points: impl ExactSizeIterator<Item = Point3<f32>> + Clone) -> Self {
        let padding = points.len().next_multiple_of(LANES) - points.len();
        let along = |axis: usize| {
            let coordinates = points.clone().map(|point| point[axis]);
            coordinates.chain(std::iter::repeat_n(f32::NAN, padding)).collect()
        };
        static COUNT: AtomicU64 = AtomicU64::new(0);
        Self {
            number: COUNT.fetch_add(1, Ordering::Relaxed),
            coordinates: [along(0), along(1), along(2)],
        }
    }

    /// Number of points, and of what fills up the last vector.
    fn len(&self) -> usize {
        self.coordinates[0].len()
    }

    /// Coordinates along x, y and z, eight points at a time.
    #[inline(always)]
    fn eights(&self) -> [&[[f32; LANES]]; 3] {
        self.coordinates.each_ref().map(|axis| axis.as_chunks().0)
    }
}

/// Bits of a slot that hold a place in the list of covered pixels; the others say which drawing it is.
const PLACE_BITS: u32 = 24;
/// Drawings after which the slots are cleared.
const MOST_DRAWINGS: u32 = 1 << (u32::BITS - PLACE_BITS);

/// The bits above which a pixel's row stands, and its column below.
pub(super) const ROW_BITS: u32 = 16;
/// More columns or rows than any image has that is drawn on in squares.
pub(super) const MOST_ROWS: usize = (1 << ROW_BITS) - 1;

/// Draws points for one hypothesis after the other, and keeps what query and synthetic view show where
/// both exist. Where the order of the pixels has no part in the cost, [`DepthCanvas`](super::DepthCanvas)
/// is faster.
///
/// Each pixel of the image has a slot that says where in the list of this drawing it stands. A slot also
/// says which drawing it is of, so nothing is cleared between two drawings, and all that is read of an
/// image is the slot and the query's value of the pixels on which points fall. The pairs are those of
/// [`Rasterizer`](super::Rasterizer), bit by bit and in the same order.
pub struct Canvas<T> {
    level: Level,
    intrinsics: Intrinsics,
    reach: i32,
    drawing: u32,
    slots: Vec<u32>,
    projected: Projected,
    covered: Covered<T>,
}

/// Where the points fall.
#[derive(Default)]
pub(super) struct Projected {
    /// Position of the nearest pixel, or one that no image has: row-major where a point covers its own
    /// pixel alone, and otherwise the row in the upper bits and the column in the lower.
    pub(super) pixels: Vec<u32>,
    /// Depths \[m\].
    pub(super) depths: Vec<f32>,
    /// What points were projected last, and how the camera was turned.
    last: Option<(u64, Turn)>,
    /// What the turn alone makes of them. A search moves the camera more often than it turns it.
    turned: [Vec<[f32; LANES]>; 3],
}

/// The pixels on which points fell, in that order, and room for more.
struct Covered<T> {
    /// Depths of the visible points \[m\].
    depths: Vec<f32>,
    pairs: Vec<Pair<T>>,
    count: usize,
}

/// What is compared: for each pixel of the image the query's value, for each point that of the point.
#[derive(Clone, Copy)]
pub struct Values<'a, T> {
    /// The query's, row by row.
    pub query: &'a [T],
    /// The points', in their order.
    pub points: &'a [T],
}

impl<T: Copy + Default> Canvas<T> {
    /// An empty canvas for a camera; each point covers a square of `splat_px` (odd) pixels. `None` for
    /// an image of more pixels than it can tell apart, 16 million, or 65,000 in a row.
    pub fn new(intrinsics: &Intrinsics, splat_px: usize) -> Option<Self> {
        let [width, height] = [intrinsics.width, intrinsics.height].map(|side| side as usize);
        let pixels = width * height;
        let longest = width.max(height) + splat_px;
        (pixels <= 1 << PLACE_BITS && longest < MOST_ROWS).then(|| Self {
            level: Level::new(),
            intrinsics: *intrinsics,
            reach: (splat_px / 2) as i32,
            drawing: 0,
            slots: vec![0; pixels],
            projected: Projected::default(),
            covered: Covered { depths: Vec::new(), pairs: Vec::new(), count: 0 },
        })
    }

    /// From now on, what another camera of the same size sees.
    pub fn look_through(&mut self, intrinsics: &Intrinsics) {
        self.intrinsics = *intrinsics;
    }

    /// What the query and a camera at `camera_from_points` show, at each pixel on which points fall.
    pub fn draw(
        &mut self,
        points: &PointArrays,
        values: Values<'_, T>,
        camera_from_points: &Pose,
    ) -> &[Pair<T>] {
        self.drawing += 1;
        if self.drawing == MOST_DRAWINGS {
            self.slots.fill(0);
            self.drawing = 1;
        }
        let side = 2 * self.reach as usize + 1;
        let most = (values.points.len() * side * side).min(self.slots.len());
        self.covered.make_room(most);

        let Self { level, projected, .. } = self;
        let (level, reach) = (*level, self.reach);
        let projection = Projection::new(&self.intrinsics, reach, camera_from_points);
        let projection = match reach {
            0 => projection,
            _ => projection.with_stride(1 << ROW_BITS),
        };
        dispatch!(level, simd => projected.project(simd, points, &projection));
        match reach {
            0 => self.draw_points(values),
            1 => self.draw_squares::<3>(values),
            2 => self.draw_squares::<5>(values),
            _ => self.draw_squares::<0>(values),
        }
        &self.covered.pairs[..self.covered.count]
    }

    fn draw_points(&mut self, values: Values<'_, T>) {
        let first_slot = self.drawing << PLACE_BITS;
        let slots = self.slots.as_mut_slice();
        // Of equal lengths, as the compiler sees, so that one comparison serves both.
        let query = &values.query[..slots.len()];
        let Projected { pixels, depths, .. } = &self.projected;
        for ((&pixel, &depth), &synthetic) in pixels.iter().zip(depths).zip(values.points) {
            let pixel = pixel as usize;
            if pixel < slots.len() {
                let pair = Pair { query: query[pixel], synthetic };
                self.covered.put(&mut slots[pixel], first_slot, depth, pair);
            }
        }
    }

    /// Draws squares of `SIDE` pixels, or 0 for such as the canvas was made for.
    fn draw_squares<const SIDE: usize>(&mut self, values: Values<'_, T>) {
        let first_slot = self.drawing << PLACE_BITS;
        let reach = self.reach;
        let [width, height] =
            [self.intrinsics.width, self.intrinsics.height].map(|side| side as i32);
        let slots = self.slots.as_mut_slice();
        let query = &values.query[..slots.len()];
        let Projected { pixels, depths, .. } = &self.projected;
        for ((&pixel, &depth), &synthetic) in pixels.iter().zip(depths).zip(values.points) {
            if pixel == Eight::OUT_OF_VIEW {
                continue;
            }
            // A point may be outside the image by as much as it reaches.
            let left = (pixel & (MOST_ROWS as u32)) as i32 - 2 * reach;
            let top = (pixel >> ROW_BITS) as i32 - 2 * reach;
            let side = 2 * reach + 1;
            if SIDE > 0 && left >= 0 && top >= 0 && left + side <= width && top + side <= height {
                let mut begin = (top * width + left) as usize;
                for _ in 0..SIDE {
                    let slots = &mut slots[begin..][..SIDE];
                    for (slot, &query) in slots.iter_mut().zip(&query[begin..][..SIDE]) {
                        self.covered.put(slot, first_slot, depth, Pair { query, synthetic });
                    }
                    begin += width as usize;
                }
                continue;
            }
            let columns = left.max(0)..(left + side).min(width);
            for row in top.max(0)..(top + side).min(height) {
                let begin = (row * width + columns.start) as usize;
                let pixels = begin..begin + columns.len();
                let slots = slots[pixels.clone()].iter_mut();
                for (slot, &query) in slots.zip(&query[pixels]) {
                    self.covered.put(slot, first_slot, depth, Pair { query, synthetic });
                }
            }
        }
    }
}

impl Projected {
    #[inline(always)]
    pub(super) fn project<S: Simd>(
        &mut self,
        simd: S,
        points: &PointArrays,
        projection: &Projection,
    ) {
        self.pixels.resize(points.len(), Eight::OUT_OF_VIEW);
        self.depths.resize(points.len(), 0.0);
        let (pixels, _) = self.pixels.as_chunks_mut::<LANES>();
        let (depths, _) = self.depths.as_chunks_mut::<LANES>();
        let places = pixels.iter_mut().zip(depths);
        let of_eight = projection.of_eight(simd);
        let turn = Some((points.number, projection.turn()));
        let is_known = self.last == turn;
        self.last = turn;
        if is_known {
            let [a, b, c] = self.turned.each_ref().map(Vec::as_slice);
            for ((((pixels, depths), a), b), c) in places.zip(a).zip(b).zip(c) {
                let projected = of_eight.project(loaded(simd, [a, b, c]));
                (*pixels, *depths) = (projected.pixels, projected.depths);
            }
            return;
        }
        let [x, y, z] = points.eights();
        let [a, b, c] = self.turned.each_mut().map(|turned| {
            turned.resize(x.len(), [0.0; LANES]);
            turned.as_mut_slice()
        });
        let coordinates = x.iter().zip(y).zip(z);
        let kept = a.iter_mut().zip(b).zip(c);
        for (((pixels, depths), ((x, y), z)), ((a, b), c)) in places.zip(coordinates).zip(kept) {
            let turned = of_eight.turned([x, y, z]);
            *a = simd.as_array_f32x8(turned[0]);
            *b = simd.as_array_f32x8(turned[1]);
            *c = simd.as_array_f32x8(turned[2]);
            let projected = of_eight.project(turned);
            (*pixels, *depths) = (projected.pixels, projected.depths);
        }
    }
}

impl<T: Copy + Default> Covered<T> {
    /// Forgets the last drawing and makes room for `most` pixels.
    fn make_room(&mut self, most: usize) {
        self.count = 0;
        if self.depths.len() < most {
            self.depths.resize(most, 0.0);
            self.pairs.resize(most, Pair::default());
        }
    }

    /// The nearest point is seen; of two at the same depth, the one that comes first.
    #[inline(always)]
    fn put(&mut self, slot: &mut u32, first_slot: u32, depth: f32, pair: Pair<T>) {
        if *slot < first_slot {
            *slot = first_slot + self.count as u32;
            self.depths[self.count] = depth;
            self.pairs[self.count] = pair;
            self.count += 1;
        } else {
            let place = (*slot - first_slot) as usize;
            if depth < self.depths[place] {
                self.depths[place] = depth;
                self.pairs[place] = pair;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::small_camera;
    use crate::render::{ColoredPoint, Rasterizer, SplattedPixel};
    use proptest::prelude::*;

    /// Points before, beside and behind the camera, some of them exactly behind each other and some at
    /// equal depths.
    fn some_points() -> impl Strategy<Value = Vec<ColoredPoint>> {
        let coordinate = || (-40..40_i32).prop_map(|tenths| tenths as f32 / 20.0);
        let point = (coordinate(), coordinate(), 0..60_i32, 0.0_f32..=255.0);
        prop::collection::vec(point, 0..80).prop_map(|points| {
            let made = points.into_iter().map(|(x, y, depth, intensity)| {
                let z = depth as f32 / 10.0 - 1.0;
                let intensity = intensity.round();
                ColoredPoint { position: Point3::new(x * z, y * z, z), intensity }
            });
            made.collect()
        })
    }

    /// What the plain way draws.
    fn plainly(points: &[ColoredPoint], splat_px: usize, pose: &Pose) -> Vec<SplattedPixel> {
        Rasterizer::new(&small_camera(), splat_px).splat(points, pose).to_vec()
    }

    fn level(baseline: bool) -> Level {
        if baseline { Level::baseline() } else { Level::new() }
    }

    proptest! {
        #[test]
        fn a_canvas_shows_what_the_plain_way_draws_pixel_by_pixel_and_in_its_order(
            points in some_points(),
            shifts in prop::collection::vec((-2.0_f64..2.0, -1.0_f64..1.0), 1..4),
            splat_px in prop_oneof![Just(1_usize), Just(3), Just(5), Just(15)],
            baseline: bool,
        ) {
            let arrays = PointArrays::new(points.iter().map(|point| point.position));
            let mut canvas = Canvas {
                level: level(baseline),
                ..Canvas::new(&small_camera(), splat_px).expect("a small image")
            };
            let pixels: Vec<f32> = (0..63).map(|pixel| pixel as f32).collect();
            let intensities: Vec<f32> = points.iter().map(|point| point.intensity).collect();
            let values = Values { query: &pixels, points: &intensities };
            for (right, forward) in shifts {
                let pose = Pose::translation(right, 0.0, forward);
                let seen: Vec<_> = canvas
                    .draw(&arrays, values, &pose)
                    .iter()
                    .map(|pair| (pair.query as u32, pair.synthetic))
                    .collect();
                let drawn: Vec<_> = plainly(&points, splat_px, &pose)
                    .iter()
                    .map(|pixel| (pixel.index, pixel.intensity))
                    .collect();
                prop_assert_eq!(seen, drawn);
            }
        }
    }

    #[test]
    fn more_drawings_than_a_slot_counts_leave_no_trace() {
        let points: Vec<_> = (0..9)
            .map(|i| ColoredPoint {
                position: Point3::new(0.1 * (i as f32 - 4.0), 0.0, 1.0),
                intensity: i as f32,
            })
            .collect();
        let values = Values { query: &[0; 63], points: &[0; 9] };
        let [all, one, none] = [9, 1, 0]
            .map(|count| PointArrays::new(points[..count].iter().map(|point| point.position)));
        let mut canvas = Canvas::new(&small_camera(), 1).expect("a small image");
        let mut covered = |points| canvas.draw(points, values, &Pose::identity()).len();
        assert_eq!(covered(&all), 9);
        // The drawing after these has the number of the first one again.
        for _ in 1..MOST_DRAWINGS - 1 {
            assert_eq!(covered(&none), 0);
        }
        assert_eq!(covered(&one), 1);
        assert_eq!(covered(&all), 9);
    }

    #[test]
    fn a_huge_image_has_no_canvas() {
        let huge = Intrinsics { width: 1 << 13, height: (1 << 11) + 1, ..small_camera() };
        assert!(Canvas::<u8>::new(&huge, 1).is_none());
    }
}
