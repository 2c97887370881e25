//! Records direct methods: synthetic views, and their evaluation by the cost.

use std::sync::Arc;

use rerun::Scalars;

use super::encode::{Encoded, indexed, png};
use super::entities;
use super::indexed;
use super::scene::EventContext;
use super::stream::Stream;
use super::surface::{self, CostRange};
use crate::cost::{Entropies, Explanation};
use crate::event::{Event, Moment, PhaseSearched, PoseScored, ViewRendered};
use crate::grid::{Offset, Phase};
use crate::picture::{self, Painter};
use crate::render::Comparison;

/// Every how many new bests one is shown: in a search along a slope, every second hypothesis is a new best.
const SHOWN_BESTS: usize = 10;

/// The state of a direct method that later events need.
#[derive(Default)]
pub(super) struct DirectContext {
    /// The best pose so far, if not yet shown, with its time on `eval`.
    unseen: Option<(i64, Arc<Comparison>)>,
    /// The best-so-far offsets.
    path: Vec<Offset>,
    /// The range of the colour map.
    range: Option<CostRange>,
    costs: Vec<(i64, f64)>,
    coverages: Vec<(i64, f64)>,
}

impl DirectContext {
    /// Records one event.
    pub(super) fn tell(&mut self, event: &Event, context: &EventContext<'_>, stream: &mut Stream) {
        match event {
            Event::PoseScored(scored) => self.scored(scored, context.evals),
            Event::ViewRendered(view) => self.rendered(view, context, stream),
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
        let eval = context.evals + event.evaluation as i64;
        self.unseen = Some((eval, Arc::clone(&event.comparison)));
        if event.moment != Moment::NewBest || self.path.len().is_multiple_of(SHOWN_BESTS) {
            self.show_best(context, stream);
        }
        stream.set_eval(Some(eval));
        if let Some(Explanation::JointHistogram(histogram)) = &comparison.explanation {
            let Entropies { query, synthetic, joint } = histogram.entropies;
            stream.log(&path("entropy"), &Scalars::new([query, synthetic, joint]));
        }
        if let Some(cost) = comparison.score.cost {
            stream.log(&path("best"), &Scalars::single(cost));
        }
        self.path.push(event.offset);
        surface::log_path(stream, &self.path, context);
        stream.set_eval(None);
    }

    /// Shows the best pose so far, unless it was shown.
    fn show_best(&mut self, context: &EventContext<'_>, stream: &mut Stream) {
        let Some((eval, comparison)) = self.unseen.take() else {
            return;
        };
        stream.set_eval(Some(eval));
        for (part, picture) in packed(&comparison) {
            stream.log_image(&entities::direct(context.method, part), picture);
        }
        stream.set_eval(None);
        if stream.is_live() {
            stream.flush();
        }
    }

    fn searched(&mut self, event: &PhaseSearched, context: &EventContext<'_>, stream: &mut Stream) {
        self.show_best(context, stream);
        let surface = &event.surface;
        match surface.lattice.phase {
            Phase::PositionCoarse | Phase::PositionFine => {
                // The fine lattice in the colours of the coarse one, so that both can be compared.
                self.range = self.range.or_else(|| CostRange::of(surface));
                surface::log_maps(stream, surface, self.range.unwrap_or_default(), context);
            }
            Phase::YawCoarse | Phase::YawFine => surface::log_yaw(stream, surface, context),
        }
        let path = |part: &str| entities::direct(context.method, part);
        stream.log_scalars(&path("cost"), &mut self.costs);
        stream.log_scalars(&path("coverage"), &mut self.coverages);
        stream.flush();
    }
}

/// Pictures of a synthetic view and of its evaluation, by name.
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
        _ => {}
    }
    pictures
}
