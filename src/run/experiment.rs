//! The paper's experiments.

use std::fmt;
use std::str::FromStr;

use crate::text::UnknownWord;

/// One of the experiments of the paper's section 4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Experiment {
    /// One random reference within 10, 15, 20 and 25 m (section 4.3, table 3).
    Single,
    /// One to five references, four fusions (section 4.4, table 4).
    Multi,
    /// References from retrieval within a large prior (section 4.5, tables 5 and 6).
    Large,
}

impl Experiment {
    /// All experiments.
    pub const ALL: [Self; 3] = [Self::Single, Self::Multi, Self::Large];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Multi => "multi",
            Self::Large => "large",
        }
    }
}

impl fmt::Display for Experiment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Experiment {
    type Err = UnknownWord;

    fn from_str(name: &str) -> Result<Self, UnknownWord> {
        let found = Self::ALL.into_iter().find(|known| known.name() == name);
        found.ok_or_else(|| UnknownWord::among(name, "preset", Self::ALL.map(Self::name)))
    }
}

posescope_core::serde_as_text!(Experiment);
