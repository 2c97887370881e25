//! Going down from the reference pose by the derivatives of a smooth cost, instead of scanning.

use std::sync::Arc;

use image::GrayImage;
use nalgebra::Point3;

use super::Direct;
use crate::cost::Statistic;
use crate::descent::{Step, View, information, photometric};
use crate::estimator::{CostSummary, Failure, Halt};
use crate::event::{DescentStepped, Moment, PhaseSearched, Stage, ViewRendered};
use crate::geometry::Pose;
use crate::grid::{Lattice, Offset, Phase, Scored, least_covered};
use crate::image::{FloatImage, gaussian_smoothed};
use crate::problem::Problem;
use crate::render::{ColoredCloud, Objective as _, Score, Scorer};
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
        let initial = scorer.score(&[Pose::identity()])[0];
        let mut standing =
            Standing { reference_from_camera: Pose::identity(), score: initial, evaluations: 1 };
        let rendered = |standing: &Standing, moment| ViewRendered {
            moment,
            evaluation: standing.evaluations.saturating_sub(1),
            offset: Offset::of(&standing.reference_from_camera),
            comparison: Arc::new(scorer.compare(&standing.reference_from_camera)),
        };
        trace.emit(|| rendered(&standing, Moment::Start))?;
        // The way is shown over the surface of the method's own cost, which it knows nothing of.
        if trace.wants::<PhaseSearched>() {
            self.show_surface(problem, &scorer, initial, trace)?;
        }
        trace.stage(Stage::Descend, |trace| {
            for level in (0..self.descent.levels).rev() {
                trace.checkpoint()?;
                let start = standing.reference_from_camera.inverse();
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
                        level,
                        step,
                        reference_from_camera: pose,
                        smooth_cost,
                        score: standing.score,
                    })?;
                    trace.emit(|| rendered(&standing, Moment::NewBest))
                };
                let copies = Copies::new(self, problem, level);
                let view = copies.view(problem, &cloud, &start, self.descent.most_points);
                let most_steps = self.descent.most_steps;
                match self.cost.statistic() {
                    Statistic::Histogram { bins, .. } => {
                        information::descend(&view, bins, most_steps, told)
                    }
                    // Of other costs, the one that looks at differences can be descended.
                    _ => photometric::descend(&view, most_steps, told),
                }?;
            }
            Ok::<_, Halt>(())
        })?;
        trace.stage(Stage::Assess, |trace| {
            let Standing { reference_from_camera: pose, score, evaluations } = standing;
            let least = least_covered(self.grid.coverage_floor, initial.covered);
            let Some(best) = score.eligible_cost(least) else {
                let hypotheses = evaluations as usize;
                return Err(Halt::from(Failure::NothingComparable { hypotheses }));
            };
            trace.emit(|| rendered(&standing, Moment::End))?;
            trace.checkpoint()?;
            let (distance_m, radius_m) =
                (pose.translation.vector.norm(), problem.uncertainty_radius_m);
            if distance_m > radius_m {
                return Err(Halt::from(Failure::OutsideRadius { distance_m, radius_m }));
            }
            let area = problem.query.intrinsics.area();
            let summary = CostSummary {
                initial: initial.cost,
                best,
                shuffled: scorer.shuffled(&pose, problem.shuffle_seed()),
                runner_up: None,
                coverage_best: f64::from(score.covered) / area,
                coverage_reference: f64::from(initial.covered) / area,
                evaluations,
            };
            trace.emit(|| summary.assessed(Offset::of(&pose)))?;
            Ok((problem.world_from_query(&pose), summary))
        })
    }

    /// Tells the coarse positions of the grid with their costs, for whoever watches.
    fn show_surface(
        &self,
        problem: &Problem,
        scorer: &Scorer<'_>,
        initial: Score,
        trace: &mut Trace<'_>,
    ) -> Result<(), Halt> {
        let (start, phase) = (Offset::default(), Phase::PositionCoarse);
        let lattice = Lattice::new(phase, start, problem.uncertainty_radius_m, &self.grid);
        let lattice = lattice.map_err(Failure::from)?;
        trace.stage(Stage::Search(phase), |trace| {
            let least = least_covered(self.grid.coverage_floor, initial.covered);
            let silently = |_: &[Scored], trace: &mut Trace<'_>| trace.checkpoint();
            let surface = self.scored(problem, scorer, lattice, least, trace, silently)?;
            // It leads nowhere: the descent begins at the reference.
            trace.emit(|| PhaseSearched { surface: Arc::new(surface), best: None })?;
            Ok(())
        })
    }
}

/// Both photos as a level has them.
struct Copies {
    query: FloatImage,
    reference: FloatImage,
}

impl Copies {
    fn new(direct: &Direct, problem: &Problem, level: usize) -> Self {
        let sigma_px = direct.descent.sigma_px * f64::from(1 << level);
        let copy = |photo: &GrayImage| gaussian_smoothed(photo, sigma_px);
        Self {
            query: copy(&problem.query.photo.gray),
            reference: copy(&problem.reference.photo.gray),
        }
    }

    /// What the query's copy shows of the coloured points, of which every nth is taken.
    fn view(
        &self,
        problem: &Problem,
        cloud: &ColoredCloud,
        camera_from_reference: &Pose,
        most_points: usize,
    ) -> View<'_> {
        let stride = cloud.points.len().div_ceil(most_points).max(1);
        let points: Vec<Point3<f32>> =
            cloud.points.iter().step_by(stride).map(|point| point.position).collect();
        View::new(
            (&self.query, &problem.query.intrinsics),
            (&self.reference, &problem.reference.intrinsics),
            &points,
            camera_from_reference,
        )
    }
}
