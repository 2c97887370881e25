//! `--events`: every event as data.

use std::collections::BTreeSet;

use serde_json::Value as Json;

use crate::binary::{objects, write};
use crate::small_sequence::SmallSequence;

#[test]
fn every_event_is_a_line_whose_numbers_are_those_of_the_result() {
    let sequence = SmallSequence::write();
    let told = |name: &str, threads: &str| {
        let line =
            "run sequences/42 --query 5 --reference 4 --reference 7 --method fb,mi --radius 3";
        let more = format!("--fusion r-wavg --json - -q --threads {threads} --events {name}");
        let results = sequence.run(&format!("{line} {more}")).ok().out;
        (sequence.text(name), results)
    };
    let (text, results) = told("events.jsonl", "1");
    assert_eq!(told("again.jsonl", "3"), (text.clone(), results.clone()));
    let [events, results]: [Vec<Json>; 2] = [&text, &results].map(|text| objects(text));
    let of = |kind: &str, method: &str, reference: &str| -> Vec<&Json> {
        let is_it = |event: &&Json| {
            event["kind"] == kind && event["method"] == method && event["reference"] == reference
        };
        events.iter().filter(is_it).collect()
    };
    let fb = &results[0]["per_reference"][0];
    assert_eq!(fb["references"][0], "000004");
    let detected = of("FeaturesDetected", "fb", "000004");
    assert_eq!(detected.len(), 2);
    assert_eq!(
        detected[0]["x_px"].as_array().map(Vec::len),
        fb["counts"]["query_keypoints"].as_u64().map(|count| count as usize)
    );
    let classified = of("FeaturesClassified", "fb", "000004");
    let states = classified[0]["state"].as_array().expect("states");
    let inliers = states.iter().filter(|state| **state == "inlier").count();
    assert_eq!(Some(inliers as u64), fb["counts"]["inliers"].as_u64());

    let mi = &results[1]["per_reference"][1];
    assert_eq!(mi["references"][0], "000007");
    let phases = of("PhaseSearched", "mi", "000007");
    let coarse = phases[0];
    let cells = coarse["cost"].as_array().expect("costs").len() as u64;
    let side = |name: &str| coarse[name].as_u64().expect("a count");
    assert_eq!(cells, side("columns") * side("rows"));
    let scored = of("PoseScored", "mi", "000007");
    let tried = |phase: &Json| {
        let covered = phase["covered"].as_array().expect("a list");
        covered.iter().filter(|covered| !covered.is_null()).count()
    };
    let tried: usize = phases.iter().map(|phase| tried(phase)).sum();
    assert_eq!(scored.len(), tried);
    let assessed = of("MinimumAssessed", "mi", "000007");
    assert_eq!(assessed[0]["best"], mi["cost"]["best"]);
    assert!(events.iter().any(|event| event["kind"] == "ReferencesFused"));
    for event in &events {
        let kind = event["kind"].as_str().expect("a name");
        let documented = documented(kind);
        for field in event.as_object().expect("an object").keys() {
            assert!(documented.contains(field.as_str()), "{kind}: {field}");
        }
    }
    // Nothing is as large as a picture.
    assert!(text.lines().all(|line| line.len() < 200_000));
}

/// The fields that the documentation has for a kind of event.
fn documented(kind: &str) -> BTreeSet<&'static str> {
    let mut rows = include_str!("../../docs/results.md").lines();
    let row = rows.find(|row| {
        let first = row.strip_prefix("| `");
        first.is_some_and(|row| row.split('|').next().unwrap_or("").contains(kind))
    });
    let words = row.unwrap_or_else(|| panic!("{kind}")).split('`');
    let of_all = ["scene", "query", "reference", "radius_m", "method"];
    let of_all = of_all.into_iter().chain(["index", "depth", "kind"]);
    of_all.chain(words.skip(1).step_by(2)).collect()
}

/// What a run over the first queries tells, in this folder, with these words more; but for what it remembers
/// of frames that it had before.
#[track_caller]
fn told_by_eval(sequence: &SmallSequence, out: &str, more: &str) -> String {
    let line =
        "eval sequences/42 --query 4 --query 5 --method fb,pm -q --radius 2,3 --keep-failures 0";
    let files = format!("--out {out} --events {out}.jsonl");
    sequence.run(&format!("{line} {more} {files}")).ok();
    let text = sequence.text(&format!("{out}.jsonl"));
    text.replace("\"reused\":true", "\"reused\":false")
}

#[test]
fn a_run_over_many_queries_tells_each_once_however_often_it_is_gone_on_with() {
    let sequence = SmallSequence::write();
    let whole = told_by_eval(&sequence, "whole", "");
    let events: Vec<Json> = objects(&whole);
    for (query, radius) in [("000004", 2.0), ("000004", 3.0), ("000005", 2.0), ("000005", 3.0)] {
        let is_it = |event: &Json| event["query"] == query && event["radius_m"] == radius;
        assert!(events.iter().any(is_it), "{query} {radius}");
    }
    assert!(events.iter().all(|event| event["scene"] == events[0]["scene"]));

    let first = told_by_eval(&sequence, "first", "--shard 1/2");
    let second = told_by_eval(&sequence, "second", "--shard 2/2");
    assert!(!first.is_empty() && !second.is_empty());
    assert!(first.clone() + &second == whole, "the parts are not the whole");

    // As a run that was stopped after its first query leaves it.
    let lines = sequence.text("whole/results.jsonl");
    let of_first = lines.split_inclusive('\n').filter(|line| line.contains("\"query\":\"000004\""));
    let of_first: String = of_first.collect();
    assert!(!of_first.is_empty() && of_first.len() < lines.len());
    write(sequence.path().join("whole/results.jsonl"), of_first);
    write(sequence.path().join("whole.jsonl"), &first);
    let resumed = told_by_eval(&sequence, "whole", "--resume");
    assert!(resumed == whole, "what is gone on with is not the whole");
}

#[test]
fn a_file_that_cannot_be_written_is_told_before_anything_is_run() {
    let sequence = SmallSequence::write();
    let line = "run sequences/42 --query 5 --reference 4 --events /no/such/folder/e.jsonl";
    let said = sequence.run(line).fails(3, "/no/such/folder/e.jsonl: ");
    assert_eq!(said.out, "");
    // The folder of the run holds what a run holds.
    for (events, code, words) in [
        ("/no/such/folder/e.jsonl", 3, "/no/such/folder/e.jsonl: "),
        ("run/events.jsonl", 2, "outside the run folder"),
    ] {
        let line = "eval sequences/42 --query 5 --method fb -q --out run --events";
        sequence.run(&format!("{line} {events}")).fails(code, words);
        assert!(!sequence.path().join("run").exists(), "the same command refuses it");
    }
}
