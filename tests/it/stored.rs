//! Files that an earlier program wrote, and what is wrong in a file that somebody edited.
//!
//! The files in `tests/fixtures` were written before results and sessions named their methods,
//! fusions and choices by types.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;

use crate::binary::posescope;
use crate::small_sequence::SmallSequence;

const FIXTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures");

/// A sequence with a finished run over its three frames, which an earlier program made.
fn earlier_run() -> (SmallSequence, PathBuf) {
    let sequence = SmallSequence::of(&[0, 1, 2]);
    let run = sequence.path().join("run");
    fs::create_dir(&run).expect("writable");
    for file in ["run.toml", "results.jsonl", "timings.jsonl"] {
        let from = Path::new(FIXTURES).join("run-1").join(file);
        fs::copy(from, run.join(file)).expect("writable");
    }
    (sequence, run)
}

/// What the earlier run was asked, from the folder of the sequence.
fn eval(sequence: &SmallSequence, out: &Path) -> Command {
    let mut command = posescope();
    command
        .current_dir(sequence.path())
        .args(["eval", "sequences/42", "--format", "kitti"])
        .args(["--method", "fb,mi", "--reference", "random:2", "-q"])
        .args(["--radius", "2", "--prior", "3", "--seed", "1"])
        .args(["--set", "fb.ratio=0.75", "--out"])
        .arg(out);
    command
}

#[test]
fn a_run_of_an_earlier_program_is_resumed() {
    let (sequence, run) = earlier_run();
    // Another version is another run.
    let file = run.join("run.toml");
    let text = fs::read_to_string(&file).expect("text");
    let version = format!("version = \"{}\"", env!("CARGO_PKG_VERSION"));
    fs::write(&file, text.replacen("version = \"0.1.0\"", &version, 1)).expect("writable");
    let results = fs::read_to_string(run.join("results.jsonl")).expect("text");
    let first: String = results.lines().take(2).map(|l| format!("{l}\n")).collect();
    fs::write(run.join("results.jsonl"), &first).expect("writable");
    eval(&sequence, &run).arg("--resume").assert().code(0);
    let resumed = fs::read_to_string(run.join("results.jsonl")).expect("text");
    assert_eq!(resumed.lines().count(), 6);
    assert!(resumed.starts_with(&first));
    assert!(run.join("summary.json").exists());
}

#[test]
fn a_run_of_an_earlier_program_serves_as_baseline_and_is_exported() {
    let (sequence, baseline) = earlier_run();
    let out = sequence.path().join("now");
    eval(&sequence, &out)
        .arg("--baseline")
        .arg(&baseline)
        .assert()
        .code(0);
    let mut diff = posescope();
    diff.arg("compare").arg(&baseline).arg(&out);
    let output = diff.output().expect("the binary starts");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("of 6 results in both runs"), "{said}");
    let mut export = posescope();
    export.arg("results").arg(&baseline);
    export.args(["--as", "csv", "--where", "method = mi and fusion = r-wavg"]);
    let output = export.output().expect("the binary starts");
    assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 4);
}

/// Expects exit code 3 and one line, which holds these words.
fn refused(command: &mut Command, words: &[&str]) {
    let output = command.output().expect("the binary starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    for word in words {
        assert!(message.contains(word), "`{word}` is missing in: {message}");
    }
}

/// The number of the line that begins with these words.
fn line_of(text: &str, begins: &str) -> usize {
    let line = text.lines().position(|line| line.starts_with(begins));
    line.expect("there is such a line") + 1
}

#[test]
fn what_is_wrong_in_a_run_file_is_told_with_its_line() {
    let (_sequence, run) = earlier_run();
    let file = run.join("run.toml");
    let good = fs::read_to_string(&file).expect("text");
    for (from, to, key, words) in [
        (
            "\"mi\"]",
            "\"mo\"]",
            "method",
            "`mo` is no method; fb, pm, mi, hy",
        ),
        (
            "method = [\"fb\", \"mi\"]",
            "method = []",
            "method",
            "at least one method",
        ),
        (
            "random:2",
            "best:2",
            "reference",
            "`best:2` is no choice of references",
        ),
        (
            "r-wavg",
            "mean",
            "fusion",
            "`mean` is no fusion; maxf, avg, wavg, r-wavg or joint expected",
        ),
        ("[2.0]", "[-2.0]", "radius", "positive radius"),
        (
            "scene_index = 0",
            "scene_index = 1",
            "scene_index",
            "scene_index 1 names none of the 1 scenes",
        ),
        ("run/1", "run/9", "schema", "posescope.run/1 expected"),
        (
            "seed = 1",
            "seed = 1\npreset = \"huge\"",
            "preset",
            "`huge` is no preset; single, multi or large expected",
        ),
        (
            "version =",
            "shard = \"3/2\"\nversion =",
            "shard",
            "I/N expected",
        ),
    ] {
        let bad = good.replacen(from, to, 1);
        assert_ne!(bad, good);
        fs::write(&file, &bad).expect("writable");
        let place = format!("run.toml:{}:", line_of(&bad, key));
        let mut export = posescope();
        export.arg("results").arg(&run).args(["--as", "csv"]);
        refused(&mut export, &[&place, words]);
        let mut view = posescope();
        refused(view.arg("view").arg(&run), &[&place, words]);
    }
}

#[test]
fn what_is_wrong_in_a_result_is_told_with_its_line() {
    let (sequence, run) = earlier_run();
    let file = run.join("results.jsonl");
    let good = fs::read_to_string(&file).expect("text");
    for (from, to, words) in [
        (
            "\"method\":\"mi\"",
            "\"method\":\"mo\"",
            "`mo` is no method; fb, pm, mi, hy",
        ),
        (
            "\"fusion\":\"r-wavg\"",
            "\"fusion\":\"mean\"",
            "`mean` is no fusion",
        ),
        (
            "\"status\":\"ok\"",
            "\"status\":\"good\"",
            "`good` is no status; ok or failed expected",
        ),
    ] {
        let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
        let bad = lines[3].replacen(from, to, 1);
        assert_ne!(bad, lines[3]);
        lines[3] = bad;
        fs::write(&file, lines.join("\n") + "\n").expect("writable");
        let words = ["results.jsonl:4: ", words];
        let mut export = posescope();
        export.arg("results").arg(&run).args(["--as", "csv"]);
        refused(&mut export, &words);
        let mut view = posescope();
        view.current_dir(sequence.path()).arg("view").arg("run");
        refused(&mut view, &words);
        let mut diff = posescope();
        refused(diff.arg("compare").arg(&run).arg(&run), &words);
    }
}
