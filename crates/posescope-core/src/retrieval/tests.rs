//! From features to a file to ranked frames, on a street of landmarks.

use std::convert::Infallible;
use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use rand::SeedableRng as _;
use rand_pcg::Pcg64;
use tempfile::TempDir;

use super::*;
use crate::features::{Descriptor, Features, Keypoint};

const FRAMES: usize = 30;
/// Landmarks that a frame sees, and how many of them the next frame no longer sees.
const SEEN: usize = 60;
const STEP: usize = 6;

/// What is seen from a place: landmarks beside each other, 20 px apart, with noise.
fn view(place: usize, seed: u64) -> Features {
    let landmarks = random_descriptors(FRAMES * STEP + SEEN, 1);
    let seen = place * STEP..place * STEP + SEEN;
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(1000) + place as u64);
    let keypoints = seen.clone().map(|landmark| Keypoint {
        x: 20.0 * (landmark - place * STEP) as f32 + rng.random_range(-1.0..1.0),
        y: (landmark * 37 % 200) as f32 + rng.random_range(-1.0..1.0),
        scale: 3.0,
        angle: 0.0,
        response: 1.0,
        laplacian_positive: true,
    });
    Features {
        keypoints: keypoints.collect(),
        descriptors: around(&landmarks[seen], SEEN, 0.05, seed + place as u64),
    }
}

fn request() -> BuildRequest {
    BuildRequest {
        scene: "landmarks".to_owned(),
        fingerprint: 42,
        // Every other place, so that positions in the index differ from those in the scene.
        frames: (0..FRAMES).step_by(2).collect(),
        clustering: Clustering { words: 200, iterations: 6, trees: 4, checks: 64, seed: 5 },
        sample: 100,
        recipe: [("words", "200"), ("features", "1000")]
            .map(|(key, value)| (key.to_owned(), value.to_owned()))
            .into(),
    }
}

fn built(request: &BuildRequest) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("made on demand/landmarks.posescope-index");
    build(&path, request, |frame| Ok::<_, Infallible>(view(frame, 0)), |_| ()).expect("is built");
    (folder, path)
}

fn open(path: &Path) -> Index {
    Index::open(path, 64).unwrap_or_else(|error| panic!("{error}"))
}

fn frames(retrieval: &Retrieval) -> Vec<usize> {
    retrieval.ranked.iter().map(|ranked| ranked.frame).collect()
}

#[test]
fn the_frames_around_a_new_view_come_first_and_are_verified() {
    let (_folder, path) = built(&request());
    let index = open(&path);
    for place in 1..FRAMES - 2 {
        let retrieval = index.query(&view(place, 9), &RetrievalParams::default(), |_| true);
        assert_eq!(retrieval.words.len(), SEEN);
        let first = &retrieval.ranked[0];
        assert!(first.frame.abs_diff(place) <= 1, "{place}: {}", first.frame);
        let verified = first.verification().expect("is the same place");
        assert!(verified.inliers > SEEN / 2);
        // Landmarks move by as many pixels as the places are apart.
        let shift = (place as f64 - first.frame as f64) * 20.0 * STEP as f64;
        let found = verified.reference_from_query.translation.x;
        assert!((found - shift).abs() < 5.0, "{found} {shift}");
    }
}

#[test]
fn only_allowed_frames_are_ranked() {
    let (_folder, path) = built(&request());
    let index = open(&path);
    let far =
        index.query(&view(10, 9), &RetrievalParams::default(), |frame| frame.abs_diff(10) > 4);
    assert!(!far.ranked.is_empty());
    assert!(frames(&far).iter().all(|frame| frame.abs_diff(10) > 4));
    let none = index.query(&view(10, 9), &RetrievalParams::default(), |_| false);
    assert!(none.ranked.is_empty());
}

#[test]
fn without_verification_the_order_is_that_of_the_scores() {
    let (_folder, path) = built(&request());
    let params = RetrievalParams { verify: 0, ..RetrievalParams::default() };
    let retrieval = open(&path).query(&view(10, 9), &params, |_| true);
    let ranked = &retrieval.ranked;
    assert!(ranked.is_sorted_by(|a, b| a.score >= b.score));
    assert!(ranked.iter().all(|ranked| ranked.geometry == Geometry::Unchecked));
    assert!(ranked.iter().all(|r| r.score > 0.0 && r.score < 1.0 + 1e-5));
}

#[test]
fn verified_frames_stand_before_the_others_by_their_inliers() {
    let (_folder, path) = built(&request());
    let params = RetrievalParams { verify: 12, ..RetrievalParams::default() };
    let ranked = open(&path).query(&view(10, 9), &params, |_| true).ranked;
    let inliers = |r: &Ranked| r.verification().map(|found| found.inliers);
    assert!(ranked.is_sorted_by(|a, b| inliers(a) >= inliers(b)));
    assert!(inliers(&ranked[0]).is_some());
    assert!(ranked.iter().any(|ranked| inliers(ranked).is_none()));
}

#[test]
fn queries_without_features_find_nothing() {
    let (_folder, path) = built(&request());
    let nothing = open(&path).query(&Features::default(), &RetrievalParams::default(), |_| true);
    assert_eq!(nothing, Retrieval::default());
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads_and_do_on_the_seed() {
    let on = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("a thread pool").install(|| {
            let mut request = request();
            request.clustering.seed = seed;
            let (_folder, path) = built(&request);
            fs::read(path).expect("just written")
        })
    };
    let one = on(1, 5);
    assert_eq!(one, on(2, 5));
    assert_eq!(one, on(8, 5));
    assert_ne!(one, on(1, 6));
}

#[test]
fn the_file_gives_back_what_went_in() {
    let request = request();
    let (_folder, path) = built(&request);
    let index = open(&path);
    let description = index.description();
    assert_eq!(description.scene, "landmarks");
    assert_eq!(description.recipe, request.recipe);
    assert_eq!(description.counts.documents, FRAMES / 2);
    assert_eq!(description.counts.features, FRAMES / 2 * SEEN);
    assert_eq!(description.counts.words, 200);
    let stored = super::layout::MappedIndex::open(&path).expect("just opened");
    for document in 0..FRAMES / 2 {
        assert_eq!(stored.frame(document), Some(2 * document));
        let written = view(2 * document, 0);
        let features: Vec<_> = stored.features(document).collect();
        assert!(features.is_sorted_by_key(|(word, _)| *word));
        let mut places: Vec<_> = features.iter().map(|(_, k)| (k.x, k.y)).collect();
        let mut expected: Vec<_> = written.keypoints.iter().map(|k| (k.x, k.y)).collect();
        places.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
        expected.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
        assert_eq!(places, expected);
        // The weights of a document have unit norm.
        let weights = (0..200).flat_map(|word| stored.postings(word));
        let own = weights.filter(|(other, _)| *other == document);
        let norm: f32 = own.map(|(_, weight)| weight * weight).sum();
        assert!((norm - 1.0).abs() < 1e-4, "{norm}");
    }
    assert_eq!(stored.frame(FRAMES), None);
    assert_eq!(stored.features(FRAMES).len(), 0);
    assert_eq!(stored.postings(200).count(), 0);
}

#[test]
fn an_index_of_something_else_is_stale_and_says_why() {
    let request = request();
    let (_folder, path) = built(&request);
    let index = open(&path);
    assert!(index.check_request(&request).is_ok());
    let why = |changed: BuildRequest| {
        let error = index.check_request(&changed).expect_err("is stale");
        error.to_string()
    };
    let scene = "street".to_owned();
    let message = why(BuildRequest { scene, ..request.clone() });
    assert!(message.contains("for landmarks instead of street"), "{message}");
    let message = why(BuildRequest { fingerprint: 43, ..request.clone() });
    assert!(message.contains("have changed"), "{message}");
    let mut recipe = request.recipe.clone();
    recipe.insert("features".to_owned(), "500".to_owned());
    let message = why(BuildRequest { recipe, ..request });
    assert!(message.contains("built with features = 1000 instead of 500"), "{message}");
}

#[test]
fn a_vocabulary_too_large_is_refused_and_leaves_no_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.posescope-index");
    let mut request = request();
    request.clustering.words = 5000;
    let outcome = build(&path, &request, |f| Ok::<_, Infallible>(view(f, 0)), |_| ());
    let message = outcome.expect_err("900 descriptors").to_string();
    assert!(message.contains("900 descriptors"), "{message}");
    assert!(message.contains("at most 90"), "{message}");
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0);
}

#[test]
fn a_frame_that_cannot_be_read_ends_the_work() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.posescope-index");
    let broken = |frame| match frame {
        8 => Err(std::io::Error::other("frame 8 is broken")),
        _ => Ok(view(frame, 0)),
    };
    let message = build(&path, &request(), broken, |_| ()).expect_err("frame 8");
    assert_eq!(message.to_string(), "frame 8 is broken");
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0);
}

#[test]
fn progress_goes_through_all_steps_to_their_ends() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.posescope-index");
    let mut told: Vec<BuildProgress> = Vec::new();
    let tell = |progress| told.push(progress);
    build(&path, &request(), |f| Ok::<_, Infallible>(view(f, 0)), tell).expect("is built");
    let mut steps: Vec<&str> = told.iter().map(|progress| progress.step.name()).collect();
    steps.dedup();
    assert_eq!(steps, ["features", "vocabulary", "words"]);
    for step in [BuildStep::Features, BuildStep::Words] {
        let last = told.iter().rev().find(|progress| progress.step == step);
        assert!(last.is_some_and(|last| last.done == last.total));
    }
}

#[test]
fn files_that_are_none_are_told_apart() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.posescope-index");
    let message = || match Index::open(&path, 64) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("is no index"),
    };
    assert!(message().contains("the retrieval index does not exist"));
    for content in ["", "short", "This text is not an index."] {
        fs::write(&path, content).expect("writable");
        assert!(message().contains("not a retrieval index"), "{content}");
    }
    fs::remove_file(&path).expect("just written");
    fs::create_dir(&path).expect("is free");
    assert!(Index::open(&path, 64).is_err());
}

#[test]
fn another_layout_is_named() {
    let (_folder, path) = built(&request());
    let mut bytes = fs::read(&path).expect("just written");
    bytes[7] += 1;
    let end = bytes.len() - 8;
    let sum = xxhash_rust::xxh3::xxh3_64(&bytes[..end]);
    bytes[end..].copy_from_slice(&sum.to_le_bytes());
    fs::write(&path, bytes).expect("writable");
    let error = Index::open(&path, 64).err().map(|error| error.to_string());
    let error = error.unwrap_or_default();
    assert!(error.contains("layout 2 instead of 1"), "{error}");
}

fn small_file() -> Vec<u8> {
    let mut request = BuildRequest { frames: (0..3).collect(), ..request() };
    request.clustering.words = 8;
    let (_folder, path) = built(&request);
    fs::read(path).expect("just written")
}

fn opens(bytes: &[u8]) -> bool {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.posescope-index");
    fs::write(&path, bytes).expect("writable");
    Index::open(&path, 64).is_ok()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn a_changed_byte_is_always_noticed(at in any::<prop::sample::Index>(), change in 1u8..) {
        static WHOLE: std::sync::LazyLock<Vec<u8>> = std::sync::LazyLock::new(small_file);
        let mut damaged = WHOLE.clone();
        prop_assert!(opens(&damaged));
        let at = at.index(damaged.len());
        damaged[at] ^= change;
        prop_assert!(!opens(&damaged), "byte {}", at);
        prop_assert!(!opens(&WHOLE[..at]), "cut off at {}", at);
        damaged[at] ^= change;
        damaged.push(change);
        prop_assert!(!opens(&damaged), "longer");
    }

    /// Somebody who wrote nonsense with a checksum that fits.
    #[test]
    fn nonsense_that_is_whole_is_refused_or_harmless(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..20),
    ) {
        static WHOLE: std::sync::LazyLock<Vec<u8>> = std::sync::LazyLock::new(small_file);
        let mut bytes = WHOLE.clone();
        let end = bytes.len() - 8;
        for (at, value) in changes {
            bytes[at.index(end)] = value;
        }
        let sum = xxhash_rust::xxh3::xxh3_64(&bytes[..end]);
        bytes[end..].copy_from_slice(&sum.to_le_bytes());
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.posescope-index");
        fs::write(&path, bytes).expect("writable");
        if let Ok(index) = Index::open(&path, 64) {
            index.query(&view(1, 3), &RetrievalParams::default(), |_| true);
        }
    }
}

/// Descriptors of unit norm in random directions.
pub(super) fn random_descriptors(count: usize, seed: u64) -> Vec<Descriptor> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..count).map(|_| normalized(std::array::from_fn(|_| rng.random_range(-1.0..1.0)))).collect()
}

/// Descriptors of unit norm near the centres, dealt out to them in turn; `spread` is the greatest
/// deviation of a number.
pub(super) fn around(
    centres: &[Descriptor],
    count: usize,
    spread: f32,
    seed: u64,
) -> Vec<Descriptor> {
    let mut rng = Pcg64::seed_from_u64(seed);
    (0..count)
        .map(|i| {
            let centre = centres[i % centres.len()];
            normalized(centre.map(|value| value + rng.random_range(-spread..spread)))
        })
        .collect()
}

fn normalized(descriptor: Descriptor) -> Descriptor {
    let norm = descriptor.iter().map(|value| value * value).sum::<f32>();
    descriptor.map(|value| value / norm.sqrt())
}
