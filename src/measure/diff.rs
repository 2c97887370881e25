//! Compares two runs, query by query.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::fmt;

use super::metrics::Group;
use crate::diagnosis::{Grade, Tolerance};
use crate::localize::QueryResult;
use crate::method::Method;
use crate::table::Table;

/// What happened to a query from one run to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    /// It became a failure: a regression.
    Broken,
    /// It is no longer a failure.
    Fixed,
    /// It fails in neither run, and its error grew by more than the tolerance.
    Worse,
    /// It fails in neither run, and its error shrank by more than the tolerance.
    Better,
}

impl Change {
    /// The change in one word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Broken => "broken",
            Self::Fixed => "fixed",
            Self::Worse => "worse",
            Self::Better => "better",
        }
    }
}

/// A query and method with different results in two runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// What happened to the query.
    pub change: Change,
    /// The result in the first run.
    pub before: QueryResult,
    /// The result in the second run.
    pub after: QueryResult,
}

/// All differences of two runs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunComparison {
    /// By change, then in the order of the first run.
    pub differences: Vec<Difference>,
    /// The changes of primary verdicts, the most frequent first.
    pub migrations: Vec<Migration>,
    /// The number of results in both runs.
    pub common: usize,
    /// The number of results only in the first run.
    pub only_before: usize,
    /// The number of results only in the second run.
    pub only_after: usize,
}

impl RunComparison {
    /// The default tolerance: smaller changes of a pose's error are ignored.
    pub const TOLERANCE: Tolerance = Tolerance { translation_m: 0.1, rotation_deg: 0.5 };

    /// Compares two runs. Changes of an error up to the tolerance are ignored.
    pub fn of(before: &[QueryResult], after: &[QueryResult], tolerance: &Tolerance) -> Self {
        let mut others: BTreeMap<String, &QueryResult> =
            after.iter().map(|row| (Self::key(row), row)).collect();
        let mut comparison = Self::default();
        let mut pairs = Vec::new();
        for row in before {
            let Some(other) = others.remove(&Self::key(row)) else {
                comparison.only_before += 1;
                continue;
            };
            comparison.common += 1;
            pairs.push((row.method, [row, other].map(verdict_name)));
            if let Some(change) = change(row, other, tolerance) {
                let (before, after) = (row.clone(), other.clone());
                comparison.differences.push(Difference { change, before, after });
            }
        }
        comparison.only_after = others.len();
        comparison.migrations = migrations(pairs);
        comparison.migrations.retain(Migration::is_change);
        comparison.differences.sort_by_key(|one| one.change);
        comparison
    }

    /// What a result has in common with that of another run, and with no other of its own.
    pub fn key(row: &QueryResult) -> String {
        format!("{:?}/{}/{}", Group::of(row), row.query, row.method)
    }

    /// The number of queries with this change.
    pub fn count(&self, change: Change) -> usize {
        let changes = self.differences.iter();
        changes.filter(|one| one.change == change).count()
    }

    /// A sentence with the numbers of changed results and verdicts.
    pub fn summary(&self) -> String {
        let counts = [Change::Broken, Change::Fixed, Change::Worse, Change::Better];
        let counts = counts.map(|change| format!("{} {}", self.count(change), change.name()));
        let mut text = format!("{}, of {} results in both runs", counts.join(", "), self.common);
        if self.only_before + self.only_after > 0 {
            text += &format!(
                " ({} only in the first, {} only in the second)",
                self.only_before, self.only_after
            );
        }
        let moved = self
            .migrations
            .iter()
            .map(|one| format!("{} {} → {} {}", one.method, one.before, one.after, one.count));
        let moved: Vec<String> = moved.collect();
        if !moved.is_empty() {
            text += &format!(". Verdicts: {}", moved.join(", "));
        }
        text
    }

    /// The results that changed.
    pub fn table(&self) -> Table {
        let header = ["change", "query", "method", "before", "after", "where"];
        let mut table = Table::with_notes(header, &[3, 4], 0);
        table.name = "Changed results".to_owned();
        for one in &self.differences {
            table.push([
                one.change.name().to_owned(),
                one.before.query.clone(),
                one.before.method.to_string(),
                one.before.grade.words(one.before.error.as_ref()),
                one.after.grade.words(one.after.error.as_ref()),
                Group::of(&one.before).to_string(),
            ]);
        }
        table
    }

    /// Whether a query is broken.
    pub fn is_regression(&self) -> bool {
        self.count(Change::Broken) > 0
    }
}

/// The primary verdict of a result.
fn change(before: &QueryResult, after: &QueryResult, tolerance: &Tolerance) -> Option<Change> {
    match (before.grade.is_failure(), after.grade.is_failure()) {
        (false, true) => return Some(Change::Broken),
        (true, false) => return Some(Change::Fixed),
        (true, true) => return None,
        (false, false) => {}
    }
    let (before, after) = (before.error?, after.error?);
    let metres = after.translation_m - before.translation_m;
    let degrees = after.rotation_deg - before.rotation_deg;
    // If one error grows and the other shrinks, the result is worse.
    if metres > tolerance.translation_m || degrees > tolerance.rotation_deg {
        Some(Change::Worse)
    } else if metres < -tolerance.translation_m || degrees < -tolerance.rotation_deg {
        Some(Change::Better)
    } else {
        None
    }
}

/// The name for right results without a verdict.
pub const NOTHING_FOUND: &str = "ok";

/// The number of a method's results that changed from one primary verdict to another, or kept it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Migration {
    /// The method.
    pub method: Method,
    /// The name of the verdict in the first run.
    pub before: String,
    /// The name in the second run.
    pub after: String,
    /// The number of results.
    pub count: usize,
}

impl Migration {
    /// Whether the verdict changed.
    pub fn is_change(&self) -> bool {
        self.before != self.after
    }

    /// Whether another one counts the same change.
    pub fn is_like(&self, other: &Self) -> bool {
        (self.method, &self.before, &self.after) == (other.method, &other.before, &other.after)
    }
}

/// `MI D2 → ok`.
impl fmt::Display for Migration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} → {}", self.method.label(), self.before, self.after)
    }
}

/// The name of a primary verdict: its code. Without one a right result is `ok`, and a pose that nobody measured is not.
pub fn verdict_name(result: &QueryResult) -> &'static str {
    match (result.diagnosis.first(), result.grade) {
        (Some(primary), _) => primary.code.name(),
        (None, Grade::Right) => NOTHING_FOUND,
        (None, grade) => grade.word(),
    }
}

/// Counts the changes of common results by method and primary verdicts, the most frequent first.
pub fn migrations(common: impl IntoIterator<Item = (Method, [&'static str; 2])>) -> Vec<Migration> {
    let mut counts: BTreeMap<(Method, &str, &str), usize> = BTreeMap::new();
    for (method, [before, after]) in common {
        let key = (method, before, after);
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
    use super::super::metrics::tests::{finding, row, rows};
    use super::*;
    use crate::diagnosis::Code;

    fn compare(before: &[QueryResult], after: &[QueryResult]) -> RunComparison {
        RunComparison::of(before, after, &RunComparison::TOLERANCE)
    }

    #[test]
    fn equal_runs_do_not_differ() {
        let comparison = compare(&rows(), &rows());
        assert_eq!(comparison.differences, []);
        assert_eq!(comparison.common, 8);
        assert!(!comparison.is_regression());
    }

    #[test]
    fn verdicts_that_became_others_are_counted_by_method() {
        let with = |query: &str, method: &str, code: Option<&str>| {
            let mut row = row(query, method, Some(0.1));
            let code = code.map(|code| code.parse().expect("a code"));
            row.diagnosis = code.map(finding).into_iter().collect();
            row
        };
        let before = [
            with("a", "mi", Some("D3")),
            with("b", "mi", Some("D3")),
            with("c", "mi", None),
            with("d", "fb", Some("R3")),
        ];
        let after = [
            with("a", "mi", None),
            with("b", "mi", None),
            with("c", "mi", Some("D2")),
            with("d", "fb", Some("R3")),
        ];
        let told: Vec<String> = compare(&before, &after)
            .migrations
            .iter()
            .map(|one| format!("{} {} {} {}", one.method, one.before, one.after, one.count))
            .collect();
        assert_eq!(told, ["mi D3 ok 2", "mi ok D2 1"]);
    }

    #[test]
    fn fixed_broken_and_changed_queries_are_told_apart() {
        let before = [
            row("a", "fb", Some(0.1)),
            row("b", "fb", None),
            row("c", "fb", Some(1.0)),
            row("d", "fb", Some(1.0)),
            row("e", "fb", Some(1.0)),
            row("f", "fb", Some(11.0)),
            row("gone", "fb", None),
        ];
        let after = [
            row("a", "fb", Some(12.0)),
            row("b", "fb", Some(0.3)),
            row("c", "fb", Some(1.2)),
            row("d", "fb", Some(0.5)),
            row("e", "fb", Some(1.05)),
            row("f", "fb", None),
            row("new", "fb", None),
            row("newer", "fb", None),
        ];
        let comparison = compare(&before, &after);
        let changes: Vec<_> = comparison
            .differences
            .iter()
            .map(|one| (one.change, one.before.query.as_str()))
            .collect();
        let expected = [
            (Change::Broken, "a"),
            (Change::Fixed, "b"),
            (Change::Worse, "c"),
            (Change::Better, "d"),
        ];
        assert_eq!(changes, expected);
        let counts = (comparison.common, comparison.only_before, comparison.only_after);
        assert_eq!(counts, (6, 1, 2));
        assert!(comparison.is_regression());
    }

    #[test]
    fn a_pose_that_nobody_measured_is_not_ok() {
        let named = |grade: &str, code: Option<Code>| {
            let mut result = row("a", "mi", Some(0.1));
            result.grade = grade.parse().expect("a grade");
            result.diagnosis = code.map(finding).into_iter().collect();
            verdict_name(&result)
        };
        assert_eq!(named("right", None), "ok");
        assert_eq!(named("right", Some(Code::L1)), "L1");
        assert_eq!(named("unmeasured", None), "unmeasured");
        assert_eq!(named("unmeasured", Some(Code::E3)), "E3");
    }

    #[test]
    fn what_stayed_is_counted_beside_what_changed() {
        let common = [
            (Method::MI, ["ok", "ok"]),
            (Method::MI, ["ok", "D2"]),
            (Method::MI, ["ok", "D2"]),
            (Method::FB, ["D3", "D3"]),
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
