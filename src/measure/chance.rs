//! The success rate of chance, as a baseline.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

/// The share of the queries that would succeed without any method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chance {
    /// With the pose of the reference as the answer.
    pub reference_pose: f64,
    /// With a random position in the uncertainty disc as the answer.
    pub random_pose: f64,
}

impl Chance {
    /// The success rate of chance, from each query's distance to the reference and uncertainty radius \[m\]. `None` if
    /// any of them is unknown.
    pub fn of(
        queries: impl Iterator<Item = (Option<f64>, Option<f64>)>,
        failure_radius_m: f64,
    ) -> Option<Self> {
        let of_query = |(away_m, radius_m): (Option<f64>, Option<f64>)| {
            let (away_m, radius_m) = (away_m?, radius_m?);
            let hits = f64::from(u8::from(away_m < failure_radius_m));
            Some((hits, share_within(radius_m, failure_radius_m, away_m)))
        };
        let each: Vec<(f64, f64)> = queries.map(of_query).collect::<Option<_>>()?;
        let count = each.len().max(1) as f64;
        Some(Self {
            reference_pose: each.iter().map(|one| one.0).sum::<f64>() / count,
            random_pose: each.iter().map(|one| one.1).sum::<f64>() / count,
        })
    }
}

/// The share of a disc of radius `disc_m` within `limit_m` of a point at a distance `away_m` from its centre: the
/// area of the intersection of two circles over that of the disc.
fn share_within(disc_m: f64, limit_m: f64, away_m: f64) -> f64 {
    let (r, s, d) = (disc_m, limit_m, away_m);
    if d >= r + s {
        return 0.0;
    }
    if d <= (r - s).abs() {
        return (s.min(r) / r).powi(2);
    }
    let lens = |radius: f64, other: f64| {
        let cosine = (d * d + radius * radius - other * other) / (2.0 * d * radius);
        radius * radius * cosine.clamp(-1.0, 1.0).acos()
    };
    let kite = ((-d + r + s) * (d + r - s) * (d - r + s) * (d + r + s)).max(0.0);
    (lens(r, s) + lens(s, r) - 0.5 * kite.sqrt()) / (PI * r * r)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn discs_share_nothing_all_or_what_the_formula_of_two_equal_circles_says() {
        assert_eq!(share_within(10.0, 10.0, 20.0), 0.0);
        assert_eq!(share_within(10.0, 30.0, 5.0), 1.0);
        assert!((share_within(10.0, 5.0, 2.0) - 0.25).abs() < 1e-12);
        // Two unit circles at distance 1: (2π/3 − √3/2) / π.
        let expected = 2.0 / 3.0 - 3f64.sqrt() / (2.0 * PI);
        assert!((share_within(1.0, 1.0, 1.0) - expected).abs() < 1e-12);
    }

    #[test]
    fn the_share_falls_without_a_jump_as_the_point_goes_away() {
        let shares: Vec<f64> =
            (0..400).map(|k| share_within(10.0, 7.0, 0.05 * f64::from(k))).collect();
        let steps = shares.windows(2).map(|pair| pair[0] - pair[1]);
        assert!(steps.clone().all(|step| (-1e-9..0.02).contains(&step)));
    }
}
