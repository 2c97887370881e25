//! Responses of the box-filter Hessian (sections 3.2 and 3.3).

use fearless_simd::{Level, dispatch};

use super::integral::IntegralImage;

/// Weight of Dxy against Dxx and Dyy in the determinant (section 3.2, equations 3 and 4).
///
/// The paper finds 0.9 for the filters of size 9, all divided by the same number. Here each is
/// divided so that it is exact on quadratic images, where Dxx of size 9 is 135 times the
/// derivative and Dxy 144 times: 0.9 × 144 / 135. The filters of other sizes are magnified copies,
/// so it holds for them too. Anything from 0.9 to 1.05 finds as many blobs again.
const MIXED_WEIGHT: f32 = 0.96;

/// The three filters of one size, approximating second derivatives of a Gaussian (figure 2).
///
/// Dxx is three lobes side by side weighted 1, −2, 1, each `lobe` px wide; Dyy is the same,
/// upright; Dxy is four square lobes in the corners. All dimensions are odd, to have a central
/// pixel, and otherwise keep the proportions of the filters of size 9. If instead the lobes of Dxx
/// stretched to 2 `lobe` − 1 and the gaps of Dxy stayed at 1 px, as in common implementations, the
/// share of blobs found again in images turned by 15° and enlarged 1.3 times would fall from 0.68
/// to 0.65.
#[derive(Clone, Copy)]
pub(super) struct BoxFilter {
    /// Width of a lobe, odd, a third of the filter's size \[px\].
    pub(super) lobe: usize,
    /// Length of the lobes of Dxx and Dyy on either side of the central pixel.
    half_length: usize,
    /// Width of the gap between the lobes of Dxy on either side of the central pixel.
    half_gap: usize,
}

impl BoxFilter {
    pub(super) fn new(lobe: usize) -> Self {
        Self {
            lobe,
            // Length 5/3 and gap 1/3 of the lobe, to the nearest odd number.
            half_length: 5 * lobe / 6,
            half_gap: lobe / 6,
        }
    }

    /// Distance from the central pixel to the filter's edge pixels \[px\].
    pub(super) fn margin(&self) -> usize {
        3 * self.lobe / 2
    }

    /// Standard deviation of the Gaussian \[px\]: 1.2 for size 9 (section 3.3).
    pub(super) fn scale(&self) -> f32 {
        1.2 / 3.0 * self.lobe as f32
    }

    /// The trace of the Hessian at a pixel, up to a positive factor.
    pub(super) fn laplacian(&self, integral: &IntegralImage, x: usize, y: usize) -> i64 {
        let (length, middle, whole) = (self.half_length, self.lobe / 2, self.margin());
        let sum = |dx: usize, dy: usize| {
            i64::from(integral.box_sum(x - dx, y - dy, x + dx + 1, y + dy + 1))
        };
        // The middle lobe's weight −2 is the weight of the whole less 3.
        let dxx = sum(whole, length) - 3 * sum(middle, length);
        let dyy = sum(length, whole) - 3 * sum(length, middle);
        dxx + dyy
    }

    /// The determinants of the Hessian along row `y` of the image, at every `step`-th pixel from the first;
    /// 0 where the filter leaves the image.
    pub(super) fn respond(
        &self,
        integral: &IntegralImage,
        y: usize,
        step: usize,
        room: &mut Room,
        samples: &mut [f32],
    ) {
        let margin = self.margin();
        let count = integral.width.saturating_sub(2 * margin);
        let rows = margin..integral.height.saturating_sub(margin);
        samples.fill(0.0);
        if count == 0 || !rows.contains(&y) {
            return;
        }
        let (level, Room { sums, dense }) = (Level::new(), room);
        if step == 1 {
            let inside = &mut samples[margin..][..count];
            dispatch!(level, _simd => self.determinants(integral, y, sums, inside));
            return;
        }
        // Every pixel of the row, even if few are kept: vectors make up for it.
        dense.resize(count, 0.0);
        dispatch!(level, _simd => self.determinants(integral, y, sums, dense));
        let first = margin.next_multiple_of(step);
        let kept = dense.iter().skip(first - margin).step_by(step);
        for (sample, &determinant) in samples[first / step..].iter_mut().zip(kept) {
            *sample = determinant;
        }
    }

    /// The determinants of the Hessians along row `y`, from the first pixel where the filter fits.
    #[inline(always)]
    fn determinants(
        &self,
        integral: &IntegralImage,
        y: usize,
        sums: &mut [Vec<i32>; 3],
        determinants: &mut [f32],
    ) {
        let count = determinants.len();
        let x = self.margin();
        // Table entries `offset` pixels before and after the central pixel, for the whole row.
        let before = |row: usize, offset: usize| &integral.row(row)[x - offset..][..count];
        let after = |row: usize, offset: usize| &integral.row(row)[x + 1 + offset..][..count];
        let [dxx, dyy, dxy] = sums.each_mut().map(|sums| {
            sums.resize(count, 0);
            sums.as_mut_slice()
        });

        let (length, middle, whole) = (self.half_length, self.lobe / 2, self.margin());
        let edges = |row: usize| {
            let (left, right) = (before(row, middle), after(row, middle));
            [before(row, whole), left, right, after(row, whole)]
        };
        second_difference([edges(y - length), edges(y + length + 1)], dxx);

        let [top, upper, lower, bottom] = [y - whole, y - middle, y + middle + 1, y + whole + 1];
        let left = [top, upper, lower, bottom].map(|row| before(row, length));
        let right = [top, upper, lower, bottom].map(|row| after(row, length));
        second_difference([left, right], dyy);

        let (near, far) = (self.half_gap, self.half_gap + self.lobe);
        let edges = |row: usize| {
            let (left, right) = (before(row, near), after(row, near));
            [before(row, far), left, right, after(row, far)]
        };
        mixed_difference([edges(y - far), edges(y - near)], dxy, |_, upper| upper);
        let edges = [edges(y + far + 1), edges(y + near + 1)];
        mixed_difference(edges, dxy, i32::wrapping_add);

        // On the images x²/2 and xy, whose derivatives are 1, the sums are lobe² times the numbers
        // divided by: what remains is normalised for scale.
        let lobe_area = self.lobe * (2 * self.half_length + 1);
        let second = 1.0 / lobe_area as f32;
        let centre_distance = self.lobe + 2 * self.half_gap + 1;
        let mixed = MIXED_WEIGHT / (centre_distance * centre_distance) as f32;
        let (dxx, dyy, dxy) = (&dxx[..count], &dyy[..count], &dxy[..count]);
        for (i, determinant) in determinants.iter_mut().enumerate() {
            let (xx, yy) = (second * dxx[i] as f32, second * dyy[i] as f32);
            let xy = mixed * dxy[i] as f32;
            *determinant = xx * yy - xy * xy;
        }
    }
}

/// What a row of responses takes, kept from row to row for its memory.
#[derive(Default)]
pub(super) struct Room {
    /// Box sums of each pixel.
    sums: [Vec<i32>; 3],
    /// The responses at every pixel where fewer are kept.
    dense: Vec<f32>,
}

/// Sums over three boxes side by side, weighted 1, −2, 1: the four edges of the boxes in two rows
/// of the integral image, or in two columns.
#[inline(always)]
fn second_difference(edges: [[&[u32]; 4]; 2], sums: &mut [i32]) {
    let count = sums.len();
    let [[a0, a1, a2, a3], [b0, b1, b2, b3]] = edges;
    // Slices of one known length spare the loop its bounds checks, and let it use vectors.
    let (a0, a1, a2, a3) = (&a0[..count], &a1[..count], &a2[..count], &a3[..count]);
    let (b0, b1, b2, b3) = (&b0[..count], &b1[..count], &b2[..count], &b3[..count]);
    for i in 0..count {
        let upper = a3[i].wrapping_sub(a0[i]);
        let lower = b3[i].wrapping_sub(b0[i]);
        let whole = lower.wrapping_sub(upper);
        let upper = a2[i].wrapping_sub(a1[i]);
        let lower = b2[i].wrapping_sub(b1[i]);
        let middle = lower.wrapping_sub(upper);
        // The middle weight −2 is the weight of the whole less 3.
        sums[i] = whole.wrapping_sub(middle.wrapping_mul(3)) as i32;
    }
}

/// Right one less left one of two boxes side by side, whose four edges are given in their outer and
/// their inner row of the integral image, joined with what is there.
#[inline(always)]
fn mixed_difference(
    [outer, inner]: [[&[u32]; 4]; 2],
    sums: &mut [i32],
    join: impl Fn(i32, i32) -> i32,
) {
    let count = sums.len();
    let [o0, o1, o2, o3] = outer.map(|edge| &edge[..count]);
    let [i0, i1, i2, i3] = inner.map(|edge| &edge[..count]);
    for i in 0..count {
        let difference = |e0: &[u32], e1: &[u32], e2: &[u32], e3: &[u32]| {
            let (left, right) = (e1[i].wrapping_sub(e0[i]), e3[i].wrapping_sub(e2[i]));
            right.wrapping_sub(left)
        };
        let (outer, inner) = (difference(o0, o1, o2, o3), difference(i0, i1, i2, i3));
        sums[i] = join(sums[i], outer.wrapping_sub(inner) as i32);
    }
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};
    use proptest::prelude::*;

    use super::*;

    /// Row 49 of the responses to `value(x, y)`, taken about the middle of a 99 × 99 image.
    fn responses(lobe: usize, value: impl Fn(i32, i32) -> i32) -> Vec<f32> {
        let image = GrayImage::from_fn(99, 99, |x, y| {
            let value = value(x as i32 - 49, y as i32 - 49);
            Luma([u8::try_from(value).expect("a grey value")])
        });
        row(&IntegralImage::new(&image), BoxFilter::new(lobe), 49, 1)
    }

    fn row(integral: &IntegralImage, filter: BoxFilter, y: usize, step: usize) -> Vec<f32> {
        let mut samples = vec![f32::NAN; integral.width.div_ceil(step)];
        filter.respond(integral, y, step, &mut Room::default(), &mut samples);
        samples
    }

    #[test]
    fn filters_of_size_9_are_those_of_the_paper() {
        let filter = BoxFilter::new(3);
        assert_eq!(filter.margin(), 4);
        assert_eq!(2 * filter.half_length + 1, 5);
        assert_eq!(2 * filter.half_gap + 1, 1);
        assert_eq!(filter.scale(), 1.2);
    }

    #[test]
    fn determinants_are_exact_on_quadratic_images() {
        let bowl = |x: i32, y: i32| (x * x + y * y).min(255);
        let saddle = |x: i32, y: i32| (128 + x * y).clamp(0, 255);
        for lobe in [3, 5, 7, 9] {
            let squared = (lobe * lobe) as f32;
            let determinant = responses(lobe, bowl)[49];
            assert!((determinant / (2.0 * squared).powi(2) - 1.0).abs() < 1e-5);
            let determinant = responses(lobe, saddle)[49];
            assert!((determinant / (MIXED_WEIGHT * squared).powi(2) + 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn slopes_and_straight_edges_have_no_response() {
        let slope = responses(5, |x, y| 128 + x + y);
        let edge = responses(5, |x, _| if x > 3 { 200 } else { 20 });
        for at in 30..70 {
            assert_eq!(slope[at], 0.0);
            assert_eq!(edge[at], 0.0);
        }
    }

    #[test]
    fn dark_blobs_have_a_positive_laplacian() {
        let image = |inside, outside| {
            GrayImage::from_fn(21, 21, |x, y| {
                let near = x.abs_diff(10).pow(2) + y.abs_diff(10).pow(2) < 12;
                Luma([if near { inside } else { outside }])
            })
        };
        let laplacian = |image| BoxFilter::new(5).laplacian(&IntegralImage::new(&image), 10, 10);
        assert!(laplacian(image(20, 90)) > 0);
        assert!(laplacian(image(90, 20)) < 0);
    }

    proptest! {
        #[test]
        fn coarser_samples_are_a_subset(
            pixels in prop::collection::vec(any::<u8>(), 40 * 31),
            step in 1usize..6,
        ) {
            let image = GrayImage::from_raw(40, 31, pixels).expect("a full image");
            let integral = IntegralImage::new(&image);
            let filter = BoxFilter::new(5);
            let margin = filter.margin();
            for y in 0..31 {
                let dense = row(&integral, filter, y, 1);
                let fits = |x: usize| (margin..40 - margin).contains(&x) && (margin..31 - margin).contains(&y);
                prop_assert!((0..40).all(|x| fits(x) || dense[x] == 0.0));
                let kept: Vec<f32> = dense.into_iter().step_by(step).collect();
                prop_assert_eq!(row(&integral, filter, y, step), kept);
            }
        }
    }
}
