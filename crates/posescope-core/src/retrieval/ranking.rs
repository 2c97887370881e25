//! A ranking as it is reported: the frames that became references, and those that nearly did.

use super::index::Ranked;
use crate::geometry::Pose;

/// Frames reported after those chosen.
const RUNNERS_UP: usize = 5;
/// Frames reported at most, unless more are chosen.
const MAX_REPORTED: usize = 10;

/// What the scores of a ranking are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// The cosine of tf-idf weights of visual words, in 0 … 1.
    Words,
    /// The number of feature matches.
    Matches,
}

impl Criterion {
    /// The way of choosing references by it, as `--reference WAY:K` has it.
    pub(crate) fn way(self) -> &'static str {
        match self {
            Self::Words => "retrieve",
            Self::Matches => "matches",
        }
    }
}

/// A frame that was ranked as a reference of a query.
#[derive(Clone, Debug, PartialEq)]
pub struct RankedReference {
    /// Its name in its scene.
    pub name: String,
    /// Its pose, if known.
    pub world_from_camera: Option<Pose>,
    /// Its score, and what verification made of it.
    pub ranked: Ranked,
}

/// The best frames for a query, from which its references were chosen.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceRanking {
    /// What the scores are.
    pub criterion: Criterion,
    /// Frames that could have been chosen.
    pub candidates: usize,
    /// The first of the frames, which were chosen.
    pub chosen: usize,
    /// The best first, some more than were chosen.
    pub frames: Vec<RankedReference>,
}

impl ReferenceRanking {
    /// Frames to rank where `count` are asked for.
    pub fn depth(count: usize) -> usize {
        count.max(MAX_REPORTED.min(count + RUNNERS_UP))
    }

    /// The frames that are worth a picture.
    pub fn pictured(&self) -> &[RankedReference] {
        &self.frames[..self.frames.len().min(MAX_REPORTED)]
    }
}

#[cfg(test)]
mod tests {
    use super::ReferenceRanking;

    #[test]
    fn some_more_than_are_asked_for_are_told_about_but_no_crowd() {
        assert_eq!([1, 5, 7, 10, 20].map(ReferenceRanking::depth), [6, 10, 10, 10, 20]);
    }
}
