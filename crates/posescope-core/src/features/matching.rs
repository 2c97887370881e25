//! Exhaustive matching of descriptors, and the tests a match has to pass.

use std::convert::Infallible;
use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView};
use rayon::prelude::*;

/// Descriptors compared at a time. The products of one block take 128 KiB and stay in the cache
/// while they are searched.
const QUERY_BLOCK: usize = 64;
const REFERENCE_BLOCK: usize = 512;

/// Pairs compared between two checkpoints, if that is work enough for all threads: 2,000 features
/// with 2,000, which takes about as long as finding them.
const PAIRS_AT_A_TIME: usize = 1 << 22;

/// Products looked through at a time. Hardly any group holds a new neighbour, and telling so of
/// a whole group takes a few vector instructions.
const GROUP: usize = 16;

/// The two descriptors of a reference set that are nearest to a query descriptor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Neighbours {
    /// Index of the nearest one; of equally near ones, the first.
    pub nearest: usize,
    /// Euclidean distance to it, from 0 to 2 for unit descriptors.
    pub distance: f32,
    /// Distance to the next nearest one; infinite where there is none.
    pub second_distance: f32,
}

impl Neighbours {
    /// Distance to the nearest divided by that to the next nearest, from 0 to 1: the smaller,
    /// the more the nearest stands out (Lowe, IJCV 2004, section 7.1). 1 where both distances are
    /// 0.
    pub fn ratio(&self) -> f32 {
        if self.distance < self.second_distance {
            self.distance / self.second_distance
        } else {
            1.0
        }
    }
}

/// Finds the nearest neighbours of every query descriptor by comparing it with all reference
/// descriptors. None only if there are no reference descriptors.
///
/// The sum of squares |q − r|² = |q|² − 2 (q·r − |r|²/2), so that a matrix product does most of the
/// work, and the nearest r is the one with the largest term in brackets. The distances of the two
/// found are then taken directly, since the difference of large squares would be a poor measure of
/// small distances.
pub fn nearest_neighbours<const N: usize>(
    query: &[[f32; N]],
    reference: &[[f32; N]],
) -> Vec<Option<Neighbours>> {
    let Ok(found) = nearest_neighbours_interruptible(query, reference, || Ok::<_, Infallible>(()));
    found
}

/// Finds what [`nearest_neighbours`] does. `checkpoint` is called on the caller's thread every four
/// million pairs, or every block for each thread where that is more, and can stop the search.
///
/// # Errors
/// The errors of `checkpoint`.
pub fn nearest_neighbours_interruptible<const N: usize, E>(
    query: &[[f32; N]],
    reference: &[[f32; N]],
    mut checkpoint: impl FnMut() -> Result<(), E>,
) -> Result<Vec<Option<Neighbours>>, E> {
    // With one descriptor per row, each column of the product belongs to one query.
    let rows = as_columns(reference).transpose();
    let half_squares: Vec<f32> = reference.iter().map(|r| 0.5 * squared_norm(r)).collect();
    let search = |products: &mut DMatrix<f32>, block: &[[f32; N]]| {
        let mut best = vec![TopTwo::default(); block.len()];
        for start in (0..reference.len()).step_by(REFERENCE_BLOCK) {
            let count = REFERENCE_BLOCK.min(reference.len() - start);
            let mut products = products.view_mut((0, 0), (count, block.len()));
            products.gemm(1.0, &rows.rows(start, count), &as_columns(block), 0.0);
            for (best, products) in best.iter_mut().zip(products.column_iter()) {
                best.search(products.as_slice(), &half_squares, start..start + count);
            }
        }
        let neighbours = |(query, best): (&[f32; N], TopTwo)| best.resolve(query, reference);
        block.iter().zip(best).map(neighbours).collect::<Vec<_>>()
    };
    // Whole blocks: a product does not depend on where the search is interrupted.
    let blocks = PAIRS_AT_A_TIME / QUERY_BLOCK / reference.len().max(1);
    let at_a_time = QUERY_BLOCK * blocks.max(rayon::current_num_threads());
    let mut found = Vec::with_capacity(query.len());
    for query in query.chunks(at_a_time) {
        checkpoint()?;
        let products = || DMatrix::zeros(REFERENCE_BLOCK, QUERY_BLOCK);
        let neighbours = query
            .par_chunks(QUERY_BLOCK)
            .map_init(products, |products, block| search(products, block))
            .flatten_iter();
        found.par_extend(neighbours);
    }
    Ok(found)
}

/// Descriptors as the columns of a matrix with as many rows as they have numbers.
fn as_columns<const N: usize>(descriptors: &[[f32; N]]) -> DMatrixView<'_, f32> {
    DMatrixView::from_slice(descriptors.as_flattened(), N, descriptors.len())
}

fn squared_norm<const N: usize>(descriptor: &[f32; N]) -> f32 {
    descriptor.iter().map(|v| v * v).sum()
}

fn distance<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f32>().sqrt()
}

/// The two references with the largest scores q·r − |r|²/2 so far.
#[derive(Clone, Copy)]
struct TopTwo {
    scores: [f32; 2],
    /// Valid where the score is finite.
    indices: [usize; 2],
}

impl Default for TopTwo {
    fn default() -> Self {
        Self {
            scores: [f32::NEG_INFINITY; 2],
            indices: [0; 2],
        }
    }
}

impl TopTwo {
    /// Goes through the products q·r of a range of references.
    fn search(&mut self, products: &[f32], half_squares: &[f32], range: Range<usize>) {
        let half_squares = &half_squares[range.clone()];
        let groups = products.chunks(GROUP).zip(half_squares.chunks(GROUP));
        for (start, (products, half_squares)) in range.step_by(GROUP).zip(groups) {
            let scores = || products.iter().zip(half_squares).map(|(p, h)| p - h);
            let second = self.scores[1];
            // Not `any`, which would stop early and so compare one by one.
            if scores().fold(false, |found, score| found | (score > second)) {
                for (index, score) in (start..).zip(scores()) {
                    self.insert(index, score);
                }
            }
        }
    }

    fn insert(&mut self, index: usize, score: f32) {
        if score > self.scores[0] {
            self.scores = [score, self.scores[0]];
            self.indices = [index, self.indices[0]];
        } else if score > self.scores[1] {
            self.scores[1] = score;
            self.indices[1] = index;
        }
    }

    fn resolve<const N: usize>(
        &self,
        query: &[f32; N],
        reference: &[[f32; N]],
    ) -> Option<Neighbours> {
        let neighbour = |rank: usize| {
            let index = self.indices[rank];
            let found = self.scores[rank] > f32::NEG_INFINITY;
            found.then(|| (index, distance(query, &reference[index])))
        };
        let (nearest, distance) = neighbour(0)?;
        let Some((second, second_distance)) = neighbour(1) else {
            return Some(Neighbours {
                nearest,
                distance,
                second_distance: f32::INFINITY,
            });
        };
        // Scores are rounded: the order of two almost equal ones may be wrong.
        let swapped = second_distance < distance;
        Some(Neighbours {
            nearest: if swapped { second } else { nearest },
            distance: distance.min(second_distance),
            second_distance: distance.max(second_distance),
        })
    }
}

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

/// Judges the best match of every query descriptor.
///
/// `forward` are the neighbours of the query descriptors among the reference descriptors,
/// `backward` those of the reference descriptors among the query descriptors. A match passes the
/// ratio test if its ratio is below `max_ratio`; 0.8 is customary, 1 lets all but exact ties pass.
/// None for queries without neighbours.
///
/// # Panics
///
/// If `forward` and `backward` do not belong to the same two sets.
pub fn classify(
    forward: &[Option<Neighbours>],
    backward: &[Option<Neighbours>],
    max_ratio: f32,
) -> Vec<Option<Match>> {
    let judge = |(query, neighbours): (usize, &Option<Neighbours>)| {
        let neighbours = (*neighbours)?;
        let reference = neighbours.nearest;
        let rival = backward[reference]
            .expect("a reference descriptor has neighbours if there are queries")
            .nearest;
        let ratio = neighbours.ratio();
        let verdict = if ratio >= max_ratio {
            MatchVerdict::Ambiguous
        } else if rival != query {
            MatchVerdict::NotUnique { rival }
        } else {
            MatchVerdict::Candidate
        };
        Some(Match {
            query,
            reference,
            distance: neighbours.distance,
            ratio,
            verdict,
        })
    };
    forward.iter().enumerate().map(judge).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::features::Descriptor;

    /// A unit descriptor in the plane of the first two axes.
    fn at(degrees: f32) -> Descriptor {
        let mut descriptor = [0.0; 64];
        (descriptor[1], descriptor[0]) = degrees.to_radians().sin_cos();
        descriptor
    }

    fn descriptors(
        size: impl Into<prop::collection::SizeRange>,
    ) -> impl Strategy<Value = Vec<Descriptor>> {
        prop::collection::vec(prop::array::uniform32(-1.0f32..1.0), size).prop_map(|halves| {
            let unit = |half: [f32; 32]| {
                let full: Descriptor = std::array::from_fn(|i| half[i % 32] * (1 + i / 32) as f32);
                let norm = squared_norm(&full).sqrt();
                full.map(|v| v / norm)
            };
            halves.into_iter().map(unit).collect()
        })
    }

    #[test]
    fn empty_sets_have_no_neighbours() {
        assert_eq!(nearest_neighbours(&[at(0.0)], &[]), [None]);
        assert_eq!(nearest_neighbours(&[], &[at(0.0)]), []);
        assert_eq!(classify(&[None], &[], 0.8), [None]);
    }

    #[test]
    fn a_single_reference_stands_out() {
        let found = nearest_neighbours(&[at(0.0)], &[at(60.0)])[0].expect("a neighbour");
        assert_eq!(found.nearest, 0);
        assert!((found.distance - 1.0).abs() < 1e-6);
        assert_eq!(found.second_distance, f32::INFINITY);
        assert_eq!(found.ratio(), 0.0);
    }

    #[test]
    fn small_distances_are_exact() {
        let found = nearest_neighbours(&[at(30.0)], &[at(90.0), at(30.0), at(30.01)]);
        let found = found[0].expect("a neighbour");
        assert_eq!((found.nearest, found.distance), (1, 0.0));
        assert!((found.second_distance - 0.01f32.to_radians()).abs() < 1e-6);
    }

    #[test]
    fn every_verdict_has_its_case() {
        let query = [at(0.0), at(3.0), at(45.0), at(170.0)];
        let reference = [at(1.0), at(90.0), at(172.0)];
        let forward = nearest_neighbours(&query, &reference);
        let backward = nearest_neighbours(&reference, &query);
        let matches = classify(&forward, &backward, 0.8);
        let verdicts: Vec<_> = matches
            .iter()
            .flatten()
            .map(|m| (m.reference, m.verdict))
            .collect();
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
    fn the_first_of_two_equals_does_not_stand_out() {
        let found = nearest_neighbours(&[at(5.0)], &[at(80.0), at(5.0), at(5.0)]);
        let found = found[0].expect("a neighbour");
        assert_eq!((found.nearest, found.ratio()), (1, 1.0));
    }

    #[test]
    fn a_long_search_can_be_stopped_and_is_the_same_on_any_number_of_threads() {
        // Ten times as many pairs as are compared at a time.
        let many = |count: u16| -> Vec<Descriptor> {
            (0..count).map(|i| at(f32::from(i) * 0.7)).collect()
        };
        let (query, reference) = (many(5200), many(8100));
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a thread pool").install(|| {
                let mut checkpoints = 0;
                let found = nearest_neighbours_interruptible(&query, &reference, || {
                    checkpoints += 1;
                    Ok::<_, ()>(())
                });
                assert!(checkpoints >= 10, "{checkpoints}");
                found
            })
        };
        assert_eq!(on(1), on(3));
        let mut checkpoints = 0;
        let stopped = nearest_neighbours_interruptible(&query, &reference, || {
            checkpoints += 1;
            if checkpoints == 3 {
                Err("stopped")
            } else {
                Ok(())
            }
        });
        assert_eq!((stopped, checkpoints), (Err("stopped"), 3));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20))]

        #[test]
        fn neighbours_are_those_of_a_plain_search(
            query in descriptors(1..80),
            reference in descriptors(1..600),
        ) {
            for (query, found) in query.iter().zip(nearest_neighbours(&query, &reference)) {
                let found = found.expect("a neighbour");
                let mut distances: Vec<f32> =
                    reference.iter().map(|r| distance(query, r)).collect();
                prop_assert_eq!(found.distance, distances[found.nearest]);
                distances.sort_unstable_by(f32::total_cmp);
                prop_assert!((found.distance - distances[0]).abs() < 1e-5);
                match distances.get(1) {
                    Some(second) => prop_assert!((found.second_distance - second).abs() < 1e-5),
                    None => prop_assert_eq!(found.second_distance, f32::INFINITY),
                }
            }
        }
    }
}
