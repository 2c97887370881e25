//! The verdict that a method reports itself, where it has no pose.

use super::{Code, Diagnosis};
use crate::estimator::Failure;

impl Code {
    /// The verdict that a method's own failure is.
    pub fn of(failure: &Failure) -> Self {
        match failure {
            Failure::NothingInView { .. } | Failure::NoReference { .. } => Self::R1,
            Failure::TooFewFeatures { .. } => Self::R2,
            Failure::TooFewMatches { .. }
            | Failure::NoConsensus { .. }
            | Failure::ChanceConsensus { .. } => Self::R3,
            Failure::TooFewDepths { .. } => Self::R4,
            Failure::OutsideRadius { .. } => Self::R9,
            Failure::NothingComparable { .. } | Failure::FlatCost { .. } => Self::D5,
            Failure::LedOutside { .. } => Self::D8,
            Failure::ChanceMinimum { .. } => Self::D6,
            Failure::LatticeTooLarge(_) => Self::D9,
            Failure::NoReferenceSucceeded { failure, .. } => Self::of(failure),
            Failure::NotJoint { .. } => Self::F2,
            Failure::NotAnswered { .. } => Self::E1,
            Failure::LowConfidence { .. } => Self::L1,
            Failure::Internal { .. } => Self::X9,
        }
    }
}

impl Diagnosis {
    /// What an estimator that has no pose reports.
    pub fn of_failure(failure: &Failure) -> Self {
        Self { code: Code::of(failure), text: failure.to_string(), evidence: serde_json::json!({}) }
    }
}
