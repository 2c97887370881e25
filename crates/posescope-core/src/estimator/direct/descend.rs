//! Going down from the reference pose by the derivatives of a smooth cost, instead of scanning.

use std::sync::Arc;

use nalgebra::Point3;

use super::Direct;
use crate::cost::Statistic;
use crate::estimator::multi_start::Level;
use crate::estimator::{Answered, CostSummary, Failure, Halt};
use crate::event::{DescentStepped, Moment, PhaseSearched, Stage, ViewRendered};
use crate::geometry::Pose;
use crate::grid::{Lattice, Offset, Phase, Scored};
use crate::image::gaussian_smoothed;
use crate::problem::Problem;
use crate::render::{ColoredCloud, Score, Scorer};
use crate::search::descent::{Step, View, information, photometric};
use crate::search::{Refined, Start};
use crate::trace::{Cancelled, Trace};

/// Where a descent stands.
struct Standing {
    reference_from_camera: Pose,
    score: Score,
    evaluations: u64,
}

/// A step of a descent: on which copy of the photos, which of the steps there, where it leads, and the smooth cost there.
struct SteppedTo {
    level: usize,
    step: usize,
    reference_from_camera: Pose,
    smooth_cost: f64,
}

impl Direct {
    /// The minimum that the reference pose leads to, in six freedoms, from a coarse copy of the photos to
    /// the finest. The answer is where the smooth cost ends, whatever the method's own cost says of other
    /// places.
    pub(super) fn descend(
        &self,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<(Pose, CostSummary), Halt> {
        let cloud = self.color(problem, trace)?;
        let level = self.multi_start.level(self.scorer_of(problem, Arc::clone(&cloud)));
        trace.checkpoint()?;
        let scorer = &level.objective;
        let mut standing = Standing {
            reference_from_camera: Pose::identity(),
            score: level.initial,
            evaluations: 1,
        };
        let rendered = |standing: &Standing, moment| ViewRendered {
            moment,
            evaluation: standing.evaluations.saturating_sub(1),
            offset: Offset::of(&standing.reference_from_camera),
            comparison: Arc::new(scorer.compare(&standing.reference_from_camera)),
        };
        trace.emit(|| rendered(&standing, Moment::Start))?;
        // The way is shown over the surface of the method's own cost, which it knows nothing of.
        if trace.wants::<PhaseSearched>() {
            self.show_surface(problem, &level, trace)?;
        }
        trace.stage(Stage::Descend, |trace| {
            let start = standing.reference_from_camera;
            self.go_down(problem, &cloud, start, trace, |step, trace| {
                let SteppedTo { level, step, reference_from_camera: pose, smooth_cost } = step;
                standing = Standing {
                    reference_from_camera: pose,
                    score: scorer.score(&[pose])[0],
                    evaluations: standing.evaluations + 1,
                };
                trace.checkpoint()?;
                trace.emit(|| DescentStepped {
                    level,
                    step,
                    reference_from_camera: pose,
                    smooth_cost,
                    score: standing.score,
                })?;
                trace.emit(|| rendered(&standing, Moment::NewBest))
            })
        })?;
        trace.stage(Stage::Assess, |trace| {
            let Standing { reference_from_camera: pose, score, evaluations } = standing;
            if score.eligible_cost(level.least_covered).is_none() {
                let hypotheses = evaluations as usize;
                return Err(Halt::from(Failure::NothingComparable { hypotheses }));
            }
            trace.emit(|| rendered(&standing, Moment::End))?;
            trace.checkpoint()?;
            let reach_m = problem.uncertainty_radius_m;
            if pose.translation.vector.norm() > reach_m {
                return Err(Halt::from(Failure::LedOutside { minima: 1, reach_m }));
            }
            let answered =
                Answered { reference_from_camera: pose, score, runner_up: None, evaluations };
            let summary = CostSummary::of(problem, &level, &answered);
            trace.emit(|| summary.assessed(Offset::of(&pose)))?;
            Ok((problem.world_from_query(&pose), summary))
        })
    }

    /// Goes down from a pose (`reference_from_camera`), level by level, and tells each step. Returns where it ends.
    fn go_down(
        &self,
        problem: &Problem,
        cloud: &ColoredCloud,
        start: Pose,
        trace: &mut Trace<'_>,
        mut tell: impl FnMut(SteppedTo, &mut Trace<'_>) -> Result<(), Cancelled>,
    ) -> Result<Pose, Cancelled> {
        // Every nth point.
        let stride = cloud.points.len().div_ceil(self.descent.max_points).max(1);
        let points = cloud.points.iter().step_by(stride).map(|point| point.position);
        let points: Vec<Point3<f32>> = points.collect();
        let mut reference_from_camera = start;
        for level in (0..self.descent.levels).rev() {
            trace.checkpoint()?;
            // Both photos as the level has them.
            let sigma_px = self.descent.sigma_px * f64::from(1 << level);
            let [query, reference] = [&problem.query.photo, &problem.reference.photo]
                .map(|photo| gaussian_smoothed(&photo.gray, sigma_px));
            let query = (&query, &problem.query.intrinsics);
            let reference = (&reference, &problem.reference.intrinsics);
            let view = View::new(query, reference, &points, &reference_from_camera.inverse());
            let mut step = 0;
            let told = |Step { camera_from_reference, cost: smooth_cost }| {
                reference_from_camera = camera_from_reference.inverse();
                step += 1;
                tell(SteppedTo { level, step, reference_from_camera, smooth_cost }, trace)
            };
            let max_steps = self.descent.max_steps;
            match self.cost.statistic() {
                Statistic::Histogram { bins, .. } => {
                    information::descend(&view, bins, max_steps, told)
                }
                // Of other costs, the one that looks at differences can be descended.
                _ => photometric::descend(&view, max_steps, told),
            }?;
        }
        Ok(reference_from_camera)
    }

    /// The minimum that a pose leads to, though no descent started there; `None` where either lies outside of the disc, or
    /// too little is covered.
    pub(super) fn descended_from(&self, problem: &Problem, start: &Pose) -> Option<Refined> {
        let is_inside =
            |pose: &Pose| pose.translation.vector.norm() <= problem.uncertainty_radius_m;
        let cloud = self.colored(problem).value;
        let level = self.multi_start.level(self.scorer_of(problem, Arc::clone(&cloud)));
        let cost_of = |pose: Pose| {
            let score = level.objective.score(&[pose])[0];
            score.eligible_cost(level.least_covered).filter(|_| is_inside(&pose))
        };
        let start = Start { pose: *start, cost: cost_of(*start)? };
        let mut evaluations = 1;
        let count = |_, _: &mut Trace<'_>| {
            evaluations += 1;
            Ok(())
        };
        let pose = self.go_down(problem, &cloud, start.pose, &mut Trace::off(), count).ok()?;
        Some(Refined { start, pose, cost: cost_of(pose)?, evaluations })
    }

    /// Emits the coarse positions of the grid with their costs, for observers; nothing where there are too many. The
    /// descent needs none of it.
    fn show_surface(
        &self,
        problem: &Problem,
        level: &Level<Scorer<'_>>,
        trace: &mut Trace<'_>,
    ) -> Result<(), Cancelled> {
        let (start, phase) = (Offset::default(), Phase::PositionCoarse);
        let radius_m = problem.uncertainty_radius_m;
        let Ok(lattice) = Lattice::new(phase, start, radius_m, &self.multi_start.grid) else {
            return Ok(());
        };
        trace.stage(Stage::Search(phase), |trace| {
            let silently = |_: &[Scored], trace: &mut Trace<'_>| trace.checkpoint();
            let surface = self.scored(problem, level, lattice, trace, silently)?;
            // It leads nowhere: the descent begins at the reference.
            trace.emit(|| PhaseSearched { surface: Arc::new(surface), best: None })?;
            Ok(())
        })
    }
}
