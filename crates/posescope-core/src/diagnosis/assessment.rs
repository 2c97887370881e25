//! What a result is worth.

use super::rules::GIVEN_MATCHES;
use super::{Diagnosis, Family, PoseConfidence, Subject, Tolerance, confidence, diagnose};
use crate::geometry::PoseError;
use crate::method::Method;
use crate::text::words;

/// What a result is worth, by the truth where that is known; from the best.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Grade {
    /// The pose is within the tolerance of the truth.
    Right,
    /// There is a pose, and the truth is not known.
    Unmeasured,
    /// The pose is not within the tolerance of the truth.
    Wrong,
    /// There is no pose.
    NoPose,
}

impl Grade {
    /// The grade of a result with or without a pose, whose error is known or not. An error that is no number
    /// is not within any tolerance.
    pub fn of(has_pose: bool, error: Option<&PoseError>, right: Tolerance) -> Self {
        match (has_pose, error) {
            (false, _) => Self::NoPose,
            (true, None) => Self::Unmeasured,
            (true, Some(error)) if right.contains(error) => Self::Right,
            (true, Some(_)) => Self::Wrong,
        }
    }

    /// The grade with the error, where there is one.
    pub fn words(self, error: Option<&PoseError>) -> String {
        match error {
            Some(error) if self != Self::NoPose => format!("{self}: {error}"),
            _ => self.to_string(),
        }
    }

    /// Whether the query was not localised: the pose is wrong or missing.
    pub fn is_failure(self) -> bool {
        matches!(self, Self::Wrong | Self::NoPose)
    }

    /// The glyph, the same everywhere: a shape of its own, for those who do not see its colour.
    pub fn glyph(self) -> &'static str {
        match self {
            Self::Right => "●",
            Self::Wrong => "▲",
            Self::NoPose => "×",
            Self::Unmeasured => "○",
        }
    }
}

words!(Grade, "grade": Right = "right", Unmeasured = "unmeasured", Wrong = "wrong", NoPose = "no pose");

/// What a result is worth, and why: made once, and used by all that show it.
#[derive(Clone, Debug, PartialEq)]
pub struct Assessment {
    /// By the truth.
    pub grade: Grade,
    /// By what the method itself leaves behind; `None` where it cannot be known.
    pub confidence: Option<PoseConfidence>,
    /// Why the pose is wrong, missing or uncertain, the primary verdict first.
    pub verdicts: Vec<Diagnosis>,
}

impl Assessment {
    /// Assesses one method's outcome.
    pub fn of(subject: &Subject<'_>) -> Self {
        Self {
            grade: subject.grade(),
            confidence: subject.confidence.clone(),
            verdicts: with_origin(diagnose(subject), subject),
        }
    }
}

/// Verdicts on features, with the origin of the matches in their evidence if another system gave them.
fn with_origin(mut verdicts: Vec<Diagnosis>, subject: &Subject<'_>) -> Vec<Diagnosis> {
    let is_of_features = |found: &Diagnosis| found.code.rule().applies_to == Family::MATCHING;
    let is_fb = confidence::responsible(subject.method, subject.outcome) == Method::FB;
    if subject.problem.matches().is_some() && is_fb {
        for found in verdicts.iter_mut().filter(|found| is_of_features(found)) {
            if let Some(evidence) = found.evidence.as_object_mut() {
                evidence.insert(GIVEN_MATCHES.to_owned(), true.into());
            }
        }
    }
    verdicts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tolerance_decides_and_an_error_that_is_no_number_is_wrong() {
        let right = Tolerance::default();
        let grade = |translation_m, rotation_deg| {
            let error = PoseError { translation_m, rotation_deg, max_euler_deg: rotation_deg };
            Grade::of(true, Some(&error), right)
        };
        assert_eq!(grade(1.0, 5.0), Grade::Right);
        assert_eq!(grade(1.01, 0.0), Grade::Wrong);
        assert_eq!(grade(0.0, 5.01), Grade::Wrong);
        assert_eq!(grade(f64::NAN, 0.0), Grade::Wrong);
        assert_eq!(Grade::of(true, None, right), Grade::Unmeasured);
        assert_eq!(Grade::of(false, None, right), Grade::NoPose);
        for grade in Grade::ALL {
            assert_eq!(grade.word().parse(), Ok(grade));
        }
    }
}
