//! Which of the known results are looked at, and what became of verdicts since other results.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

use super::memo::Memo;
use crate::diagnosis::Code;
use crate::localize::QueryResult;
use crate::measure::{Condition, ConditionError, Migration, migrations, verdict_name};
use crate::method::Method;

/// Results by query.
pub type Results = BTreeMap<usize, Vec<QueryResult>>;

/// What is known of queries before the window is opened.
#[derive(Clone, Debug, Default)]
pub struct KnownResults {
    /// The results that are shown.
    pub now: Results,
    /// Other results of the same queries, A, which those are held against.
    pub before: Option<Results>,
}

impl From<Results> for KnownResults {
    fn from(now: Results) -> Self {
        Self { now, before: None }
    }
}

/// A result by its query and its place among the query's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ResultRow {
    /// The query, by its position in its scene.
    pub query: usize,
    /// The position among the results of the query.
    pub place: usize,
}

/// What became of a method's verdicts from the results A to those of now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VerdictChange {
    /// The method.
    pub method: Method,
    /// The primary verdict before, `ok` where nothing was found.
    pub before: String,
    /// The primary verdict now.
    pub after: String,
}

impl std::fmt::Display for VerdictChange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let name = self.method.name().to_uppercase();
        write!(f, "{name} {} → {}", self.before, self.after)
    }
}

/// The known results, and those to hold them against.
#[derive(Clone, Copy)]
pub(super) struct Known<'a> {
    pub(super) now: &'a Results,
    /// The results A, if some were kept or opened.
    pub(super) before: Option<&'a Results>,
    /// Grows with every change of either.
    pub(super) version: u64,
}

/// What is asked of results to be looked at.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wanted {
    /// A condition as it was typed; none where it is empty.
    pub(super) condition: String,
    /// What became of the verdict.
    pub(super) change: Option<VerdictChange>,
    /// Whether the verdict has to be another one than before.
    pub(super) only_changed: bool,
}

/// The rows that are wanted, or what is wrong with the condition.
type Found = Result<Rc<[ResultRow]>, ConditionError>;

/// The latest answers, which hold as long as nothing changes.
#[derive(Default)]
pub(super) struct Selection {
    rows: RefCell<Memo<(u64, Wanted), Found>>,
    migrations: RefCell<Memo<u64, Rc<[Migration]>>>,
}

impl<'a> Known<'a> {
    /// The result of a row.
    pub(super) fn result(&self, row: ResultRow) -> Option<&'a QueryResult> {
        self.now.get(&row.query)?.get(row.place)
    }

    /// What the same method gave for the same query and setting before.
    fn before(&self, query: usize, now: &QueryResult) -> Option<&'a QueryResult> {
        let before = self.before?.get(&query)?;
        before.iter().find(|before| {
            before.method == now.method
                && before.fusion == now.fusion
                && before.setting == now.setting
        })
    }

    /// The same for the result of a row.
    pub(super) fn before_row(&self, row: ResultRow) -> Option<&'a QueryResult> {
        self.before(row.query, self.result(row)?)
    }

    fn rows(&self) -> impl Iterator<Item = (ResultRow, &'a QueryResult)> {
        self.now.iter().flat_map(|(&query, results)| {
            let results = results.iter().enumerate();
            results.map(move |(place, result)| (ResultRow { query, place }, result))
        })
    }

    /// The primary verdicts of a result, before and now; nothing where there was none before.
    fn verdicts(&self, query: usize, now: &QueryResult) -> Option<[Option<Code>; 2]> {
        Some([self.before(query, now)?, now].map(primary))
    }
}

fn primary(result: &QueryResult) -> Option<Code> {
    Some(result.diagnosis.first()?.code)
}

impl Wanted {
    fn find(&self, known: Known<'_>) -> Found {
        let condition: Option<Condition> = match self.condition.trim() {
            "" => None,
            typed => Some(typed.parse()?),
        };
        let is_wanted = |(row, result): &(ResultRow, &QueryResult)| {
            let mut changes = self.change.iter();
            let has_become = changes.all(|change| {
                change.method == result.method
                    && known.verdicts(row.query, result).is_some_and(|codes| {
                        codes.map(verdict_name) == [&*change.before, &*change.after]
                    })
            });
            let is_other = |[before, now]: [Option<Code>; 2]| before != now;
            has_become
                && (!self.only_changed || known.verdicts(row.query, result).is_some_and(is_other))
                && condition.as_ref().is_none_or(|condition| condition.is_met(result))
        };
        Ok(known.rows().filter(is_wanted).map(|(row, _)| row).collect())
    }
}

impl Selection {
    /// The results that are wanted, in the order of the queries.
    pub(super) fn rows(&self, known: Known<'_>, wanted: Wanted) -> Found {
        let mut rows = self.rows.borrow_mut();
        rows.get((known.version, wanted.clone()), || wanted.find(known)).clone()
    }

    /// What became of the verdicts that both have, also of those that stayed what they were.
    pub(super) fn migrations(&self, known: Known<'_>) -> Rc<[Migration]> {
        let count = || {
            let verdicts = |(row, result): (ResultRow, &QueryResult)| {
                Some((result.method, known.verdicts(row.query, result)?))
            };
            migrations(known.rows().filter_map(verdicts)).into()
        };
        Rc::clone(self.migrations.borrow_mut().get(known.version, count))
    }
}
