//! How methods find their poses.

use super::find;
use crate::method::Method;

/// How a method finds its pose, as far as rules differ by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Features matched once: `fb`.
    Features,
    /// Features matched again where a pose says: `fb2`.
    Guided,
    /// A cost searched on a grid: `pm`, `mi` and other costs.
    Grid,
    /// A cost searched from many starts in six freedoms: `mi6`, `robust`.
    Starts,
    /// Another system's pose.
    Given,
}

impl Family {
    /// Every family.
    pub const ALL: &[Self] = &[Self::Features, Self::Guided, Self::Grid, Self::Starts, Self::Given];
    /// Those that match features.
    pub const MATCHING: &[Self] = &[Self::Features, Self::Guided];
    /// Those that search a cost.
    pub const SEARCHING: &[Self] = &[Self::Grid, Self::Starts];
    /// Those whose pose has a cost: searched, or given by another system.
    pub const COSTED: &[Self] = &[Self::Grid, Self::Starts, Self::Given];

    /// The family in one phrase.
    pub fn words(self) -> &'static str {
        match self {
            Self::Features => "features (fb)",
            Self::Guided => "features (fb2)",
            Self::Grid => "grid search (pm, mi)",
            Self::Starts => "many starts (mi6, robust)",
            Self::Given => "other systems",
        }
    }

    /// The family of a method that is no hybrid; `None` where nothing is known of it but its pose.
    pub(crate) fn of(method: Method) -> Option<Self> {
        find(method).map_or(Some(Self::Given), |entry| entry.family)
    }
}
