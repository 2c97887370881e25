//! What a result is worth in one word.

use std::fmt;

use super::{QueryResult, Status};
use crate::diagnosis::Tolerance;

/// What a result is worth: by the truth where that is known, by what the method itself leaves behind
/// elsewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Standing {
    /// The pose is within the tolerance of the truth.
    Right,
    /// There is a pose that can be held against nothing, and the method does not doubt it.
    Unmeasured,
    /// The truth is not known, and poses like this one are often wrong.
    LowConfidence,
    /// The pose is not within the tolerance of the truth.
    Wrong,
    /// There is no pose.
    NoPose,
}

impl Standing {
    /// All of them, from the best.
    pub const ALL: [Self; 5] = [
        Self::Right,
        Self::Unmeasured,
        Self::LowConfidence,
        Self::Wrong,
        Self::NoPose,
    ];

    /// The standing in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Unmeasured => "a pose",
            Self::LowConfidence => "low confidence",
            Self::Wrong => "wrong",
            Self::NoPose => "no pose",
        }
    }

    /// A shape of its own, for those who do not see its colour.
    pub fn mark(self) -> &'static str {
        match self {
            Self::Right => "●",
            Self::Unmeasured => "○",
            Self::LowConfidence => "◆",
            Self::Wrong => "▲",
            Self::NoPose => "×",
        }
    }
}

impl fmt::Display for Standing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words())
    }
}

impl QueryResult {
    /// What the result is worth. Where the truth may not be told, its error counts for nothing.
    pub fn standing(&self, right: Tolerance, truth_is_told: bool) -> Standing {
        let is_doubted = self.trust.as_ref().is_some_and(|trust| trust.is_low());
        match (&self.error, self.status) {
            (_, Status::Failed) => Standing::NoPose,
            (Some(error), Status::Ok) if truth_is_told => match right.contains(error) {
                true => Standing::Right,
                false => Standing::Wrong,
            },
            (_, Status::Ok) if is_doubted => Standing::LowConfidence,
            (_, Status::Ok) => Standing::Unmeasured,
        }
    }
}
