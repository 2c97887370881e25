//! Sinks for the events of a run: recordings and JSON lines.

mod events;
#[cfg(feature = "rerun")]
pub mod rerun;
#[cfg(feature = "rerun")]
mod run_records;

pub use events::{EventExport, EventLines, SceneNames};
#[cfg(feature = "rerun")]
pub use run_records::{Follower, KEPT_FAILURES, RunRecords, merge_failures};
