//! What the lines of a run folder must be about: the plan of the run says it, line by line.

use std::path::Path;

use super::FolderError;
use crate::fusion::Fusion;
use crate::localize::{QueryResult, SCHEMA, Setting};
use crate::run::{RunFile, RunItem};

/// What a line says it is about.
pub(super) struct Line<'a> {
    pub schema: Option<&'a str>,
    /// The scene of the references, and that of the queries; times do not say it.
    pub scenes: Option<[&'a str; 2]>,
    pub query: &'a str,
    pub method: &'a str,
    /// What distinguishes the results of a method for a query; times do not say it.
    pub case: Option<(Option<Setting>, Option<Fusion>)>,
}

impl<'a> Line<'a> {
    /// That of a result.
    pub fn of(result: &'a QueryResult) -> Self {
        let queries = result.query_scene.as_ref().unwrap_or(&result.scene);
        Self {
            schema: Some(&result.schema),
            scenes: Some([&result.scene, queries]),
            query: &result.query,
            method: result.method.name(),
            case: Some((result.setting, result.fusion)),
        }
    }
}

/// The lines that a run has, in their order: all of a query, and of these all of a method, one after the other.
pub(super) struct PlannedLines<'a> {
    items: Box<dyn Iterator<Item = RunItem<'a>> + 'a>,
    item: Option<RunItem<'a>>,
    methods: Vec<&'static str>,
    per_method: usize,
    /// The position of the next line among those of its query.
    at: usize,
    /// The cases of the method of the query until now.
    cases: Vec<(Option<Setting>, Option<Fusion>)>,
}

impl<'a> PlannedLines<'a> {
    /// Those of a run, or of its shard.
    pub fn of(run: &'a RunFile) -> Self {
        let methods: Vec<&str> = run.protocol.methods.iter().map(|method| method.name()).collect();
        let per_method = run.results_per_item() / methods.len().max(1);
        let mut items: Box<dyn Iterator<Item = RunItem<'a>> + 'a> = Box::new(run.items());
        let item = items.next();
        Self { items, item, methods, per_method, at: 0, cases: Vec::new() }
    }

    /// Checks the next line. The error says what was expected.
    pub fn check(&mut self, line: &Line<'_>) -> Result<(), String> {
        if line.schema.is_some_and(|schema| schema != SCHEMA) {
            return Err(format!(
                "schema {SCHEMA} expected, {} found",
                line.schema.unwrap_or_default()
            ));
        }
        let Some(item) = self.item else {
            return Err("no further line expected, the run has no more queries".to_owned());
        };
        let method =
            self.methods.get(self.at / self.per_method.max(1)).copied().unwrap_or_default();
        let scenes = [item.pair.scene.as_str(), item.pair.query_scene.as_str()];
        if line.query != item.query || line.method != method {
            let (query, found) = (item.query, line.query);
            return Err(format!(
                "query {query} with {method} expected, {found} with {} found",
                line.method
            ));
        }
        if let Some(found) = line.scenes.filter(|found| *found != scenes) {
            let [references, queries] = scenes;
            return Err(format!(
                "query {} of {queries} in {references} expected, of {} in {} found",
                item.query, found[1], found[0]
            ));
        }
        if let Some(case) = line.case {
            if self.cases.contains(&case) {
                return Err(format!(
                    "query {} with {method} once expected, the same is above",
                    item.query
                ));
            }
            self.cases.push(case);
        }
        self.at += 1;
        if self.at.is_multiple_of(self.per_method.max(1)) {
            self.cases.clear();
        }
        if self.at == self.per_method * self.methods.len() {
            self.at = 0;
            self.item = self.items.next();
        }
        Ok(())
    }

    /// Whether all lines were there.
    pub fn are_all(&self) -> bool {
        self.item.is_none()
    }
}

/// The error of a line, counted from 1, with what it costs.
pub(super) fn damaged(path: &Path, line: usize, expected: &str) -> FolderError {
    let below = posescope_core::files::lines(path).map_or(0, |lines| lines.skip(line - 1).count());
    let all = match below {
        0 | 1 => String::new(),
        count => format!(" ({count} lines)"),
    };
    let message = format!(
        "{expected}; remove this line and all below{all}, and --resume localises their queries again"
    );
    FolderError::Damaged { path: path.to_owned(), line, message }
}
