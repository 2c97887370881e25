//! The nearest two of many descriptors, by comparing with all.

use std::convert::Infallible;

use fearless_simd::{Level, Simd, SimdBase as _, SimdFloat as _, SimdMask as _, dispatch, f32x8};
use rayon::prelude::*;

/// References compared at a time, one in each lane of two vectors.
const LANES: usize = 16;

/// Queries compared at a time. Their sums with all lanes stay in registers, and each load of a reference
/// serves all of them.
const QUERIES: usize = 6;

/// Groups of queries that go through the references together. With sixteen references, 20 KiB of
/// SURF's descriptors, they stay in the first-level cache.
const GROUPS: usize = 10;

/// Queries that a thread takes at a time.
const QUERY_BLOCK: usize = QUERIES * GROUPS;

/// Pairs compared between two checkpoints, if that is work enough for all threads: 2,000 features
/// with 2,000, which takes about as long as describing them.
const PAIRS_AT_A_TIME: usize = 1 << 22;

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
/// The sum of squares |q − r|² = |q|² − 2 (q·r − |r|²/2), so that the nearest r is the one with the
/// largest term in brackets, a score that takes one multiplication per number. Scores are rounded, by
/// no more than a known bound: of all references whose score is less than the second largest by no more
/// than that, hardly ever more than two, the distances are taken directly. What is found is what taking
/// all distances would find, to the last bit and on any processor.
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
    let panels: Vec<Panel<N>> = reference.chunks(LANES).map(Panel::new).collect();
    let margin = margin::<N>(query.iter().chain(reference));
    let level = Level::new();
    let search = |block: &[[f32; N]]| {
        let mut groups: Vec<Group<N>> =
            block.chunks(QUERIES).map(|queries| Group::new(queries, margin)).collect();
        dispatch!(level, simd => search(simd, &panels, &mut groups));
        let found = groups.into_iter().flat_map(|group| group.near);
        block
            .iter()
            .zip(found)
            .map(|(query, near)| near.resolve(query, reference))
            .collect::<Vec<_>>()
    };
    let blocks = PAIRS_AT_A_TIME / QUERY_BLOCK / reference.len().max(1);
    let at_a_time = QUERY_BLOCK * blocks.max(rayon::current_num_threads());
    let mut found = Vec::with_capacity(query.len());
    for query in query.chunks(at_a_time) {
        checkpoint()?;
        let neighbours = query.par_chunks(QUERY_BLOCK).map(search).flatten_iter();
        found.par_extend(neighbours);
    }
    Ok(found)
}

/// By how much the score of one of the two nearest may be less than the second largest score.
///
/// With u = 2⁻²⁴ and descriptors no longer than m, a score is wrong by less than 2 N u m² in whatever
/// order its products are added, so two differ by less than 4 N u m² from what they should; and
/// distances that come out equal may differ by (N + 4) u of their squares, no more than 4 m², which is
/// as much of a score. That makes 8 N u m² and a little; here it is twice as much.
fn margin<'a, const N: usize>(descriptors: impl Iterator<Item = &'a [f32; N]>) -> f32 {
    let longest = descriptors.map(squared_norm).fold(0.0, f32::max);
    // What is lost below the least normal number is not in proportion.
    let rounding = N as f32 * (8.0 * f32::EPSILON * longest + f32::MIN_POSITIVE);
    // A sum of squares is itself rounded.
    rounding * 1.01
}

/// Sixteen references, one in each lane.
struct Panel<const N: usize> {
    /// The first number of all, the second of all, …; 0 where there are fewer references.
    numbers: [[f32; LANES]; N],
    /// |r|²/2; not a number where there are fewer references, which is never enough.
    half_squares: [f32; LANES],
}

impl<const N: usize> Panel<N> {
    fn new(references: &[[f32; N]]) -> Self {
        let mut panel = Self { numbers: [[0.0; LANES]; N], half_squares: [f32::NAN; LANES] };
        for (lane, reference) in references.iter().enumerate() {
            for (numbers, &value) in panel.numbers.iter_mut().zip(reference) {
                numbers[lane] = value;
            }
            panel.half_squares[lane] = 0.5 * squared_norm(reference);
        }
        panel
    }

    /// The scores of six queries with all sixteen.
    #[inline(always)]
    fn scores<S: Simd>(&self, simd: S, queries: &[[f32; N]; QUERIES]) -> [[f32x8<S>; 2]; QUERIES] {
        let halves = |numbers: &[f32; LANES]| {
            let (low, high) = numbers.split_at(LANES / 2);
            [f32x8::from_slice(simd, low), f32x8::from_slice(simd, high)]
        };
        let mut sums = [[f32x8::splat(simd, 0.0); 2]; QUERIES];
        for (k, numbers) in self.numbers.iter().enumerate() {
            let [low, high] = halves(numbers);
            for (sums, query) in sums.iter_mut().zip(queries) {
                let value = f32x8::splat(simd, query[k]);
                sums[0] = low.mul_add(value, sums[0]);
                sums[1] = high.mul_add(value, sums[1]);
            }
        }
        let [low, high] = halves(&self.half_squares);
        for sums in &mut sums {
            sums[0] -= low;
            sums[1] -= high;
        }
        sums
    }
}

/// Six queries and what is near them.
struct Group<const N: usize> {
    queries: [[f32; N]; QUERIES],
    near: [Neighbour; QUERIES],
}

impl<const N: usize> Group<N> {
    /// A group of at most six; the rest is zero and unused.
    fn new(queries: &[[f32; N]], margin: f32) -> Self {
        let mut group = Self {
            queries: [[0.0; N]; QUERIES],
            near: std::array::from_fn(|_| Neighbour::within(margin)),
        };
        group.queries[..queries.len()].copy_from_slice(queries);
        for near in &mut group.near[queries.len()..] {
            near.floor = f32::INFINITY;
        }
        group
    }
}

/// Compares all groups with all references.
#[inline(always)]
fn search<S: Simd, const N: usize>(simd: S, panels: &[Panel<N>], groups: &mut [Group<N>]) {
    for (index, panel) in panels.iter().enumerate() {
        for group in groups.iter_mut() {
            let scores = panel.scores(simd, &group.queries);
            for (near, [low, high]) in group.near.iter_mut().zip(scores) {
                let floor = f32x8::splat(simd, near.floor);
                // Hardly any are, and telling so of sixteen takes a few instructions.
                if (low.simd_ge(floor) | high.simd_ge(floor)).any_true() {
                    let first = LANES * index;
                    near.insert(first, &simd.as_array_f32x8(low));
                    near.insert(first + LANES / 2, &simd.as_array_f32x8(high));
                }
            }
        }
    }
}

/// The references that may be the nearest two of a query.
struct Neighbour {
    /// The largest two scores so far.
    largest: [f32; 2],
    margin: f32,
    /// The least score of a candidate.
    floor: f32,
    /// Scores and indices, in the order of the indices; some were left behind by the floor.
    candidates: Vec<(f32, usize)>,
}

impl Neighbour {
    fn within(margin: f32) -> Self {
        Self {
            largest: [f32::NEG_INFINITY; 2],
            margin,
            floor: f32::NEG_INFINITY,
            candidates: Vec::new(),
        }
    }

    #[inline(never)]
    fn insert(&mut self, first: usize, scores: &[f32; LANES / 2]) {
        for (index, &score) in (first..).zip(scores) {
            if score >= self.floor {
                let [largest, second] = self.largest;
                self.largest = [largest.max(score), second.max(largest.min(score))];
                self.floor = self.largest[1] - self.margin;
                self.candidates.push((score, index));
            }
        }
    }

    fn resolve<const N: usize>(
        &self,
        query: &[f32; N],
        reference: &[[f32; N]],
    ) -> Option<Neighbours> {
        let candidates = self.candidates.iter();
        let near = candidates.filter(|(score, _)| *score >= self.floor);
        let mut found: Option<Neighbours> = None;
        for &(_, index) in near {
            let distance = distance(query, &reference[index]);
            found = Some(match found {
                Some(found) if distance >= found.distance => {
                    Neighbours { second_distance: found.second_distance.min(distance), ..found }
                }
                _ => Neighbours {
                    nearest: index,
                    distance,
                    second_distance: found.map_or(f32::INFINITY, |found| found.distance),
                },
            });
        }
        found
    }
}

fn squared_norm<const N: usize>(descriptor: &[f32; N]) -> f32 {
    descriptor.iter().map(|v| v * v).sum()
}

fn distance<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f32>().sqrt()
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

    /// Taking all distances, one after the other.
    fn plainly<const N: usize>(query: &[f32; N], reference: &[[f32; N]]) -> Option<Neighbours> {
        let distances: Vec<f32> = reference.iter().map(|r| distance(query, r)).collect();
        let mut order: Vec<usize> = (0..reference.len()).collect();
        order.sort_by(|&a, &b| distances[a].total_cmp(&distances[b]));
        let &nearest = order.first()?;
        Some(Neighbours {
            nearest,
            distance: distances[nearest],
            second_distance: order.get(1).map_or(f32::INFINITY, |&second| distances[second]),
        })
    }

    /// Descriptors of unit length, many of them alike.
    fn descriptors(
        size: impl Into<prop::collection::SizeRange>,
    ) -> impl Strategy<Value = Vec<Descriptor>> {
        let kinds = prop::array::uniform32(-1.0f32..1.0);
        let one = (kinds, 0..4_u8, 0..1000_u32);
        prop::collection::vec(one, size).prop_map(|drawn| {
            let first = drawn[0].0;
            let made = drawn.into_iter().map(|(half, kind, bits)| {
                let half = if kind == 0 { half } else { first };
                let mut full: Descriptor =
                    std::array::from_fn(|i| half[i % 32] * (1 + i / 32) as f32);
                let norm = squared_norm(&full).sqrt();
                full = full.map(|v| v / norm);
                if kind == 2 {
                    // Nearly the same: the last bits of a few numbers differ.
                    let value = &mut full[bits as usize % 64];
                    *value = f32::from_bits(value.to_bits() ^ (bits >> 6));
                }
                full
            });
            made.collect()
        })
    }

    #[test]
    fn empty_sets_have_no_neighbours() {
        assert_eq!(nearest_neighbours(&[at(0.0)], &[]), [None]);
        assert_eq!(nearest_neighbours(&[], &[at(0.0)]), []);
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
    fn the_first_of_two_equals_does_not_stand_out() {
        let found = nearest_neighbours(&[at(5.0)], &[at(80.0), at(5.0), at(5.0)]);
        let found = found[0].expect("a neighbour");
        assert_eq!((found.nearest, found.ratio()), (1, 1.0));
    }

    #[test]
    fn descriptors_that_say_nothing_are_all_as_near() {
        let found = nearest_neighbours(&[[0.0; 64]; 7], &[[0.0; 64]; 100]);
        let expected = Some(Neighbours { nearest: 0, distance: 0.0, second_distance: 0.0 });
        assert_eq!(found, [expected; 7]);
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
            if checkpoints == 3 { Err("stopped") } else { Ok(()) }
        });
        assert_eq!((stopped, checkpoints), (Err("stopped"), 3));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        #[test]
        fn neighbours_are_those_of_a_plain_search_to_the_last_bit(
            query in descriptors(1..80),
            reference in descriptors(1..600),
        ) {
            for (query, found) in query.iter().zip(nearest_neighbours(&query, &reference)) {
                prop_assert_eq!(found, plainly(query, &reference));
            }
        }

        #[test]
        fn processors_without_wide_vectors_find_the_same(
            query in descriptors(1..20),
            reference in descriptors(1..100),
        ) {
            let panels: Vec<Panel<64>> = reference.chunks(LANES).map(Panel::new).collect();
            let margin = margin::<64>(query.iter().chain(&reference));
            for query in &query {
                let mut groups = [Group::new(std::slice::from_ref(query), margin)];
                let level = Level::baseline();
                dispatch!(level, simd => search(simd, &panels, &mut groups));
                let found = groups[0].near[0].resolve(query, &reference);
                prop_assert_eq!(found, plainly(query, &reference));
            }
        }

        #[test]
        fn lengths_may_be_any(
            numbers in prop::collection::vec(prop::array::uniform4(-3.0f32..3.0), 2..60),
            scale in prop_oneof![Just(1.0_f32), Just(1e-22), Just(1e15)],
        ) {
            let scaled: Vec<[f32; 4]> = numbers.iter().map(|n| n.map(|v| v * scale)).collect();
            let (query, reference) = scaled.split_at(scaled.len() / 2);
            for (query, found) in query.iter().zip(nearest_neighbours(query, reference)) {
                prop_assert_eq!(found, plainly(query, reference));
            }
        }
    }
}
