//! What the costs say of poses that the run did not try: one pose, the line between two, a dense map. All of it is
//! computed beside the window's thread.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::worker::{Answers, Worker};
use crate::estimator;
use crate::geometry::Pose;
use crate::grid::{DenseSurface, LatticeTooLarge};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::proof::between;
use crate::render::{Comparison, Score};

/// What was asked and what is known so far, for the problem and the parameters of one run.
pub struct Scoring {
    prober: Worker<Probe>,
    /// The pose that was asked for last.
    asked: Option<Pose>,
    probe: Option<Probe>,
    /// Of each method along the line that was asked for last.
    lines: Answers<CostLine, CostAlong>,
    filler: Worker<Scored>,
    /// The map that is being filled. It stands still while it is not shown.
    filling: Option<DenseAsk>,
    /// Whether a map was asked for since the last poll.
    is_shown: bool,
    /// The latest of each method.
    maps: Vec<DenseMap>,
}

impl Scoring {
    pub(super) fn new(ctx: &egui::Context) -> Self {
        Self {
            prober: Worker::new("prober", ctx),
            asked: None,
            probe: None,
            lines: Answers::new("cost line", ctx),
            filler: Worker::new("dense map", ctx),
            filling: None,
            is_shown: false,
            maps: Vec::new(),
        }
    }

    /// Forgets everything: the problem or the parameters have changed.
    pub(super) fn forget(&mut self) {
        self.prober.forget();
        self.asked = None;
        self.probe = None;
        self.lines.forget();
        self.pause();
        self.maps.clear();
    }

    /// Takes in answers. Errors are faults of ours.
    pub(super) fn poll(&mut self) -> Vec<String> {
        let mut errors = Vec::new();
        for answer in self.prober.poll() {
            match answer {
                Some(probe) => self.probe = Some(probe),
                None => errors.push("the pose could not be tried".to_owned()),
            }
        }
        if !self.lines.poll() {
            errors.push("the cost between two poses could not be computed".to_owned());
        }
        for answer in self.filler.poll() {
            let map = self.maps.iter_mut().find(|map| Some(map.ask) == self.filling);
            match (answer, map) {
                (
                    Some(Some((scores, took))),
                    Some(DenseMap { surface: Ok(surface), took: all, .. }),
                ) => {
                    surface.take(&scores);
                    *all += took;
                }
                (Some(None), Some(map)) => {
                    errors
                        .push(format!("{} has no cost to fill a map with", map.ask.method.label()));
                }
                (None, _) => errors.push("the dense map could not be computed".to_owned()),
                _ => {}
            }
        }
        if !self.filler.is_busy() {
            self.filling = None;
        }
        if !std::mem::take(&mut self.is_shown) {
            self.pause();
        }
        errors
    }

    /// Asks what these methods' costs say of a pose, in place of the pose that was asked for before.
    pub(super) fn ask(
        &mut self,
        problem: &Problem,
        methods: Vec<Method>,
        params: &Params,
        pose: Pose,
    ) {
        if self.asked.replace(pose) == Some(pose) {
            return;
        }
        self.prober.forget();
        let (problem, params) = (problem.clone(), params.clone());
        self.prober.ask(move |emit| {
            emit(Probe::of(&problem, &methods, &params, pose));
        });
    }

    /// What is known of the pose that was asked for last; until then, of the one before.
    pub fn probe(&self) -> Option<&Probe> {
        self.probe.as_ref()
    }

    /// Whether the answer for a pose is still to come.
    pub fn is_probing(&self) -> bool {
        self.prober.is_busy()
    }

    /// Has the cost along a line computed.
    pub(super) fn trace(&mut self, problem: &Problem, params: &Params, line: CostLine) {
        self.lines.forget_where(|other| other.method == line.method && *other != line);
        self.lines.ask(line, || {
            let (problem, params) = (problem.clone(), params.clone());
            Some(move || CostAlong::of(line, &problem, &params))
        });
    }

    /// What is known of a method's cost along the line that was asked for last.
    pub fn along(&self, method: Method) -> Option<&CostAlong> {
        self.lines.find(|line| line.method == method)
    }

    /// Whether the cost along a line is still to come.
    pub fn is_tracing(&self) -> bool {
        self.lines.is_busy()
    }

    /// Has a dense map filled for as long as this is called in each frame. Another map of the same method is forgotten;
    /// one that was begun goes on.
    pub(super) fn fill(&mut self, problem: &Problem, params: &Params, ask: DenseAsk) {
        self.is_shown = true;
        if self.filling == Some(ask) {
            return;
        }
        self.pause();
        if !self.maps.iter().any(|map| map.ask == ask) {
            self.maps.retain(|map| map.ask.method != ask.method);
            self.maps.push(DenseMap::new(ask, problem, params));
        }
        let map = self.maps.iter().find(|map| map.ask == ask);
        let surface = map.and_then(|map| map.surface.as_ref().ok());
        let Some(surface) = surface.filter(|surface| !surface.is_complete()) else {
            return;
        };
        self.filling = Some(ask);
        let (problem, params, surface) = (problem.clone(), params.clone(), surface.clone());
        self.filler.ask(move |emit| fill(&problem, &params, ask.method, surface, emit));
    }

    fn pause(&mut self) {
        self.filler.forget();
        self.filling = None;
    }

    /// The dense map of a method that was asked for last.
    pub fn dense_map(&self, method: Method) -> Option<&DenseMap> {
        self.maps.iter().find(|map| map.ask.method == method)
    }

    /// Whether a dense map is being filled.
    pub fn is_filling(&self) -> bool {
        self.filling.is_some()
    }
}

/// The direct methods at one pose.
#[derive(Clone)]
pub struct Probe {
    /// `world_from_camera`.
    pub pose: Pose,
    /// The synthetic view and cost of each method that has one.
    pub comparisons: Vec<(Method, Arc<Comparison>)>,
}

impl Probe {
    fn of(problem: &Problem, methods: &[Method], params: &Params, pose: Pose) -> Self {
        let compare = |method: Method| {
            let estimator = estimator::entry(method).make(params);
            let comparison = estimator.compare_at(problem, &pose)?;
            Some((method, Arc::new(comparison)))
        };
        // Beside each other, and not in the pool of threads: a thread of the pool that waits for what
        // another method makes of the frame would take up a part of that itself, and wait for ever.
        let comparisons = std::thread::scope(|scope| {
            let started = methods.iter().map(|&method| scope.spawn(move || compare(method)));
            let started: Vec<_> = started.collect();
            let ended = started.into_iter().map(|thread| match thread.join() {
                Ok(comparison) => comparison,
                Err(panic) => std::panic::resume_unwind(panic),
            });
            ended.flatten().collect()
        });
        Self { pose, comparisons }
    }
}

/// A line between two poses, and the method whose cost is wanted along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CostLine {
    /// The direct method.
    pub method: Method,
    /// Where the line has its share 0 (`world_from_camera`).
    pub from: Pose,
    /// Where it has its share 1 (`world_from_camera`).
    pub to: Pose,
}

impl CostLine {
    /// How many poses are tried between the two ends, each end included once.
    const BETWEEN: isize = 48;
    /// How many are tried beyond each end, at the same distances.
    const BEYOND: isize = 12;

    /// The pose at a share of the way; below 0 and above 1 it goes on in the same direction.
    pub fn pose(&self, share: f64) -> Pose {
        between(&self.from, &self.to, share)
    }

    /// Its length \[m\].
    pub fn length_m(&self) -> f64 {
        (self.to.translation.vector - self.from.translation.vector).norm()
    }

    /// The shares that are tried, from the least to the greatest.
    fn shares() -> impl Iterator<Item = f64> {
        let places = -Self::BEYOND..=Self::BETWEEN + Self::BEYOND;
        places.map(|place| place as f64 / Self::BETWEEN as f64)
    }
}

/// The cost along a line.
#[derive(Clone, Debug)]
pub struct CostAlong {
    /// The line.
    pub line: CostLine,
    /// Shares of the way, rising, with the score of each pose.
    pub scores: Vec<(f64, Option<Score>)>,
}

impl CostAlong {
    /// Scores the poses of a line.
    fn of(line: CostLine, problem: &Problem, params: &Params) -> Self {
        let pose = |share| problem.reference_from_query(&line.pose(share));
        let poses: Vec<Pose> = CostLine::shares().map(pose).collect();
        let estimator = estimator::entry(line.method).make(params);
        let scorer = estimator.scorer(problem);
        let scores = scorer.map_or_else(Vec::new, |scorer| scorer.score(&poses));
        let scores = CostLine::shares().zip(scores.into_iter().map(Some)).collect();
        Self { line, scores }
    }
}

/// Which dense map is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DenseAsk {
    /// The direct method whose cost it is of.
    pub method: Method,
    /// The reference, by its position among those of the run.
    pub reference: usize,
    /// Pixels that a hypothesis must cover to be eligible.
    pub least_covered: u32,
}

/// A dense map, as far as it is filled.
pub struct DenseMap {
    /// What was asked for.
    pub ask: DenseAsk,
    /// What is known so far, or why nothing can be known.
    pub surface: Result<DenseSurface, LatticeTooLarge>,
    /// How long it took so far.
    pub took: Duration,
}

impl DenseMap {
    fn new(ask: DenseAsk, problem: &Problem, params: &Params) -> Self {
        let mut grid = params.grid.clone();
        grid.coarse_step_m = params.surface.step_m;
        grid.yaw_step_deg = params.surface.yaw_step_deg;
        let radius_m = problem.uncertainty_radius_m();
        let surface = DenseSurface::new(radius_m, &grid, ask.least_covered);
        Self { ask, surface, took: Duration::ZERO }
    }
}

/// The scores of the next hypotheses of a map and the time that they took; `None` where the method has no cost.
type Scored = Option<(Vec<Score>, Duration)>;

/// Scores batch after batch for as long as more is wanted.
fn fill(
    problem: &Problem,
    params: &Params,
    method: Method,
    mut surface: DenseSurface,
    emit: &mut dyn FnMut(Scored) -> bool,
) {
    let estimator = estimator::entry(method).make(params);
    let Some(scorer) = estimator.scorer(problem) else {
        emit(None);
        return;
    };
    let mut is_wanted = true;
    while is_wanted && !surface.is_complete() {
        let begun = Instant::now();
        let scores = surface.score_next(&scorer);
        is_wanted = emit(Some((scores, begun.elapsed())));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::yaw;

    #[test]
    fn a_line_goes_through_both_poses_and_on_beyond_them() {
        let line = CostLine {
            method: Method::MI,
            from: Pose::translation(1.0, 0.0, 2.0),
            to: Pose::translation(5.0, 0.5, 2.0) * yaw(0.3),
        };
        let off = |share: f64, pose: Pose| (line.pose(share).inverse() * pose).to_homogeneous();
        for (share, pose) in [(0.0, line.from), (1.0, line.to)] {
            let off = off(share, pose) - nalgebra::Matrix4::identity();
            assert!(off.norm() < 1e-12, "{off}");
            assert!(CostLine::shares().any(|tried| tried == share));
        }
        let beyond = line.pose(1.5).translation.vector - line.to.translation.vector;
        assert!((beyond - nalgebra::Vector3::new(2.0, 0.25, 0.0)).norm() < 1e-12);
        let turned = line.pose(1.5).rotation.angle();
        assert!((turned - 0.45).abs() < 1e-12, "{turned}");
        assert!((line.length_m() - (16.25_f64).sqrt()).abs() < 1e-12);
    }
}
