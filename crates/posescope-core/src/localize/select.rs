//! Choosing references by where they are, or by what they look like.

use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

use nalgebra::Point3;
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_pcg::Pcg64;
use rayon::prelude::*;

use crate::estimator::count_matches;
use crate::event::{ReferencesRanked, Stage};
use crate::params::Params;
use crate::problem::Query;
use crate::retrieval::{Criterion, Geometry, Ranked, RankedReference, ReferenceRanking};
use crate::scene::{Scene, SceneError};
use crate::text::UnknownWord;
use crate::trace::{Cancelled, Trace};

/// How references are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// K frames within the radius, drawn by the seed.
    Random(usize),
    /// The K nearest frames within the radius.
    Nearest(usize),
    /// The K frames within the radius that share the most feature matches with the query: what a
    /// perfect index of the features could find.
    Matched(usize),
    /// The K frames that retrieval ranks first.
    Retrieved(usize),
}

/// A name, and what it makes of a count.
type Way = (&'static str, fn(usize) -> Selection);

/// The ways of choosing, in the order of the variants.
const WAYS: [Way; 4] = [
    ("random", Selection::Random),
    ("nearest", Selection::Nearest),
    ("matches", Selection::Matched),
    ("retrieve", Selection::Retrieved),
];

impl Selection {
    /// The place among [`WAYS`], and how many are chosen.
    fn parts(self) -> (usize, usize) {
        match self {
            Self::Random(count) => (0, count),
            Self::Nearest(count) => (1, count),
            Self::Matched(count) => (2, count),
            Self::Retrieved(count) => (3, count),
        }
    }

    /// Whether this is the name of a way of choosing: the part before the colon.
    pub fn is_name(text: &str) -> bool {
        WAYS.iter().any(|(name, _)| *name == text)
    }

    /// How many references are chosen: the K of its name.
    pub fn count(self) -> usize {
        self.parts().1
    }

    /// The same way of choosing, with another K.
    pub fn with_count(self, count: usize) -> Self {
        WAYS[self.parts().0].1(count)
    }
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (way, count) = self.parts();
        write!(f, "{}:{count}", WAYS[way].0)
    }
}

/// The most references of a query.
const MOST: usize = 1000;

impl FromStr for Selection {
    type Err = UnknownWord;

    fn from_str(text: &str) -> Result<Self, UnknownWord> {
        let read = || {
            let (how, count) = text.split_once(':')?;
            let (_, make) = WAYS.iter().find(|(name, _)| *name == how)?;
            count.parse().ok().filter(|count| (1..=MOST).contains(count)).map(make)
        };
        read().ok_or_else(|| UnknownWord {
            found: text.to_owned(),
            kind: "choice of references",
            expected: format!(
                "random:K, nearest:K, matches:K or retrieve:K with K from 1 to {MOST}"
            ),
        })
    }
}

crate::serde_as_text!(Selection);

/// Something that ranks reference frames for a query by what they look like: an index to ask.
pub trait Ranking: Send + Sync {
    /// What its scores are.
    fn criterion(&self) -> Criterion;

    /// The best `count` of the candidates, the best first, all of them as positions in the
    /// references' scene. `checkpoint` is called between two frames that are looked at.
    ///
    /// # Errors
    /// When a frame or the index cannot be read, and those of `checkpoint`.
    fn rank(
        &self,
        query: &Query,
        candidates: &[usize],
        count: usize,
        checkpoint: &mut dyn FnMut() -> Result<(), Cancelled>,
    ) -> Result<Vec<Ranked>, ChoiceError>;
}

/// The references of a query.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct References {
    /// The positions of the references in their scene.
    pub frames: Vec<usize>,
    /// How they were found, where something ranked them.
    pub ranking: Option<Arc<ReferenceRanking>>,
    /// How far from the query's known position they were sought \[m\]; `None` where they were named,
    /// or the position is not known.
    pub within_m: Option<f64>,
}

impl From<Vec<usize>> for References {
    fn from(frames: Vec<usize>) -> Self {
        Self { frames, ranking: None, within_m: None }
    }
}

/// Emits how the references of a query were ranked.
///
/// # Errors
/// Only [`Cancelled`]. A photo that cannot be read is not shown: watching never changes the answer.
pub fn report_ranking(
    ranking: &Arc<ReferenceRanking>,
    references: &dyn Scene,
    trace: &mut Trace<'_>,
) -> Result<(), Cancelled> {
    let photo = |reference: &RankedReference| {
        let read = references.query(reference.ranked.frame);
        read.inspect_err(|error| log::warn!("{error}")).ok().map(|frame| Arc::clone(&frame.photo))
    };
    trace.stage(Stage::Retrieve, |trace| {
        trace.emit(|| ReferencesRanked {
            ranking: Arc::clone(ranking),
            photos: ranking.pictured().iter().map(photo).collect(),
        })
    })
}

/// Frames with pose and cloud within `radius_m` of a place, except those left out, the nearest
/// first; of equally near ones, the earlier.
pub fn frames_within(
    scene: &dyn Scene,
    place: &Point3<f64>,
    radius_m: f64,
    left_out: &dyn Fn(usize) -> bool,
) -> Vec<usize> {
    let mut within: Vec<(f64, usize)> = (0..scene.frames().len())
        .filter(|&frame| !left_out(frame))
        .filter_map(|frame| {
            let offset = scene.pose(frame)?.translation.vector - place.coords;
            let distance = offset.norm();
            (distance <= radius_m && scene.has_cloud(frame)).then_some((distance, frame))
        })
        .collect();
    within.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    within.into_iter().map(|(_, frame)| frame).collect()
}

/// `count` of the candidates, drawn for a query: the draw depends on the seed and the query's name,
/// not on its place among the queries.
pub fn draw(mut candidates: Vec<usize>, count: usize, query: &str, seed: u64) -> Vec<usize> {
    candidates.sort_unstable();
    let text = format!("{seed}/{query}/references");
    let seed = xxhash_rust::xxh3::xxh3_64(text.as_bytes());
    candidates.shuffle(&mut Pcg64::seed_from_u64(seed));
    candidates.truncate(count);
    candidates
}

/// Why no references can be chosen.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ChoiceError {
    /// References are sought around the query, whose position is unknown.
    #[error(
        "the position of query {query} is not known; name a frame with --reference, say where it is \
         with --gps, or choose by looks with --reference matches:K or retrieve:K"
    )]
    UnknownPosition {
        /// The query frame's name.
        query: String,
    },
    /// There is nothing that could rank frames.
    #[error(
        "retrieve:K needs a retrieval index of the references; build it with `posescope index`"
    )]
    NoIndex,
    /// A frame cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The observer asked the run to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Photos that are looked at between two looks at whether to stop.
const AT_ONCE: usize = 8;

/// Ranks by exhaustive matching of features.
pub struct ByMatches<'a> {
    /// The references' scene.
    pub scene: &'a dyn Scene,
    /// Parameters of features and matching.
    pub params: &'a Params,
}

impl Ranking for ByMatches<'_> {
    fn criterion(&self) -> Criterion {
        Criterion::Matches
    }

    fn rank(
        &self,
        query: &Query,
        candidates: &[usize],
        count: usize,
        checkpoint: &mut dyn FnMut() -> Result<(), Cancelled>,
    ) -> Result<Vec<Ranked>, ChoiceError> {
        let surf = &self.params.surf;
        let of_query = query.features(surf);
        let mut ranked = Vec::new();
        // Neither their poses nor their clouds are needed.
        let matches = |&candidate: &usize| -> Result<(usize, usize), SceneError> {
            let frame = self.scene.query(candidate)?;
            let count = count_matches(&of_query, &frame.features(surf), &self.params.fb);
            Ok((count, candidate))
        };
        for together in candidates.chunks(AT_ONCE) {
            for _ in together {
                checkpoint()?;
            }
            let looked_at: Vec<_> = together.par_iter().map(matches).collect();
            for one in looked_at {
                ranked.push(one?);
            }
        }
        ranked.sort_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        ranked.truncate(count);
        let ranked = ranked.into_iter().map(|(matches, frame)| Ranked {
            frame,
            score: matches as f32,
            geometry: Geometry::Unchecked,
        });
        Ok(ranked.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn selections_are_read_and_written_and_nonsense_is_refused() {
        for text in ["random:3", "nearest:1", "matches:5", "retrieve:20"] {
            let selection: Selection = text.parse().expect("a selection");
            assert_eq!(selection.to_string(), text);
        }
        for wrong in ["nearest", "nearest:0", "nearest:-1", "best:2", ""] {
            assert!(wrong.parse::<Selection>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_draw_follows_from_seed_and_query_and_not_from_the_order_of_the_candidates() {
        let all: Vec<usize> = (0..40).collect();
        let drawn = draw(all.clone(), 5, "000070", 0);
        assert_eq!(drawn, draw(all.iter().rev().copied().collect(), 5, "000070", 0));
        assert_eq!(draw(all.clone(), 2, "000070", 0), drawn[..2]);
        assert_ne!(drawn, draw(all.clone(), 5, "000071", 0));
        assert_ne!(drawn, draw(all, 5, "000070", 1));
    }
}
