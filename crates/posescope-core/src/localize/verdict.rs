//! What a success is: one meaning for runs, gates, comparisons, recordings and the window.

use super::{QueryResult, Status};
use crate::geometry::PoseError;

/// What became of a query.
///
/// A failure is a self-reported one or a pose that is as far off as the failure radius or farther
/// (paper, section 4.2). A pose whose truth is not known cannot be held against anything and counts
/// as a success.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// There is no pose.
    NoPose,
    /// There is a pose, and it is as far from the truth as the failure radius or farther.
    Far,
    /// There is a pose within the failure radius.
    Near,
    /// There is a pose, and the truth is not known.
    Unmeasured,
}

impl Verdict {
    /// Judges by status and error.
    pub fn new(status: Status, error: Option<&PoseError>, failure_radius_m: f64) -> Self {
        match (status, error) {
            (Status::Failed, _) => Self::NoPose,
            (Status::Ok, None) => Self::Unmeasured,
            // An error that is no number is not near.
            (Status::Ok, Some(error)) if error.translation_m < failure_radius_m => Self::Near,
            (Status::Ok, Some(_)) => Self::Far,
        }
    }

    /// Whether the query counts as localised.
    pub fn is_success(self) -> bool {
        matches!(self, Self::Near | Self::Unmeasured)
    }

    /// In words, with the error where there is one.
    pub fn words(self, error: Option<&PoseError>) -> String {
        match (self, error) {
            (Self::NoPose, _) => "no pose".to_owned(),
            (Self::Far, Some(error)) => format!("far: {error}"),
            (Self::Near, Some(error)) => error.to_string(),
            (_, None) | (Self::Unmeasured, _) => "a pose".to_owned(),
        }
    }
}

impl QueryResult {
    /// What became of the query.
    pub fn verdict(&self, failure_radius_m: f64) -> Verdict {
        Verdict::new(self.status, self.error.as_ref(), failure_radius_m)
    }

    /// Whether there is a pose and, where the truth is known, a near one.
    pub fn is_success(&self, failure_radius_m: f64) -> bool {
        self.verdict(failure_radius_m).is_success()
    }

    /// The verdict in words: the reason of a failure, the error of a pose.
    pub fn words(&self, failure_radius_m: f64) -> String {
        match &self.reason {
            Some(reason) => format!("{} {}", reason.code, reason.text),
            None => self.verdict(failure_radius_m).words(self.error.as_ref()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(translation_m: f64) -> PoseError {
        PoseError {
            translation_m,
            rotation_deg: 0.66,
            max_euler_deg: 0.5,
        }
    }

    #[test]
    fn the_failure_radius_decides_and_an_error_that_is_no_number_fails() {
        let verdict = |metres| Verdict::new(Status::Ok, Some(&error(metres)), 20.0);
        assert_eq!(verdict(12.0), Verdict::Near);
        assert_eq!(verdict(20.0), Verdict::Far);
        assert_eq!(verdict(f64::NAN), Verdict::Far);
        assert!(Verdict::new(Status::Ok, None, 20.0).is_success());
        assert!(!Verdict::new(Status::Failed, None, 20.0).is_success());
    }

    #[test]
    fn words_name_both_measures_of_the_rotation() {
        let near = error(0.1);
        assert_eq!(
            Verdict::Near.words(Some(&near)),
            "0.100 m, 0.66° (max Euler 0.50°)"
        );
        assert!(Verdict::Far.words(Some(&near)).starts_with("far: "));
    }
}
