//! The names of the views.

/// Declares the views, each with the word for it in lessons and widgets.
macro_rules! names {
    ($($name:ident = $word:literal),+ $(,)?) => {
        /// A view.
        #[allow(missing_docs, reason = "the registry says what each view shows")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum ViewName { $($name),+ }

        impl ViewName {
            /// All of them, in the order of the menu.
            pub const ALL: &[Self] = &[$(Self::$name),+];

            /// The word for it.
            pub fn word(self) -> &'static str {
                match self { $(Self::$name => $word),+ }
            }
        }
    };
}

names! {
    Queries = "queries",
    Batch = "batch",
    References = "references",
    Parameters = "parameters",
    Breakpoints = "breakpoints",
    Images = "images",
    Retrieval = "retrieval",
    Synthetic = "synthetic",
    Space = "space",
    Ransac = "ransac",
    Surface = "surface",
    Histogram = "histogram",
    Fusion = "fusion",
    Charts = "charts",
    Lockstep = "lockstep",
    Log = "log",
}

impl ViewName {
    /// The view with this word.
    pub fn find(word: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|name| name.word() == word)
    }
}
