//! Those who watch a run: recordings, progress bars, several at once.

mod fanout;
#[cfg(feature = "cli")]
mod progress;
#[cfg(feature = "rerun")]
pub mod rerun;

pub use fanout::Fanout;
#[cfg(feature = "cli")]
pub use progress::Progress;
