//! Files that an earlier program wrote, and what is wrong in a file that somebody edited.
//!
//! The files in `tests/fixtures` were written before results and sessions named their methods,
//! fusions and choices by types.

use std::fs;
use std::path::Path;

use crate::binary::{cells, has, lines, write};
use crate::small_sequence::SmallSequence;

const FIXTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures");

/// A sequence with a finished `run` over its three frames, which an earlier program made.
fn earlier_run() -> SmallSequence {
    let sequence = SmallSequence::of(&[0, 1, 2]);
    let run = sequence.path().join("run");
    fs::create_dir(&run).expect("writable");
    for file in ["run.toml", "results.jsonl", "timings.jsonl"] {
        let from = Path::new(FIXTURES).join("run-1").join(file);
        fs::copy(from, run.join(file)).expect("writable");
    }
    sequence
}

/// What the earlier run was asked.
const EVAL: &str = "eval sequences/42 --format kitti --method fb,mi --reference random:2 -q \
                    --radius 2 --prior 3 --seed 1 --set fb.ratio=0.75 --out";

#[test]
fn a_run_of_an_earlier_program_is_resumed() {
    let sequence = earlier_run();
    // Another version is another run.
    let file = |name: &str| sequence.path().join("run").join(name);
    let text = sequence.text("run/run.toml");
    let version = format!("version = \"{}\"", env!("CARGO_PKG_VERSION"));
    write(file("run.toml"), text.replacen("version = \"0.1.0\"", &version, 1));
    let results = sequence.text("run/results.jsonl");
    let first: String = results.split_inclusive('\n').take(2).collect();
    write(file("results.jsonl"), &first);
    sequence.run(&format!("{EVAL} run --resume")).ok();
    assert_eq!(lines(file("results.jsonl")), 6);
    assert!(sequence.text("run/results.jsonl").starts_with(&first));
    assert!(file("summary.json").exists());
}

#[test]
fn a_run_of_an_earlier_program_serves_as_baseline_and_is_exported() {
    let sequence = earlier_run();
    sequence.run(&format!("{EVAL} now --baseline run")).ok();
    has(&sequence.run("compare run now").out, "of 6 results in both runs");
    let line = "results run --as csv --where 'method = mi and fusion = r-wavg'";
    assert_eq!(sequence.run(line).ok().out.lines().count(), 4);
}

#[test]
fn what_is_wrong_in_a_run_file_is_told_with_its_line() {
    let sequence = earlier_run();
    let good = sequence.text("run/run.toml");
    // What is changed into what, the line that is named, the words.
    let table = r#"
        "mi"] | "mo"] | method | `mo` is no method; fb, pm, mi, hy
        method = ["fb", "mi"] | method = [] | method | at least one method
        random:2 | best:2 | reference | `best:2` is no choice of references
        r-wavg | mean | fusion | `mean` is no fusion; maxf, avg, wavg, r-wavg or joint expected
        [2.0] | [-2.0] | radius | radius above 0
        scene_index = 0 | scene_index = 1 | scene_index | a scene_index below 1 expected
        run/1 | run/9 | schema | posescope.run/1 expected
        seed = 1 | preset = "huge" | preset | `huge` is no preset; single, multi or large expected
        version = | shard = "3/2"\nversion = | shard | I/N expected
    "#;
    for row in table.lines().map(str::trim).filter(|row| !row.is_empty()) {
        let [from, to, key, words] = cells(row);
        let bad = good.replacen(from, &to.replace("\\n", "\n"), 1);
        assert_ne!(bad, good);
        write(sequence.path().join("run/run.toml"), &bad);
        let line = bad.lines().position(|line| line.starts_with(key));
        let words = format!("run.toml:{}: ~ {words}", line.expect("is there") + 1);
        for command in ["results run --as csv", "view run"] {
            sequence.run(command).fails_in_one_line(3, &words);
        }
    }
}

#[test]
fn what_is_wrong_in_a_result_is_told_with_its_line() {
    let sequence = earlier_run();
    let good = sequence.text("run/results.jsonl");
    let table = r#"
        "method":"mi" | "method":"mo" | `mo` is no method; fb, pm, mi, hy
        "fusion":"r-wavg" | "fusion":"mean" | `mean` is no fusion
        "status":"ok" | "status":"good" | `good` is no status; ok or failed expected
    "#;
    for row in table.lines().map(str::trim).filter(|row| !row.is_empty()) {
        let [from, to, words] = cells(row);
        let mut lines: Vec<String> = good.lines().map(str::to_owned).collect();
        let bad = lines[3].replacen(from, to, 1);
        assert_ne!(bad, lines[3]);
        lines[3] = bad;
        write(sequence.path().join("run/results.jsonl"), lines.join("\n") + "\n");
        for command in ["results run --as csv", "view run", "compare run run"] {
            let words = format!("results.jsonl:4:  ~ {words}");
            sequence.run(command).fails_in_one_line(3, &words);
        }
    }
}
