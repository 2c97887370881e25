//! For posescope's own crates: may change in any version.
//!
//! A second opinion on a pose that another system found: how far off it is, without knowing the truth.
//!
//! Posescope localises the query itself, from the same references and without the given pose. Where its own answer can
//! be trusted, the given pose is compared with that: near it, the given pose is confirmed, elsewhere contradicted. Two
//! systems that found the same pose independently are seldom both wrong, so an own answer that would not be trusted
//! alone may confirm a pose. What posescope cannot tell stays undecided, and says why. That a pose costs much never
//! contradicts it.

use nalgebra::Matrix3x4;
use serde::{Deserialize, Serialize};

use crate::covariance::error_vector;
use crate::diagnosis::confidence::{TRUSTED_FROM, Within, percent};
use crate::diagnosis::{Diagnosis, PoseConfidence, Tolerance};
use crate::directions;
use crate::geometry::{Pose, PoseError, matrix_from_pose, pose_from_matrix};
use crate::method::Method;
use crate::text::words;

/// What a second opinion comes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Standing {
    /// The pose is likely right.
    Confirmed,
    /// It cannot be told.
    Undecided,
    /// The photos agree elsewhere.
    Contradicted,
}

words!(Standing, "standing": Confirmed = "confirmed", Undecided = "undecided", Contradicted = "contradicted");

impl Standing {
    /// The glyph, the same everywhere.
    pub fn glyph(self) -> &'static str {
        match self {
            Self::Confirmed => "✓",
            Self::Undecided => "?",
            Self::Contradicted => "≠",
        }
    }
}

/// The share of what counts as right up to which a pose may be off to be confirmed, and from which on it is
/// contradicted. Between them lies what posescope's own error may hide.
const BOUNDARY: f64 = 0.75;

/// From here on an own answer is more likely right than wrong, so that it may contradict.
const LIKELY: f64 = 0.5;

/// The minimum at a true pose seldom costs so much more than the answer, in robust standard deviations: how much, and in
/// how many cases it does all the same.
const TELLING: f64 = 5.0;
const RARELY: f64 = 0.1;

/// How often two systems that are both wrong find the same pose all the same, as a share: what looks alike misleads
/// both.
const BOTH_MISLED: f64 = 0.1;

/// More is never known of an own answer.
const MOST_LIKELY: f64 = 0.995;

/// What is thought of the pose that another system found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Opinion {
    /// What it comes to.
    pub standing: Standing,
    /// How likely the given pose is right.
    pub probability: f64,
    /// What counts as right.
    pub within: Within,
    /// Where the given camera is, seen from where posescope has it: right, down, forward \[m\].
    pub offset_m: Option<[f64; 3]>,
    /// How far it is turned against that \[°\].
    pub offset_deg: Option<f64>,
    /// The same turn about the axes of the camera as posescope has it: up, right, clockwise \[°\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turned_deg: Option<[f64; 3]>,
    /// How far off it is, at least and at most, if posescope's own pose is right, in 95 % of such cases \[m\].
    pub interval_m: Option<[f64; 2]>,
    /// Where the photos agree, for a pose that is contradicted.
    pub better: Option<BetterPose>,
    /// Posescope's own pose, where it is trusted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub own: Option<BetterPose>,
    /// The frame of the map that has this very pose, unless the pose is confirmed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub copied_from: Option<String>,
    /// The method of posescope whose answer this rests on.
    pub by: Option<Method>,
    /// What the pose explains of the matches that the other system gave with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matches: Option<ExplainedMatches>,
    /// Why, in a sentence.
    pub because: String,
}

/// The pose at which the photos agree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BetterPose {
    /// `[R|t]`, row by row.
    pub world_from_camera: [[f64; 4]; 3],
    /// How far off posescope's own pose is in 95 % of cases, if it is right.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub within_95: Option<Within>,
}

impl From<&Pose> for BetterPose {
    fn from(pose: &Pose) -> Self {
        let matrix = matrix_from_pose(pose);
        let row = |row: usize| std::array::from_fn(|column| matrix[(row, column)]);
        Self { world_from_camera: std::array::from_fn(row), within_95: None }
    }
}

impl BetterPose {
    /// The pose; `None` where the numbers are none.
    pub fn to_pose(&self) -> Option<Pose> {
        let rows = &self.world_from_camera;
        pose_from_matrix(&Matrix3x4::from_fn(|row, column| rows[row][column])).ok()
    }
}

/// How many of another system's matches its own pose explains. It is evidence on what that system made of them; what
/// misleads its matches misleads both poses, so it decides nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExplainedMatches {
    /// Matches whose point in the reference has a depth.
    pub with_depth: usize,
    /// Those that the pose explains.
    pub by_pose: usize,
    /// Those that the best pose for them explains.
    pub at_most: usize,
    /// How far that pose is from the given one.
    pub apart: Option<PoseError>,
}

impl ExplainedMatches {
    /// The same as a sentence; lengths in metres.
    pub fn words(&self) -> String {
        let Self { with_depth, by_pose, at_most, apart } = self;
        let best = match apart {
            Some(apart) if at_most > by_pose => format!(
                "; the best pose for them, {} and {} away, explains {at_most}",
                apart.translation(),
                apart.rotation()
            ),
            _ => String::new(),
        };
        format!(
            "It explains {by_pose} of the {with_depth} matches with a depth that came with it{best}."
        )
    }
}

/// What another system's own matches say of its pose.
#[derive(Clone, Debug)]
pub struct MatchesOfPose {
    /// How many the pose explains.
    pub explained: ExplainedMatches,
    /// What is wrong with the consensus of the matches.
    pub verdicts: Vec<Diagnosis>,
}

/// A pose that posescope itself found for the query.
#[derive(Clone, Debug)]
pub struct OwnAnswer {
    /// The method that found it.
    pub method: Method,
    /// The pose, `world_from_camera`.
    pub pose: Pose,
    /// How likely it is right, as the user defines it; `None` where that cannot be known.
    pub confidence: Option<PoseConfidence>,
    /// How much more the minimum costs that the given pose leads to, in robust standard deviations of costs around the
    /// reference; `None` where that was not looked at.
    pub given_costs_more: Option<f64>,
}

impl OwnAnswer {
    /// Whether it is worth a look what the given pose costs: it is elsewhere, and the answer alone does not decide.
    pub fn needs_costs(&self, given: &Pose, right: Tolerance) -> bool {
        let error = PoseError::between(&self.pose, given);
        let is_apart = Apart::of(&error, self.may_be_off(right), right).least >= BOUNDARY;
        is_apart && !self.is_trusted() && self.probability() >= LIKELY
    }

    /// How likely it is right.
    fn probability(&self) -> f64 {
        self.confidence.as_ref().map_or(0.0, |known| known.probability.min(MOST_LIKELY))
    }

    /// Whether it decides by itself.
    pub fn is_trusted(&self) -> bool {
        self.probability() >= TRUSTED_FROM
    }

    /// How far off it may be itself.
    fn may_be_off(&self, right: Tolerance) -> Within {
        let known = self.confidence.as_ref().and_then(|known| known.within_95);
        known.unwrap_or_else(|| right.into())
    }

    fn words(&self) -> String {
        format!("{}'s own pose, {} likely right,", self.method, percent(self.probability()))
    }
}

/// How far apart two poses are, as shares of what counts as right, at least and at most.
struct Apart {
    least: f64,
    most: f64,
}

impl Apart {
    fn of(error: &PoseError, own: Within, right: Tolerance) -> Self {
        let parts = [
            (error.translation_m, own.m, right.translation_m),
            (error.rotation_deg, own.deg, right.rotation_deg),
        ];
        let greatest = |sign: f64| {
            let shares = parts.iter().map(|(off, own, right)| (off + sign * own).max(0.0) / right);
            shares.fold(0.0, f64::max)
        };
        Self { least: greatest(-1.0), most: greatest(1.0) }
    }

    /// How likely they are so close that the one is right if the other is.
    fn share_within(&self) -> f64 {
        ((1.0 - self.least) / (self.most - self.least).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    }
}

impl Opinion {
    /// The opinion on a pose, `world_from_camera`, by posescope's own answers from the same references. `missing` says
    /// why there is none, if there is none.
    pub fn of(given: &Pose, right: Tolerance, answers: &[OwnAnswer], missing: &str) -> Self {
        let undecided = |because: String| Self {
            standing: Standing::Undecided,
            probability: 0.5,
            within: right.into(),
            offset_m: None,
            offset_deg: None,
            turned_deg: None,
            interval_m: None,
            better: None,
            own: None,
            copied_from: None,
            by: None,
            matches: None,
            because,
        };
        // Of equals, the first.
        let best = answers.iter().rev().max_by(|a, b| a.probability().total_cmp(&b.probability()));
        let Some(best) = best else {
            return undecided(missing.to_owned());
        };
        if best.confidence.is_none() {
            let because = "Posescope cannot say how likely its own poses are right at this scale; `posescope survey` \
                           of the map finds it out.";
            return undecided(because.to_owned());
        }
        let trusted = answers.iter().filter(|answer| answer.is_trusted());
        let elsewhere = trusted
            .map(|other| PoseError::between(&best.pose, &other.pose))
            .find(|between| !right.contains(between));
        if let Some(between) = elsewhere.filter(|_| best.is_trusted()) {
            let because = format!(
                "Two references lead to poses that are both likely right and {} apart.",
                between.greater()
            );
            return undecided(because);
        }
        best_known(given, right, best, undecided)
    }

    /// What it comes to, with the offset, as people read it; lengths in metres.
    pub fn words(&self) -> String {
        let glyph = self.standing.glyph();
        match self.standing {
            Standing::Contradicted => {
                format!("{glyph} {}, {}", self.standing, self.off().unwrap_or_default())
            }
            Standing::Confirmed => format!(
                "{glyph} {}, {} likely within {} m",
                self.standing,
                percent(self.probability),
                self.within.m
            ),
            Standing::Undecided => format!("{glyph} {}", self.standing),
        }
    }

    /// The same of a pose that is also that of a frame of the map. A right one may be: the camera stood still.
    #[must_use]
    pub(crate) fn of_a_pose_like(self, frame: Option<String>) -> Self {
        match frame.filter(|_| self.standing != Standing::Confirmed) {
            Some(frame) => {
                let because = format!("It is the pose of {frame} of the map. {}", self.because);
                Self { copied_from: Some(frame), because, ..self }
            }
            None => self,
        }
    }

    /// How far off the position is \[m\].
    pub fn distance_m(&self) -> Option<f64> {
        let parts = self.offset_m?;
        Some(parts.iter().map(|part| part * part).sum::<f64>().sqrt())
    }

    /// How far off the pose is, as a share of what counts as right; turns count like distances.
    pub fn share(&self) -> Option<f64> {
        let shares = [self.distance_m()? / self.within.m, self.offset_deg? / self.within.deg];
        Some(shares.into_iter().fold(0.0, f64::max))
    }

    /// How far off the pose is, with the directions that matter.
    fn off(&self) -> Option<String> {
        let (offset, distance, angle) = (self.offset_m?, self.distance_m()?, self.offset_deg?);
        // A turn this small has no meaningful direction.
        let turned = self.turned_deg.filter(|_| angle >= 0.1);
        let turned = turned.map(|turned| format!(" ({})", directions::of_turn(turned)));
        Some(format!(
            "{distance:.2} m ({}) and {angle:.2}°{} off",
            directions::of_shift(offset),
            turned.unwrap_or_default()
        ))
    }
}

/// The opinion by an answer of which it is known how likely it is right.
fn best_known(
    given: &Pose,
    right: Tolerance,
    best: &OwnAnswer,
    undecided: impl Fn(String) -> Opinion,
) -> Opinion {
    let error = PoseError::between(&best.pose, given);
    let own = best.may_be_off(right);
    let apart = Apart::of(&error, own, right);
    let likely = best.probability();
    // By Bayes' rule, if a given pose is as likely right as wrong before.
    let right_if_near = likely / (likely + (1.0 - likely) * BOTH_MISLED);
    let costs_more = best.given_costs_more.filter(|more| *more >= TELLING);
    let right_if_apart =
        (1.0 - likely) / (2.0 - likely) * if costs_more.is_some() { RARELY } else { 1.0 };
    let share = apart.share_within();
    let probability = share * right_if_near + (1.0 - share) * right_if_apart;
    let (is_near, is_apart) = (apart.most <= BOUNDARY, apart.least >= BOUNDARY);
    let standing = match () {
        () if is_near && right_if_near >= TRUSTED_FROM => Standing::Confirmed,
        () if is_apart && likely >= LIKELY && right_if_apart <= 1.0 - TRUSTED_FROM => {
            Standing::Contradicted
        }
        () => Standing::Undecided,
    };
    let between = format!("{} and {}", error.translation(), error.rotation());
    let because = match standing {
        Standing::Confirmed => format!("{} is {between} from it.", best.words()),
        Standing::Contradicted => {
            let costs = match costs_more {
                Some(more) if !best.is_trusted() => {
                    format!(", and the given pose costs {more:.0} standard deviations more")
                }
                _ => String::new(),
            };
            format!("The photos agree elsewhere: {} is {between} from it{costs}.", best.words())
        }
        Standing::Undecided if !is_near && !is_apart => format!(
            "{} is {between} from it and may be off by {own} itself: too close to what still counts as right, {} m and \
             {}°.",
            best.words(),
            right.translation_m,
            right.rotation_deg
        ),
        Standing::Undecided => {
            format!("{} is {between} from it: that is too little to decide by.", best.words())
        }
    };
    let offset = error_vector(given, &best.pose);
    let less_m = (error.translation_m - own.m).max(0.0);
    Opinion {
        standing,
        probability,
        offset_m: Some([offset[3], offset[4], offset[5]]),
        offset_deg: Some(error.rotation_deg),
        turned_deg: Some([offset[0], offset[1], offset[2]].map(f64::to_degrees)),
        interval_m: Some([less_m, error.translation_m + own.m]),
        better: (standing == Standing::Contradicted).then(|| BetterPose::from(&best.pose)),
        own: best.is_trusted().then(|| BetterPose {
            within_95: best.confidence.as_ref().and_then(|known| known.within_95),
            ..BetterPose::from(&best.pose)
        }),
        by: Some(best.method),
        ..undecided(because)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIGHT: Tolerance = Tolerance { translation_m: 1.0, rotation_deg: 5.0 };

    fn answer(at_m: f64, probability: f64) -> OwnAnswer {
        let confidence = PoseConfidence {
            within_95: Some(Within { m: 0.1, deg: 0.2 }),
            ..PoseConfidence::new(probability, RIGHT.into())
        };
        let pose = Pose::translation(at_m, 0.0, 0.0);
        OwnAnswer { method: Method::FB, pose, confidence: Some(confidence), given_costs_more: None }
    }

    fn of(given_m: f64, answers: &[OwnAnswer]) -> Opinion {
        Opinion::of(&Pose::translation(given_m, 0.0, 0.0), RIGHT, answers, "Nothing was found.")
    }

    #[test]
    fn a_trusted_pose_confirms_what_is_near_and_contradicts_what_is_elsewhere() {
        let own = [answer(0.0, 0.98)];
        let near = of(0.1, &own);
        assert_eq!((near.standing, near.better), (Standing::Confirmed, None));
        assert!(near.probability > 0.95, "{}", near.probability);
        for away in [1.0, -2.0, 10.0] {
            let far = of(away, &own);
            assert_eq!(far.standing, Standing::Contradicted, "{away}");
            let [right, down, forward] = far.offset_m.expect("an offset");
            assert!((right - away).abs() < 1e-12 && down == 0.0 && forward == 0.0);
            let [least, most] = far.interval_m.expect("an interval");
            assert!((least - (away.abs() - 0.1)).abs() < 1e-12 && most > away.abs());
            assert_eq!(far.better, Some(BetterPose::from(&own[0].pose)));
        }
        assert!(of(3.0, &own).probability < 0.05);
        assert!(of(2.0, &own).words().contains("2.00 m (2.00 m right) and 0.00° off"));
        let turned = Pose::rotation(nalgebra::Vector3::y() * 8_f64.to_radians());
        let turned = Opinion::of(&turned, RIGHT, &own, "");
        assert_eq!(turned.standing, Standing::Contradicted);
        assert!(turned.words().contains("8.00° (8.00° right)"), "{}", turned.words());
        // A turn counts like a distance.
        assert!((turned.share().expect("an offset") - 8.0 / 5.0).abs() < 1e-9);
    }

    #[test]
    fn what_an_own_error_may_hide_is_undecided() {
        let between = of(0.75, &[answer(0.0, 0.98)]);
        assert_eq!(between.standing, Standing::Undecided);
        assert!(between.because.contains("too close"), "{}", between.because);
    }

    #[test]
    fn agreement_confirms_where_an_own_pose_alone_would_not_be_trusted_and_never_contradicts() {
        let own = [answer(0.0, 0.8)];
        assert_eq!(of(0.1, &own).standing, Standing::Confirmed);
        assert_eq!(of(5.0, &own).standing, Standing::Undecided);
        let doubted = [answer(0.0, 0.4)];
        assert_eq!(of(0.1, &doubted).standing, Standing::Undecided);
        // The likelier it is elsewhere, the less likely the given pose is right.
        assert!(of(5.0, &own).probability < of(5.0, &doubted).probability);
    }

    #[test]
    fn a_likely_pose_contradicts_where_the_given_one_costs_far_more() {
        let costing = |probability: f64, more: f64| {
            let own = OwnAnswer { given_costs_more: Some(more), ..answer(0.0, probability) };
            let given = Pose::translation(3.0, 0.0, 0.0);
            assert!(own.needs_costs(&given, RIGHT) == (0.5..0.95).contains(&probability));
            assert!(!own.needs_costs(&own.pose, RIGHT));
            of(3.0, &[own])
        };
        let found = costing(0.7, 12.0);
        assert_eq!(found.standing, Standing::Contradicted);
        assert!(found.because.contains("12 standard deviations more"), "{}", found.because);
        // A high cost alone never contradicts, nor does a pose that costs about the same.
        assert_eq!(costing(0.4, 50.0).standing, Standing::Undecided);
        assert_eq!(costing(0.7, 2.0).standing, Standing::Undecided);
    }

    #[test]
    fn without_an_own_pose_or_with_two_that_contradict_each_other_it_stays_open() {
        let none = of(0.0, &[]);
        assert_eq!(
            (none.standing, none.because.as_str()),
            (Standing::Undecided, "Nothing was found.")
        );
        let unknown = [OwnAnswer { confidence: None, ..answer(0.0, 0.9) }];
        assert!(of(0.0, &unknown).because.contains("survey"));
        let two = [answer(0.0, 0.98), answer(4.0, 0.97)];
        let torn = of(0.0, &two);
        assert_eq!(torn.standing, Standing::Undecided);
        assert!(torn.because.contains("4.000 m"), "{}", torn.because);
        // A doubtful one has no say beside one that is trusted.
        assert_eq!(of(0.0, &[answer(4.0, 0.6), answer(0.0, 0.98)]).standing, Standing::Confirmed);
    }
}
