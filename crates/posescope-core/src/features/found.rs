//! Matches of another system.

use std::sync::Arc;

use super::{Features, Keypoint, Match, MatchVerdict};

/// The matches of a query with a reference that another system was asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum PairMatches {
    /// It says nothing of this pair.
    Absent,
    /// What it found.
    Found(FoundMatches),
}

/// Keypoints of two photos and which belong together.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundMatches {
    /// Keypoints of the query; they have no descriptors.
    pub query: Arc<Features>,
    /// Keypoints of the reference; they have no descriptors.
    pub reference: Arc<Features>,
    /// The match of each query keypoint, where it has one.
    pub decisions: Arc<[Option<Match>]>,
}

impl FoundMatches {
    /// Matches of keypoints by their positions \[px\], the centre of the top-left pixel at (0, 0);
    /// `matched` holds the position of a query keypoint's partner in `reference`.
    ///
    /// A reference keypoint that several query keypoints claim is given to the first.
    ///
    /// # Panics
    /// When `matched` is not as long as `query` or names a keypoint that there is not.
    pub fn new(query: &[[f32; 2]], reference: &[[f32; 2]], matched: &[Option<usize>]) -> Self {
        assert_eq!(query.len(), matched.len(), "one partner for each keypoint");
        let mut taken: Vec<Option<usize>> = vec![None; reference.len()];
        let decisions = matched.iter().enumerate().map(|(query, &partner)| {
            let reference = partner?;
            let rival = taken[reference];
            taken[reference] = rival.or(Some(query));
            Some(Match {
                query,
                reference,
                // The other system keeps its distances to itself.
                distance: 0.0,
                ratio: 0.0,
                verdict: match rival {
                    Some(rival) => MatchVerdict::NotUnique { rival },
                    None => MatchVerdict::Candidate,
                },
            })
        });
        Self {
            decisions: decisions.collect(),
            query: Arc::new(features(query)),
            reference: Arc::new(features(reference)),
        }
    }

    /// How many query keypoints have a partner of their own.
    pub fn count(&self) -> usize {
        let decisions = self.decisions.iter().flatten();
        decisions.filter(|found| found.verdict == MatchVerdict::Candidate).count()
    }
}

fn features(positions: &[[f32; 2]]) -> Features {
    /// Drawn size of a keypoint without one \[px\].
    const SCALE_PX: f32 = 1.2;
    let keypoint = |&[x, y]: &[f32; 2]| Keypoint {
        x,
        y,
        scale: SCALE_PX,
        angle: 0.0,
        response: 0.0,
        laplacian_positive: true,
    };
    Features { keypoints: positions.iter().map(keypoint).collect(), descriptors: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_keypoint_that_two_claim_goes_to_the_first() {
        let query = [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]];
        let found = FoundMatches::new(&query, &[[7.0, 8.0]], &[None, Some(0), Some(0)]);
        let verdicts: Vec<_> = found.decisions.iter().map(|d| d.map(|d| d.verdict)).collect();
        let expected =
            [None, Some(MatchVerdict::Candidate), Some(MatchVerdict::NotUnique { rival: 1 })];
        assert_eq!(verdicts, expected);
        assert_eq!(found.count(), 1);
        assert_eq!(found.query.keypoints[2].pixel(), nalgebra::Point2::new(5.0, 6.0));
    }
}
