//! Sums over grids of boxes, from shared differences.
//!
//! In a grid along the image axes, the same rows of pixels cut all boxes of a row. They are added up once
//! along the row, many pixels at a time, in the order of operations of a single box: the sums are the same
//! to the last bit.

use super::integral::{IntegralImage, Span};

/// Columns of the table that one row of boxes may span: 26 units of the scale of the largest filters of
/// four octaves. A wider row takes its boxes one by one.
const MAX_WIDTH: usize = 1024;

/// The extents of the boxes of a grid along one axis.
pub(super) struct Spans<const N: usize> {
    first: [u32; N],
    last: [u32; N],
    head: [f32; N],
    tail: [f32; N],
}

impl<const N: usize> Spans<N> {
    /// Spans of length `side` \[px\] about each of the centres, in an image of `extent` pixels along this axis.
    ///
    /// A span that would leave the image is moved back to its border: the image goes on as its outermost
    /// pixels, without the edge that a black frame would add. `side` must not exceed `extent`.
    #[inline(always)]
    pub(super) fn new(centres: &[f32; N], side: f32, extent: usize) -> Self {
        let mut spans = Self { first: [0; N], last: [0; N], head: [0.0; N], tail: [0.0; N] };
        let room = (extent as f32 - side).max(0.0);
        let furthest = extent as i32 - 1;
        for (i, centre) in centres.iter().enumerate() {
            let start = (centre + 0.5 - 0.5 * side).max(0.0).min(room);
            let end = start + side;
            let first = (start as i32).min(furthest);
            let last = (end as i32).min(furthest);
            spans.first[i] = first as u32;
            spans.last[i] = last as u32;
            spans.head[i] = 1.0 - (start - first as f32);
            spans.tail[i] = end - last as f32;
        }
        spans
    }

    #[inline(always)]
    fn span(&self, index: usize) -> Span {
        Span {
            first: self.first[index] as usize,
            head: self.head[index],
            last: self.last[index] as usize,
            tail: self.tail[index],
        }
    }
}

/// Room for what the boxes of a row have in common, kept from grid to grid.
pub(super) struct Strips {
    /// Sums of each column of the table's differences: over the upper cut pixels, the whole ones, the
    /// lower cut ones.
    sums: [[u32; MAX_WIDTH]; 3],
    /// What each single column of pixels counts.
    columns: [f32; MAX_WIDTH],
}

impl Default for Strips {
    fn default() -> Self {
        Self { sums: [[0; MAX_WIDTH]; 3], columns: [0.0; MAX_WIDTH] }
    }
}

/// Sums over the boxes of a grid along the axes, row by row. The spans of the columns must not go
/// backwards.
#[inline(always)]
pub(super) fn aligned<const N: usize>(
    integral: &IntegralImage,
    columns: &Spans<N>,
    rows: &Spans<N>,
    strips: &mut Strips,
) -> [[f32; N]; N] {
    let mut boxes = [[0.0; N]; N];
    let left = columns.first[0] as usize;
    let width = columns.last[N - 1] as usize + 2 - left;
    if width > MAX_WIDTH {
        for (row, boxes) in boxes.iter_mut().enumerate() {
            for (column, sum) in boxes.iter_mut().enumerate() {
                *sum = integral.area(columns.span(column), rows.span(row));
            }
        }
        return boxes;
    }
    for (row, boxes) in boxes.iter_mut().enumerate() {
        let rows = rows.span(row);
        strips.fill(integral, rows, left, width);
        let [upper, whole, lower] = &strips.sums;
        let mut inner = [[0_u32; N]; 3];
        let mut ends = [[0.0_f32; N]; 2];
        for i in 0..N {
            // Within the strips, as the compiler sees.
            let first = (columns.first[i] as usize - left) % MAX_WIDTH;
            let start = (columns.first[i] as usize + 1 - left) % MAX_WIDTH;
            let end = (columns.last[i] as usize - left) % MAX_WIDTH;
            inner[0][i] = upper[end].wrapping_sub(upper[start]);
            inner[1][i] = whole[end].wrapping_sub(whole[start]);
            inner[2][i] = lower[end].wrapping_sub(lower[start]);
            ends[0][i] = strips.columns[first];
            ends[1][i] = strips.columns[end];
        }
        for i in 0..N {
            let whole = |strip: usize| inner[strip][i] as i32 as f32;
            let middle = rows.head * whole(0) + whole(1) + rows.tail * whole(2);
            boxes[i] = columns.head[i] * ends[0][i] + middle + columns.tail[i] * ends[1][i];
        }
    }
    boxes
}

impl Strips {
    #[inline(always)]
    fn fill(&mut self, integral: &IntegralImage, rows: Span, left: usize, width: usize) {
        let table = |row: usize| &integral.row(row)[left..][..width];
        let [upper, whole, lower] = &mut self.sums;
        let (upper, whole, lower) = (&mut upper[..width], &mut whole[..width], &mut lower[..width]);
        let (a, b) = (table(rows.first), table(rows.first + 1));
        let (c, d) = (table(rows.last), table(rows.last + 1));
        for i in 0..width {
            upper[i] = b[i].wrapping_sub(a[i]);
            whole[i] = c[i].wrapping_sub(b[i]);
            lower[i] = d[i].wrapping_sub(c[i]);
        }
        let columns = &mut self.columns[..width - 1];
        let (upper, after_upper) = (&upper[..width - 1], &upper[1..]);
        let (whole, after_whole) = (&whole[..width - 1], &whole[1..]);
        let (lower, after_lower) = (&lower[..width - 1], &lower[1..]);
        for i in 0..width - 1 {
            let head = after_upper[i].wrapping_sub(upper[i]) as i32 as f32;
            let body = after_whole[i].wrapping_sub(whole[i]) as i32 as f32;
            let tail = after_lower[i].wrapping_sub(lower[i]) as i32 as f32;
            columns[i] = rows.head * head + body + rows.tail * tail;
        }
    }
}

/// Sums over boxes that lie anywhere.
#[inline(always)]
pub(super) fn scattered<const N: usize>(
    integral: &IntegralImage,
    columns: &Spans<N>,
    rows: &Spans<N>,
) -> [f32; N] {
    let mut boxes = [0.0; N];
    for (i, sum) in boxes.iter_mut().enumerate() {
        *sum = integral.area(columns.span(i), rows.span(i));
    }
    boxes
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn grids_are_their_boxes_one_by_one(
            pixels in prop::collection::vec(any::<u8>(), 90 * 70),
            x in -20.0f32..110.0, y in -20.0f32..90.0, scale in 0.3f32..8.0, side in 1.0f32..2.0,
        ) {
            let image = GrayImage::from_raw(90, 70, pixels).expect("a full image");
            let integral = IntegralImage::new(&image);
            let side = side * scale;
            let centres = |centre: f32| -> [f32; 7] {
                std::array::from_fn(|i| centre + scale * (i as f32 - 3.0))
            };
            let (xs, ys) = (centres(x), centres(y));
            let (columns, rows) = (Spans::new(&xs, side, 90), Spans::new(&ys, side, 70));
            let boxes = aligned(&integral, &columns, &rows, &mut Strips::default());
            for (boxes, &y) in boxes.iter().zip(&ys) {
                for (&sum, &x) in boxes.iter().zip(&xs) {
                    let area = integral.area(Span::new(x, side, 90), Span::new(y, side, 70));
                    prop_assert_eq!(sum.to_bits(), area.to_bits());
                }
            }
            let diagonal = scattered(&integral, &columns, &rows);
            prop_assert_eq!(diagonal, std::array::from_fn(|i| boxes[i][i]));
        }
    }

    #[test]
    fn wide_grids_are_their_boxes_one_by_one() {
        let image = GrayImage::from_fn(1500, 1400, |x, y| {
            Luma([((x * x + 7 * y + x * y / 3) % 251) as u8])
        });
        let integral = IntegralImage::new(&image);
        for scale in [120.0, 160.0] {
            let xs: [f32; 9] = std::array::from_fn(|i| 700.3 + scale * (i as f32 - 4.0));
            let columns = Spans::new(&xs, 1.5 * scale, 1500);
            let rows = Spans::new(&xs, 1.5 * scale, 1400);
            let boxes = aligned(&integral, &columns, &rows, &mut Strips::default());
            for (i, boxes) in boxes.iter().enumerate() {
                for (j, &sum) in boxes.iter().enumerate() {
                    assert_eq!(sum, integral.area(columns.span(j), rows.span(i)));
                }
            }
        }
    }
}
