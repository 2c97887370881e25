//! The views: each one file and one entry in [`ALL`].
//!
//! A view draws from the [`ViewContext`] that it is handed and keeps nothing of the run. What it does keep
//! is how a person looks at it: a zoom, a filter.

mod breakpoints;
mod canvas;
mod fusion;
mod histogram;
mod images;
mod ink;
mod legend;
mod log;
mod parameters;
mod queries;
mod ransac;
mod readout;
mod references;
mod report;
mod retrieval;
mod space;
mod surface;
mod synthetic;
mod thumbnail;

use eframe::egui_wgpu::RenderState;

use super::view_context::ViewContext;

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
    /// One phrase.
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

/// Every view, in the order of the menu.
pub const ALL: &[Entry] = &[
    Entry {
        name: QUERIES,
        title: "Queries",
        about: "all queries with what is known of them",
        new: |_| Box::<queries::QueryList>::default(),
    },
    Entry {
        name: "references",
        title: "References",
        about: "which frames the query is localised against, and how their poses are fused",
        new: |_| Box::<references::References>::default(),
    },
    Entry {
        name: PARAMETERS,
        title: "Parameters",
        about: "every parameter with unit, range and meaning",
        new: |_| Box::<parameters::Parameters>::default(),
    },
    Entry {
        name: "breakpoints",
        title: "Breakpoints",
        about: "where a run is to stop",
        new: |_| Box::<breakpoints::BreakpointList>::default(),
    },
    Entry {
        name: "images",
        title: "Images",
        about: "both photos, their matches, and where each feature ended",
        new: |_| Box::<images::Images>::default(),
    },
    Entry {
        name: "retrieval",
        title: "Retrieval",
        about: "frames that resemble the query, and what in them lies alike",
        new: |_| Box::<retrieval::Retrieval>::default(),
    },
    Entry {
        name: "synthetic",
        title: "Synthetic",
        about: "the synthetic view beside the query, and what the cost makes of them",
        new: |_| Box::<synthetic::Synthetic>::default(),
    },
    Entry {
        name: "space",
        title: "3-D",
        about: "cloud, cameras, rays and costs in space",
        new: |state| Box::new(space::Space::new(state)),
    },
    Entry {
        name: "ransac",
        title: "RANSAC",
        about: "likelihood and inliers of every hypothesis, the test of the best",
        new: |_| Box::<ransac::Ransac>::default(),
    },
    Entry {
        name: "surface",
        title: "Cost surface",
        about: "cost and coverage of every position tried, minima, slices",
        new: |_| Box::<surface::Surface>::default(),
    },
    Entry {
        name: "histogram",
        title: "Histogram",
        about: "joint histogram and entropies of MI, residuals of PM",
        new: |_| Box::<histogram::Histogram>::default(),
    },
    Entry {
        name: "fusion",
        title: "Fusion",
        about: "what each reference gives alone, its weight, and the fused pose",
        new: |_| Box::<fusion::Fusion>::default(),
    },
    Entry {
        name: "report",
        title: "Report",
        about: "verdicts, errors, timings, parameters",
        new: |_| Box::<report::Report>::default(),
    },
    Entry {
        name: "log",
        title: "Log",
        about: "every decision in words",
        new: |_| Box::<log::Log>::default(),
    },
];
