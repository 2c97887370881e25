//! Which of the known results are looked at, and what became of verdicts since other results.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::Deref;
use std::rc::Rc;

use super::memo::Memo;
use crate::localize::QueryResult;
use crate::measure::{
    Condition, ConditionError, Finding, Migration, Order, Overview, migrations, select,
    verdict_name,
};

/// Results by query.
pub type Results = BTreeMap<usize, Vec<QueryResult>>;

/// What is known of queries before the window is opened.
#[derive(Clone, Debug, Default)]
pub struct KnownResults {
    /// The results that are shown.
    pub now: Results,
    /// Other results of the same queries, A, which those are held against.
    pub before: Option<Results>,
    /// What `posescope doctor` says of scenes whose queries fail often.
    pub examined: Vec<Finding>,
}

impl From<Results> for KnownResults {
    fn from(now: Results) -> Self {
        Self { now, ..Self::default() }
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

/// What is asked of results to be looked at.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wanted {
    /// A condition as it was typed; none where it is empty.
    pub(super) condition: String,
    /// What became of the verdict.
    pub(super) change: Option<Migration>,
    /// Whether the verdict has to be another one than before.
    pub(super) only_changed: bool,
}

/// The rows that are wanted, or what is wrong with the condition.
type Found = Result<Rc<[ResultRow]>, ConditionError>;

/// The results of the queries that were run, those that they are compared with, and the latest selections of them, which
/// hold as long as nothing changes.
#[derive(Default)]
pub struct BatchResults {
    now: Results,
    /// The results A, if some were kept or opened.
    before: Option<Results>,
    /// What `posescope doctor` says of the scenes.
    pub(super) examined: Vec<Finding>,
    /// Grows with every change.
    version: u64,
    rows: RefCell<Memo<(u64, Wanted), Found>>,
    migrations: RefCell<Memo<u64, Rc<[Migration]>>>,
    overview: RefCell<Memo<(u64, bool), Rc<Overview>>>,
}

impl Deref for BatchResults {
    type Target = Results;

    fn deref(&self) -> &Results {
        &self.now
    }
}

impl BatchResults {
    /// Takes over other results.
    pub(super) fn set(&mut self, now: Results) {
        self.now = now;
        self.version += 1;
    }

    /// Takes over what the results are compared with; without any, nothing.
    pub(super) fn set_before(&mut self, before: Option<Results>) {
        self.before = before;
        self.version += 1;
    }

    /// Takes over the results of a query.
    pub(super) fn insert(&mut self, query: usize, results: Vec<QueryResult>) {
        self.now.insert(query, results);
        self.version += 1;
    }

    /// Grows with every change.
    pub(super) fn version(&self) -> u64 {
        self.version
    }

    /// Whether there are results A.
    pub(super) fn has_before(&self) -> bool {
        self.before.is_some()
    }

    /// The result of a row.
    pub(super) fn result(&self, row: ResultRow) -> Option<&QueryResult> {
        self.now.get(&row.query)?.get(row.place)
    }

    /// Some rows in an order.
    pub(super) fn sorted(&self, rows: &[ResultRow], order: Option<Order>) -> Vec<ResultRow> {
        let known: Vec<&QueryResult> = rows.iter().filter_map(|row| self.result(*row)).collect();
        select(&known, None, order).into_iter().map(|index| rows[index]).collect()
    }

    /// What the same method gave for the same query and setting before.
    fn before(&self, query: usize, now: &QueryResult) -> Option<&QueryResult> {
        let before = self.before.as_ref()?.get(&query)?;
        before.iter().find(|before| {
            before.method == now.method
                && before.fusion == now.fusion
                && before.setting == now.setting
        })
    }

    /// The same for the result of a row.
    pub(super) fn before_row(&self, row: ResultRow) -> Option<&QueryResult> {
        self.before(row.query, self.result(row)?)
    }

    fn all(&self) -> impl Iterator<Item = (ResultRow, &QueryResult)> {
        self.now.iter().flat_map(|(&query, results)| {
            let results = results.iter().enumerate();
            results.map(move |(place, result)| (ResultRow { query, place }, result))
        })
    }

    /// The primary verdicts of a result, before and now; nothing where there was none before.
    fn verdicts(&self, query: usize, now: &QueryResult) -> Option<[&'static str; 2]> {
        Some([self.before(query, now)?, now].map(verdict_name))
    }

    /// The results that are wanted, in the order of the queries.
    pub(super) fn select(&self, wanted: Wanted) -> Found {
        let mut rows = self.rows.borrow_mut();
        rows.get((self.version, wanted.clone()), || wanted.find(self)).clone()
    }

    /// What all results came to, with what the truth says of them or without.
    pub(super) fn overview(&self, shows_truth: bool) -> Rc<Overview> {
        let make = || {
            let shown: Vec<_> = self.all().map(|(_, result)| result.shown(shows_truth)).collect();
            Rc::new(Overview::of(&shown.iter().collect::<Vec<_>>(), &self.examined))
        };
        Rc::clone(self.overview.borrow_mut().get((self.version, shows_truth), make))
    }

    /// What became of the verdicts since the results A, also of those that stayed what they were.
    pub(super) fn migrations(&self) -> Rc<[Migration]> {
        let count = || {
            let verdicts = |(row, result): (ResultRow, &QueryResult)| {
                Some((result.method, self.verdicts(row.query, result)?))
            };
            migrations(self.all().filter_map(verdicts)).into()
        };
        Rc::clone(self.migrations.borrow_mut().get(self.version, count))
    }
}

impl Wanted {
    fn find(&self, known: &BatchResults) -> Found {
        let condition: Option<Condition> = match self.condition.trim() {
            "" => None,
            typed => Some(typed.parse()?),
        };
        let is_wanted = |(row, result): &(ResultRow, &QueryResult)| {
            let mut changes = self.change.iter();
            let has_become = changes.all(|change| {
                change.method == result.method
                    && known
                        .verdicts(row.query, result)
                        .is_some_and(|names| names == [&*change.before, &*change.after])
            });
            let is_other = |[before, now]: [&str; 2]| before != now;
            has_become
                && (!self.only_changed || known.verdicts(row.query, result).is_some_and(is_other))
                && condition.as_ref().is_none_or(|condition| condition.is_met(result))
        };
        Ok(known.all().filter(is_wanted).map(|(row, _)| row).collect())
    }
}
