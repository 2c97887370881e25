//! What the run told up to the cursor, as far as it has a place in the scene.

use std::sync::Arc;

use nalgebra::Point3;

use crate::app::ViewContext;
use crate::depth::LiftedMatch;
use crate::event::{CloudColored, Event, PoseScored};
use crate::features::FeatureState;
use crate::geometry::Pose;
use crate::grid::{Offset, ScoredLattice};
use crate::method::Method;
use crate::render::ColoredCloud;
use crate::session::Run;

/// The matches that FB lifts into space, and the camera that it finds with them.
#[derive(Default)]
pub(super) struct LiftedFeatures<'a> {
    lifted: &'a [LiftedMatch],
    states: Option<&'a [FeatureState]>,
    /// The best pose so far: that of MLESAC, then the refined one.
    pub(super) reference_from_query: Option<Pose>,
}

/// A ray from a camera to a lifted point.
pub(super) struct LiftedRay {
    /// The lifted point, in the reference camera's frame \[m\].
    pub(super) point: Point3<f64>,
    /// Index of the query keypoint.
    pub(super) query: usize,
    /// Whether the estimated pose explains it; `None` before that is decided.
    pub(super) is_inlier: Option<bool>,
}

impl<'a> LiftedFeatures<'a> {
    /// From the estimator at the cursor, if it lifts matches; else from FB's part.
    pub(super) fn at(context: &ViewContext<'a>) -> Self {
        let here = if context.is_inside_hybrid(Method::FB) {
            Self::told(context.run, context.cursor)
        } else {
            Self::default()
        };
        if !here.lifted.is_empty() {
            return here;
        }
        match context.part_of(Method::FB) {
            Some((_, cursor)) => Self::told(context.run, cursor),
            None => here,
        }
    }

    fn told(run: &'a Run, cursor: usize) -> Self {
        let mut progress = Self::default();
        for event in events(run, cursor) {
            match event {
                Event::DepthsLifted(event) => progress.lifted = &event.matches,
                Event::MatchesGuided(event) => progress.lifted = &event.matches,
                Event::FeaturesClassified(event) => progress.states = Some(&event.states),
                Event::HypothesisTried(event) => {
                    if let Some(best) = &event.trial.best {
                        progress.reference_from_query = Some(best.pose.inverse());
                    }
                }
                Event::PoseRefined(event) => {
                    progress.reference_from_query = Some(event.reference_from_query);
                }
                _ => {}
            }
        }
        progress
    }

    pub(super) fn rays(&self) -> impl Iterator<Item = LiftedRay> {
        self.lifted.iter().filter_map(|lifted| {
            let state = self.states.and_then(|states| states.get(lifted.query));
            Some(LiftedRay {
                point: lifted.point?,
                query: lifted.query,
                is_inlier: state.map(|state| matches!(state, FeatureState::Inlier { .. })),
            })
        })
    }
}

/// The grid search of a direct method.
#[derive(Default)]
pub(super) struct SearchProgress<'a> {
    /// Complete phases up to the cursor: the coarse positions and those after them.
    pub(super) surfaces: Vec<&'a Arc<ScoredLattice>>,
    /// Hypotheses of a phase that is not complete.
    pub(super) scored: Vec<&'a PoseScored>,
    /// Where the search stood: the start, and each best so far.
    pub(super) path: Vec<Offset>,
    /// Least and greatest cost of the run's first surface, complete or not: the ends of the colours.
    pub(super) costs: Option<(f64, f64)>,
}

impl<'a> SearchProgress<'a> {
    /// From the direct method whose pictures are shown.
    pub(super) fn at(context: &ViewContext<'a>) -> Self {
        let method = context.searching_method();
        let Some((span, cursor)) = context.part_of(method) else {
            return Self::default();
        };
        let mut progress = Self::default();
        for event in events(context.run, cursor) {
            match event {
                Event::ViewRendered(event) => progress.path.push(event.offset),
                Event::PoseScored(event) => progress.scored.push(event),
                Event::PhaseSearched(event) => {
                    progress.scored.clear();
                    progress.surfaces.push(&event.surface);
                }
                _ => {}
            }
        }
        let last = span.records.end.saturating_sub(1);
        let first_surface = events(context.run, last).find_map(|event| match event {
            Event::PhaseSearched(event) => Some(&event.surface),
            _ => None,
        });
        progress.costs = match first_surface {
            Some(surface) => {
                ends((0..surface.scores.len()).filter_map(|cell| surface.eligible_cost(cell)))
            }
            None => ends(
                progress
                    .scored
                    .iter()
                    .filter_map(|scored| scored.score.cost),
            ),
        };
        progress
    }
}

/// The reference's cloud in the photo's grey values, if a direct method has coloured it.
pub(super) fn colored<'a>(context: &ViewContext<'a>) -> Option<&'a Arc<ColoredCloud>> {
    let here = context.latest::<CloudColored>();
    let other = || {
        let methods = context.setup.task.protocol.methods.iter();
        methods
            .copied()
            .find_map(|method| context.latest_of::<CloudColored>(method))
    };
    here.or_else(other).map(|event| &event.cloud)
}

/// What the estimator at a cursor has told up to there.
fn events(run: &Run, cursor: usize) -> impl Iterator<Item = &Event> {
    let records = run.span_at(cursor).map_or(&[][..], |span| {
        let end = span.records.end.min(cursor + 1);
        &run.records()[span.records.start.min(end)..end]
    });
    records.iter().map(|record| &record.event)
}

/// The least and the greatest of some numbers.
pub(super) fn ends(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .filter(|value| value.is_finite())
        .fold(None, |ends, value| match ends {
            None => Some((value, value)),
            Some((least, greatest)) => Some((least.min(value), greatest.max(value))),
        })
}
