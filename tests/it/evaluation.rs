//! `posescope eval` and what follows it: run folders, shards, resumed runs, gates, diff, export.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use posescope::diagnosis::Code;
use posescope::image::Photo;
use posescope::localize::{LocalizeObserver, NoObserver, QueryResult, Selection};
use posescope::measure::{Plot, RunResults, TableName};
use posescope::method::Method;
use posescope::params::Params;
use posescope::run::{
    Draw, Evaluation, Limit, Plan, Protocol, RUN_SCHEMA, Reference, RunFile, RunFolder,
    RunObserver, Scenes, read_results, read_run,
};
use posescope::scene::street::{Size, Street};
use posescope::scene::{Scene, SceneError, SceneSize};
use tempfile::TempDir;

use crate::binary::{background_in, has, lines, objects, refused, run_in, text, write};
use crate::damage::open;
use crate::planted::{Fault, Planted};
use crate::small_sequence::SmallSequence;
use crate::walls_scene::{TwoCameras, Walls};
use crate::written::Written as _;

const FRAMES: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

/// Two methods over all frames of the sequence, with two fused references each. Nothing is recorded.
const EVAL: &str = "eval sequences/42 --method fb,mi --reference random:2 --radius 3 --seed 1 \
                    --keep-failures 0 --out";

/// The same, but hardly a pose is within a micrometre, so that many queries fail; three are recorded.
const STRICT: &str = "eval sequences/42 --method fb,mi --reference random:2 --radius 3 --seed 1 \
                      --right 0.000001m,5deg --keep-failures 3 --out";

/// The attributes of `junit.xml` but for the times.
fn without_times(bytes: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(bytes);
    let words = text.split(' ').filter(|word| !word.starts_with("time=\""));
    words.collect::<Vec<_>>().join(" ").into_bytes()
}

/// Every file of a run that holds no time and is no recording, and the names of its recordings.
fn timeless(folder: &Path) -> (BTreeMap<PathBuf, Vec<u8>>, BTreeSet<OsString>) {
    let names = |folder: &Path| -> BTreeSet<OsString> {
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        entries.map(|entry| entry.file_name()).collect()
    };
    let files = names(folder).into_iter().map(PathBuf::from);
    let is_timeless =
        |name: &PathBuf| !["timings.jsonl", "failures"].map(Path::new).contains(&&**name);
    let read = |name: PathBuf| {
        let bytes = fs::read(folder.join(&name)).expect("readable");
        let is_timed = name == Path::new("junit.xml");
        let bytes = if is_timed { without_times(&bytes) } else { bytes };
        (name, bytes)
    };
    (files.filter(is_timeless).map(read).collect(), names(&folder.join("failures")))
}

#[track_caller]
fn assert_same(left: &Path, right: &Path) {
    let ((left, recorded), (right, others)) = (timeless(left), timeless(right));
    assert!(left.keys().eq(right.keys()), "{:?} {:?}", left.keys(), right.keys());
    for (name, bytes) in &left {
        assert!(right[name] == *bytes, "{} differs", name.display());
    }
    assert_eq!(recorded, others);
}

#[test]
fn a_run_folder_holds_what_is_promised() {
    let sequence = SmallSequence::of(&FRAMES);
    let out = sequence.path().join("run");
    let said = sequence.run(&format!("{STRICT} run")).ok();
    has(
        &said.out,
        "method ~ wrong ~ trusted ~ mostly ~ Right: within ~ Failures: ~ posescope view run --query ~ --method ~ Report: run/report.html",
    );
    assert!(said.out.lines().all(|line| line.chars().count() <= 100), "{}", said.out);
    let (files, recordings) = timeless(&out);
    let expected = "junit.xml report.html results.jsonl run.toml summary.json";
    assert!(files.keys().eq(expected.split(' ').map(Path::new)), "{:?}", files.keys());
    assert!(out.join("timings.jsonl").is_file());
    // Tables and plots follow from the results.
    let run = RunResults::read(&out).expect("a run");
    let [summary] = TableName::Summary.of(&run).try_into().expect("one table");
    has(&summary.to_markdown(), "| success (%) |");
    assert_eq!(summary.to_csv().lines().count(), 1 + 2);
    has(&summary.to_latex(), "\\begin{tabular}");
    has(&Plot::Recall.svg(&run).expect("the truth is known"), "kitti/42");
    let results = run.results;
    assert_eq!(results.len(), 2 * FRAMES.len());
    let order = |at: usize| (results[at].query.as_str(), results[at].method.name());
    let expected = [("000000", "fb"), ("000000", "mi"), ("000001", "fb")];
    assert_eq!([order(0), order(1), order(2)], expected);
    for result in &results {
        assert_eq!(result.fusion.map(|fusion| fusion.name), Some("r-wavg"));
        let alone = result.per_reference.as_ref().expect("several were fused");
        assert_eq!(alone.len(), 2);
        assert!(alone.iter().all(|one| one.per_reference.is_none()));
    }
    let junit = sequence.text("run/junit.xml");
    assert_eq!(junit.matches("<testcase ").count(), results.len());
    assert_eq!(junit.matches(" classname=\"kitti/42 fb\" time=\"").count(), FRAMES.len());
    let failed = results.iter().filter(|result| result.grade.is_failure());
    let failed = failed.map(|result| format!("{}-{}.rrd", result.query, result.method).into());
    let failed: Vec<OsString> = failed.collect();
    assert!(failed.len() > 3, "{failed:?}");
    assert_eq!(junit.matches("<failure ").count(), failed.len());
    // The first failures are recorded.
    assert!(recordings.iter().eq(&failed[..3]), "{recordings:?}");
    has(&said.err, &format!("{} failures were not recorded", failed.len() - 3));
}

#[test]
fn named_references_are_those_of_every_query_but_themselves() {
    let sequence = SmallSequence::of(&FRAMES);
    let line = "eval sequences/42 --method fb --reference 3 --reference 5 --query 2 --query 3 --radius 3 \
                --keep-failures 0 --out run";
    sequence.run(line).ok();
    let run = RunResults::read(&sequence.path().join("run")).expect("a run");
    let found: Vec<(&str, Vec<&str>)> = run
        .results
        .iter()
        .map(|one| (&*one.query, one.references.iter().map(String::as_str).collect()))
        .collect();
    assert_eq!(
        found,
        [("000002", vec!["000003", "000005"]), ("000003", vec!["000005"])],
        "two are fused, and no photo is its own reference"
    );
    has(&sequence.text("run/run.toml"), "reference = [\"3\", \"5\"]");
    refused(sequence.path(), "3 | eval sequences/42 --method fb --reference 77 --out other | 77");
}

#[test]
fn threads_kills_and_shards_make_no_difference() {
    let sequence = SmallSequence::of(&FRAMES);
    let folder = |name: &str| sequence.path().join(name);
    sequence.run(&format!("{STRICT} whole --threads 1")).ok();
    let results = |name: &str| folder(name).join("results.jsonl");
    let all = lines(results("whole"));
    // Killed as soon as it has results of its own, queries away from the end.
    let line = format!("{STRICT} killed --threads 2 --resume");
    for _ in 0..2 {
        let before = lines(results("killed"));
        let mut child = background_in(sequence.path(), &line);
        while lines(results("killed")) <= before {
            assert!(child.try_wait().expect("it is ours").is_none(), "it ended");
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        child.kill().expect("it may be killed");
        assert!(!child.wait().expect("it ends").success(), "it was not hit");
        assert!(lines(results("killed")) < all);
    }
    sequence.run(&line).ok();
    assert_same(&folder("whole"), &folder("killed"));
    // All parts at once, each a process of its own.
    sequence.run(&format!("{EVAL} plain")).ok();
    let part = |part| format!("{EVAL} part-{part} --shard {part}/2");
    let child = background_in(sequence.path(), &part(1));
    sequence.run(&part(2)).ok();
    assert!(child.wait_with_output().expect("it ends").status.success());
    sequence.run("eval merge --out merged part-1 part-2").ok();
    assert_same(&folder("plain"), &folder("merged"));
}

#[test]
fn what_doctor_says_of_a_failing_scene_is_a_finding_of_the_run_and_of_its_merged_parts() {
    let root = TempDir::new().expect("a temporary folder");
    let street = Street::new("overcast", Size::Half).expect("is built in");
    Planted::every(&street, Fault::InversePose, 0..12, 1).write_to(&root.path().join("inverse"));
    let run = |line: &str| run_in(root.path(), line).ok();
    let eval = "eval inverse --limit 8 --method fb --keep-failures 0 --out";
    run(&format!("{eval} whole"));
    let summary = text(root.path().join("whole/summary.json"));
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    let found = &summary["findings"][0];
    assert_eq!((&found["doctor"], &found["about"]), (&true.into(), &"poses".into()), "{found}");
    // With two queries each, no part alone knows that the scene fails often.
    for part in 1..=4 {
        run(&format!("{eval} part-{part} --shard {part}/4"));
    }
    run("eval merge --out merged part-1 part-2 part-3 part-4");
    assert_same(&root.path().join("whole"), &root.path().join("merged"));
}

#[test]
fn a_torn_line_is_cut_off() {
    let sequence = SmallSequence::of(&FRAMES[..4]);
    sequence.run(&format!("{EVAL} run")).ok();
    let out = sequence.path().join("run");
    let run = read_run(&out).expect("our own");
    let [whole, timings] =
        ["results", "timings"].map(|of| sequence.text(&format!("run/{of}.jsonl")));
    let ends = whole.match_indices('\n').map(|(at, _)| at + 1);
    // A query has two results, which are written together.
    let ends: Vec<usize> = [0].into_iter().chain(ends).step_by(2).collect();
    for length in [0, 1, whole.len() / 3, whole.len() - 1] {
        write(out.join("results.jsonl"), &whole[..length]);
        write(out.join("timings.jsonl"), &timings);
        RunFolder::resume(&out, &run).expect("our own");
        let end = ends.iter().rev().find(|end| **end <= length);
        assert!(sequence.text("run/results.jsonl") == whole[..*end.expect("is there")]);
    }
}

/// Versions before did not write all parameters.
#[test]
fn a_run_whose_description_lacks_a_parameter_goes_on_and_compares() {
    let sequence = SmallSequence::of(&FRAMES[..3]);
    sequence.run(&format!("{EVAL} whole")).ok();
    sequence.run(&format!("{EVAL} old")).ok();
    let text = sequence.text("old/run.toml");
    let unknown =
        ["min_trials", "em_iterations", "loss", "loss_scale"].map(|name| format!("{name} = "));
    let known = |line: &&str| !unknown.iter().any(|name| line.starts_with(name));
    let fewer: Vec<&str> = text.lines().filter(known).collect();
    // FB has them, and so has the method with another feature.
    assert_eq!(fewer.len() + 8, text.lines().count(), "{text}");
    write(sequence.path().join("old/run.toml"), fewer.join("\n") + "\n");
    write(sequence.path().join("old/results.jsonl"), "");
    sequence.run(&format!("{EVAL} old --resume")).ok();
    assert!(sequence.text("whole/results.jsonl") == sequence.text("old/results.jsonl"));
    sequence.run("compare whole old").ok();
    let said = sequence.run(&format!("{EVAL} old --resume --set fb.min_trials=7"));
    said.fails(2, "other settings ~ min_trials = 7");
}

#[test]
fn a_folder_with_something_else_in_it_is_left_alone() {
    let sequence = SmallSequence::of(&FRAMES[..3]);
    sequence.run(&format!("{EVAL} run")).ok();
    let table = format!(
        "
        2 | {EVAL} sequences | not empty ~ --out
        2 | {EVAL} sequences --resume | not empty ~ --out
        2 | {EVAL} run | not empty ~ --resume
        2 | {EVAL} run --resume --failure-radius 7 | other settings ~ failure-radius = 7.0
        "
    );
    refused(sequence.path(), &table);
}

#[test]
fn parts_that_do_not_make_a_whole_are_refused() {
    let sequence = SmallSequence::of(&FRAMES[..4]);
    for (name, words) in [
        ("one", "--shard 1/2"),
        ("two", "--shard 2/2"),
        ("other", "--shard 2/2 --failure-radius 7"),
    ] {
        sequence.run(&format!("{EVAL} {name} {words}")).ok();
    }
    let text = sequence.text("two/results.jsonl");
    let cut = text.split_inclusive('\n').next().expect("a line");
    write(sequence.path().join("two/results.jsonl"), cut);
    refused(
        sequence.path(),
        "
        3 | eval merge --out merged one | in none of the parts
        2 | eval merge --out merged one other | other settings
        3 | eval merge --out merged one two | 0 of 2 queries ~ --resume
        ",
    );
}

#[test]
fn gates_and_regressions_decide_the_exit_code() {
    let sequence = SmallSequence::of(&FRAMES[..4]);
    let good = "--failure-radius 100 --gate 'success@mi >= 0.5' --right 100m,180deg";
    sequence.run(&format!("{EVAL} good {good}")).ok();
    let table = format!(
        "
        1 | {EVAL} gated --gate 'recall@0.000001m,5deg@mi > 0.5' | gate ~ recall ~ failed: 0.
        2 | {EVAL} wrong --gate 'success > 1' | --help
        1 | {EVAL} bad --right 0.000001m,5deg --baseline good | broken since
        1 | compare good bad | queries broke
        3 | compare good nowhere | not a run folder
        "
    );
    refused(sequence.path(), &table);
    sequence.run("compare good good").ok();
    sequence.run("compare bad good --save diff.rrd").ok();
    let recording = fs::metadata(sequence.path().join("diff.rrd"));
    assert!(recording.is_ok_and(|file| file.len() > 1000));
}

#[test]
fn exports_hold_the_poses_and_say_what_they_cannot_hold() {
    let sequence = SmallSequence::of(&FRAMES[..4]);
    sequence.run(&format!("{EVAL} run")).ok();
    sequence.run(&format!("{EVAL} partly --query 2 --query 3")).ok();
    let export = |format: &str| {
        let line = format!("results run --where 'method = mi' --as {format}");
        sequence.run(&line).ok().out
    };
    let numbers = |text: &str, line: usize| -> Vec<f64> {
        let words = text.lines().nth(line).expect("a line per pose").split(' ');
        words.map(|word| word.parse().expect("a number")).collect()
    };
    let results: Vec<QueryResult> = objects(&sequence.text("run/results.jsonl"));
    let of_mi = results.iter().filter(|result| result.method == Method::MI);
    let second = of_mi.skip(1).find_map(|result| result.pose.as_ref());
    let position = second.expect("a pose").position_m;
    // Behind a header.
    let line = numbers(&export("tum"), 2);
    assert_eq!(line[..4], [0.1, position[0], position[1], position[2]]);
    let kitti = export("kitti");
    assert_eq!(kitti.lines().count(), 4);
    let line = numbers(&kitti, 1);
    assert_eq!([line[3], line[7], line[11]], position);
    let vloc = export("vloc");
    let line = vloc.lines().nth(1).expect("a line");
    assert!(line.starts_with("000001 "), "{line}");
    let ros = export("ros");
    let messages: Vec<&str> = ros.split_terminator("---\n").collect();
    assert_eq!(messages.len(), 4);
    has(messages[1], "sec: 0\n    nanosec: 100000000\n  frame_id: map");
    has(messages[1], &format!("position:\n      x: {}\n      y: {}\n", position[0], position[1]));
    let (_, covariance) = messages[1].split_once("covariance: [").expect("a covariance");
    let covariance = covariance.split_once(']').expect("its end").0.split(", ");
    let covariance: Vec<f64> = covariance.map(|word| word.parse().expect("a number")).collect();
    assert_eq!(covariance.len(), 36);
    assert!((0..6).all(|axis| covariance[7 * axis] > 0.0), "{covariance:?}");
    assert_eq!(export("csv").lines().count(), 5);
    refused(
        sequence.path(),
        "
        2 | results run --as tum | several results ~ --where 'method = fb'
        2 | results run --where 'method = mi' --as colmap | cameras.txt ~ --out
        2 | results partly --where 'method = mi' --as kitti | kitti ~ frame 0 is not a query
        ",
    );
    sequence.run("results run --where 'method = mi' --as colmap --out model").ok();
    let cameras = sequence.text("model/cameras.txt");
    has(&cameras, "1 PINHOLE 160 64 100 100 80.5 32.5");
}

/// A draw of queries, all of them where no limit is set.
fn draw(limit: Option<Limit>) -> Draw<'static> {
    Draw { limit, only: &[], seed: 0 }
}

#[test]
fn a_share_of_the_frames_is_held_out_of_the_references_and_a_number_is_not() {
    let sequence = SmallSequence::of(&(0..12).collect::<Vec<_>>());
    let scene = open(sequence.folder());
    let drawn = |limit: &str| {
        let limit = Some(limit.parse().expect("a limit"));
        draw(limit).pair(0, scene.as_ref(), scene.as_ref()).expect("queries")
    };
    let (share, number) = (drawn("25%"), drawn("3"));
    assert_eq!(share.queries.len(), 3);
    assert_eq!(share.drawn, share.queries);
    assert_eq!(number.queries, share.queries);
    assert!(number.drawn.is_empty());
}

#[test]
fn a_run_describes_the_camera_of_each_query_where_they_have_several() {
    let one = Walls::new();
    let pair = draw(None).pair(0, &one, &one).expect("queries");
    assert!(pair.cameras.is_empty());
    let two = TwoCameras(Walls::new());
    let pair = draw(None).pair(0, &two, &two).expect("queries");
    let widths: Vec<u32> = pair.cameras.iter().map(|camera| camera.width).collect();
    assert_eq!(widths, [240, 120, 240, 240, 240]);
    assert_eq!(pair.camera, pair.cameras[0]);
    assert_ne!(two.fingerprint(), TwoCameras(Walls::new()).0.fingerprint());
}

/// A scene whose photo of one frame makes the program panic.
struct PanickingScene {
    scene: Box<dyn Scene>,
    frame: usize,
}

impl Scene for PanickingScene {
    posescope::inner_scene!(scene: name, frames, intrinsics, pose, time_s, cloud);

    fn has_cloud(&self, frame: usize) -> bool {
        self.scene.has_cloud(frame) && frame != self.frame
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        assert!(frame != self.frame, "a trap\nfor the photo");
        self.scene.photo(frame)
    }
}

struct NoRunObserver(NoObserver);

impl RunObserver for NoRunObserver {
    fn query_observer(&mut self) -> &mut dyn LocalizeObserver {
        &mut self.0
    }
}

#[test]
fn a_query_that_panics_is_a_failed_result_and_the_rest_goes_on() {
    let sequence = SmallSequence::of(&FRAMES[..4]);
    let scene = open(sequence.folder());
    let scenes = Scenes {
        references: vec![Arc::new(PanickingScene { scene, frame: 1 })],
        queries: Vec::new(),
    };
    let references = scenes.references[0].as_ref();
    let run = RunFile {
        schema: RUN_SCHEMA.to_owned(),
        version: "0".to_owned(),
        scenes: vec!["small".to_owned()],
        protocol: Protocol {
            methods: vec![Method::FB, Method::MI],
            references: vec![Reference::Chosen(Selection::Nearest(1))],
            radii_m: vec![3.0],
            ..Protocol::default()
        },
        shard: None,
        pairs: vec![draw(None).pair(0, references, references).expect("queries")],
        inputs: BTreeMap::new(),
        paths: BTreeMap::new(),
        params: Params::default().to_toml().parse().expect("a table"),
    };
    let out = sequence.path().join("run");
    let mut folder = RunFolder::create(&out, &run).expect("a new folder");
    let plan = Plan {
        run,
        scenes,
        params: Params::default(),
        indices: Vec::new(),
        survey: None,
        size: SceneSize::PAPER,
    };
    Evaluation::run(&plan, &mut folder, &mut NoRunObserver(NoObserver))
        .expect("a panic is a result");
    let results = read_results(&out, &plan.run).expect("results");
    assert_eq!(results.len(), 8);
    for result in &results {
        let code = result.reason.as_ref().map(|reason| reason.code);
        if result.query == "000001" {
            let reason = result.reason.as_ref().expect("a reason");
            assert_eq!(reason.code, Code::X9);
            has(&reason.text, "a trap for the photo");
        } else {
            assert_ne!(code, Some(Code::X9), "{result:?}");
        }
    }
}
