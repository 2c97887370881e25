//! A protocol applied to scenes.

use std::sync::Arc;

use super::Protocol;
use crate::foreign::Foreign;
use crate::localize::{Chooser, Localizer, Ranking};
use crate::run::EstimatesFile;
use crate::scene::{MatchFolder, Scene, SceneError, degraded, located, read_estimates};

impl Protocol {
    /// The localizer with this protocol's tolerance, least confidence and explanations, and with the poses and
    /// matches of other systems.
    ///
    /// # Errors
    /// A file of another system that cannot be read or belongs to another scene.
    pub fn configured<'a>(&self, localizer: Localizer<'a>) -> Result<Localizer<'a>, SceneError> {
        let mut foreign = Foreign::default();
        for EstimatesFile { method, path } in &self.estimates {
            let estimates = read_estimates(path, localizer.queries())?;
            foreign = foreign.with_estimates(*method, estimates);
        }
        if let Some(folder) = &self.matches {
            let matches = MatchFolder::open(folder)?;
            let matches = matches.between(localizer.queries(), localizer.references());
            foreign = foreign.with_matches(Arc::new(matches));
        }
        Ok(localizer
            .with_foreign(foreign)
            .with_tolerance(self.right)
            .accepting_from(self.min_confidence)
            .explaining(self.explain))
    }

    /// What chooses references within this distance of a query \[m\], by this index if one is needed.
    pub fn chooser<'a>(
        &self,
        localizer: &'a Localizer<'a>,
        radius_m: f64,
        index: Option<&'a dyn Ranking>,
    ) -> Chooser<'a> {
        let (params, selection, seed) = (localizer.params(), self.selection(), self.seed);
        Chooser { localizer, params, selection, radius_m, seed, index }
    }

    /// The scene of the queries with the given rough positions and degraded photos.
    ///
    /// # Errors
    /// The errors of [`located`].
    pub fn prepared_queries(
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

    /// The scene of the queries with degraded photos; replaces an earlier degradation.
    pub fn degraded(&self, queries: &Arc<dyn Scene>) -> Arc<dyn Scene> {
        degraded(queries, self.degrade, self.seed)
    }

    /// How far from a query's known position references are chosen \[m\], given the uncertainty radius \[m\].
    pub fn reach_m(&self, radius_m: f64) -> f64 {
        self.prior_m.unwrap_or(radius_m)
    }
}
