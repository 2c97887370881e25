//! `posescope eval` and what follows it: run folders, shards, resumed runs, gates, diff, export.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command as Process, Stdio};
use std::sync::Arc;

use assert_cmd::Command;
use posescope::diagnosis::Code;
use posescope::image::Photo;
use posescope::localize::{LocalizeObserver, NoObserver, QueryResult, Selection};
use posescope::measure::{Plot, RunResults, TableName};
use posescope::method::Method;
use posescope::params::Params;
use posescope::run::{
    Draw, Execution, Protocol, RUN_SCHEMA, Reference, RunFile, RunFolder, RunObserver, Scenes,
    read_results,
};
use posescope::scene::{self, Scene, SceneError};

use crate::binary::{CACHE, posescope};
use crate::small_sequence::SmallSequence;
use crate::walls_scene::{TwoCameras, Walls};

const FRAMES: [usize; 12] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11];

/// Two methods over all frames of the sequence, with two fused references each.
const ASKED: [&str; 8] = [
    "--method",
    "fb,mi",
    "--reference",
    "random:2",
    "--radius",
    "3",
    "--seed",
    "1",
];

fn eval(sequence: &SmallSequence, out: &Path, extra: &[&str]) -> Command {
    let mut command = posescope();
    command.arg("eval").arg(sequence.folder()).args(ASKED);
    command.arg("--out").arg(out).args(extra);
    command
}

fn run(sequence: &SmallSequence, out: &Path, extra: &[&str]) {
    eval(sequence, out, extra).assert().code(0);
}

/// Every file of a run that holds no time and is no recording.
fn timeless(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(&next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_none_or(|extension| extension != "rrd") {
                let name = path.strip_prefix(folder).expect("below").to_owned();
                files.insert(name, fs::read(&path).expect("readable"));
            }
        }
    }
    files.remove(Path::new("timings.jsonl"));
    files
}

fn assert_same(left: &Path, right: &Path) {
    let (left, right) = (timeless(left), timeless(right));
    let names = |files: &BTreeMap<PathBuf, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(&left), names(&right));
    for (name, bytes) in &left {
        assert!(right[name] == *bytes, "{} differs", name.display());
    }
}

#[test]
fn a_run_folder_holds_what_is_promised() {
    let sequence = SmallSequence::of(&FRAMES);
    let out = sequence.path().join("run");
    // Hardly a pose is within a micrometre, so that many queries fail; three are recorded.
    let extra = ["--right", "0.000001m,5deg", "--keep-failures", "3"];
    let output = eval(&sequence, &out, &extra)
        .output()
        .expect("the binary starts");
    assert_eq!(output.status.code(), Some(0));
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(table.contains("success (%)"), "{table}");
    let entries = fs::read_dir(&out).expect("a folder");
    let mut names: Vec<String> = entries
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .into_string()
                .expect("plain")
        })
        .collect();
    names.sort();
    assert_eq!(
        names,
        [
            "failures",
            "junit.xml",
            "report.html",
            "results.jsonl",
            "run.toml",
            "summary.json",
            "timings.jsonl",
        ]
    );
    // Tables and plots follow from the results.
    let run = RunResults::read(&out).expect("a run");
    let [summary] = TableName::Summary.of(&run).try_into().expect("one table");
    assert!(summary.to_markdown().contains("| success (%) |"));
    assert_eq!(summary.to_csv().lines().count(), 1 + 2);
    assert!(summary.to_latex().contains("\\begin{tabular}"));
    let recall = Plot::Recall.svg(&run).expect("the truth is known");
    assert!(recall.contains("kitti/42"), "{recall}");
    let results = run.results;
    assert_eq!(results.len(), 24);
    let order = |at: usize| (results[at].query.as_str(), results[at].method.name());
    let expected = [("000000", "fb"), ("000000", "mi"), ("000001", "fb")];
    assert_eq!([order(0), order(1), order(2)], expected);
    for result in &results {
        assert_eq!(result.fusion.map(|fusion| fusion.name), Some("r-wavg"));
        let alone = result.per_reference.as_ref().expect("several were fused");
        assert_eq!(alone.len(), 2);
        assert!(alone.iter().all(|one| one.per_reference.is_none()));
    }
    let junit = fs::read_to_string(out.join("junit.xml")).expect("text");
    assert_eq!(junit.matches("<testcase ").count(), 24);
    let failed: Vec<String> = results
        .iter()
        .filter(|result| result.grade.is_failure())
        .map(|result| format!("{}-{}", result.query, result.method))
        .collect();
    assert!(failed.len() > 3, "{failed:?}");
    assert_eq!(junit.matches("<failure ").count(), failed.len());
    // The first failures are recorded.
    for name in &failed[..3] {
        assert!(out.join(format!("failures/{name}.rrd")).exists(), "{name}");
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let count = format!("{} failures were not recorded", failed.len() - 3);
    assert!(said.contains(&count), "{said}");
    assert_eq!(
        fs::read_dir(out.join("failures"))
            .expect("a folder")
            .count(),
        3
    );
}

#[test]
fn threads_and_shards_make_no_difference() {
    let sequence = SmallSequence::of(&FRAMES);
    let folder = |name: &str| sequence.path().join(name);
    let whole = folder("whole");
    run(&sequence, &whole, &["--threads", "1"]);
    let other = folder("other");
    run(&sequence, &other, &["--threads", "2"]);
    assert_same(&whole, &other);
    // All parts at once, each a process of its own.
    let parts = [1, 2, 3].map(|part| {
        let out = folder(&format!("part-{part}"));
        let child = background(&sequence, &out, &["--shard", &format!("{part}/3")]);
        (out, child)
    });
    let parts = parts.map(|(out, mut child)| {
        assert!(child.wait().expect("it ends").success());
        out
    });
    let merged = folder("merged");
    posescope()
        .args(["eval", "merge", "--out"])
        .arg(&merged)
        .args(&parts)
        .assert()
        .code(0);
    assert_same(&whole, &merged);
}

fn background(sequence: &SmallSequence, out: &Path, extra: &[&str]) -> std::process::Child {
    Process::new(assert_cmd::cargo::cargo_bin!("posescope"))
        .env("POSESCOPE_CACHE", CACHE)
        .arg("eval")
        .arg(sequence.folder())
        .args(ASKED)
        .arg("--out")
        .arg(out)
        .args(extra)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the binary starts")
}

/// Whole lines in a file that may not be there yet.
fn lines(path: &Path) -> usize {
    let bytes = fs::read(path).unwrap_or_default();
    bytes.iter().filter(|byte| **byte == b'\n').count()
}

#[test]
fn a_killed_run_goes_on_to_the_same_bytes() {
    let sequence = SmallSequence::of(&FRAMES);
    let (whole, killed) = (
        sequence.path().join("whole"),
        sequence.path().join("killed"),
    );
    // Hardly a pose is within a micrometre, so that more fail than are recorded.
    let extra = [
        "--right",
        "0.000001m,5deg",
        "--keep-failures",
        "5",
        "--resume",
        "--threads",
        "1",
    ];
    run(&sequence, &whole, &extra);
    let (results, all) = (
        killed.join("results.jsonl"),
        lines(&whole.join("results.jsonl")),
    );
    // Each is killed as soon as it has results of its own, queries away from the end.
    for _ in 0..3 {
        let before = lines(&results);
        let mut child = background(&sequence, &killed, &extra);
        while lines(&results) <= before {
            assert!(child.try_wait().expect("it is ours").is_none(), "it ended");
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        child.kill().expect("it may be killed");
        assert!(!child.wait().expect("it ends").success(), "it was not hit");
        assert!(lines(&results) < all);
    }
    run(&sequence, &killed, &extra);
    assert_same(&whole, &killed);
    let recorded = |run: &Path| {
        let entries = fs::read_dir(run.join("failures")).expect("a folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name());
        names.collect::<std::collections::BTreeSet<_>>()
    };
    assert_eq!(recorded(&whole).len(), 5);
    assert_eq!(recorded(&whole), recorded(&killed));
}

/// Versions before did not write all parameters.
#[test]
fn a_run_whose_description_lacks_a_parameter_goes_on_and_compares() {
    let sequence = SmallSequence::of(&FRAMES[..4]);
    let (whole, old) = (sequence.path().join("whole"), sequence.path().join("old"));
    run(&sequence, &whole, &[]);
    run(&sequence, &old, &[]);
    let file = old.join("run.toml");
    let text = fs::read_to_string(&file).expect("text");
    let known = |line: &&str| {
        let unknown = ["min_trials", "em_iterations", "loss", "loss_scale"];
        !unknown
            .iter()
            .any(|name| line.starts_with(&format!("{name} = ")))
    };
    let fewer: Vec<&str> = text.lines().filter(known).collect();
    // FB has them, and so has the method with another feature.
    assert_eq!(fewer.len() + 8, text.lines().count(), "{text}");
    fs::write(&file, fewer.join("\n") + "\n").expect("writable");
    fs::write(old.join("results.jsonl"), "").expect("writable");
    run(&sequence, &old, &["--resume"]);
    let results = |folder: &Path| fs::read(folder.join("results.jsonl")).expect("results");
    assert!(results(&whole) == results(&old));
    posescope()
        .arg("compare")
        .args([&whole, &old])
        .assert()
        .code(0);
    expect_line(
        &mut eval(&sequence, &old, &["--resume", "--set", "fb.min_trials=7"]),
        2,
        &["asked for otherwise", "min_trials = 7"],
    );
}

#[test]
fn a_torn_line_is_cut_off() {
    let sequence = SmallSequence::of(&FRAMES[..4]);
    let (whole, torn) = (sequence.path().join("whole"), sequence.path().join("torn"));
    run(&sequence, &whole, &[]);
    run(&sequence, &torn, &[]);
    let results = torn.join("results.jsonl");
    let bytes = fs::read(&results).expect("readable");
    for length in [0, 1, bytes.len() / 3, bytes.len() - 1] {
        fs::write(&results, &bytes[..length]).expect("writable");
        run(&sequence, &torn, &["--resume"]);
        assert_same(&whole, &torn);
    }
}

/// Runs and expects an exit code and one line with all of these words.
fn expect_line(command: &mut Command, code: i32, words: &[&str]) {
    let output = command.output().expect("the binary starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{message}");
    let line = message.trim_end().lines().last().unwrap_or_default();
    for word in words {
        assert!(line.contains(word), "`{word}` is missing in: {message}");
    }
}

#[test]
fn a_folder_with_something_else_in_it_is_left_alone() {
    let sequence = SmallSequence::of(&FRAMES[..4]);
    let out = sequence.path().join("run");
    expect_line(
        &mut eval(&sequence, &sequence.path().join("sequences"), &[]),
        2,
        &["not empty", "--out"],
    );
    expect_line(
        &mut eval(&sequence, &sequence.path().join("sequences"), &["--resume"]),
        2,
        &["not empty", "--out"],
    );
    run(&sequence, &out, &[]);
    expect_line(
        &mut eval(&sequence, &out, &[]),
        2,
        &["not empty", "--resume"],
    );
    expect_line(
        &mut eval(&sequence, &out, &["--resume", "--failure-radius", "7"]),
        2,
        &["asked for otherwise", "failure-radius = 7.0"],
    );
}

#[test]
fn parts_that_do_not_make_a_whole_are_refused() {
    let sequence = SmallSequence::of(&FRAMES[..4]);
    let part = |name: &str, shard: &str, extra: &[&str]| {
        let out = sequence.path().join(name);
        let mut all = vec!["--shard", shard];
        all.extend(extra);
        run(&sequence, &out, &all);
        out
    };
    let merge = |parts: &[&PathBuf]| {
        let mut command = posescope();
        command
            .args(["eval", "merge", "--out"])
            .arg(sequence.path().join("merged"));
        command.args(parts);
        command
    };
    let (one, two) = (part("one", "1/2", &[]), part("two", "2/2", &[]));
    expect_line(&mut merge(&[&one]), 3, &["in none of the parts"]);
    let other = part("other", "2/2", &["--failure-radius", "7"]);
    expect_line(&mut merge(&[&one, &other]), 2, &["asked for otherwise"]);
    let results = two.join("results.jsonl");
    let text = fs::read_to_string(&results).expect("text");
    let cut = text.lines().next().expect("a line");
    fs::write(&results, format!("{cut}\n")).expect("writable");
    expect_line(
        &mut merge(&[&one, &two]),
        3,
        &["0 of 2 queries", "--resume"],
    );
}

#[test]
fn gates_and_regressions_decide_the_exit_code() {
    let sequence = SmallSequence::of(&FRAMES[..4]);
    let folder = |name: &str| sequence.path().join(name);
    let (good, bad) = (folder("good"), folder("bad"));
    run(
        &sequence,
        &good,
        &[
            "--failure-radius",
            "100",
            "--gate",
            "success@mi >= 0.5",
            "--right",
            "100m,180deg",
        ],
    );
    expect_line(
        &mut eval(
            &sequence,
            &folder("gated"),
            &["--gate", "recall@0.000001m,5deg@mi > 0.5"],
        ),
        1,
        &["gate", "recall", "failed: 0."],
    );
    expect_line(
        &mut eval(&sequence, &folder("wrong"), &["--gate", "success > 1"]),
        2,
        &["--help"],
    );
    let baseline = good.to_str().expect("a plain path");
    let extra = ["--right", "0.000001m,5deg", "--baseline", baseline];
    expect_line(&mut eval(&sequence, &bad, &extra), 1, &["broken since"]);
    let diff = |a: &Path, b: &Path| {
        let mut command = posescope();
        command.arg("compare").arg(a).arg(b);
        command
    };
    diff(&good, &good).assert().code(0);
    expect_line(&mut diff(&good, &bad), 1, &["queries broke"]);
    let recording = folder("diff.rrd");
    diff(&bad, &good)
        .arg("--save")
        .arg(&recording)
        .assert()
        .code(0);
    assert!(fs::metadata(&recording).is_ok_and(|file| file.len() > 1000));
    expect_line(&mut diff(&good, &folder("nowhere")), 3, &["no run here"]);
}

#[test]
fn exports_hold_the_poses_and_say_what_they_cannot_hold() {
    let sequence = SmallSequence::of(&FRAMES[..4]);
    let out = sequence.path().join("run");
    run(&sequence, &out, &[]);
    let export = |format: &str, extra: &[&str]| {
        let mut command = posescope();
        command
            .arg("results")
            .arg(&out)
            .args(["--as", format])
            .args(extra);
        command
    };
    let text = |format: &str| {
        let output = export(format, &["--where", "method = mi"])
            .output()
            .expect("starts");
        assert_eq!(output.status.code(), Some(0), "{format}");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let results: Vec<QueryResult> = read_results(&out)
        .expect("results")
        .collect::<Result<_, _>>()
        .expect("one per line");
    let of_mi: Vec<_> = results
        .iter()
        .filter(|result| result.method == Method::MI)
        .collect();
    let position = of_mi[1].pose.as_ref().expect("a pose").position_m;
    let tum = text("tum");
    let line: Vec<f64> = tum
        .lines()
        .nth(2)
        .expect("a header and two poses")
        .split(' ')
        .map(|number| number.parse().expect("a number"))
        .collect();
    assert_eq!(line[..4], [0.1, position[0], position[1], position[2]]);
    let kitti = text("kitti");
    assert_eq!(kitti.lines().count(), 4);
    let line: Vec<f64> = kitti
        .lines()
        .nth(1)
        .expect("a line per frame")
        .split(' ')
        .map(|number| number.parse().expect("a number"))
        .collect();
    assert_eq!([line[3], line[7], line[11]], position);
    // World to camera: the camera looks along the road, so that its z is minus the position's.
    let vloc = text("vloc");
    let line: Vec<&str> = vloc.lines().nth(1).expect("a line").split(' ').collect();
    assert_eq!(line[0], "000001");
    assert_eq!(text("csv").lines().count(), 5);
    expect_line(
        &mut export("tum", &[]),
        2,
        &["several results", "--where 'method = fb'"],
    );
    expect_line(
        &mut export("colmap", &["--where", "method = mi"]),
        2,
        &["cameras.txt", "--out"],
    );
    let model = sequence.path().join("model");
    let arguments = [
        "--where",
        "method = mi",
        "--out",
        model.to_str().expect("plain"),
    ];
    export("colmap", &arguments).assert().code(0);
    let camera = fs::read_to_string(model.join("cameras.txt")).expect("text");
    assert!(
        camera.contains("1 PINHOLE 160 64 100 100 80.5 32.5"),
        "{camera}"
    );

    let partly = sequence.path().join("partly");
    run(&sequence, &partly, &["--query", "2", "--query", "3"]);
    let mut command = posescope();
    command
        .arg("results")
        .arg(&partly)
        .args(["--as", "kitti", "--where", "method = mi"]);
    expect_line(
        &mut command,
        2,
        &["kitti", "frame 0 is none of the queries"],
    );
}

#[test]
fn a_share_of_the_frames_is_held_out_of_the_references_and_a_number_is_not() {
    let sequence = SmallSequence::of(&FRAMES);
    let folder = sequence.folder();
    let scene = scene::open(folder.to_str().expect("plain"), None).expect("a scene");
    let drawn = |limit: &str| {
        let draw = Draw {
            limit: Some(limit.parse().expect("a limit")),
            only: &[],
            seed: 0,
        };
        draw.pair(0, scene.as_ref(), scene.as_ref())
            .expect("queries")
    };
    let (share, number) = (drawn("25%"), drawn("3"));
    assert_eq!(share.queries.len(), 3);
    assert_eq!(share.drawn, share.queries);
    assert_eq!(number.queries, share.queries);
    assert!(number.drawn.is_empty());
}

#[test]
fn a_run_describes_the_camera_of_each_query_where_they_have_several() {
    let draw = Draw {
        limit: None,
        only: &[],
        seed: 0,
    };
    let one = Walls::new();
    let pair = draw.pair(0, &one, &one).expect("queries");
    assert!(pair.cameras.is_empty());
    let two = TwoCameras(Walls::new());
    let pair = draw.pair(0, &two, &two).expect("queries");
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
    let folder = sequence.folder();
    let scene = scene::open(folder.to_str().expect("plain"), None).expect("a scene");
    let scenes = Scenes {
        references: vec![Arc::new(PanickingScene { scene, frame: 1 })],
        queries: Vec::new(),
    };
    let draw = Draw {
        limit: None,
        only: &[],
        seed: 0,
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
        pairs: vec![draw.pair(0, references, references).expect("queries")],
        inputs: BTreeMap::new(),
        params: Params::default().to_toml().parse().expect("a table"),
    };
    let out = sequence.path().join("run");
    let mut folder = RunFolder::create(&out, &run).expect("a new folder");
    let execution = Execution {
        run: &run,
        scenes: &scenes,
        params: &Params::default(),
        indices: &[],
    };
    execution
        .run_remaining(&mut folder, &mut NoRunObserver(NoObserver))
        .expect("a panic is a result");
    let results: Vec<QueryResult> = read_results(&out)
        .expect("results")
        .collect::<Result<_, _>>()
        .expect("one per line");
    assert_eq!(results.len(), 8);
    for result in &results {
        let code = result.reason.as_ref().map(|reason| reason.code);
        if result.query == "000001" {
            let reason = result.reason.as_ref().expect("a reason");
            assert_eq!(reason.code, Code::X9);
            assert!(
                reason.text.contains("a trap for the photo"),
                "{}",
                reason.text
            );
        } else {
            assert_ne!(code, Some(Code::X9), "{result:?}");
        }
    }
}
