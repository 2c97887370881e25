//! Why a card cannot be used.

/// Why a card cannot be used, or not any more. Each is one line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GpuError {
    /// There is no driver, or no card.
    #[error("no graphics card to compute on: {0}")]
    NoAdapter(String),
    /// There is nothing but software that plays a card.
    #[error("no graphics card to compute on, only software that plays one: {0}")]
    OnlySoftware(String),
    /// The card was found and cannot be opened.
    #[error("the graphics card {name} cannot be used: {why}")]
    NotOpened {
        /// Which card.
        name: String,
        /// What its driver says.
        why: String,
    },
    /// The card lacks room or abilities.
    #[error("the graphics card {name} is too small: {what}")]
    TooSmall {
        /// Which card.
        name: String,
        /// What is needed, and what is there.
        what: String,
    },
    /// Its numbers are not those of the processor, before anything was asked.
    #[error(
        "the graphics card {0} rounds otherwise than the processor, so its results would differ"
    )]
    Inexact(String),
    /// The card or its driver stopped working.
    #[error("the graphics card {name} was lost: {why}")]
    Lost {
        /// Which card.
        name: String,
        /// What was heard of it last.
        why: String,
    },
    /// Its numbers were not those of the processor while it worked.
    #[error(
        "the graphics card {0} disagreed with the processor on a cost, which is a mistake of its driver or \
         of ours; results so far may be wrong, run again with --compute cpu"
    )]
    Disagrees(String),
}
