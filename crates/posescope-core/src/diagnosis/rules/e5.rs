//! E5: the poses of another system are off in one way. It is of a whole file, and no single query has it.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "the poses of another system are off in one way",
    advice: "mend the file of poses as the finding says",
    needs_truth: false,
    ..Rule::new(Code::E5)
};
