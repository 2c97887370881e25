//! `robust`: one judge between the families.
//!
//! HY takes FB's pose wherever FB accepts one, and MI's elsewhere. It follows FB where its matches agree
//! on a wrong pose, and drops a right one that too few matches support. Here the poses of both families
//! are refined in six freedoms under one cost, that of the [judge](crate::judge), and the cheapest is
//! the answer. That features agree beyond chance earns their pose a small credit; that they do not costs
//! it nothing. An unlikely pose gets the penalty of `mi6`.

mod params;

use std::sync::Arc;

pub use params::RobustParams;

use super::feature::Proposal;
use super::mi6::{self, SEVERAL_CHANNELS, shown};
use super::multi_start::Found;
use super::{
    CostSummary, Entry, Estimator, Failure, Family, FeatureBased, Halt, Mi6, Outcome, fb2,
    separate_failure,
};
use crate::event::{BranchTaken, CandidatesJudged, JudgedPose, Stage};
use crate::geometry::Pose;
use crate::grid::Offset;
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::{Comparison, leave_out};
use crate::search::Refined;
use crate::trace::{Cancelled, Trace};

/// The method.
const METHOD: Method = Method::named("robust");

/// The estimator in the registry.
pub(super) fn entry() -> Entry {
    let about = "the cheapest of the poses of fb, fb2 and mi6, refined under one cost";
    Entry {
        family: |_, _| Some(Family::MultiStart),
        groups: vec!["robust"],
        cost: Some(shown()),
        runs: &[Method::FB, fb2::METHOD, mi6::METHOD],
        least_probability: |params| params.robust.least_probability,
        ..Entry::new(METHOD, about, |params| Box::new(Robust::new(params)))
    }
}

/// The estimator that takes the cheaper pose.
pub struct Robust {
    feature: FeatureBased,
    guided: FeatureBased,
    six: Mi6,
    params: RobustParams,
}

impl Robust {
    /// The estimator with these parameters.
    pub fn new(params: &Params) -> Self {
        Self {
            feature: FeatureBased::new(params),
            guided: FeatureBased::guided(params),
            six: Mi6::new(params),
            params: params.robust.clone(),
        }
    }

    fn decide(
        &self,
        problem: &Problem,
        proposals: &[(Method, Proposal)],
        trace: &mut Trace<'_>,
    ) -> Result<(Pose, Option<CostSummary>), Halt> {
        let level = self.six.level(problem, 1);
        let found = trace
            .stage(Stage::Estimator(mi6::METHOD), |trace| self.six.search(problem, &level, trace));
        let found = separate_failure(found)?;
        trace.stage(Stage::Judge, |trace| {
            let Found { refined, summary, spread } = match found {
                Ok(found) => found,
                Err(failure) => return without_search(problem, proposals, failure, trace),
            };
            let mut candidates: Vec<JudgedPose> = refined
                .iter()
                .map(|&refined| JudgedPose {
                    method: mi6::METHOD,
                    refined,
                    from_features: false,
                    accepted: true,
                })
                .collect();
            for &(method, Proposal { ref outcome, consensus }) in proposals {
                let Some(pose) = consensus else { continue };
                let checkpoint = || trace.checkpoint();
                if let Some(refined) =
                    self.six.multi_start.refined(problem, &level, pose, checkpoint)?
                {
                    let accepted = outcome.pose.is_ok();
                    candidates.push(JudgedPose { method, refined, from_features: true, accepted });
                }
            }
            // The features' poses come last and the sort is stable: of equally cheap ones the search's
            // stands.
            let map_cost = |candidate: &JudgedPose| {
                let is_agreed = candidate.from_features && candidate.accepted;
                let credit = if is_agreed { self.params.credit } else { 0.0 };
                let Refined { pose, cost, .. } = candidate.refined;
                -spread.deviations(self.six.multi_start.map_cost(&spread, &pose, cost)) - credit
            };
            candidates.sort_by(|a, b| map_cost(a).total_cmp(&map_cost(b)));
            let best = candidates[0].clone();
            let deviations = spread.deviations(best.refined.cost);
            let needed = self.params.deviations;
            let why = why(&candidates);
            trace.emit(|| CandidatesJudged {
                candidates: Arc::from(candidates.as_slice()),
                deviations,
                needed,
                why: why.clone(),
            })?;
            if deviations < needed {
                return Err(Halt::from(Failure::ChanceMinimum {
                    cost: best.refined.cost,
                    deviations,
                    needed,
                }));
            }
            trace.emit(|| BranchTaken { method: best.method, why: why.clone() })?;
            let of_features = candidates.iter().filter(|one| one.from_features);
            let refining: u64 = of_features.map(|one| one.refined.evaluations).sum();
            let others = candidates[1..].iter().map(|other| &other.refined);
            let evaluations = summary.evaluations + refining;
            let answered =
                self.six.multi_start.answered(&level, &best.refined, others, evaluations);
            let summary = CostSummary::of(problem, &level, &answered);
            let pose = answered.reference_from_camera;
            trace.emit(|| summary.assessed(Offset::of(&pose)))?;
            Ok((problem.world_from_query(&pose), Some(summary)))
        })
    }
}

/// Where nothing can be searched, the features' accepted pose stands as it is.
fn without_search(
    problem: &Problem,
    proposals: &[(Method, Proposal)],
    failure: Failure,
    trace: &mut Trace<'_>,
) -> Result<(Pose, Option<CostSummary>), Halt> {
    // The last is that of the better features.
    let mut accepted = proposals.iter().rev().filter(|(_, proposal)| proposal.outcome.pose.is_ok());
    let found = accepted.find_map(|(method, proposal)| Some((*method, proposal.consensus?)));
    let Some((method, agreed)) = found else {
        return Err(Halt::from(failure));
    };
    let why = format!("there is no search to compare with: {failure}");
    trace.emit(|| BranchTaken { method, why })?;
    Ok((problem.world_from_query(&agreed), None))
}

/// Why the first candidate is the answer.
fn why(candidates: &[JudgedPose]) -> String {
    let best = &candidates[0];
    let said = |candidate: &JudgedPose| {
        let refused = if candidate.accepted { "" } else { " (refused by itself)" };
        format!("{}{refused} {:.4}", candidate.method, candidate.refined.cost)
    };
    let mut methods = vec![best.method];
    let mut others = Vec::new();
    for candidate in &candidates[1..] {
        if !methods.contains(&candidate.method) {
            methods.push(candidate.method);
            others.push(said(candidate));
        }
    }
    if others.is_empty() {
        format!("{}, and nothing to compare with", said(best))
    } else {
        format!("{} against {}", said(best), others.join(", "))
    }
}

impl Estimator for Robust {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        leave_out(METHOD, SEVERAL_CHANNELS);
        trace.stage(Stage::Estimator(METHOD), |trace| {
            let proposals = [
                (Method::FB, self.feature.propose(problem, trace)?),
                (fb2::METHOD, self.guided.propose(problem, trace)?),
            ];
            let decided = separate_failure(self.decide(problem, &proposals, trace))?;
            let [(_, Proposal { outcome, .. }), _] = proposals;
            Ok(match decided {
                Ok((pose, cost)) => Outcome { pose: Ok(pose), cost, ..outcome },
                Err(failure) => Outcome { counts: outcome.counts, ..Outcome::failed(failure) },
            })
        })
    }

    fn led_from(&self, problem: &Problem, reference_from_camera: &Pose) -> Option<Refined> {
        self.six.led_from(problem, reference_from_camera)
    }

    fn compare_at(&self, problem: &Problem, world_from_query: &Pose) -> Option<Comparison> {
        self.six.compare_at(problem, world_from_query)
    }
}
