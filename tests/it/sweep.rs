//! `eval --sweep` and `eval --rerun-failed`.

use std::collections::BTreeSet;
use std::fs;

use posescope::localize::QueryResult;

use crate::binary::{has, objects};
use crate::small_sequence::SmallSequence;

const EVAL: &str = "eval sequences/42 --method fb,mi --radius 3 -q --reference nearest:1 --out";

#[test]
fn a_sweep_has_a_run_per_value_a_table_and_curves_and_goes_on() {
    let sequence = SmallSequence::write();
    let sweep = format!("{EVAL} sweep --sweep gamma=0.5:2:0.75");
    sequence.run(&format!("{sweep} --threads 1")).ok();
    for (name, degrade) in [("0.50", "0.5"), ("1.25", "1.25"), ("2.00", "2")] {
        let run = sequence.text(&format!("sweep/gamma={name}/run.toml"));
        has(&run, &format!("degrade = \"gamma={degrade}\"\n"));
        let recording = format!("sweep/gamma={name}/failures/000005-fb.rrd");
        assert!(!sequence.path().join(recording).exists());
    }
    assert_eq!(sequence.text("sweep/sweep.csv").lines().count(), 1 + 3 * 2);
    has(&sequence.text("sweep/success.svg"), "gamma");
    has(&sequence.text("sweep/median.svg"), "gamma");

    // One value is lost on the way; the others are as they were, and threads make no difference.
    let files = ["gamma=1.25/results.jsonl", "gamma=2.00/results.jsonl", "median.svg"];
    let texts = || files.map(|file| sequence.text(&format!("sweep/{file}")));
    let before = texts();
    fs::remove_dir_all(sequence.path().join("sweep/gamma=2.00")).expect("is there");
    sequence.run(&format!("{sweep} --threads 3 --resume")).ok();
    assert!(before == texts());

    let line = format!("{EVAL} ratio --sweep fb.ratio=0.6:0.8:0.2 --gate 'success@fb > 1'");
    sequence.run(&line).fails_with(1, "fb.ratio=0.8: gate");
    has(&sequence.text("ratio/fb.ratio=0.6/run.toml"), "ratio = 0.6\n");
}

#[test]
fn what_cannot_be_swept_is_one_line() {
    let sequence = SmallSequence::write();
    for (sweep, words) in [
        ("gamma=1", "KEY=FROM:TO:STEP expected"),
        ("fb.ratio=0.5:1.5:0.5", "`fb.ratio` takes 0.1 … 1, not `1.5`"),
        ("fog=0:2:1", "`fog` takes 0 … 1, not `2`"),
    ] {
        sequence.run(&format!("{EVAL} nowhere --sweep {sweep}")).fails_with(2, words);
    }
    assert!(!sequence.path().join("nowhere").exists());
}

#[test]
fn what_failed_is_asked_again_otherwise_and_compared() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    sequence.blacken("000002");
    sequence.run(&format!("{EVAL} before --seed 3 --right 2m,10deg")).ok();
    let results = |run: &str| -> Vec<QueryResult> {
        objects(&sequence.text(&format!("{run}/results.jsonl")))
    };
    let failed = results("before").into_iter().filter(|result| result.grade.is_failure());
    let failed: BTreeSet<String> = failed.map(|result| result.query).collect();
    assert!(failed.contains("000002") && !failed.contains("000000"));

    let line = "eval --rerun-failed before --out again --set mi.bins=32 --degrade exposure=1";
    let said = sequence.run(line).ok();
    has(
        &sequence.text("again/run.toml"),
        "seed = 3 ~ bins = 32 ~ degrade = \"exposure=1\" ~ right = \"2m,10deg\"",
    );
    let again = results("again");
    assert!(again.iter().all(|result| failed.contains(&result.query)));
    assert_eq!(again.len(), 2 * failed.len());
    has(&said.out, "0 broken, 0 fixed");
    assert!(!said.out.contains("only in the first"), "{}", said.out);

    // Where nothing failed there is nothing to do.
    let line = format!("{EVAL} fine --query 0 --method fb --right 9m,90deg");
    sequence.run(&line).ok();
    has(&sequence.run("eval --rerun-failed fine").ok().err, "No query failed in");
}
