//! Localises queries: against each reference alone, then fused if asked. Single queries, experiments and
//! the window all go this way.

mod assess;
mod explain;
mod fuse;
mod opinion;
mod work;

use std::collections::BTreeMap;
use std::sync::Arc;

use self::work::{Answer, Estimated, MethodOutcome, QueryWork, ReferencePlace};
use super::observer::checkpoint;
use super::single::estimate_traced;
use super::{
    LocalizeObserver, QueryResult, References, Setting, StageTimes, StageTimings, localize_by,
    report_ranking,
};
use crate::diagnosis::{Evidence, Subject, Tolerance, confidence};
use crate::estimator::{self, Estimator, Failure, Given, Hybrid, Outcome, hybrid_outcome};
use crate::event::KindSet;
use crate::foreign::Foreign;
use crate::fusion::Fusion;
use crate::geometry::Pose;
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::retrieval::ReferenceRanking;
use crate::scene::{CachedScene, DegradedScene, Scene, SceneError};
use crate::trace::Fanout;
use crate::trace::{Cancelled, Sink, Trace};

/// Why queries could not be localised, for those who have no error of their own.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LocalizeError {
    /// A frame cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The observer asked the run to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What is asked of a query: a set of references and what to make of them.
#[derive(Clone, Debug)]
pub struct Request {
    /// How far the query may be from a reference \[m\].
    pub radius_m: f64,
    /// The references, as positions in their scene, and how they were found. Without any, the query
    /// fails.
    pub references: References,
    /// The fusions to make; without any, each reference gives a result of its own.
    pub fusions: Vec<Fusion>,
    /// What the results are marked with.
    pub setting: Option<Setting>,
}

/// Localises the queries of one scene against the references of another, or of the same.
///
/// It keeps the frames used last with all that was computed of them, for the next method and the next
/// query.
#[derive(Clone)]
pub struct Localizer<'a> {
    references: CachedScene<'a>,
    queries: CachedScene<'a>,
    params: &'a Params,
    seed: u64,
    tolerance: Tolerance,
    /// The least probability of being right with which a pose is accepted.
    least_probability: Option<f64>,
    /// How often a query that went wrong is localised again to see what would have helped.
    runs_to_explain: usize,
    /// What other systems answered.
    foreign: Foreign,
    is_one_drive: bool,
}

impl<'a> Localizer<'a> {
    /// A localizer for these scenes, which may be the same.
    pub fn new(
        references: &'a dyn Scene,
        queries: &'a dyn Scene,
        params: &'a Params,
        seed: u64,
    ) -> Self {
        Self::with_cached_scenes(CachedScene::pair(references, queries), params, seed)
    }

    /// A localizer for scenes, references and queries, whose frames are kept longer than it lives.
    pub fn with_cached_scenes(
        (references, queries): (CachedScene<'a>, CachedScene<'a>),
        params: &'a Params,
        seed: u64,
    ) -> Self {
        Self {
            is_one_drive: is_one_drive(&references, &queries),
            references,
            queries,
            params,
            seed,
            tolerance: Tolerance::default(),
            least_probability: None,
            runs_to_explain: 0,
            foreign: Foreign::default(),
        }
    }

    /// The same scenes and their frames, localised with other parameters. It explains nothing.
    fn with_other_params<'b>(&'b self, params: &'b Params) -> Localizer<'b> {
        Localizer { params, runs_to_explain: 0, ..self.clone() }
    }

    /// Whether queries and references are frames of one drive, so that a query must not be its own
    /// reference.
    pub fn is_one_drive(&self) -> bool {
        self.is_one_drive
    }

    /// The parameters.
    pub fn params(&self) -> &Params {
        self.params
    }

    /// The same localizer, which localises a query that went wrong again, at most so often for each
    /// result, to see what would have helped.
    #[must_use]
    pub fn explaining(self, runs: usize) -> Self {
        Self { runs_to_explain: runs, ..self }
    }

    /// The same localizer, for which a pose is right that is within `tolerance` of the truth.
    #[must_use]
    pub fn with_tolerance(self, tolerance: Tolerance) -> Self {
        Self { tolerance, ..self }
    }

    /// The same localizer, which accepts no pose that is right with less than this
    /// probability.
    #[must_use]
    pub fn accepting_from(self, least_probability: Option<f64>) -> Self {
        Self { least_probability, ..self }
    }

    /// The same localizer, with what other systems answered about the queries: their poses are methods
    /// beside ours, their matches take the place of those of SURF.
    #[must_use]
    pub fn with_foreign(self, foreign: Foreign) -> Self {
        Self { foreign, ..self }
    }

    /// The scene of the queries, with its frames cached.
    pub fn queries(&self) -> &dyn Scene {
        &self.queries
    }

    /// The scene of the references, with its frames cached.
    pub fn references(&self) -> &dyn Scene {
        &self.references
    }

    /// The true pose of a query: of the file that takes the place of the scene's poses, if there is one.
    fn truth(&self, query: usize) -> Option<Pose> {
        match self.foreign.estimates(Foreign::TRUTH) {
            Some(truth) => truth.get(&self.queries.frames()[query]).copied(),
            None => self.queries.pose(query),
        }
    }

    /// Localises one query and hands out the results by method, then request, then fusion (or
    /// reference). A problem that two requests share is solved once.
    ///
    /// A panic of an estimator becomes the result of the query that it met.
    ///
    /// # Errors
    /// Data that cannot be read, a run that its observer cancelled, and what `hand_out` returns.
    pub fn localize<E: From<SceneError> + From<Cancelled>>(
        &self,
        index: usize,
        query: usize,
        requests: &[Request],
        methods: &[Method],
        observer: &mut dyn LocalizeObserver,
        mut hand_out: impl FnMut(QueryResult, StageTimes) -> Result<(), E>,
    ) -> Result<(), E> {
        let loaded = self.queries.query(query)?;
        let mut places: Vec<ReferencePlace> = Vec::new();
        let mut problems = Vec::new();
        let mut members: Vec<Vec<usize>> = Vec::new();
        for request in requests {
            let mut of_request = Vec::new();
            for &reference in &request.references.frames {
                let place = ReferencePlace {
                    reference,
                    radius_m: request.radius_m,
                    within_m: request.references.within_m,
                };
                let known = places.iter().position(|known| *known == place);
                of_request.push(match known {
                    Some(problem) => problem,
                    None => {
                        places.push(place);
                        checkpoint(observer)?;
                        let reference = self.references.reference(reference)?;
                        problems.push(Problem {
                            matches: self.foreign.matches(&loaded.name, &reference.name)?,
                            query: Arc::clone(&loaded),
                            reference,
                            uncertainty_radius_m: request.radius_m,
                            prior_m: request.references.within_m,
                            seed: self.seed,
                        });
                        problems.len() - 1
                    }
                });
            }
            members.push(of_request);
        }
        let mut work = QueryWork {
            query: &loaded,
            truth: self.truth(query),
            matches: vec![None; problems.len()],
            own: vec![BTreeMap::new(); problems.len()],
            candidates: BTreeMap::new(),
            problems,
            frame: query,
            places,
        };
        observer.begin_query(index, &work.problems, work.truth.as_ref());
        self.report_rankings(requests, observer)?;
        // Explain after all methods ran: answers come first, and no method profits from another's remedies.
        let mut unexplained = Vec::new();
        let answered = self.answer(
            &mut work,
            requests.iter().zip(&members),
            methods,
            observer,
            &mut |answer| match self.runs_to_explain {
                0 => hand_out(answer.result, answer.times),
                _ => {
                    unexplained.push(answer);
                    Ok(())
                }
            },
        );
        let explained = answered
            .and_then(|()| Ok(self.explain_wrong(&mut unexplained, work.frame, observer)?));
        for answer in unexplained {
            hand_out(answer.result, answer.times)?;
        }
        explained
    }

    /// Lets every method answer every request.
    fn answer<'r, E: From<Cancelled>>(
        &self,
        work: &mut QueryWork<'_>,
        requests: impl Iterator<Item = (&'r Request, &'r Vec<usize>)> + Clone,
        methods: &[Method],
        observer: &mut dyn LocalizeObserver,
        emit: &mut dyn FnMut(Answer) -> Result<(), E>,
    ) -> Result<(), E> {
        for &method in methods {
            for (request, members) in requests.clone() {
                let mut emit = |result: QueryResult, times: StageTimes, asked: Request| {
                    emit(Answer { result: self.marked(result, request.setting), times, asked })
                };
                if members.is_empty() {
                    let failure = self.without_reference(&request.references);
                    let fusions = request.fusions.iter().copied().map(Some);
                    let lines =
                        if request.fusions.is_empty() { vec![None] } else { fusions.collect() };
                    for fusion in lines {
                        let result = self.of_pose(work, method, fusion, Err(&failure));
                        let result =
                            self.with_ranking_assessed(result, request, work.truth_for(method));
                        emit(result, StageTimes::default(), request.clone())?;
                    }
                    continue;
                }
                for &problem in members {
                    self.solve(work, problem, method, (request, members), observer)?;
                    if let (true, Some(candidate)) =
                        (request.fusions.is_empty(), work.candidate(problem, method))
                    {
                        let result = candidate.result.clone();
                        let result =
                            self.with_ranking_assessed(result, request, work.truth_for(method));
                        let mut asked = work.asked_alone(problem);
                        asked.references.ranking = request.references.ranking.clone();
                        emit(result, candidate.times.clone(), asked)?;
                    }
                }
                if !request.fusions.is_empty() {
                    self.count_matches(work, members, observer)?;
                }
                // They are known by now.
                let is_given = self.foreign.estimates(method).is_some();
                let has_pose = |problem: &usize| {
                    let candidate = work.candidate(*problem, method);
                    candidate.is_some_and(|one| one.outcome.pose.is_ok())
                };
                let own = if is_given && members.iter().any(has_pose) {
                    self.own_answers(work, members, None, &mut Trace::off())?
                } else {
                    Vec::new()
                };
                for &fusion in &request.fusions {
                    let (result, times) =
                        self.fuse(work, members, method, fusion, (request, &own), observer)?;
                    let asked = Request { fusions: vec![fusion], ..request.clone() };
                    emit(result, times, asked)?;
                }
            }
        }
        Ok(())
    }

    /// Why a query has no reference.
    fn without_reference(&self, references: &References) -> Failure {
        let ranking = references.ranking.as_deref();
        let best =
            ranking.and_then(|ranking| Some((ranking.frames.len(), ranking.frames.first()?)));
        match best {
            Some((ranked, best)) => Failure::NotRecognised {
                ranked,
                best: best.name.clone(),
                inliers: best.ranked.inliers(),
                needed: self.params.retrieval.accept,
            },
            None => Failure::NoReference { radius_m: references.within_m },
        }
    }

    /// Reports each ranking once, even if several requests share it.
    fn report_rankings(
        &self,
        requests: &[Request],
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(), Cancelled> {
        let mut reported: Vec<&Arc<ReferenceRanking>> = Vec::new();
        for ranking in requests.iter().filter_map(|r| r.references.ranking.as_ref()) {
            if !reported.iter().any(|known| Arc::ptr_eq(known, ranking)) {
                observer.begin_retrieval();
                let sink: &mut dyn Sink = &mut *observer;
                report_ranking(ranking, &self.references, &mut Trace::to(sink))?;
                reported.push(ranking);
            }
        }
        Ok(())
    }

    fn marked(&self, mut result: QueryResult, setting: Option<Setting>) -> QueryResult {
        result.put_into_words_of(self.params.scale.unit());
        QueryResult {
            query_scene: (!self.is_one_drive).then(|| self.queries.name().to_owned()),
            scale: self.params.scale.metre(),
            degraded: self.queries.as_degraded().map(DegradedScene::degradation),
            setting,
            ..result
        }
    }

    /// A result of the query with what follows from its pose alone.
    fn of_pose(
        &self,
        work: &QueryWork<'_>,
        method: Method,
        fusion: Option<Fusion>,
        pose: Result<&Pose, &Failure>,
    ) -> QueryResult {
        QueryResult {
            fusion,
            ..QueryResult::new(
                self.references.name(),
                &work.query.name,
                method,
                self.seed,
                pose,
                work.truth_for(method),
                self.tolerance,
            )
        }
    }

    /// Solves one problem, unless it was solved before.
    fn solve(
        &self,
        work: &mut QueryWork<'_>,
        problem: usize,
        method: Method,
        (request, members): (&Request, &[usize]),
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(), Cancelled> {
        if work.candidate(problem, method).is_some() {
            return Ok(());
        }
        observer.begin_method(problem, method);
        let candidate = match work.hybrid_parts(problem, method) {
            Some((feature, direct)) => {
                let runs = [&feature.times, &direct.times];
                let used = if feature.outcome.pose.is_ok() { 1 } else { 2 };
                let times = StageTimes::inside(method.name(), runs.into_iter().take(used));
                let (outcome, evidence) = if observer.wanted() == KindSet::NONE {
                    let outcome = hybrid_outcome(&feature.outcome, &direct.estimated);
                    let evidence = if outcome.fell_back {
                        feature.evidence.followed_by(&direct.evidence)
                    } else {
                        feature.evidence.clone()
                    };
                    (outcome, evidence)
                } else {
                    // An observer wants to see the hybrid at work. Its parts are cached, so this run is not
                    // timed.
                    let again = self.estimate(work, problem, method, observer)?;
                    (again.estimated, again.evidence)
                };
                // A fallback has the verdicts of the method that it fell back to.
                let verdicts = outcome.fell_back.then(|| direct.result.diagnosis.clone());
                let estimated = Estimated { outcome, evidence, times, verdicts };
                self.assessed(work, problem, method, estimated)
            }
            None => match self.foreign.estimates(method) {
                Some(estimates) => {
                    let given = Given::new(method, Arc::clone(estimates));
                    self.take_given(work, problem, (method, &given), members, observer)?
                }
                None => self.estimate(work, problem, method, observer)?,
            },
        };
        let mut reported =
            self.with_ranking_assessed(candidate.result.clone(), request, work.truth_for(method));
        reported.put_into_words_of(self.params.scale.unit());
        observer.end_method(&reported, &candidate.times);
        let of_method = work.candidates.entry(method).or_default();
        of_method.resize_with(work.problems.len(), || None);
        of_method[problem] = Some(candidate);
        Ok(())
    }

    fn estimate(
        &self,
        work: &QueryWork<'_>,
        problem: usize,
        method: Method,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<MethodOutcome, Cancelled> {
        let mut timings = StageTimings::default();
        let mut evidence = Evidence::default();
        let attention = observer.attention();
        let sinks: Vec<&mut dyn Sink> = vec![&mut timings, &mut evidence, observer];
        let mut fanout = Fanout::new(sinks);
        let mut trace = Trace::watched(&mut fanout, attention.as_deref());
        let current = &work.problems[problem];
        let outcome = self.ask(current, method, &mut trace)?;
        let estimated =
            Estimated { outcome, evidence, times: timings.into_times(), verdicts: None };
        Ok(self.assessed(work, problem, method, estimated))
    }

    /// What a method answers. A hybrid falls back where the pose of its first method is refused for a low
    /// confidence, as where that has none.
    fn ask(
        &self,
        problem: &Problem,
        method: Method,
        trace: &mut Trace<'_>,
    ) -> Result<Outcome, Cancelled> {
        let parts = estimator::find(method).and_then(|entry| entry.hybrid());
        let sound = self.params.check();
        let (Some(parts), Some(_), Ok(())) = (parts, self.least_probability, sound) else {
            return estimate_traced(problem, method, self.params, trace);
        };
        let ask_first = |first: &dyn Estimator, trace: &mut Trace<'_>| {
            let mut evidence = Evidence::default();
            let outcome =
                trace.heard_by(&mut evidence, |trace| localize_by(first, problem, trace))?;
            let subject = Subject::new(problem, parts.first, self.params, &outcome, &evidence)
                .against(None, self.tolerance);
            Ok(confidence::accepted(&subject, self.least_probability))
        };
        Hybrid::new(method, parts, self.params).estimate_with(problem, ask_first, trace)
    }
}

/// Whether two scenes have the same frames at the same places. Names are not enough: every KITTI folder has
/// a sequence `00`.
pub fn is_one_drive(a: &dyn Scene, b: &dyn Scene) -> bool {
    a.name() == b.name()
        && a.frames() == b.frames()
        && (0..a.frames().len()).all(|frame| a.pose(frame) == b.pose(frame))
}
