//! Localises the queries of a run.

use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::plan::Plan;
use super::protocol::Protocol;
use super::run_file::RunItem;
use super::run_folder::{FolderError, RunFolder};
use super::scene_pair::ScenePair;
use crate::estimator::Failure;
use crate::fusion::Fusion;
use crate::localize::{
    ChoiceError, LocalizeObserver, Localizer, NoObserver, QueryResult, References, Request,
    StageTimes,
};
use crate::method::Method;
use crate::scene::SceneError;
use crate::trace::Cancelled;

/// Why a run stopped.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A frame cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// References cannot be chosen.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    /// The observer cancelled the run.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The folder cannot be written.
    #[error(transparent)]
    Folder(#[from] FolderError),
}

/// A query for which a method has no pose or a wrong one.
pub struct FailedQuery<'a> {
    /// The localizer of its scenes.
    pub localizer: &'a Localizer<'a>,
    /// The query's item in the plan.
    pub item: RunItem<'a>,
    /// The query's position in its scene.
    pub frame: usize,
    /// The method.
    pub method: Method,
    /// The first of the requests that failed.
    pub request: &'a Request,
}

/// An observer of a run over many queries.
pub trait RunObserver {
    /// A query is about to be localised.
    fn begin(&mut self, _item: &RunItem<'_>) {}

    /// The observer of the next query.
    fn query_observer(&mut self) -> &mut dyn LocalizeObserver;

    /// A method failed on a query whose results are about to be written.
    ///
    /// # Errors
    /// What stops the run.
    fn failed(&mut self, _query: &FailedQuery<'_>) -> Result<(), RunError> {
        Ok(())
    }

    /// A query is done.
    fn done(&mut self, _item: &RunItem<'_>) {}
}

/// An evaluation: the queries of a plan are localised one after the other.
pub struct Evaluation<'a> {
    plan: &'a Plan,
}

impl<'a> Evaluation<'a> {
    /// Localises the remaining queries of the plan, and again those whose files could not be read, and writes their
    /// results. A query that panics, or whose files cannot be read, gets failed results, and the evaluation continues.
    ///
    /// # Errors
    /// [`RunError`]. Finished queries are in the folder. A new run that fails before its first result, as by the file of
    /// another system's poses, leaves no folder.
    pub fn run(
        plan: &'a Plan,
        folder: &mut RunFolder,
        observer: &mut dyn RunObserver,
    ) -> Result<(), RunError> {
        let ran = Self::run_remaining(plan, folder, observer);
        if matches!(&ran, Err(error) if !matches!(error, RunError::Cancelled(_))) {
            folder.discard();
        }
        ran
    }

    fn run_remaining(
        plan: &'a Plan,
        folder: &mut RunFolder,
        observer: &mut dyn RunObserver,
    ) -> Result<(), RunError> {
        let evaluation = Self { plan };
        let Plan { run, scenes, params, .. } = plan;
        let items: Vec<RunItem<'_>> = run.items().collect();
        let left = items.get(folder.done()..).unwrap_or_default();
        let again = folder.unread().iter().filter_map(|&at| Some((Some(at), *items.get(at)?)));
        let remaining: Vec<(Option<usize>, RunItem<'_>)> =
            again.chain(left.iter().map(|item| (None, *item))).collect();
        // One localizer per pair of scenes, which caches its features.
        for of_pair in remaining.chunk_by(|(_, a), (_, b)| std::ptr::eq(a.pair, b.pair)) {
            let Some((_, RunItem { pair, .. })) = of_pair.first().copied() else {
                continue;
            };
            let references = scenes.references[pair.scene_index].as_ref();
            let queries = scenes.of_queries(pair);
            let protocol = &run.protocol;
            let localizer = Localizer::new(references, queries, params, protocol.seed);
            let localizer = protocol.configured(localizer)?;
            let excluded = excluded(pair, &localizer)?;
            for (place, item) in of_pair {
                observer.begin(item);
                let results = evaluation.results(item, &localizer, &excluded, observer)?;
                match place {
                    Some(place) => folder.replace(*place, &results)?,
                    None => folder.append(&results)?,
                }
                observer.done(item);
            }
        }
        Ok(())
    }

    fn results(
        &self,
        item: &RunItem<'_>,
        localizer: &Localizer<'_>,
        excluded: &BTreeSet<usize>,
        observer: &mut dyn RunObserver,
    ) -> Result<Vec<(QueryResult, StageTimes)>, RunError> {
        let frame = localizer.queries().find(item.query)?;
        let mut results = Vec::new();
        let localized = catch_unwind(AssertUnwindSafe(|| -> Result<_, RunError> {
            let requests = self.requests(item, localizer, frame, excluded)?;
            localizer.localize(
                item.index,
                frame,
                &requests,
                &self.plan.run.protocol.methods,
                observer.query_observer(),
                |result, times| {
                    results.push((in_pair(item.pair, result), times));
                    Ok::<(), RunError>(())
                },
            )?;
            Ok(requests)
        }));
        match localized {
            Ok(Err(RunError::Scene(error) | RunError::Choice(ChoiceError::Scene(error)))) => {
                results = self.broken(item, &Failure::Unreadable { message: error.to_string() });
            }
            Ok(requests) => {
                let requests = requests?;
                // One call per method that failed in any of the requests.
                for &method in &self.plan.run.protocol.methods {
                    let mut results = results.iter().map(|(result, _)| result);
                    let request = results
                        .find(|result| result.method == method && result.is_suspect())
                        .and_then(|failed| {
                            requests.iter().find(|one| one.setting == failed.setting)
                        });
                    if let Some(request) = request {
                        let item = *item;
                        observer.failed(&FailedQuery {
                            localizer,
                            item,
                            frame,
                            method,
                            request,
                        })?;
                    }
                }
            }
            Err(panic) => {
                let message = crate::localize::words_of(panic.as_ref());
                results = self.broken(item, &Failure::Internal { message });
            }
        }
        Ok(results)
    }

    fn requests(
        &self,
        item: &RunItem<'_>,
        localizer: &Localizer<'_>,
        frame: usize,
        excluded: &BTreeSet<usize>,
    ) -> Result<Vec<Request>, RunError> {
        let (protocol, pair) = (&self.plan.run.protocol, item.pair);
        if let Some(named) = named(protocol, item, localizer, frame)? {
            let settings = self.plan.run.settings().into_iter();
            return Ok(settings.map(|setting| self.plan.run.request(setting, &named)).collect());
        }
        let index = self.plan.indices.get(pair.scene_index).map(|index| index.as_ref());
        let choose = |radius_m: f64| {
            let chooser = protocol.chooser(localizer, radius_m, index);
            chooser.choose(frame, &|frame| excluded.contains(&frame), &mut NoObserver)
        };
        let mut requests = Vec::new();
        let mut last: Option<(f64, References)> = None;
        for setting in self.plan.run.settings() {
            let radius = protocol.reach_m(setting.radius_m);
            let chosen = match last.take() {
                Some((known, chosen)) if known == radius => chosen,
                _ => choose(radius)?,
            };
            requests.push(self.plan.run.request(setting, &chosen));
            last = Some((radius, chosen));
        }
        Ok(requests)
    }

    /// The results of a query that could not be localised at all.
    fn broken(&self, item: &RunItem<'_>, failure: &Failure) -> Vec<(QueryResult, StageTimes)> {
        let pair = item.pair;
        let protocol = &self.plan.run.protocol;
        let fusions: Vec<Option<Fusion>> = match protocol.fusions.as_slice() {
            [] => vec![None],
            fusions => fusions.iter().copied().map(Some).collect(),
        };
        let mut results = Vec::new();
        for &method in &protocol.methods {
            for setting in self.plan.run.settings() {
                for &fusion in &fusions {
                    let result = QueryResult {
                        setting: Some(setting),
                        fusion,
                        ..QueryResult::new(
                            &pair.scene,
                            item.query,
                            method,
                            protocol.seed,
                            Err(failure),
                            None,
                            protocol.right,
                        )
                    };
                    results.push((in_pair(pair, result), StageTimes::default()));
                }
            }
        }
        results
    }
}

/// The references that are named for a query; `None` where they are to be chosen. No photo is its own reference.
fn named(
    protocol: &Protocol,
    item: &RunItem<'_>,
    localizer: &Localizer<'_>,
    frame: usize,
) -> Result<Option<References>, SceneError> {
    let names: Vec<&str> = match item.references {
        Some(names) => names.iter().map(String::as_str).collect(),
        None => protocol.named_references().collect(),
    };
    if item.references.is_none() && names.is_empty() {
        return Ok(None);
    }
    let mut frames = Vec::new();
    for name in names {
        let reference = localizer.references().find(name)?;
        if !(localizer.is_one_drive() && reference == frame) {
            frames.push(reference);
        }
    }
    Ok(Some(frames.into()))
}

/// The result with the scenes as the run calls them.
fn in_pair(pair: &ScenePair, result: QueryResult) -> QueryResult {
    let (scene, queries) = (pair.scene.clone(), pair.query_scene.clone());
    QueryResult { query_scene: (queries != scene).then_some(queries), scene, ..result }
}

/// Frames of the references' scene that are queries, and must not be references.
fn excluded(pair: &ScenePair, localizer: &Localizer<'_>) -> Result<BTreeSet<usize>, SceneError> {
    let drawn = if localizer.is_one_drive() { pair.drawn.as_slice() } else { &[] };
    drawn.iter().map(|name| localizer.references().find(name)).collect()
}
