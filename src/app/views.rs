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
mod in_sight;
mod legend;
mod lockstep;
mod log;
mod mesh_painter;
mod parameters;
mod queries;
mod ransac;
mod readout;
mod references;
mod retrieval;
mod space;
mod surface;
mod synthetic;

use eframe::egui_wgpu::RenderState;

use super::view_context::ViewContext;
use crate::event::DebugEvent;
use crate::method::Method;
use crate::session::Span;

/// A part of the window.
pub trait View {
    /// Draws the view. It must bear any moment of any run, and none.
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
    /// Makes the view. The render state is for those that draw on the graphics card themselves.
    pub new: fn(Option<&RenderState>) -> Box<dyn View>,
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
    Entry {
        name: QUERIES,
        title: "Queries",
        about: "all queries with what is known of them",
        new: |_| Box::<queries::QueriesView>::default(),
    },
    Entry {
        name: "batch",
        title: "Batch",
        about: "the results of all queries in a table: filter, sort, open",
        new: |_| Box::<batch::BatchView>::default(),
    },
    Entry {
        name: "references",
        title: "References",
        about: "which frames the query is localised against, and how their poses are fused",
        new: |_| Box::<references::ReferencesView>::default(),
    },
    Entry {
        name: PARAMETERS,
        title: "Parameters",
        about: "every parameter with unit, range and meaning",
        new: |_| Box::<parameters::ParametersView>::default(),
    },
    Entry {
        name: "breakpoints",
        title: "Breakpoints",
        about: "where a run is to stop",
        new: |_| Box::<breakpoints::BreakpointsView>::default(),
    },
    Entry {
        name: "images",
        title: "Images",
        about: "both photos, their matches, and where each feature ended",
        new: |_| Box::<images::ImagesView>::default(),
    },
    Entry {
        name: "retrieval",
        title: "Retrieval",
        about: "frames that resemble the query, and what in them lies alike",
        new: |_| Box::<retrieval::RetrievalView>::default(),
    },
    Entry {
        name: "synthetic",
        title: "Synthetic",
        about: "the synthetic view beside the query, and what the cost makes of them",
        new: |_| Box::<synthetic::SynthesisView>::default(),
    },
    Entry {
        name: "space",
        title: "3-D",
        about: "where reference, truth and estimates stand in the coloured cloud",
        new: |state| Box::new(space::SpaceView::new(state)),
    },
    Entry {
        name: "ransac",
        title: "RANSAC",
        about: "likelihood and inliers of every hypothesis, the test of the best",
        new: |_| Box::<ransac::RansacView>::default(),
    },
    Entry {
        name: "surface",
        title: "Cost surface",
        about: "cost and coverage of every position tried, minima, slices",
        new: |_| Box::<surface::SurfaceView>::default(),
    },
    Entry {
        name: "histogram",
        title: "Histogram",
        about: "joint histogram and entropies of MI, residuals of PM",
        new: |_| Box::<histogram::HistogramView>::default(),
    },
    Entry {
        name: "fusion",
        title: "Fusion",
        about: "what each reference gives alone, its weight, and the fused pose",
        new: |_| Box::<fusion::FusionView>::default(),
    },
    Entry {
        name: "charts",
        title: "Charts",
        about: "the results of all queries: scatter of two measures, recall, verdicts",
        new: |_| Box::<charts::ChartsView>::default(),
    },
    Entry {
        name: "lockstep",
        title: "Lock-step",
        about: "all methods beside each other, each as many steps into its work",
        new: |_| Box::<lockstep::LockstepView>::default(),
    },
    Entry {
        name: "log",
        title: "Log",
        about: "every decision in words",
        new: |_| Box::<log::LogView>::default(),
    },
];
