//! A recording in progress: converts the events of a run to rows of entities.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use image::DynamicImage;
use rerun::{StateChange, TextDocument, TextLog, TextLogLevel, ViewCoordinates};

use super::blueprint::{Focus, is_wrong};
use super::direct::DirectContext;
use super::encode::jpeg;
use super::feature::FeatureContext;
use super::scene::{self, EventContext, Origin, PlacedCamera};
use super::stream::{Now, Stream};
use super::{Identity, RecordError, Targets, blueprint, entities, fusion, report, retrieval};
use crate::event::{Event, ReferencesFused, ReferencesRanked, Stage};
use crate::geometry::Pose;
use crate::localize::{PoseReport, QueryResult};
use crate::method::Method;
use crate::narration;
use crate::opinion::BetterPose;
use crate::palette;
use crate::params::Params;
use crate::problem::{Problem, ReferenceTuple};
use crate::proof::{self, ProofCase, ProofPicture};
use crate::render::{ColoredCloud, color_cloud};
use crate::trace::Record;

/// Width of a proof \[px\].
const PROOF_WIDTH: u32 = 1280;

/// A recording of runs, one query after the other.
///
/// A failing recording does not fail the run: it keeps its first error, ignores further events and reports the
/// error when it is closed.
pub(super) struct Recording {
    stream: Stream,
    identity: Identity,
    params: Params,
    methods: Vec<Method>,
    /// The place drawn at (0, 0, 0), from the first query for the whole recording.
    origin: Option<Origin>,
    /// What the layout that was sent last shows first.
    focus: Option<Focus>,
    /// Whether there are pages of a lesson.
    pub(super) has_pages: bool,
    /// When pages were turned whose words are not known yet.
    turned: Vec<Now>,
    query: CurrentQuery,
    /// The number of each estimator's hypotheses in earlier runs.
    evals: BTreeMap<Method, i64>,
}

/// The state of the current query.
#[derive(Default)]
struct CurrentQuery {
    problems: Vec<Problem>,
    truth: Option<Pose>,
    results: Vec<QueryResult>,
    reference: usize,
    method: Option<Method>,
    /// References whose cloud is recorded.
    clouds: BTreeSet<usize>,
    /// References whose photo is recorded below the query.
    matched: BTreeSet<usize>,
    stages: Vec<Stage>,
    /// The estimators whose stages are open, outermost first.
    estimators: Vec<ActiveEstimator>,
    /// The tables of the fusions so far, as Markdown.
    fusions: String,
    /// The records for proofs, by reference and estimator.
    records: BTreeMap<(usize, Method), Vec<Record>>,
    /// Methods with a proof.
    proven: Vec<Method>,
    /// The number of ranked frames with a picture.
    ranked: usize,
}

/// A running estimator.
#[derive(Default)]
struct ActiveEstimator {
    hypotheses: i64,
    feature: FeatureContext,
    direct: DirectContext,
}

impl Recording {
    /// Opens the targets of a run with these methods.
    ///
    /// # Errors
    /// [`RecordError`] names the target that cannot be opened.
    pub(super) fn open(
        targets: &Targets,
        identity: &Identity,
        methods: &[Method],
    ) -> Result<Self, RecordError> {
        let mut params = Params::default();
        // The report mentions an unreadable configuration.
        let _ = params.merge_toml(&identity.configuration);
        Ok(Self {
            stream: Stream::open(targets, identity)?,
            params,
            identity: identity.clone(),
            methods: methods.to_vec(),
            origin: None,
            focus: None,
            has_pages: false,
            turned: Vec::new(),
            query: CurrentQuery::default(),
            evals: BTreeMap::new(),
        })
    }

    /// Whether the recording has failed.
    pub(super) fn is_broken(&self) -> bool {
        self.stream.is_broken()
    }

    /// Turns to the next page of a lesson, whose words are known later.
    pub(super) fn turn_page(&mut self) {
        self.stream.advance();
        self.turned.push(self.stream.now());
    }

    /// Shows pages of a lesson, as Markdown, each where it was turned to.
    pub(super) fn show_pages(&mut self, pages: Vec<String>) {
        for (time, page) in self.turned.drain(..).zip(pages) {
            let page = TextDocument::from_markdown(page);
            self.stream.log_at(time, entities::LESSON, &page);
        }
    }

    /// Completes the recording.
    ///
    /// # Errors
    /// The first error of the whole run.
    pub(super) fn close(mut self) -> Result<(), RecordError> {
        self.lay_out_story();
        self.stream.close()
    }

    /// Records what the whole recording shares, from its first problem.
    fn set_up(&mut self, first: &Problem) -> Origin {
        let reference = first.reference().world_from_camera();
        let origin = Origin(reference.translation.vector);
        self.origin = Some(origin);
        self.stream.log_static(entities::WORLD, &ViewCoordinates::RDF());
        blueprint::log_styles(&mut self.stream, &self.methods, &self.params);
        origin
    }

    /// Sends the first layout, once it is known whether the references were ranked.
    fn lay_out(&mut self) {
        if self.focus.is_none() {
            self.send_layout();
        }
    }

    /// Sends the layout again, where the failures that are known now change it.
    fn lay_out_story(&mut self) {
        // The layout of a lesson stays as it is.
        if !self.query.results.is_empty() && !self.stream.is_broken() && !self.has_pages {
            self.send_layout();
        }
    }

    fn send_layout(&mut self) {
        let CurrentQuery { problems, truth, results, proven, .. } = &self.query;
        let Some(first) = problems.first() else {
            return;
        };
        let focus = Focus::of(first, truth.as_ref(), results, proven);
        if self.focus.as_ref() == Some(&focus) {
            return;
        }
        let input = blueprint::LayoutInput {
            methods: &self.methods,
            params: &self.params,
            first,
            references: problems.len(),
            ranked: self.query.ranked,
            focus: &focus,
            has_pages: self.has_pages,
        };
        blueprint::send(&mut self.stream, &input);
        self.focus = Some(focus);
    }

    /// Records the picture that proves a failure, once per method.
    fn prove(&mut self, result: &QueryResult) {
        let query = &self.query;
        let problem = match result.fusion {
            Some(_) => proof::problem_of(result, &query.problems),
            None => query.problem(),
        };
        let (Some(problem), Some(estimator)) = (problem, proof::responsible(result)) else {
            return;
        };
        if !is_wrong(result) || query.proven.contains(&result.method) {
            return;
        }
        let methods = blueprint::recorded_with(estimator).into_iter();
        let records = methods.filter_map(|method| query.records.get(&(query.reference, method)));
        let case = ProofCase {
            problem,
            records: &records.flatten().cloned().collect::<Vec<_>>(),
            result,
            truth: query.truth.as_ref(),
            params: &self.params,
        };
        if let Some(picture) = ProofPicture::of(&case) {
            let path = entities::proof(result.method);
            let raster = DynamicImage::ImageRgb8(picture.raster(PROOF_WIDTH, &result.headline()));
            self.stream.log_image(&path, jpeg(&raster));
            self.query.proven.push(result.method);
        }
    }

    /// Clears all entities of the previous query.
    fn wipe(&mut self) {
        for path in entities::of_a_query() {
            self.stream.log(path, &rerun::Clear::recursive());
        }
    }

    fn estimate(&mut self, result: &QueryResult) {
        let (Some(method), Some(problem), Some(origin)) =
            (self.query.method, self.query.problem(), self.origin)
        else {
            return;
        };
        let owner = entities::estimate(method);
        match result.pose.as_ref().and_then(PoseReport::to_pose) {
            Some(pose) => {
                let camera = PlacedCamera {
                    owner: &owner,
                    world_from_camera: &pose,
                    intrinsics: problem.query().intrinsics(),
                    color: palette::ESTIMATE,
                    label: method.name().to_owned(),
                };
                camera.log(&mut self.stream, origin);
                if let Some(opinion) = &result.opinion {
                    let owner = entities::better(method);
                    match opinion.better.as_ref().and_then(BetterPose::to_pose) {
                        Some(better) => PlacedCamera {
                            owner: &owner,
                            world_from_camera: &better,
                            color: palette::TRUTH,
                            label: "where the photos agree".to_owned(),
                            ..camera
                        }
                        .log(&mut self.stream, origin),
                        None => self.stream.log(&owner, &rerun::Clear::recursive()),
                    }
                }
                let path = entities::interval(method);
                match result.confidence.as_ref().and_then(|one| one.covariance) {
                    Some(covariance) => {
                        scene::log_interval(&mut self.stream, &path, &pose, &covariance, origin);
                    }
                    None => self.stream.log(&path, &rerun::Clear::flat()),
                }
            }
            // The estimate of an earlier query must not stay visible.
            None => self.stream.log(&owner, &rerun::Clear::recursive()),
        }
    }

    fn result_in_words(&mut self, result: &QueryResult) {
        let outcome = result.words();
        let level = if result.is_suspect() { TextLogLevel::WARN } else { TextLogLevel::INFO };
        self.say(&format!("{} result: {outcome}", result.method), level);
    }

    fn report(&mut self) {
        let Some(origin) = self.origin else { return };
        let CurrentQuery { problems, results, .. } = &self.query;
        // Not on the timeline `lockstep`: the report would show results too early there.
        self.stream.set_lockstep(None);
        let unit = self.params.scale.unit();
        let text = report::markdown(problems, results, &self.identity, origin, unit);
        self.stream.log(entities::REPORT, &TextDocument::from_markdown(text));
    }

    fn say(&mut self, words: &str, level: &str) {
        let words = self.params.scale.unit().words(words);
        self.stream.log(entities::LOG, &TextLog::new(words).with_level(level));
    }

    fn stage_started(&mut self, stage: Stage) {
        if matches!(stage, Stage::Estimator(_)) {
            self.query.estimators.push(ActiveEstimator::default());
        }
        self.query.stages.push(stage);
        self.stream.advance();
        self.show_stage();
    }

    fn stage_ended(&mut self, stage: Stage, succeeded: bool) {
        let path = narration::stages(&self.query.stages);
        self.query.stages.pop();
        if let Some(estimator) = self.query.estimators.last_mut() {
            estimator.feature.tell_trials(&mut self.stream);
        }
        if let Stage::Estimator(method) = stage
            && let Some(estimator) = self.query.estimators.pop()
        {
            *self.evals.entry(method).or_default() += estimator.hypotheses;
        }
        if !succeeded {
            self.say(&format!("{path} stopped here"), TextLogLevel::WARN);
        }
        self.show_stage();
        // Larger chunks make a file smaller and faster to write.
        if self.stream.is_live() || matches!(stage, Stage::Estimator(_)) {
            self.stream.flush();
        }
    }

    /// Shows the open stages in the lane of the requested method, including those inside a hybrid.
    fn show_stage(&mut self) {
        let Some(method) = self.query.method else {
            return;
        };
        let state = match self.query.stages.as_slice() {
            // An empty state ends the lane.
            [] => StateChange::single(""),
            // The lane is named after the method already.
            [_] => StateChange::single(method.name()),
            [_, inner @ ..] => StateChange::single(narration::stages(inner)),
        };
        self.stream.log(&entities::stage(method), &state);
    }

    /// The cloud with the colours of the direct methods.
    fn colored(&self, tuple: &ReferenceTuple) -> ColoredCloud {
        let gray = &tuple.photo().gray;
        color_cloud(tuple.cloud(), gray, tuple.intrinsics(), &self.params.render)
    }

    fn fused(&mut self, event: &ReferencesFused) {
        let (Some(method), Some(origin)) = (self.query.method, self.origin) else {
            return;
        };
        self.stream.advance();
        let words = narration::sentence(&Event::from(event.clone())).unwrap_or_default();
        self.say(&format!("{}: {words}", method.name()), TextLogLevel::INFO);
        let tables = &mut self.query.fusions;
        fusion::tell(event, method, origin, tables, &mut self.stream);
    }

    fn ranked(&mut self, event: &ReferencesRanked) {
        let (Some(problem), Some(origin)) = (self.query.problems.first(), self.origin) else {
            return;
        };
        self.stream.advance();
        let truth = self.query.truth.as_ref();
        retrieval::tell(event, problem.query(), truth, origin, &mut self.stream);
        let words = narration::sentence(&Event::from(event.clone())).unwrap_or_default();
        let path = narration::stages(&self.query.stages);
        self.say(&format!("{path}: {words}"), TextLogLevel::INFO);
        self.query.ranked = event.ranking.pictured().len();
        self.lay_out();
    }

    /// Records an event of an estimator.
    fn tell(&mut self, method: Method, event: &Event) {
        if let Some(words) = narration::sentence(event) {
            self.stream.advance();
            let path = narration::stages(&self.query.stages);
            self.say(&format!("{path}: {words}"), TextLogLevel::INFO);
        }
        let index = self.query.reference;
        let (Some(problem), Some(origin)) = (self.query.problems.get(index), self.origin) else {
            return;
        };
        // FB uses the cloud without colouring it.
        let colored = match event {
            Event::CloudColored(event) => Some(Arc::clone(&event.cloud)),
            Event::ProjectedCloud(_) => Some(Arc::new(self.colored(problem.reference()))),
            _ => None,
        };
        if let Some(cloud) = colored
            && self.query.clouds.insert(index)
        {
            scene::log_cloud(&mut self.stream, index, problem.reference(), &cloud, origin);
        }
        let context = EventContext {
            reference: index,
            problem,
            method,
            evals: self.evals.get(&method).copied().unwrap_or(0),
            is_first_match: matches!(event, Event::MatchesDecided(_))
                && self.query.matched.insert(index),
            origin,
        };
        if let Some(estimator) = self.query.estimators.last_mut() {
            if matches!(event, Event::HypothesisTried(_) | Event::PoseScored(_)) {
                estimator.hypotheses += 1;
            }
            estimator.feature.tell(event, &context, &mut self.stream);
            estimator.direct.tell(event, &context, &mut self.stream);
        }
    }
}

impl CurrentQuery {
    fn problem(&self) -> Option<&Problem> {
        self.problems.get(self.reference)
    }
}

/// The calls of the run's observer.
impl Recording {
    pub(super) fn begin_query(
        &mut self,
        query_index: usize,
        problems: Vec<Problem>,
        truth: Option<Pose>,
    ) {
        self.query = CurrentQuery { problems, truth, ..CurrentQuery::default() };
        let Some(first) = self.query.problems.first().cloned() else {
            return;
        };
        self.stream.set_query(query_index);
        // Every estimator begins here.
        self.stream.set_lockstep(Some(0));
        self.stream.advance();
        let origin = match self.origin {
            Some(origin) => {
                self.wipe();
                origin
            }
            None => self.set_up(&first),
        };
        let stream = &mut self.stream;
        let label = |name: &str| self.identity.reference_label(name);
        scene::log_photos(stream, &self.query.problems, label, origin);
        if let Some(truth) = &self.query.truth {
            let camera = PlacedCamera {
                owner: &entities::truth(),
                world_from_camera: truth,
                intrinsics: first.query().intrinsics(),
                color: palette::TRUTH,
                label: "truth".to_owned(),
            };
            camera.log(stream, origin);
        }
        self.report();
        self.stream.flush();
    }

    pub(super) fn begin_method(&mut self, reference_index: usize, method: Method) {
        self.lay_out();
        self.query.reference = reference_index;
        self.query.method = Some(method);
        self.query.stages.clear();
        self.query.estimators.clear();
    }

    pub(super) fn end_method(&mut self, result: &QueryResult) {
        self.stream.advance();
        self.result_in_words(result);
        self.estimate(result);
        self.prove(result);
        self.query.results.push(result.clone());
        self.report();
        self.stream.flush_blocking();
    }

    pub(super) fn explained(&mut self, explained: &QueryResult) {
        let is_same = |result: &&mut QueryResult| {
            result.method == explained.method
                && result.fusion == explained.fusion
                && result.references == explained.references
        };
        for result in self.query.results.iter_mut().filter(is_same) {
            *result = explained.clone();
        }
        self.report();
        self.stream.flush_blocking();
    }

    /// Records an event. For a repeated estimator, only the stages are recorded.
    pub(super) fn accept(&mut self, record: &Record, is_repeated: bool) {
        if self.stream.is_broken() {
            return;
        }
        self.stream.set_lockstep(Some(record.index));
        if let Some(&method) = record.methods.last()
            && proof::KINDS.contains(record.event.kind())
        {
            let key = (self.query.reference, method);
            let records = self.query.records.entry(key).or_default();
            records.push(record.clone());
        }
        match (&record.event, record.methods.last()) {
            (Event::StageStarted(started), _) => self.stage_started(started.stage),
            (Event::StageEnded(ended), _) => self.stage_ended(ended.stage, ended.succeeded),
            (Event::ReferencesFused(event), _) => self.fused(event),
            (Event::ReferencesRanked(event), _) => self.ranked(event),
            (event, Some(method)) if !is_repeated => self.tell(*method, event),
            _ => {}
        }
    }
}
