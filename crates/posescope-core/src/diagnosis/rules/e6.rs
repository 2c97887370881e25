//! E6: a method that is none, or a parameter outside its range.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "no such method, or a parameter outside its range",
    advice: "correct the name or the value",
    needs_truth: false,
    ..Rule::new(Code::E6)
};
