//! A forest of randomised k-d trees: the nearest of many descriptors, nearly always, at a fraction
//! of the comparisons.
//!
//! Philbin et al. 2007, section 3.1 (the search of AKM); the trees are those of Silpa-Anan, Hartley,
//! *Optimised KD-trees for fast image descriptor matching*, CVPR 2008.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

use rand::seq::SliceRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use crate::features::Descriptor;

/// A split's dimension is drawn among this many of the greatest variance, so that the trees differ.
const CANDIDATE_DIMENSIONS: usize = 5;
/// Points of a node that variances and mean are taken of; more do not improve the split.
const VARIANCE_SAMPLE: usize = 100;

/// Points of a leaf at most. Comparing a few more points takes less time than walking to them one by
/// one: a walk goes through memory, a comparison through 256 bytes in a row.
const MAX_LEAF: usize = 12;

/// Several trees over the same points, which the forest does not keep.
pub struct Forest {
    trees: Vec<Tree>,
    points: usize,
}

struct Tree {
    nodes: Vec<Node>,
    /// Indices of the points; every leaf has a range of it.
    order: Vec<u32>,
}

enum Node {
    Split {
        dimension: u8,
        threshold: f32,
        /// What is below the threshold, and what is not.
        children: [u32; 2],
    },
    Leaf(Range<u32>),
}

/// Memory of a search, kept between searches to spare allocations.
#[derive(Default)]
pub struct Scratch {
    branches: BinaryHeap<Reverse<Branch>>,
    /// The search that last compared a point.
    seen: Vec<u32>,
    search: u32,
}

/// A side of a split that was not taken: the bits of its bound, its tree and its node.
///
/// The bound is the sum of the squared distances to the splits on the way, small where the query is close by. The
/// bits of positive numbers are in their order.
type Branch = (u32, u32, u32);

impl Forest {
    /// `trees` trees over these points; the seed decides how they differ.
    pub fn new(points: &[Descriptor], trees: usize, seed: u64) -> Self {
        let trees = (0..trees as u64)
            .into_par_iter()
            .map(|tree| Tree::new(points, Pcg64::seed_from_u64(seed ^ (tree << 32))))
            .collect();
        Self { trees, points: points.len() }
    }

    /// The nearest of the points that the forest was made from, and its squared distance: best bin first
    /// over all trees together, until `checks` points were compared. With as many checks as points it is
    /// exact. `None` where there is no point at a finite distance.
    pub fn nearest(
        &self,
        points: &[Descriptor],
        query: &Descriptor,
        checks: usize,
        scratch: &mut Scratch,
    ) -> Option<(u32, f32)> {
        scratch.begin(self.points);
        let mut search =
            TreeSearch { points, query, scratch, best: None, checks_left: checks.max(1) };
        for (number, tree) in self.trees.iter().enumerate() {
            search.descend(tree, number as u32, 0, 0.0);
        }
        while search.checks_left > 0
            && let Some(Reverse((bound, tree, node))) = search.scratch.branches.pop()
        {
            search.descend(&self.trees[tree as usize], tree, node, f32::from_bits(bound));
        }
        search.best
    }
}

impl Scratch {
    fn begin(&mut self, points: usize) {
        self.branches.clear();
        if self.seen.len() != points || self.search == u32::MAX {
            self.seen = vec![0; points];
            self.search = 0;
        }
        self.search += 1;
    }
}

struct TreeSearch<'a> {
    points: &'a [Descriptor],
    query: &'a Descriptor,
    scratch: &'a mut Scratch,
    best: Option<(u32, f32)>,
    checks_left: usize,
}

impl TreeSearch<'_> {
    /// Walks to the leaf on the query's side, queues the other sides, compares the leaf's points.
    fn descend(&mut self, tree: &Tree, number: u32, mut node: u32, bound: f32) {
        loop {
            match &tree.nodes[node as usize] {
                Node::Split { dimension, threshold, children: [below, above] } => {
                    let beyond = self.query[usize::from(*dimension)] - threshold;
                    let (taken, other) =
                        if beyond < 0.0 { (*below, *above) } else { (*above, *below) };
                    let bound = bound + beyond * beyond;
                    self.scratch.branches.push(Reverse((bound.to_bits(), number, other)));
                    node = taken;
                }
                Node::Leaf(range) => {
                    for &index in &tree.order[range.start as usize..range.end as usize] {
                        self.compare(index);
                    }
                    return;
                }
            }
        }
    }

    fn compare(&mut self, index: u32) {
        let seen = &mut self.scratch.seen[index as usize];
        if *seen == self.scratch.search || self.checks_left == 0 {
            return;
        }
        *seen = self.scratch.search;
        self.checks_left -= 1;
        let squared_distance = squared_distance(self.query, &self.points[index as usize]);
        let least = self.best.map_or(f32::INFINITY, |(_, least)| least);
        if squared_distance < least {
            self.best = Some((index, squared_distance));
        }
    }
}

impl Tree {
    fn new(points: &[Descriptor], mut rng: Pcg64) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        // The first points of every node are then a random sample of it.
        order.shuffle(&mut rng);
        let mut nodes = vec![Node::Leaf(0..order.len() as u32)];
        let mut open = vec![0];
        while let Some(node) = open.pop() {
            let Node::Leaf(range) = &nodes[node] else {
                continue;
            };
            let start = range.start;
            let members = &mut order[start as usize..range.end as usize];
            let Some((dimension, threshold)) = split(points, members, &mut rng) else {
                continue;
            };
            let middle = partition(members, |index| points[index as usize][dimension] < threshold);
            if middle == 0 || middle == members.len() {
                continue;
            }
            let middle = start + middle as u32;
            let end = range.end;
            let below = nodes.len();
            nodes.push(Node::Leaf(start..middle));
            nodes.push(Node::Leaf(middle..end));
            nodes[node] = Node::Split {
                dimension: dimension as u8,
                threshold,
                children: [below as u32, below as u32 + 1],
            };
            open.extend([below, below + 1]);
        }
        Self { nodes, order }
    }
}

/// A dimension in which the points vary, and their mean there; `None` for points that are equal.
fn split(points: &[Descriptor], members: &[u32], rng: &mut Pcg64) -> Option<(usize, f32)> {
    if members.len() <= MAX_LEAF {
        return None;
    }
    let sample = &members[..members.len().min(VARIANCE_SAMPLE)];
    let count = sample.len() as f32;
    let mut mean = [0.0; 64];
    let mut variance = [0.0; 64];
    for &index in sample {
        for (mean, value) in mean.iter_mut().zip(&points[index as usize]) {
            *mean += value / count;
        }
    }
    for &index in sample {
        for ((variance, mean), value) in variance.iter_mut().zip(&mean).zip(&points[index as usize])
        {
            *variance += (value - mean) * (value - mean);
        }
    }
    let mut dimensions: [usize; 64] = std::array::from_fn(|dimension| dimension);
    dimensions.select_nth_unstable_by(CANDIDATE_DIMENSIONS - 1, |&a, &b| {
        (variance[b].total_cmp(&variance[a])).then(a.cmp(&b))
    });
    let candidates = &mut dimensions[..CANDIDATE_DIMENSIONS];
    candidates.sort_unstable();
    let varying: Vec<usize> =
        (candidates.iter().copied()).filter(|&dimension| variance[dimension] > 0.0).collect();
    if varying.is_empty() {
        return None;
    }
    let dimension = varying[rng.random_range(0..varying.len())];
    Some((dimension, mean[dimension]))
}

/// Brings those for which it holds to the front and returns how many they are. The order on both
/// sides stays random as it was.
fn partition(members: &mut [u32], holds: impl Fn(u32) -> bool) -> usize {
    let mut front = 0;
    for i in 0..members.len() {
        if holds(members[i]) {
            members.swap(front, i);
            front += 1;
        }
    }
    front
}

/// Squared Euclidean distance, in eight sums that the compiler keeps in vector registers.
pub fn squared_distance(a: &Descriptor, b: &Descriptor) -> f32 {
    let (a, _) = a.as_chunks::<8>();
    let (b, _) = b.as_chunks::<8>();
    let mut sums = [0.0_f32; 8];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..8 {
            let difference = a[lane] - b[lane];
            sums[lane] += difference * difference;
        }
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::retrieval::tests::random_descriptors;

    fn exact(points: &[Descriptor], query: &Descriptor) -> f32 {
        let distances = points.iter().map(|point| squared_distance(point, query));
        distances.fold(f32::INFINITY, f32::min)
    }

    #[test]
    fn the_distance_is_the_sum_of_squares() {
        let mut a = [0.0; 64];
        let mut b = [0.0; 64];
        (a[0], b[0]) = (1.0, 3.0);
        (a[63], b[63]) = (2.0, -1.0);
        a[17] = 0.5;
        assert_eq!(squared_distance(&a, &b), 4.0 + 9.0 + 0.25);
    }

    #[test]
    fn few_checks_find_the_nearest_of_clustered_points_nearly_always() {
        let points = random_descriptors(2000, 1);
        let forest = Forest::new(&points, 8, 3);
        let mut scratch = Scratch::default();
        let mut rng = Pcg64::seed_from_u64(5);
        let mut hits = 0;
        for index in 0..500 {
            let mut query = points[index * 4];
            for value in &mut query {
                *value += rng.random_range(-0.05..0.05);
            }
            let found = forest.nearest(&points, &query, 64, &mut scratch);
            let found = found.expect("there are points");
            hits += usize::from(found.1 == exact(&points, &query));
        }
        assert!(hits >= 475, "{hits} of 500");
    }

    #[test]
    fn equal_points_and_no_points_are_no_trouble() {
        let mut scratch = Scratch::default();
        let forest = Forest::new(&[], 3, 0);
        assert_eq!(forest.nearest(&[], &[0.0; 64], 10, &mut scratch), None);
        let points = [[0.5; 64]; 300];
        let forest = Forest::new(&points, 3, 0);
        let found = forest.nearest(&points, &[0.5; 64], 10, &mut scratch);
        assert_eq!(found.map(|found| found.1), Some(0.0));
        let unknown = [f32::NAN; 64];
        assert_eq!(forest.nearest(&points, &unknown, 300, &mut scratch), None);
    }

    proptest! {
        #[test]
        fn with_as_many_checks_as_points_the_neighbour_is_exact(
            count in 1usize..200, trees in 1usize..5, seed in any::<u64>(),
        ) {
            let points = random_descriptors(count, seed);
            let queries = random_descriptors(20, seed ^ 1);
            let forest = Forest::new(&points, trees, seed);
            let mut scratch = Scratch::default();
            for query in &queries {
                let found = forest.nearest(&points, query, count, &mut scratch);
                let found = found.map(|found| found.1);
                prop_assert_eq!(found, Some(exact(&points, query)));
            }
        }

        #[test]
        fn a_search_does_not_depend_on_the_searches_before_it(seed in any::<u64>()) {
            let points = random_descriptors(300, seed);
            let queries = random_descriptors(10, seed ^ 1);
            let forest = Forest::new(&points, 4, seed);
            let mut used = Scratch::default();
            for query in &queries {
                let fresh = forest.nearest(&points, query, 20, &mut Scratch::default());
                prop_assert_eq!(forest.nearest(&points, query, 20, &mut used), fresh);
            }
        }
    }
}
