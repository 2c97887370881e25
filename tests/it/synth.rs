//! The street on disk: what the estimators find there is what they find in memory.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use posescope::cloud::Cloud;
use posescope::estimator;
use posescope::geometry::PoseError;
use posescope::image::Photo;
use posescope::memo::Memo;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::{Problem, Query, ReferenceTuple};
use posescope::scene::layout::LAYOUTS;
use posescope::scene::street::{Size, Street};
use posescope::scene::{self, Scene};
use posescope::trace::Trace;
use tempfile::TempDir;

use crate::binary::posescope;
use crate::round_trips;

/// Frames 0, 300 and 600 in half size.
const FEW: [&str; 6] = [
    "--size",
    "half",
    "--every",
    "300",
    "--condition",
    "overcast",
];

fn synth(folder: &Path, extra: &[&str]) -> std::process::Output {
    let output = posescope().arg("synth").arg(folder).args(extra).output();
    output.expect("the binary starts")
}

fn open(folder: &Path) -> Box<dyn Scene> {
    let folder = folder.join("sequences/overcast");
    scene::open(folder.to_str().expect("a plain path"), None).unwrap_or_else(|e| panic!("{e}"))
}

/// The pair as it is made, past any cache.
fn in_memory(street: &Street, query: usize, reference: usize) -> Problem {
    let drive = street.traversal();
    let photo = |frame| Arc::new(Photo::from_color(drive.image(frame)));
    let intrinsics = drive.intrinsics();
    let scan = drive.cloud(reference);
    Problem {
        query: Arc::new(Query {
            name: format!("{query:06}"),
            photo: photo(query),
            intrinsics,
            memo: Memo::off(),
        }),
        reference: Arc::new(ReferenceTuple {
            name: format!("{reference:06}"),
            photo: photo(reference),
            intrinsics,
            world_from_camera: drive.world_from_camera(reference),
            cloud: Cloud {
                points: scan.iter().map(|point| point.position).collect(),
            },
            memo: Memo::off(),
        }),
        uncertainty_radius_m: 15.0,
        prior_m: None,
        seed: 0,
        matches: None,
    }
}

#[test]
fn estimates_from_disk_are_those_from_memory() {
    let folder = TempDir::new().expect("a temporary folder");
    let street = Street::new("overcast", Size::Half).expect("is built in");
    let disk = round_trips::written(&LAYOUTS[0], &street, folder.path());
    let [reference, query] = round_trips::WRITTEN;
    let problem = in_memory(&street, query, reference);
    let from_disk = Problem {
        query: disk.query(1).expect("is complete"),
        reference: disk.reference(0).expect("is complete"),
        ..problem.clone()
    };
    assert_eq!(from_disk.query.photo.color, problem.query.photo.color);
    assert_eq!(disk.time_s(1), Some(7.2));
    for method in Method::PAPER {
        let estimate = |problem: &Problem| {
            let estimator = estimator::entry(method).make(&Params::default());
            let outcome = estimator.estimate(problem, &mut Trace::off());
            let pose = outcome.expect("nobody cancels").pose;
            pose.unwrap_or_else(|failure| panic!("{}: {failure}", method.name()))
        };
        let apart = PoseError::between(&estimate(&problem), &estimate(&from_disk));
        // Points are rounded by micrometres; the grids' poses do not move at all.
        assert!(apart.translation_m < 1e-3, "{}: {apart:?}", method.name());
        assert!(apart.rotation_deg < 1e-3, "{}: {apart:?}", method.name());
    }
}

#[test]
fn the_command_line_runs_on_what_it_wrote() {
    let folder = TempDir::new().expect("a temporary folder");
    let output = synth(folder.path(), &[&FEW[..], &["-q"]].concat());
    assert!(output.status.success() && output.stderr.is_empty());
    let disk = open(folder.path());
    assert_eq!(disk.frames(), ["000000", "000300", "000600"]);
    assert_eq!(disk.intrinsics(0), Size::Half.intrinsics());
    let output = posescope()
        .arg("run")
        .arg(folder.path().join("sequences/overcast"))
        .args(["--query", "300", "--reference", "600", "--radius", "1000"])
        .args(["--method", "fb", "-q", "--json", "-"])
        .output()
        .expect("the binary starts");
    assert!(output.status.success());
    let result = String::from_utf8_lossy(&output.stdout);
    assert!(result.contains("kitti/overcast"), "{result}");
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let folders = ["1", "3"].map(|threads| {
        let folder = TempDir::new().expect("a temporary folder");
        let written = posescope()
            .arg("synth")
            .arg(folder.path())
            .args(FEW)
            .env("RAYON_NUM_THREADS", threads)
            .output();
        assert!(written.expect("the binary starts").status.success());
        folder
    });
    let [alone, together] = folders.each_ref().map(|folder| contents(folder.path()));
    // Three frames, three text files.
    assert_eq!(
        alone.len(),
        9,
        "{:?}",
        alone.iter().map(|f| &f.0).collect::<Vec<_>>()
    );
    assert!(alone == together);
}

/// Every file below a folder, by its path there.
fn contents(root: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(root).expect("is below").to_owned();
                found.push((name, fs::read(path).expect("readable")));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn a_folder_that_is_not_empty_is_refused_unless_forced() {
    let folder = TempDir::new().expect("a temporary folder");
    let notes = folder.path().join("notes.txt");
    fs::write(&notes, b"mine").expect("writable");
    let refused = synth(folder.path(), &FEW);
    let message = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{message}");
    assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    assert!(
        message.contains("not empty") && message.contains("--force"),
        "{message}"
    );
    assert_eq!(contents(folder.path()).len(), 1);

    let sparse = ["--size", "half", "--every", "400", "--force"];
    for extra in [&[&FEW[..], &["--force"]].concat()[..], &sparse] {
        let output = synth(folder.path(), extra);
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    }
    // Of the first sequence no frame is left between those of the second.
    assert_eq!(open(folder.path()).frames(), ["000000", "000400", "000800"]);
    assert_eq!(fs::read(&notes).expect("is still there"), b"mine");
}

#[test]
fn wrong_arguments_name_the_right_ones() {
    let folder = TempDir::new().expect("a temporary folder");
    let cases = [
        (["--condition", "fog"], "overcast"),
        (["--size", "tiny"], "half"),
        (["--every", "0"], "--every"),
        (["--layout", "robotcar"], "toml"),
    ];
    for (arguments, words) in cases {
        let output = synth(folder.path(), &arguments);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(words), "{message}");
    }
}

/// A limit on the size of files stands in for a full disk: the scans, 1.6 MB each, do not fit.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_no_half_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let script = format!(
        "trap '' XFSZ; ulimit -f 500; exec '{}' synth '{}' {}",
        assert_cmd::cargo::cargo_bin!("posescope").display(),
        folder.path().display(),
        FEW.join(" ")
    );
    let output = assert_cmd::Command::new("bash")
        .args(["-c", &script])
        .env("POSESCOPE_CACHE", "")
        .output()
        .expect("bash starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    assert!(message.contains(".bin: File too large"), "{message}");
    let left: Vec<PathBuf> = contents(folder.path())
        .into_iter()
        .map(|file| file.0)
        .collect();
    let text_files = [
        "poses/overcast.txt",
        "sequences/overcast/calib.txt",
        "sequences/overcast/times.txt",
    ];
    assert_eq!(left, text_files.map(PathBuf::from));
}
