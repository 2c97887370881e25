//! What was answered about the photos of a survey.

use super::fit::{self, Judged};
use super::prediction::{Prediction, Tried};
use crate::diagnosis::confidence::TRUSTED_FROM;
use crate::diagnosis::{Code, Confidence, Grade};
use crate::localize::QueryResult;
use crate::method::Method;
use crate::run::Poses;
use crate::scene::Scene;
use posescope_core::survey::Surveyed as Numbers;

/// A part of a survey.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// Photos within the radius of their reference.
    Near,
    /// The same, degraded.
    Worse,
    /// Photos far from their reference.
    Far,
    /// Mirrored photos, which no pose fits.
    Mirrored,
}

impl Part {
    /// Its name, which is that of its run folder.
    pub fn name(self) -> &'static str {
        match self {
            Self::Near => "near",
            Self::Worse => "worse",
            Self::Far => "far",
            Self::Mirrored => "mirrored",
        }
    }
}

/// A result of a survey.
pub(super) struct Answer {
    pub part: Part,
    pub method: Method,
    pub query: String,
    pub grade: Grade,
    pub error_m: Option<f64>,
    pub start_m: Option<f64>,
    /// The cause of a failure.
    pub code: Option<Code>,
    /// The stated probability of its pose, and the truth.
    pub judged: Option<Judged>,
    /// Where it was and from where it was searched.
    pub tried: Option<Tried>,
}

impl Answer {
    pub fn of(part: Part, result: QueryResult, scene: &dyn Scene) -> Self {
        // A mirrored photo shows no place, so that a pose near the truth is right by chance alone.
        let is_right = result.grade == Grade::Right && part != Part::Mirrored;
        let judged = result.confidence.as_ref().map(|confidence| Judged {
            probability: confidence.probability,
            is_right,
            over_95: confidence.within_95.zip(result.error).filter(|_| is_right).map(
                |(within, error)| [error.translation_m / within.m, error.rotation_deg / within.deg],
            ),
        });
        let grade = match (result.grade, part) {
            (Grade::Right, Part::Mirrored) => Grade::Wrong,
            (grade, _) => grade,
        };
        let pose = |frame: &str| scene.pose(scene.find(frame).ok()?);
        let tried = result.references.first().and_then(|reference| {
            let (query, reference) = (pose(&result.query)?, pose(reference)?);
            Some(Tried { query, reference, is_right: grade == Grade::Right })
        });
        Self {
            part,
            method: result.method,
            tried,
            grade,
            error_m: result.error.map(|error| error.translation_m),
            start_m: result.initial_error.map(|error| error.translation_m),
            code: result.diagnosis.first().map(|one| one.code).filter(|code| code.is_failure()),
            judged,
            query: result.query,
        }
    }
}

/// What a survey says of a method.
pub struct Surveyed {
    /// The method.
    pub method: Method,
    /// The numbers that its confidence follows from now on; `None` where it gave too few poses.
    pub numbers: Option<Numbers>,
    /// Photos near a reference, and how many of them it localised.
    pub near: (usize, usize),
    /// What became of each of them.
    pub tried: Vec<Tried>,
    judged: Vec<Judged>,
    is_paper: bool,
}

/// How well a confidence says what is true.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reliability {
    /// Poses that are right.
    pub right: usize,
    /// Those of them that are trusted.
    pub right_trusted: usize,
    /// Poses that are wrong.
    pub wrong: usize,
    /// Those of them that are trusted.
    pub wrong_trusted: usize,
}

impl Surveyed {
    pub(super) fn of(method: Method, answers: &[Answer], is_paper: bool) -> Self {
        let own = || answers.iter().filter(|answer| answer.method == method);
        let near = own().filter(|answer| answer.part == Part::Near);
        let right = near.clone().filter(|answer| answer.grade == Grade::Right).count();
        let tried = near.clone().filter_map(|answer| answer.tried).collect();
        let judged: Vec<Judged> = own().filter_map(|answer| answer.judged).collect();
        Self {
            method,
            numbers: fit::fitted(&judged, is_paper),
            near: (near.count(), right),
            tried,
            judged,
            is_paper,
        }
    }

    /// Where the method will localise photos that are searched within this radius.
    pub fn prediction(&self, radius_m: f64) -> Prediction {
        Prediction::of(&self.tried, radius_m)
    }

    /// The poses that the numbers rest on.
    pub fn poses(&self) -> Poses {
        let right = self.judged.iter().filter(|pose| pose.is_right).count();
        Poses { right, wrong: self.judged.len() - right }
    }

    /// How well confidence says what is true, without the survey.
    pub fn before(&self) -> Reliability {
        Reliability::of(self.judged.iter().map(|pose| (pose.probability, pose.is_right)))
    }

    /// The same with a survey: that of one half of the photos, judged on the other half.
    pub fn after(&self) -> Reliability {
        Reliability::of(self.by_halves().into_iter())
    }

    /// The probability of each pose by the numbers of the half that it does not belong to, and whether it is right.
    pub(super) fn by_halves(&self) -> Vec<(f64, bool)> {
        let half = |which: usize| -> Vec<Judged> {
            let all = self.judged.iter().enumerate();
            all.filter(|(at, _)| at % 2 == which).map(|(_, pose)| *pose).collect()
        };
        let (even, odd) = (half(0), half(1));
        let by = |fitted: &[Judged], judged: &[Judged]| -> Vec<(f64, bool)> {
            let numbers = fit::numbers(fitted, self.is_paper);
            let moved = judged.iter();
            moved.map(|pose| (numbers.probability(pose.probability), pose.is_right)).collect()
        };
        [by(&even, &odd), by(&odd, &even)].concat()
    }

    /// The probability of each pose as it was fitted, and whether it is right.
    pub(super) fn as_fitted(&self) -> Vec<(f64, bool)> {
        self.judged.iter().map(|pose| (pose.probability, pose.is_right)).collect()
    }
}

impl Reliability {
    fn of(poses: impl Iterator<Item = (f64, bool)>) -> Self {
        let mut found = Self::default();
        for (probability, is_right) in poses {
            let is_trusted = usize::from(Confidence::of(probability) == Confidence::Trusted);
            let (all, trusted) = if is_right {
                (&mut found.right, &mut found.right_trusted)
            } else {
                (&mut found.wrong, &mut found.wrong_trusted)
            };
            *all += 1;
            *trusted += is_trusted;
        }
        found
    }
}

/// The borders between groups of probabilities; the last but one is that of trusted poses.
pub(super) const GROUPS: [f64; 5] = [0.0, 0.5, 0.8, TRUSTED_FROM, 1.0];
