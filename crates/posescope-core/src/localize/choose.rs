//! Choosing the references of a query.

use std::sync::Arc;

use super::observer::checkpoint;
use super::select::{ByMatches, ChoiceError, Ranking, References, Selection, draw, frames_within};
use super::{LocalizeObserver, Localizer};
use crate::params::Params;
use crate::retrieval::{Criterion, RankedReference, ReferenceRanking};

/// Chooses references for queries.
pub struct Chooser<'a> {
    /// Whose frames are ranked, and what is known about them.
    pub localizer: &'a Localizer<'a>,
    /// Parameters of features and matching.
    pub params: &'a Params,
    /// How references are chosen, and how many.
    pub selection: Selection,
    /// How far from the query's known position a reference may be \[m\].
    pub radius_m: f64,
    /// Seed of the draw.
    pub seed: u64,
    /// The index that [`Selection::Retrieved`] asks.
    pub index: Option<&'a dyn Ranking>,
}

impl Chooser<'_> {
    /// The references of a query, perhaps none. `left_out` excludes frames of the references' scene; the
    /// query itself is always excluded. `observer` follows the progress and can stop it.
    ///
    /// # Errors
    /// [`ChoiceError`].
    pub fn choose(
        &self,
        query: usize,
        left_out: &dyn Fn(usize) -> bool,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<References, ChoiceError> {
        let (references, queries) = (self.localizer.references(), self.localizer.queries());
        let name = &queries.frames()[query];
        let place = queries.position(query);
        let is_one_drive = self.localizer.is_one_drive();
        let excluded = |frame| is_one_drive && frame == query || left_out(frame);
        let mut within = match (place, self.selection) {
            (Some(place), _) => frames_within(references, &place, self.radius_m, &excluded),
            // Without a position, all frames are candidates.
            (None, Selection::Matched(_) | Selection::Retrieved(_)) => {
                (0..references.frames().len())
                    .filter(|&frame| !excluded(frame) && references.has_cloud(frame))
                    .filter(|&frame| references.pose(frame).is_some())
                    .collect()
            }
            (None, _) => {
                return Err(ChoiceError::UnknownPosition { query: name.clone() });
            }
        };
        let count = self.selection.count();
        let chosen = match self.selection {
            Selection::Random(_) => draw(within, count, name, self.seed).into(),
            Selection::Nearest(_) => {
                within.truncate(count);
                within.into()
            }
            Selection::Matched(_) => {
                let by_matches = ByMatches { scene: references, params: self.params };
                self.ranked(query, &within, &by_matches, observer)?
            }
            Selection::Retrieved(_) => {
                let index = self.index.ok_or(ChoiceError::NoIndex)?;
                self.ranked(query, &within, index, observer)?
            }
        };
        Ok(References { within_m: place.map(|_| self.radius_m), ..chosen })
    }

    fn ranked(
        &self,
        query: usize,
        candidates: &[usize],
        by: &dyn Ranking,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<References, ChoiceError> {
        let (references, queries) = (self.localizer.references(), self.localizer.queries());
        let count = self.selection.count();
        let depth = ReferenceRanking::depth(count);
        let mut looked_at = 0;
        let frames: Vec<RankedReference> = by
            .rank(&*queries.query(query)?, candidates, depth, &mut || {
                looked_at += 1;
                observer.choosing(looked_at, candidates.len());
                checkpoint(observer)
            })?
            .into_iter()
            .map(|ranked| RankedReference {
                name: references.frames()[ranked.frame].clone(),
                world_from_camera: references.pose(ranked.frame),
                ranked,
            })
            .collect();
        // Matches are not verified, and all accepted.
        let needed = match by.criterion() {
            Criterion::Words => self.params.retrieval.accept,
            Criterion::Matches => 0,
        };
        let chosen: Vec<usize> = frames
            .iter()
            .take(count)
            .filter(|reference| reference.ranked.inliers() >= needed)
            .map(|reference| reference.ranked.frame)
            .collect();
        Ok(References {
            ranking: Some(Arc::new(ReferenceRanking {
                criterion: by.criterion(),
                candidates: candidates.len(),
                chosen: chosen.len(),
                frames,
            })),
            frames: chosen,
            within_m: None,
        })
    }
}
