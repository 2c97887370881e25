//! Where the points of a cloud fall in a camera, one by one or eight at a time.

use fearless_simd::{Simd, SimdBase as _, SimdFloat as _, f32x8, u32x8};

use super::ColoredPoint;
use crate::camera::Intrinsics;
use crate::geometry::Pose;

/// Nearer points are not seen \[m\].
const NEAREST_M: f32 = 0.1;

/// A projection of single precision: for a point p, `row · (p, 1)` is column times depth, row times depth,
/// and depth \[px·m, px·m, m\].
pub type ProjectionRows = [[f32; 4]; 3];

/// Pose and intrinsics in single precision: half the memory traffic of the inner loop, and exact to
/// 1/1000 px at the ranges of a scanner.
pub(super) struct Projection {
    rows: ProjectionRows,
    width: u32,
    height: u32,
    reach: i32,
    /// From one row to the next in the positions of pixels.
    stride: i32,
}

/// Eight points in a camera.
pub(super) struct Eight {
    /// Position of the nearest pixel in the image that is larger by the reach on each side, or
    /// [`Self::OUT_OF_VIEW`]: the row times the stride, and the column.
    pub pixels: [u32; 8],
    /// Depth \[m\].
    pub depths: [f32; 8],
}

impl Eight {
    /// The pixel of a point that is behind the camera, too near or too far outside the image.
    pub const OUT_OF_VIEW: u32 = u32::MAX;
}

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

    /// What a device projects by.
    pub fn rows(&self) -> ProjectionRows {
        self.rows
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
        if !(depth > NEAREST_M && depth < f32::INFINITY) {
            return None;
        }
        let inverse = depth.recip();
        let u = along(&self.rows[0]) * inverse;
        let v = along(&self.rows[1]) * inverse;
        Some((floor(u + 0.5), floor(v + 0.5), depth))
    }

    /// As [`Self::pixel_and_depth`] for eight points at once, by the same operations in the same order
    /// and so with the same result.
    #[inline(always)]
    pub fn eight<S: Simd>(&self, simd: S, [x, y, z]: [&[f32]; 3]) -> Eight {
        let points = [
            f32x8::from_slice(simd, x),
            f32x8::from_slice(simd, y),
            f32x8::from_slice(simd, z),
        ];
        let depth = along(&self.rows[2], points);
        let inverse = f32x8::splat(simd, 1.0) / depth;
        let column = (along(&self.rows[0], points) * inverse + 0.5).floor();
        let row = (along(&self.rows[1], points) * inverse + 0.5).floor();
        let reach = self.reach as f32;
        let in_view = depth.simd_gt(NEAREST_M)
            & depth.simd_lt(f32::INFINITY)
            & column.simd_ge(-reach)
            & row.simd_ge(-reach)
            & column.simd_lt(self.width as f32 + reach)
            & row.simd_lt(self.height as f32 + reach);
        let [column, row] = [simd.cvt_i32_f32x8(column), simd.cvt_i32_f32x8(row)];
        let pixels = (row + self.reach) * self.stride + (column + self.reach);
        let pixels = simd.reinterpret_u32_i32x8(pixels);
        let out_of_view = u32x8::splat(simd, Eight::OUT_OF_VIEW);
        Eight {
            pixels: simd.as_array_u32x8(simd.select_u32x8(in_view, pixels, out_of_view)),
            depths: simd.as_array_f32x8(depth),
        }
    }
}

/// One row of the projection applied to eight points.
#[inline(always)]
fn along<S: Simd>(row: &[f32; 4], [x, y, z]: [f32x8<S>; 3]) -> f32x8<S> {
    x * row[0] + y * row[1] + z * row[2] + row[3]
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
