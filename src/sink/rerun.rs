//! Recordings for the Rerun viewer.
//!
//! A [`Recorder`] is a [`Sink`](crate::trace::Sink) that records the events of an estimator, with a layout for the
//! stock viewer. [`entities`] lists the entity paths.
//!
//! Two recordings of the same run are equal under `rerun rrd compare --unordered`, and a run that is
//! killed leaves a readable recording of everything up to the last view or stage.

mod blueprint;
mod checkup;
mod comparison;
mod direct;
mod encode;
pub mod entities;
mod error;
mod feature;
mod file;
mod fusion;
mod indexed;
mod layout;
mod recorder;
mod recording;
mod report;
mod retrieval;
mod scene;
mod stream;
mod surface;
mod targets;
mod viewer;

pub use checkup::record_checkup;
pub use comparison::record_comparison;
pub use error::RecordError;
pub use recorder::Recorder;
pub use targets::{Identity, Targets};

use crate::palette::Rgb;

fn color([r, g, b]: Rgb) -> rerun::Color {
    rerun::Color::from_rgb(r, g, b)
}
