//! Sinks for the events of a run: recordings and JSON lines.

mod events;
#[cfg(feature = "rerun")]
pub mod rerun;

pub use events::{SceneNames, write_event};
