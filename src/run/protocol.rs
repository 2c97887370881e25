//! How queries are localised, whichever they are.

use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::estimates_file::EstimatesFile;
use crate::diagnosis::Tolerance;
use crate::foreign::Foreign;
use crate::fusion::Fusion;
use crate::image::Degradation;
use crate::localize::{Localizer, Selection};
use crate::method::Method;
use crate::scene::{MatchFolder, Scene, SceneError, degraded, located, read_estimates};

/// The protocol of a localisation: what is the same for every query, scene and radius. The defaults
/// of everything in it are here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Protocol {
    /// How references are chosen.
    pub references: Selection,
    /// How far from the query's known position references may be \[m\]; without it, as far as the
    /// uncertainty radius. See [`Self::reach_m`].
    pub prior_m: Option<f64>,
    /// Poses of other systems, which are methods beside ours: read before the methods, some of which
    /// they name.
    #[serde(default, skip_serializing_if = "is_default")]
    pub estimates: Vec<EstimatesFile>,
    /// The methods, in the order of their results.
    pub methods: Vec<Method>,
    /// What to make of several references: one pose by each of these, or without any a pose for each
    /// reference.
    pub fusions: Vec<Fusion>,
    /// Seed of every random choice.
    pub seed: u64,
    /// How near the truth a pose is right, so that no verdict says why it failed.
    #[serde(default, skip_serializing_if = "is_default")]
    pub right: Tolerance,
    /// The least probability of being within 1 m with which a pose is accepted; without it every pose
    /// is that its method gives.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accept: Option<f64>,
    /// How often a query that went wrong is localised again, at most, to see what would have helped.
    #[serde(default, skip_serializing_if = "is_default")]
    pub explain: usize,
    /// A folder of matches that take the place of those of SURF.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub matches: Option<PathBuf>,
    /// A file of rough positions of queries, around which references are sought.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gps: Option<PathBuf>,
    /// What is done to the photos of queries before anybody sees them.
    #[serde(default, skip_serializing_if = "is_default")]
    pub degrade: Degradation,
}

/// For what is written only where somebody asked for it.
pub(super) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// One random reference, the methods of the paper.
impl Default for Protocol {
    fn default() -> Self {
        Self {
            references: Selection::Random(1),
            prior_m: None,
            methods: Method::PAPER.to_vec(),
            fusions: Vec::new(),
            seed: 0,
            right: Tolerance::default(),
            accept: None,
            explain: 0,
            estimates: Vec::new(),
            matches: None,
            gps: None,
            degrade: Degradation::default(),
        }
    }
}

impl Protocol {
    /// Runs that explain a wrong result, where their number is not given.
    pub const EXPLAINING_RUNS: usize = 12;

    /// The uncertainty radius where none is given \[m\].
    pub const RADIUS_M: f64 = 15.0;

    /// A localizer that judges and accepts poses as this says.
    pub fn configured<'a>(&self, localizer: Localizer<'a>) -> Localizer<'a> {
        localizer
            .with_tolerance(self.right)
            .accepting_from(self.accept)
            .explaining(self.explain)
    }

    /// What other systems answered about the frames of the queries' scene.
    ///
    /// # Errors
    /// A file that cannot be read, or is of another scene.
    pub fn foreign(&self, queries: &dyn Scene) -> Result<Foreign, SceneError> {
        let mut foreign = Foreign::default();
        for EstimatesFile { method, path } in &self.estimates {
            foreign = foreign.with_estimates(*method, read_estimates(path, queries)?);
        }
        if let Some(folder) = &self.matches {
            foreign = foreign.with_matches(Arc::new(MatchFolder::open(folder)?));
        }
        Ok(foreign)
    }

    /// The scene of queries as it is asked about: with the rough positions that were given, and with
    /// its photos degraded.
    ///
    /// # Errors
    /// The errors of [`located`].
    pub fn as_asked(
        &self,
        queries: Arc<dyn Scene>,
        references: &dyn Scene,
    ) -> Result<Arc<dyn Scene>, SceneError> {
        let queries = match &self.gps {
            Some(path) => located(queries, references, path)?,
            None => queries,
        };
        Ok(self.degraded(&queries))
    }

    /// The scene of queries with its photos degraded, in the place of any degradation before.
    pub fn degraded(&self, queries: &Arc<dyn Scene>) -> Arc<dyn Scene> {
        degraded(queries, self.degrade, self.seed)
    }

    /// How far from a query's known position its references may be \[m\], with this uncertainty
    /// radius \[m\].
    pub fn reach_m(&self, radius_m: f64) -> f64 {
        self.prior_m.unwrap_or(radius_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_reach_as_far_as_the_prior_and_without_one_as_the_radius() {
        let mut protocol = Protocol::default();
        assert_eq!(protocol.reach_m(Protocol::RADIUS_M), 15.0);
        protocol.prior_m = Some(200.0);
        assert_eq!(protocol.reach_m(Protocol::RADIUS_M), 200.0);
    }
}
