//! Where the points of a cloud fall in a camera, one by one or eight at a time.

use fearless_simd::{Simd, SimdBase as _, SimdFloat as _, f32x8, u32x8};

use super::ColoredPoint;
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// Nearer points are not seen \[m\].
const MIN_DEPTH_M: f32 = 0.1;

/// A projection of single precision: for a point p, `row · (p, 1)` is column times depth, row times depth,
/// and depth \[px·m, px·m, m\].
pub type ProjectionRows = [[f32; 4]; 3];

/// Pose and intrinsics in single precision: half the memory traffic of the inner loop, and exact to
/// 1/1000 px at the ranges of a scanner.
pub(super) struct Projection {
    /// What a device projects by.
    pub rows: ProjectionRows,
    width: u32,
    height: u32,
    reach: i32,
    /// From one row to the next in the positions of pixels.
    stride: i32,
}

/// The pixel of a point that is behind the camera, too near or too far outside the image.
pub(super) const OUT_OF_VIEW: u32 = u32::MAX;

impl Projection {
    /// The projection of points into a camera. Each covers all pixels that are at most `reach` columns
    /// and rows from its own.
    pub fn new(intrinsics: &Intrinsics, reach: i32, camera_from_points: &Pose) -> Self {
        let m = camera_from_points.to_homogeneous();
        let row = |focal: f64, centre: f64, axis: usize| {
            std::array::from_fn(|c| (focal * m[(axis, c)] + centre * m[(2, c)]) as f32)
        };
        Self {
            rows: [
                row(intrinsics.fx, intrinsics.cx, 0),
                row(intrinsics.fy, intrinsics.cy, 1),
                std::array::from_fn(|c| m[(2, c)] as f32),
            ],
            width: intrinsics.width,
            height: intrinsics.height,
            reach,
            stride: intrinsics.width as i32 + 2 * reach,
        }
    }

    /// The same projection with other positions of pixels.
    pub fn with_stride(self, stride: u32) -> Self {
        let stride = stride as i32;
        Self { stride, ..self }
    }

    /// Column and row of the nearest pixel, in the image or not, and depth \[m\]; `None` behind the
    /// camera, nearer than 10 cm, or where there is no number for the depth.
    #[inline]
    pub fn pixel_and_depth(&self, point: &ColoredPoint) -> Option<(i32, i32, f32)> {
        let p = &point.position;
        let along = |row: &[f32; 4]| row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3];
        let depth = along(&self.rows[2]);
        if !(depth > MIN_DEPTH_M && depth < f32::INFINITY) {
            return None;
        }
        let inverse = depth.recip();
        let u = along(&self.rows[0]) * inverse;
        let v = along(&self.rows[1]) * inverse;
        Some((floor(u + 0.5), floor(v + 0.5), depth))
    }

    /// What of it all cameras that look one way have in common: what coordinates are multiplied by.
    pub fn turn(&self) -> Turn {
        self.rows.map(|[x, y, z, _]| [x, y, z].map(f32::to_bits))
    }

    /// The same for several points at once.
    #[inline(always)]
    pub fn of_eight<S: Simd>(&self, simd: S) -> ProjectionOfEight<S> {
        let number = |value: f32| f32x8::splat(simd, value);
        let reach = self.reach as f32;
        ProjectionOfEight {
            simd,
            factors: self.rows.map(|[x, y, z, _]| [x, y, z].map(number)),
            added: self.rows.map(|[.., added]| number(added)),
            first: number(-reach),
            ends: [self.width, self.height].map(|side| number(side as f32 + reach)),
            reach: self.reach,
            stride: self.stride,
        }
    }
}

/// The part of a projection that is the same for all cameras that look one way, as bits.
pub(super) type Turn = [[u32; 3]; 3];

/// A projection of eight points at once. Its numbers stay in registers, wherever results are written.
#[derive(Clone, Copy)]
pub(super) struct ProjectionOfEight<S: Simd> {
    simd: S,
    factors: [[f32x8<S>; 3]; 3],
    added: [f32x8<S>; 3],
    first: f32x8<S>,
    ends: [f32x8<S>; 2],
    reach: i32,
    stride: i32,
}

impl<S: Simd> ProjectionOfEight<S> {
    /// What the turn alone makes of eight points.
    #[inline(always)]
    pub fn turned(&self, coordinates: [&[f32; 8]; 3]) -> [f32x8<S>; 3] {
        let [a, b, c] = &self.factors;
        let [x, y, z] = loaded(self.simd, coordinates);
        [
            x * a[0] + y * a[1] + z * a[2],
            x * b[0] + y * b[1] + z * b[2],
            x * c[0] + y * c[1] + z * c[2],
        ]
    }

    /// As [`Projection::pixel_and_depth`] for eight points that were turned before, by the same operations in
    /// the same order and so with the same result: positions of the nearest pixels in the image that is larger
    /// by the reach on each side, the row times the stride and the column, or [`OUT_OF_VIEW`]; and depths \[m\].
    #[inline(always)]
    pub fn project(&self, turned: [f32x8<S>; 3]) -> ([u32; 8], [f32; 8]) {
        let simd = self.simd;
        let depth = turned[2] + self.added[2];
        let inverse = f32x8::splat(simd, 1.0) / depth;
        let column = ((turned[0] + self.added[0]) * inverse + 0.5).floor();
        let row = ((turned[1] + self.added[1]) * inverse + 0.5).floor();
        let in_view = depth.simd_gt(MIN_DEPTH_M)
            & depth.simd_lt(f32::INFINITY)
            & column.simd_ge(self.first)
            & row.simd_ge(self.first)
            & column.simd_lt(self.ends[0])
            & row.simd_lt(self.ends[1]);
        let [column, row] = [simd.cvt_i32_f32x8(column), simd.cvt_i32_f32x8(row)];
        let pixels = (row + self.reach) * self.stride + (column + self.reach);
        let pixels = simd.reinterpret_u32_i32x8(pixels);
        let pixels = simd.select_u32x8(in_view, pixels, u32x8::splat(simd, OUT_OF_VIEW));
        (simd.as_array_u32x8(pixels), simd.as_array_f32x8(depth))
    }
}

/// Three times eight numbers.
#[inline(always)]
pub(super) fn loaded<S: Simd>(simd: S, [a, b, c]: [&[f32; 8]; 3]) -> [f32x8<S>; 3] {
    [simd.load_array_ref_f32x8(a), simd.load_array_ref_f32x8(b), simd.load_array_ref_f32x8(c)]
}

/// [`f32::floor`] as a whole number. That of the standard library is a call for every point, unless
/// it is compiled for processors with SSE4.1 alone.
#[inline]
fn floor(value: f32) -> i32 {
    let truncated = value as i32;
    truncated.saturating_sub(i32::from(truncated as f32 > value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn floor_is_that_of_the_standard_library(bits: u32) {
            let value = f32::from_bits(bits);
            prop_assert_eq!(floor(value), value.floor() as i32);
        }
    }
}
