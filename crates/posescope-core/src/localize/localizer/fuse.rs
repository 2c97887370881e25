//! One pose from those of several references.

use super::opinion::SharedAnswer;
use super::work::{MethodOutcome, QueryWork};
use super::{Localizer, Request};
use crate::diagnosis::{Member, diagnose_fusion, fused_confidence};
use crate::estimator::{Failure, JointReference, count_matches};
use crate::features::PairMatches;
use crate::fusion::{self, Fusion, Share, Way};
use crate::geometry::{Pose, PoseError};
use crate::localize::observer::checkpoint;
use crate::localize::single::localize_jointly;
use crate::localize::{LocalizeObserver, QueryResult, StageTimes, StageTimings};
use crate::method::Method;
use crate::problem::Problem;
use crate::trace::{Cancelled, Fanout, Sink, Trace};

impl Localizer<'_> {
    /// The matches of FB, whichever methods run, so that a fused result depends on no other method.
    pub(super) fn count_matches(
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
            let counted =
                work.candidate(problem, Method::FB).and_then(|candidate| candidate.outcome.counts);
            let Problem { query, reference, matches, .. } = &work.problems[problem];
            work.matches[problem] = Some(match (counted, matches.as_deref()) {
                (Some(counts), _) => counts.unique,
                (None, Some(PairMatches::Found(found))) => found.count(),
                (None, Some(PairMatches::Absent)) => 0,
                (None, None) => {
                    let surf = &self.params.surf;
                    let (query, reference) = (query.features(surf), reference.features(surf));
                    count_matches(&query, &reference, &self.params.fb)
                }
            });
        }
        Ok(())
    }

    /// The result of one of a request's fusions.
    pub(super) fn fuse(
        &self,
        work: &QueryWork<'_>,
        members: &[usize],
        method: Method,
        fusion: Fusion,
        (request, own): (&Request, &[SharedAnswer]),
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
                fell_back: candidate.outcome.fell_back && !self.params.hy.per_reference,
            })
            .collect();
        observer.begin_fusion(method);
        let mut own_timings = StageTimings::default();
        let (pose, shares) = match fusion.way {
            Way::Weighed(weigh) => {
                let sink: &mut dyn Sink = observer;
                fusion::fuse(fusion.name, weigh, &candidates, &mut Trace::to(sink))?
            }
            Way::Joint => self.estimate_jointly(&solved, method, &mut own_timings, observer)?,
        };
        let fused_members: Vec<Member<'_>> = shares
            .iter()
            .zip(&solved)
            .map(|(share, (.., candidate))| Member {
                share,
                verdicts: &candidate.result.diagnosis,
                confidence: candidate.result.confidence.as_ref(),
            })
            .collect();
        let truth = work.truth_for(method);
        // Where one would start from with a single reference: the one with the most matches.
        let best = solved.iter().rev().max_by_key(|(_, matches, _)| *matches);
        let result = QueryResult {
            references: solved.iter().map(|(problem, ..)| problem.reference.name.clone()).collect(),
            initial_error: truth.zip(best).map(|(truth, (problem, ..))| {
                PoseError::between(truth, &problem.reference.world_from_camera)
            }),
            diagnosis: diagnose_fusion(
                &pose,
                &fused_members,
                truth,
                self.tolerance,
                matches!(fusion.way, Way::Joint),
            ),
            confidence: pose
                .as_ref()
                .ok()
                .and_then(|pose| fused_confidence(pose, &fused_members, self.tolerance)),
            per_reference: Some(
                solved.iter().map(|(.., candidate)| candidate.result.nested()).collect(),
            ),
            ..self.of_pose(work, method, Some(fusion), pose.as_ref())
        };
        let opinion = pose.as_ref().ok().filter(|_| !own.is_empty());
        let opinion = opinion.map(|pose| self.opinion(work, pose, own));
        let mut result = self.with_ranking_assessed(result, request, truth);
        result.take_opinion(opinion, None);
        result.put_into_words_of(self.params.scale.unit());
        observer.end_fusion(&result);
        let own_times = own_timings.into_times();
        let runs = solved.iter().map(|(.., candidate)| &candidate.times);
        let times = StageTimes::sum(runs.chain(std::iter::once(&own_times)));
        Ok((result, times))
    }

    /// One pose from all references, each of which was asked alone before: what they answered is shown
    /// beside it, and at most a place to start from.
    fn estimate_jointly(
        &self,
        solved: &[(&Problem, usize, &MethodOutcome)],
        method: Method,
        own: &mut StageTimings,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<(Result<Pose, Failure>, Vec<Share>), Cancelled> {
        let references: Vec<_> = solved
            .iter()
            .map(|(problem, matches, candidate)| JointReference {
                problem,
                matches: *matches,
                alone: candidate.outcome.pose.as_ref().ok(),
            })
            .collect();
        let attention = observer.attention();
        let mut fanout = Fanout::new(vec![own, observer]);
        let mut trace = Trace::watched(&mut fanout, attention.as_deref());
        localize_jointly(&references, method, self.params, &mut trace)
    }
}
