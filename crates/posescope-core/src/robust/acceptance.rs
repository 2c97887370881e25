//! Are the inliers of a pose more than chance explains?
//!
//! MLESAC returns the best of thousands of poses. Among purely false matches the best still has
//! three to five inliers when there are 30 to 128 of them, so "four or more" accepts junk.

use std::f64::consts::{LN_10, PI};

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

use super::cells::Cells;
use super::params::{NEEDED, SAMPLE};
use super::places::Places;
use crate::describe::choice;
use crate::solver::MAX_SOLUTIONS;

/// Expected number of accepted poses per problem of purely false matches, as a power of ten.
const LOG10_EPSILON: f64 = -2.0;

/// Distance at which [`effective_area_px`] counts two pixels as neighbours \[px\].
///
/// Several inlier thresholds, so that a few dozen pixels have neighbours to count, yet within the
/// patches of texture that detections gather on.
const NEIGHBOURHOOD_PX: f64 = 25.0;

/// When the inliers of a pose are enough.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AcceptanceRule {
    /// More inliers than chance explains: [`inliers_beyond_chance`].
    #[default]
    Consensus,
    /// Four inliers, whatever the number of correspondences.
    Paper,
}

choice!(AcceptanceRule: Consensus = "consensus", Paper = "paper");

impl AcceptanceRule {
    /// Whether the rule accepts the pose that the verdict is about.
    pub fn accepts(self, verdict: &Acceptance) -> bool {
        match self {
            Self::Consensus => verdict.needed.is_some_and(|needed| verdict.inliers >= needed),
            Self::Paper => verdict.inliers >= NEEDED,
        }
    }
}

/// The verdict of [`inliers_beyond_chance`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Acceptance {
    /// The inliers that were counted.
    pub inliers: usize,
    /// Logarithm to base ten of the number of false alarms: of the poses with as many inliers
    /// that false matches alone are expected to give.
    pub log10_nfa: f64,
    /// Fewest inliers that [`AcceptanceRule::Consensus`] accepts; `None` where not even all
    /// correspondences would be enough.
    pub needed: Option<usize>,
}

/// How surprising `inliers` among `correspondences` are, if all of these were false.
///
/// An a-contrario test (Moisan, Stival, *A probabilistic criterion to detect rigid point matches
/// between two images*, IJCV 2004; Moulon, Monasse, Marlet, *Adaptive Structure from Motion with
/// a contrario model estimation*, ACCV 2012) with a fixed threshold:
///
/// - A false match lies anywhere in the area `A`, so it is within the threshold `t` of the
///   projection of its point with probability `p = π t² / A`.
/// - Three of the `n` matches fit their pose for free. That at least `k − 3` of the others agree
///   with it has the binomial tail probability `P[B(n − 3, p) ≥ k − 3]`.
/// - The pose is the best of many. Any three matches may be sampled, and each sample has up to
///   four solutions: at most `4 C(n, 3)` tests, however many of them were tried.
///
/// The expected number of poses with `k` inliers is then at most
/// `NFA = 4 C(n, 3) · P[B(n − 3, p) ≥ k − 3]`, which also bounds the probability that there is
/// one. A pose is accepted at `NFA ≤ 0.01`. With 3 px on a KITTI image that takes 5 inliers of
/// 8, 6 of 30, 7 of 128 and 10 of 1,000. The refinement after the sample gains an inlier or so
/// that the count of tests leaves out; the bound is slack enough, see `tests/it/robust_pose.rs`.
///
/// The test assumes that false matches are independent of each other. Matches that share a pixel
/// or a point are not and should come in once. Gathered pixels are allowed for by passing
/// [`effective_area_px`] instead of the image area.
pub fn inliers_beyond_chance(
    inliers: usize,
    correspondences: usize,
    threshold_px: f64,
    area_px: f64,
) -> Acceptance {
    let chance = (PI * threshold_px * threshold_px / area_px).min(1.0);
    accepted(inliers, correspondences, correspondences, chance)
}

/// As [`inliers_beyond_chance`], of places in the query instead of correspondences, so that none that
/// repeats another is counted: `inliers` are correspondences, and a place is an inlier where one of its
/// correspondences is.
///
/// - A place with `m` false matches has one within the threshold with probability `1 − (1 − p)^m` at
///   most. The sum of such unequal trials exceeds a bound above its mean no more often than a binomial
///   of their mean probability does (Hoeffding, *On the distribution of the number of successes in
///   independent trials*, Annals of Mathematical Statistics 27, 1956), which stands for it.
/// - Any three correspondences may be sampled, of the same place or not: `4 C(n, 3)` tests of all `n`.
/// - The area that chance has is that of the places' pixels.
pub fn places_beyond_chance(
    inliers: &[usize],
    places: &Places,
    threshold_px: f64,
    image_area_px: f64,
) -> Acceptance {
    let area_px = effective_area_px(&places.pixels, image_area_px);
    let one = (PI * threshold_px * threshold_px / area_px).min(1.0);
    let any: f64 = places
        .sizes
        .iter()
        .map(|&size| match size {
            1 => one,
            _ => 1.0 - (1.0 - one).powi(size as i32),
        })
        .sum();
    let chance = any / places.count().max(1) as f64;
    accepted(places.of_some(inliers), places.count(), places.of.len(), chance)
}

/// The verdict on the inliers among `count` that agree with a pose by chance each by itself, where samples are
/// drawn from `tested` correspondences.
fn accepted(inliers: usize, count: usize, tested: usize, chance: f64) -> Acceptance {
    // log₁₀ (4 C(tested, 3) · P[B(n − 3, p) ≥ k − 3]).
    let log10_nfa = |k: usize| {
        let tests = (MAX_SOLUTIONS as f64).ln() + ln_binomial(tested, SAMPLE);
        let others = count.saturating_sub(SAMPLE);
        (tests + ln_tail(k.saturating_sub(SAMPLE), others, chance)) / LN_10
    };
    // The more inliers, the fewer false alarms.
    let numbers: Vec<usize> = (NEEDED..=count).collect();
    let too_few = numbers.partition_point(|&k| log10_nfa(k) > LOG10_EPSILON);
    let needed = numbers.get(too_few).copied();
    Acceptance { inliers, log10_nfa: log10_nfa(inliers), needed }
}

/// The area over which pixels would have to be spread evenly to be as close together as they are
/// \[px²\], at most `image_area_px`.
///
/// With the density `f` of the pixels it is `1 / ∫ f²`, estimated from the share of pairs that are
/// neighbours. Keypoints gather on texture; two patches of it on top of each other bring more
/// false matches in line than an even spread would. One pair more is counted than found, because
/// a few pixels cannot show that they are spread out.
pub fn effective_area_px(pixels: &[Point2<f64>], image_area_px: f64) -> f64 {
    let squared_radius = NEIGHBOURHOOD_PX * NEIGHBOURHOOD_PX;
    let mut cells = Cells::new(NEIGHBOURHOOD_PX);
    let mut neighbours = 0;
    for (number, pixel) in pixels.iter().enumerate() {
        let distance = |&other: &usize| (pixel - pixels[other]).norm_squared();
        neighbours += cells.around(pixel).filter(|other| distance(other) < squared_radius).count();
        cells.insert(pixel, number);
    }
    let pairs = pixels.len() * pixels.len().saturating_sub(1) / 2;
    let share = (neighbours + 1) as f64 / pairs.max(1) as f64;
    (PI * squared_radius / share).min(image_area_px)
}

/// `ln P[B ≥ k]` for the number of successes `B` in `n` trials of probability `p`.
fn ln_tail(k: usize, n: usize, p: f64) -> f64 {
    // Left out below: p = 1 has no odds, and zero successes are certain.
    if k == 0 || p >= 1.0 && k <= n {
        return 0.0;
    }
    let first = ln_binomial(n, k) + k as f64 * p.ln() + n.saturating_sub(k) as f64 * (-p).ln_1p();
    // The terms after the first, in units of the first.
    let odds = p / (1.0 - p);
    let rest: f64 = (k..n)
        .scan(1.0, |term, j| {
            *term *= (n - j) as f64 / (j + 1) as f64 * odds;
            Some(*term)
        })
        .sum();
    (first + rest.ln_1p()).min(0.0)
}

/// `ln C(n, k)`; minus infinity where `k > n`.
fn ln_binomial(n: usize, k: usize) -> f64 {
    (0..k).map(|i| (n.saturating_sub(i) as f64 / (i + 1) as f64).ln()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const KITTI_AREA: f64 = 1241.0 * 376.0;

    #[test]
    fn the_number_of_false_alarms_by_hand() {
        // Four of five, p = 1/4: 4 · C(5,3) = 40 tests, P[B(2, ¼) ≥ 1] = 7/16.
        let verdict = inliers_beyond_chance(4, 5, 1.0, 4.0 * PI);
        assert!((verdict.log10_nfa - (40.0_f64 * 7.0 / 16.0).log10()).abs() < 1e-12);
        // Five of five: P = 1/16.
        let verdict = inliers_beyond_chance(5, 5, 1.0, 4.0 * PI);
        assert!((verdict.log10_nfa - 2.5_f64.log10()).abs() < 1e-12);
        assert_eq!(verdict.needed, None);
    }

    #[test]
    fn more_correspondences_need_more_inliers() {
        let needed = [8, 30, 128, 1000]
            .map(|n| inliers_beyond_chance(0, n, 3.0, KITTI_AREA).needed.expect("enough of them"));
        assert_eq!(needed, [5, 6, 7, 10]);
    }

    /// Pixels 60 px apart, each `copies` times.
    fn repeated(places: usize, copies: usize) -> Vec<Point2<f64>> {
        (0..places * copies)
            .map(|i| Point2::new((i % places % 20) as f64, (i % places / 20) as f64) * 60.0)
            .collect()
    }

    #[test]
    fn what_repeats_another_correspondence_is_no_evidence_of_its_own() {
        let places = |copies| Places::of(repeated(30, copies), 3.0);
        // Each by itself: as the test of correspondences has it.
        let inliers: Vec<usize> = (0..6).collect();
        let once = places_beyond_chance(&inliers, &places(1), 3.0, KITTI_AREA);
        assert_eq!(once, inliers_beyond_chance(6, 30, 3.0, KITTI_AREA));
        assert!(AcceptanceRule::Consensus.accepts(&once));
        // Three places, each twice, are six inliers of three places: a sample and nothing else.
        let twice: Vec<usize> = [0, 1, 2, 30, 31, 32].to_vec();
        let verdict = places_beyond_chance(&twice, &places(2), 3.0, KITTI_AREA);
        assert_eq!(verdict.inliers, 3);
        assert!(!AcceptanceRule::Consensus.accepts(&verdict));
        // Of more matches a place has more room for chance, and the same places say less.
        let six = places_beyond_chance(&inliers, &places(5), 3.0, KITTI_AREA);
        assert_eq!(six.inliers, 6);
        assert!(six.log10_nfa > once.log10_nfa + 1.0);
    }

    #[test]
    fn the_rules_differ_on_four_of_thirty() {
        let four = inliers_beyond_chance(4, 30, 3.0, KITTI_AREA);
        assert!(!AcceptanceRule::Consensus.accepts(&four));
        assert!(AcceptanceRule::Paper.accepts(&four));
        let three = inliers_beyond_chance(3, 30, 3.0, KITTI_AREA);
        assert!(!AcceptanceRule::Paper.accepts(&three));
    }

    #[test]
    fn gathered_pixels_have_a_small_effective_area() {
        let grid = |spacing: f64| -> Vec<_> {
            (0..400)
                .map(|i| Point2::new(f64::from(i % 20) * spacing, f64::from(i / 20) * spacing))
                .collect()
        };
        // 20 x 20 pixels, 10 px apart, cover 200 x 200 px.
        let spread = effective_area_px(&grid(10.0), f64::INFINITY);
        assert!((spread / 4e4 - 1.0).abs() < 0.3, "{spread}");
        assert_eq!(effective_area_px(&grid(60.0), KITTI_AREA), KITTI_AREA);
        assert_eq!(effective_area_px(&[], 10.0), 10.0);
    }

    proptest! {
        #[test]
        fn the_neighbours_are_those_of_all_pairs(
            pixels in prop::collection::vec((-90.0_f64..300.0, -90.0_f64..300.0), 2..200),
        ) {
            let pixels: Vec<_> = pixels.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
            let pairs = (0..pixels.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
            let is_near = |&(i, j): &(usize, usize)| (pixels[i] - pixels[j]).norm() < NEIGHBOURHOOD_PX;
            let share = (pairs.clone().filter(is_near).count() + 1) as f64 / pairs.count() as f64;
            let expected = PI * NEIGHBOURHOOD_PX * NEIGHBOURHOOD_PX / share;
            let area = effective_area_px(&pixels, f64::INFINITY);
            prop_assert!((area / expected - 1.0).abs() < 1e-12, "{area} {expected}");
        }

        #[test]
        fn what_is_needed_is_the_first_number_that_chance_does_not_explain(
            n in 4_usize..300, area in 10.0..1e6,
        ) {
            let nfa = |k| inliers_beyond_chance(k, n, 3.0, area).log10_nfa;
            let first = (NEEDED..=n).find(|&k| nfa(k) <= LOG10_EPSILON);
            prop_assert_eq!(inliers_beyond_chance(0, n, 3.0, area).needed, first);
        }

        #[test]
        fn an_inlier_more_is_never_less_surprising(
            n in 4_usize..2000, k in 0_usize..2000, area in 10.0..1e7,
        ) {
            let k = k % n;
            let nfa = |k| inliers_beyond_chance(k, n, 3.0, area).log10_nfa;
            prop_assert!(nfa(k).is_finite());
            prop_assert!(nfa(k + 1) <= nfa(k) + 1e-9);
        }
    }
}
