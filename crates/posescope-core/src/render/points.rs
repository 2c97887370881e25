//! Points as arrays, and where they fall in a camera.

use std::sync::atomic::{AtomicU64, Ordering};

use fearless_simd::Simd;
use nalgebra::Point3;

use super::projection::{OUT_OF_VIEW, Projection, Turn, loaded};

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

    /// The points; those that fill up the last vector follow.
    pub(crate) fn iter(&self) -> impl Iterator<Item = Point3<f32>> + '_ {
        let [x, y, z] = &self.coordinates;
        x.iter().zip(y).zip(z).map(|((&x, &y), &z)| Point3::new(x, y, z))
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

/// The bits above which a pixel's row stands, and its column below.
pub(super) const ROW_BITS: u32 = 16;
/// More columns or rows than any image has that is drawn on in squares.
pub(super) const MAX_ROWS: usize = (1 << ROW_BITS) - 1;

/// What is compared: for each pixel of the image the query's value, for each point that of the point.
#[derive(Clone, Copy)]
pub struct Values<'a, T> {
    /// The query's, row by row.
    pub query: &'a [T],
    /// The points', in their order.
    pub points: &'a [T],
}

/// Where the points fall.
#[derive(Default)]
pub(super) struct ProjectedPoints {
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

impl ProjectedPoints {
    #[inline(always)]
    pub(super) fn project<S: Simd>(
        &mut self,
        simd: S,
        points: &PointArrays,
        projection: &Projection,
    ) {
        self.pixels.resize(points.len(), OUT_OF_VIEW);
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
                (*pixels, *depths) = of_eight.project(loaded(simd, [a, b, c]));
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
            (*pixels, *depths) = of_eight.project(turned);
        }
    }
}
