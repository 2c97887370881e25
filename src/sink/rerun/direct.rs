//! What PM and MI tell: synthetic views, and what the cost made of them.

use rerun::Scalars;

use super::encode::{indexed, png};
use super::entities;
use super::event_context::EventContext;
use super::indexed;
use super::stream::Stream;
use super::surface::{self, CostRange};
use crate::cost::Explanation;
use crate::event::{Event, PhaseSearched, PoseScored, ViewRendered};
use crate::grid::{Offset, Phase};
use crate::picture::{self, Painter};
use crate::render::Comparison;

/// What a direct method told so far, as far as later events refer to it.
#[derive(Default)]
pub(super) struct DirectContext {
    /// The best-so-far offsets.
    path: Vec<Offset>,
    /// The costs that have the ends of the colour map.
    range: Option<CostRange>,
    costs: Vec<(i64, f64)>,
    coverages: Vec<(i64, f64)>,
}

impl DirectContext {
    /// Records one event; `evals` is the number of evaluations of earlier runs.
    pub(super) fn tell(
        &mut self,
        event: &Event,
        evals: i64,
        context: &EventContext<'_>,
        stream: &mut Stream,
    ) {
        match event {
            Event::PoseScored(scored) => self.scored(scored, evals),
            Event::ViewRendered(view) => {
                stream.set_eval(Some(evals + view.evaluation as i64));
                self.rendered(view, context, stream);
                stream.set_eval(None);
            }
            Event::PhaseSearched(searched) => self.searched(searched, context, stream),
            _ => {}
        }
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
        log_pictures(stream, comparison, &path);
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

/// Pictures of a synthetic view and of what the cost makes of it.
pub(super) fn log_pictures(
    stream: &mut Stream,
    comparison: &Comparison,
    path: &dyn Fn(&str) -> String,
) {
    let Comparison {
        view,
        pairs,
        explanation,
        ..
    } = comparison;
    let painter = Painter::new(view);
    let synthetic = || png(painter.synthetic());
    match explanation {
        Some(Explanation::Weights(weights)) => {
            // On all threads: the search waits for them.
            let (synthetic, (residual, weights)) = rayon::join(synthetic, || {
                rayon::join(
                    || indexed(&indexed::residual(&painter, pairs)),
                    || indexed(&indexed::weights(&painter, weights)),
                )
            });
            stream.log_image(&path("synthetic"), synthetic);
            stream.log_image(&path("residual"), residual);
            stream.log_image(&path("weights"), weights);
        }
        Some(Explanation::JointHistogram(histogram)) => {
            stream.log_image(&path("synthetic"), synthetic());
            let histogram = png(picture::joint_histogram(histogram));
            stream.log_image(&path("joint_histogram"), histogram);
        }
        None => stream.log_image(&path("synthetic"), synthetic()),
    }
}
