//! What can be saved in a file of somebody's choice.

/// Something that leaves the window for a file, or comes from one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveTarget {
    /// All that was told so far, for the Rerun viewer.
    Recording,
    /// The whole window, as PNG.
    Picture,
    /// The canvas, as PNG.
    Canvas,
    /// Scene, query, settings and layout.
    Session,
    /// Back from such a file.
    Restored,
}

impl SaveTarget {
    /// What is asked, as the title of the question.
    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Recording => "Save the recording",
            Self::Picture => "Save the window as a picture",
            Self::Canvas => "Save the canvas as a picture",
            Self::Session => "Save the session",
            Self::Restored => "Restore a session",
        }
    }
}
