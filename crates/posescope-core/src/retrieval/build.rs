//! Building an index with little memory: features are made once, wait on disk, and are turned into
//! words as a stream.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufWriter, Read as _, Seek as _, Write as _};
use std::path::Path;

use rand::SeedableRng as _;
use rand::seq::index;
use rand_pcg::Pcg64;
use rayon::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

use super::error::BuildError;
use super::layout::{Description, IndexWriter, RecordCounts};
use super::tf_idf::InvertedIndexBuilder;
use super::vocabulary::{Clustering, Vocabulary};
use crate::features::{Descriptor, Features};
use crate::files::{folder_of, write_whole_with};

/// Frames that are worked on at a time; all their features are in memory.
const BATCH: usize = 16;
/// Numbers of a feature that waits on disk: x, y, scale, angle, descriptor.
const NUMBERS: usize = 4 + 64;

/// What is to be indexed, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildRequest {
    /// The scene's name.
    pub scene: String,
    /// Changes with the scene's frames.
    pub fingerprint: u64,
    /// The positions of the frames in the scene.
    pub frames: Vec<usize>,
    /// How the vocabulary is learnt; the seed is that of every random choice.
    pub clustering: Clustering,
    /// Descriptors per word at most from which it is learnt.
    pub sample: usize,
    /// All that decides what the index holds, by name; kept with it and compared when it is used.
    pub recipe: BTreeMap<String, String>,
}

/// A part of the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BuildStep {
    /// Features of each frame.
    Features,
    /// Rounds of k-means.
    Vocabulary,
    /// The words of each frame.
    Words,
}

impl BuildStep {
    /// What is being done.
    pub fn name(self) -> &'static str {
        match self {
            Self::Features => "features",
            Self::Vocabulary => "vocabulary",
            Self::Words => "words",
        }
    }
}

/// How far the building of an index is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct BuildProgress {
    /// The part of the work that is being done.
    pub step: BuildStep,
    /// How much of the part is done.
    pub done: usize,
    /// How much the part has in all; k-means may converge sooner.
    pub total: usize,
}

/// What an index was built of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct BuildSummary {
    /// Frames in the index.
    pub frames: usize,
    /// Features of these frames.
    pub features: usize,
    /// Visual words.
    pub words: usize,
    /// Size of the file.
    pub bytes: u64,
}

/// Builds an index and writes it to a file, whole or not at all.
///
/// The bytes depend on the request and the features only, not on the number of threads. Beside the
/// features of a batch of frames, memory holds the sample that the vocabulary is learnt from and 8
/// bytes per feature.
///
/// # Errors
/// [`BuildError`]: a frame's own, a vocabulary too large for the features, or a file that cannot be
/// written.
pub fn build<E: std::error::Error + Send + 'static>(
    path: &Path,
    request: &BuildRequest,
    features_of: impl Fn(usize) -> Result<Features, E> + Sync,
    mut progress: impl FnMut(BuildProgress),
) -> Result<BuildSummary, BuildError<E>> {
    let io = |source| BuildError::Io { path: path.to_owned(), source };
    let folder = folder_of(path);
    fs::create_dir_all(folder).map_err(io)?;
    let mut waiting = Spool::new(folder).map_err(io)?;
    let total = request.frames.len();
    for batch in request.frames.chunks(BATCH) {
        let features: Result<Vec<_>, _> =
            batch.par_iter().map(|&frame| features_of(frame)).collect();
        for features in features.map_err(BuildError::Frame)? {
            waiting.push(&features).map_err(io)?;
        }
        let done = waiting.counts.len();
        progress(BuildProgress { step: BuildStep::Features, done, total });
    }
    let found: usize = waiting.counts.iter().sum();
    if found < request.clustering.words.max(1) {
        return Err(BuildError::TooFewDescriptors {
            found: found as u64,
            words: request.clustering.words,
        });
    }
    let vocabulary = learn(&mut waiting, request, &mut progress).map_err(io)?;
    write_whole_with(path, |file| write(file, waiting, request, &vocabulary, &mut progress))
        .map_err(io)?;
    Ok(BuildSummary {
        frames: total,
        features: found,
        words: vocabulary.words.len(),
        bytes: fs::metadata(path).map_err(io)?.len(),
    })
}

/// A seed for one random choice.
pub(super) fn seed_for(seed: u64, purpose: &str) -> u64 {
    xxh3_64(format!("{seed}/retrieval/{purpose}").as_bytes())
}

/// Words from a sample of the descriptors, drawn without regard to frames.
fn learn(
    waiting: &mut Spool,
    request: &BuildRequest,
    progress: &mut impl FnMut(BuildProgress),
) -> io::Result<Vocabulary> {
    let total: usize = waiting.counts.iter().sum();
    let wanted = request.clustering.words.saturating_mul(request.sample.max(1));
    let mut rng = Pcg64::seed_from_u64(seed_for(request.clustering.seed, "sample"));
    let mut chosen = index::sample(&mut rng, total, wanted.min(total)).into_vec();
    chosen.sort_unstable();
    let mut sample = Vec::with_capacity(chosen.len());
    let mut before = 0;
    waiting.file.rewind()?;
    for frame in 0..waiting.counts.len() {
        let (_, descriptors) = waiting.next(frame)?;
        let end = before + descriptors.len();
        while let Some(&index) = chosen.get(sample.len())
            && index < end
        {
            sample.push(descriptors[index - before]);
        }
        before = end;
    }
    let seed = seed_for(request.clustering.seed, "vocabulary");
    let clustering = Clustering { seed, ..request.clustering };
    let total = clustering.iterations;
    Ok(Vocabulary::learn(&sample, &clustering, |done| {
        progress(BuildProgress { step: BuildStep::Vocabulary, done, total });
    }))
}

fn write(
    file: &mut File,
    mut waiting: Spool,
    request: &BuildRequest,
    vocabulary: &Vocabulary,
    progress: &mut impl FnMut(BuildProgress),
) -> io::Result<()> {
    let mut writer = IndexWriter::new(BufWriter::new(file))?;
    let mut counts = RecordCounts {
        documents: request.frames.len(),
        words: vocabulary.words.len(),
        ..RecordCounts::default()
    };
    let mut occurrences = InvertedIndexBuilder::new(counts.words);
    let mut starts = vec![0];
    waiting.file.rewind()?;
    for done in 0..counts.documents {
        let (places, descriptors) = waiting.next(done)?;
        let words = vocabulary.quantize(&descriptors);
        let features = words.into_iter().zip(places);
        let mut features: Vec<(u32, [f32; 4])> =
            features.filter_map(|(word, place)| Some((word?, place))).collect();
        // Stable: of one word, the strongest stays first.
        features.sort_by_key(|(word, _)| *word);
        for (word, place) in &features {
            writer.record([*word].into_iter().chain(place.map(f32::to_bits)))?;
        }
        let words: Vec<u32> = features.iter().map(|(word, _)| *word).collect();
        occurrences.push(&words);
        counts.features += features.len();
        starts.push(number(counts.features)?);
        progress(BuildProgress { step: BuildStep::Words, done: done + 1, total: counts.documents });
    }
    let frames = request.frames.iter().copied().chain([0]);
    for (frame, start) in frames.zip(starts) {
        writer.record([number(frame)?, start])?;
    }
    for word in &vocabulary.words {
        writer.record(word.map(f32::to_bits))?;
    }
    let inverted = occurrences.weighted();
    for (list, idf) in inverted.lists.iter().zip(&inverted.idf) {
        writer.record([number(counts.postings)?, idf.to_bits()])?;
        counts.postings += list.len();
    }
    writer.record([number(counts.postings)?, 0])?;
    for (document, weight) in inverted.lists.iter().flatten() {
        writer.record([*document, weight.to_bits()])?;
    }
    writer.finish(&Description {
        scene: request.scene.clone(),
        fingerprint: fingerprint_text(request.fingerprint),
        recipe: request.recipe.clone(),
        trees: request.clustering.trees,
        seed: seed_for(request.clustering.seed, "vocabulary"),
        counts,
    })
}

/// The fingerprint as a description writes it.
pub(super) fn fingerprint_text(fingerprint: u64) -> String {
    format!("{fingerprint:016x}")
}

/// The number as a record writes it.
fn number(count: usize) -> io::Result<u32> {
    u32::try_from(count)
        .map_err(|_| io::Error::other(format!("{count} is more than an index can store")))
}

/// Features that wait on disk, in a file without a name, to be read in their order.
struct Spool {
    file: File,
    /// Features of each frame.
    counts: Vec<usize>,
}

impl Spool {
    fn new(folder: &Path) -> io::Result<Self> {
        Ok(Self { file: tempfile::tempfile_in(folder)?, counts: Vec::new() })
    }

    fn push(&mut self, features: &Features) -> io::Result<()> {
        let mut bytes = Vec::new();
        for (keypoint, descriptor) in features.keypoints.iter().zip(&features.descriptors) {
            let place = [keypoint.x, keypoint.y, keypoint.scale, keypoint.angle];
            bytes.extend(place.iter().chain(descriptor).flat_map(|number| number.to_le_bytes()));
        }
        self.counts.push(features.keypoints.len().min(features.descriptors.len()));
        self.file.write_all(&bytes)
    }

    /// Places and descriptors of a frame, which must be the next.
    fn next(&mut self, frame: usize) -> io::Result<(Vec<[f32; 4]>, Vec<Descriptor>)> {
        let count = self.counts[frame];
        let mut bytes = vec![0; count * NUMBERS * size_of::<f32>()];
        self.file.read_exact(&mut bytes)?;
        let (numbers, _) = bytes.as_chunks::<4>();
        Ok(numbers
            .chunks_exact(NUMBERS)
            .map(|numbers| {
                let number = |i: usize| f32::from_le_bytes(numbers[i]);
                (std::array::from_fn(number), std::array::from_fn(|i| number(4 + i)))
            })
            .unzip())
    }
}
