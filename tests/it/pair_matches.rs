//! Matches that another system found take the place of ours; all that follows stays.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use posescope::foreign::MatchSource as _;
use posescope::localize::QueryResult;
use posescope::method::Method;
use posescope::scene::MatchFolder;
use tempfile::TempDir;

use crate::binary::posescope;
use crate::damage;
use crate::real_pair::authors_pair;

fn results(scene: &str, arguments: &[&str]) -> Vec<QueryResult> {
    let mut command = posescope();
    command
        .args(["run", scene, "--json", "-", "-q"])
        .args(arguments);
    let output = command.output().expect("the binary starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    let lines = String::from_utf8_lossy(&output.stdout);
    let read = |line: &str| serde_json::from_str(line).expect("a result");
    lines.lines().map(read).collect()
}

fn of_fb(results: &[QueryResult]) -> Vec<&QueryResult> {
    results
        .iter()
        .filter(|result| result.method == Method::FB)
        .collect()
}

/// FB's poses with the matches that FB exported.
fn read_back(scene: &str, asked: &[&str]) {
    let folder = TempDir::new().expect("a folder");
    let matches = folder.path().join("matches");
    let matches = matches.to_str().expect("a plain path");
    let ours = results(scene, &[asked, &["--export-matches", matches]].concat());
    let again = results(scene, &[asked, &["--matches", matches]].concat());
    assert_eq!(ours.len(), again.len());
    let mut localized = 0;
    for (ours, again) in of_fb(&ours).into_iter().zip(of_fb(&again)) {
        // Bit for bit, as it is written.
        assert_eq!(ours.pose, again.pose, "{}", ours.query);
        let inliers = |result: &QueryResult| result.counts.map(|counts| counts.inliers);
        assert_eq!(inliers(ours), inliers(again));
        localized += usize::from(ours.pose.is_some());
    }
    assert!(localized > 0);
    let others = |results: &[QueryResult]| -> Vec<QueryResult> {
        let others = results.iter().filter(|result| result.method == Method::MI);
        others
            .map(|result| QueryResult {
                agreement: Vec::new(),
                ..result.clone()
            })
            .collect()
    };
    assert_eq!(others(&ours), others(&again), "MI has no matches");
}

#[test]
fn our_own_matches_read_back_give_our_own_pose_bit_for_bit() {
    let asked = [
        "--query",
        "70",
        "--query",
        "300",
        "--reference",
        "nearest:2",
        "--method",
        "fb,mi",
    ];
    read_back("street", &asked);
}

#[test]
fn our_own_matches_of_real_photos_read_back_give_our_own_pose_bit_for_bit() {
    let Some(sequence) = authors_pair() else {
        return;
    };
    let scene = sequence.to_str().expect("a plain path");
    read_back(
        scene,
        &[
            "--query",
            "3823",
            "--reference",
            "3814",
            "--method",
            "fb,mi",
        ],
    );
}

#[test]
fn a_pair_without_matches_is_a_result_that_says_so() {
    let folder = TempDir::new().expect("a folder");
    fs::write(folder.path().join("000001_000002_matches.txt"), "1 2 3 4\n").expect("writable");
    let matches = folder.path().to_str().expect("a plain path");
    let found = results(
        "street",
        &[
            "--query",
            "70",
            "--reference",
            "62",
            "--method",
            "fb,hy",
            "--matches",
            matches,
        ],
    );
    let reason = found[0].reason.as_ref().expect("no matches, no pose");
    assert_eq!(reason.code.name(), "E1");
    assert!(
        reason.text.contains("matches of 000070 with 000062"),
        "{}",
        reason.text
    );
    // The hybrid goes on to its second method.
    assert!(found[1].cost.is_some());
}

/// A file in numpy's format.
fn npy(kind: &str, shape: &str, bytes: &[u8]) -> Vec<u8> {
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
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

/// As SuperGlue's demonstration writes it: three keypoints, two, and one match.
fn npz(path: &Path) {
    let floats =
        |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let whole =
        |values: &[i64]| -> Vec<u8> { values.iter().flat_map(|v| v.to_le_bytes()).collect() };
    let mut archive = zip::ZipWriter::new(fs::File::create(path).expect("writable"));
    let options = zip::write::SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated);
    for (name, content) in [
        (
            "keypoints0.npy",
            npy("<f4", "(3, 2)", &floats(&[1.0, 2.0, 3.5, 4.0, 5.0, 6.0])),
        ),
        (
            "keypoints1.npy",
            npy("<f4", "(2, 2)", &floats(&[7.0, 8.0, 9.0, 10.25])),
        ),
        ("matches.npy", npy("<i8", "(3,)", &whole(&[-1, 1, -1]))),
        (
            "match_confidence.npy",
            npy("<f4", "(3,)", &floats(&[0.0, 0.5, 0.0])),
        ),
    ] {
        archive.start_file(name, options).expect("writable");
        archive.write_all(&content).expect("writable");
    }
    archive.finish().expect("writable");
}

/// As hloc writes them, with names in folders and positions of 16 bits.
fn hloc(folder: &Path) {
    let half = |values: &[f32]| -> Vec<u16> {
        values
            .iter()
            .map(|value| half::f16::from_f32(*value).to_bits())
            .collect()
    };
    let mut features = hdf5_pure::FileBuilder::new();
    for (name, values, count) in [
        ("query", vec![1.0, 2.0, 3.5, 4.0, 5.0, 6.0], 3),
        ("mapping", vec![7.0, 8.0, 9.0, 10.25], 2),
    ] {
        let mut outer = features.create_group(name);
        let image = if name == "query" {
            "000070.png"
        } else {
            "000062.png"
        };
        let mut group = outer.create_group(image);
        // Halves have no type of their own in the writer; singles are read as well.
        let _ = half(&values);
        group
            .create_dataset("keypoints")
            .with_f32_data(&values)
            .with_shape(&[count, 2]);
        outer.add_group(group.finish());
        features.add_group(outer.finish());
    }
    features.write(folder.join("feats.h5")).expect("writable");
    let mut matches = hdf5_pure::FileBuilder::new();
    let mut first = matches.create_group("query-000070.png");
    let mut second = first.create_group("mapping-000062.png");
    second
        .create_dataset("matches0")
        .with_i16_data(&[-1, 1, -1])
        .with_shape(&[3]);
    first.add_group(second.finish());
    matches.add_group(first.finish());
    matches.write(folder.join("matches.h5")).expect("writable");
}

fn text(path: &Path) {
    fs::write(path, "# a comment\n3.5 4 9 10.25 0.5\n").expect("writable");
}

/// What writes the same matches of a pair into a folder.
type Write = fn(&Path);

/// By the name of the form.
pub const FORMS: [(&str, Write); 3] = [
    ("matches as text", |folder| {
        text(&folder.join("000070_000062_matches.txt"));
    }),
    ("matches as npz", |folder| {
        npz(&folder.join("000070_000062_matches.npz"));
    }),
    ("matches of hloc", hloc),
];

#[test]
fn all_forms_say_the_same_in_both_directions() {
    for (form, write) in FORMS {
        let folder = TempDir::new().expect("a folder");
        write(folder.path());
        let source = MatchFolder::open(folder.path()).unwrap_or_else(|error| panic!("{error}"));
        let pairs = |query: &str, reference: &str| {
            let found = source
                .matches(query, reference)
                .unwrap_or_else(|error| panic!("{error}"));
            let Some(posescope::features::PairMatches::Found(found)) = found else {
                panic!("{form} has the pair");
            };
            let decision = found.decisions.iter().flatten().next().expect("one match");
            let a = found.query.keypoints[decision.query];
            let b = found.reference.keypoints[decision.reference];
            ([a.x, a.y], [b.x, b.y], found.count())
        };
        assert_eq!(
            pairs("000070", "000062"),
            ([3.5, 4.0], [9.0, 10.25], 1),
            "{form}"
        );
        assert_eq!(
            pairs("000062", "000070"),
            ([9.0, 10.25], [3.5, 4.0], 1),
            "{form}"
        );
        assert!(
            source
                .matches("000070", "000063")
                .is_ok_and(|found| found.is_none())
        );
    }
}

#[test]
fn a_folder_without_matches_is_refused() {
    let folder = TempDir::new().expect("a folder");
    let error = MatchFolder::open(folder.path()).err().expect("is empty");
    damage::expect_words(&error.to_string(), &["hloc's features and matches"]);
    let mut command = posescope();
    command.args(["run", "street", "--query", "70", "--method", "mi"]);
    command.arg("--export-matches").arg(folder.path());
    command.assert().code(2);
}
