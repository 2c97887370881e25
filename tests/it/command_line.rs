//! The binary as its user drives it.

use serde_json::Value;

use crate::binary::posescope;
use crate::small_sequence::SmallSequence;

fn json_lines(bytes: &[u8]) -> Vec<Value> {
    String::from_utf8_lossy(bytes)
        .lines()
        .map(|line| serde_json::from_str(line).expect("one object per line"))
        .collect()
}

#[test]
fn results_come_in_query_then_method_order_with_the_promised_keys() {
    let sequence = SmallSequence::write();
    let output = posescope()
        .arg("run")
        .arg(sequence.folder())
        .args(["--query", "5", "--query", "7", "--reference", "4"])
        .args(["--method", "mi,fb", "--json", "-", "-q"])
        .output()
        .expect("the binary starts");
    assert!(output.status.success());
    assert!(output.stderr.is_empty(), "-q is quiet");
    let results = json_lines(&output.stdout);
    let order: Vec<_> = results
        .iter()
        .map(|r| (r["query"].as_str(), r["method"].as_str()))
        .collect();
    let expected = [
        ("000005", "fb"),
        ("000005", "mi"),
        ("000007", "fb"),
        ("000007", "mi"),
    ];
    assert_eq!(order, expected.map(|(q, m)| (Some(q), Some(m))));

    let keys: Vec<_> = results[0].as_object().expect("an object").keys().collect();
    let promised = [
        "schema",
        "scene",
        "query",
        "references",
        "method",
        "fusion",
        "seed",
        "status",
        "reason",
        "pose",
        "error",
        "initial_error",
        "counts",
        "cost",
        "diagnosis",
    ];
    for key in promised {
        assert!(keys.iter().any(|k| *k == key), "{key} is missing");
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
    let cases: [(&[&str], &str); 9] = [
        (
            &["--query", "5", "--set", "fb.ratoi=0.7"],
            "did you mean `fb.ratio`",
        ),
        (&["--query", "5", "--set", "fb.ratio=7"], "0.1 … 1"),
        (
            &["--query", "5", "--method", "xx"],
            "fb, pm, mi, hy, fb2, mi6, nid or robust",
        ),
        (
            &["--query", "5", "--reference", "best:1"],
            "random:K, nearest:K",
        ),
        (&["--query", "5", "--radius=-1"], "a positive number"),
        (&["--query", "5", "--right", "1,5"], "--right"),
        (
            &["--query", "5", "--min-confidence", "1.5"],
            "--min-confidence",
        ),
        (&["--query", "5", "--explain", "many"], "--explain"),
        (&[], "--query"),
    ];
    for (arguments, words) in cases {
        let output = posescope()
            .arg("run")
            .arg(sequence.folder())
            .args(arguments)
            .output()
            .expect("the binary starts");
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(
            message.contains(words),
            "`{words}` is missing in: {message}"
        );
    }
}

#[test]
fn a_scene_is_opened_and_a_mistyped_command_gets_its_suggestion() {
    let said = |words: &[&str]| {
        let output = posescope().args(words).output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said)
    };
    let (code, text) = said(&["evla", "street"]);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("did you mean `eval`?"), "{text}");
    let (code, text) = said(&["nonsense"]);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("no command, file or folder"), "{text}");
    let sequence = SmallSequence::write();
    let folder = sequence.folder();
    let folder = folder.to_str().expect("a plain path");
    let (code, text) = said(&[folder, "--query", "5", "--limit", "3"]);
    assert_eq!(code, Some(2), "{text}");
    assert!(
        text.contains("--limit is an option of `posescope eval`"),
        "{text}"
    );
    for (option, words) in [
        ("--radius=1,2", "takes one value here"),
        ("--failure-radius=3", "--failure-radius is an option of"),
    ] {
        let (code, text) = said(&["run", folder, "--query", "5", option]);
        assert_eq!(code, Some(2), "{text}");
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn a_reference_is_chosen_within_the_radius_and_never_the_query_itself() {
    let sequence = SmallSequence::write();
    let references = |extra: &[&str]| {
        let output = posescope()
            .arg("run")
            .arg(sequence.folder())
            .args(["--query", "5", "--method", "mi", "--json", "-", "-q"])
            .args(extra)
            .output()
            .expect("the binary starts");
        let results = json_lines(&output.stdout);
        let names = results
            .iter()
            .map(|r| r["references"][0].as_str().map(str::to_owned));
        (
            output.status.code(),
            names.collect::<Option<Vec<_>>>().expect("names"),
        )
    };
    let nearest = references(&["--reference", "nearest:2"]);
    assert_eq!(
        nearest,
        (Some(0), vec!["000004".to_owned(), "000007".to_owned()])
    );
    let within = references(&["--reference", "random:5", "--radius", "1.5"]);
    assert_eq!(within, (Some(0), vec!["000004".to_owned()]));
    assert_eq!(references(&["--radius", "0.5"]).0, Some(3));
    let farther = [
        "--reference",
        "random:5",
        "--radius",
        "0.5",
        "--prior",
        "1.5",
    ];
    assert_eq!(references(&farther), within);
}

#[test]
fn where_no_reference_is_near_the_distance_is_named_that_was_searched() {
    let sequence = SmallSequence::write();
    let said = |command: &str, extra: &[&str]| {
        let output = posescope()
            .arg(command)
            .arg(sequence.folder())
            .args(["--query", "5", "--method", "mi", "--radius", "15"])
            .args(extra)
            .output()
            .expect("the binary starts");
        assert_eq!(output.status.code(), Some(3));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    for command in ["run", "view"] {
        let message = said(command, &["--prior", "0.5"]);
        let words = "within 0.5 m of query 000005; raise --radius or --prior, or name one";
        assert!(message.contains(words), "{message}");
    }
    let out = sequence.path().join("run");
    let output = posescope()
        .arg("eval")
        .arg(sequence.folder())
        .args(["--method", "mi", "--prior", "0.5", "-q", "--out"])
        .arg(&out)
        .output()
        .expect("the binary starts");
    assert_eq!(output.status.code(), Some(0));
    let results = std::fs::read(out.join("results.jsonl")).expect("results");
    for result in json_lines(&results) {
        let reason = &result["reason"]["text"];
        assert_eq!(
            reason,
            "No reference frame with pose and scan within 0.5 m of the query."
        );
    }
}

#[test]
fn every_parameter_is_listed_and_changes_are_marked() {
    let output = posescope()
        .args(["params", "--set", "mi.bins=32"])
        .output()
        .expect("the binary starts");
    assert!(output.status.success());
    let table = String::from_utf8_lossy(&output.stdout);
    for row in posescope::params::Params::default().list() {
        assert!(table.contains(&row.key), "{} is missing", row.key);
    }
    assert!(table.contains("32 (default 16)"));
}

#[test]
fn the_street_is_solved_and_the_bytes_do_not_depend_on_the_number_of_threads() {
    let results = |threads: &str| {
        let output = posescope()
            .args(["run", "street", "--query", "70", "--reference", "62"])
            .args(["--threads", threads, "--json", "-", "-q"])
            .output()
            .expect("the binary starts");
        assert!(output.status.success());
        output.stdout
    };
    let alone = results("1");
    for result in json_lines(&alone) {
        let error = result["error"]["translation_m"].as_f64();
        let limit = if result["method"] == "fb" || result["method"] == "hy" {
            0.2
        } else {
            1.5
        };
        assert!(error.is_some_and(|error| error < limit), "{result}");
    }
    assert_eq!(results("2"), alone);
    assert_eq!(results("8"), alone);
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let binary = assert_cmd::cargo::cargo_bin!("posescope");
    let script = format!(
        "'{}' params | true; exit ${{PIPESTATUS[0]}}",
        binary.display()
    );
    let output = std::process::Command::new("bash")
        .args(["-c", &script])
        .output()
        .expect("bash is there");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && message.is_empty(), "{message}");
}

#[test]
fn fused_references_give_one_result_with_each_reference_below_it() {
    let sequence = SmallSequence::write();
    let output = posescope()
        .arg("run")
        .arg(sequence.folder())
        .args(["--query", "5", "--reference", "4", "--reference", "7"])
        .args(["--method", "mi", "--fusion", "avg", "--json", "-", "-q"])
        .output()
        .expect("the binary starts");
    assert!(output.status.success());
    let results = json_lines(&output.stdout);
    assert_eq!(results.len(), 1);
    let fused = &results[0];
    assert_eq!(fused["fusion"], "avg");
    assert_eq!(fused["references"], serde_json::json!(["000004", "000007"]));
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
