//! For posescope's own crates: may change in any version.
//!
//! Mistakes of a whole file of poses: what many of its poses have in common, without the truth.
//!
//! Posescope's own trusted poses of the same queries stand for the truth. A mistake is sought on every other query, and
//! named only if it mends the queries between them.

mod model;

use nalgebra::Vector3;

use self::model::{Both, Model};
use crate::diagnosis::Tolerance;
use crate::directions;
use crate::geometry::{Pose, PoseError};
use crate::stats::upper_median;

/// A query of a file, in the order of the queries.
#[derive(Clone, Copy, Debug, Default)]
pub struct Answered {
    /// The pose in the file, `world_from_camera`.
    pub given: Option<Pose>,
    /// Posescope's own pose, where it is trusted.
    pub own: Option<Pose>,
}

impl Answered {
    /// Whether both are there to compare.
    pub fn is_comparable(&self) -> bool {
        self.given.is_some() && self.own.is_some()
    }
}

/// What the poses of a file have in common.
#[derive(Clone, Debug, PartialEq)]
pub enum Mistake {
    /// Their numbers mean something else.
    Reading(String),
    /// The name of a pose stands so many lines after its own.
    Lines(i64),
    /// The given camera in the frame of the right one: right, down, forward \[m\], and the turn about these axes \[°\].
    Mounting {
        /// The shift.
        shift_m: [f64; 3],
        /// The turn.
        turn_deg: [f64; 3],
        /// Whether both are so on average only, as with another focal length, which shifts by a share of the depths.
        varies: bool,
    },
    /// Their world is another.
    World {
        /// How large it is beside the map's.
        scale: f64,
        /// How far it is turned \[°\].
        turn_deg: f64,
        /// How far it is shifted, in the middle of the queries \[m\].
        shift_m: f64,
    },
    /// The poses are those of so many queries earlier.
    Delay(f64),
    /// The error grows along the route.
    Drift {
        /// At the last queries \[m\].
        at_end_m: f64,
        /// As a share of the way from the first query.
        share: f64,
    },
}

/// A mistake of a whole file, with what speaks for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Systematic {
    /// The mistake.
    pub mistake: Mistake,
    /// Another that explains the poses as well.
    pub or: Option<Mistake>,
    /// How many queries have a pose in the file and an own one that is trusted.
    pub compared: usize,
    /// How many of them are right as they are given, if the own poses are.
    pub right_as_given: usize,
    /// How many are right once the mistake is mended.
    pub right_if_mended: usize,
    /// The median distance from the own poses, as given and mended \[m\].
    pub medians_m: [f64; 2],
}

/// The fewest queries that can be compared.
pub const FEWEST: usize = 8;
/// The share of what counts as right within which poses are the same.
const NEAR: f64 = 0.2;
/// The share of the queries that a mistake must explain, and how many more than were explained without it.
const EXPLAINED: f64 = 0.5;
const MORE: f64 = 0.3;
/// With more freedom, a mistake must explain so many more queries.
const MORE_BY_FREEDOM: f64 = 0.1;
/// Else it must lessen the errors by this factor, if they are so great \[in units of near\].
const LESS: f64 = 3.0;
const LESS_BY_FREEDOM: f64 = 2.0;
const WORTH_IT: f64 = 0.75;

/// How far poses may be from what a mistake of the camera makes of them on average, as a share of the mistake.
const ABOUT: f64 = 0.4;

/// What is near.
pub(crate) struct Nearness {
    metres: f64,
    radians: f64,
}

impl Nearness {
    fn of_right(right: Tolerance) -> Self {
        let radians = NEAR * right.rotation_deg.to_radians();
        Self { metres: NEAR * right.translation_m, radians }
    }

    /// What is near where the camera is shifted and turned so far on average; `None` where that is not far.
    fn about(self, given_from_right: &Pose) -> Option<Self> {
        let shift = ABOUT * given_from_right.translation.vector.norm();
        let turn = ABOUT * given_from_right.rotation.angle();
        (shift > self.metres || turn > self.radians)
            .then(|| Self { metres: self.metres.max(shift), radians: self.radians.max(turn) })
    }

    /// How far apart two poses are, in units of near.
    fn of(&self, one: &Pose, other: &Pose) -> f64 {
        let metres = (one.translation.vector - other.translation.vector).norm();
        let radians = one.rotation.angle_to(&other.rotation);
        (metres / self.metres).max(radians / self.radians)
    }
}

/// How well a model explains queries.
#[derive(Clone, Copy)]
struct Score {
    /// The share of queries that are near.
    near: f64,
    /// The median distance \[in units of near\].
    median: f64,
}

impl Score {
    fn of(model: &Model, queries: &[Answered], on: &[Both], nearness: &Nearness) -> Self {
        let off = on.iter().map(|both| {
            let corrected = model.corrected(queries, both.at);
            corrected.map_or(f64::INFINITY, |pose| nearness.of(&both.own, &pose))
        });
        let mut off: Vec<f64> = off.collect();
        let near = off.iter().filter(|off| **off <= 1.0).count() as f64 / off.len().max(1) as f64;
        Self { near, median: upper_median(&mut off) }
    }

    /// Whether it explains what the poses as they are given do not.
    fn explains(self, as_given: Self) -> bool {
        let explains_more = self.near >= EXPLAINED && self.near >= as_given.near + MORE;
        let lessens = as_given.median >= WORTH_IT && self.median <= as_given.median / LESS;
        // What is still far off is not explained.
        self.near >= EXPLAINED && (explains_more || lessens)
    }

    /// Whether it explains enough more than a model with less freedom.
    fn is_worth_freedom(self, simpler: Self) -> bool {
        let lessens = simpler.median >= 0.5 && self.median <= simpler.median / LESS_BY_FREEDOM;
        self.near >= simpler.near + MORE_BY_FREEDOM || self.near >= simpler.near && lessens
    }

    /// Whether it explains the poses about as well.
    fn is_as_good_as(self, other: Self) -> bool {
        self.near >= other.near - 0.05 && self.median <= 1.3 * other.median + 0.05
    }
}

/// The mistake of a file of poses; `None` where there is none or it cannot be known. The queries stand in their order.
pub fn systematic(queries: &[Answered], right: Tolerance) -> Option<Systematic> {
    let both: Vec<Both> = queries
        .iter()
        .enumerate()
        .filter_map(|(at, query)| Some(Both { at, given: query.given?, own: query.own? }))
        .collect();
    if both.len() < FEWEST {
        return None;
    }
    let exact = || Nearness::of_right(right);
    found_within(queries, &both, right, &exact()).or_else(|| {
        let on_average = exact().about(&model::shift_and_turn(&both)?)?;
        let about = found_within(queries, &both, right, &on_average)?;
        match about.mistake {
            Mistake::Mounting { shift_m, turn_deg, .. } => {
                let mistake = Mistake::Mounting { shift_m, turn_deg, varies: true };
                Some(Systematic { mistake, or: None, ..about })
            }
            _ => None,
        }
    })
}

/// The mistake that brings poses near.
fn found_within(
    queries: &[Answered],
    both: &[Both],
    right: Tolerance,
    nearness: &Nearness,
) -> Option<Systematic> {
    let half =
        |parity: usize| -> Vec<Both> { both.iter().skip(parity).step_by(2).copied().collect() };
    let (fitted_to, tested_on) = (half(0), half(1));
    let score = |model: &Model| Score::of(model, queries, &tested_on, nearness);
    let as_given = score(&Model::AsGiven);
    let models = Model::fitted(queries, &fitted_to, nearness);
    let mut scored: Vec<(u32, Score, Model)> =
        models.into_iter().map(|(freedom, model)| (freedom, score(&model), model)).collect();
    scored.sort_by_key(|(freedom, ..)| *freedom);
    scored.retain(|(_, score, model)| score.explains(as_given) && model.is_telling(both));
    let mut best: Option<usize> = None;
    for at in 0..scored.len() {
        let Some(known) = best else {
            best = Some(at);
            continue;
        };
        let ((freedom, score, _), (known_freedom, known_score, _)) = (&scored[at], &scored[known]);
        let is_better = if freedom == known_freedom {
            (score.near, -score.median) > (known_score.near, -known_score.median)
        } else {
            score.is_worth_freedom(*known_score)
        };
        if is_better {
            best = Some(at);
        }
    }
    let best = best?;
    let (freedom, best_score, _) = &scored[best];
    let mistake = scored[best].2.mistake(both)?;
    // The least free of them.
    let rivals = scored.iter().filter(|(other_freedom, score, _)| {
        *other_freedom <= freedom + 3 && score.is_as_good_as(*best_score)
    });
    let or = rivals
        .filter_map(|(_, _, model)| model.mistake(both))
        .find(|other| !other.is_kin_of(&mistake));
    let model = &scored[best].2;
    let errors = |model: &Model| -> Vec<PoseError> {
        let errors = both.iter().filter_map(|both| {
            Some(PoseError::between(&both.own, &model.corrected(queries, both.at)?))
        });
        errors.collect()
    };
    let (given, mended) = (errors(&Model::AsGiven), errors(model));
    let right_of =
        |errors: &[PoseError]| errors.iter().filter(|error| right.contains(error)).count();
    let median_m = |errors: &[PoseError]| {
        upper_median(&mut errors.iter().map(|error| error.translation_m).collect::<Vec<_>>())
    };
    Some(Systematic {
        mistake,
        or,
        compared: both.len(),
        right_as_given: right_of(&given),
        right_if_mended: right_of(&mended),
        medians_m: [median_m(&given), median_m(&mended)],
    })
}

impl Model {
    /// Whether it says more than that the poses are elsewhere.
    fn is_telling(&self, both: &[Both]) -> bool {
        match self {
            // An error that changes slowly is a drift only if it grows.
            Self::Drift(_) => self.mistake(both).is_some(),
            _ => true,
        }
    }

    /// What it means; `None` for what is no mistake.
    fn mistake(&self, both: &[Both]) -> Option<Mistake> {
        Some(match self {
            Self::AsGiven => return None,
            Self::Reading(reading) => Mistake::Reading(reading.name.clone()),
            Self::Lines(by) => Mistake::Lines(*by),
            Self::Mounting(given_from_right) => {
                let right_from_given = given_from_right.inverse();
                let turn = right_from_given.rotation.scaled_axis().map(f64::to_degrees);
                Mistake::Mounting {
                    shift_m: right_from_given.translation.vector.into(),
                    turn_deg: turn.into(),
                    varies: false,
                }
            }
            Self::World { scale, pose } => {
                let middle = both.get(both.len() / 2)?;
                let theirs = middle.given.translation.vector;
                let moved = pose.rotation * (theirs * *scale) + pose.translation.vector;
                Mistake::World {
                    scale: 1.0 / scale,
                    turn_deg: pose.rotation.angle().to_degrees(),
                    shift_m: (moved - theirs).norm(),
                }
            }
            Self::Delay(by) => Mistake::Delay(*by),
            Self::Drift(_) => drift_of(both)?,
        })
    }
}

/// An error that grows with the way from the first query.
fn drift_of(both: &[Both]) -> Option<Mistake> {
    /// How much greater it is in the last third than in the first.
    const GROWS: f64 = 3.0;
    let mut way_m = 0.0;
    let mut before: Option<Vector3<f64>> = None;
    let places = both.iter().map(|one| {
        let at = one.own.translation.vector;
        way_m += before.map_or(0.0, |before| (at - before).norm());
        before = Some(at);
        (way_m, (one.given.translation.vector - at).norm())
    });
    let places: Vec<(f64, f64)> = places.collect();
    let third = places.len() / 3;
    let median_of =
        |part: &[(f64, f64)]| upper_median(&mut part.iter().map(|one| one.1).collect::<Vec<_>>());
    let (first, last) = (median_of(&places[..third]), median_of(&places[places.len() - third..]));
    let far = places.iter().filter(|(way, _)| *way > 0.3 * way_m);
    let share = upper_median(&mut far.map(|(way, off)| off / way).collect::<Vec<_>>());
    (last >= GROWS * first && share.is_finite()).then_some(Mistake::Drift { at_end_m: last, share })
}

impl Mistake {
    /// Whether it is the same with other numbers.
    fn is_kin_of(&self, other: &Self) -> bool {
        match (self, other) {
            // A drift explains whatever else does, and other axes are a mounting and a world too.
            (Self::Drift { .. }, _) | (_, Self::Reading(_)) => true,
            (Self::Lines(_), Self::Delay(_)) | (Self::Delay(_), Self::Lines(_)) => true,
            _ => std::mem::discriminant(self) == std::mem::discriminant(other),
        }
    }

    /// What is wrong, as the end of a sentence about the poses.
    pub fn words(&self) -> String {
        match self {
            Self::Reading(reading) => format!("are {reading}"),
            Self::Lines(by) => {
                let (lines, place) = (by.unsigned_abs(), if *by > 0 { "before" } else { "after" });
                let unit = if lines == 1 { "query" } else { "queries" };
                format!(
                    "belong to the {} {lines} {unit} {place}",
                    if lines == 1 { "one" } else { "ones" }
                )
            }
            Self::Mounting { shift_m, turn_deg, varies } => {
                let about = if *varies { "about " } else { "" };
                let shift = Vector3::from(*shift_m).norm();
                let turn = Vector3::from(*turn_deg).norm();
                let of_shift = || {
                    format!("shifted by {about}{shift:.2} m ({})", directions::of_shift(*shift_m))
                };
                let of_turn =
                    || format!("turned by {about}{turn:.2}° ({})", directions::of_turn(*turn_deg));
                match (shift > 0.0, turn > 0.0) {
                    (true, false) => format!("are {} in the camera's frame", of_shift()),
                    (false, _) => format!("are {} in the camera's frame", of_turn()),
                    (true, true) => {
                        format!("are {} and {} in the camera's frame", of_shift(), of_turn())
                    }
                }
            }
            Self::World { scale, turn_deg, shift_m } => {
                let size = if (scale - 1.0).abs() < 0.002 {
                    String::new()
                } else {
                    format!("{scale:.3} times as large, ")
                };
                format!(
                    "are of another world: beside the map's, it is {size}turned by {turn_deg:.1}° and shifted by \
                     {shift_m:.2} m"
                )
            }
            Self::Delay(by) => {
                let when = if *by > 0.0 { "earlier" } else { "later" };
                format!("are those of {:.2} queries {when}", by.abs())
            }
            Self::Drift { at_end_m, share } => format!(
                "drift: their error grows along the route to {at_end_m:.2} m, {:.2} % of the way",
                100.0 * share
            ),
        }
    }

    /// What to do about it.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Reading(_) => "write the poses in the convention of the map",
            Self::Lines(_) => "check which line belongs to which photo",
            Self::Mounting { varies: true, .. } => {
                "the size differs from pose to pose: check the camera's focal length and centre, and the size of the photos"
            }
            Self::Mounting { varies: false, .. } => {
                "check what the poses are of (a body, another camera, an antenna), and the camera's focal length and \
                 centre"
            }
            Self::World { .. } => "align the poses to the map's world",
            Self::Delay(_) => "check the clocks of photos and poses",
            Self::Drift { .. } => "localise against the map anew on the way, or close loops",
        }
    }
}

#[cfg(test)]
mod tests;
