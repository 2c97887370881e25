//! What the window is opened on.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

use crate::estimator;
use crate::fusion;
use crate::localize::{QueryResult, References, Selection, frames_within};
use crate::method::Method;
use crate::params::Params;
use crate::scene::{FrameStore, Scene};
use crate::session::{IndexFile, Job, RunMode};

/// How the references of a query are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReferencePick {
    /// The frames that were named, for every query.
    ByHand,
    /// Anew for every query.
    By(Selection),
}

impl fmt::Display for ReferencePick {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ByHand => f.write_str("by hand"),
            Self::By(selection) => selection.fmt(f),
        }
    }
}

/// What is run, and how the window begins.
#[derive(Clone)]
pub struct Setup {
    /// The scene as it was named on the command line.
    pub scene_argument: String,
    /// Where the references are.
    pub references: Arc<dyn Scene>,
    /// The scene of the queries, if it is another one.
    pub queries_argument: Option<String>,
    /// Where the queries are; often the same scene.
    pub queries: Arc<dyn Scene>,
    /// The queries that the list offers, as positions in their scene.
    pub offered: Vec<usize>,
    /// The query to begin with.
    pub query: usize,
    /// Its references; none where they are still to be chosen.
    pub chosen: References,
    /// How the references of other queries are chosen.
    pub pick: ReferencePick,
    /// What a choice by looks asks.
    pub index: Arc<IndexFile>,
    /// The methods to run.
    pub methods: Vec<Method>,
    /// What to make of several references: nothing, or one pose by each of these.
    pub fusions: Vec<&'static fusion::Entry>,
    /// Their parameters.
    pub params: Params,
    /// How far the query may be from a reference \[m\].
    pub uncertainty_radius_m: f64,
    /// How far from the query's known position references are chosen \[m\]; without it, within the
    /// radius.
    pub prior_m: Option<f64>,
    /// The translation error from which on a pose counts as a failure \[m\].
    pub failure_radius_m: f64,
    /// Seed of every random choice.
    pub seed: u64,
    /// Breakpoints to begin with.
    pub breakpoints: Vec<String>,
    /// Whether it waits at the first step or runs.
    pub mode: RunMode,
    /// Results that are known already, by query.
    pub results: BTreeMap<usize, Vec<QueryResult>>,
    /// Where recordings, pictures and sessions are saved unless somebody names another place.
    pub folder: PathBuf,
}

impl Setup {
    pub(super) fn job(&self, frames: &Arc<FrameStore>) -> Job {
        Job {
            references: Arc::clone(&self.references),
            queries: Arc::clone(&self.queries),
            query: self.query,
            chosen: self.chosen.clone(),
            selection: match self.pick {
                ReferencePick::ByHand => None,
                ReferencePick::By(selection) => Some(selection),
            },
            index: Arc::clone(&self.index),
            methods: self.methods.clone(),
            fusions: self.fusions.clone(),
            params: self.params.clone(),
            uncertainty_radius_m: self.uncertainty_radius_m,
            prior_m: self.prior_m,
            seed: self.seed,
            frames: Arc::clone(frames),
        }
    }

    /// The methods whose cost can be looked at: those asked for that search one, those of the paper
    /// where there are none.
    pub fn direct_methods(&self) -> Vec<Method> {
        let direct = estimator::direct_methods(&self.methods);
        match direct.as_slice() {
            [] => vec![Method::PM, Method::MI],
            _ => direct,
        }
    }

    /// Goes to another query; where references are not chosen by hand, new ones are needed.
    pub(super) fn go_to(&mut self, query: usize) {
        self.query = query;
        if self.pick != ReferencePick::ByHand {
            self.chosen = References::default();
        }
    }

    /// Frames that could be references of a query: with pose and cloud, within the radius where the
    /// query's position is known.
    pub fn candidates(&self, query: usize) -> Vec<usize> {
        let (references, queries) = (self.references.as_ref(), self.queries.as_ref());
        let is_same_scene = references.name() == queries.name();
        let is_query = |frame| is_same_scene && frame == query;
        match queries.pose(query) {
            Some(place) => {
                let radius_m = self.prior_m.unwrap_or(self.uncertainty_radius_m);
                frames_within(references, &place, radius_m, &is_query)
            }
            None => (0..references.frames().len())
                .filter(|&frame| !is_query(frame) && references.has_cloud(frame))
                .filter(|&frame| references.pose(frame).is_some())
                .collect(),
        }
    }

    /// The command line that repeats this run.
    pub fn command_line(&self) -> String {
        let mut words = vec!["posescope".to_owned(), "run".to_owned()];
        words.push(self.scene_argument.clone());
        if let Some(queries) = &self.queries_argument {
            words.extend(["--queries".to_owned(), queries.clone()]);
        }
        let frame = |scene: &Arc<dyn Scene>, index: usize| scene.frames()[index].clone();
        words.extend(["--query".to_owned(), frame(&self.queries, self.query)]);
        for &reference in &self.chosen.frames {
            words.extend(["--reference".to_owned(), frame(&self.references, reference)]);
        }
        if self.methods != Method::PAPER {
            let names: Vec<_> = self.methods.iter().map(|method| method.name()).collect();
            words.extend(["--method".to_owned(), names.join(",")]);
        }
        if !self.fusions.is_empty() {
            let names: Vec<_> = self.fusions.iter().map(|fusion| fusion.name).collect();
            words.extend(["--fusion".to_owned(), names.join(",")]);
        }
        words.extend(["--radius".to_owned(), self.uncertainty_radius_m.to_string()]);
        words.extend(["--seed".to_owned(), self.seed.to_string()]);
        for change in self.params.changes() {
            words.extend(["--set".to_owned(), change]);
        }
        words
            .iter()
            .map(|word| quoted(word))
            .collect::<Vec<_>>()
            .join(" ")
    }
}

/// A word as a POSIX shell reads it back.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=+@".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn words_are_quoted_where_a_shell_would_split_them() {
        assert_eq!(quoted("street:night"), "street:night");
        assert_eq!(quoted("my data/00"), "'my data/00'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }
}
