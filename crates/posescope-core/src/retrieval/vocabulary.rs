//! Visual words by approximate k-means (AKM): Philbin et al. 2007, section 3.1.

use rand::SeedableRng as _;
use rand::seq::index;
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::forest::{Forest, Scratch, squared_distance};
use crate::features::Descriptor;

/// Descriptors that one task of a thread looks up, so that its scratch memory pays.
const CHUNK: usize = 256;
/// The centres have settled when fewer than one in this many descriptors change their word.
const SETTLED: usize = 1000;

/// How the centres are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clustering {
    /// Number of words.
    pub words: usize,
    /// Rounds of k-means at most.
    pub iterations: usize,
    /// Trees of the forest.
    pub trees: usize,
    /// Centres that a search compares.
    pub checks: usize,
    /// The seed of the first centres, and of the forests.
    pub seed: u64,
}

/// Visual words with the forest that finds them.
pub struct Vocabulary {
    /// The centres of the words.
    pub words: Vec<Descriptor>,
    forest: Forest,
    checks: usize,
}

impl Vocabulary {
    /// Words with their forest.
    pub fn new(words: Vec<Descriptor>, trees: usize, checks: usize, seed: u64) -> Self {
        let forest = Forest::new(&words, trees, seed);
        Self { words, forest, checks }
    }

    /// Clusters the sample by k-means whose nearest centres come from a forest over the centres.
    ///
    /// The first centres are distinct descriptors of the sample. A descriptor keeps its word where
    /// the search finds none that is nearer, so that the sum of distances never grows by a search
    /// that missed. A word that lost all its descriptors takes the one that is farthest from its own.
    /// `round` hears how many rounds are done. There must be at least as many descriptors as words.
    pub fn learn(
        sample: &[Descriptor],
        clustering: &Clustering,
        mut round: impl FnMut(usize),
    ) -> Self {
        let Clustering { words, iterations, trees, checks, seed } = *clustering;
        let words = words.min(sample.len());
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut first = index::sample(&mut rng, sample.len(), words).into_vec();
        first.sort_unstable();
        let first = first.into_iter().map(|index| sample[index]).collect();
        let mut vocabulary = Self::new(first, trees, checks, seed);
        let mut assigned = vocabulary.assign(sample, None);
        for iteration in 1..=iterations {
            let centres = vocabulary.recentred(sample, &assigned);
            vocabulary = Self::new(centres, trees, checks, seed.wrapping_add(iteration as u64));
            let again = vocabulary.assign(sample, Some(&assigned));
            let pairs = again.iter().zip(&assigned);
            let changed = pairs.filter(|(new, old)| new.0 != old.0).count();
            assigned = again;
            round(iteration);
            if changed < sample.len() / SETTLED {
                break;
            }
        }
        // An index that is opened makes the same forest of these words.
        Self::new(vocabulary.words, trees, checks, seed)
    }

    /// The word of each descriptor; `None` for one that has no distance from any.
    pub fn quantize(&self, descriptors: &[Descriptor]) -> Vec<Option<u32>> {
        self.each_nearest(descriptors, |_, _, found| found.map(|(word, _)| word))
    }

    /// What `make` makes of the place of each descriptor, itself, and its word with the squared distance.
    fn each_nearest<T: Send>(
        &self,
        descriptors: &[Descriptor],
        make: impl Fn(usize, &Descriptor, Option<(u32, f32)>) -> T + Sync,
    ) -> Vec<T> {
        let descriptors = descriptors.par_iter().enumerate().with_min_len(CHUNK);
        let made = descriptors.map_init(Scratch::default, |scratch, (place, descriptor)| {
            let found = self.forest.nearest(&self.words, descriptor, self.checks, scratch);
            make(place, descriptor, found)
        });
        made.collect()
    }

    /// Word and squared distance of each descriptor of the sample.
    fn assign(&self, sample: &[Descriptor], before: Option<&[(u32, f32)]>) -> Vec<(u32, f32)> {
        self.each_nearest(sample, |place, descriptor, found| {
            let found = found.unwrap_or((0, f32::INFINITY));
            let Some(before) = before else { return found };
            let (word, _) = before[place];
            let kept = squared_distance(descriptor, &self.words[word as usize]);
            if found.1 < kept { found } else { (word, kept) }
        })
    }

    /// The means of the descriptors of each word. Summed in the order of the sample, because sums of
    /// floating-point numbers depend on it.
    fn recentred(&self, sample: &[Descriptor], assigned: &[(u32, f32)]) -> Vec<Descriptor> {
        let mut sums = vec![[0.0_f64; 64]; self.words.len()];
        let mut counts = vec![0_usize; self.words.len()];
        for (descriptor, &(word, _)) in sample.iter().zip(assigned) {
            counts[word as usize] += 1;
            for (sum, value) in sums[word as usize].iter_mut().zip(descriptor) {
                *sum += f64::from(*value);
            }
        }
        let empty = counts.iter().filter(|&&count| count == 0).count();
        let mut stray = farthest(assigned, empty).into_iter();
        sums.iter()
            .zip(&counts)
            .map(|(sum, &count)| match count {
                0 => stray.next().map_or([0.0; 64], |index| sample[index]),
                _ => sum.map(|sum| (sum / count as f64) as f32),
            })
            .collect()
    }
}

/// The descriptors that are farthest from their words.
fn farthest(assigned: &[(u32, f32)], count: usize) -> Vec<usize> {
    if count == 0 {
        return Vec::new();
    }
    let mut order: Vec<usize> = (0..assigned.len()).collect();
    order.sort_unstable_by(|&a, &b| (assigned[b].1.total_cmp(&assigned[a].1)).then(a.cmp(&b)));
    order.truncate(count);
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::retrieval::tests::{around, random_descriptors};

    const FOUR: Clustering = Clustering { words: 4, iterations: 20, trees: 4, checks: 32, seed: 1 };

    #[test]
    fn clusters_far_apart_are_found_with_their_means() {
        let centres = random_descriptors(4, 9);
        let sample = around(&centres, 400, 0.01, 2);
        let vocabulary = Vocabulary::learn(&sample, &FOUR, |_| ());
        let words = vocabulary.quantize(&sample);
        for cluster in 0..4 {
            // `around` deals the descriptors out to the centres in turn.
            let members: Vec<usize> = (cluster..400).step_by(4).collect();
            let word = words[members[0]].expect("is finite");
            assert!(members.iter().all(|&member| words[member] == Some(word)));
            let mean = |dimension: usize| {
                let values = members.iter().map(|&m| f64::from(sample[m][dimension]));
                values.sum::<f64>() / members.len() as f64
            };
            let centre = vocabulary.words[word as usize];
            for (dimension, value) in centre.into_iter().enumerate() {
                assert!((f64::from(value) - mean(dimension)).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn more_rounds_bring_the_words_nearer() {
        let sample = random_descriptors(2000, 3);
        let error = |iterations| {
            let clustering = Clustering { words: 50, iterations, ..FOUR };
            let vocabulary = Vocabulary::learn(&sample, &clustering, |_| ());
            let all = vocabulary.words;
            let distance = |descriptor| {
                let distances = all.iter().map(|word| squared_distance(word, descriptor));
                f64::from(distances.fold(f32::INFINITY, f32::min))
            };
            sample.iter().map(distance).sum::<f64>()
        };
        let (one, ten) = (error(1), error(10));
        assert!(ten < 0.98 * one, "{one} {ten}");
    }

    #[test]
    fn words_without_descriptors_take_new_ones() {
        // Half of the first centres are equal; only one of them can keep descriptors.
        let mut sample = vec![[0.1; 64]; 100];
        sample.extend(random_descriptors(100, 4));
        let clustering = Clustering { words: 40, ..FOUR };
        let vocabulary = Vocabulary::learn(&sample, &clustering, |_| ());
        let mut used: Vec<_> = vocabulary.quantize(&sample).into_iter().flatten().collect();
        used.sort_unstable();
        used.dedup();
        assert!(used.len() > 35, "{}", used.len());
    }

    #[test]
    fn the_number_of_threads_does_not_matter() {
        let sample = random_descriptors(3000, 7);
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.expect("a thread pool").install(|| {
                let clustering = Clustering { words: 60, checks: 16, ..FOUR };
                let vocabulary = Vocabulary::learn(&sample, &clustering, |_| ());
                (vocabulary.quantize(&sample), vocabulary.words)
            })
        };
        assert_eq!(on(1), on(5));
    }
}
