//! Localising queries: every reference by itself, then fused where that is asked for.
//!
//! The one way through for a single query, for an experiment over thousands, and for whoever wants
//! to watch either.

mod explain;

use std::collections::BTreeMap;
use std::sync::Arc;

use self::explain::Unexplained;

use super::observer::checkpoint;
use super::{
    Agreement, LocalizeObserver, QueryResult, References, Setting, StageTimes, StageTimings,
    evaluate, localize_by, localize_traced, tell_ranking,
};
use crate::diagnosis::{
    Evidence, Member, Subject, Tolerance, diagnose_fusion, diagnose_ranking, fused_trust,
};
use crate::estimator::{self, Failure, Given, Outcome, count_matches, hybrid_outcome};
use crate::event::KindSet;
use crate::features::{PairMatches, remembered};
use crate::foreign::Foreign;
use crate::fusion::{self, Fusion};
use crate::geometry::{Pose, PoseError};
use crate::method::Method;
use crate::params::Params;
use crate::problem::{Problem, Query};
use crate::retrieval::ReferenceRanking;
use crate::scene::{CachedScene, Scene, SceneError};
use crate::trace::Fanout;
use crate::trace::{Cancelled, Sink, Trace};

/// Why queries could not be localised, for those who have no error of their own.
#[derive(Debug, thiserror::Error)]
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
/// The frames that were used last are at hand for the next method and the next query, with all that
/// was worked out about them.
pub struct Localizer<'a> {
    references: CachedScene<'a>,
    queries: CachedScene<'a>,
    params: &'a Params,
    seed: u64,
    tolerance: Tolerance,
    /// The least probability of being within 1 m with which a pose is accepted.
    least_probability: Option<f64>,
    /// How often a query that went wrong is localised again to see what would have helped.
    runs_to_explain: usize,
    /// What other systems answered.
    foreign: Foreign,
}

/// What one method made of one problem.
struct MethodOutcome {
    /// What the estimator answered.
    estimated: Outcome,
    /// What is made of it: a pose of low confidence may be refused.
    outcome: Outcome,
    /// What the estimator told.
    evidence: Evidence,
    result: QueryResult,
    times: StageTimes,
}

/// A query at work, with all that was found out about it.
struct QueryWork<'a> {
    query: &'a Query,
    truth: Option<Pose>,
    problems: Vec<Problem>,
    /// The query's position in its scene.
    frame: usize,
    /// The reference and the radius of each problem \[m\].
    places: Vec<(usize, f64)>,
    /// Feature matches by problem, once they are known.
    matches: Vec<Option<usize>>,
    /// What each method made of each problem.
    candidates: BTreeMap<Method, Vec<Option<MethodOutcome>>>,
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

    /// A localizer for scenes, references and queries, whose frames are remembered for longer than
    /// it lives.
    pub fn with_cached_scenes(
        (references, queries): (CachedScene<'a>, CachedScene<'a>),
        params: &'a Params,
        seed: u64,
    ) -> Self {
        Self {
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
        Localizer {
            references: self.references.clone(),
            queries: self.queries.clone(),
            params,
            seed: self.seed,
            tolerance: self.tolerance,
            least_probability: self.least_probability,
            runs_to_explain: 0,
            foreign: self.foreign.clone(),
        }
    }

    /// The parameters.
    pub fn params(&self) -> &Params {
        self.params
    }

    /// When a pose is right.
    pub fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    /// The same localizer, which localises a query that went wrong again, at most so often for each
    /// result, to see what would have helped.
    #[must_use]
    pub fn explaining(self, runs: usize) -> Self {
        Self {
            runs_to_explain: runs,
            ..self
        }
    }

    /// The same localizer, for which a pose is right that is within `tolerance` of the truth.
    #[must_use]
    pub fn with_tolerance(self, tolerance: Tolerance) -> Self {
        Self { tolerance, ..self }
    }

    /// The same localizer, which accepts no pose that is within 1 m of the truth with less than this
    /// probability.
    #[must_use]
    pub fn accepting_from(self, least_probability: Option<f64>) -> Self {
        Self {
            least_probability,
            ..self
        }
    }

    /// The same localizer, with what other systems answered about the queries: their poses are methods
    /// beside ours, their matches take the place of those of SURF.
    #[must_use]
    pub fn with_foreign(self, foreign: Foreign) -> Self {
        Self { foreign, ..self }
    }

    /// The scene of the queries, its frames remembered.
    pub fn queries(&self) -> &dyn Scene {
        &self.queries
    }

    /// The scene of the references, its frames remembered.
    pub fn references(&self) -> &dyn Scene {
        &self.references
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
        let mut places: Vec<(usize, u64)> = Vec::new();
        let mut problems = Vec::new();
        let mut members: Vec<Vec<usize>> = Vec::new();
        for request in requests {
            let mut of_request = Vec::new();
            for &reference in &request.references.frames {
                let place = (reference, request.radius_m.to_bits());
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
            truth: self.queries.pose(query),
            matches: vec![None; problems.len()],
            candidates: BTreeMap::new(),
            problems,
            frame: query,
            places: places
                .into_iter()
                .map(|(reference, radius)| (reference, f64::from_bits(radius)))
                .collect(),
        };
        observer.begin_query(index, &work.problems, work.truth.as_ref());
        self.tell_rankings(requests, observer)?;
        for &method in methods {
            for (request, members) in requests.iter().zip(&members) {
                let truth = work.truth;
                let mut emit = |result: QueryResult, times: StageTimes| {
                    let result = self.with_ranking_judged(result, request, truth.as_ref());
                    hand_out(self.marked(result, request.setting), times)
                };
                if members.is_empty() {
                    let failure = Failure::NoReference {
                        radius_m: request.references.within_m,
                    };
                    let fusions = request.fusions.iter().copied().map(Some);
                    let lines = if request.fusions.is_empty() {
                        vec![None]
                    } else {
                        fusions.collect()
                    };
                    for fusion in lines {
                        let result = self.without_pose(&work, method, fusion, &failure);
                        emit(result, StageTimes::default())?;
                    }
                    continue;
                }
                for &problem in members {
                    let is_fused = !request.fusions.is_empty();
                    self.solve(&mut work, problem, method, is_fused, observer)?;
                    if let (true, Some(candidate)) =
                        (request.fusions.is_empty(), work.candidate(problem, method))
                    {
                        emit(candidate.result.clone(), candidate.times.clone())?;
                    }
                }
                if !request.fusions.is_empty() {
                    self.count_matches(&mut work, members, observer)?;
                }
                for &fusion in &request.fusions {
                    let (result, times) =
                        self.fuse(&work, members, method, fusion, request, observer)?;
                    emit(result, times)?;
                }
            }
        }
        Ok(())
    }

    /// Each ranking once, though several requests may take their references from it.
    fn tell_rankings(
        &self,
        requests: &[Request],
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(), Cancelled> {
        let mut told: Vec<&Arc<ReferenceRanking>> = Vec::new();
        for ranking in requests
            .iter()
            .filter_map(|r| r.references.ranking.as_ref())
        {
            if !told.iter().any(|known| Arc::ptr_eq(known, ranking)) {
                observer.begin_retrieval();
                let sink: &mut dyn Sink = &mut *observer;
                tell_ranking(ranking, &self.references, &mut Trace::to(sink))?;
                told.push(ranking);
            }
        }
        Ok(())
    }

    fn marked(&self, result: QueryResult, setting: Option<Setting>) -> QueryResult {
        let (scene, queries) = (self.references.name(), self.queries.name());
        QueryResult {
            query_scene: (queries != scene).then(|| queries.to_owned()),
            setting,
            ..result
        }
    }

    /// A result that is not right because retrieval found another place says so first.
    fn with_ranking_judged(
        &self,
        mut result: QueryResult,
        request: &Request,
        truth: Option<&Pose>,
    ) -> QueryResult {
        let is_right = result
            .error
            .is_some_and(|error| self.tolerance.contains(&error));
        let ranking = request.references.ranking.as_ref().zip(truth);
        if !is_right
            && let Some(verdict) = ranking
                .and_then(|(ranking, truth)| diagnose_ranking(ranking, truth, request.radius_m))
        {
            result.diagnosis.insert(0, verdict);
        }
        result
    }

    fn without_pose(
        &self,
        work: &QueryWork<'_>,
        method: Method,
        fusion: Option<Fusion>,
        failure: &Failure,
    ) -> QueryResult {
        QueryResult {
            fusion,
            ..QueryResult::new(
                self.references.name(),
                &work.query.name,
                method,
                self.seed,
                Err(failure),
                work.truth.as_ref(),
            )
        }
    }

    /// Solves one problem, unless it was solved before.
    fn solve(
        &self,
        work: &mut QueryWork<'_>,
        problem: usize,
        method: Method,
        is_fused: bool,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(), Cancelled> {
        if work.candidate(problem, method).is_some() {
            return Ok(());
        }
        observer.begin_method(problem, method);
        let mut candidate = match work.hybrid_parts(problem, method) {
            Some((feature, direct)) => {
                let runs = [&feature.times, &direct.times];
                let used = if feature.outcome.pose.is_ok() { 1 } else { 2 };
                let times = StageTimes::inside(method.name(), runs.into_iter().take(used));
                let (outcome, evidence) = match observer.wanted() == KindSet::NONE {
                    true => {
                        let outcome = hybrid_outcome(&feature.estimated, &direct.estimated);
                        let evidence = match outcome.fell_back {
                            true => feature.evidence.followed_by(&direct.evidence),
                            false => feature.evidence.clone(),
                        };
                        (outcome, evidence)
                    }
                    // Whoever watches wants to see the hybrid at work. It has everything at hand, so
                    // what it takes now says nothing.
                    false => {
                        let again = self.estimate(work, problem, method, observer)?;
                        (again.estimated, again.evidence)
                    }
                };
                self.judged(work, problem, method, outcome, evidence, times)
            }
            None => self.estimate(work, problem, method, observer)?,
        };
        // What is fused is explained as a whole.
        let explained = if is_fused {
            Ok(())
        } else {
            let (reference, radius_m) = work.places[problem];
            let request = Request {
                radius_m,
                references: vec![reference].into(),
                fusions: Vec::new(),
                setting: None,
            };
            self.explain_wrong(&mut candidate.result, work.frame, &request, observer)
        };
        observer.end_method(&candidate.result, &candidate.times);
        let of_method = work.candidates.entry(method).or_default();
        of_method.resize_with(work.problems.len(), || None);
        of_method[problem] = Some(candidate);
        explained
    }

    /// Says of a wrong result what would have helped, if that is asked for.
    fn explain_wrong(
        &self,
        result: &mut QueryResult,
        query: usize,
        request: &Request,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(), Cancelled> {
        let is_right = |error: &PoseError| self.tolerance.contains(error);
        let is_wrong =
            result.initial_error.is_some() && !result.error.as_ref().is_some_and(is_right);
        if self.runs_to_explain == 0 || !is_wrong {
            return Ok(());
        }
        let unexplained = Unexplained {
            result,
            query,
            request,
        };
        let (explanation, outcome) = self.explain(&unexplained, self.runs_to_explain, observer);
        result.explanation = Some(explanation);
        outcome
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
        let mut trace = match &attention {
            Some(flag) => Trace::watched(&mut fanout, flag),
            None => Trace::to(&mut fanout),
        };
        let asked = &work.problems[problem];
        let outcome = match self.foreign.estimates(method) {
            Some(estimates) => {
                let given = Given::new(method, Arc::clone(estimates));
                localize_by(&given, asked, &mut trace)?
            }
            None => localize_traced(asked, method, self.params, &mut trace)?,
        };
        let times = timings.into_times();
        Ok(self.judged(work, problem, method, outcome, evidence, times))
    }

    fn judged(
        &self,
        work: &QueryWork<'_>,
        problem: usize,
        method: Method,
        estimated: Outcome,
        evidence: Evidence,
        times: StageTimes,
    ) -> MethodOutcome {
        let solved = &work.problems[problem];
        let subject = Subject::new(solved, method, self.params, &estimated, &evidence);
        let outcome = self.accepted(&subject);
        let subject = Subject {
            outcome: &outcome,
            ..subject
        };
        let subject = subject.against(work.truth.as_ref(), self.tolerance);
        let mut result = evaluate(self.references.name(), &subject);
        if let Ok(pose) = &outcome.pose {
            result.agreement = work.agreement(problem, method, pose);
        }
        MethodOutcome {
            estimated,
            outcome,
            evidence,
            result,
            times,
        }
    }

    /// The outcome, without its pose where that is less certain than asked for.
    fn accepted(&self, subject: &Subject<'_>) -> Outcome {
        let trust = subject.trust.as_ref();
        let probability = trust.and_then(|trust| trust.probability);
        match (self.least_probability, probability) {
            (Some(needed), Some(probability)) if probability < needed => Outcome {
                pose: Err(Failure::LowConfidence {
                    probability,
                    needed,
                }),
                ..subject.outcome.clone()
            },
            _ => subject.outcome.clone(),
        }
    }

    /// FB counts them anyway; for the direct methods the same features are matched.
    fn count_matches(
        &self,
        work: &mut QueryWork<'_>,
        members: &[usize],
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(), Cancelled> {
        for &problem in members {
            if work.matches[problem].is_some() {
                continue;
            }
            checkpoint(observer)?;
            let counted = work.candidates.values().find_map(|of_method| {
                let candidate = of_method.get(problem)?.as_ref()?;
                candidate.outcome.counts
            });
            let Problem {
                query,
                reference,
                matches,
                ..
            } = &work.problems[problem];
            work.matches[problem] = Some(match (counted, matches.as_deref()) {
                (Some(counts), _) => counts.unique,
                (None, Some(PairMatches::Found(found))) => found.count(),
                (None, Some(PairMatches::Absent)) => 0,
                (None, None) => {
                    let surf = &self.params.surf;
                    let query = remembered(&query.photo.gray, &query.memo, surf);
                    let reference = remembered(&reference.photo.gray, &reference.memo, surf);
                    count_matches(&query.value, &reference.value, &self.params.fb)
                }
            });
        }
        Ok(())
    }

    fn fuse(
        &self,
        work: &QueryWork<'_>,
        members: &[usize],
        method: Method,
        fusion: Fusion,
        request: &Request,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(QueryResult, StageTimes), Cancelled> {
        let solved: Vec<(&Problem, usize, &MethodOutcome)> = members
            .iter()
            .filter_map(|&problem| {
                let matches = work.matches[problem].unwrap_or_default();
                let candidate = work.candidate(problem, method)?;
                Some((&work.problems[problem], matches, candidate))
            })
            .collect();
        let candidates: Vec<_> = solved
            .iter()
            .map(|(problem, matches, candidate)| fusion::Candidate {
                reference: &problem.reference.name,
                matches: *matches,
                pose: candidate.outcome.pose.as_ref(),
                fell_back: candidate.outcome.fell_back,
            })
            .collect();
        observer.begin_fusion(method);
        let sink: &mut dyn Sink = observer;
        let (pose, shares) = fusion::fuse(&fusion, &candidates, &mut Trace::to(sink))?;
        let fused_members: Vec<Member<'_>> = shares
            .iter()
            .zip(&solved)
            .map(|(share, (.., candidate))| Member {
                share,
                verdicts: &candidate.result.diagnosis,
                trust: candidate.result.trust.as_ref(),
            })
            .collect();
        let truth = work.truth.as_ref();
        // Where one would start from with a single reference: the one with the most matches.
        let best = solved.iter().rev().max_by_key(|(_, matches, _)| *matches);
        let mut result = QueryResult {
            references: solved
                .iter()
                .map(|(problem, ..)| problem.reference.name.clone())
                .collect(),
            fusion: Some(fusion),
            initial_error: truth.zip(best).map(|(truth, (problem, ..))| {
                PoseError::between(truth, &problem.reference.world_from_camera)
            }),
            diagnosis: diagnose_fusion(&pose, &fused_members, truth, self.tolerance),
            trust: pose
                .as_ref()
                .ok()
                .and_then(|pose| fused_trust(pose, &fused_members)),
            per_reference: Some(
                solved
                    .iter()
                    .map(|(.., candidate)| candidate.result.nested())
                    .collect(),
            ),
            ..QueryResult::new(
                self.references.name(),
                &work.query.name,
                method,
                self.seed,
                pose.as_ref(),
                truth,
            )
        };
        let asked = Request {
            fusions: vec![fusion],
            ..request.clone()
        };
        let explained = self.explain_wrong(&mut result, work.frame, &asked, observer);
        observer.end_fusion(&result);
        explained?;
        let times = StageTimes::sum(solved.iter().map(|(.., candidate)| &candidate.times));
        Ok((result, times))
    }
}

impl QueryWork<'_> {
    /// How far the poses of the other methods that solved the problem are from this one.
    fn agreement(&self, problem: usize, method: Method, pose: &Pose) -> Vec<Agreement> {
        let others = self.candidates.keys().copied();
        others
            .filter(|other| *other != method)
            .filter_map(|other| {
                let candidate = self.candidate(problem, other)?;
                let error = PoseError::between(candidate.outcome.pose.as_ref().ok()?, pose);
                Some(Agreement {
                    method: other,
                    translation_m: error.translation_m,
                    rotation_deg: error.rotation_deg,
                })
            })
            .collect()
    }

    fn candidate(&self, problem: usize, method: Method) -> Option<&MethodOutcome> {
        self.candidates.get(&method)?.get(problem)?.as_ref()
    }

    /// The candidates of a hybrid's methods, where it can be made of them.
    fn hybrid_parts(
        &self,
        problem: usize,
        method: Method,
    ) -> Option<(&MethodOutcome, &MethodOutcome)> {
        let parts = estimator::find(method)?.hybrid()?;
        let first = self.candidate(problem, parts.first)?;
        let second = self.candidate(problem, parts.second)?;
        let panicked = |candidate: &MethodOutcome| {
            matches!(candidate.outcome.pose, Err(Failure::Internal { .. }))
        };
        (!panicked(first) && !panicked(second)).then_some((first, second))
    }
}
