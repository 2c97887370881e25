//! What the window is arranged for.

use serde::{Deserialize, Serialize};

/// What the window is arranged for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Arrangement {
    /// One query: why it failed.
    #[default]
    Inspect,
    /// One large picture and one sentence for each stage, and nothing of what is still to come.
    Lecture,
    /// A run over many queries.
    Batch,
}

impl Arrangement {
    /// All arrangements, with their titles and the texts of their actions.
    pub const ALL: [(Self, &'static str, &'static str); 3] = [
        (Self::Inspect, "Inspect", "Inspect one query"),
        (Self::Lecture, "Lecture", "Lecture"),
        (Self::Batch, "Batch", "Batch of results"),
    ];
}
