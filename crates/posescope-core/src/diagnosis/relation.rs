//! Whether matches say how two photos of one place lie against each other.

use nalgebra::{Matrix2, Point2, Vector2};

use super::Evidence;
use crate::features::Keypoint;

/// Matches by chance seem related once in so many times.
const ONCE_IN: f64 = 20.0;

/// Whether the unique matches are related no more than matches by chance; `None` where it is not known.
pub(super) fn is_chance(evidence: &Evidence) -> Option<bool> {
    let (query, reference) = (evidence.query.as_ref()?, evidence.reference.as_ref()?);
    let pairs = evidence.lifted.as_ref()?.iter().map(|found| {
        let ends = [query.keypoints.get(found.query)?, reference.keypoints.get(found.reference)?];
        Some(ends.map(Keypoint::pixel))
    });
    Some(!are_related(&pairs.collect::<Option<Vec<_>>>()?))
}

/// Whether an affine map from the first pixels to the second explains more than it does of pairs by chance.
///
/// Of a coordinate of n pixels that have nothing to do with the others, it leaves a share u or less unexplained with
/// the probability u^((n − 3) / 2): the coefficient of determination of a regression on two variables.
fn are_related(pairs: &[[Point2<f64>; 2]]) -> bool {
    let count = pairs.len() as f64;
    let mean = |side: usize| -> Vector2<f64> {
        pairs.iter().map(|pair| pair[side].coords).sum::<Vector2<f64>>() / count
    };
    let means = [mean(0), mean(1)];
    let (mut squares, mut products, mut totals) =
        (Matrix2::zeros(), Matrix2::zeros(), Vector2::zeros());
    for pair in pairs {
        let [from, to] = [0, 1].map(|side| pair[side].coords - means[side]);
        squares += from * from.transpose();
        products += from * to.transpose();
        totals += to.component_mul(&to);
    }
    let Some(inverse) = squares.try_inverse() else {
        return false;
    };
    let explained = (products.transpose() * inverse * products).diagonal();
    let chance = |coordinate: usize| {
        let unexplained = match totals[coordinate] {
            0.0 => 1.0,
            total => (1.0 - explained[coordinate] / total).max(0.0),
        };
        unexplained.powf((count - 3.0) / 2.0)
    };
    // Of two coordinates, one is by chance twice as often.
    2.0 * chance(0).min(chance(1)) < 1.0 / ONCE_IN
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation2;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_pcg::Pcg64;

    /// Pairs of pixels of which this share is by chance; the others are turned and shifted.
    fn pairs(count: usize, by_chance: f64, seed: u64) -> Vec<[Point2<f64>; 2]> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let turn = Rotation2::new(1.5);
        (0..count)
            .map(|_| {
                let mut pixel =
                    || Point2::new(1240.0 * rng.random::<f64>(), 370.0 * rng.random::<f64>());
                let (from, other) = (pixel(), pixel());
                let is_chance = rng.random::<f64>() < by_chance;
                let seen = turn * from + Vector2::new(30.0, -8.0);
                [from, if is_chance { other } else { seen }]
            })
            .collect()
    }

    #[test]
    fn pixels_by_chance_are_related_once_in_twenty_at_most() {
        for count in [9, 30, 200] {
            let related = (0..2000).filter(|seed| are_related(&pairs(count, 1.0, *seed))).count();
            assert!((60..=140).contains(&related), "{count} pairs: {related} of 2000");
        }
    }

    #[test]
    fn a_turned_and_shifted_photo_is_related_although_two_of_five_matches_are_chance() {
        let related = (0..200).filter(|seed| are_related(&pairs(40, 0.4, *seed))).count();
        assert!(related >= 190, "{related} of 200");
    }

    #[test]
    fn pixels_in_one_place_tell_nothing() {
        let pixel = Point2::new(3.0, 4.0);
        assert!(!are_related(&[[pixel, pixel]; 12]));
        let to_one = pairs(12, 0.0, 1).into_iter().map(|[from, _]| [from, pixel]);
        assert!(!are_related(&to_one.collect::<Vec<_>>()));
    }
}
