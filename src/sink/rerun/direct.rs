//! What PM and MI tell: synthetic views, and what the cost made of them.

use std::sync::Arc;

use rayon::prelude::*;
use rerun::Scalars;

use super::Views;
use super::encode::{Encoded, indexed, png};
use super::entities;
use super::event_context::EventContext;
use super::indexed;
use super::stream::{Now, Stream};
use super::surface::{self, CostRange};
use crate::cost::Explanation;
use crate::event::{Event, Moment, PhaseSearched, PoseScored, ViewRendered};
use crate::grid::{Offset, Phase};
use crate::method::Method;
use crate::picture::{self, Painter};
use crate::render::Comparison;

/// A best pose that was best for so many hypotheses was it for a while.
const LASTING: u64 = 8;

/// What a direct method told so far, as far as later events refer to it.
pub(super) struct DirectContext {
    views: Views,
    /// The best pose so far, if it is not yet known whether it lasts.
    passing: Option<PassingView>,
    /// Views to be shown, which are packed together, on all threads.
    lasting: Vec<PassingView>,
    /// The best-so-far offsets.
    path: Vec<Offset>,
    /// The costs that have the ends of the colour map.
    range: Option<CostRange>,
    costs: Vec<(i64, f64)>,
    coverages: Vec<(i64, f64)>,
}

/// A run that is killed loses so many views at most.
const AT_ONCE: usize = 8;

/// A view that is shown if no better one comes soon.
struct PassingView {
    evaluation: u64,
    comparison: Arc<Comparison>,
    told: Now,
}

impl DirectContext {
    pub(super) fn new(views: Views) -> Self {
        Self {
            views,
            passing: None,
            lasting: Vec::new(),
            path: Vec::new(),
            range: None,
            costs: Vec::new(),
            coverages: Vec::new(),
        }
    }

    /// Records one event; `evals` is the number of evaluations of earlier runs.
    pub(super) fn tell(
        &mut self,
        event: &Event,
        evals: i64,
        context: &EventContext<'_>,
        stream: &mut Stream,
    ) {
        match event {
            Event::PoseScored(scored) => {
                if self.has_lasted(scored.evaluation) {
                    self.settle(context.method, stream);
                }
                self.scored(scored, evals);
            }
            Event::ViewRendered(view) => {
                stream.set_eval(Some(evals + view.evaluation as i64));
                self.rendered(view, context, stream);
                stream.set_eval(None);
            }
            Event::PhaseSearched(searched) => {
                self.settle(context.method, stream);
                self.searched(searched, context, stream);
            }
            _ => {}
        }
    }

    /// The best pose so far is followed by nothing better.
    fn settle(&mut self, method: Method, stream: &mut Stream) {
        self.lasting.extend(self.passing.take());
        if self.lasting.len() >= AT_ONCE || stream.is_live() {
            self.show(method, stream);
        }
    }

    /// Shows what is there to be shown.
    pub(super) fn show(&mut self, method: Method, stream: &mut Stream) {
        self.lasting.extend(self.passing.take());
        if self.lasting.is_empty() {
            return;
        }
        let pack = |view: &PassingView| packed(&view.comparison);
        let pictures: Vec<_> = self.lasting.par_iter().map(pack).collect();
        for (view, pictures) in self.lasting.drain(..).zip(pictures) {
            stream.as_of(view.told, |stream| {
                for (part, picture) in pictures {
                    stream.log_image(&entities::direct(method, part), picture);
                }
            });
        }
        stream.flush();
    }

    fn has_lasted(&self, evaluation: u64) -> bool {
        let passing = self.passing.as_ref();
        passing.is_some_and(|passing| passing.evaluation + LASTING <= evaluation)
    }

    fn scored(&mut self, event: &PoseScored, evals: i64) {
        let eval = evals + event.evaluation as i64;
        if let Some(cost) = event.score.cost {
            self.costs.push((eval, cost));
        }
        self.coverages.push((eval, event.coverage));
    }

    fn rendered(&mut self, event: &ViewRendered, context: &EventContext<'_>, stream: &mut Stream) {
        let path = |part: &str| entities::direct(context.method, part);
        let comparison = event.comparison.as_ref();
        if event.moment != Moment::NewBest {
            self.settle(context.method, stream);
        }
        // A better one takes the place of one that has not lasted.
        self.passing = Some(PassingView {
            evaluation: event.evaluation,
            comparison: Arc::clone(&event.comparison),
            told: stream.now(),
        });
        if self.views == Views::All || event.moment != Moment::NewBest {
            self.settle(context.method, stream);
        }
        if let Some(Explanation::JointHistogram(histogram)) = &comparison.explanation {
            let entropies = [
                histogram.query_entropy,
                histogram.synthetic_entropy,
                histogram.joint_entropy,
            ];
            stream.log(&path("entropy"), &Scalars::new(entropies));
        }
        if let Some(cost) = comparison.score.cost {
            stream.log(&path("best"), &Scalars::single(cost));
        }
        self.path.push(event.offset);
        surface::log_path(stream, &self.path, context);
    }

    fn searched(&mut self, event: &PhaseSearched, context: &EventContext<'_>, stream: &mut Stream) {
        let surface = &event.surface;
        match surface.lattice.phase {
            Phase::PositionCoarse | Phase::PositionFine => {
                // The fine lattice in the colours of the coarse one, so that both can be compared.
                let range = match self.range {
                    Some(range) => Some(range),
                    None => CostRange::of(surface),
                };
                self.range = range;
                surface::log_maps(stream, surface, range.unwrap_or_default(), context);
            }
            Phase::YawCoarse | Phase::YawFine => surface::log_yaw(stream, surface, context),
        }
        stream.log_scalars(&entities::direct(context.method, "cost"), &self.costs);
        stream.log_scalars(
            &entities::direct(context.method, "coverage"),
            &self.coverages,
        );
        self.costs.clear();
        self.coverages.clear();
    }
}

/// Pictures of a synthetic view and of what the cost makes of it, by what they show.
pub(super) fn packed(comparison: &Comparison) -> Vec<(&'static str, Encoded)> {
    let painter = Painter::new(&comparison.view);
    let mut pictures = vec![("synthetic", png(painter.synthetic()))];
    match &comparison.explanation {
        Some(Explanation::Weights(weights)) => {
            let residual = indexed::residual(&painter, &comparison.pairs);
            pictures.push(("residual", indexed(&residual)));
            pictures.push(("weights", indexed(&indexed::weights(&painter, weights))));
        }
        Some(Explanation::JointHistogram(histogram)) => {
            let histogram = png(picture::joint_histogram(histogram));
            pictures.push(("joint_histogram", histogram));
        }
        None => {}
    }
    pictures
}
