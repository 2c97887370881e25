//! The cost along the line between two poses, worked out beside the window's thread.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use crate::estimator;
use crate::geometry::Pose;
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::Score;

/// A line between two poses, and whose cost is wanted along it.
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
    const BETWEEN: usize = 48;
    /// How many are tried beyond each end, at the same distances.
    const BEYOND: usize = 12;

    /// The pose at a share of the way; below 0 and above 1 it goes on in the same direction.
    pub fn pose(&self, share: f64) -> Pose {
        /// Below this sine of the angle between two rotations they are taken for equal.
        const PARALLEL: f64 = 1e-12;
        // To the last bit, so that the costs there are those of the poses themselves.
        if share == 0.0 {
            return self.from;
        }
        if share == 1.0 {
            return self.to;
        }
        let (from, to) = (&self.from, &self.to);
        let translation = from.translation.vector.lerp(&to.translation.vector, share);
        let rotation = from.rotation.try_slerp(&to.rotation, share, PARALLEL);
        Pose::from_parts(translation.into(), rotation.unwrap_or(from.rotation))
    }

    /// Its length \[m\].
    pub fn length_m(&self) -> f64 {
        (self.to.translation.vector - self.from.translation.vector).norm()
    }

    /// The shares that are tried, from the least to the greatest.
    fn shares() -> Vec<f64> {
        let (between, beyond) = (Self::BETWEEN as isize, Self::BEYOND as isize);
        let places = -beyond..=between + beyond;
        places.map(|place| place as f64 / between as f64).collect()
    }

    /// The places of the shares, the ends first, and then ever finer between.
    fn order() -> Vec<usize> {
        let count = Self::shares().len();
        let ends = [Self::BEYOND, Self::BEYOND + Self::BETWEEN];
        let coarse_first = [8, 4, 2, 1]
            .into_iter()
            .flat_map(|step| (0..count).step_by(step));
        let mut order: Vec<usize> = Vec::with_capacity(count);
        for place in ends.into_iter().chain(coarse_first) {
            if !order.contains(&place) {
                order.push(place);
            }
        }
        order
    }
}

/// What the cost is along a line, as far as it is known.
#[derive(Clone, Debug)]
pub struct CostAlong {
    /// The line.
    pub line: CostLine,
    /// Shares of the way, rising, with what each pose is worth.
    pub scores: Vec<(f64, Option<Score>)>,
}

impl CostAlong {
    fn new(line: CostLine) -> Self {
        let scores = CostLine::shares().into_iter().map(|share| (share, None));
        Self {
            line,
            scores: scores.collect(),
        }
    }

    /// Whether every pose of the line was tried.
    pub fn is_complete(&self) -> bool {
        self.scores.iter().all(|(_, score)| score.is_some())
    }
}

struct Request {
    problem: Problem,
    params: Arc<Params>,
    line: CostLine,
}

/// What was found of a line: a place among its shares, and what the pose there is worth.
type Answer = Result<(CostLine, usize, Score), String>;

/// Tries the poses of the lines that are wanted: the one that was asked for last of each method.
pub struct LineTracer {
    requests: Sender<Request>,
    answers: Receiver<Answer>,
    /// The lines that are wanted, which the worker looks at before each pose.
    wanted: Wanted,
    along: Vec<CostAlong>,
}

/// Lines that somebody still wants.
#[derive(Clone, Default)]
struct Wanted(Arc<Mutex<Vec<CostLine>>>);

impl Wanted {
    fn set(&self, lines: impl Iterator<Item = CostLine>) {
        *self.lock() = lines.collect();
    }

    fn holds(&self, line: &CostLine) -> bool {
        self.lock().contains(line)
    }

    fn lock(&self) -> MutexGuard<'_, Vec<CostLine>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LineTracer {
    pub(super) fn new(ctx: egui::Context) -> Self {
        let (requests, inbox) = mpsc::channel::<Request>();
        let (outbox, answers) = mpsc::channel();
        let wanted = Wanted::default();
        let still_wanted = wanted.clone();
        // Without a thread the answers never come, and the send below says so.
        let _ = thread::Builder::new()
            .name("cost line".to_owned())
            .spawn(move || {
                while let Ok(request) = inbox.recv() {
                    trace(&request, &still_wanted, &outbox, &ctx);
                }
            });
        Self {
            requests,
            answers,
            wanted,
            along: Vec::new(),
        }
    }

    /// Asks for the cost along a line, unless it is known or asked for. Another line of the same method is
    /// wanted no longer.
    pub(super) fn ask(&mut self, problem: &Problem, params: &Arc<Params>, line: CostLine) {
        if self.along.iter().any(|along| along.line == line) {
            return;
        }
        self.along.retain(|along| along.line.method != line.method);
        self.along.push(CostAlong::new(line));
        self.wanted.set(self.along.iter().map(|along| along.line));
        let request = Request {
            problem: problem.clone(),
            params: Arc::clone(params),
            line,
        };
        // Without a worker nothing is ever known.
        let _ = self.requests.send(request);
    }

    /// Forgets all lines: the problem or the parameters have changed.
    pub(super) fn forget(&mut self) {
        self.along.clear();
        self.wanted.set(std::iter::empty());
    }

    /// Takes in answers. An error is a fault of ours.
    pub(super) fn poll(&mut self) -> Result<(), String> {
        while let Ok(answer) = self.answers.try_recv() {
            let (line, place, score) = answer?;
            let mut along = self.along.iter_mut();
            if let Some(along) = along.find(|along| along.line == line) {
                along.scores[place].1 = Some(score);
            }
        }
        Ok(())
    }

    /// What is known of the line of a method that was asked for last.
    pub(super) fn along(&self, method: Method) -> Option<&CostAlong> {
        self.along.iter().find(|along| along.line.method == method)
    }

    /// Whether more is to come.
    pub(super) fn is_busy(&self) -> bool {
        self.along.iter().any(|along| !along.is_complete())
    }
}

/// Tries the poses of a line as long as it is wanted.
fn trace(request: &Request, wanted: &Wanted, outbox: &Sender<Answer>, ctx: &egui::Context) {
    let Request {
        problem,
        params,
        line,
    } = request;
    let estimator = estimator::entry(line.method).make(params);
    let shares = CostLine::shares();
    for place in CostLine::order() {
        if !wanted.holds(line) {
            return;
        }
        let pose = line.pose(shares[place]);
        let compared = catch_unwind(AssertUnwindSafe(|| estimator.compare_at(problem, &pose)));
        let answer = match compared {
            Ok(comparison) => Ok(comparison.map_or(NOTHING, |comparison| comparison.score)),
            Err(_) => Err("the cost between two poses could not be worked out".to_owned()),
        };
        let is_lost = answer.is_err();
        let told = outbox.send(answer.map(|score| (*line, place, score)));
        if told.is_err() || is_lost {
            return;
        }
        ctx.request_repaint();
    }
}

/// What a pose is worth from which nothing can be compared.
const NOTHING: Score = Score {
    cost: None,
    covered: 0,
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::yaw;

    fn line() -> CostLine {
        CostLine {
            method: Method::MI,
            from: Pose::translation(1.0, 0.0, 2.0),
            to: Pose::translation(5.0, 0.5, 2.0) * yaw(0.3),
        }
    }

    #[test]
    fn a_line_goes_through_both_poses_and_on_beyond_them() {
        let line = line();
        let off = |share: f64, pose: Pose| (line.pose(share).inverse() * pose).to_homogeneous();
        for (share, pose) in [(0.0, line.from), (1.0, line.to)] {
            let off = off(share, pose) - nalgebra::Matrix4::identity();
            assert!(off.norm() < 1e-12, "{off}");
        }
        let beyond = line.pose(1.5).translation.vector - line.to.translation.vector;
        assert!((beyond - nalgebra::Vector3::new(2.0, 0.25, 0.0)).norm() < 1e-12);
        let turned = line.pose(1.5).rotation.angle();
        assert!((turned - 0.45).abs() < 1e-12, "{turned}");
        assert!((line.length_m() - (16.25_f64).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn every_place_is_tried_once_the_ends_first() {
        let (shares, order) = (CostLine::shares(), CostLine::order());
        assert_eq!([shares[order[0]], shares[order[1]]], [0.0, 1.0]);
        let mut sorted = order;
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..shares.len()));
        assert!(shares.is_sorted());
    }
}
