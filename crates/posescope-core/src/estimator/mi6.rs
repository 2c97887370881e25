//! `mi6`: mutual information in six degrees of freedom.
//!
//! MI searches three freedoms one after the other: position first, with the reference's heading, then
//! yaw. Three things keep it from the truth where it fails. Only one coarse minimum is followed; height,
//! pitch and roll stay the reference's, which costs more information than the last decimetres give; and
//! grey values alone change with the light. So here the [search](super::multi_start) has many starts and six freedoms,
//! and the cost is that of the [judge](crate::judge): three channels in smaller copies of the photos, and local
//! contrast in the photos themselves.

use std::cell::LazyCell;

use super::direct::Direct;
use super::multi_start::{Found, Level, MultiStart};
use super::{Entry, Estimator, Family, Halt, Outcome, separate_failure};
use crate::cost;
use crate::event::Stage;
use crate::geometry::Pose;
use crate::judge::{Channels, Judge, JudgeParams};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::{Comparison, Objective as _, RenderParams, Score, Scorer, leave_out};
use crate::search::Refined;
use crate::trace::{Cancelled, Trace};

/// The method.
pub(super) const METHOD: Method = Method::named("mi6");

/// The estimator in the registry.
pub(super) fn entry() -> Entry {
    let about = "mutual information in six freedoms: several yaws, starts and channels, refined";
    Entry {
        family: |_, _| Some(Family::MultiStart),
        groups: vec!["judge", "render"],
        cost: Some(shown()),
        ..Entry::new(METHOD, about, |params| Box::new(Mi6::new(params)))
    }
}

/// The registered cost by which the views are explained.
pub(super) fn shown() -> &'static cost::CostEntry {
    let shown = cost::ALL.iter().find(|entry| entry.name == Method::MI.name());
    shown.expect("the paper's cost is registered")
}

/// Why no graphics card takes what the judge scores.
pub(super) const SEVERAL_CHANNELS: &str = "compares more than grey values";

/// The search in six freedoms.
pub struct Mi6 {
    pub(super) multi_start: MultiStart,
    render: RenderParams,
    judge: JudgeParams,
    /// What draws the pictures: grey values, explained by the joint histogram of MI.
    view: Direct,
}

impl Mi6 {
    /// The estimator with these parameters.
    pub fn new(params: &Params) -> Self {
        Self {
            multi_start: MultiStart::new(params),
            render: params.render.clone(),
            judge: params.judge.clone(),
            view: Direct::new(shown(), params),
        }
    }

    /// The cost with photos that are `shrink` times smaller. All three channels lead from farther away, and the one that
    /// the parameters name decides.
    pub(super) fn level(&self, problem: &Problem, shrink: u32) -> Level<Judge> {
        let channels = if shrink > 1 { Channels::Three } else { self.judge.channels };
        let judge = JudgeParams { channels, ..self.judge.clone() };
        self.multi_start.level(Judge::new(problem, &self.render, &judge, shrink))
    }

    /// The view at a pose beside the query, with the score that the judge gave it.
    fn compare(view: &Scorer<'_>, pose: &Pose, score: Score) -> Comparison {
        Comparison { score, ..view.compare(pose) }
    }

    /// Searches all of the disc.
    pub(super) fn search(
        &self,
        problem: &Problem,
        level: &Level<Judge>,
        trace: &mut Trace<'_>,
    ) -> Result<Found, Halt> {
        self.multi_start.check_size(problem)?;
        let cloud = self.view.color(problem, trace)?;
        let smaller = |shrink| self.level(problem, shrink);
        // Only what is shown is drawn in grey values.
        let view = LazyCell::new(|| self.view.scorer_of(problem, cloud));
        let compare = |pose: &Pose, score| Self::compare(&view, pose, score);
        self.multi_start.search(problem, level, Some(&smaller), &compare, trace)
    }
}

impl Estimator for Mi6 {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        leave_out(METHOD, SEVERAL_CHANNELS);
        let found = trace.stage(Stage::Estimator(METHOD), |trace| {
            self.search(problem, &self.level(problem, 1), trace)
        });
        Ok(Outcome::searched(separate_failure(found)?.map(|found| {
            let pose = problem.world_from_query(&found.refined[0].pose);
            (pose, found.summary)
        })))
    }

    fn led_from(&self, problem: &Problem, reference_from_camera: &Pose) -> Option<Refined> {
        self.multi_start.basin_of(problem, &self.level(problem, 1), reference_from_camera)
    }

    fn compare_at(&self, problem: &Problem, world_from_query: &Pose) -> Option<Comparison> {
        let pose = problem.reference_from_query(world_from_query);
        let judge = Judge::new(problem, &self.render, &self.judge, 1);
        let score = judge.score(&[pose])[0];
        Some(Self::compare(&self.view.scorer(problem)?, &pose, score))
    }
}
