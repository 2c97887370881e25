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
mod parameters;
mod queries;
mod ransac;
mod references;
mod retrieval;
mod space;
mod surface;
mod synthetic;

use super::view_context::ViewContext;
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
    /// The name in saved layouts.
    pub name: &'static str,
    /// The title on its tab.
    pub title: &'static str,
    /// What the view shows, in one phrase.
    pub about: &'static str,
    /// Makes the view.
    pub new: fn() -> Box<dyn View>,
}

/// Name of the list of queries.
pub(super) const QUERIES: &str = "queries";
/// Name of the list of parameters.
pub(super) const PARAMETERS: &str = "parameters";

/// The registered name that equals a name from elsewhere.
pub(super) fn name_of(name: &str) -> Option<&'static str> {
    let mut names = ALL.iter().map(|entry| entry.name);
    names.find(|known| *known == name)
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

/// Every view, in the order of the menu.
pub const ALL: &[Entry] = &[
    entry::<queries::QueriesView>(QUERIES, "Queries", "all queries with what is known of them"),
    entry::<batch::BatchView>(
        "batch",
        "Batch",
        "the results of all queries in a table: filter, sort, open",
    ),
    entry::<references::ReferencesView>(
        "references",
        "References",
        "which frames the query is localised against, and how their poses are fused",
    ),
    entry::<parameters::ParametersView>(
        PARAMETERS,
        "Parameters",
        "every parameter with unit, range and meaning",
    ),
    entry::<breakpoints::BreakpointsView>("breakpoints", "Breakpoints", "where a run is to stop"),
    entry::<images::ImagesView>(
        "images",
        "Images",
        "both photos, their matches, and where each feature ended",
    ),
    entry::<retrieval::RetrievalView>(
        "retrieval",
        "Retrieval",
        "frames that resemble the query, and what in them lies alike",
    ),
    entry::<synthetic::SynthesisView>(
        "synthetic",
        "Synthetic",
        "the synthetic view beside the query, and what the cost makes of them",
    ),
    entry::<space::SpaceView>(
        "space",
        "3-D",
        "where reference, truth and estimates stand in the coloured cloud",
    ),
    entry::<ransac::RansacView>(
        "ransac",
        "RANSAC",
        "likelihood and inliers of every hypothesis, the test of the best",
    ),
    entry::<surface::SurfaceView>(
        "surface",
        "Cost surface",
        "cost and coverage of every position tried, minima, slices",
    ),
    entry::<histogram::HistogramView>(
        "histogram",
        "Histogram",
        "joint histogram and entropies of MI, residuals of PM",
    ),
    entry::<fusion::FusionView>(
        "fusion",
        "Fusion",
        "what each reference gives alone, its weight, and the fused pose",
    ),
    entry::<charts::ChartsView>(
        "charts",
        "Charts",
        "the results of all queries: scatter of two measures, recall, verdicts",
    ),
    entry::<lockstep::LockstepView>(
        "lockstep",
        "Lock-step",
        "all methods beside each other, each as many steps into its work",
    ),
    entry::<log::LogView>("log", "Log", "every decision in words"),
];

const fn entry<V: View + Default + 'static>(
    name: &'static str,
    title: &'static str,
    about: &'static str,
) -> Entry {
    Entry { name, title, about, new: || Box::<V>::default() }
}
