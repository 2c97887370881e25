//! For posescope's own crates: may change in any version.
//!
//! Answers of other systems: poses of queries, and matches of photos.
//!
//! Poses become a method ([`Foreign::with_estimates`]) that runs nothing, and is measured, diagnosed and
//! recorded as the others are. Matches ([`Foreign::with_matches`]) replace those of SURF; the steps after
//! matching stay.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use crate::features::PairMatches;
use crate::geometry::Pose;
use crate::method::Method;
use crate::scene::SceneError;

/// The poses of another system, `world_from_camera`, by the name of the query.
pub type Estimates = BTreeMap<String, Pose>;

/// What other systems answered about the queries of one scene. Cloning it shares what it holds.
#[derive(Clone, Default)]
pub struct Foreign {
    estimates: BTreeMap<Method, Arc<Estimates>>,
    matches: Option<Arc<dyn MatchSource>>,
}

impl fmt::Debug for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Foreign")
            .field("estimates", &self.estimates)
            .field("matches", &self.matches.is_some())
            .finish()
    }
}

impl Foreign {
    /// The name under which a file of poses takes the place of the queries' true poses. Second opinions judge it like the
    /// poses of any other system.
    pub const TRUTH: Method = Method::named("truth");

    /// The same, and the poses of one more system under the name of a method.
    #[must_use]
    pub fn with_estimates(mut self, method: Method, estimates: Estimates) -> Self {
        self.estimates.insert(method, Arc::new(estimates));
        self
    }

    /// The same, with matches that take the place of those of SURF.
    #[must_use]
    pub fn with_matches(self, matches: Arc<dyn MatchSource>) -> Self {
        Self { matches: Some(matches), ..self }
    }

    /// The poses of a method, if it is another system.
    pub fn estimates(&self, method: Method) -> Option<&Arc<Estimates>> {
        self.estimates.get(&method)
    }

    /// The matches of a query with a reference, both by name; `None` without a source, so that features are
    /// detected and matched.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn matches(
        &self,
        query: &str,
        reference: &str,
    ) -> Result<Option<Arc<PairMatches>>, SceneError> {
        let Some(source) = &self.matches else {
            return Ok(None);
        };
        let found = source.matches(query, reference)?;
        Ok(Some(Arc::new(found.unwrap_or(PairMatches::Absent))))
    }
}

/// Where the matches of pairs of photos come from.
pub trait MatchSource: Send + Sync {
    /// The matches of two frames by name; `None` where there are none of this pair.
    ///
    /// # Errors
    /// When they cannot be read.
    fn matches(&self, query: &str, reference: &str) -> Result<Option<PairMatches>, SceneError>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_that_a_source_says_nothing_of_is_not_matched_by_ourselves() {
        struct Nothing;
        impl MatchSource for Nothing {
            fn matches(&self, _: &str, _: &str) -> Result<Option<PairMatches>, SceneError> {
                Ok(None)
            }
        }
        let none = Foreign::default();
        assert!(none.matches("a", "b").is_ok_and(|found| found.is_none()));
        let nothing = none.with_matches(Arc::new(Nothing));
        let found = nothing.matches("a", "b").expect("readable");
        assert_eq!(found.as_deref(), Some(&PairMatches::Absent));
    }
}
