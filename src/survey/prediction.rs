//! Where a method will localise photos, from what became of those of a survey.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::{Pose, PoseError};

/// What became of a photo that was localised from one reference.
#[derive(Clone, Copy, Debug)]
pub struct Tried {
    /// The true pose of the photo (`world_from_camera`).
    pub query: Pose,
    /// The pose of its reference.
    pub reference: Pose,
    /// Whether the answer was right.
    pub is_right: bool,
}

/// Photos that look this far apart see another place \[°\].
const APART_DEG: f64 = 45.0;

/// Photos this far away, as a share of the search radius, are of another place.
const APART: f64 = 0.5;

/// The standard deviation of the prior of each weight.
const PRIOR: f64 = 5.0;

/// How likely a method localises a photo, by where it is and from where it is searched.
///
/// How far the reference is away and how far it is turned decide first: a logistic function of both is fitted to all
/// photos. What became of photos nearby then moves the odds.
#[derive(Clone, Debug)]
pub struct Prediction {
    radius_m: f64,
    weights: Vector3<f64>,
    /// The photos, and how likely they are right by distance and turn alone.
    tried: Vec<(Tried, f64)>,
}

impl Prediction {
    /// From these photos, which were searched within a radius.
    pub fn of(tried: &[Tried], radius_m: f64) -> Self {
        let mut found = Self { radius_m, weights: Vector3::zeros(), tried: Vec::new() };
        let rows: Vec<(Vector3<f64>, f64)> = tried
            .iter()
            .map(|one| {
                (found.values(&one.query, &one.reference), f64::from(u8::from(one.is_right)))
            })
            .collect();
        found.weights = logistic(&rows);
        found.tried = tried.iter().map(|one| (*one, found.by_distance(one))).collect();
        found
    }

    /// How likely a photo with this pose is localised from a reference with that one.
    pub fn chance(&self, query: &Pose, reference: &Pose) -> f64 {
        let odds = self.weights.dot(&self.values(query, reference));
        let (mut more, mut known) = (0.0, 1.0);
        for (other, chance) in &self.tried {
            let counts = self.likeness(query, &other.query);
            more += counts * (f64::from(u8::from(other.is_right)) - chance);
            known += counts * chance * (1.0 - chance);
        }
        logistic_of(odds + more / known)
    }

    fn by_distance(&self, one: &Tried) -> f64 {
        logistic_of(self.weights.dot(&self.values(&one.query, &one.reference)))
    }

    /// What decides first: a constant, the distance over the radius, and the turn.
    fn values(&self, query: &Pose, reference: &Pose) -> Vector3<f64> {
        let apart = PoseError::between(query, reference);
        Vector3::new(1.0, apart.translation_m / self.radius_m, apart.rotation_deg / APART_DEG)
    }

    /// How much two photos show the same place: 1 for the same photo, near 0 for others.
    fn likeness(&self, a: &Pose, b: &Pose) -> f64 {
        let apart = PoseError::between(a, b);
        let away = apart.translation_m / (APART * self.radius_m);
        let turned = apart.rotation_deg / APART_DEG;
        (-0.5 * (away * away + turned * turned)).exp()
    }
}

fn logistic_of(log_odds: f64) -> f64 {
    1.0 / (1.0 + (-log_odds).exp())
}

/// The most likely weights of values that decide whether something is right, with a normal prior around 0.
fn logistic(rows: &[(Vector3<f64>, f64)]) -> Vector3<f64> {
    const STEPS: usize = 50;
    let prior = Matrix3::identity() / (PRIOR * PRIOR);
    let mut weights = Vector3::zeros();
    for _ in 0..STEPS {
        let (mut gradient, mut curvature) = (prior * weights, prior);
        for (values, is_right) in rows {
            let chance = logistic_of(weights.dot(values));
            gradient += values * (chance - is_right);
            curvature += values * values.transpose() * (chance * (1.0 - chance));
        }
        // The prior keeps the curvature positive.
        let step = curvature.try_inverse().map_or_else(Vector3::zeros, |one| one * gradient);
        // Far from the best weights, whole steps may leave them on the other side.
        weights -= step * (2.0 / step.norm()).min(1.0);
        if step.norm() < 1e-10 {
            break;
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A photo along a street, searched from this far behind.
    fn tried(at_m: f64, away_m: f64, is_right: bool) -> Tried {
        let pose = |z: f64| Pose::translation(0.0, 0.0, z);
        Tried { query: pose(at_m), reference: pose(at_m - away_m), is_right }
    }

    fn chance(prediction: &Prediction, at_m: f64, away_m: f64) -> f64 {
        let one = tried(at_m, away_m, true);
        prediction.chance(&one.query, &one.reference)
    }

    #[test]
    fn photos_are_lost_where_others_were_and_from_as_far_as_others_were() {
        // Right up to 12 m, and nowhere between 100 and 140 m.
        let photos: Vec<Tried> = (0..60)
            .map(|at| {
                let (at_m, away_m) = (5.0 * f64::from(at), f64::from(at % 20));
                tried(at_m, away_m, away_m <= 12.0 && !(100.0..140.0).contains(&at_m))
            })
            .collect();
        let prediction = Prediction::of(&photos, 20.0);
        assert!(chance(&prediction, 40.0, 3.0) > 0.8, "{}", chance(&prediction, 40.0, 3.0));
        assert!(chance(&prediction, 40.0, 18.0) < 0.5 * chance(&prediction, 40.0, 3.0));
        assert!(chance(&prediction, 120.0, 3.0) < 0.5 * chance(&prediction, 40.0, 3.0));
        // Farther is never better.
        let by_distance: Vec<f64> =
            (0..20).map(|away| chance(&prediction, 200.0, f64::from(away))).collect();
        assert!(by_distance.is_sorted_by(|a, b| a > b), "{by_distance:?}");
        // A photo that looks back sees another place than those that are lost there.
        let mut back = tried(120.0, 3.0, true);
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(Vector3::y() * std::f64::consts::PI);
        (back.query.rotation, back.reference.rotation) = (turn, turn);
        let back = prediction.chance(&back.query, &back.reference);
        assert!(back > chance(&prediction, 120.0, 3.0));
    }

    #[test]
    fn without_photos_nothing_is_known_and_all_alike_say_so() {
        let known = |photos: &[Tried]| chance(&Prediction::of(photos, 10.0), 0.0, 3.0);
        assert!((known(&[]) - 0.5).abs() < 1e-12);
        let all = |is_right| -> Vec<Tried> {
            (0..30).map(|at| tried(f64::from(at), f64::from(at % 10), is_right)).collect()
        };
        assert!(known(&all(true)) > 0.95 && known(&all(false)) < 0.05);
    }
}
