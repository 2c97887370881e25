//! What a CI job asks of a run: gates on verdicts, known failures, the summary of its step.

use crate::binary::{Said, command_in, has, write};
use crate::small_sequence::SmallSequence;

/// One of whose photos is black, so that nothing finds it.
fn sequence() -> SmallSequence {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    sequence.blacken("000002");
    sequence
}

fn eval_with(sequence: &SmallSequence, words: &str, summary: Option<&str>) -> Said {
    let asked = "--method fb --radius 3 --reference nearest:1 --right 2m,5deg";
    let line = format!("eval sequences/42 {asked} --query 0 --query 1 --query 2 {words}");
    let mut command = command_in(sequence.path(), &line);
    command.env_remove("GITHUB_STEP_SUMMARY");
    command.envs(summary.map(|file| ("GITHUB_STEP_SUMMARY", file)));
    Said::by(&mut command)
}

fn eval(sequence: &SmallSequence, words: &str) -> Said {
    eval_with(sequence, words, None)
}

#[test]
fn a_known_failure_turns_no_job_red_and_one_that_is_fixed_is_said() {
    let sequence = sequence();
    let list = sequence.path().join("known.txt");
    let gates = "--gate 'success@fb >= 1' --gate 'share(R2)@fb <= 0'";
    let gated = format!("{gates} --known-failures known.txt");

    let said = eval(&sequence, &format!("{gates} --out red"));
    said.fails_with(1, "share(R2)@fb <= 0` failed: 0.3333");

    write(&list, "# the lamp was off\n2 fb R2\n1 fb\n");
    let said = eval(&sequence, &format!("{gated} --out green")).ok();
    has(&said.out, "1 known failure is left out of gates ~ 1 fb no longer fails; remove");
    let junit = sequence.text("green/junit.xml");
    assert_eq!(junit.matches("<skipped").count(), 1, "{junit}");
    assert_eq!(junit.matches("<failure").count(), 0);

    // A failure of another kind is news.
    write(&list, "2 fb R8\n");
    let said = eval(&sequence, &format!("{gated} --out other"));
    assert_eq!(said.code, Some(1));
    has(&said.out, "2 fb fails with R2 instead of R8 in");

    write(&list, "2\n");
    let said = eval(&sequence, &format!("{gated} --out bad"));
    said.fails(3, "known.txt:1: QUERY METHOD");
    assert!(!sequence.path().join("bad").exists());
}

#[test]
fn a_known_failure_is_no_regression() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    eval(&sequence, "--out good").ok();
    sequence.blacken("000002");
    write(sequence.path().join("known.txt"), "000002 fb\n");
    assert_eq!(eval(&sequence, "--baseline good --out red").code, Some(1));
    eval(&sequence, "--baseline good --known-failures known.txt --out green").ok();
}

#[test]
fn the_summary_of_a_step_is_appended_where_there_is_one() {
    let sequence = sequence();
    write(sequence.path().join("summary.md"), "# before\n");
    let words = "--gate 'median(time)@fb < 60' --gate 'success@fb > 0.9' --out run";
    assert_eq!(eval_with(&sequence, words, Some("summary.md")).code, Some(1));
    let text = sequence.text("summary.md");
    assert!(text.starts_with("# before\n### ❌ posescope: kitti/42"), "{text}");
    has(
        &text,
        "| `median(time)@fb < 60` | passed | ~ | `success@fb > 0.9` | failed | ~ | fb | 66.7 |",
    );
    assert!(text.len() < 4000);
    // Where nobody can write, the run goes on.
    eval_with(&sequence, "--out other", Some("no/such/folder")).ok();
}
