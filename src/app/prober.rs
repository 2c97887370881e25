//! Costs and pictures of any pose, worked out beside the window's thread.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;
use std::time::{Duration, Instant};

use crate::estimator;
use crate::geometry::Pose;
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::Comparison;

/// The direct methods at one pose.
#[derive(Clone)]
pub struct Probe {
    /// `world_from_camera`.
    pub pose: Pose,
    /// The synthetic view and cost of each method that has one.
    pub comparisons: Vec<(Method, Arc<Comparison>)>,
    /// How long the answer took.
    pub took: Duration,
}

struct ProbeRequest {
    problem: Problem,
    methods: Vec<Method>,
    params: Arc<Params>,
    pose: Pose,
}

/// Answers for the pose that was asked for last; older questions are dropped.
pub struct Prober {
    requests: Sender<ProbeRequest>,
    answers: Receiver<Result<Probe, String>>,
    asked: Option<Pose>,
    latest: Option<Probe>,
}

impl Prober {
    pub(super) fn new(ctx: egui::Context) -> Self {
        let (requests, inbox) = mpsc::channel::<ProbeRequest>();
        let (outbox, answers) = mpsc::channel();
        // Without a thread the answers never come, and the send below says so.
        let _ = thread::Builder::new()
            .name("prober".to_owned())
            .spawn(move || {
                while let Ok(first) = inbox.recv() {
                    let request = inbox.try_iter().last().unwrap_or(first);
                    let probe = catch_unwind(AssertUnwindSafe(|| request.answer()));
                    let answer = probe.map_err(|_| "the pose could not be tried".to_owned());
                    if outbox.send(answer).is_err() {
                        break;
                    }
                    ctx.request_repaint();
                }
            });
        Self {
            requests,
            answers,
            asked: None,
            latest: None,
        }
    }

    /// Asks what these methods' costs say of a pose, unless it was asked for last.
    pub(super) fn ask(
        &mut self,
        problem: &Problem,
        methods: &[Method],
        params: &Arc<Params>,
        pose: Pose,
    ) {
        if self.asked == Some(pose) {
            return;
        }
        let request = ProbeRequest {
            problem: problem.clone(),
            methods: methods.to_vec(),
            params: Arc::clone(params),
            pose,
        };
        if self.requests.send(request).is_ok() {
            self.asked = Some(pose);
        }
    }

    /// Forgets everything: the problem or the parameters have changed.
    pub(super) fn forget(&mut self) {
        self.asked = None;
        self.latest = None;
    }

    /// Takes in answers. An error is a fault of ours.
    pub(super) fn poll(&mut self) -> Result<(), String> {
        while let Ok(answer) = self.answers.try_recv() {
            self.latest = Some(answer?);
        }
        Ok(())
    }

    /// The answer for a pose; while it is worked out, the latest there is.
    pub(super) fn latest(&self) -> Option<&Probe> {
        self.latest.as_ref()
    }

    /// Whether an answer is awaited.
    pub(super) fn is_busy(&self) -> bool {
        self.asked != self.latest.as_ref().map(|probe| probe.pose)
    }
}

impl ProbeRequest {
    fn answer(&self) -> Probe {
        let begun = Instant::now();
        let compare = |method: Method| {
            let estimator = estimator::entry(method).make(&self.params);
            let comparison = estimator.compare_at(&self.problem, &self.pose)?;
            Some((method, Arc::new(comparison)))
        };
        // Beside each other, and not in the pool of threads: a thread of the pool that waits for what
        // another method makes of the frame would take up a part of that itself, and wait for ever.
        let comparisons = thread::scope(|scope| {
            let started: Vec<_> = self
                .methods
                .iter()
                .map(|&method| scope.spawn(move || compare(method)))
                .collect();
            let ended = started.into_iter().map(|thread| match thread.join() {
                Ok(comparison) => comparison,
                Err(panic) => std::panic::resume_unwind(panic),
            });
            ended.flatten().collect()
        });
        Probe {
            pose: self.pose,
            comparisons,
            took: begun.elapsed(),
        }
    }
}
