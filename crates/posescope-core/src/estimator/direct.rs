//! What PM and MI share: colour the cloud, then search the grid for the pose of least cost
//! (paper, appendix B).

use std::sync::Arc;

use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64;

use super::{CostSummary, Estimator, Failure, Halt, Outcome, settle};
use crate::cost::{self, Cost};
use crate::event::{
    CloudColored, MinimumAssessed, Moment, PhaseSearched, PoseScored, Stage, ViewRendered,
};
use crate::geometry::Pose;
use crate::grid::{GridParams, Lattice, Offset, Phase, ScoredLattice, least_covered};
use crate::memo::Recalled;
use crate::method::Method;
use crate::params::Params;
use crate::problem::{Problem, ReferenceTuple};
use crate::render::{ColoredCloud, Comparison, RenderParams, Score, Scorer, color_cloud_by};
use crate::trace::{Cancelled, Trace};

/// A direct estimator: a cost and the way to search it.
pub struct Direct {
    method: Method,
    cost: Box<dyn Cost>,
    render: RenderParams,
    grid: GridParams,
    /// The cost with all its parameters, as a key of what is remembered.
    cost_key: String,
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
            cost_key: format!("{} {cost:?}", entry.name),
        }
    }
}

impl Estimator for Direct {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        let found = trace.stage(Stage::Estimator(self.method), |trace| {
            self.search(problem, trace)
        });
        Ok(match settle(found)? {
            Ok((pose, cost)) => Outcome {
                pose: Ok(pose),
                counts: None,
                cost: Some(cost),
            },
            Err(failure) => Outcome {
                pose: Err(failure),
                counts: None,
                cost: None,
            },
        })
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
        let cloud = trace.stage(Stage::Color, |trace| {
            let Recalled {
                value: cloud,
                reused,
            } = self.colored(problem);
            trace.note_reuse(reused);
            trace.emit(|| CloudColored {
                cloud: Arc::clone(&cloud),
            })?;
            if cloud.points.is_empty() {
                let points = problem.reference.cloud.len();
                return Err(Halt::from(Failure::NothingInView { points }));
            }
            Ok(cloud)
        })?;
        let scorer = self.scorer(problem, &cloud);

        // The reference pose is the starting value, and its coverage the measure of all others.
        let start = Offset::default();
        let initial = scorer.score(&[start.reference_from_camera()])[0];
        let mut search = Search {
            scorer: &scorer,
            memory: Memory {
                direct: self,
                problem,
            },
            covered_at_reference: initial.covered,
            least_covered: least_covered(self.grid.coverage_floor, initial.covered),
            evaluations: 1,
            best: start,
            best_score: initial,
        };
        trace.emit(|| search.render(Moment::Start, start))?;

        let mut coarse_positions = None;
        for _ in 0..self.grid.rounds {
            for phase in Phase::ALL {
                let radius = problem.uncertainty_radius_m;
                let lattice = Lattice::new(phase, search.best, radius, &self.grid);
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
            let Search {
                best,
                best_score,
                evaluations,
                ..
            } = search;
            let Some(best_cost) = best_score.cost else {
                let hypotheses = evaluations as usize;
                return Err(Halt::from(Failure::NothingComparable { hypotheses }));
            };
            trace.emit(|| search.render(Moment::End, best))?;
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
            Ok((
                problem.world_from_query(&best.reference_from_camera()),
                summary,
            ))
        })
    }

    fn colored(&self, problem: &Problem) -> Recalled<ColoredCloud> {
        let reference = &problem.reference;
        let key = (&self.render, self.cost.reference_channel_name());
        reference.memo.recall(&key, || {
            color_cloud_by(
                &reference.cloud,
                &reference.intrinsics,
                &self.render,
                self.cost.reference_channel(&reference.photo.gray),
            )
        })
    }

    fn scorer<'a>(&'a self, problem: &Problem, cloud: &'a ColoredCloud) -> Scorer<'a> {
        let query = &problem.query;
        let channel = query.memo.recall(&self.cost.query_channel_name(), || {
            self.cost.query_channel(&query.photo.gray)
        });
        Scorer::new(
            &cloud.points,
            channel.value,
            &query.intrinsics,
            self.render.splat_px,
            self.cost.as_ref(),
        )
    }
}

/// Where the scores of a lattice are remembered: with the query, under all that they depend on.
struct Memory<'a> {
    direct: &'a Direct,
    problem: &'a Problem,
}

/// Remembered scores. They keep their reference alive, so that its address stays its own.
struct LatticeScores {
    scores: Vec<Score>,
    _reference: Arc<ReferenceTuple>,
}

impl Memory<'_> {
    fn scores(
        &self,
        lattice: &Lattice,
        score: impl FnOnce() -> Vec<Score>,
    ) -> Recalled<LatticeScores> {
        let Self { direct, problem } = self;
        let reference = &problem.reference;
        let key = (
            Arc::as_ptr(reference),
            &direct.cost_key,
            &direct.render,
            lattice,
        );
        problem.query.memo.recall(&key, || LatticeScores {
            scores: score(),
            _reference: Arc::clone(reference),
        })
    }
}

/// The state of a search: where it stands and what it has seen.
struct Search<'a> {
    scorer: &'a Scorer<'a>,
    memory: Memory<'a>,
    covered_at_reference: u32,
    least_covered: u32,
    evaluations: u64,
    best: Offset,
    best_score: Score,
}

impl Search<'_> {
    /// Scores a lattice, tells the scores in scan order, and moves to its minimum.
    ///
    /// A lattice where nothing has a cost leaves the search where it is.
    fn phase(
        &mut self,
        lattice: Lattice,
        trace: &mut Trace<'_>,
    ) -> Result<Arc<ScoredLattice>, Cancelled> {
        let hypotheses: Vec<(usize, Offset)> = lattice.hypotheses().collect();
        let poses: Vec<Pose> = hypotheses
            .iter()
            .map(|(_, offset)| offset.reference_from_camera())
            .collect();
        let mut scores = vec![None; lattice.cells()];
        let mut least: Option<f64> = None;
        let phase = lattice.phase;
        let Recalled {
            value: found,
            reused,
        } = self.memory.scores(&lattice, || self.scorer.score(&poses));
        trace.note_reuse(reused);
        for (&(cell, offset), &score) in hypotheses.iter().zip(&found.scores) {
            scores[cell] = Some(score);
            let cost = score.eligible_cost(self.least_covered);
            let is_best = cost.is_some_and(|cost| least.is_none_or(|least| cost < least));
            if is_best {
                least = cost;
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
        }
        let surface = Arc::new(ScoredLattice {
            lattice,
            scores,
            least_covered: self.least_covered,
        });
        let minimum = surface.minimum();
        if let Some(cell) = minimum
            && let (Some(offset), Some(score)) =
                (surface.lattice.offset(cell), surface.scores[cell])
        {
            (self.best, self.best_score) = (offset, score);
        }
        trace.emit(|| PhaseSearched {
            surface: Arc::clone(&surface),
            best: minimum.and_then(|cell| surface.lattice.offset(cell)),
        })?;
        Ok(surface)
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
        let Comparison { mut pairs, .. } = self.scorer.compare(&best);
        let mut values: Vec<f32> = pairs.iter().map(|pair| pair.synthetic).collect();
        values.shuffle(&mut Pcg64::seed_from_u64(seed));
        for (pair, value) in pairs.iter_mut().zip(values) {
            pair.synthetic = value;
        }
        self.memory.direct.cost.evaluate(&pairs)
    }
}
