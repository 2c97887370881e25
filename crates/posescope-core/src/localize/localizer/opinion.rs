//! Localising a query anew, for a second opinion on the pose of another system.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::Localizer;
use super::work::{MethodOutcome, OneAnswer, QueryWork};
use crate::diagnosis::{Evidence, Subject};
use crate::estimator::{self, Outcome};
use crate::event::KindSet;
use crate::geometry::{Pose, PoseError};
use crate::grid::{Phase, ScoredLattice};
use crate::localize::{LocalizeObserver, StageTimes, StageTimings};
use crate::method::Method;
use crate::opinion::{Opinion, OwnAnswer};
use crate::problem::Problem;
use crate::trace::{Cancelled, Fanout, Record, Sink, Trace};

/// The methods that are asked, until one has a pose that can be trusted; the quick one first, about all references.
const ASKED: [Method; 2] = [Method::named("fb2"), SEARCHING];

/// The one of them that searches a cost.
const SEARCHING: Method = Method::named("robust");

/// An answer, with the position of its problem.
pub(super) type SharedAnswer = (usize, Arc<OneAnswer>);

/// Keeps the events of another method's search from an observer, which may still stop it.
struct Quiet<'a>(&'a mut dyn LocalizeObserver);

impl Sink for Quiet<'_> {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }

    fn accept(&mut self, _record: &Record) -> Result<(), Cancelled> {
        Ok(())
    }

    fn attend(&mut self) -> Result<(), Cancelled> {
        self.0.attend()
    }
}

impl Localizer<'_> {
    /// The own answers to the problems of a request, each found once for all given poses, and how long that took. The given
    /// pose was not found from a reference, so each of them may say where the query is.
    pub(super) fn own_answers(
        &self,
        work: &mut QueryWork<'_>,
        members: &[usize],
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(Vec<SharedAnswer>, StageTimes), Cancelled> {
        let mut timings = StageTimings::default();
        let mut answers: Vec<SharedAnswer> = Vec::new();
        let is_trusted =
            |answer: &SharedAnswer| answer.1.found.as_ref().is_ok_and(OwnAnswer::is_trusted);
        for method in ASKED {
            if answers.iter().any(is_trusted) {
                break;
            }
            for &problem in members {
                let answer = match work.own[problem].get(&method) {
                    Some(known) => Arc::clone(known),
                    None => {
                        let answer =
                            self.own_answer(work, problem, method, &mut timings, observer)?;
                        let answer = Arc::new(answer);
                        work.own[problem].insert(method, Arc::clone(&answer));
                        answer
                    }
                };
                answers.push((problem, answer));
                // The quick method may contradict itself; a second search would take too long.
                if method == SEARCHING && answers.last().is_some_and(is_trusted) {
                    break;
                }
            }
        }
        Ok((answers, timings.into_times()))
    }

    /// What one of the own methods answers to a problem.
    fn own_answer(
        &self,
        work: &QueryWork<'_>,
        problem: usize,
        method: Method,
        timings: &mut StageTimings,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<OneAnswer, Cancelled> {
        // The matches of the other system would repeat its mistakes.
        let solved = Problem { matches: None, ..work.problems[problem].clone() };
        // What the run asks for anyway is not done twice.
        let has_own_matches = work.problems[problem].matches.is_none();
        let known = work.candidate(problem, method).filter(|_| has_own_matches);
        let (outcome, evidence) = match known {
            Some(known) => (known.estimated.clone(), known.evidence.clone()),
            None => self.asked(&solved, method, timings, observer)?,
        };
        let subject = Subject::new(&solved, method, self.params, &outcome, &evidence)
            .against(None, self.tolerance);
        let found = match &outcome.pose {
            Ok(pose) => Ok(OwnAnswer {
                method,
                pose: *pose,
                confidence: subject.confidence.clone(),
                given_costs_more: None,
            }),
            Err(failure) => Err(format!("Posescope has no pose of its own: {failure}")),
        };
        let searched = outcome.cost.filter(|_| method == SEARCHING).map(|cost| {
            let of_disc = |one: &&Arc<ScoredLattice>| one.lattice.phase == Phase::PositionCoarse;
            let coarse: Vec<_> = evidence.surfaces.iter().filter(of_disc).cloned().collect();
            (cost.best, estimator::cost_deviation(&coarse))
        });
        Ok(OneAnswer { found, searched })
    }

    fn asked(
        &self,
        problem: &Problem,
        method: Method,
        timings: &mut StageTimings,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(Outcome, Evidence), Cancelled> {
        let mut evidence = Evidence::default();
        let attention = observer.attention();
        let attention: Option<&AtomicBool> = attention.as_deref();
        let mut quiet = Quiet(observer);
        let mut fanout = Fanout::new(vec![timings, &mut evidence, &mut quiet]);
        let mut trace = Trace::watched(&mut fanout, attention);
        let outcome = self.ask(problem, method, &mut trace)?;
        Ok((outcome, evidence))
    }

    /// What was made of a given pose, with the opinion on it.
    pub(super) fn with_opinion(
        &self,
        work: &QueryWork<'_>,
        candidate: MethodOutcome,
        own: &[SharedAnswer],
        took: &StageTimes,
    ) -> MethodOutcome {
        let mut result = candidate.result;
        let pose = candidate.outcome.pose.as_ref().ok();
        result.take_opinion(pose.map(|pose| self.opinion(work, pose, own)));
        let times = StageTimes::inside(result.method.name(), [&candidate.times, took]);
        MethodOutcome { result, times, ..candidate }
    }

    /// The opinion on a given pose by the own answers to some problems.
    pub(super) fn opinion(
        &self,
        work: &QueryWork<'_>,
        given: &Pose,
        own: &[SharedAnswer],
    ) -> Opinion {
        let found = own.iter().filter_map(|(problem, own)| {
            let answer = own.found.as_ref().ok()?;
            let more = || self.given_costs_more(&work.problems[*problem], own, given);
            let is_needed = answer.needs_costs(given, self.tolerance);
            Some(OwnAnswer { given_costs_more: is_needed.then(more).flatten(), ..answer.clone() })
        });
        let answers: Vec<OwnAnswer> = found.collect();
        let missing = own.iter().rev().find_map(|(_, own)| own.found.as_ref().err());
        let missing = missing.map_or("", String::as_str);
        let opinion = Opinion::of(given, self.tolerance, &answers, missing);
        opinion.of_a_pose_like(self.frame_at(given, &work.query.name))
    }

    /// The other frame of the map whose pose this is, to the digits that files have.
    fn frame_at(&self, given: &Pose, query: &str) -> Option<String> {
        const SAME_M: f64 = 1e-4;
        const SAME_DEG: f64 = 0.01;
        let map = self.references();
        let is_there = |frame: &usize| {
            map.pose(*frame).is_some_and(|pose| {
                let error = PoseError::between(&pose, given);
                error.translation_m < SAME_M && error.rotation_deg < SAME_DEG
            })
        };
        let names = map.frames().iter().map(String::as_str).enumerate();
        let mut others = names.filter(|(_, name)| !(self.is_one_drive() && query == *name));
        others.find(|(frame, _)| is_there(frame)).map(|(_, name)| name.to_owned())
    }

    /// How much more the minimum costs that a given pose leads to than an own answer, in standard deviations. Where it
    /// leads elsewhere, the cost at the pose counts.
    fn given_costs_more(&self, problem: &Problem, own: &OneAnswer, given: &Pose) -> Option<f64> {
        let (best, deviation) = own.searched?;
        let estimator = estimator::find(SEARCHING)?.make(self.params);
        let led = estimator.led_from(problem, &problem.reference_from_query(given));
        let near = led.filter(|led| {
            let moved = PoseError::between(given, &problem.world_from_query(&led.pose));
            self.tolerance.contains(&moved)
        });
        let cost = match near {
            Some(near) => near.cost,
            None => estimator.compare_at(problem, given)?.score.cost?,
        };
        Some((cost - best) / deviation)
    }
}
