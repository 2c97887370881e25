//! Sinks for the events of a run: recordings, progress bars, several at once.

#[cfg(feature = "cli")]
mod progress;
#[cfg(feature = "rerun")]
pub mod rerun;

#[cfg(feature = "cli")]
pub use progress::Progress;
