//! What a CI job asks of a run: gates on verdicts, known failures, the summary of its step.

use std::fs;
use std::path::Path;

use assert_cmd::Command;

use crate::binary::posescope;
use crate::small_sequence::SmallSequence;

/// One of whose photos is black, so that nothing finds it.
fn sequence() -> SmallSequence {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let black = image::GrayImage::new(160, 64);
    black.save(sequence.image("000002")).expect("writable");
    sequence
}

fn eval(sequence: &SmallSequence, out: &Path, extra: &[&str]) -> Command {
    let mut command = posescope();
    command.arg("eval").arg(sequence.folder());
    command.args([
        "--method",
        "fb",
        "--radius",
        "3",
        "--reference",
        "nearest:1",
    ]);
    command.args([
        "--query", "0", "--query", "1", "--query", "2", "--right", "2m,5deg",
    ]);
    command.arg("--out").arg(out).args(extra);
    command.env_remove("GITHUB_STEP_SUMMARY");
    command
}

#[test]
fn a_known_failure_turns_no_job_red_and_one_that_is_fixed_is_said() {
    let sequence = sequence();
    let path = |name: &str| sequence.path().join(name);
    let list = path("known.txt");
    let known = ["--known-failures", list.to_str().expect("a plain path")];
    let gates = ["--gate", "success@fb >= 1", "--gate", "share(R2)@fb <= 0"];

    let output = eval(&sequence, &path("red"), &gates)
        .output()
        .expect("it starts");
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("share(R2)@fb <= 0` failed: 0.3333"), "{said}");

    fs::write(&list, "# the lamp was off\n2 fb R2\n1 fb\n").expect("writable");
    let output = eval(&sequence, &path("green"), &[&gates[..], &known].concat());
    let output = { output }.output().expect("it starts");
    let shown = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{shown}");
    assert!(
        shown.contains("1 known failure is left out of gates"),
        "{shown}"
    );
    assert!(shown.contains("1 fb is right now; take it off"), "{shown}");
    let junit = fs::read_to_string(path("green/junit.xml")).expect("text");
    assert_eq!(junit.matches("<skipped").count(), 1, "{junit}");
    assert_eq!(junit.matches("<failure").count(), 0);

    // A failure of another kind is news.
    fs::write(&list, "2 fb R8\n").expect("writable");
    let output = eval(&sequence, &path("other"), &[&gates[..], &known].concat());
    let output = { output }.output().expect("it starts");
    assert_eq!(output.status.code(), Some(1));
    let shown = String::from_utf8_lossy(&output.stdout);
    assert!(shown.contains("2 fb has R2, not R8 as in"), "{shown}");

    fs::write(&list, "2\n").expect("writable");
    let output = eval(&sequence, &path("bad"), &known)
        .output()
        .expect("it starts");
    assert_eq!(output.status.code(), Some(3));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("known.txt:1: QUERY METHOD"), "{said}");
    assert!(!path("bad").exists());
}

#[test]
fn a_known_failure_is_no_regression() {
    let (good, bad) = (SmallSequence::of(&[0, 1, 2, 3]), sequence());
    let path = |name: &str| bad.path().join(name);
    eval(&good, &path("good"), &[]).assert().code(0);
    let list = path("known.txt");
    fs::write(&list, "000002 fb\n").expect("writable");
    let text = |path: &Path| path.to_str().expect("a plain path").to_owned();
    let baseline = ["--baseline".to_owned(), text(&path("good"))];
    let known = ["--known-failures".to_owned(), text(&list)];
    let run = |name: &str, words: &[String]| {
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        eval(&bad, &path(name), &words).assert()
    };
    run("red", &baseline).code(1);
    run("green", &[baseline, known].concat()).code(0);
}

#[test]
fn the_summary_of_a_step_is_appended_where_there_is_one() {
    let sequence = sequence();
    let summary = sequence.path().join("summary.md");
    fs::write(&summary, "# before\n").expect("writable");
    let gates = [
        "--gate",
        "median(time)@fb < 60",
        "--gate",
        "success@fb > 0.9",
    ];
    let mut command = eval(&sequence, &sequence.path().join("run"), &gates);
    command
        .env("GITHUB_STEP_SUMMARY", &summary)
        .assert()
        .code(1);
    let text = fs::read_to_string(&summary).expect("text");
    assert!(
        text.starts_with("# before\n### ❌ posescope: kitti/42"),
        "{text}"
    );
    assert!(
        text.contains("| `median(time)@fb < 60` | passed |"),
        "{text}"
    );
    assert!(text.contains("| `success@fb > 0.9` | failed |"), "{text}");
    assert!(text.contains("| FB | 66.7 |"), "{text}");
    assert!(text.len() < 4000);
    // Where nobody can write, the run goes on.
    let mut command = eval(&sequence, &sequence.path().join("other"), &[]);
    let nowhere = sequence.path().join("no/such/folder");
    command.env("GITHUB_STEP_SUMMARY", nowhere).assert().code(0);
}
