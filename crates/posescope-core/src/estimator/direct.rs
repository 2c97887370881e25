//! What PM and MI share: colour the cloud, then search the grid for the pose of least cost
//! (paper, appendix B).

mod descend;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::{CostSummary, Estimator, Failure, Halt, Outcome, separate_failure};
use crate::cost::{self, Cost, shuffled};
use crate::descent::DescentParams;
use crate::event::{
    CloudColored, MinimumAssessed, Moment, PhaseSearched, PoseScored, Stage, ViewRendered,
};
use crate::geometry::Pose;
use crate::grid::{GridParams, Lattice, Offset, Phase, ScoredLattice, least_covered};
use crate::memo::{Exact, Key, MemoId, Recalled, Remembered};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::{ColoredCloud, Comparison, RenderParams, Score, Scorer, leave_out};
use crate::trace::{Cancelled, Trace};

/// A direct estimator: a cost and the way to search it.
pub struct Direct {
    method: Method,
    cost: Box<dyn Cost>,
    render: RenderParams,
    pub(super) grid: GridParams,
    descent: DescentParams,
    /// Which cost, with all its parameters.
    cost_key: Key,
}

impl Direct {
    /// The estimator that searches the pose of least registered cost.
    pub fn new(entry: &cost::Entry, params: &Params) -> Self {
        let default = (entry.params)();
        let cost = params.costs.of(entry).unwrap_or(default.as_ref());
        Self {
            method: Method::named(entry.name),
            cost: cost.cost(),
            render: params.render.clone(),
            grid: params.grid.clone(),
            descent: params.descent.clone(),
            cost_key: Key::new((entry.name, cost.key())),
        }
    }

    /// The estimator of a cost that is in no registry: it renders and searches as the others do, by
    /// `params.render` and `params.grid`, and tells what it does as the method of this name.
    ///
    /// What is remembered of its scores is never taken for that of another cost, not even of one with
    /// the same name: every estimator that is made here has a key of its own.
    pub fn searching(name: &'static str, cost: Box<dyn Cost>, params: &Params) -> Self {
        static MADE: AtomicU64 = AtomicU64::new(0);
        Self {
            method: Method::named(name),
            cost,
            render: params.render.clone(),
            grid: params.grid.clone(),
            descent: params.descent.clone(),
            cost_key: Key::new(("unregistered", MADE.fetch_add(1, Ordering::Relaxed))),
        }
    }
}

impl Estimator for Direct {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        let found =
            trace.stage(Stage::Estimator(self.method), |trace| match self.cost.descended() {
                None => self.search(problem, trace),
                Some(smooth) => self.descend(smooth, problem, trace),
            });
        Ok(match separate_failure(found)? {
            Ok((pose, cost)) => {
                Outcome { pose: Ok(pose), counts: None, cost: Some(cost), fell_back: false }
            }
            Err(failure) => Outcome::failed(failure),
        })
    }

    fn with_scorer(&self, problem: &Problem, work: &mut dyn FnMut(&Scorer<'_>)) -> bool {
        let cloud = self.colored(problem).value;
        work(&self.scorer(problem, &cloud));
        true
    }

    fn compare_at(&self, problem: &Problem, world_from_query: &Pose) -> Option<Comparison> {
        let cloud = self.colored(problem).value;
        let reference_from_query = problem.reference_from_query(world_from_query);
        Some(self.scorer(problem, &cloud).compare(&reference_from_query))
    }
}

impl Direct {
    fn search(
        &self,
        problem: &Problem,
        trace: &mut Trace<'_>,
    ) -> Result<(Pose, CostSummary), Halt> {
        let radius = problem.uncertainty_radius_m;
        // How large a lattice is depends on no centre, so none is refused after the others were scored.
        for phase in Phase::ALL {
            Lattice::new(phase, Offset::default(), radius, &self.grid).map_err(Failure::from)?;
        }
        if self.cost.tallying().is_none() {
            leave_out(self.method, "has a cost that whole numbers do not decide");
        }
        let cloud = self.colored_and_told(problem, trace)?;
        trace.checkpoint()?;
        let scorer = self.scorer(problem, &cloud);
        trace.checkpoint()?;

        // The reference pose is the starting value, and its coverage the measure of all others.
        let start = Offset::default();
        let initial = scorer.score(&[start.reference_from_camera()])[0];
        let mut search = Search {
            scorer: &scorer,
            memory: Memory { direct: self, problem },
            covered_at_reference: initial.covered,
            least_covered: least_covered(self.grid.coverage_floor, initial.covered),
            evaluations: 1,
            best: start,
            best_score: initial,
            is_later_round: false,
        };
        trace.emit(|| search.render(Moment::Start, start))?;

        let mut coarse_positions = None;
        for round in 0..self.grid.rounds {
            search.is_later_round = round > 0;
            for phase in Phase::ALL {
                let lattice =
                    Lattice::new(phase, search.best, radius, &self.grid).map_err(Failure::from)?;
                let surface =
                    trace.stage(Stage::Search(phase), |trace| search.phase(lattice, trace))?;
                if phase == Phase::PositionCoarse {
                    if let Some((cost, hypotheses)) = surface.flat_cost() {
                        return Err(Halt::from(Failure::FlatCost { cost, hypotheses }));
                    }
                    coarse_positions.get_or_insert(surface);
                }
            }
        }

        trace.stage(Stage::Assess, |trace| {
            let Search { best, best_score, evaluations, .. } = search;
            let Some(best_cost) = best_score.cost else {
                let hypotheses = evaluations as usize;
                return Err(Halt::from(Failure::NothingComparable { hypotheses }));
            };
            trace.emit(|| search.render(Moment::End, best))?;
            trace.checkpoint()?;
            let area = problem.query.intrinsics.area();
            let summary = CostSummary {
                initial: initial.cost,
                best: best_cost,
                shuffled: search.shuffled_cost(problem.random_seed("shuffled pixels")),
                runner_up: coarse_positions
                    .and_then(|surface| surface.local_minima().get(1).map(|minimum| minimum.1)),
                coverage_best: f64::from(best_score.covered) / area,
                coverage_reference: f64::from(initial.covered) / area,
                evaluations,
            };
            trace.emit(|| MinimumAssessed {
                offset: best,
                initial: summary.initial,
                best: summary.best,
                shuffled: summary.shuffled,
                runner_up: summary.runner_up,
            })?;
            Ok((problem.world_from_query(&best.reference_from_camera()), summary))
        })
    }

    fn colored_and_told(
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
        let key = ColoringKey {
            render: Exact::of(&self.render),
            channel: self.cost.reference_channel_key(),
        };
        reference.memo.recall(key, || {
            let value = self.cost.reference_channel(&reference.photo.gray);
            reference.visible_cloud(&self.render).colored_by(value)
        })
    }

    pub(super) fn scorer<'a>(&'a self, problem: &Problem, cloud: &'a ColoredCloud) -> Scorer<'a> {
        let query = &problem.query;
        let channel = query
            .memo
            .recall(self.cost.query_channel_key(), || self.cost.query_channel(&query.photo.gray));
        Scorer::new(
            &cloud.points,
            channel.value,
            &query.intrinsics,
            self.render.splat_px,
            self.cost.as_ref(),
        )
    }
}

/// What a coloured cloud depends on beside the reference.
#[derive(PartialEq, Eq, Hash)]
struct ColoringKey {
    render: Exact<RenderParams>,
    channel: Key,
}

/// Where the scores of a lattice are remembered: with the query, under all that they depend on.
#[derive(Clone, Copy)]
struct Memory<'a> {
    direct: &'a Direct,
    problem: &'a Problem,
}

/// What scores depend on beside the query.
#[derive(PartialEq, Eq, Hash)]
struct ScoresKey {
    reference: MemoId,
    cost: Key,
    render: Exact<RenderParams>,
    lattice: Exact<Lattice>,
}

/// Remembered scores.
struct LatticeScores(Vec<Score>);

impl Remembered for LatticeScores {
    fn heap_bytes(&self) -> usize {
        size_of_val(self.0.as_slice())
    }
}

impl Memory<'_> {
    fn scores(
        self,
        lattice: &Lattice,
        score: impl FnOnce() -> Result<Vec<Score>, Cancelled>,
    ) -> Result<Recalled<LatticeScores>, Cancelled> {
        let Self { direct, problem } = self;
        let Some(id) = problem.reference.memo.id() else {
            return Ok(Recalled::made(Arc::new(LatticeScores(score()?))));
        };
        let key = ScoresKey {
            reference: id,
            cost: direct.cost_key.clone(),
            render: Exact::of(&direct.render),
            lattice: Exact::of(lattice),
        };
        let memo = &problem.query.memo;
        memo.try_recall(key, || Ok(LatticeScores(score()?)))
    }
}

/// The state of a search: where it stands and what it has seen.
struct Search<'a, 'cost> {
    scorer: &'a Scorer<'cost>,
    memory: Memory<'a>,
    covered_at_reference: u32,
    least_covered: u32,
    evaluations: u64,
    best: Offset,
    best_score: Score,
    is_later_round: bool,
}

impl Search<'_, '_> {
    /// Scores a lattice, some hypotheses at a time, tells the scores in scan order, and moves to its
    /// minimum.
    ///
    /// A lattice where nothing has a cost leaves the search where it is.
    fn phase(
        &mut self,
        lattice: Lattice,
        trace: &mut Trace<'_>,
    ) -> Result<Arc<ScoredLattice>, Cancelled> {
        let mut surface = ScoredLattice {
            scores: vec![None; lattice.cells()],
            lattice: lattice.clone(),
            least_covered: self.least_covered,
        };
        let mut least = None;
        let (memory, scorer) = (self.memory, self.scorer);
        let at_a_time = scorer.at_a_time_of(lattice.cells());
        let found = memory.scores(&lattice, || {
            let mut hypotheses = lattice.hypotheses();
            loop {
                trace.checkpoint()?;
                let some: Vec<_> = hypotheses.by_ref().take(at_a_time).collect();
                if some.is_empty() {
                    break;
                }
                let poses: Vec<Pose> =
                    some.iter().map(|(_, offset)| offset.reference_from_camera()).collect();
                for ((cell, offset), score) in some.into_iter().zip(scorer.score(&poses)) {
                    surface.scores[cell] = Some(score);
                    self.tell(lattice.phase, offset, score, &mut least, trace)?;
                }
            }
            // Settled scores are cached: a later scorer asks no device, so it would correct nothing.
            surface.settle(scorer);
            Ok(surface.scores.iter().flatten().copied().collect())
        })?;
        trace.note_reuse(found.reused);
        if found.reused {
            for ((cell, offset), &score) in lattice.hypotheses().zip(&found.value.0) {
                surface.scores[cell] = Some(score);
                self.tell(lattice.phase, offset, score, &mut least, trace)?;
            }
        }
        let surface = Arc::new(surface);
        let minimum = surface.minimum();
        if let Some(cell) = minimum
            && let (Some(offset), Some(score)) =
                (surface.lattice.offset(cell), surface.scores[cell])
            && !self.is_worse(&score)
        {
            (self.best, self.best_score) = (offset, score);
        }
        trace.emit(|| PhaseSearched {
            surface: Arc::clone(&surface),
            best: minimum.and_then(|cell| surface.lattice.offset(cell)),
        })?;
        Ok(surface)
    }

    /// Whether a score is worse than the best so far. A later round is centred on the best pose, but its
    /// coarse disc is the reference's, so its lattice need not contain that pose.
    fn is_worse(&self, score: &Score) -> bool {
        self.is_later_round && {
            let eligible = |score: &Score| score.eligible_cost(self.least_covered);
            match (eligible(score), eligible(&self.best_score)) {
                (Some(cost), Some(best)) => cost > best,
                _ => false,
            }
        }
    }

    /// Tells the score of a hypothesis, and the view where it is the `least` of its lattice so far.
    fn tell(
        &mut self,
        phase: Phase,
        offset: Offset,
        score: Score,
        least: &mut Option<f64>,
        trace: &mut Trace<'_>,
    ) -> Result<(), Cancelled> {
        let cost = score.eligible_cost(self.least_covered);
        let is_best = cost.is_some_and(|cost| least.is_none_or(|least| cost < least));
        if is_best {
            *least = cost;
        }
        let evaluation = self.evaluations;
        self.evaluations += 1;
        trace.emit(|| PoseScored {
            phase,
            evaluation,
            offset,
            score,
            coverage: f64::from(score.covered) / f64::from(self.covered_at_reference.max(1)),
            is_best,
        })?;
        if is_best {
            trace.emit(|| self.render(Moment::NewBest, offset))?;
        }
        Ok(())
    }

    fn render(&self, moment: Moment, offset: Offset) -> ViewRendered {
        ViewRendered {
            moment,
            evaluation: self.evaluations.saturating_sub(1),
            offset,
            comparison: Arc::new(self.scorer.compare(&offset.reference_from_camera())),
        }
    }

    /// The cost at the minimum if the view's pixels had nothing to do with the query's: what a
    /// minimum must beat to mean anything.
    fn shuffled_cost(&self, seed: u64) -> Option<f64> {
        let best = self.best.reference_from_camera();
        let pairs = shuffled(&self.scorer.compare(&best).pairs, seed);
        self.memory.direct.cost.evaluate(&pairs)
    }
}
