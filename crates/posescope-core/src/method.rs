//! The methods that are compared, by the names that the paper gives them.

/// An estimator, as the paper abbreviates it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Method {
    /// FB, the indirect feature-based method.
    Feature,
    /// PM, the direct photometric method.
    Photometric,
    /// MI, the direct mutual-information method.
    MutualInformation,
    /// HY, the hybrid of FB and MI.
    Hybrid,
}

impl Method {
    /// The order in which methods run and are listed.
    pub const ALL: [Self; 4] = [
        Self::Feature,
        Self::Photometric,
        Self::MutualInformation,
        Self::Hybrid,
    ];

    /// The short name on the command line, in results and in recordings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Feature => "fb",
            Self::Photometric => "pm",
            Self::MutualInformation => "mi",
            Self::Hybrid => "hy",
        }
    }

    /// The method of a short name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.name() == name)
    }
}
