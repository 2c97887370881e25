//! The street on disk: what the estimators find there is what they find in memory.

use std::fs;
use std::path::{Path, PathBuf};

use posescope::cloud::Cloud;
use posescope::estimator;
use posescope::geometry::PoseError;
use posescope::image::Photo;
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::{Problem, Query, ReferenceTuple};
use posescope::scene::layout::LAYOUTS;
use posescope::scene::street::{Size, Street};
use posescope::trace::Trace;
use tempfile::TempDir;

use crate::binary::{Said, command_in, has, run_in, text, with_files_up_to, write};
use crate::damage::open;
use crate::round_trips;

/// Frames 0, 300 and 600 in half size.
const FEW: &str = "synth . --size half --every 300 --condition overcast";

/// The pair as it is made, past any cache.
fn in_memory(street: &Street, query: usize, reference: usize) -> Problem {
    let drive = street.traversal();
    let photo = |frame| Photo::from_color(drive.image(frame));
    let intrinsics = drive.intrinsics();
    let points = drive.cloud(reference).iter().map(|point| point.position).collect();
    let pose = drive.world_from_camera(reference);
    let (name, tuple_photo) = (format!("{reference:06}"), photo(reference));
    let reference = ReferenceTuple::new(name, tuple_photo, intrinsics, pose, Cloud { points });
    let query = Query::new(format!("{query:06}"), photo(query), intrinsics).expect("fits");
    Problem::new(query, reference.expect("fits"), 15.0).expect("a radius")
}

#[test]
fn estimates_from_disk_are_those_from_memory() {
    let folder = TempDir::new().expect("a temporary folder");
    let street = Street::new("overcast", Size::Half).expect("is built in");
    let disk = round_trips::written(&LAYOUTS[0], &street, folder.path());
    let [reference, query] = round_trips::WRITTEN;
    let problem = in_memory(&street, query, reference);
    let from_disk = problem
        .clone()
        .with_query(disk.query(1).expect("is complete"))
        .with_reference(disk.reference(0).expect("is complete"));
    assert_eq!(from_disk.query().photo().color, problem.query().photo().color);
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
fn the_command_line_runs_on_what_it_wrote_and_writes_the_same_on_any_number_of_threads() {
    let [folder, other] = [0, 1].map(|_| TempDir::new().expect("a temporary folder"));
    let said = run_in(folder.path(), &format!("{FEW} -q")).ok();
    assert!(said.err.is_empty(), "{}", said.err);
    let disk = open(folder.path().join("sequences/overcast"));
    assert_eq!(disk.frames(), ["000000", "000300", "000600"]);
    assert_eq!(disk.intrinsics(0), Size::Half.intrinsics());

    let mut command = command_in(other.path(), FEW);
    Said::by(command.env("RAYON_NUM_THREADS", "1")).ok();
    // Three frames, three text files.
    let files = contents(folder.path());
    assert_eq!(files.len(), 9);
    assert!(files == contents(other.path()));

    let line =
        "run sequences/overcast --query 300 --reference 600 --radius 1000 --method fb -q --json -";
    has(&run_in(folder.path(), line).ok().out, "kitti/overcast");
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
    let run = |line: &str| run_in(folder.path(), line);
    write(folder.path().join("notes.txt"), "mine");
    run(FEW).fails_in_one_line(2, "not empty ~ --force");
    assert_eq!(contents(folder.path()).len(), 1);
    run(&format!("{FEW} --force")).ok();
    run("synth . --size half --every 400 --condition overcast --force").ok();
    // Of the first sequence no frame is left between those of the second.
    let disk = open(folder.path().join("sequences/overcast"));
    assert_eq!(disk.frames(), ["000000", "000400", "000800"]);
    assert_eq!(text(folder.path().join("notes.txt")), "mine");
    for (words, expected) in [
        ("--condition fog", "overcast"),
        ("--size tiny", "half"),
        ("--every 0", "--every"),
        ("--layout robotcar", "toml"),
    ] {
        run(&format!("synth other {words}")).fails_with(2, expected);
    }
}

/// A limit on the size of files stands in for a full disk: the scans, 1.6 MB each, do not fit.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_no_half_file() {
    let folder = TempDir::new().expect("a temporary folder");
    let Some(mut command) = with_files_up_to(500, FEW) else {
        return;
    };
    command.current_dir(folder.path());
    let said = Said::by(command.env("POSESCOPE_CACHE", ""));
    said.fails_in_one_line(3, ".bin: File too large");
    let left = contents(folder.path()).into_iter().map(|file| file.0);
    let expected =
        ["poses/overcast.txt", "sequences/overcast/calib.txt", "sequences/overcast/times.txt"];
    assert!(left.eq(expected.map(PathBuf::from)));
}
