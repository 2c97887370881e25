//! The binary as its user drives it.

use std::process::Stdio;

use serde_json::{Value, json};
use tempfile::TempDir;

use crate::binary::{cells, has, objects, posescope, refused, run_in};
use crate::small_sequence::SmallSequence;

/// The results that a run on the small sequence prints.
#[track_caller]
fn results(sequence: &SmallSequence, words: &str) -> Vec<Value> {
    let said = sequence.run(&format!("run sequences/42 {words} --json - -q"));
    assert!(said.err.is_empty(), "-q is quiet: {}", said.err);
    objects(&said.ok().out)
}

#[test]
fn results_come_in_query_then_method_order_with_the_promised_keys() {
    let sequence = SmallSequence::write();
    let results = results(&sequence, "--query 5 --query 7 --reference 4 --method mi,fb");
    let order = results.iter().map(|r| json!([r["query"], r["method"]]));
    let expected = [["000005", "fb"], ["000005", "mi"], ["000007", "fb"], ["000007", "mi"]];
    assert_eq!(order.collect::<Vec<_>>(), expected.map(|pair| json!(pair)));
    let promised = "schema scene query references method fusion seed status reason pose error \
                    initial_error counts cost diagnosis";
    for key in promised.split_whitespace() {
        assert!(results[0].get(key).is_some(), "{key} is missing");
    }
    assert_eq!(results[0]["schema"], "posescope.result/1");
    assert_eq!(results[0]["scene"], "kitti/42");
    for result in &results {
        let has_pose = !result["pose"].is_null();
        assert_eq!(result["status"] == "ok", has_pose);
        assert_eq!(result["reason"].is_null(), has_pose);
        assert_eq!(result["error"].is_null(), !has_pose);
    }
}

#[test]
fn usage_errors_have_exit_code_2_and_name_the_next_step() {
    let sequence = SmallSequence::write();
    let table = "
        --query 5 --set fb.ratoi=0.7 | did you mean `fb.ratio`
        --query 5 --set fb.ratio=7 | 0.1 … 1
        --query 5 --method xx | `xx` is no method; fb, pm, mi, hy, 
        --query 5 --reference best:1 | random:K, nearest:K
        --query 5 --radius -1 | a positive number
        --query 5 --radius=1,2 | takes one value here
        --query 5 --failure-radius=3 | --failure-radius has no effect here
        --query 5 --right 1,5 | --right
        --query 5 --min-confidence 1.5 | --min-confidence
        --query 5 --explain many | --explain
        --query 70 --degrade gama=0.4 | fog, blur, exposure, gamma, noise, invert, mirror expected
        --query 70 --degrade gamma=0.01 | `gamma` takes 0.05 … 10, not `0.01`
        --query 70 --degrade noise=8,noise=9 | `noise` is given twice
        --query 70 --degrade '' | such as gamma=0.4,noise=8,invert
        --query 5 --estimates mi=poses.txt | mi is a built-in method
        --query 5 --estimates poses.txt | give the poses a name, such as superglue=poses.txt
        --query 5 --estimates 'A B=poses.txt' | is not a possible name of a method
        --method mi | --query FRAME, --query PHOTO or --all expected; frames of kitti/42: 000004 … 000007
    ";
    for row in table.lines().map(str::trim).filter(|row| !row.is_empty()) {
        let [words, expected] = cells(row);
        sequence.run(&format!("run sequences/42 {words}")).fails_with(2, expected);
    }
}

#[test]
fn a_scene_is_opened_and_a_mistyped_command_gets_its_suggestion() {
    let sequence = SmallSequence::write();
    for (line, words) in [
        ("evla street", "did you mean `eval`?"),
        ("nonsense", "not a command, file or folder"),
        (
            "sequences/42 --query 5 --limit 3",
            "--limit has no effect here; use it with `posescope eval`",
        ),
    ] {
        sequence.run(line).fails_with(2, words);
    }
}

#[test]
fn a_reference_is_chosen_within_the_radius_and_never_the_query_itself() {
    let sequence = SmallSequence::write();
    let line = |words: &str| format!("run sequences/42 --query 5 --method mi --json - -q {words}");
    let references = |words: &str| -> Vec<Value> {
        let results: Vec<Value> = objects(&sequence.run(&line(words)).ok().out);
        results.iter().map(|result| result["references"][0].clone()).collect()
    };
    assert_eq!(references("--reference nearest:2"), ["000004", "000007"]);
    assert_eq!(references("--reference random:5 --radius 1.5"), ["000004"]);
    assert_eq!(references("--reference random:5 --radius 0.5 --prior 1.5"), ["000004"]);
    assert_eq!(sequence.run(&line("--radius 0.5")).code, Some(3));
}

#[test]
fn where_no_reference_is_near_the_distance_is_named_that_was_searched() {
    let sequence = SmallSequence::write();
    refused(
        sequence.path(),
        "
        3 | run sequences/42 --query 5 --method mi --radius 15 --prior 0.5 | within 0.5 m of query 000005, and the nearest, 000004, is
        3 | view sequences/42 --query 5 --method mi --radius 15 --prior 0.5 | m away; raise --radius or --prior, or name a frame
        ",
    );
    sequence.run("eval sequences/42 --method mi --prior 0.5 -q --out run").ok();
    for result in objects::<Value>(&sequence.text("run/results.jsonl")) {
        let expected = "No reference frame with pose and scan within 0.5 m of the query.";
        assert_eq!(result["reason"]["text"], expected);
    }
}

#[test]
fn every_parameter_is_listed_and_changes_are_marked() {
    let folder = TempDir::new().expect("a folder");
    let table = run_in(folder.path(), "params --set mi.bins=32").ok().out;
    for row in posescope::params::Params::default().list() {
        has(&table, &row.key);
    }
    has(&table, "32 (default 16)");
}

#[test]
fn the_street_is_solved_and_the_bytes_do_not_depend_on_the_number_of_threads() {
    let folder = TempDir::new().expect("a folder");
    let results = |threads: u8| {
        let line = format!("run street --query 70 --reference 62 --threads {threads} --json - -q");
        run_in(folder.path(), &line).ok().out
    };
    let alone = results(1);
    for result in objects::<Value>(&alone) {
        let error = result["error"]["translation_m"].as_f64();
        let has_features = result["method"] == "fb" || result["method"] == "hy";
        let limit = if has_features { 0.2 } else { 1.5 };
        assert!(error.is_some_and(|error| error < limit), "{result}");
    }
    assert_eq!(results(2), alone);
    assert_eq!(results(8), alone);
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_posescope"));
    command.args(["params"]).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the binary starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success() && output.stderr.is_empty(), "{output:?}");
}

#[test]
fn fused_references_give_one_result_with_each_reference_below_it() {
    let sequence = SmallSequence::write();
    let words = "--query 5 --reference 4 --reference 7 --method mi --fusion avg";
    let results = results(&sequence, words);
    assert_eq!(results.len(), 1);
    let fused = &results[0];
    assert_eq!(fused["fusion"], "avg");
    assert_eq!(fused["references"], json!(["000004", "000007"]));
    let alone = fused["per_reference"].as_array().expect("a list");
    assert_eq!(alone.len(), 2);
    let z = |result: &Value| result["pose"]["position_m"][2].as_f64().expect("a pose");
    let mean = (z(&alone[0]) + z(&alone[1])) / 2.0;
    assert!((z(fused) - mean).abs() < 1e-9);
    for one in alone {
        assert!(one["fusion"].is_null() && one.get("per_reference").is_none());
        assert!(one["cost"]["evaluations"].as_u64().is_some_and(|n| n > 0));
    }
}

/// What is printed for a terminal of this width, or in a pipe.
fn printed(sequence: &SmallSequence, line: &str, columns: Option<&str>) -> String {
    let mut command = posescope();
    command.current_dir(sequence.path()).args(line.split(' '));
    command.envs(columns.map(|columns| ("COLUMNS", columns)));
    crate::binary::Said::by(&mut command).ok().out
}

const TWO_QUERIES: &str = "run sequences/42 --query 5 --query 7 --reference 4 --method fb,mi";

#[track_caller]
fn expect_narrow(text: &str) {
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "{line}\n{text}");
    }
}

#[test]
fn a_pipe_has_a_line_for_each_result_and_no_rules() {
    let text = printed(&SmallSequence::write(), TWO_QUERIES, None);
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("query   reference  "), "{text}");
    let expected = [("000005", "fb"), ("000005", "mi"), ("000007", "fb"), ("000007", "mi")];
    for (line, (query, method)) in lines[1..].iter().zip(expected) {
        let cells: Vec<&str> = line.split("  ").map(str::trim).collect();
        assert_eq!((cells[0], cells[1]), (query, "000004"), "{text}");
        assert!(cells.contains(&method), "{text}");
    }
    assert!(!text.contains(['─', '═', '│']), "{text}");
}

#[test]
fn eighty_columns_hold_every_result_with_whole_words() {
    let sequence = SmallSequence::write();
    let narrow = printed(&sequence, TWO_QUERIES, Some("80"));
    expect_narrow(&narrow);
    assert!(narrow.starts_with("query 000005, reference 000004, distance 1.000 m\n"), "{narrow}");
    // Nothing of what a wide terminal shows is missing or broken, but the times.
    let wide = printed(&sequence, TWO_QUERIES, Some("400"));
    let rows = wide.split_once('\n').map_or("", |(_, rows)| rows);
    let plain = |word: &str| word.trim_end_matches(',').to_owned();
    let known: Vec<String> = narrow.split_whitespace().map(plain).collect();
    for word in rows.split_whitespace() {
        let is_time = word.parse::<f64>().is_ok();
        assert!(is_time || known.contains(&plain(word)), "`{word}` of\n{wide}\nin\n{narrow}");
    }
}

#[test]
fn parameters_keep_their_names_whole_at_eighty_columns() {
    let sequence = SmallSequence::write();
    let narrow = printed(&sequence, "params", Some("80"));
    expect_narrow(&narrow);
    for line in printed(&sequence, "params", None).lines().skip(1) {
        let name = line.split_whitespace().next().expect("a name");
        has(&narrow, &format!("\n  {name} "));
    }
}

#[test]
fn an_evaluation_fits_eighty_columns_and_in_a_pipe_a_hundred() {
    let sequence = SmallSequence::write();
    let line =
        |out| format!("eval sequences/42 --method fb,mi --radius 3 --keep-failures 0 --out {out}");
    let narrow = printed(&sequence, &line("a"), Some("80"));
    expect_narrow(&narrow);
    let piped = printed(&sequence, &line("b"), None);
    assert!(piped.lines().all(|line| line.chars().count() <= 100), "{piped}");
    for text in [narrow, piped] {
        assert!(!text.contains('|'), "{text}");
        has(&text, "fb ~ mi ~ median error ~ Right: ~ Trusted: ~ Report: ~ --table summary");
    }
}

/// The street turns by 45° between the two; the search looks there because a vehicle turns with the road.
#[test]
fn a_query_behind_a_bend_is_found_by_the_search() {
    let folder = TempDir::new().expect("a folder");
    let asked = "run street --query 127 --reference 120 --radius 10 --method mi6 --json - -q";
    let results: Vec<Value> = objects(&run_in(folder.path(), asked).ok().out);
    assert_eq!(results[0]["grade"], "right", "{}", results[0]["error"]);
}
