//! What PM and MI share: colour the cloud, then search the grid for the pose of least cost
//! (paper, appendix B).

mod descend;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::multi_start::{Level, MultiStart};
use super::{Answered, CostSummary, Estimator, Failure, Halt, Outcome, separate_failure};
use crate::cost::{self, Cost, CostSetting, SearchRule};
use crate::event::{CloudColored, Moment, PhaseSearched, PoseScored, Stage, ViewRendered};
use crate::geometry::Pose;
use crate::grid::{GridParams, Lattice, Offset, Phase, Scored, ScoredLattice, scan};
use crate::image::FloatImage;
use crate::memo::{Key, Recalled, key};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::{ColoredCloud, Objective as _, RenderParams, Score, Scorer, leave_out};
use crate::search::Refined;
use crate::search::descent::DescentParams;
use crate::trace::{Cancelled, Trace};

/// A direct estimator: it searches the pose whose synthetic view has the lowest cost.
pub struct Direct {
    method: Method,
    cost: Box<dyn Cost>,
    search: SearchRule,
    render: RenderParams,
    descent: DescentParams,
    pub(super) multi_start: MultiStart,
    /// Which cost, with all its parameters.
    cost_key: Key,
}

impl Direct {
    /// The estimator that searches the pose of least registered cost.
    #[doc(hidden)]
    pub fn new(entry: &cost::CostEntry, params: &Params) -> Self {
        let setting = params.costs.of(entry).cloned();
        let CostSetting { cost, search } = setting.unwrap_or_else(|| CostSetting::new(entry));
        let cost_key = key((entry.name, &cost));
        Self { search, cost_key, ..Self::searching(entry.name, cost, params) }
    }

    /// The estimator of your own cost: it renders and searches the grid as PM and MI do, by
    /// `params.render` and `params.grid`, and emits its events as the method `name`.
    ///
    /// Its cached scores are never used for another cost, even of the same name: every estimator that
    /// is made here has its own key.
    pub fn searching(name: &'static str, cost: Box<dyn Cost>, params: &Params) -> Self {
        static MADE: AtomicU64 = AtomicU64::new(0);
        Self {
            method: Method::named(name),
            cost,
            search: SearchRule::Grid,
            render: params.render.clone(),
            descent: params.descent.clone(),
            multi_start: MultiStart::new(params),
            cost_key: key(("unregistered", MADE.fetch_add(1, Ordering::Relaxed))),
        }
    }
}

impl Estimator for Direct {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        let found = trace.stage(Stage::Estimator(self.method), |trace| match self.search {
            SearchRule::Grid => self.search_grid(problem, trace),
            SearchRule::MultiStart => self.search_starts(problem, trace),
            SearchRule::Descent => self.descend(problem, trace),
        });
        Ok(Outcome::searched(separate_failure(found)?))
    }

    fn scorer(&self, problem: &Problem) -> Option<Scorer<'_>> {
        Some(self.scorer_of(problem, self.colored(problem).value))
    }

    fn led_from(&self, problem: &Problem, reference_from_camera: &Pose) -> Option<Refined> {
        match self.search {
            SearchRule::Grid => None,
            SearchRule::MultiStart => {
                let cloud = self.colored(problem).value;
                let level = self.multi_start.level(self.scorer_of(problem, cloud));
                self.multi_start.basin_of(problem, &level, reference_from_camera)
            }
            SearchRule::Descent => self.descended_from(problem, reference_from_camera),
        }
    }
}

impl Direct {
    fn search_grid(
        &self,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<(Pose, CostSummary), Halt> {
        let radius = problem.uncertainty_radius_m;
        check_size(&self.multi_start.grid, radius)?;
        if !self.cost.statistic().is_counted() {
            leave_out(self.method, "has a cost that whole numbers do not decide");
        }
        let cloud = self.color(problem, trace)?;
        trace.checkpoint()?;
        let scorer = self.scorer_of(problem, cloud);
        trace.checkpoint()?;

        // The reference pose is the starting value, and its coverage the measure of all others.
        let start = Offset::default();
        let level = self.multi_start.level(scorer);
        let mut search = GridSearch { direct: self, problem, level: &level, evaluations: 1 };
        trace.emit(|| search.render(Moment::Start, start))?;
        let best = Best { offset: start, score: Some(level.initial) };
        let (best, coarse) =
            coarse_to_fine(&self.multi_start.grid, radius, best, trace, |lattice, trace| {
                search.phase(lattice, trace)
            })?;

        trace.stage(Stage::Assess, |trace| {
            let evaluations = search.evaluations;
            let Some(score) = best.score.filter(|score| score.cost.is_some()) else {
                let hypotheses = evaluations as usize;
                return Err(Halt::from(Failure::NothingComparable { hypotheses }));
            };
            trace.emit(|| search.render(Moment::End, best.offset))?;
            trace.checkpoint()?;
            let answered = Answered {
                reference_from_camera: best.offset.reference_from_camera(),
                score,
                runner_up: coarse
                    .and_then(|surface| surface.local_minima().get(1).map(|minimum| minimum.1)),
                evaluations,
            };
            let summary = CostSummary::of(problem, &level, &answered);
            trace.emit(|| summary.assessed(best.offset))?;
            Ok((problem.world_from_query(&answered.reference_from_camera), summary))
        })
    }

    /// The search of `mi6`, without its levels of smaller photos.
    fn search_starts(
        &self,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<(Pose, CostSummary), Halt> {
        self.multi_start.check_size(problem)?;
        let cloud = self.color(problem, trace)?;
        let level = self.multi_start.level(self.scorer_of(problem, cloud));
        let compare = |pose: &Pose, _| level.objective.compare(pose);
        let found = self.multi_start.search(problem, &level, None, &compare, trace)?;
        Ok((problem.world_from_query(&found.refined[0].pose), found.summary))
    }

    /// Colours the cloud, and emits it.
    pub(super) fn color(
        &self,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<Arc<ColoredCloud>, Halt> {
        trace.stage(Stage::Color, |trace| {
            let Recalled { value: cloud, reused } = self.colored(problem);
            trace.note_reuse(reused);
            trace.emit(|| CloudColored { cloud: Arc::clone(&cloud) })?;
            if cloud.points.is_empty() {
                let points = problem.reference.cloud.len();
                return Err(Halt::from(Failure::NothingInView { points }));
            }
            Ok(cloud)
        })
    }

    pub(super) fn colored(&self, problem: &Problem) -> Recalled<ColoredCloud> {
        let reference = &problem.reference;
        let bytes = |cloud: &ColoredCloud| size_of_val(cloud.points.as_slice());
        let channel = self.cost.reference_channel();
        reference.memo.recall((&self.render, channel.key), bytes, || {
            reference.visible_cloud(&self.render).colored_by(channel.of(&reference.photo.gray))
        })
    }

    /// What scores poses of the query by what its photo and the coloured cloud show.
    pub(super) fn scorer_of(&self, problem: &Problem, cloud: Arc<ColoredCloud>) -> Scorer<'_> {
        let query = &problem.query;
        let bytes = |image: &FloatImage| size_of_val(image.as_raw().as_slice());
        let channel = self.cost.query_channel();
        let image = query.memo.recall(channel.key, bytes, || channel.of(&query.photo.gray));
        Scorer::new(cloud, image.value, &query.intrinsics, self.render.splat_px, self.cost.as_ref())
    }
}

impl Direct {
    /// Scores a lattice, or recalls its scores from the query, and passes them to `tell` in scan order.
    fn scored(
        &self,
        problem: &Problem,
        &Level { objective: ref scorer, least_covered, .. }: &Level<Scorer<'_>>,
        lattice: Lattice,
        trace: &mut Trace<'_>,
        mut tell: impl FnMut(&[Scored], &mut Trace<'_>) -> Result<(), Cancelled>,
    ) -> Result<ScoredLattice, Cancelled> {
        let batch = scorer.batch(lattice.cells());
        let mut surface = None;
        let bytes = |scores: &Vec<Score>| size_of_val(scores.as_slice());
        let inputs = (self.cost_key, &self.render, &lattice);
        let found = problem.try_recall(inputs, bytes, || {
            let score = |poses: &[Pose]| scorer.score(poses);
            let tell = |some: &[Scored]| tell(some, trace);
            let mut scored = scan(lattice.clone(), least_covered, batch, score, tell)?;
            // Settled scores are cached: a later scorer asks no device, so it would correct nothing.
            scored.settle(scorer);
            let scores = scored.scores.iter().flatten().copied().collect();
            surface = Some(scored);
            Ok(scores)
        })?;
        trace.note_reuse(found.reused);
        if let Some(surface) = surface {
            return Ok(surface);
        }
        let mut known = found.value.iter().copied();
        let score = |poses: &[Pose]| known.by_ref().take(poses.len()).collect();
        scan(lattice, least_covered, batch, score, |some| tell(some, trace))
    }
}

/// The best hypothesis of a search so far.
#[derive(Clone, Copy)]
pub(super) struct Best {
    pub(super) offset: Offset,
    /// `None` before anything was scored.
    pub(super) score: Option<Score>,
}

impl Best {
    /// Whether a score is worse. A later round is centred on the best pose, but its coarse disc is the
    /// reference's, so its lattice need not contain that pose.
    fn beats(&self, score: &Score, least_covered: u32) -> bool {
        let best = self.score.and_then(|best| best.eligible_cost(least_covered));
        let cost = score.eligible_cost(least_covered);
        best.zip(cost).is_some_and(|(best, cost)| best < cost)
    }
}

/// The search of appendix B: scores coarse and fine positions, then coarse and fine yaws, each around the best
/// hypothesis so far, in one or more rounds. Returns the best and the first coarse positions.
///
/// A lattice where nothing has a cost leaves the search where it is.
pub(super) fn coarse_to_fine(
    grid: &GridParams,
    radius_m: f64,
    mut best: Best,
    trace: &mut Trace<'_>,
    mut score: impl FnMut(Lattice, &mut Trace<'_>) -> Result<Arc<ScoredLattice>, Cancelled>,
) -> Result<(Best, Option<Arc<ScoredLattice>>), Halt> {
    let mut coarse = None;
    for round in 0..grid.rounds {
        for phase in Phase::ALL {
            let lattice =
                Lattice::new(phase, best.offset, radius_m, grid).map_err(Failure::from)?;
            let surface = trace.stage(Stage::Search(phase), |trace| score(lattice, trace))?;
            if let Some(cell) = surface.minimum()
                && let (Some(offset), Some(score)) =
                    (surface.lattice.offset(cell), surface.scores[cell])
                && (round == 0 || !best.beats(&score, surface.least_covered))
            {
                best = Best { offset, score: Some(score) };
            }
            if phase == Phase::PositionCoarse {
                if let Some((cost, hypotheses)) = surface.flat_cost() {
                    return Err(Halt::from(Failure::FlatCost { cost, hypotheses }));
                }
                coarse.get_or_insert(surface);
            }
        }
    }
    Ok((best, coarse))
}

/// Fails where a lattice of the search is too large. Its size does not depend on its centre: nothing need be
/// scored before.
pub(super) fn check_size(grid: &GridParams, radius_m: f64) -> Result<(), Failure> {
    for phase in Phase::ALL {
        Lattice::new(phase, Offset::default(), radius_m, grid)?;
    }
    Ok(())
}

/// The state of a search over the grid.
struct GridSearch<'a, 'cost> {
    direct: &'a Direct,
    problem: &'a Problem,
    level: &'a Level<Scorer<'cost>>,
    evaluations: u64,
}

impl GridSearch<'_, '_> {
    /// Scores a lattice and emits its hypotheses, and the view of each that is the best so far.
    fn phase(
        &mut self,
        lattice: Lattice,
        trace: &mut Trace<'_>,
    ) -> Result<Arc<ScoredLattice>, Cancelled> {
        let &mut Self { direct, problem, level, .. } = self;
        let (phase, covered_at_reference) = (lattice.phase, level.initial.covered);
        let tell = |some: &[Scored], trace: &mut Trace<'_>| {
            trace.checkpoint()?;
            for &one in some {
                let evaluation = self.evaluations;
                self.evaluations += 1;
                trace.emit(|| PoseScored::new(phase, evaluation, one, covered_at_reference))?;
                if one.is_best {
                    trace.emit(|| self.render(Moment::NewBest, one.offset))?;
                }
            }
            Ok(())
        };
        let surface = direct.scored(problem, level, lattice, trace, tell)?;
        let surface = Arc::new(surface);
        trace.emit(|| PhaseSearched {
            surface: Arc::clone(&surface),
            best: surface.minimum().and_then(|cell| surface.lattice.offset(cell)),
        })?;
        Ok(surface)
    }

    fn render(&self, moment: Moment, offset: Offset) -> ViewRendered {
        ViewRendered {
            moment,
            evaluation: self.evaluations.saturating_sub(1),
            offset,
            comparison: Arc::new(self.level.objective.compare(&offset.reference_from_camera())),
        }
    }
}
