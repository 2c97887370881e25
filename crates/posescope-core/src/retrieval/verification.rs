//! Do the features of two images that share their words also lie alike?
//!
//! Philbin et al. 2007, section 4: hypotheses from single pairs of features, so that all can be tried
//! and nothing is left to chance; the promising ones are refined on their inliers as in Chum, Matas,
//! Kittler, *Locally Optimized RANSAC*, DAGM 2003.

use nalgebra::Point2;

use super::affine::Affine;
use super::params::RetrievalParams;
use crate::features::Keypoint;

/// Hypotheses at most; of more pairs, evenly spread ones are tried.
const MAX_HYPOTHESES: usize = 400;
/// Refinements of a hypothesis that was better than all before.
const REFINEMENTS: usize = 4;
/// Pairs without which all six degrees of freedom are not fitted: twice as many as they take.
const REFINED_FROM: usize = 6;
/// A fit may change the scale of the hypothesis by this factor, lest it collapses the query onto a
/// few crowded features.
const SCALE_CHANGE: f64 = 1.5;

/// Two features with the same word.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WordMatch {
    /// Index of the query's feature.
    pub query: u32,
    /// The query's feature.
    pub query_keypoint: Keypoint,
    /// The reference's feature.
    pub reference_keypoint: Keypoint,
}

/// A feature of the query and where the reference shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VerifiedMatch {
    /// Index of the query's feature.
    pub query: usize,
    /// Its place in the query \[px\].
    pub query_pixel: Point2<f64>,
    /// The place of the reference's feature \[px\].
    pub reference_pixel: Point2<f64>,
}

/// A transform that many features agree with.
#[derive(Clone, Debug, PartialEq)]
pub struct Verification {
    /// Number of matches.
    pub inliers: usize,
    /// From query pixels to reference pixels.
    pub reference_from_query: Affine,
    /// The features that agree, one to one.
    pub matches: Vec<VerifiedMatch>,
}

/// The transform that most features agree with, if they are enough. Pairs of one feature of the
/// query stand together.
pub fn verify(pairs: &[WordMatch], params: &RetrievalParams) -> Option<Verification> {
    let points: Vec<_> = pairs
        .iter()
        .map(|pair| (pair.query_keypoint.pixel(), pair.reference_keypoint.pixel()))
        .collect();
    let fit = AffineFit { pairs, points: &points, limit: params.inlier_px * params.inlier_px };
    let mut best: Option<(usize, Affine)> = None;
    let stride = pairs.len().div_ceil(MAX_HYPOTHESES).max(1);
    for pair in pairs.iter().step_by(stride) {
        let hypothesis = Affine::from_features(&pair.query_keypoint, &pair.reference_keypoint);
        let inliers = fit.count(&hypothesis);
        if best.is_none_or(|(most, _)| inliers > most) {
            best = Some(fit.refined(inliers, hypothesis));
        }
    }
    let (_, reference_from_query) = best?;
    let matches = fit.matches(&reference_from_query);
    (matches.len() >= params.min_inliers).then_some(Verification {
        inliers: matches.len(),
        reference_from_query,
        matches,
    })
}

/// Pairs of features against which affine transforms are held.
struct AffineFit<'a> {
    pairs: &'a [WordMatch],
    points: &'a [(Point2<f64>, Point2<f64>)],
    /// Squared distance \[px²\].
    limit: f64,
}

impl AffineFit<'_> {
    /// Squared distance of a pair \[px²\].
    fn residual(&self, affine: &Affine, pair: usize) -> f64 {
        let (query, reference) = &self.points[pair];
        (affine.apply(query) - reference).norm_squared()
    }

    /// The query's features of which a pair agrees.
    fn count(&self, affine: &Affine) -> usize {
        let mut last = None;
        let mut count = 0;
        for (i, pair) in self.pairs.iter().enumerate() {
            if self.residual(affine, i) <= self.limit && last != Some(pair.query) {
                last = Some(pair.query);
                count += 1;
            }
        }
        count
    }

    /// The local optimisation: fitted to the inliers while that brings more of them.
    fn refined(&self, inliers: usize, hypothesis: Affine) -> (usize, Affine) {
        let mut best = (inliers, hypothesis);
        for _ in 0..REFINEMENTS {
            if best.0 < REFINED_FROM {
                break;
            }
            let agreeing: Vec<_> = (0..self.pairs.len())
                .filter(|&i| self.residual(&best.1, i) <= self.limit)
                .map(|i| self.points[i])
                .collect();
            let Some(fitted) = Affine::least_squares(&agreeing) else {
                break;
            };
            let change = fitted.scale() / hypothesis.scale();
            if !(SCALE_CHANGE.recip()..=SCALE_CHANGE).contains(&change) {
                break;
            }
            let inliers = self.count(&fitted);
            if inliers <= best.0 {
                break;
            }
            best = (inliers, fitted);
        }
        best
    }

    /// The pairs that agree, the nearest first where a feature has several, in the query's order.
    fn matches(&self, affine: &Affine) -> Vec<VerifiedMatch> {
        let mut agreeing: Vec<(f64, usize)> = (0..self.pairs.len())
            .map(|i| (self.residual(affine, i), i))
            .filter(|(residual, _)| *residual <= self.limit)
            .collect();
        agreeing.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut queries = std::collections::HashSet::new();
        let mut references = std::collections::HashSet::new();
        let mut matches: Vec<VerifiedMatch> = agreeing
            .into_iter()
            .filter_map(|(_, i)| {
                let WordMatch { query, reference_keypoint: Keypoint { x, y, scale, .. }, .. } =
                    self.pairs[i];
                let reference = [x, y, scale].map(f32::to_bits);
                (!references.contains(&reference) && queries.insert(query)).then(|| {
                    references.insert(reference);
                    let (query_pixel, reference_pixel) = self.points[i];
                    VerifiedMatch { query: query as usize, query_pixel, reference_pixel }
                })
            })
            .collect();
        matches.sort_unstable_by_key(|found| found.query);
        matches
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Vector2};
    use proptest::prelude::*;
    use rand::SeedableRng as _;
    use rand_pcg::Pcg64;

    use super::*;

    fn limits() -> RetrievalParams {
        RetrievalParams { inlier_px: 4.0, min_inliers: 6, ..Default::default() }
    }

    fn keypoint(point: Point2<f64>, scale: f64, angle: f64) -> Keypoint {
        Keypoint {
            x: point.x as f32,
            y: point.y as f32,
            scale: scale as f32,
            angle: angle as f32,
            response: 1.0,
            laplacian_positive: true,
        }
    }

    /// Pairs of which the first follow the transform, with up to 1 px of noise and scales and
    /// angles that are a little off, and the others lie anywhere.
    fn pairs(
        truth: &Affine,
        angle: f64,
        inliers: usize,
        outliers: usize,
        seed: u64,
    ) -> Vec<WordMatch> {
        let mut rng = Pcg64::seed_from_u64(seed);
        (0..inliers + outliers)
            .map(|i| {
                let mut point =
                    || Point2::new(rng.random_range(0.0..1241.0), rng.random_range(0.0..376.0));
                let (query, elsewhere) = (point(), point());
                let mut draw = |range: f64| rng.random_range(-range..range);
                let seen = truth.apply(&query) + Vector2::new(draw(0.7), draw(0.7));
                let scale = 3.0 * truth.scale() * (1.0 + draw(0.05));
                let turned = angle + draw(0.03);
                let reference = if i < inliers {
                    keypoint(seen, scale, turned)
                } else {
                    keypoint(elsewhere, 3.0 * (1.0 + draw(0.5)), draw(3.0))
                };
                WordMatch {
                    query: i as u32,
                    query_keypoint: keypoint(query, 3.0, 0.0),
                    reference_keypoint: reference,
                }
            })
            .collect()
    }

    fn similarity(scale: f64, angle: f64) -> Affine {
        let (sin, cos) = angle.sin_cos();
        Affine {
            linear: scale * Matrix2::new(cos, -sin, sin, cos),
            translation: Vector2::new(40.0, -25.0),
        }
    }

    #[test]
    fn a_transform_is_found_among_four_times_as_many_outliers() {
        let mut truth = similarity(1.2, 0.1);
        // A shear that no single pair knows.
        truth.linear[(0, 1)] += 0.03;
        let pairs = pairs(&truth, 0.1, 40, 160, 1);
        let found = verify(&pairs, &limits()).expect("enough inliers");
        let true_ones = found.matches.iter().filter(|m| m.query < 40).count();
        assert!(true_ones >= 38, "{true_ones}");
        assert!(found.inliers - true_ones <= 3);
        assert_eq!(found.inliers, found.matches.len());
        assert!((found.reference_from_query.linear - truth.linear).amax() < 0.01);
    }

    #[test]
    fn the_local_optimisation_finds_what_single_pairs_miss() {
        let mut truth = similarity(1.0, 0.0);
        truth.linear[(0, 0)] = 1.08;
        let pairs = pairs(&truth, 0.0, 60, 0, 2);
        let single = pairs
            .iter()
            .map(|pair| {
                let affine = Affine::from_features(&pair.query_keypoint, &pair.reference_keypoint);
                let error = |pair: &&WordMatch| {
                    let seen = affine.apply(&pair.query_keypoint.pixel());
                    (seen - pair.reference_keypoint.pixel()).norm() <= limits().inlier_px
                };
                pairs.iter().filter(error).count()
            })
            .max();
        let found = verify(&pairs, &limits()).map(|found| found.inliers);
        assert_eq!(found, Some(60));
        assert!(single < Some(50), "{single:?}");
    }

    #[test]
    fn unrelated_pairs_are_not_verified() {
        for seed in 0..20 {
            let pairs = pairs(&similarity(1.0, 0.0), 0.0, 0, 60, seed);
            assert_eq!(verify(&pairs, &limits()), None, "seed {seed}");
        }
        assert_eq!(verify(&[], &limits()), None);
    }

    #[test]
    fn a_feature_counts_once() {
        let one = pairs(&similarity(1.0, 0.0), 0.0, 1, 0, 1)[0];
        // Twenty features of the reference at about one place, all of the same word.
        let crowd: Vec<WordMatch> = (0..20)
            .map(|i| {
                let mut pair = one;
                pair.reference_keypoint.x += 0.01 * i as f32;
                pair
            })
            .collect();
        assert_eq!(verify(&crowd, &limits()), None);
        // Twenty features of the query on one feature of the reference.
        let crowd: Vec<WordMatch> = (0..20).map(|query| WordMatch { query, ..one }).collect();
        assert_eq!(verify(&crowd, &limits()), None);
    }

    proptest! {
        #[test]
        fn matches_are_one_to_one_and_within_the_tolerance(
            scale in 0.5..1.3_f64, angle in -3.0..3.0_f64,
            inliers in 0usize..60, outliers in 0usize..60, seed in any::<u64>(),
        ) {
            let mut pairs = pairs(&similarity(scale, angle), angle, inliers, outliers, seed);
            // Some features have two pairs.
            for i in 0..pairs.len() / 4 {
                pairs[2 * i + 1].query = pairs[2 * i].query;
            }
            if let Some(found) = verify(&pairs, &limits()) {
                prop_assert!(found.inliers >= limits().min_inliers);
                prop_assert!(found.matches.is_sorted_by(|a, b| a.query < b.query));
                for found_match in &found.matches {
                    let seen = found.reference_from_query.apply(&found_match.query_pixel);
                    prop_assert!((seen - found_match.reference_pixel).norm() <= 4.0 + 1e-9);
                }
            } else {
                prop_assert!(inliers < 40, "{} inliers were not found", inliers);
            }
        }

        #[test]
        fn nonsense_never_panics(
            numbers in prop::collection::vec(prop::array::uniform8(prop::num::f32::ANY), 0..30),
        ) {
            let pairs: Vec<WordMatch> = numbers
                .iter()
                .zip(0..)
                .map(|(&[a, b, c, d, e, f, g, h], query)| {
                    let keypoint = |x, y, scale, angle| Keypoint {
                        x, y, scale, angle, response: 1.0, laplacian_positive: false,
                    };
                    WordMatch {
                        query,
                        query_keypoint: keypoint(a, b, c, d),
                        reference_keypoint: keypoint(e, f, g, h),
                    }
                })
                .collect();
            verify(&pairs, &limits());
        }
    }
}
