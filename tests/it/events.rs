//! `--events`: every event as data.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde_json::Value as Json;

use crate::binary::posescope;
use crate::small_sequence::SmallSequence;

#[test]
fn every_event_is_a_line_whose_numbers_are_those_of_the_result() {
    let sequence = SmallSequence::write();
    let told = |name: &str, threads: &str| {
        let path = sequence.path().join(name);
        let output = posescope()
            .arg("run")
            .arg(sequence.folder())
            .args(["--query", "5", "--reference", "4", "--reference", "7"])
            .args(["--method", "fb,mi", "--radius", "3", "--fusion", "r-wavg"])
            .args(["--json", "-", "-q", "--threads", threads])
            .arg("--events")
            .arg(&path)
            .output()
            .expect("the binary starts");
        assert_eq!(output.status.code(), Some(0));
        let results = String::from_utf8_lossy(&output.stdout).into_owned();
        (fs::read_to_string(path).expect("text"), results)
    };
    let (text, results) = told("events.jsonl", "1");
    assert_eq!(told("again.jsonl", "3"), (text.clone(), results.clone()));
    let events: Vec<Json> = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("an object"))
        .collect();
    let results: Vec<Json> = results
        .lines()
        .map(|line| serde_json::from_str(line).expect("an object"))
        .collect();
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
        fb["counts"]["query_keypoints"]
            .as_u64()
            .map(|count| count as usize)
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
    assert!(
        events
            .iter()
            .any(|event| event["kind"] == "ReferencesFused")
    );
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
fn told_by_eval(sequence: &SmallSequence, out: &str, more: &[&str]) -> String {
    let path = sequence.path().join(format!("{out}.jsonl"));
    let output = posescope()
        .arg("eval")
        .arg(sequence.folder())
        .args(["--query", "4", "--query", "5", "--method", "fb,pm", "-q"])
        .args(["--radius", "2,3", "--keep-failures", "0"])
        .args(more)
        .arg("--out")
        .arg(sequence.path().join(out))
        .arg("--events")
        .arg(&path)
        .output()
        .expect("the binary starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{stderr}");
    let text = fs::read_to_string(path).expect("text");
    text.replace("\"reused\":true", "\"reused\":false")
}

#[test]
fn a_run_over_many_queries_tells_each_once_however_often_it_is_gone_on_with() {
    let sequence = SmallSequence::write();
    let whole = told_by_eval(&sequence, "whole", &[]);
    let events: Vec<Json> = whole
        .lines()
        .map(|line| serde_json::from_str(line).expect("an object"))
        .collect();
    for query in ["000004", "000005"] {
        for radius in [2.0, 3.0] {
            let of_it = |event: &&Json| event["query"] == query && event["radius_m"] == radius;
            assert!(events.iter().any(|event| of_it(&event)), "{query} {radius}");
        }
    }
    assert!(
        events
            .iter()
            .all(|event| event["scene"] == events[0]["scene"])
    );

    let first = told_by_eval(&sequence, "first", &["--shard", "1/2"]);
    let second = told_by_eval(&sequence, "second", &["--shard", "2/2"]);
    assert!(!first.is_empty() && !second.is_empty());
    assert!(
        first.clone() + &second == whole,
        "the parts are not the whole"
    );

    // As a run that was stopped after its first query leaves it.
    let results = sequence.path().join("whole/results.jsonl");
    let lines = fs::read_to_string(&results).expect("text");
    let of_first: String = lines
        .split_inclusive('\n')
        .filter(|line| line.contains("\"query\":\"000004\""))
        .collect();
    assert!(!of_first.is_empty() && of_first.len() < lines.len());
    fs::write(&results, of_first).expect("room");
    fs::write(sequence.path().join("whole.jsonl"), &first).expect("room");
    let resumed = told_by_eval(&sequence, "whole", &["--resume"]);
    assert!(resumed == whole, "what is gone on with is not the whole");
}

#[test]
fn a_file_that_cannot_be_written_is_told_before_anything_is_run() {
    let sequence = SmallSequence::write();
    let output = posescope()
        .arg("run")
        .arg(sequence.folder())
        .args([
            "--query",
            "5",
            "--reference",
            "4",
            "--events",
            "/no/such/folder/e.jsonl",
        ])
        .output()
        .expect("the binary starts");
    assert_eq!(output.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&output.stderr).contains("/no/such/folder/e.jsonl: "));
    assert!(output.stdout.is_empty());

    let folder = sequence.path().join("run");
    let eval = |events: &Path| {
        posescope()
            .arg("eval")
            .arg(sequence.folder())
            .args(["--query", "5", "--method", "fb", "-q", "--out"])
            .arg(&folder)
            .arg("--events")
            .arg(events)
            .output()
            .expect("the binary starts")
    };
    let refused = eval(Path::new("/no/such/folder/e.jsonl"));
    assert_eq!(refused.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("/no/such/folder/e.jsonl: "));
    assert!(
        !folder.exists(),
        "a run folder that the same command refuses"
    );

    // The folder of the run holds what a run holds.
    let refused = eval(&folder.join("events.jsonl"));
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8_lossy(&refused.stderr);
    assert!(said.contains("outside of the run folder"), "{said}");
    assert!(!folder.exists());
}
