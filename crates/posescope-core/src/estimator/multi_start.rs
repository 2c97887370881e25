//! Multi-start search: from many starts, in six freedoms, for any cost.
//!
//! 1. Coarse positions are scored at several yaws, at once and not one after the other,
//! 2. many of their minima are starts, each refined in right, forward and yaw,
//! 3. around the best of those, samples gather, and end in a refinement in all six freedoms,
//! 4. and of minima that cost about the same the likelier pose stands.
//!
//! Where there are smaller copies of the photos, steps 1 and 2 use them.

mod halving;
mod level;
mod params;
mod prior;

use std::sync::Arc;

pub(super) use level::Level;
pub use params::MultiStartParams;

use super::{Answered, CostSummary, Failure, Halt};
use crate::event::{Moment, PhaseSearched, PoseScored, Stage, StartsRefined, ViewRendered};
use crate::geometry::Pose;
use crate::grid::{GridParams, Lattice, Offset, Phase, Scored, ScoredLattice, scan};
use crate::params::Params;
use crate::problem::Problem;
use crate::render::{Comparison, Objective, Score};
use crate::scale::Scale;
use crate::search::{CrossEntropy, Freedoms, PatternSearch, Refined, Start};
use crate::stats::upper_median;
use crate::trace::{Cancelled, Trace};

/// The step below which the refinement of all starts ends, before the best go on in six freedoms \[m\], at the
/// paper's scale.
const PLANE_LAST_M: f64 = 0.05;

/// At least so many minima are followed to the end: the answer, and what it is compared with.
const MIN_REFINED: usize = 5;

/// The multi-start search.
pub(super) struct MultiStart {
    params: MultiStartParams,
    pub(super) grid: GridParams,
    /// How far outside the disc a pose may be, as a share of its radius.
    radius_slack: f64,
    scale: Scale,
}

/// What the search found, in the frame of the reference camera.
pub(super) struct Found {
    /// The refined minima, the answer first; at least one.
    pub(super) refined: Vec<Refined>,
    /// What the least is worth.
    pub(super) summary: CostSummary,
    /// What the coarse positions cost.
    pub(super) spread: Spread,
}

/// Middle and width of many costs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spread {
    median: f64,
    /// 1.4826 times the median distance from the median: the standard deviation, were they Gaussian.
    deviation: f64,
}

impl Spread {
    pub(super) fn of(surfaces: &[Arc<ScoredLattice>]) -> Self {
        let cells = surfaces.iter().flat_map(|surface| surface.eligible());
        let mut costs: Vec<f64> = cells.map(|(_, cost)| cost).collect();
        let median = upper_median(&mut costs);
        let mut away: Vec<f64> = costs.iter().map(|cost| (cost - median).abs()).collect();
        Self { median, deviation: 1.4826 * upper_median(&mut away) }
    }

    /// How far a cost is below the middle, in standard deviations.
    pub(super) fn deviations(&self, cost: f64) -> f64 {
        (self.median - cost) / self.deviation()
    }

    /// The standard deviation, which is never nothing.
    pub(super) fn deviation(&self) -> f64 {
        self.deviation.max(1e-9)
    }
}

/// What the prior on poses adds to the cost of a pose (`reference_from_camera`) of a multi-start search, given the
/// costs of its coarse positions.
pub(crate) fn prior_penalty(params: &Params, coarse: &[Arc<ScoredLattice>], pose: &Pose) -> f64 {
    MultiStart::new(params).map_cost(&Spread::of(coarse), pose, 0.0)
}

/// How far the costs of the coarse positions of a multi-start search are spread: their robust standard deviation.
pub(crate) fn cost_deviation(coarse: &[Arc<ScoredLattice>]) -> f64 {
    Spread::of(coarse).deviation()
}

impl MultiStart {
    /// The search with these parameters.
    pub(super) fn new(params: &Params) -> Self {
        Self {
            params: params.mi6.clone(),
            grid: params.grid.clone(),
            radius_slack: params.fb.radius_slack,
            scale: params.scale,
        }
    }

    /// The plan for the last refinement, in six freedoms.
    fn in_six(&self) -> PatternSearch {
        PatternSearch {
            freedoms: Freedoms::Six,
            first_m: self.params.six_step_m.min(self.most_m()),
            last_m: self.params.last_step_m,
            ..self.in_the_plane()
        }
    }

    /// The samples around the best starts.
    fn around(&self, problem: &Problem) -> CrossEntropy {
        let PatternSearch { first_m, rad_per_m, .. } = self.in_the_plane();
        CrossEntropy { first_m, rad_per_m, fewest: MIN_REFINED, seed: problem.seed }
    }

    fn in_the_plane(&self) -> PatternSearch {
        PatternSearch {
            freedoms: Freedoms::Plane,
            first_m: self.params.first_step_m.min(self.most_m()),
            last_m: self.scale.length(PLANE_LAST_M).min(self.most_m()),
            rad_per_m: self.params.deg_per_m.to_radians(),
            in_place: true,
        }
    }

    /// No step is longer than half of one between coarse positions \[m\]: it would only lead to where
    /// another start is.
    fn most_m(&self) -> f64 {
        0.5 * self.grid.coarse_step_m
    }

    /// How far from the reference an answer may be \[m\]: a little farther than the disc, as for FB.
    fn reach(&self, problem: &Problem) -> f64 {
        problem.uncertainty_radius_m * (1.0 + self.radius_slack)
    }

    /// Fails where a lattice is too large.
    pub(super) fn check_size(&self, problem: &Problem) -> Result<(), Failure> {
        self.lattices(problem, self.params.yaws).map(|_| ())
    }

    /// Searches all of the disc. `level` has the photos as they are, and `smaller` makes levels of smaller ones,
    /// where there are any; `compare` shows a pose.
    pub(super) fn search<O: Objective>(
        &self,
        problem: &Problem,
        level: &Level<O>,
        smaller: Option<&dyn Fn(u32) -> Level<O>>,
        compare: &dyn Fn(&Pose, Score) -> Comparison,
        trace: &mut Trace<'_>,
    ) -> Result<Found, Halt> {
        let smaller = smaller.filter(|_| self.params.coarse_shrink > 1);
        // Where smaller copies are searched, one surface is enough to say what costs are worth.
        let yaws = if smaller.is_some() { 1 } else { self.params.yaws };
        let lattices = self.lattices(problem, yaws)?;
        let initial = level.initial;
        let rendered = |moment, evaluation, pose: &Pose, score| ViewRendered {
            moment,
            evaluation,
            offset: Offset::of(pose),
            comparison: Arc::new(compare(pose, score)),
        };
        trace.emit(|| rendered(Moment::Start, 0, &Pose::identity(), initial))?;
        let mut search = Search { level, evaluations: 1 };
        let surfaces = trace.stage(Stage::Search(Phase::PositionCoarse), |trace| {
            let mut surfaces = Vec::new();
            for lattice in lattices {
                surfaces.push(search.score(lattice, trace)?);
            }
            Ok::<_, Halt>(surfaces)
        })?;
        let spread = Spread::of(&surfaces);
        let map_cost = |pose: &Pose, cost: f64| self.map_cost(&spread, pose, cost);
        let starts = starts(&surfaces, self.params.starts, map_cost);
        if starts.is_empty() {
            return Err(Halt::from(Failure::NothingComparable {
                hypotheses: search.evaluations as usize,
            }));
        }
        let flat: Vec<_> = surfaces.iter().map(|surface| surface.flat_cost()).collect();
        if let Some(&Some((cost, hypotheses))) = flat.first()
            && flat.iter().all(Option::is_some)
        {
            return Err(Halt::from(Failure::FlatCost { cost, hypotheses }));
        }
        let mut finalists = Vec::new();
        if let Some(smaller) = smaller {
            let poses = trace
                .stage(Stage::SearchCoarse, |trace| self.coarse_poses(problem, smaller, trace))?;
            search.evaluations += poses.len() as u64;
            finalists = level.starts(&poses);
        }
        if finalists.is_empty() {
            let refined = trace.stage(Stage::RefinePlane, |trace| {
                let walks = starts.iter().map(Refined::unmoved).collect();
                let plan = self.in_the_plane();
                self.refine(&mut search, walks, &plan, self.params.finalists, map_cost, trace)
            })?;
            finalists = self.apart(refined, self.params.finalists, map_cost);
        }
        let mut refined = trace.stage(Stage::RefineSix, |trace| {
            let walks = level
                .gathered(&finalists, &self.around(problem), map_cost, || trace.checkpoint())?;
            self.refine(&mut search, walks, &self.in_six(), MIN_REFINED, map_cost, trace)
        })?;
        // A walk may leave the disc, where no query can be.
        let reach_m = self.reach(problem);
        let minima = refined.len();
        refined.retain(|one| one.pose.translation.vector.norm() <= reach_m);
        if refined.is_empty() {
            return Err(Halt::from(Failure::LedOutside { minima, reach_m }));
        }
        trace.stage(Stage::Assess, |trace| {
            let best = refined[0];
            let answered = self.answered(level, &best, &refined[1..], search.evaluations);
            let summary = CostSummary::of(problem, level, &answered);
            trace.emit(|| {
                rendered(Moment::End, search.evaluations - 1, &best.pose, answered.score)
            })?;
            trace.emit(|| summary.assessed(Offset::of(&best.pose)))?;
            Ok(Found { refined, summary, spread })
        })
    }

    /// The first of some minima, compared with the next that is at another place.
    pub(super) fn answered<'a>(
        &self,
        level: &Level<impl Objective>,
        first: &Refined,
        others: impl IntoIterator<Item = &'a Refined>,
        evaluations: u64,
    ) -> Answered {
        let pose = first.pose;
        let mut others = others.into_iter();
        Answered {
            reference_from_camera: pose,
            score: level.objective.score(&[pose])[0],
            runner_up: others.find(|other| self.is_apart(&pose, &other.pose)).map(|one| one.cost),
            evaluations,
        }
    }

    /// A lattice of coarse positions for each yaw, the reference's own heading last: that one stays
    /// where only one is shown.
    fn lattices(&self, problem: &Problem, yaws: usize) -> Result<Vec<Lattice>, Failure> {
        let middle = yaws / 2;
        let mut yaws: Vec<f64> = (0..yaws)
            .map(|k| (k as f64 - middle as f64) * self.params.yaw_step_deg.to_radians())
            .collect();
        yaws.sort_by(|a, b| b.abs().total_cmp(&a.abs()).then(a.total_cmp(b)));
        let lattices = yaws.into_iter().map(|yaw_rad| {
            let centre = Offset { yaw_rad, ..Offset::default() };
            let radius = problem.uncertainty_radius_m;
            Lattice::new(Phase::PositionCoarse, centre, radius, &self.grid).map_err(Failure::from)
        });
        lattices.collect()
    }

    /// The scores of the poses; of those that are as unlikely as can be, none.
    fn score_plausible<O: Objective>(&self, level: &Level<O>, poses: &[Pose]) -> Vec<Score> {
        let plausible = poses.iter().copied().filter(|pose| self.is_plausible(pose));
        let mut scores = level.objective.score(&plausible.collect::<Vec<_>>()).into_iter();
        let scored = poses.iter().map(|pose| {
            let score = self.is_plausible(pose).then(|| scores.next());
            score.flatten().unwrap_or(Score { cost: None, covered: 0 })
        });
        scored.collect()
    }

    /// Poses that two smaller copies of the photos lead to: the minima of the smallest, over a wide range of headings,
    /// refined there in six freedoms and again at half the size. Basins are wider there than in the photos themselves.
    fn coarse_poses<O: Objective>(
        &self,
        problem: &Problem,
        smaller: &dyn Fn(u32) -> Level<O>,
        trace: &mut Trace<'_>,
    ) -> Result<Vec<Pose>, Halt> {
        let shrink_by = self.params.coarse_shrink as u32;
        let level = smaller(shrink_by);
        let mut surfaces = Vec::new();
        for lattice in self.lattices(problem, self.params.coarse_yaws)? {
            let score = |poses: &[Pose]| self.score_plausible(&level, poses);
            let silently = |_: &[Scored]| trace.checkpoint();
            let batch = level.objective.batch(lattice.cells());
            let surface = scan(lattice, level.least_covered, batch, score, silently)?;
            surfaces.push(Arc::new(surface));
        }
        let spread = Spread::of(&surfaces);
        let map_cost = |pose: &Pose, cost: f64| self.map_cost(&spread, pose, cost);
        let MultiStartParams { starts: most, finalists, .. } = self.params;
        let most_m = self.most_m();
        let walks = starts(&surfaces, 2 * most, map_cost).iter().map(Refined::unmoved).collect();
        let plan = PatternSearch { last_m: most_m.min(0.1), ..self.in_the_plane() };
        let plane =
            self.halved(&level, walks, &plan, finalists, map_cost, || trace.checkpoint())?;
        let plan = PatternSearch {
            freedoms: Freedoms::Six,
            first_m: most_m.min(0.2),
            last_m: most_m.min(0.05),
            ..plan
        };
        let walks = self.apart(plane, most, map_cost).iter().map(Refined::unmoved).collect();
        let six =
            self.halved(&level, walks, &plan, MIN_REFINED, map_cost, || trace.checkpoint())?;

        let level = smaller(shrink_by.div_ceil(2));
        trace.checkpoint()?;
        let best = self.apart(six, finalists, map_cost);
        let poses: Vec<Pose> = best.iter().map(|start| start.pose).collect();
        let plan = PatternSearch { last_m: most_m.min(0.025), ..plan };
        let walks = level.starts(&poses).iter().map(Refined::unmoved).collect();
        let refined =
            self.halved(&level, walks, &plan, MIN_REFINED, map_cost, || trace.checkpoint())?;
        let best = self.apart(refined, finalists, map_cost);
        Ok(best.into_iter().map(|start| start.pose).collect())
    }
}

/// The state of a search.
struct Search<'a, O> {
    level: &'a Level<O>,
    evaluations: u64,
}

impl<O: Objective> Search<'_, O> {
    fn score(
        &mut self,
        lattice: Lattice,
        trace: &mut Trace<'_>,
    ) -> Result<Arc<ScoredLattice>, Cancelled> {
        let &Level { ref objective, initial, least_covered } = self.level;
        let (phase, batch) = (lattice.phase, objective.batch(lattice.cells()));
        let score = |poses: &[Pose]| objective.score(poses);
        let tell = |some: &[Scored]| {
            trace.checkpoint()?;
            for &one in some {
                let evaluation = self.evaluations;
                self.evaluations += 1;
                trace.emit(|| PoseScored::new(phase, evaluation, one, initial.covered))?;
            }
            Ok(())
        };
        let surface = Arc::new(scan(lattice, least_covered, batch, score, tell)?);
        trace.emit(|| PhaseSearched {
            best: surface.minimum().and_then(|cell| surface.lattice.offset(cell)),
            surface: Arc::clone(&surface),
        })?;
        Ok(surface)
    }
}

/// The best minima of all lattices, no two of them at one place with one heading.
fn starts(
    surfaces: &[Arc<ScoredLattice>],
    most: usize,
    map_cost: impl Fn(&Pose, f64) -> f64,
) -> Vec<Start> {
    let mut minima: Vec<Start> = surfaces
        .iter()
        .flat_map(|surface| {
            let minima = surface.local_minima().into_iter();
            minima.filter_map(|(cell, cost)| {
                let offset = surface.lattice.offset(cell)?;
                Some(Start { pose: offset.reference_from_camera(), cost })
            })
        })
        .collect();
    minima.sort_by(|a, b| map_cost(&a.pose, a.cost).total_cmp(&map_cost(&b.pose, b.cost)));
    minima.truncate(most);
    minima
}

impl MultiStart {
    /// Refines the starts, at least `fewest` of them to the end, and emits where they ended, the lowest MAP cost first.
    fn refine<O: Objective>(
        &self,
        search: &mut Search<'_, O>,
        walks: Vec<Refined>,
        plan: &PatternSearch,
        fewest: usize,
        map_cost: impl Fn(&Pose, f64) -> f64,
        trace: &mut Trace<'_>,
    ) -> Result<Vec<Refined>, Cancelled> {
        let refined =
            self.halved(search.level, walks, plan, fewest, map_cost, || trace.checkpoint())?;
        search.evaluations += refined.iter().map(|one| one.evaluations).sum::<u64>();
        trace.emit(|| StartsRefined {
            freedoms: plan.freedoms,
            refinements: refined.as_slice().into(),
        })?;
        Ok(refined)
    }

    /// The best of those that are refined, each at a place of its own.
    fn apart(
        &self,
        mut refined: Vec<Refined>,
        most: usize,
        map_cost: impl Fn(&Pose, f64) -> f64,
    ) -> Vec<Start> {
        halving::sort_by_map_cost(&mut refined, map_cost);
        let (kept, _) = self.partition(refined, most);
        kept.iter().map(|one| Start { pose: one.pose, cost: one.cost }).collect()
    }

    fn is_apart(&self, a: &Pose, b: &Pose) -> bool {
        !self.scale.is_same_pose(a, b)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;
    use crate::camera::Intrinsics;
    use crate::cloud::Cloud;
    use crate::geometry::{PoseError, yaw};
    use crate::image::Photo;
    use crate::problem::{Query, ReferenceTuple};

    /// Cones along the way: the place of each, how far it is turned \[°\], and its least cost.
    const CONES: [(f64, f64, f64); 10] = [
        (-20.0, 8.0, 0.79),
        (-16.0, 8.0, 0.79),
        (-12.0, 0.0, 0.8),
        (-8.0, 8.0, 0.79),
        (-4.0, 8.0, 0.79),
        (4.0, 0.0, 0.8),
        (8.0, 8.0, 0.79),
        (12.0, 8.0, 0.79),
        (16.0, 0.0, 0.8),
        (20.0, 8.0, 0.79),
    ];

    /// A cost of cones, which counts the rounds of samples around each.
    struct Cones {
        rounds: Mutex<[usize; CONES.len()]>,
    }

    impl Cones {
        fn nearest(pose: &Pose) -> (usize, f64) {
            let costs = CONES.iter().map(|&(forward_m, yaw_deg, least)| {
                let cone = Pose::from_parts(
                    nalgebra::Vector3::new(0.0, 0.0, forward_m).into(),
                    yaw(yaw_deg.to_radians()),
                );
                let off = PoseError::between(&cone, pose);
                least + 0.02 * off.translation_m + 0.01 * off.rotation_deg
            });
            let nearest = costs.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b));
            nearest.expect("there are cones")
        }
    }

    impl Objective for Cones {
        fn score(&self, reference_from_camera: &[Pose]) -> Vec<Score> {
            let nearest: Vec<_> = reference_from_camera.iter().map(Self::nearest).collect();
            let (first, _) = nearest[0];
            // Only samples of one walk are so many around one cone.
            if nearest.len() == 64 && nearest.iter().all(|&(cone, _)| cone == first) {
                self.rounds.lock().expect("no panic")[first] += 1;
            }
            nearest.iter().map(|&(_, cost)| Score { cost: Some(cost), covered: 100 }).collect()
        }

        fn batch(&self, hypotheses: usize) -> usize {
            hypotheses
        }

        fn shuffled(&self, _: &Pose, _: u64) -> Option<f64> {
            None
        }
    }

    #[test]
    fn likelier_poses_are_sampled_to_the_end_though_others_are_a_little_cheaper() {
        let camera = Intrinsics { fx: 4.0, fy: 4.0, cx: 1.5, cy: 1.5, width: 4, height: 4 };
        let photo = || Photo::from_gray_values(4, 4, vec![0; 16]).expect("of that size");
        let query = Query::new("query", photo(), camera).expect("fits");
        let reference =
            ReferenceTuple::new("reference", photo(), camera, Pose::identity(), Cloud::default());
        let problem = Problem::new(query, reference.expect("fits"), 25.0).expect("a radius");
        let starts = MultiStart::new(&Params::default());
        let level = starts.level(Cones { rounds: Mutex::default() });
        let compare = |_: &Pose, _: Score| unreachable!("nobody looks");
        let found = starts
            .search(&problem, &level, None, &compare, &mut Trace::off())
            .unwrap_or_else(|_| panic!("there are minima"));
        assert!(found.refined[0].cost > 0.795, "{:?}", found.refined[0]);
        let rounds = level.objective.rounds.into_inner().expect("no panic");
        for ((_, yaw_deg, _), rounds) in CONES.into_iter().zip(rounds) {
            assert!(rounds >= 1, "each is sampled");
            assert!(yaw_deg != 0.0 || rounds >= 4, "{rounds} rounds around a likely pose");
        }
    }
}
