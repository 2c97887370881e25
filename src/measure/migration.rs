//! Changes of primary verdicts between two runs.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use crate::diagnosis::Code;
use crate::method::Method;

/// The name for results without a verdict.
const NOTHING_FOUND: &str = "ok";

/// The number of a method's results that changed from one primary verdict to another, or kept it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Migration {
    /// The method.
    pub method: Method,
    /// The code in the first run, `ok` without a verdict.
    pub before: String,
    /// The code in the second run.
    pub after: String,
    /// The number of results.
    pub count: usize,
}

impl Migration {
    /// Whether the verdict changed.
    pub fn is_change(&self) -> bool {
        self.before != self.after
    }
}

/// The name of a primary verdict: its code, or `ok` without one.
pub fn verdict_name(primary: Option<Code>) -> &'static str {
    primary.map_or(NOTHING_FOUND, Code::name)
}

/// Counts the changes of common results by method and primary verdicts, the most frequent first.
pub fn migrations(common: impl IntoIterator<Item = (Method, [Option<Code>; 2])>) -> Vec<Migration> {
    let mut counts: BTreeMap<(Method, &str, &str), usize> = BTreeMap::new();
    for (method, [before, after]) in common {
        let key = (method, verdict_name(before), verdict_name(after));
        *counts.entry(key).or_default() += 1;
    }
    let counts = counts.into_iter();
    let mut migrations: Vec<Migration> = counts
        .map(|((method, before, after), count)| Migration {
            method,
            before: before.to_owned(),
            after: after.to_owned(),
            count,
        })
        .collect();
    migrations.sort_by_key(|migration| Reverse(migration.count));
    migrations
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stayed_is_counted_beside_what_changed() {
        let (d2, d3) = (Some(Code::D2), Some(Code::D3));
        let common = [
            (Method::MI, [None, None]),
            (Method::MI, [None, d2]),
            (Method::MI, [None, d2]),
            (Method::FB, [d3, d3]),
        ];
        let told: Vec<_> = migrations(common)
            .into_iter()
            .map(|one| {
                let is_change = one.is_change();
                (one.method, one.before, one.after, one.count, is_change)
            })
            .collect();
        let expected = [
            (Method::MI, "ok", "D2", 2, true),
            (Method::FB, "D3", "D3", 1, false),
            (Method::MI, "ok", "ok", 1, false),
        ];
        let expected = expected.map(|(method, before, after, count, is_change)| {
            (method, before.to_owned(), after.to_owned(), count, is_change)
        });
        assert_eq!(told, expected);
    }
}
