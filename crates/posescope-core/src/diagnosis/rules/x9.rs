//! X9: an estimator panicked.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "a bug in posescope",
    advice: "report it with the command line that repeats it",
    needs_truth: false,
    ..Rule::new(Code::X9)
};
