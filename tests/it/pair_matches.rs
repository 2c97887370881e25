//! Matches that another system found take the place of ours; all that follows stays.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use posescope::features::PairMatches;
use posescope::foreign::MatchSource as _;
use posescope::localize::QueryResult;
use posescope::method::Method;
use posescope::scene::MatchFolder;
use tempfile::TempDir;

use crate::binary::{has, run_in, write};
use crate::colmap::write_rig;
use crate::damage;
use crate::real_pair::authors_pair;

/// The results that a run prints.
#[track_caller]
fn results(folder: &Path, words: &str) -> Vec<QueryResult> {
    run_in(folder, &format!("run {words} --json - -q")).results()
}

/// FB's poses with the matches that FB exported.
fn read_back(asked: &str) {
    let folder = TempDir::new().expect("a folder");
    let [ours, again] = ["--export-matches", "--matches"]
        .map(|option| results(folder.path(), &format!("{asked} --method fb,mi {option} matches")));
    assert_eq!(ours.len(), again.len());
    let mut localized = 0;
    let is_of_fb = |(ours, _): &(&QueryResult, &QueryResult)| ours.method == Method::FB;
    for (ours, again) in ours.iter().zip(&again).filter(is_of_fb) {
        // Bit for bit, as it is written.
        assert_eq!(ours.pose, again.pose, "{}", ours.query);
        let inliers = |result: &QueryResult| result.counts.map(|counts| counts.inliers);
        assert_eq!(inliers(ours), inliers(again));
        localized += usize::from(ours.pose.is_some());
    }
    assert!(localized > 0);
    let others = |results: &[QueryResult]| -> Vec<QueryResult> {
        let others = results.iter().filter(|result| result.method == Method::MI);
        others.map(|result| QueryResult { agreement: Vec::new(), ..result.clone() }).collect()
    };
    assert_eq!(others(&ours), others(&again), "MI has no matches");
}

#[test]
fn our_own_matches_read_back_give_our_own_pose_bit_for_bit() {
    read_back("street --query 70 --query 300 --reference nearest:2");
}

#[test]
fn our_own_matches_of_real_photos_read_back_give_our_own_pose_bit_for_bit() {
    if let Some(sequence) = authors_pair() {
        read_back(&format!("'{}' --query 3823 --reference 3814", sequence.display()));
    }
}

#[test]
fn a_pair_without_matches_is_a_result_that_says_so() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path().join("000001_000002_matches.txt"), "1 2 3 4\n");
    let words = "street --query 70 --reference 62 --method fb,hy --matches .";
    let found = results(folder.path(), words);
    let reason = found[0].reason.as_ref().expect("no matches, no pose");
    assert_eq!(reason.code.name(), "E1");
    has(&reason.text, "matches of 000070 with 000062");
    // The hybrid goes on to its second method.
    assert!(found[1].cost.is_some());
}

/// A file in numpy's format.
fn npy(kind: &str, shape: &str, order: &str, bytes: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': {order}, 'shape': {shape}, }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend((header.len() as u16).to_le_bytes());
    file.extend(header.as_bytes());
    file.extend(bytes);
    file
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn whole(values: &[i64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// An archive with three keypoints of the first photo, two of the second, and these arrays. `batch` begins the shapes.
fn npz_with(path: &Path, batch: &str, arrays: &[(&str, Vec<u8>)]) {
    let mut archive = zip::ZipWriter::new(fs::File::create(path).expect("writable"));
    let options = zip::write::SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated);
    let first = floats(&[1.0, 2.0, 3.5, 4.0, 5.0, 6.0]);
    let second = floats(&[7.0, 8.0, 9.0, 10.25]);
    let keypoints = [
        ("keypoints0", npy("<f4", &format!("({batch}3, 2)"), "False", &first)),
        ("keypoints1", npy("<f4", &format!("({batch}2, 2)"), "False", &second)),
    ];
    for (name, content) in keypoints.iter().chain(arrays) {
        archive.start_file(format!("{name}.npy"), options).expect("writable");
        archive.write_all(content).expect("writable");
    }
    archive.finish().expect("writable");
}

/// The partner of each keypoint, in this shape.
fn partners(shape: &str) -> Vec<u8> {
    npy("<i8", shape, "False", &whole(&[-1, 1, -1]))
}

/// As SuperGlue's demonstration writes it: three keypoints, two, and one match.
fn npz(path: &Path) {
    let confidence = npy("<f4", "(3,)", "False", &floats(&[0.0, 0.5, 0.0]));
    npz_with(path, "", &[("matches", partners("(3,)")), ("match_confidence", confidence)]);
}

/// As LightGlue gives it: pairs of keypoints, and the partner of each.
fn pairs(path: &Path) {
    let matches = npy("<i8", "(1, 2)", "False", &whole(&[1, 1]));
    let scores = npy("<f4", "(1,)", "False", &floats(&[0.5]));
    let arrays = [("matches", matches), ("matches0", partners("(3,)")), ("scores", scores)];
    npz_with(path, "", &arrays);
}

/// The same with a batch axis, and pairs that were transposed before they were saved.
fn batch(path: &Path) {
    let matches = npy("<i8", "(1, 1, 2)", "True", &whole(&[1, 1]));
    npz_with(path, "1, ", &[("matches", matches), ("matches0", partners("(1, 3)"))]);
}

/// As hloc writes them, or as it wrote them, with names in folders; the writer has no positions of 16 bits.
fn hloc(folder: &Path, is_old: bool) {
    let mut features = hdf5_pure::FileBuilder::new();
    for (name, image, values, count) in [
        ("query", "000070.png", vec![1.0, 2.0, 3.5, 4.0, 5.0, 6.0], 3),
        ("mapping", "000062.png", vec![7.0, 8.0, 9.0, 10.25], 2),
    ] {
        let mut outer = features.create_group(name);
        let mut group = outer.create_group(image);
        group.create_dataset("keypoints").with_f32_data(&values).with_shape(&[count, 2]);
        outer.add_group(group.finish());
        features.add_group(outer.finish());
    }
    features.write(folder.join("feats.h5")).expect("writable");
    if is_old {
        let mut matches = hdf5_pure::FileBuilder::new();
        let mut group = matches.create_group("query-000070.png_mapping-000062.png");
        group.create_dataset("matches0").with_i16_data(&[-1, 1, -1]).with_shape(&[3]);
        matches.add_group(group.finish());
        matches.write(folder.join("matches.h5")).expect("writable");
        return;
    }
    let mut matches = hdf5_pure::FileBuilder::new();
    let mut first = matches.create_group("query-000070.png");
    let mut second = first.create_group("mapping-000062.png");
    second.create_dataset("matches0").with_i16_data(&[-1, 1, -1]).with_shape(&[3]);
    first.add_group(second.finish());
    matches.add_group(first.finish());
    matches.write(folder.join("matches.h5")).expect("writable");
}

fn text(path: &Path) {
    write(path, "# a comment\n3.5 4 9 10.25 0.5\n");
}

/// What writes the same matches of a pair into a folder.
type Write = fn(&Path);

/// By the name of the form.
pub const FORMS: [(&str, Write); 6] = [
    ("matches as text", |folder| {
        text(&folder.join("000070_000062_matches.txt"));
    }),
    ("matches as npz", |folder| {
        npz(&folder.join("000070_000062_matches.npz"));
    }),
    ("matches of LightGlue", |folder| {
        pairs(&folder.join("000070_000062_matches.npz"));
    }),
    ("matches with a batch axis", |folder| {
        batch(&folder.join("000070_000062_matches.npz"));
    }),
    ("matches of hloc", |folder| hloc(folder, false)),
    ("old matches of hloc", |folder| hloc(folder, true)),
];

#[test]
fn archives_of_matches_that_say_two_things_or_none_are_refused() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("000070_000062_matches.npz");
    let said = |arrays: &[(&str, Vec<u8>)]| {
        npz_with(&path, "", arrays);
        let source = MatchFolder::open(folder.path()).unwrap_or_else(|error| panic!("{error}"));
        let error = source.matches("000070", "000062").expect_err("no matches").to_string();
        assert_eq!(error.lines().count(), 1);
        error
    };
    let of =
        |values: &[i64]| npy("<i8", &format!("({}, 2)", values.len() / 2), "False", &whole(values));
    has(&said(&[]), "an array matches or matches0 expected, keypoints0, keypoints1 found");
    has(&said(&[("matches", of(&[0, 0])), ("matches0", partners("(3,)"))]), "the same matches");
    has(&said(&[("matches", of(&[1, 0, 1, 1]))]), "keypoint 1 has two");
    has(&said(&[("matches", of(&[3, 0]))]), "a keypoint below 3 expected, 3 found");
    has(&said(&[("matches", of(&[1, -1]))]), "pairs of whole numbers expected, 1 and -1 found");
    has(&said(&[("matches0", of(&[1, 1, 0, 0]))]), "one for each keypoint");
}

#[test]
fn all_forms_say_the_same_in_both_directions() {
    for (form, write) in FORMS {
        let folder = TempDir::new().expect("a folder");
        write(folder.path());
        let source = MatchFolder::open(folder.path()).unwrap_or_else(|error| panic!("{error}"));
        let pairs = |query: &str, reference: &str| {
            let found = source.matches(query, reference).unwrap_or_else(|error| panic!("{error}"));
            let Some(PairMatches::Found(found)) = found else {
                panic!("{form} has the pair");
            };
            let decision = found.decisions.iter().flatten().next().expect("one match");
            let a = found.query.keypoints[decision.query];
            let b = found.reference.keypoints[decision.reference];
            ([a.x, a.y], [b.x, b.y], found.count())
        };
        let (a, b) = ([3.5, 4.0], [9.0, 10.25]);
        assert_eq!(pairs("000070", "000062"), (a, b, 1), "{form}");
        assert_eq!(pairs("000062", "000070"), (b, a, 1), "{form}");
        let other = source.matches("000070", "000063");
        assert!(other.is_ok_and(|found| found.is_none()));
    }
}

/// Features and matches of hloc, a keypoint of each image and their match.
fn write_hloc_of_the_rig(folder: &Path) {
    fs::create_dir(folder).expect("writable");
    let mut features = hdf5_pure::FileBuilder::new();
    for (camera, place) in [("cam0", [3.0, 4.0]), ("cam1", [50.0, 40.0])] {
        let mut outer = features.create_group(camera);
        let mut group = outer.create_group("000001.png");
        group.create_dataset("keypoints").with_f32_data(&place).with_shape(&[1, 2]);
        outer.add_group(group.finish());
        features.add_group(outer.finish());
    }
    features.write(folder.join("feats.h5")).expect("writable");
    let mut matches = hdf5_pure::FileBuilder::new();
    let mut first = matches.create_group("cam1-000001.png");
    let mut second = first.create_group("cam0-000001.png");
    second.create_dataset("matches0").with_i16_data(&[0]).with_shape(&[1]);
    first.add_group(second.finish());
    matches.add_group(first.finish());
    matches.write(folder.join("matches.h5")).expect("writable");
}

#[test]
fn hlocs_matches_of_a_rig_are_those_of_its_cameras() {
    let folder = TempDir::new().expect("a folder");
    write_rig(folder.path());
    write_hloc_of_the_rig(&folder.path().join("hloc"));
    let scene = damage::open(folder.path());
    let source = MatchFolder::open(&folder.path().join("hloc"));
    let source = source.unwrap_or_else(|error| panic!("{error}"));
    let source = source.between(scene.as_ref(), scene.as_ref());
    for (query, reference) in [("cam1/000001", "cam0/000001"), ("cam0/000001", "cam1/000001")] {
        let found = source.matches(query, reference).unwrap_or_else(|error| panic!("{error}"));
        let Some(PairMatches::Found(found)) = found else { panic!("no matches of {query}") };
        assert_eq!(found.count(), 1);
        let of_query = found.query.keypoints[0];
        // Camera 0 has no lens, so that its pixels are those of the file.
        let of_camera0 =
            if query.starts_with("cam0") { of_query } else { found.reference.keypoints[0] };
        assert_eq!((of_camera0.x, of_camera0.y), (3.0, 4.0));
    }
    assert!(source.matches("cam0/000001", "cam0/000001").is_ok_and(|found| found.is_none()));
    let line = "run . --query cam1/000001 --reference cam0/000001 --method fb --matches hloc";
    let said = run_in(folder.path(), line);
    assert!(!said.out.contains("E1"), "{}", said.out);
    has(&said.out, "R2");
}

#[test]
fn a_folder_without_matches_is_refused() {
    let folder = TempDir::new().expect("a folder");
    let error = MatchFolder::open(folder.path()).err().expect("is empty");
    damage::expect_words(&error.to_string(), "hloc's features and matches");
    let line = "run street --query 70 --method mi --export-matches .";
    assert_eq!(run_in(folder.path(), line).code, Some(2));
}

#[test]
fn advice_about_given_matches_names_no_parameter_of_our_own_features() {
    let folder = TempDir::new().expect("a folder");
    // Ten keypoints are too few.
    let rows: String = (0..10).map(|at| format!("{at}0 {at}5 {at}0 {at}5\n")).collect();
    write(folder.path().join("000070_000062_matches.txt"), rows);
    let said =
        run_in(folder.path(), "run street --query 70 --reference 62 --method fb --matches .");
    has(&said.out, "R2");
    has(&said.out, "let the matcher keep more keypoints");
    assert!(!said.out.contains("surf."), "{}", said.out);
    let said = run_in(
        folder.path(),
        "run street --query 70 --reference 62 --method fb --matches . --explain",
    );
    assert!(!said.out.contains("surf."), "{}", said.out);
}

#[test]
fn keypoints_of_resized_photos_are_named_with_the_factor() {
    let folder = TempDir::new().expect("a folder");
    let line = "run street --query 70 --reference 62 --method fb --export-matches .";
    assert_eq!(run_in(folder.path(), line).code, Some(0));
    let path = folder.path().join("000070_000062_matches.txt");
    let text = fs::read_to_string(&path).expect("our own");
    let half = |line: &str| {
        let numbers = line.split(' ').map(|word| word.parse::<f32>().expect("a number") / 2.0);
        numbers.map(|number| number.to_string()).collect::<Vec<_>>().join(" ") + "\n"
    };
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    write(&path, lines.map(half).collect::<String>());
    let line = "run street --query 70 --reference 62 --method fb --matches .";
    let said = run_in(folder.path(), line).out;
    has(&said, "X1 The matches seem to be of photos resized by about 0.49");
    // The matches themselves are those of no resized photo.
    write(&path, text);
    assert!(!run_in(folder.path(), line).out.contains("resized"));
}

/// What a folder says of a pair whose features are in a file that `features` writes.
fn matched(features: &dyn Fn(&Path)) -> Result<Vec<[f32; 2]>, String> {
    let folder = TempDir::new().expect("a folder");
    features(&folder.path().join("feats.h5"));
    let mut matches = hdf5_pure::FileBuilder::new();
    let mut first = matches.create_group("000070.png");
    let mut second = first.create_group("000062.png");
    second.create_dataset("matches0").with_i16_data(&[-1, 1, -1]).with_shape(&[3]);
    first.add_group(second.finish());
    matches.add_group(first.finish());
    matches.write(folder.path().join("matches.h5")).expect("writable");
    let source = MatchFolder::open(folder.path());
    let found = source.and_then(|source| source.matches("000070", "000062"));
    match found.map_err(|error| error.to_string())?.expect("is stored") {
        PairMatches::Found(found) => {
            Ok(found.query.keypoints.iter().map(|keypoint| [keypoint.x, keypoint.y]).collect())
        }
        PairMatches::Absent => panic!("no matches"),
    }
}

#[test]
fn arrays_of_matches_are_read_as_what_they_are() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/hdf5");
    let fixture = |name: &'static str| {
        let from = fixtures.join(name);
        matched(&move |path| {
            fs::copy(&from, path).expect("a fixture");
        })
    };
    for (name, words) in [
        ("groups-in-themselves.h5", "feats.h5 ~ a group is reached on many ways"),
        ("large-chunk.h5", "keypoints: a part of 4261412864 bytes expected"),
        ("many-links.h5", "feats.h5 ~ the same groups are linked more than 32 times"),
        ("soft-links.h5", "feats.h5 ~ 000062.png: ~ a soft link found"),
        ("words.h5", "000070.png/keypoints: positions as numbers expected"),
    ] {
        has(&fixture(name).expect_err(name), words);
    }
    let expected = vec![[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]];
    assert_eq!(fixture("big-endian-halves.h5"), Ok(expected.clone()));
    let whole = matched(&|path| {
        let mut features = hdf5_pure::FileBuilder::new();
        for image in ["000062.png", "000070.png"] {
            let mut group = features.create_group(image);
            let set = group.create_dataset("keypoints");
            set.with_i16_data(&[1, 2, 3, 4, 5, 6]).with_shape(&[3, 2]);
            features.add_group(group.finish());
        }
        features.write(path).expect("writable");
    });
    assert_eq!(whole, Ok(expected));
    // Numpy writes 1e20 where an array is masked.
    let masked = matched(&|path| {
        let mut features = hdf5_pure::FileBuilder::new();
        for image in ["000062.png", "000070.png"] {
            let mut group = features.create_group(image);
            let set = group.create_dataset("keypoints");
            set.with_f32_data(&[1.0, 2.0, 1e20, 1e20, 5.0, 6.0]).with_shape(&[3, 2]);
            features.add_group(group.finish());
        }
        features.write(path).expect("writable");
    });
    has(&masked.expect_err("masked"), "within 1e6 px ~ masked");
}
