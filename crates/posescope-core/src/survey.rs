//! For posescope's own crates: may change in any version.
//!
//! What a map shows about confidence when its own frames are localised in it.
//!
//! The probability of a pose and its interval are fitted on generated towns. Another map has other light, other
//! surfaces and another density. A survey compares them with the poses of the map's frames, and moves them by two
//! numbers and two factors for each method.

use std::collections::BTreeMap;

use nalgebra::Vector6;
use serde::{Deserialize, Serialize};

use crate::covariance::PoseCovariance;
use crate::grid::Reach;
use crate::method::Method;
use crate::scale::Scale;

/// What was surveyed, by the method that makes the pose.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Survey(BTreeMap<String, Surveyed>);

/// How the confidence of one method's poses is moved in a map.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Surveyed {
    /// What is added to the logarithm of the odds that a pose is near.
    pub shift: f64,
    /// What the logarithm of the odds is multiplied by first.
    pub slope: f64,
    /// How many times farther positions are off.
    pub position: f64,
    /// How many times farther rotations are off.
    pub rotation: f64,
}

/// How closely pairs of frames of a map fit each other, and what searches reach there, where nobody surveyed the map.
///
/// The features of two photos and the cloud of one say how the cameras stand to each other, and the stated poses say it,
/// too. A pose that is localised in the map is off at least as these are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FramePairs {
    /// The pairs whose features agree on how the cameras stand to each other.
    pub pairs: usize,
    /// Those of them whose stated poses are near that.
    pub near: usize,
    /// How many times farther than in generated towns the positions of these are off.
    pub position: f64,
    /// How many times farther their rotations are off.
    pub rotation: f64,
    /// What a search with three freedoms reaches. All, where it was not looked at.
    #[serde(default)]
    pub reach: Reach,
}

impl FramePairs {
    /// The probability in this map: a pose is right if it was found, and if the map is right there. At the scale of the
    /// paper, what was fitted holds.
    pub fn probability(&self, fitted: f64, scale: Scale) -> f64 {
        if scale.is_paper() {
            return fitted;
        }
        // The mean of what is likely of the share, if all shares were likely (Jeffreys).
        fitted * (self.near as f64 + 0.5) / (self.pairs as f64 + 1.0)
    }

    /// The covariance in this map.
    pub fn covariance(&self, fitted: &PoseCovariance) -> PoseCovariance {
        widened(fitted, self.rotation, self.position)
    }

    /// Whether its numbers can be used.
    pub fn is_sound(&self) -> bool {
        let is_factor = |factor: f64| factor >= 1.0 && factor.is_finite();
        let are_factors = is_factor(self.position) && is_factor(self.rotation);
        self.near <= self.pairs && are_factors && self.reach.is_sound()
    }
}

/// A covariance whose rotations and positions are so many times wider.
fn widened(fitted: &PoseCovariance, turn: f64, shift: f64) -> PoseCovariance {
    let by = Vector6::new(turn, turn, turn, shift, shift, shift);
    fitted.with_deviations(&fitted.deviations().component_mul(&by))
}

/// The logarithm of the odds of a probability. More than this counts as this.
pub fn log_odds(probability: f64) -> f64 {
    /// One in 3,000: more is never known.
    const MOST: f64 = 8.0;
    (probability / (1.0 - probability)).ln().clamp(-MOST, MOST)
}

impl Surveyed {
    /// Leaves everything as it was fitted.
    pub const UNCHANGED: Self = Self { shift: 0.0, slope: 1.0, position: 1.0, rotation: 1.0 };

    /// The probability in this map.
    pub fn probability(&self, fitted: f64) -> f64 {
        if *self == Self::UNCHANGED {
            return fitted;
        }
        1.0 / (1.0 + (-self.shift - self.slope * log_odds(fitted)).exp())
    }

    /// The covariance in this map.
    pub fn covariance(&self, fitted: &PoseCovariance) -> PoseCovariance {
        widened(fitted, self.rotation, self.position)
    }

    fn is_sound(&self) -> bool {
        let factors = [self.slope, self.position, self.rotation];
        self.shift.is_finite() && factors.iter().all(|factor| *factor > 0.0 && factor.is_finite())
    }
}

impl Survey {
    /// What is being surveyed: these methods as they were fitted.
    pub fn unchanged(methods: impl IntoIterator<Item = Method>) -> Self {
        methods.into_iter().map(|method| (method, Surveyed::UNCHANGED)).collect()
    }

    /// Whether nothing was surveyed.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// What holds for a method's poses; `None` where it was not surveyed.
    pub fn of(&self, method: Method) -> Option<&Surveyed> {
        self.0.get(method.name())
    }

    /// Each surveyed method, in the order of their names.
    pub fn methods(&self) -> impl Iterator<Item = (&str, &Surveyed)> {
        self.0.iter().map(|(name, surveyed)| (name.as_str(), surveyed))
    }

    /// Whether all numbers can be used.
    pub fn is_sound(&self) -> bool {
        self.0.values().all(Surveyed::is_sound)
    }
}

impl FromIterator<(Method, Surveyed)> for Survey {
    fn from_iter<I: IntoIterator<Item = (Method, Surveyed)>>(methods: I) -> Self {
        let named = methods.into_iter().map(|(method, one)| (method.name().to_owned(), one));
        Self(named.collect())
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix6;

    use super::*;

    #[test]
    fn a_survey_moves_the_odds_and_widens_the_interval() {
        let surveyed = Surveyed { shift: -1.0, slope: 0.5, position: 3.0, rotation: 2.0 };
        // Odds of one are e to the power of the shift.
        let even = surveyed.probability(0.5);
        assert!((even - 1.0 / (1.0 + 1_f64.exp())).abs() < 1e-12, "{even}");
        let mut last = 0.0;
        for percent in 1..100 {
            let probability = surveyed.probability(f64::from(percent) / 100.0);
            assert!(probability > last, "{percent}");
            last = probability;
        }
        assert!([0.0, 1.0].iter().all(|one| surveyed.probability(*one).is_finite()));
        let fitted = PoseCovariance::new(Matrix6::identity()).expect("positive");
        let deviations = surveyed.covariance(&fitted).deviations();
        assert_eq!(deviations, Vector6::new(2.0, 2.0, 2.0, 3.0, 3.0, 3.0));
    }

    #[test]
    fn pairs_that_do_not_fit_lower_the_probability_and_widen_the_interval() {
        let of =
            |near| FramePairs { pairs: 15, near, position: 2.0, rotation: 1.5, reach: Reach::ALL };
        let room = Scale::of_depth(1.8, true);
        assert!((of(15).probability(1.0, room) - 15.5 / 16.0).abs() < 1e-12);
        assert!((of(9).probability(0.5, room) - 0.5 * 9.5 / 16.0).abs() < 1e-12);
        assert_eq!(of(9).probability(0.5, Scale::PAPER), 0.5);
        let fitted = PoseCovariance::new(Matrix6::identity()).expect("positive");
        let deviations = of(15).covariance(&fitted).deviations();
        assert_eq!(deviations, Vector6::new(1.5, 1.5, 1.5, 2.0, 2.0, 2.0));
        assert!(of(15).is_sound() && !of(16).is_sound());
        assert!(!FramePairs { position: 0.5, ..of(15) }.is_sound());
    }

    #[test]
    fn what_is_being_surveyed_is_as_it_was_fitted() {
        let survey = Survey::unchanged(Method::PAPER);
        for method in Method::PAPER {
            let surveyed = survey.of(method).expect("every method");
            for probability in [0.0, 0.123_456_789, 0.999_999, 1.0] {
                assert_eq!(surveyed.probability(probability), probability);
            }
        }
        assert!(survey.is_sound() && !survey.is_empty());
        assert!(Survey::default().is_empty());
    }
}
