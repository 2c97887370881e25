//! I1: a file of the query or of its references cannot be read.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "a file of this query cannot be read",
    advice: "replace the file that it names, then continue with eval --resume",
    needs_truth: false,
    ..Rule::new(Code::I1)
};
