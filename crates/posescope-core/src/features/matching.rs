//! The tests that the best match of a descriptor has to pass.

use super::nearest::{Neighbours, nearest_neighbours_interruptible};

/// A query descriptor and its nearest reference descriptor, and what to think of the two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Index of the query descriptor.
    pub query: usize,
    /// Index of the reference descriptor.
    pub reference: usize,
    /// Euclidean distance between them.
    pub distance: f32,
    /// [`Neighbours::ratio`] of the query descriptor.
    pub ratio: f32,
    /// Whether they may show the same thing.
    pub verdict: MatchVerdict,
}

/// The first test that a match fails, or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MatchVerdict {
    /// The next nearest reference descriptor is about as near: [`Match::ratio`] is too large.
    Ambiguous,
    /// The reference descriptor is nearer to another query descriptor.
    NotUnique {
        /// Index of that query descriptor.
        rival: usize,
    },
    /// The match is distinct and mutual.
    Candidate,
}

/// The best match of every query descriptor, and which tests it passes. None for queries without neighbours.
///
/// A match passes the ratio test if its ratio is below `max_ratio`; 0.8 is customary, 1 lets all but exact
/// ties pass. Only those reference descriptors are compared with all of the query that a distinct match
/// chose, in photos of a street one of five. `checkpoint` is called as in
/// [`nearest_neighbours_interruptible`].
///
/// # Errors
/// The errors of `checkpoint`.
pub fn best_matches<const N: usize, E>(
    query: &[[f32; N]],
    reference: &[[f32; N]],
    max_ratio: f32,
    mut checkpoint: impl FnMut() -> Result<(), E>,
) -> Result<Vec<Option<Match>>, E> {
    let forward = nearest_neighbours_interruptible(query, reference, &mut checkpoint)?;
    let is_distinct = |found: &Neighbours| found.ratio() < max_ratio;
    let distinct = forward.iter().flatten().filter(|found| is_distinct(found));
    let mut chosen: Vec<usize> = distinct.map(|found| found.nearest).collect();
    chosen.sort_unstable();
    chosen.dedup();
    let of_chosen: Vec<[f32; N]> = chosen.iter().map(|&chosen| reference[chosen]).collect();
    let backward = nearest_neighbours_interruptible(&of_chosen, query, checkpoint)?;
    let judge = |(query, found): (usize, &Option<Neighbours>)| {
        let found = (*found)?;
        let Neighbours { nearest: reference, distance, .. } = found;
        let verdict = if is_distinct(&found) {
            let place = chosen.binary_search(&reference).expect("a distinct match chose it");
            match backward[place].expect("there is a query").nearest {
                rival if rival != query => MatchVerdict::NotUnique { rival },
                _ => MatchVerdict::Candidate,
            }
        } else {
            MatchVerdict::Ambiguous
        };
        Some(Match { query, reference, distance, ratio: found.ratio(), verdict })
    };
    Ok(forward.iter().enumerate().map(judge).collect())
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;
    use crate::features::{Descriptor, nearest_neighbours};

    /// A unit descriptor in the plane of the first two axes.
    fn at(degrees: f32) -> Descriptor {
        let mut descriptor = [0.0; 64];
        (descriptor[1], descriptor[0]) = degrees.to_radians().sin_cos();
        descriptor
    }

    fn both_ways(query: &[Descriptor], reference: &[Descriptor]) -> Vec<Option<Match>> {
        let forward = nearest_neighbours(query, reference);
        let backward = nearest_neighbours(reference, query);
        let Ok(found) = best_matches(query, reference, 0.8, || Ok::<_, Infallible>(()));
        for (query, (found, forward)) in found.iter().zip(&forward).enumerate() {
            assert_eq!(found.map(|found| found.reference), forward.map(|one| one.nearest));
            let Some(found) = found else { continue };
            let nearest = backward[found.reference].expect("queries").nearest;
            let verdict = match found.ratio < 0.8 {
                true if nearest == query => MatchVerdict::Candidate,
                true => MatchVerdict::NotUnique { rival: nearest },
                false => MatchVerdict::Ambiguous,
            };
            assert_eq!((found.query, found.verdict), (query, verdict));
        }
        found
    }

    #[test]
    fn nothing_matches_an_empty_set() {
        assert_eq!(both_ways(&[at(0.0)], &[]), [None]);
        assert_eq!(both_ways(&[], &[at(0.0)]), []);
    }

    #[test]
    fn every_verdict_has_its_case() {
        let query = [at(0.0), at(3.0), at(45.0), at(170.0)];
        let reference = [at(1.0), at(90.0), at(172.0)];
        let matches = both_ways(&query, &reference);
        let verdicts: Vec<_> = matches.iter().flatten().map(|m| (m.reference, m.verdict)).collect();
        assert_eq!(
            verdicts,
            [
                (0, MatchVerdict::Candidate),
                (0, MatchVerdict::NotUnique { rival: 0 }),
                (0, MatchVerdict::Ambiguous),
                (2, MatchVerdict::Candidate),
            ]
        );
        assert!(matches[2].is_some_and(|m| m.ratio > 0.95));
    }

    #[test]
    fn asking_only_the_chosen_gives_the_verdicts_of_asking_all() {
        let spread = |count: u32, seed: u32| -> Vec<Descriptor> {
            let angle = |i: u32| ((i + seed).wrapping_mul(2_654_435_761) >> 16) as f32 / 182.0;
            (0..count).map(|i| at(angle(i))).collect()
        };
        let matches = both_ways(&spread(300, 0), &spread(200, 1000));
        let unique = matches.iter().flatten().filter(|m| m.verdict == MatchVerdict::Candidate);
        assert!(unique.count() > 20);
    }
}
