//! How methods find their poses.

use serde::{Deserialize, Serialize};

use super::find;
use crate::cost::SearchRule;
use crate::method::Method;
use crate::params::Params;

/// How a method finds its pose: what it leaves behind, what can be said of it, and what may help.
///
/// It depends on the parameters too: `pm` with `pm.search=descent` is no search on a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// Features matched once: `fb`.
    Features,
    /// Features matched again where a pose says: `fb2`.
    Guided,
    /// A cost searched on a grid: `pm`, `mi` and other costs.
    Grid,
    /// Multi-start: a cost searched from many starts in six freedoms: `mi6`, `robust`, and costs with `search=starts`.
    MultiStart,
    /// A cost followed downhill from the reference pose: costs with `search=descent`.
    Descent,
    /// Another system's pose.
    Given,
}

impl Family {
    /// Every family.
    pub const ALL: &[Self] =
        &[Self::Features, Self::Guided, Self::Grid, Self::MultiStart, Self::Descent, Self::Given];
    /// Those that match features.
    pub const MATCHING: &[Self] = &[Self::Features, Self::Guided];
    /// Those that search a cost.
    pub const SEARCHING: &[Self] = &[Self::Grid, Self::MultiStart, Self::Descent];

    /// The family in one phrase.
    pub fn words(self) -> &'static str {
        match self {
            Self::Features => "features (fb)",
            Self::Guided => "features (fb2)",
            Self::Grid => "grid search (pm, mi)",
            Self::MultiStart => "many starts (mi6, robust)",
            Self::Descent => "descent (search=descent)",
            Self::Given => "other systems",
        }
    }

    /// The family of a method that is no hybrid, with these parameters; `None` where nothing is known of it but
    /// its pose.
    pub(crate) fn of(method: Method, params: &Params) -> Option<Self> {
        find(method).map_or(Some(Self::Given), |entry| entry.family(params))
    }
}

impl From<SearchRule> for Family {
    fn from(search: SearchRule) -> Self {
        match search {
            SearchRule::Grid => Self::Grid,
            SearchRule::MultiStart => Self::MultiStart,
            SearchRule::Descent => Self::Descent,
        }
    }
}
