//! Going down from the reference pose by the derivatives of a smooth cost, instead of scanning.

use std::sync::Arc;

use nalgebra::Point3;

use super::Direct;
use crate::cost::Statistic;
use crate::descent::{Step, View, information, photometric};
use crate::estimator::starts::Level;
use crate::estimator::{CostSummary, Failure, Halt};
use crate::event::{DescentStepped, Moment, PhaseSearched, Stage, ViewRendered};
use crate::geometry::Pose;
use crate::grid::{Lattice, Offset, Phase, Scored};
use crate::image::gaussian_smoothed;
use crate::problem::Problem;
use crate::render::{Score, Scorer};
use crate::trace::Trace;

/// Where a descent stands.
struct Standing {
    reference_from_camera: Pose,
    score: Score,
    evaluations: u64,
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
        let scorer = self.scorer_of(problem);
        trace.checkpoint()?;
        let level = self.starts.level(scorer);
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
        // Every nth point.
        let stride = cloud.points.len().div_ceil(self.descent.max_points).max(1);
        let points = cloud.points.iter().step_by(stride).map(|point| point.position);
        let points: Vec<Point3<f32>> = points.collect();
        trace.stage(Stage::Descend, |trace| {
            for pyramid in (0..self.descent.levels).rev() {
                trace.checkpoint()?;
                let start = standing.reference_from_camera.inverse();
                // Both photos as the level has them.
                let sigma_px = self.descent.sigma_px * f64::from(1 << pyramid);
                let [query, reference] = [&problem.query.photo, &problem.reference.photo]
                    .map(|photo| gaussian_smoothed(&photo.gray, sigma_px));
                let query = (&query, &problem.query.intrinsics);
                let reference = (&reference, &problem.reference.intrinsics);
                let view = View::new(query, reference, &points, &start);
                let mut step = 0;
                let told = |Step { camera_from_reference, cost: smooth_cost }| {
                    let pose = camera_from_reference.inverse();
                    standing = Standing {
                        reference_from_camera: pose,
                        score: scorer.score(&[pose])[0],
                        evaluations: standing.evaluations + 1,
                    };
                    step += 1;
                    trace.checkpoint()?;
                    trace.emit(|| DescentStepped {
                        level: pyramid,
                        step,
                        reference_from_camera: pose,
                        smooth_cost,
                        score: standing.score,
                    })?;
                    trace.emit(|| rendered(&standing, Moment::NewBest))
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
            Ok::<_, Halt>(())
        })?;
        trace.stage(Stage::Assess, |trace| {
            let Standing { reference_from_camera: pose, score, evaluations } = standing;
            if score.eligible_cost(level.least_covered).is_none() {
                let hypotheses = evaluations as usize;
                return Err(Halt::from(Failure::NothingComparable { hypotheses }));
            }
            trace.emit(|| rendered(&standing, Moment::End))?;
            trace.checkpoint()?;
            let (distance_m, radius_m) =
                (pose.translation.vector.norm(), problem.uncertainty_radius_m);
            if distance_m > radius_m {
                return Err(Halt::from(Failure::OutsideRadius { distance_m, radius_m }));
            }
            let summary = CostSummary::new(problem, &level, &pose, score, evaluations);
            trace.emit(|| summary.assessed(Offset::of(&pose)))?;
            Ok((problem.world_from_query(&pose), summary))
        })
    }

    /// Emits the coarse positions of the grid with their costs, for observers.
    fn show_surface(
        &self,
        problem: &Problem,
        level: &Level<Scorer<'_>>,
        trace: &mut Trace<'_>,
    ) -> Result<(), Halt> {
        let (start, phase) = (Offset::default(), Phase::PositionCoarse);
        let lattice = Lattice::new(phase, start, problem.uncertainty_radius_m, &self.starts.grid);
        let lattice = lattice.map_err(Failure::from)?;
        trace.stage(Stage::Search(phase), |trace| {
            let silently = |_: &[Scored], trace: &mut Trace<'_>| trace.checkpoint();
            let surface = self.scored(problem, level, lattice, trace, silently)?;
            // It leads nowhere: the descent begins at the reference.
            trace.emit(|| PhaseSearched { surface: Arc::new(surface), best: None })?;
            Ok(())
        })
    }
}
