//! Which correspondences are evidence of their own, and which repeat another's.

use nalgebra::Point2;

use super::cells::Cells;

/// What is counted where a consensus is held against chance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Counted {
    /// Every correspondence.
    Correspondences,
    /// Places in the query photo, whatever the number of correspondences at each.
    Places,
}

impl Counted {
    /// The word for many of them.
    pub fn name(self) -> &'static str {
        match self {
            Self::Correspondences => "correspondences",
            Self::Places => "places",
        }
    }

    /// The same in a sentence.
    pub fn words(self) -> &'static str {
        match self {
            Self::Correspondences => "correspondences",
            Self::Places => "image positions",
        }
    }
}

/// The places in the query photo that correspondences are of.
///
/// A detector finds one corner at several scales, and several references may match one keypoint. Such
/// correspondences stand and fall together: a pose that explains one explains, as good as always, the
/// others, so that an accident is counted several times. A test that takes correspondences to be
/// independent counts places instead.
#[derive(Clone, Debug, PartialEq)]
pub struct Places {
    /// The place of each correspondence.
    pub(super) of: Vec<usize>,
    /// The pixel of the first correspondence of each place.
    pub(super) pixels: Vec<Point2<f64>>,
    /// Correspondences of each place.
    pub(super) sizes: Vec<usize>,
}

impl Places {
    /// A pixel belongs to the first place before it that is within `reach_px`, and else is a place of its
    /// own.
    pub fn of(pixels: impl IntoIterator<Item = Point2<f64>>, reach_px: f64) -> Self {
        let mut places = Self { of: Vec::new(), pixels: Vec::new(), sizes: Vec::new() };
        let mut cells = Cells::new(reach_px);
        for pixel in pixels {
            let is_here = |&place: &usize| (places.pixels[place] - pixel).norm() <= reach_px;
            let place = cells.around(&pixel).filter(is_here).min().unwrap_or_else(|| {
                cells.insert(&pixel, places.pixels.len());
                places.pixels.push(pixel);
                places.sizes.push(0);
                places.sizes.len() - 1
            });
            places.sizes[place] += 1;
            places.of.push(place);
        }
        places
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.sizes.len()
    }

    /// The places that some of the correspondences are of.
    pub fn of_some(&self, correspondences: &[usize]) -> usize {
        let mut is_met = vec![false; self.count()];
        for &correspondence in correspondences {
            is_met[self.of[correspondence]] = true;
        }
        is_met.into_iter().filter(|met| *met).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_pixel_belongs_to_the_first_place_within_reach(
            pixels in prop::collection::vec((-30_i32..60, -30_i32..60), 0..120),
            reach_px in prop_oneof![Just(0.0), Just(3.0), 0.0..20.0_f64],
        ) {
            let pixel = |(x, y)| Point2::new(0.5 * f64::from(x), 0.5 * f64::from(y));
            let pixels: Vec<_> = pixels.into_iter().map(pixel).collect();
            let places = Places::of(pixels.iter().copied(), reach_px);
            let mut firsts: Vec<Point2<f64>> = Vec::new();
            for (pixel, place) in pixels.iter().zip(&places.of) {
                let known = firsts.iter().position(|first| (first - pixel).norm() <= reach_px);
                prop_assert_eq!(*place, known.unwrap_or(firsts.len()));
                if known.is_none() {
                    firsts.push(*pixel);
                }
            }
            prop_assert_eq!(&places.pixels, &firsts);
        }
    }

    #[test]
    fn near_pixels_are_one_place_and_a_chain_of_them_is_not() {
        let pixels = [0.0, 2.0, 4.0, 90.0, 0.5].map(|x| Point2::new(x, 7.0));
        let places = Places::of(pixels, 3.0);
        assert_eq!(places.count(), 3);
        assert_eq!(places.of.len(), 5);
        assert_eq!(places.sizes, [3, 1, 1]);
        assert_eq!(places.of_some(&[0, 1, 4]), 1);
        assert_eq!(places.of_some(&[4, 2, 3]), 3);
        assert_eq!(places.of_some(&[]), 0);
    }
}
