//! Integral images: the sum over a box of any size from a fixed number of look-ups.

use image::GrayImage;
use rayon::prelude::*;

/// Fewer rows are not worth a thread.
const MIN_BAND: usize = 64;

/// The integral image of a grey image (section 3.1, equation 1).
///
/// Entry (x, y) is the sum of all pixels left of column x and above row y, so the table has one
/// column and one row more than the image. Sums are kept modulo 2³². They wrap round in images of
/// more than 16.8 million white pixels, and box sums still come out right, because no box is
/// that large.
pub(super) struct IntegralImage {
    /// Width of the image \[px\].
    pub(super) width: usize,
    /// Height of the image \[px\].
    pub(super) height: usize,
    sums: Vec<u32>,
}

impl IntegralImage {
    pub(super) fn new(image: &GrayImage) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let stride = width + 1;
        let mut sums = vec![0u32; stride * (height + 1)];
        // A band of rows for each thread, as if nothing were above it; then what is above it is added.
        let rows = height.div_ceil(rayon::current_num_threads()).max(MIN_BAND);
        let (_, table) = sums.split_at_mut(stride);
        let pixels = image.as_raw().par_chunks((rows * width).max(1));
        let bands = table.par_chunks_mut(rows * stride).zip(pixels);
        bands.for_each(|(band, pixels)| sum_up(band, pixels, width));
        let mut above = vec![0u32; stride];
        let mut incomplete = Vec::new();
        for band in table.chunks_mut(rows * stride) {
            let mut next = above.clone();
            add(&mut next, &band[band.len() - stride..]);
            incomplete.push((above, band));
            above = next;
        }
        let below_the_first = incomplete.into_par_iter().skip(1);
        below_the_first.for_each(|(above, band)| {
            let rows = band.chunks_exact_mut(stride);
            rows.for_each(|row| add(row, &above));
        });
        Self { width, height, sums }
    }

    /// Row `y` of the table, `width + 1` sums, for `y` from 0 to `height`.
    #[inline(always)]
    pub(super) fn row(&self, y: usize) -> &[u32] {
        let stride = self.width + 1;
        &self.sums[y * stride..][..stride]
    }

    /// Sum over the whole pixels in columns `left..right` and rows `top..bottom` (figure 1).
    pub(super) fn box_sum(&self, left: usize, top: usize, right: usize, bottom: usize) -> u32 {
        let (above, below) = (self.row(top), self.row(bottom));
        let above = above[right].wrapping_sub(above[left]);
        let below = below[right].wrapping_sub(below[left]);
        below.wrapping_sub(above)
    }

    /// Sum over a box whose edges may cut pixels; a cut pixel counts by its share inside.
    ///
    /// Gradients are taken on boxes with sides of 1.2 px upwards. Rounded to whole pixels, they
    /// would differ from each other by up to a factor of two in area.
    #[inline(always)]
    pub(super) fn area(&self, columns: Span, rows: Span) -> f32 {
        let upper = self.corners(columns, rows.first);
        let upper_inner = self.corners(columns, rows.first + 1);
        let lower_inner = self.corners(columns, rows.last);
        let lower = self.corners(columns, rows.last + 1);
        let column = |i: usize| {
            let strip = |row: [u32; 4]| row[i + 1].wrapping_sub(row[i]);
            // As signed numbers: within a single pixel, the box between the cut pixels is −1 pixel wide.
            let cell = |above, below| strip(below).wrapping_sub(strip(above)) as i32 as f32;
            let (head, body) = (cell(upper, upper_inner), cell(upper_inner, lower_inner));
            rows.head * head + body + rows.tail * cell(lower_inner, lower)
        };
        columns.head * column(0) + column(1) + columns.tail * column(2)
    }

    /// The four entries of one row of the table at the edges of the cut and the whole pixels.
    #[inline(always)]
    fn corners(&self, columns: Span, row: usize) -> [u32; 4] {
        let row = row * (self.width + 1);
        let first = &self.sums[row + columns.first..][..2];
        let last = &self.sums[row + columns.last..][..2];
        [first[0], first[1], last[0], last[1]]
    }
}

/// The rows of the table below some rows of pixels, as if nothing were above them. The table's rows are zero
/// before.
fn sum_up(sums: &mut [u32], pixels: &[u8], width: usize) {
    let stride = width + 1;
    let mut above: &[u32] = &vec![0; stride];
    for (row, pixels) in sums.chunks_exact_mut(stride).zip(pixels.chunks_exact(width.max(1))) {
        let mut row_sum = 0u32;
        for x in 0..width {
            row_sum = row_sum.wrapping_add(u32::from(pixels[x]));
            row[x + 1] = above[x + 1].wrapping_add(row_sum);
        }
        above = row;
    }
}

/// Adds one row of the table to another.
fn add(row: &mut [u32], other: &[u32]) {
    for (sum, other) in row.iter_mut().zip(other) {
        *sum = sum.wrapping_add(*other);
    }
}

/// The extent of a box along one axis: a cut pixel, whole pixels, another cut pixel.
#[derive(Clone, Copy)]
pub(super) struct Span {
    /// The first pixel.
    pub(super) first: usize,
    /// Its share inside.
    pub(super) head: f32,
    /// The last pixel.
    pub(super) last: usize,
    /// Its share inside.
    pub(super) tail: f32,
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    // What `Spans::new` must give for one centre alone.
    impl Span {
        pub(in crate::features) fn new(centre: f32, side: f32, extent: usize) -> Self {
            // Pixel centres are integers, so the image starts half a pixel before 0.
            let room = (extent as f32 - side).max(0.0);
            let start = (centre + 0.5 - 0.5 * side).max(0.0).min(room);
            let end = start + side;
            let first = (start as usize).min(extent - 1);
            let last = (end as usize).min(extent - 1);
            Self { first, head: 1.0 - (start - first as f32), last, tail: end - last as f32 }
        }
    }

    fn image() -> impl Strategy<Value = GrayImage> {
        (1u32..12, 1u32..12).prop_flat_map(|(width, height)| {
            prop::collection::vec(any::<u8>(), (width * height) as usize).prop_map(move |pixels| {
                GrayImage::from_raw(width, height, pixels).expect("a full image")
            })
        })
    }

    /// The length of the part of pixel `i` between `start` and `end`.
    fn overlap(i: u32, start: f32, end: f32) -> f32 {
        (end.min(i as f32 + 0.5) - start.max(i as f32 - 0.5)).max(0.0)
    }

    proptest! {
        #[test]
        fn box_sum_adds_up_pixels(
            image in image(),
            a in 0usize..12, b in 0usize..12, c in 0usize..12, d in 0usize..12,
        ) {
            let (w, h) = (image.width() as usize, image.height() as usize);
            let columns = a.min(b).min(w)..a.max(b).min(w);
            let rows = c.min(d).min(h)..c.max(d).min(h);
            let inside = |x: u32, y: u32| {
                columns.contains(&(x as usize)) && rows.contains(&(y as usize))
            };
            let expected: u32 = image
                .enumerate_pixels()
                .filter(|&(x, y, _)| inside(x, y))
                .map(|(_, _, pixel)| u32::from(pixel.0[0]))
                .sum();
            let integral = IntegralImage::new(&image);
            let sum = integral.box_sum(columns.start, rows.start, columns.end, rows.end);
            prop_assert_eq!(sum, expected);
        }

        #[test]
        fn area_weighs_cut_pixels(
            image in image(),
            u in 0.0f32..1.0, v in 0.0f32..1.0, side in 0.01f32..1.0,
        ) {
            let (w, h) = (image.width() as usize, image.height() as usize);
            let side = side * w.min(h) as f32;
            // A centre with all of the box inside the image.
            let x = u * (w as f32 - side) + 0.5 * side - 0.5;
            let y = v * (h as f32 - side) + 0.5 * side - 0.5;
            let half = 0.5 * side;
            let expected: f32 = image
                .enumerate_pixels()
                .map(|(i, j, pixel)| {
                    let share = overlap(i, x - half, x + half) * overlap(j, y - half, y + half);
                    share * f32::from(pixel.0[0])
                })
                .sum();
            let integral = IntegralImage::new(&image);
            let area = integral.area(Span::new(x, side, w), Span::new(y, side, h));
            prop_assert!((area - expected).abs() < 0.05, "{area} instead of {expected}");
        }
    }

    #[test]
    fn sums_are_those_of_one_thread() {
        for (width, height) in [(0, 0), (3, 0), (0, 300), (31, 300), (5, 64)] {
            let image = GrayImage::from_fn(width, height, |x, y| {
                image::Luma([(31 * x + 7 * y * (x + 1)) as u8])
            });
            let on = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                let pool = pool.expect("a thread pool");
                pool.install(|| IntegralImage::new(&image)).sums
            };
            assert!([2, 3, 7].map(on).iter().all(|sums| *sums == on(1)));
        }
    }

    #[test]
    fn box_sums_survive_wrapping() {
        let image = GrayImage::from_pixel(4200, 4200, image::Luma([255]));
        let integral = IntegralImage::new(&image);
        assert!(4200u64 * 4200 * 255 > u64::from(u32::MAX));
        assert_eq!(integral.box_sum(4100, 4150, 4200, 4200), 100 * 50 * 255);
        let columns = Span::new(4190.25, 1.5, 4200);
        assert_eq!(integral.area(columns, columns), 2.25 * 255.0);
    }

    #[test]
    fn boxes_stop_at_the_border() {
        let image = GrayImage::from_fn(8, 8, |x, _| image::Luma([10 * x as u8]));
        let integral = IntegralImage::new(&image);
        let row = Span::new(4.0, 2.0, 8);
        let outside = integral.area(Span::new(-100.0, 2.0, 8), row);
        assert_eq!(outside, 2.0 * (0.0 + 10.0));
        let outside = integral.area(Span::new(100.0, 2.0, 8), row);
        assert_eq!(outside, 2.0 * (60.0 + 70.0));
    }
}
