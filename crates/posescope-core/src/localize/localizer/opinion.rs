//! Localising a query anew, for a second opinion on the pose of another system.

use std::sync::Arc;

use nalgebra::{Point2, Point3};

use super::Localizer;
use super::work::{Estimated, MethodOutcome, OneAnswer, QueryWork};
use crate::depth::LiftedMatch;
use crate::diagnosis::{Assessment, Evidence, Subject};
use crate::estimator::{self, FeatureBased, Given};
use crate::event::{OpinionFormed, OwnAnswered, Stage};
use crate::features::PairMatches;
use crate::geometry::{Pose, PoseError};
use crate::grid::{Phase, ScoredLattice};
use crate::localize::{LocalizeObserver, StageTimings, localize_by};
use crate::method::Method;
use crate::opinion::{BetterPose, ExplainedMatches, MatchesOfPose, Opinion, OwnAnswer};
use crate::problem::Problem;
use crate::trace::{Cancelled, Fanout, Trace};

/// The methods that are asked, until one has a pose that can be trusted; the quick one first, about all references.
const ASKED: [Method; 2] = [Method::named("fb2"), SEARCHING];

/// The one of them that searches a cost.
const SEARCHING: Method = Method::named("robust");

/// An answer, with the position of its problem.
pub(super) type SharedAnswer = (usize, Arc<OneAnswer>);

impl Localizer<'_> {
    /// Takes the pose that another system has for the query, and forms an opinion on it.
    pub(super) fn take_given(
        &self,
        work: &mut QueryWork<'_>,
        problem: usize,
        (method, given): (Method, &Given),
        members: &[usize],
        observer: &mut dyn LocalizeObserver,
    ) -> Result<MethodOutcome, Cancelled> {
        let (mut timings, mut opinion) = (StageTimings::default(), None);
        let attention = observer.attention();
        let mut fanout = Fanout::new(vec![&mut timings, observer]);
        let mut trace = Trace::watched(&mut fanout, attention.as_deref());
        let outcome = trace.stage(Stage::Estimator(method), |trace| {
            let outcome = given.answer(&work.query.name);
            if let Ok(pose) = &outcome.pose {
                let formed = trace.stage(Stage::Opinion, |trace| {
                    let own = self.own_answers(work, members, Some(pose), trace)?;
                    let opinion = self.opinion(work, pose, &own);
                    trace.emit(|| OpinionFormed {
                        standing: opinion.standing.word(),
                        probability: opinion.probability,
                        better: opinion.better.as_ref().and_then(BetterPose::to_pose),
                        words: opinion.words(),
                        because: opinion.because.clone(),
                    })?;
                    Ok::<_, Cancelled>(opinion)
                })?;
                opinion = Some(formed);
            }
            Ok::<_, Cancelled>(outcome)
        })?;
        let (evidence, times) = (Evidence::default(), timings.into_times());
        let its_matches = outcome.pose.as_ref().ok().and_then(|pose| {
            let truth = work.truth_for(method);
            self.of_its_matches(&work.problems[problem], pose, truth)
        });
        let estimated = Estimated { outcome, evidence, times, verdicts: None };
        let mut candidate = self.assessed(work, problem, method, estimated);
        candidate.result.take_opinion(opinion, its_matches);
        Ok(candidate)
    }

    /// The own answers to the problems of a request, each found once for all given poses. The given pose was not found from a
    /// reference, so each of them may say where the query is.
    pub(super) fn own_answers(
        &self,
        work: &mut QueryWork<'_>,
        members: &[usize],
        given: Option<&Pose>,
        trace: &mut Trace<'_>,
    ) -> Result<Vec<SharedAnswer>, Cancelled> {
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
                        let answer = Arc::new(self.own_answer(work, problem, method, trace)?);
                        work.own[problem].insert(method, Arc::clone(&answer));
                        answer
                    }
                };
                trace.emit(|| own_answered(&work.problems[problem], method, &answer, given))?;
                answers.push((problem, answer));
                // The quick method may contradict itself; a second search would take too long.
                if method == SEARCHING && answers.last().is_some_and(is_trusted) {
                    break;
                }
            }
        }
        Ok(answers)
    }

    /// What one of the own methods answers to a problem.
    fn own_answer(
        &self,
        work: &QueryWork<'_>,
        problem: usize,
        method: Method,
        trace: &mut Trace<'_>,
    ) -> Result<OneAnswer, Cancelled> {
        // The matches of the other system would repeat its mistakes.
        let solved = Problem { matches: None, ..work.problems[problem].clone() };
        // What the run asks for anyway is not done twice.
        let has_own_matches = work.problems[problem].matches.is_none();
        let known = work.candidate(problem, method).filter(|_| has_own_matches);
        let (outcome, evidence) = match known {
            Some(known) => (known.estimated.clone(), known.evidence.clone()),
            None => {
                let mut evidence = Evidence::default();
                let asked = trace.aside(&mut evidence, |trace| self.ask(&solved, method, trace));
                (asked?, evidence)
            }
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

    /// What the matches of the other system say of its pose; `None` where it gave none with a depth.
    fn of_its_matches(
        &self,
        problem: &Problem,
        given: &Pose,
        truth: Option<&Pose>,
    ) -> Option<MatchesOfPose> {
        let PairMatches::Found(_) = problem.matches.as_deref()? else {
            return None;
        };
        let mut evidence = Evidence::default();
        let estimator = FeatureBased::new(self.params);
        let outcome = localize_by(&estimator, problem, &mut Trace::to(&mut evidence)).ok()?;
        let (lifted, features) = (evidence.lifted.clone()?, evidence.query.clone()?);
        let pixel = |one: &LiftedMatch| features.keypoints[one.query].pixel();
        let pairs: Vec<_> =
            lifted.iter().filter_map(|one| Some((pixel(one), one.point?))).collect();
        let camera = &problem.query.intrinsics;
        let explained = |reference_from_query: &Pose| {
            let query_from_reference = reference_from_query.inverse();
            let is_near = |(pixel, point): &&(Point2<f64>, Point3<f64>)| {
                let seen = camera.project(&(query_from_reference * *point));
                let most_px = self.params.fb.mlesac.inlier_threshold_px;
                seen.is_some_and(|seen| (seen - *pixel).norm() <= most_px)
            };
            pairs.iter().filter(is_near).count()
        };
        let best = evidence.refined.as_ref().map(|refined| refined.reference_from_query);
        let subject = Subject::new(problem, Method::FB, self.params, &outcome, &evidence)
            .against(truth, self.tolerance);
        (!pairs.is_empty()).then(|| MatchesOfPose {
            explained: ExplainedMatches {
                with_depth: pairs.len(),
                by_pose: explained(&problem.reference_from_query(given)),
                at_most: best.as_ref().map_or(0, explained),
                apart: best.map(|best| PoseError::between(&problem.world_from_query(&best), given)),
            },
            verdicts: Assessment::of(&subject).verdicts,
        })
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

/// The event of an own answer beside a given pose.
fn own_answered(
    problem: &Problem,
    method: Method,
    answer: &OneAnswer,
    given: Option<&Pose>,
) -> OwnAnswered {
    let found = answer.found.as_ref().ok();
    OwnAnswered {
        by: method,
        from: problem.reference.name.clone(),
        world_from_camera: found.map(|found| found.pose),
        probability: found.and_then(|found| Some(found.confidence.as_ref()?.probability)),
        apart: found.zip(given).map(|(found, given)| PoseError::between(&found.pose, given)),
    }
}
