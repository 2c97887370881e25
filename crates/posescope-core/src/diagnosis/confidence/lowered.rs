//! What makes a pose less likely right than the evidence of its method says.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::explained::correspondences;
use super::{NEAR, coefficients::Fitted, responsible};
use crate::diagnosis::Subject;
use crate::diagnosis::numbers::with_digits;
use crate::estimator::Family;
use crate::geometry::{Pose, PoseError};
use crate::grid::Reach;
use crate::judge::Judge;
use crate::render::Objective as _;
use crate::solver::{Loss, Zoomed, refine_zoomed};
use crate::stats::median;

/// Why a pose is less likely right than its method's evidence says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "why", rename_all = "kebab-case")]
pub enum Lowered {
    /// With another focal length the query shows more of the matches, and shows them from elsewhere.
    Camera {
        /// The focal length that explains more \[px\].
        focal_length_px: f64,
        /// The stated one \[px\].
        stated_px: f64,
        /// The matches that it explains, of those that were looked at.
        explains: usize,
        /// The matches that the stated one explains, of the same.
        stated_explains: usize,
    },
    /// The search went farther than any that probabilities were fitted to.
    Radius {
        /// How far it went \[m, or the unit of the scene\].
        searched_m: f64,
        /// How far those went, at the scale of the scene.
        fitted_to_m: f64,
    },
    /// The search keeps the height and the tilt of the reference, or turns little, and the map's cameras differ in these.
    Freedoms {
        /// The share of the pairs of the map's frames that such a search can find.
        reached: f64,
    },
}

/// As a clause after *because*.
impl fmt::Display for Lowered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Camera { focal_length_px, stated_px, explains, stated_explains } => write!(
                f,
                "a focal length of {focal_length_px:.0} px explains {explains} matches, from another place, and the \
                 stated {stated_px:.0} px explain {stated_explains}: check the query's camera"
            ),
            Self::Radius { searched_m, fitted_to_m } => write!(
                f,
                "the search went {} m far, and probabilities are known up to {} m",
                with_digits(*searched_m, 2),
                with_digits(*fitted_to_m, 2)
            ),
            Self::Freedoms { reached } => write!(
                f,
                "the search changes position and heading alone, and so reaches {:.0} % of the ways from one camera of the map \
                 to another: use --method robust or mi6",
                100.0 * reached
            ),
        }
    }
}

/// A pose that another camera explains better is no more likely right than this.
const OF_ANOTHER_CAMERA: f64 = 0.25;

impl Lowered {
    /// The probability of a pose for which this holds.
    pub(super) fn applied(&self, probability: f64) -> f64 {
        match self {
            Self::Camera { .. } => probability.min(OF_ANOTHER_CAMERA),
            Self::Radius { searched_m, fitted_to_m } => {
                // The number of places that look alike grows with the area.
                let by = (fitted_to_m / searched_m).powi(2);
                by * probability / (1.0 - probability + by * probability)
            }
            Self::Freedoms { reached } => reached * probability,
        }
    }
}

/// Whether a search went farther than all that probabilities were fitted to.
pub(super) fn by_radius(subject: &Subject<'_>, fitted: &Fitted) -> Option<Lowered> {
    let metre = subject.params.scale.metre();
    let searched_m = subject.problem.uncertainty_radius_m();
    let fitted_to_m = fitted.farthest()? * metre;
    // What is kept of the fit is rounded.
    (searched_m > 1.001 * fitted_to_m).then_some(Lowered::Radius { searched_m, fitted_to_m })
}

/// Whether the method searches fewer freedoms than the cameras of the map have. The minimum of its cost does not show it.
pub(super) fn by_freedoms(subject: &Subject<'_>, reach: &Reach) -> Option<Lowered> {
    /// Cameras of which more are reached move as those that were fitted to.
    const AS_IN_TOWNS: f64 = 0.95;
    let method = responsible(subject.method, subject.outcome);
    let is_grid = Family::of(method, subject.params) == Some(Family::Grid);
    let reached = reach.of(&subject.params.grid, subject.params.scale);
    (is_grid && reached < AS_IN_TOWNS).then_some(Lowered::Freedoms { reached })
}

/// Whether the matches of the photos, and the photos themselves, go better with another focal length of the query at
/// another place. Then the stated camera may be that of another photo, and the pose is wrong as the camera is.
///
/// One more freedom explains more false matches, too: those of windows that repeat at one depth. So the photos must agree
/// with it: drawn from there with that camera, the reference's cloud goes with the query better than from the pose.
pub(super) fn by_camera(subject: &Subject<'_>) -> Option<Lowered> {
    /// How many times smaller the photos are that must agree.
    const SHRINK: u32 = 4;
    /// More matches tell nothing new.
    const MATCHES: usize = 300;
    /// Where to start, beside the stated focal length.
    const ZOOMS: [f64; 3] = [1.0, 0.8, 1.25];
    /// Focal lengths that are nearer to each other are those of one camera.
    const SAME: f64 = 0.03;
    /// How many times as many matches it must explain, and how many more at least.
    const MORE: f64 = 1.25;
    const AT_LEAST_MORE: usize = 8;
    let &Subject { problem, params, outcome, evidence, .. } = subject;
    let reference_from_query = problem.reference_from_query(outcome.pose.as_ref().ok()?);
    let threshold_px = match Family::of(subject.method, params) {
        Some(Family::Guided) => params.fb2.mlesac.inlier_threshold_px,
        _ => params.fb.mlesac.inlier_threshold_px,
    };
    let correspondences = correspondences(subject, MATCHES)?;
    let stated = &problem.query.intrinsics;
    let answer = Zoomed { pose: reference_from_query.inverse(), zoom: 1.0 };
    let refined = evidence.refined.as_ref().map(|one| one.reference_from_query.inverse());
    let refined = refined.map(|pose| Zoomed { pose, zoom: 1.0 });
    let mut depths: Vec<f64> =
        correspondences.iter().map(|one| (answer.pose * one.point).z).collect();
    let depth_m = median(&mut depths)?;
    let searched = ZOOMS.map(|zoom| {
        let back = Pose::translation(0.0, 0.0, (zoom - 1.0) * depth_m);
        let mut found = Zoomed { pose: back * answer.pose, zoom };
        for scale in [6.0 * threshold_px, threshold_px] {
            found = refine_zoomed(&correspondences, stated, found, Loss::Cauchy(scale));
        }
        found
    });
    let near_m = NEAR.at(params.scale).translation_m;
    let of = |one: &Zoomed| one.explains(&correspondences, stated, threshold_px);
    let apart_m =
        |one: &Zoomed| PoseError::between(&reference_from_query, &one.pose.inverse()).translation_m;
    let all = searched.iter().chain([&answer]).chain(&refined);
    let (here, elsewhere): (Vec<&Zoomed>, Vec<&Zoomed>) =
        all.partition(|one| apart_m(one) <= near_m);
    let stated_explains = here.into_iter().map(of).max()?;
    let others = elsewhere.into_iter().filter(|one| one.zoom.ln().abs() > SAME);
    let (other, explains) = others.map(|one| (one, of(one))).max_by_key(|one| one.1)?;
    let is_more = explains as f64 >= MORE * stated_explains as f64
        && explains >= stated_explains + AT_LEAST_MORE;
    if !is_more {
        return None;
    }
    let judge = || Judge::new(problem, &params.render, &params.judge, SHRINK);
    let cost = |judge: Judge, pose: &Pose| judge.score(&[*pose]).first().and_then(|one| one.cost);
    let stated_cost = cost(judge(), &reference_from_query);
    let other_cost = cost(judge().seen_by(&other.camera(stated), SHRINK), &other.pose.inverse())?;
    stated_cost.is_none_or(|stated_cost| other_cost < stated_cost).then_some(Lowered::Camera {
        focal_length_px: other.zoom * stated.fx,
        stated_px: stated.fx,
        explains,
        stated_explains,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odds_fall_with_the_area_that_was_searched_and_another_camera_caps_them() {
        let radius = Lowered::Radius { searched_m: 50.0, fitted_to_m: 25.0 };
        // Odds of 9 to 1 become 9 to 4.
        assert!((radius.applied(0.9) - 9.0 / 13.0).abs() < 1e-12);
        assert_eq!([0.0, 1.0].map(|sure| radius.applied(sure)), [0.0, 1.0]);
        let camera = Lowered::Camera {
            focal_length_px: 883.2,
            stated_px: 707.0,
            explains: 60,
            stated_explains: 21,
        };
        assert_eq!([0.99, 0.1].map(|one| camera.applied(one)), [OF_ANOTHER_CAMERA, 0.1]);
        let freedoms = Lowered::Freedoms { reached: 0.25 };
        assert_eq!(freedoms.applied(0.8), 0.2);
        let said = [radius.to_string(), camera.to_string(), freedoms.to_string()];
        assert_eq!(said[0], "the search went 50 m far, and probabilities are known up to 25 m");
        let words = "a focal length of 883 px explains 60 matches, from another place, and the stated 707 px explain \
                     21: check the query's camera";
        assert_eq!(said[1], words);
        let words = "the search changes position and heading alone, and so reaches 25 % of the ways from one camera of \
                     the map to another: use --method robust or mi6";
        assert_eq!(said[2], words);
        let text = serde_json::to_string(&camera).expect("numbers");
        assert_eq!(serde_json::from_str::<Lowered>(&text).ok(), Some(camera));
    }
}
