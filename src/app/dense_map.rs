//! The cost over every position and heading, worked out beside the window's thread and shown as it fills.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, Sender};
use std::thread;
use std::time::{Duration, Instant};

use crate::estimator;
use crate::grid::{DenseSurface, GridParams, LatticeTooLarge};
use crate::method::Method;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::Score;

/// Which dense map is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DenseAsk {
    /// The direct method whose cost it is of.
    pub method: Method,
    /// The reference, by its position among those of the run.
    pub reference: usize,
    /// Distance of neighbouring positions \[m\].
    pub step_m: f64,
    /// Distance of neighbouring headings \[°\].
    pub yaw_step_deg: f64,
    /// Pixels that a hypothesis must cover to have a say.
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
        let grid = GridParams {
            coarse_step_m: ask.step_m,
            yaw_step_deg: ask.yaw_step_deg,
            ..params.grid.clone()
        };
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

    /// What is known so far, or why there is nothing to be known.
    pub fn surface(&self) -> Result<&DenseSurface, &LatticeTooLarge> {
        self.surface.as_ref()
    }

    /// How long it was worked at.
    pub fn took(&self) -> Duration {
        self.took
    }

    fn is_complete(&self) -> bool {
        self.surface
            .as_ref()
            .map_or(true, DenseSurface::is_complete)
    }
}

/// A map to go on with from where it is.
struct Request {
    ticket: usize,
    problem: Problem,
    params: Arc<Params>,
    ask: DenseAsk,
    surface: DenseSurface,
}

/// What the hypotheses after the first `tried` ones are worth.
struct Scored {
    ask: DenseAsk,
    tried: usize,
    scores: Vec<Score>,
    took: Duration,
}

/// Fills the map that is looked at, and stands still when nobody looks.
pub struct DenseFiller {
    requests: Sender<Request>,
    answers: Receiver<Result<Scored, String>>,
    /// The ticket of the request that is to be worked at; the worker looks at it before each batch.
    wanted: Arc<AtomicUsize>,
    /// The ticket that was given out last; 0 stands for none.
    last_ticket: usize,
    /// What is being filled.
    filling: Option<DenseAsk>,
    /// Whether the map was asked for in this frame.
    is_looked_at: bool,
    /// The latest of each method.
    maps: Vec<DenseMap>,
}

impl DenseFiller {
    pub(super) fn new(ctx: egui::Context) -> Self {
        let (requests, inbox) = mpsc::channel::<Request>();
        let (outbox, answers) = mpsc::channel();
        let wanted = Arc::new(AtomicUsize::new(0));
        let still_wanted = Arc::clone(&wanted);
        // Without a thread the answers never come, and the send below says so.
        let _ = thread::Builder::new()
            .name("dense map".to_owned())
            .spawn(move || {
                while let Ok(mut request) = inbox.recv() {
                    let filled = catch_unwind(AssertUnwindSafe(|| {
                        fill(&mut request, &still_wanted, &outbox, &ctx);
                    }));
                    if filled.is_err() {
                        let why = "the dense map could not be worked out".to_owned();
                        let _ = outbox.send(Err(why));
                        ctx.request_repaint();
                    }
                }
            });
        Self {
            requests,
            answers,
            wanted,
            last_ticket: 0,
            filling: None,
            is_looked_at: false,
            maps: Vec::new(),
        }
    }

    /// Has a map filled as long as this is said again in each frame. Another map of the same method is
    /// forgotten; one that was begun is gone on with.
    pub(super) fn ask(&mut self, problem: &Problem, params: &Arc<Params>, ask: DenseAsk) {
        self.is_looked_at = true;
        if self.filling == Some(ask) {
            return;
        }
        self.pause();
        if !self.maps.iter().any(|map| map.ask == ask) {
            self.maps.retain(|map| map.ask.method != ask.method);
            self.maps.push(DenseMap::new(ask, problem, params));
        }
        let map = self.maps.iter().find(|map| map.ask == ask);
        let Some(map) = map.filter(|map| !map.is_complete()) else {
            return;
        };
        let Ok(surface) = &map.surface else { return };
        self.last_ticket += 1;
        self.wanted.store(self.last_ticket, Ordering::Relaxed);
        let request = Request {
            ticket: self.last_ticket,
            problem: problem.clone(),
            params: Arc::clone(params),
            ask,
            surface: surface.clone(),
        };
        let sent = self.requests.send(request);
        self.filling = sent.is_ok().then_some(ask);
    }

    fn pause(&mut self) {
        self.wanted.store(0, Ordering::Relaxed);
        self.filling = None;
    }

    /// Forgets all maps: the problem or the parameters have changed.
    pub(super) fn forget(&mut self) {
        self.pause();
        self.maps.clear();
    }

    /// Takes in what was worked out, and stands still if nobody asked since the last time. An error is a
    /// fault of ours.
    pub(super) fn poll(&mut self) -> Result<(), String> {
        while let Ok(answer) = self.answers.try_recv() {
            let scored = match answer {
                Ok(scored) => scored,
                Err(why) => {
                    self.pause();
                    return Err(why);
                }
            };
            let map = self.maps.iter_mut().find(|map| map.ask == scored.ask);
            if let Some(map) = map
                && let Ok(surface) = &mut map.surface
                // What was scored twice, because a map was gone on with, counts once.
                && surface.tried() == scored.tried
            {
                surface.take(&scored.scores);
                map.took += scored.took;
            }
        }
        let filling = self.filling;
        let mut maps = self.maps.iter();
        let is_done = maps.any(|map| Some(map.ask) == filling && map.is_complete());
        if is_done || !self.is_looked_at {
            self.pause();
        }
        self.is_looked_at = false;
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

/// Scores batch after batch as long as the request is wanted.
fn fill(
    request: &mut Request,
    wanted: &AtomicUsize,
    outbox: &Sender<Result<Scored, String>>,
    ctx: &egui::Context,
) {
    let estimator = estimator::entry(request.ask.method).make(&request.params);
    let Request {
        ticket,
        problem,
        ask,
        surface,
        ..
    } = request;
    let has_cost = estimator.with_scorer(problem, &mut |scorer| {
        while wanted.load(Ordering::Relaxed) == *ticket && !surface.is_complete() {
            let begun = Instant::now();
            let tried = surface.tried();
            let scored = Scored {
                ask: *ask,
                tried,
                scores: surface.score_next(scorer),
                took: begun.elapsed(),
            };
            if outbox.send(Ok(scored)).is_err() {
                return;
            }
            ctx.request_repaint();
        }
    });
    if !has_cost {
        let why = format!("{} has no cost to fill a map with", ask.method.label());
        let _ = outbox.send(Err(why));
        ctx.request_repaint();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_scored_twice_counts_once() {
        let surface = DenseSurface::new(2.0, &GridParams::default(), 0).expect("small");
        let ask = DenseAsk {
            method: Method::MI,
            reference: 0,
            step_m: 1.0,
            yaw_step_deg: 1.0,
            least_covered: 0,
        };
        let mut filler = DenseFiller::new(egui::Context::default());
        let (outbox, answers) = mpsc::channel();
        filler.answers = answers;
        filler.maps.push(DenseMap {
            ask,
            surface: Ok(surface),
            took: Duration::ZERO,
        });
        let score = Score {
            cost: Some(1.0),
            covered: 1,
        };
        for tried in [0, 0, 5] {
            let scored = Scored {
                ask,
                tried,
                scores: vec![score; 5],
                took: Duration::ZERO,
            };
            outbox.send(Ok(scored)).expect("a receiver");
        }
        filler.poll().expect("no fault");
        let map = filler.map(Method::MI).expect("the map");
        assert_eq!(map.surface().expect("small").tried(), 10);
    }
}
