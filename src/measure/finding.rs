//! A mistake of a whole scene or file.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::diagnosis::Code;
use crate::doctor::Subject;

/// A mistake of a whole scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// The verdict of the single queries.
    pub code: Code,
    /// The scene or the method with the mistake.
    pub of: String,
    /// What is wrong with it.
    pub about: Subject,
    /// The number of queries that agree; 0 if only `posescope doctor` says it.
    pub queries: usize,
    /// Whether `posescope doctor` says so.
    pub doctor: bool,
    /// The mistake in one sentence.
    pub text: String,
    /// The value that they agree on.
    pub evidence: Value,
}
