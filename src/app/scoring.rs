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

/// The direct methods at one pose.
#[derive(Clone)]
pub struct Probe {
    /// `world_from_camera`.
    pub pose: Pose,
    /// The synthetic view and cost of each method that has one.
    pub comparisons: Vec<(Method, Arc<Comparison>)>,
}

struct ProbeRequest {
    problem: Problem,
    methods: Vec<Method>,
    params: Params,
    pose: Pose,
}

/// Answers for the pose that was asked for last; older questions are dropped.
pub(super) struct Prober {
    worker: Worker<ProbeRequest, Probe>,
    asked: Option<Pose>,
    latest: Option<Probe>,
}

impl Prober {
    pub(super) fn new(ctx: egui::Context) -> Self {
        Self {
            worker: Worker::new("prober", ctx, |request: ProbeRequest| request.answer()),
            asked: None,
            latest: None,
        }
    }

    /// Asks what these methods' costs say of a pose, unless it was asked for last.
    pub(super) fn ask(
        &mut self,
        problem: &Problem,
        methods: &[Method],
        params: &Params,
        pose: Pose,
    ) {
        if self.asked == Some(pose) {
            return;
        }
        self.asked = Some(pose);
        self.worker.forget();
        self.worker.ask(ProbeRequest {
            problem: problem.clone(),
            methods: methods.to_vec(),
            params: params.clone(),
            pose,
        });
    }

    /// Forgets everything: the problem or the parameters have changed.
    pub(super) fn forget(&mut self) {
        self.worker.forget();
        self.asked = None;
        self.latest = None;
    }

    /// Takes in answers. An error is a fault of ours.
    pub(super) fn poll(&mut self) -> Result<(), String> {
        for answer in self.worker.poll() {
            self.latest = Some(answer.ok_or("the pose could not be tried")?);
        }
        Ok(())
    }

    /// The answer for a pose; until it comes, the latest there is.
    pub(super) fn latest(&self) -> Option<&Probe> {
        self.latest.as_ref()
    }

    /// Whether an answer is still to come.
    pub(super) fn is_busy(&self) -> bool {
        self.worker.is_busy()
    }
}

impl ProbeRequest {
    fn answer(&self) -> Probe {
        let compare = |method: Method| {
            let estimator = estimator::entry(method).make(&self.params);
            let comparison = estimator.compare_at(&self.problem, &self.pose)?;
            Some((method, Arc::new(comparison)))
        };
        // Beside each other, and not in the pool of threads: a thread of the pool that waits for what
        // another method makes of the frame would take up a part of that itself, and wait for ever.
        let comparisons = std::thread::scope(|scope| {
            let methods = self.methods.iter();
            let started: Vec<_> =
                methods.map(|&method| scope.spawn(move || compare(method))).collect();
            let ended = started.into_iter().map(|thread| match thread.join() {
                Ok(comparison) => comparison,
                Err(panic) => std::panic::resume_unwind(panic),
            });
            ended.flatten().collect()
        });
        Probe { pose: self.pose, comparisons }
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

/// The costs along lines: of each method the one that was asked for last.
pub(super) type Lines = Answers<CostLine, (Problem, Params), CostAlong>;

/// Starts the thread that scores the poses of lines.
pub(super) fn lines(ctx: egui::Context) -> Lines {
    Answers::new("cost line", ctx, |line: &CostLine, question: (Problem, Params)| {
        let (problem, params) = question;
        let pose = |share| problem.reference_from_query(&line.pose(share));
        let poses: Vec<Pose> = CostLine::shares().map(pose).collect();
        let estimator = estimator::entry(line.method).make(&params);
        let scorer = estimator.scorer(&problem);
        let scores = scorer.map_or_else(Vec::new, |scorer| scorer.score(&poses));
        let scores = CostLine::shares().zip(scores.into_iter().map(Some)).collect();
        CostAlong { line: *line, scores }
    })
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
    ask: DenseAsk,
    surface: Result<DenseSurface, LatticeTooLarge>,
    took: Duration,
}

impl DenseMap {
    fn new(ask: DenseAsk, problem: &Problem, params: &Params) -> Self {
        let mut grid = params.grid.clone();
        grid.coarse_step_m = params.surface.step_m;
        grid.yaw_step_deg = params.surface.yaw_step_deg;
        let radius_m = problem.uncertainty_radius_m;
        Self {
            ask,
            surface: DenseSurface::new(radius_m, &grid, ask.least_covered),
            took: Duration::ZERO,
        }
    }

    /// What was asked for.
    pub fn ask(&self) -> &DenseAsk {
        &self.ask
    }

    /// What is known so far, or why nothing can be known.
    pub fn surface(&self) -> Result<&DenseSurface, &LatticeTooLarge> {
        self.surface.as_ref()
    }

    /// How long it took so far.
    pub fn took(&self) -> Duration {
        self.took
    }
}

/// A map to go on with from where it is.
struct DenseRequest {
    problem: Problem,
    params: Params,
    ask: DenseAsk,
    surface: DenseSurface,
}

/// The scores of the next hypotheses of a map, or that the method has no cost.
struct Scored {
    ask: DenseAsk,
    scores: Option<Vec<Score>>,
    took: Duration,
}

/// Fills the map that is shown, and stands still while none is.
pub(super) struct DenseFiller {
    worker: Worker<DenseRequest, Scored>,
    /// The map that is being filled.
    filling: Option<DenseAsk>,
    /// Whether a map was asked for since the last poll.
    is_shown: bool,
    /// The latest of each method.
    maps: Vec<DenseMap>,
}

impl DenseFiller {
    pub(super) fn new(ctx: egui::Context) -> Self {
        Self {
            worker: Worker::in_parts("dense map", ctx, fill),
            filling: None,
            is_shown: false,
            maps: Vec::new(),
        }
    }

    /// Has a map filled for as long as this is called in each frame. Another map of the same method is forgotten; one
    /// that was begun goes on.
    pub(super) fn ask(&mut self, problem: &Problem, params: &Params, ask: DenseAsk) {
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
        self.worker.ask(DenseRequest {
            problem: problem.clone(),
            params: params.clone(),
            ask,
            surface: surface.clone(),
        });
    }

    fn pause(&mut self) {
        self.worker.forget();
        self.filling = None;
    }

    /// Forgets all maps: the problem or the parameters have changed.
    pub(super) fn forget(&mut self) {
        self.pause();
        self.maps.clear();
    }

    /// Takes in answers, and stands still if no map was asked for since the last time. An error is a fault of ours.
    pub(super) fn poll(&mut self) -> Result<(), String> {
        for answer in self.worker.poll() {
            let scored = answer.ok_or("the dense map could not be computed")?;
            let Some(scores) = scored.scores else {
                self.pause();
                let method = scored.ask.method.label();
                return Err(format!("{method} has no cost to fill a map with"));
            };
            let map = self.maps.iter_mut().find(|map| map.ask == scored.ask);
            if let Some(map) = map
                && let Ok(surface) = &mut map.surface
            {
                surface.take(&scores);
                map.took += scored.took;
            }
        }
        if !self.worker.is_busy() {
            self.filling = None;
        }
        if !self.is_shown {
            self.pause();
        }
        self.is_shown = false;
        Ok(())
    }

    /// The map of a method that was asked for last.
    pub(super) fn map(&self, method: Method) -> Option<&DenseMap> {
        self.maps.iter().find(|map| map.ask.method == method)
    }

    /// Whether more is to come.
    pub(super) fn is_busy(&self) -> bool {
        self.filling.is_some()
    }
}

/// Scores batch after batch for as long as more is wanted.
fn fill(mut request: DenseRequest, emit: &mut dyn FnMut(Scored) -> bool) {
    let DenseRequest { problem, params, ask, surface } = &mut request;
    let estimator = estimator::entry(ask.method).make(params);
    let Some(scorer) = estimator.scorer(problem) else {
        emit(Scored { ask: *ask, scores: None, took: Duration::ZERO });
        return;
    };
    let mut is_wanted = true;
    while is_wanted && !surface.is_complete() {
        let begun = Instant::now();
        let scores = Some(surface.score_next(&scorer));
        let took = begun.elapsed();
        is_wanted = emit(Scored { ask: *ask, scores, took });
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
