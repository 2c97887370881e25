//! E1: another system has no answer for this query.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "another system gave no answer",
    advice: "check the names in its file",
    needs_truth: false,
    ..Rule::new(Code::E1)
};
