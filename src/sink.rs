//! Sinks for the events of a run: recordings, JSON lines, progress bars.

mod events;
#[cfg(feature = "cli")]
mod progress;
#[cfg(feature = "rerun")]
pub mod rerun;

pub use events::{SceneNames, write_event};
#[cfg(feature = "cli")]
pub use progress::Progress;
