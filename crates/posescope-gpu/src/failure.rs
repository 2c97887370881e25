//! Why a card cannot be used.

/// Why a card cannot be used, or no longer. Each prints as one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// There is no driver, or no card.
    #[error("no graphics card found: {0}; use --compute cpu")]
    NoAdapter(String),
    /// There is only a software emulation of a card.
    #[error("no graphics card found, only the software emulation {0}")]
    OnlySoftware(String),
    /// The card was found and cannot be opened.
    #[error("the graphics card {name} cannot be opened: {why}; use --compute cpu")]
    NotOpened {
        /// Which card.
        name: String,
        /// What its driver says.
        why: String,
    },
    /// The card lacks room or abilities.
    #[error("the graphics card {name} is too small: {what}; use --compute cpu")]
    TooSmall {
        /// Which card.
        name: String,
        /// What is needed, and what is available.
        what: String,
    },
    /// Its numbers differ from the processor's in the initial test.
    #[error(
        "the graphics card {0} rounds differently from the processor, so results would differ; use --compute cpu"
    )]
    Inexact(String),
    /// The card or its driver stopped working.
    #[error("the graphics card {name} was lost: {why}")]
    Lost {
        /// Which card.
        name: String,
        /// The last error.
        why: String,
    },
    /// Its numbers differed from the processor's during a run.
    #[error(
        "the graphics card {0} and the processor disagree on a cost, which is a bug in its driver or in \
         posescope; results so far may be wrong, run again with --compute cpu"
    )]
    Disagrees(String),
}
