//! Whether two photos were taken in the same light.
//!
//! In the same light the photos of one place agree closely: there are matches, and the minimum of a cost is deep. Where
//! little agrees, another place is shown. In other light little agrees at the right pose, too. So how much must speak for a
//! pose depends on the light.

use image::GrayImage;

use crate::problem::Problem;

/// Smaller distances are those of the same light.
const SAME: f64 = 0.03;

/// One in so many pixels is counted.
const STRIDE: usize = 7;

/// The signal: how far the grey values of both photos are apart, whatever they show and where.
pub(super) fn signal(problem: &Problem) -> (&'static str, f64) {
    let [query, reference] = [&problem.query.photo, &problem.reference.photo];
    ("light", (SAME + distance(&query.gray, &reference.gray)).ln())
}

/// How far the grey values of the one must move to become those of the other, on average, as a share of their range: the
/// area between the cumulative distributions (Wasserstein's distance).
fn distance(one: &GrayImage, other: &GrayImage) -> f64 {
    let (one, other) = (cumulative(one), cumulative(other));
    let apart = one.iter().zip(&other).map(|(one, other)| (one - other).abs());
    apart.sum::<f64>() / one.len() as f64
}

/// The share of pixels that are at most so bright, for each grey value.
fn cumulative(photo: &GrayImage) -> [f64; 256] {
    let mut counts = [0_u32; 256];
    for value in photo.as_raw().iter().step_by(STRIDE) {
        counts[usize::from(*value)] += 1;
    }
    let all = f64::from(counts.iter().sum::<u32>().max(1));
    let mut below = 0;
    counts.map(|count| {
        below += count;
        f64::from(below) / all
    })
}

#[cfg(test)]
mod tests {
    use image::Luma;
    use image::imageops::{flip_horizontal, resize};

    use super::*;

    /// A slope of grey values, brighter by so much.
    fn photo(brighter: u8) -> GrayImage {
        GrayImage::from_fn(200, 70, |x, y| Luma([(x / 3 + y) as u8 + brighter]))
    }

    #[test]
    fn a_brighter_photo_is_as_far_as_it_is_brighter() {
        let apart = distance(&photo(0), &photo(64));
        assert!((apart - 0.25).abs() < 1e-12, "{apart}");
        assert_eq!(distance(&photo(9), &photo(9)), 0.0);
        let [black, white] = [0, 255].map(|value| GrayImage::from_pixel(30, 20, Luma([value])));
        assert!((distance(&black, &white) - 255.0 / 256.0).abs() < 1e-12);
    }

    #[test]
    fn what_a_photo_shows_where_and_its_size_do_not_matter() {
        let own = photo(20);
        let mirrored = distance(&own, &flip_horizontal(&own));
        let smaller = resize(&own, 100, 35, image::imageops::FilterType::Triangle);
        let smaller = distance(&own, &smaller);
        assert!(mirrored < SAME && smaller < SAME, "{mirrored} {smaller}");
    }
}
