//! `eval --sweep` and `eval --rerun-failed`.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use posescope::localize::QueryResult;
use posescope::run::read_results;

use crate::binary::posescope;
use crate::small_sequence::SmallSequence;

fn eval(sequence: &SmallSequence, out: &Path, extra: &[&str]) -> Command {
    let mut command = posescope();
    command.arg("eval").arg(sequence.folder());
    command.args(["--method", "fb,mi", "--radius", "3", "-q"]);
    command.args(["--reference", "nearest:1"]);
    command.arg("--out").arg(out).args(extra);
    command
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[test]
fn a_sweep_has_a_run_per_value_a_table_and_curves_and_goes_on() {
    let sequence = SmallSequence::write();
    let out = sequence.path().join("sweep");
    let gamma = ["--sweep", "gamma=0.5:2:0.75", "--threads", "1"];
    eval(&sequence, &out, &gamma).assert().code(0);
    let names = ["gamma=0.50", "gamma=1.25", "gamma=2.00"];
    for (name, degrade) in names.iter().zip(["gamma=0.5", "gamma=1.25", "gamma=2"]) {
        let run = text(&out.join(name).join("run.toml"));
        assert!(run.contains(&format!("degrade = \"{degrade}\"\n")), "{run}");
        assert!(
            !out.join(name)
                .join("failures")
                .join("000005-fb.rrd")
                .exists()
        );
    }
    let table = text(&out.join("sweep.csv"));
    assert_eq!(table.lines().count(), 1 + 3 * 2, "{table}");
    for plot in ["success", "median"] {
        assert!(text(&out.join(format!("{plot}.svg"))).contains("gamma"));
    }

    // One value is lost on the way; the others are as they were, and threads make no difference.
    let kept = text(&out.join("gamma=1.25/results.jsonl"));
    let (whole, curve) = (
        text(&out.join("gamma=2.00/results.jsonl")),
        text(&out.join("median.svg")),
    );
    fs::remove_dir_all(out.join("gamma=2.00")).expect("is there");
    let gamma = ["--sweep", "gamma=0.5:2:0.75", "--threads", "3", "--resume"];
    eval(&sequence, &out, &gamma).assert().code(0);
    assert_eq!(text(&out.join("gamma=1.25/results.jsonl")), kept);
    assert_eq!(text(&out.join("gamma=2.00/results.jsonl")), whole);
    assert_eq!(text(&out.join("median.svg")), curve);

    let ratio = sequence.path().join("ratio");
    let words = [
        "--sweep",
        "fb.ratio=0.6:0.8:0.2",
        "--gate",
        "success@fb > 2",
    ];
    let output = eval(&sequence, &ratio, &words).output().expect("it starts");
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("fb.ratio=0.8: gate"), "{said}");
    assert!(text(&ratio.join("fb.ratio=0.6/run.toml")).contains("ratio = 0.6\n"));
}

#[test]
fn what_cannot_be_swept_is_one_line() {
    let sequence = SmallSequence::write();
    for (sweep, words) in [
        ("gamma=1", "KEY=FROM:TO:STEP expected"),
        (
            "fb.ratio=0.5:1.5:0.5",
            "`fb.ratio` takes 0.1 … 1, not `1.5`",
        ),
        ("fog=0:2:1", "`fog` takes 0 … 1, not `2`"),
    ] {
        let out = sequence.path().join("nowhere");
        let output = eval(&sequence, &out, &["--sweep", sweep]).output();
        let output = output.expect("it starts");
        assert_eq!(output.status.code(), Some(2), "{sweep}");
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains(words), "{said}");
        assert!(!out.exists());
    }
}

#[test]
fn what_failed_is_asked_again_otherwise_and_compared() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    // A black photo: nothing finds it.
    let black = image::GrayImage::new(160, 64);
    black.save(sequence.image("000002")).expect("writable");
    let before = sequence.path().join("before");
    let words = ["--seed", "3", "--right", "2m,10deg"];
    eval(&sequence, &before, &words).assert().code(0);
    let failed: Vec<String> = results(&before)
        .into_iter()
        .filter(|result| result.grade.is_failure())
        .map(|result| result.query)
        .collect();
    assert!(failed.contains(&"000002".to_owned()) && !failed.contains(&"000000".to_owned()));

    let again = sequence.path().join("again");
    let mut command = posescope();
    command.args(["eval", "--rerun-failed"]).arg(&before);
    command.arg("--out").arg(&again);
    command.args(["--set", "mi.bins=32", "--degrade", "exposure=1"]);
    let output = command.output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    let run = text(&again.join("run.toml"));
    for line in [
        "seed = 3",
        "bins = 32",
        "degrade = \"exposure=1\"",
        "right = \"2m,10deg\"",
    ] {
        assert!(run.contains(line), "{line} is missing in {run}");
    }
    assert!(
        results(&again)
            .iter()
            .all(|result| failed.contains(&result.query))
    );
    assert_eq!(
        results(&again).len(),
        2 * failed
            .iter()
            .collect::<std::collections::BTreeSet<_>>()
            .len()
    );
    let shown = String::from_utf8_lossy(&output.stdout);
    assert!(shown.contains("0 broken, 0 fixed"), "{shown}");
    assert!(!shown.contains("only in the first"), "{shown}");

    // Where nothing failed there is nothing to do.
    let fine = sequence.path().join("fine");
    eval(
        &sequence,
        &fine,
        &["--query", "0", "--method", "fb", "--right", "9m,90deg"],
    )
    .assert()
    .code(0);
    let mut command = posescope();
    command.args(["eval", "--rerun-failed"]).arg(&fine);
    // It has no --out, so that a failure of this test would leave a run where it is started.
    command.current_dir(sequence.path());
    let output = command.output().expect("it starts");
    assert_eq!(output.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&output.stderr).contains("No query failed in"));
}

fn results(folder: &Path) -> Vec<QueryResult> {
    let results = read_results(folder).expect("a run");
    results.collect::<Result<_, _>>().expect("results")
}
