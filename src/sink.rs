//! Sinks for the events of a run: recordings, progress bars, several at once.

mod events;
#[cfg(feature = "cli")]
mod progress;
#[cfg(feature = "rerun")]
pub mod rerun;

pub use events::{SceneNames, write_event};
#[cfg(feature = "cli")]
pub use progress::Progress;
