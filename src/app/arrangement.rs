//! What the window is arranged for.

/// What the window is arranged for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Arrangement {
    /// Everything about one query, for somebody who asks why it failed.
    #[default]
    Inspect,
    /// Few large views and one sentence for each stage, and nothing of what is still to come.
    Teach,
    /// A run over many queries.
    Batch,
}

impl Arrangement {
    /// All arrangements, with their titles and keys.
    pub const ALL: [(Self, &'static str, egui::Key); 3] = [
        (Self::Inspect, "Inspect", egui::Key::F2),
        (Self::Teach, "Teach", egui::Key::F3),
        (Self::Batch, "Batch", egui::Key::F4),
    ];
}
