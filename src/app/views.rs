//! The views: each one file and one entry in [`ALL`].
//!
//! A view draws from the [`ViewContext`] that it is handed and keeps nothing of the run. What it
//! does keep is how a person looks at it: a zoom, a filter.

mod batch;
mod breakpoints;
mod canvas;
mod charts;
mod features;
mod fusion;
mod histogram;
mod images;
pub(super) mod legend;
mod lockstep;
mod log;
mod ovals;
mod parameters;
mod queries;
mod ransac;
mod references;
mod retrieval;
mod space;
mod surface;
mod synthetic;

use super::view_context::ViewContext;
use super::view_name::ViewName;
use crate::event::DebugEvent;
use crate::method::Method;
use crate::session::Span;

/// A part of the window.
pub trait View {
    /// Draws the view. It is called at every step of a run, and without a run.
    fn ui(&mut self, ui: &mut egui::Ui, context: &ViewContext<'_>);
}

/// A view as the registry has it.
pub struct Entry {
    /// The name in the program and in lessons.
    pub name: ViewName,
    /// The title on its tab.
    pub title: &'static str,
    /// What the view shows, in one phrase.
    pub about: &'static str,
    /// Makes the view.
    pub new: fn() -> Box<dyn View>,
}

/// The part of the run in which a method reports events of a type, and the cursor in it. A hybrid at the cursor may
/// run the method inside itself.
fn part_with<'a, E: DebugEvent + 'static>(
    context: &ViewContext<'a>,
    method: Method,
) -> Option<(&'a Span, usize)> {
    if context.is_inside_hybrid(method) && context.latest::<E>().is_some() {
        Some((context.span()?, context.cursor))
    } else {
        context.part_of(method)
    }
}

/// Every view, in the order of the names.
pub const ALL: &[Entry] = &[
    entry::<queries::QueriesView>(
        ViewName::Queries,
        "Queries",
        "all queries with what is known of them",
    ),
    entry::<batch::BatchView>(
        ViewName::Batch,
        "Batch",
        "the results of all queries in a table: filter, sort, open",
    ),
    entry::<references::ReferencesView>(
        ViewName::References,
        "References",
        "which frames the query is localised against, and how their poses are fused",
    ),
    entry::<parameters::ParametersView>(
        ViewName::Parameters,
        "Parameters",
        "every parameter with unit, range and meaning",
    ),
    entry::<breakpoints::BreakpointsView>(
        ViewName::Breakpoints,
        "Breakpoints",
        "where a run is to stop",
    ),
    entry::<images::ImagesView>(
        ViewName::Images,
        "Images",
        "both photos, their matches, and where each feature ended",
    ),
    entry::<retrieval::RetrievalView>(
        ViewName::Retrieval,
        "Retrieval",
        "frames that resemble the query, and what in them lies alike",
    ),
    entry::<synthetic::SynthesisView>(
        ViewName::Synthetic,
        "Synthetic",
        "the synthetic view beside the query, and what the cost makes of them",
    ),
    entry::<space::SpaceView>(
        ViewName::Space,
        "3-D",
        "where reference, truth and estimates stand in the coloured cloud",
    ),
    entry::<ransac::RansacView>(
        ViewName::Ransac,
        "RANSAC",
        "likelihood and inliers of every hypothesis, the test of the best",
    ),
    entry::<surface::SurfaceView>(
        ViewName::Surface,
        "Cost surface",
        "cost and coverage of every position tried, minima, slices",
    ),
    entry::<histogram::HistogramView>(
        ViewName::Histogram,
        "Histogram",
        "joint histogram and entropies of MI, residuals of PM",
    ),
    entry::<fusion::FusionView>(
        ViewName::Fusion,
        "Fusion",
        "what each reference gives alone, its weight, and the fused pose",
    ),
    entry::<charts::ChartsView>(
        ViewName::Charts,
        "Charts",
        "the results of all queries: scatter of two measures, recall, verdicts",
    ),
    entry::<lockstep::LockstepView>(
        ViewName::Lockstep,
        "Lock-step",
        "all methods beside each other, each as many steps into its work",
    ),
    entry::<log::LogView>(ViewName::Log, "Log", "every decision in words"),
];

const fn entry<V: View + Default + 'static>(
    name: ViewName,
    title: &'static str,
    about: &'static str,
) -> Entry {
    Entry { name, title, about, new: || Box::<V>::default() }
}

/// Every name has its view.
const _: () = {
    assert!(ALL.len() == ViewName::ALL.len());
    let mut at = 0;
    while at < ALL.len() {
        assert!(ALL[at].name as usize == at);
        at += 1;
    }
};

/// The view of a name.
pub(super) fn entry_of(name: ViewName) -> &'static Entry {
    &ALL[name as usize]
}
