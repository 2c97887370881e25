//! Scenes that share a name, and scenes that are spelt in several ways: each is itself.

use std::fs;
use std::path::Path;

use posescope::localize::QueryResult;
use posescope::run::read_run;
use tempfile::TempDir;

use crate::binary::{has, objects, refused, run_in, text, write};
use crate::small_sequence;

const FRAMES: [usize; 5] = [0, 1, 2, 3, 4];

const EVAL: &str = "--method fb --radius 3 --reference nearest:1 --keep-failures 0";

/// Sequences 42 in the folders `map`, `q1` and `q2`.
fn three() -> TempDir {
    let root = TempDir::new().expect("a folder");
    for name in ["map", "q1", "q2"] {
        small_sequence::write(&root.path().join(name), &FRAMES);
    }
    root
}

#[test]
fn two_query_scenes_of_one_name_are_two_scenes() {
    let root = three();
    for frame in [1, 2, 3, 4] {
        let photo = format!("q2/sequences/42/image_0/{frame:06}.png");
        write(root.path().join(photo), "no photo");
    }
    let line = format!(
        "eval map/sequences/42 --query-scene q1/sequences/42 --query-scene q2/sequences/42 {EVAL} --out run"
    );
    let said = run_in(root.path(), &line);
    said.fails(
        3,
        "4 queries were not localised, the first is 000001 ~ q2/sequences/42/image_0/000001.png",
    );
    let results: Vec<QueryResult> = objects(&text(root.path().join("run/results.jsonl")));
    let of = |scene: &str| -> Vec<&QueryResult> {
        results.iter().filter(|one| one.query_scene.as_deref() == Some(scene)).collect()
    };
    let (first, second) = (of("kitti/q1/sequences/42"), of("kitti/q2/sequences/42"));
    assert_eq!((first.len(), second.len(), results.len()), (5, 5, 10));
    assert!(first.iter().all(|one| one.reason.is_none() && one.pose.is_some()));
    let unread =
        |one: &&&QueryResult| one.reason.as_ref().is_some_and(|reason| reason.code.name() == "I1");
    assert_eq!(second.iter().filter(unread).count(), 4);
    // Tables and comparisons keep them apart, and a failure is repeated with its own photos.
    let summary = run_in(root.path(), "results run --table summary").ok().out;
    has(&summary, "kitti/q1/sequences/42 ~ kitti/q2/sequences/42");
    has(&run_in(root.path(), "compare run run").ok().out, "of 10 results in both runs");
    let report = text(root.path().join("run/report.html"));
    for (scene, of_scene) in [("q1", first), ("q2", second)] {
        let failed = of_scene.iter().filter(|one| one.grade.is_failure()).count();
        let repeated = format!("--query-scene {scene}/sequences/42 ");
        assert_eq!(report.matches(&repeated).count(), failed, "{scene}");
    }
}

#[test]
fn scenes_with_names_of_their_own_keep_them() {
    let root = three();
    fs::rename(root.path().join("q1/sequences/42"), root.path().join("q1/sequences/7"))
        .expect("is there");
    fs::copy(root.path().join("q1/poses/42.txt"), root.path().join("q1/poses/7.txt"))
        .expect("is there");
    let line = format!("eval map/sequences/42 --query-scene q1/sequences/7 {EVAL} --out run");
    run_in(root.path(), &line).ok();
    let results: Vec<QueryResult> = objects(&text(root.path().join("run/results.jsonl")));
    assert_eq!(results[0].scene, "kitti/42");
    assert_eq!(results[0].query_scene.as_deref(), Some("kitti/7"));
}

#[test]
fn two_map_scenes_of_one_name_are_two_and_one_scene_twice_is_refused() {
    let root = three();
    let line = format!("eval q1/sequences/42 q2/sequences/42 {EVAL} --out run");
    run_in(root.path(), &line).ok();
    let run = read_run(&root.path().join("run")).expect("our own");
    let labels: Vec<&str> = run.pairs.iter().map(|pair| pair.scene.as_str()).collect();
    assert_eq!(labels, ["kitti/q1/sequences/42", "kitti/q2/sequences/42"]);
    refused(
        root.path(),
        &format!(
            "
            2 | eval map/sequences/42 ./map/sequences/42/ {EVAL} | kitti/42 is given twice ~ ./map
            2 | eval map/sequences/42 --query-scene q1/sequences/42 --query-scene q2/../q1/sequences/42 {EVAL} | given twice
            "
        ),
    );
}

#[test]
fn a_run_goes_on_whatever_its_scene_is_called_and_wherever_it_is_started() {
    let root = three();
    let path = root.path();
    run_in(path, &format!("eval map/sequences/42 {EVAL} --out run")).ok();
    let whole = text(path.join("run/results.jsonl"));
    let described = text(path.join("run/run.toml"));
    let (first, _) = whole.split_once('\n').expect("lines");
    for (folder, scene, out) in [
        (".", "./map/sequences/42", "run"),
        (".", "map/sequences/42/", "run"),
        ("map", "sequences/42", "../run"),
        ("q1/sequences", "../../map/sequences/42", "../../run"),
        ("map/sequences/42", ".", "../../../run"),
    ] {
        write(path.join("run/results.jsonl"), format!("{first}\n"));
        let line = format!("eval {scene} {EVAL} --out {out} --resume");
        run_in(&path.join(folder), &line).ok();
        assert_eq!(text(path.join("run/results.jsonl")), whole);
        assert_eq!(text(path.join("run/run.toml")), described);
    }
    let other = run_in(path, &format!("eval q1/sequences/42 {EVAL} --out run --resume"));
    other.fails(2, "other settings ~ q1/sequences/42");
}

#[test]
fn a_moved_run_folder_opens_with_the_scenes_beside_it() {
    let root = three();
    let line =
        format!("eval map/sequences/42 --query-scene q1/sequences/42 {EVAL} --out runs/first");
    run_in(root.path(), &line).ok();
    let moved = TempDir::new().expect("a folder");
    for name in ["map", "q1", "runs"] {
        fs::rename(root.path().join(name), moved.path().join(name)).expect("one disk");
    }
    let written = |folder: &Path, run: &str| {
        run_in(folder, &format!("results {run} --as html --out page.html")).ok();
        text(folder.join("page.html"))
    };
    for (folder, run) in [("", "runs/first"), ("q2", "../runs/first")] {
        let folder = moved.path().join(folder);
        fs::create_dir_all(&folder).expect("writable");
        assert!(!written(&folder, run).contains("There are no photos"), "{run}");
    }
    // Without its scenes, it says so.
    fs::rename(moved.path().join("map"), moved.path().join("gone")).expect("one disk");
    has(&written(moved.path(), "runs/first"), "There are no photos: map/sequences/42");
}

#[test]
fn each_scene_has_a_folder_of_its_own_among_the_runs() {
    let root = three();
    let sequences = root.path().join("map/sequences");
    let [own, foreign] = ["42", "日本 é"].map(|name| sequences.join(name));
    for (folder, scene, run) in
        [(&own, ".", "runs/42"), (&own, "../42", "runs/42"), (&sequences, "42/../42/.", "runs/42")]
    {
        let _ = fs::remove_dir_all(folder.join("runs"));
        run_in(folder, &format!("eval {scene} {EVAL} --limit 1")).ok();
        let there = fs::read_dir(folder.join("runs")).expect("the runs").flatten();
        let there: Vec<_> = there.map(|entry| entry.file_name()).collect();
        assert_eq!(there.len(), 1, "{there:?}");
        assert!(folder.join("runs").join(&there[0]).join("run.toml").is_file(), "{run}");
    }
    fs::rename(&own, &foreign).expect("one disk");
    fs::copy(root.path().join("map/poses/42.txt"), root.path().join("map/poses/日本 é.txt"))
        .expect("is there");
    run_in(&sequences, &format!("eval '日本 é' {EVAL} --limit 1")).ok();
    assert!(sequences.join("runs/日本-é/run.toml").is_file());
}
