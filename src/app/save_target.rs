//! What can be saved in a file of somebody's choice.

/// Something that leaves the window for a file, or comes from one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SaveTarget {
    /// All that was told so far, for the Rerun viewer.
    Recording,
    /// A view or the whole window, as PNG.
    Picture(Option<&'static str>),
    /// Scene, query, settings and layout.
    Session,
    /// Back from such a file.
    Restored,
}

impl SaveTarget {
    /// What is asked, as the title of the question.
    pub(super) fn title(self) -> String {
        match self {
            Self::Recording => "Save the recording".to_owned(),
            Self::Picture(None) => "Save the window as a picture".to_owned(),
            Self::Picture(Some(view)) => format!("Save the view {view} as a picture"),
            Self::Session => "Save the session".to_owned(),
            Self::Restored => "Restore a session".to_owned(),
        }
    }
}
