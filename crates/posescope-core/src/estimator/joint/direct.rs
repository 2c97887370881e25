//! A direct method of several references: their costs added up over one grid.

use std::sync::Arc;

use super::{JointPose, JointReference, between, lead};
use crate::estimator::direct::{Best, Direct, check_size, coarse_to_fine};
use crate::estimator::multi_start::Level;
use crate::estimator::{Failure, Halt};
use crate::fusion::share::Support;
use crate::geometry::Pose;
use crate::grid::{Offset, scan};
use crate::render::{Score, Scorer, at_a_time};
use crate::search::{Freedoms, PatternSearch, Start, pattern_search};
use crate::trace::{Cancelled, Trace};

/// The first step is that of the grid's fine lattice, the last what neither a photo nor a scan tells apart.
const REFINEMENT: PatternSearch = PatternSearch {
    freedoms: Freedoms::Six,
    first_m: 0.2,
    last_m: 0.01,
    // Three degrees move a view by as much as a metre does.
    rad_per_m: 0.052,
    in_place: false,
};

/// A reference that shows something.
struct JointMember<'a> {
    index: usize,
    level: Level<Scorer<'a>>,
    /// Its camera's frame seen from that of the lead.
    member_from_lead: Pose,
}

impl Direct {
    /// The pose that the references agree on.
    ///
    /// The grid is that of the reference with the most matches: its disc, its axes, its height, pitch and
    /// roll. (On the street the grids of others that look another way found a cheaper wrong place more often
    /// than the right one, and a grid at the average of the references was less exact.) At each hypothesis every
    /// reference draws its own view of the query and has its own cost; the joint cost is their mean, each weighed
    /// by the pixels that it covers. One that covers too little there, as
    /// [`coverage_floor`](crate::grid::GridParams::coverage_floor) says, abstains, and where fewer than half are
    /// eligible there is no cost: a place that few can see would have a low cost for that reason alone.
    ///
    /// The grid ends at a step and at the greatest yaw, and its height, pitch and roll are those of one
    /// reference; an average of several poses is bound to none of that. So the minimum of the grid, and the pose
    /// that each reference found alone, are refined under the joint cost by shrinking steps, and the cheapest is
    /// the answer. With one reference that shows something nothing is refined: the answer is the method's own.
    pub(super) fn agree(
        &self,
        references: &[JointReference<'_>],
        trace: &mut Trace<'_>,
    ) -> Result<JointPose, Halt> {
        let lead = references[lead(references)].problem;
        let (grid, radius_m) = (&self.multi_start.grid, lead.uncertainty_radius_m);
        check_size(grid, radius_m)?;
        let mut members = Vec::new();
        for (index, reference) in references.iter().enumerate() {
            trace.checkpoint()?;
            let cloud = self.colored(reference.problem).value;
            if !cloud.points.is_empty() {
                trace.checkpoint()?;
                let level = self.multi_start.level(self.scorer_of(reference.problem, cloud));
                let member_from_lead = between(reference.problem, lead);
                members.push(JointMember { index, level, member_from_lead });
            }
        }
        if members.is_empty() {
            let clouds = references.iter().map(|r| r.problem.reference.cloud.len());
            let points = clouds.sum();
            return Err(Halt::from(Failure::NothingInView { points }));
        }

        let joint = Joint { members };
        let start = Best { offset: Offset::default(), score: None };
        let mut hypotheses = 0;
        let (best, _) = coarse_to_fine(grid, radius_m, start, trace, |lattice, trace| {
            hypotheses += lattice.hypotheses().count();
            // Those that abstain have been left out, so any coverage will do.
            let batch = at_a_time() / joint.members.len();
            let score = |poses: &[Pose]| joint.score(poses);
            scan(lattice, 0, batch, score, |_| trace.checkpoint()).map(Arc::new)
        })?;
        if best.score.is_none() {
            return Err(Halt::from(Failure::NothingComparable { hypotheses }));
        }
        let on_grid = best.offset.reference_from_camera();
        let alone = references.iter().filter_map(|reference| reference.alone);
        let lead_from_world = lead.reference.world_from_camera.inverse();
        let starts = std::iter::once(on_grid).chain(alone.map(|pose| lead_from_world * pose));
        let lead_from_query = match joint.members.as_slice() {
            [_] => on_grid,
            _ => joint.refined(starts, radius_m, trace)?.unwrap_or(on_grid),
        };
        let area = lead.query.intrinsics.area();
        let mut supports = vec![None; references.len()];
        for member in &joint.members {
            let score = member.scores(&[lead_from_query])[0];
            supports[member.index] = Some(Support::Cost {
                cost: score.eligible_cost(member.level.least_covered),
                coverage: f64::from(score.covered) / area,
            });
        }
        Ok((lead.world_from_query(&lead_from_query), supports))
    }
}

impl JointMember<'_> {
    /// The member's own scores of cameras in the frame of the lead.
    fn scores(&self, lead_from_camera: &[Pose]) -> Vec<Score> {
        let own = lead_from_camera.iter();
        let own: Vec<Pose> = own.map(|pose| self.member_from_lead * pose).collect();
        self.level.objective.score(&own)
    }
}

/// The members at work.
struct Joint<'a> {
    members: Vec<JointMember<'a>>,
}

impl Joint<'_> {
    /// The joint scores of many cameras in the frame of the lead.
    fn score(&self, lead_from_camera: &[Pose]) -> Vec<Score> {
        let own: Vec<Vec<Score>> =
            self.members.iter().map(|member| member.scores(lead_from_camera)).collect();
        let at = |place: usize| self.together(own.iter().map(|scores| scores[place]));
        (0..lead_from_camera.len()).map(at).collect()
    }

    /// The cheapest pose within the disc that steps which shrink lead to from any of these,
    /// `lead_from_camera`.
    fn refined(
        &self,
        starts: impl Iterator<Item = Pose>,
        radius_m: f64,
        trace: &mut Trace<'_>,
    ) -> Result<Option<Pose>, Cancelled> {
        let mut costs = |poses: &[Pose]| {
            trace.checkpoint()?;
            let cost = |(pose, score): (&Pose, Score)| {
                let shift = &pose.translation;
                score.cost.filter(|_| shift.x.hypot(shift.z) <= radius_m)
            };
            Ok::<_, Cancelled>(poses.iter().zip(self.score(poses)).map(cost).collect::<Vec<_>>())
        };
        let poses: Vec<Pose> = starts.collect();
        let starts: Vec<Start> = poses
            .iter()
            .zip(costs(&poses)?)
            .filter_map(|(&pose, cost)| Some(Start { pose, cost: cost? }))
            .collect();
        let refined = pattern_search(&starts, &REFINEMENT, costs)?;
        // The first of equal ones, so that the grid's comes before those of single references.
        let best = refined.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
        Ok(best.map(|best| best.pose))
    }

    /// The mean of the costs of those that cover enough, and the pixels that they cover.
    fn together(&self, own: impl Iterator<Item = Score>) -> Score {
        let counted: Vec<(f64, u32)> = own
            .zip(&self.members)
            .filter_map(|(score, member)| {
                Some((score.eligible_cost(member.level.least_covered)?, score.covered))
            })
            .collect();
        let covered: u32 = counted.iter().map(|(_, covered)| covered).sum();
        let mean = |(cost, own): &(f64, u32)| cost * (f64::from(*own) / f64::from(covered));
        let is_heard = !counted.is_empty() && 2 * counted.len() >= self.members.len();
        Score { cost: is_heard.then(|| counted.iter().map(mean).sum()), covered }
    }
}
