//! `posescope results` as a process.

use std::path::{Path, PathBuf};

use crate::binary::{posescope, said};
use crate::small_sequence::SmallSequence;

/// A run over the frames of a small sequence.
fn run() -> (SmallSequence, PathBuf) {
    let sequence = SmallSequence::write();
    let folder = sequence.path().join("run");
    posescope()
        .arg("eval")
        .arg(sequence.folder())
        .args(["--method", "fb,mi", "--radius", "3", "--out"])
        .arg(&folder)
        .assert()
        .code(0);
    (sequence, folder)
}

/// The exit code, what is printed, and what is said on stderr.
fn results_of(folder: &Path, more: &[&str]) -> (Option<i32>, String, String) {
    said(posescope().arg("results").arg(folder).args(more))
}

#[test]
fn results_are_chosen_sorted_and_counted() {
    let (_sequence, folder) = run();
    let lines = std::fs::read_to_string(folder.join("results.jsonl")).expect("results");
    let results: Vec<serde_json::Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).expect("a result"))
        .collect();
    let of_mi = results.iter().filter(|result| result["method"] == "mi");
    let mut wanted: Vec<f64> = of_mi
        .filter_map(|result| result["error"]["translation_m"].as_f64())
        .collect();
    wanted.sort_by(f64::total_cmp);
    // An error that some poses stay below and some do not.
    let limit = wanted[wanted.len() - 1];
    wanted.retain(|error| *error < limit);
    assert!(!wanted.is_empty());

    let condition = &format!("method = MI and error < {limit}");
    let asked = [
        "--where",
        condition,
        "--sort",
        "-error",
        "--columns",
        "error,query",
    ];
    let (code, table, said) = results_of(&folder, &asked);
    assert_eq!(code, Some(0), "{said}");
    let words = format!("{} of {} results", wanted.len(), results.len());
    assert_eq!(said.trim(), words);
    let shown: Vec<f64> = table
        .lines()
        .skip(1)
        .map(|line| {
            let first = line.split_whitespace().next().expect("an error");
            first.parse().expect("a number")
        })
        .collect();
    let mut sorted = wanted.clone();
    sorted.sort_by(|a, b| b.total_cmp(a));
    assert_eq!(shown.len(), sorted.len());
    for (shown, wanted) in shown.iter().zip(&sorted) {
        assert!((shown - wanted).abs() <= 5e-4, "{shown} {wanted}");
    }

    // Of one order the other is the reverse, and what has no error comes last in both.
    let order = |order: &str| -> Vec<f64> {
        let (code, table, said) =
            results_of(&folder, &["--sort", order, "--columns", "error,method"]);
        assert_eq!(code, Some(0), "{said}");
        let rows = table.lines().skip(1);
        rows.filter_map(|line| line.split_whitespace().next()?.parse().ok())
            .collect()
    };
    let (up, mut down) = (order("error"), order("-error"));
    assert!(up.is_sorted() && up[0] < up[up.len() - 1], "{up:?}");
    down.reverse();
    assert_eq!(down, up);

    // As JSON the lines are those of the run.
    let asked = ["--where", "error >= 0", "--as", "json", "--rows", "1"];
    let (code, json, said) = results_of(&folder, &asked);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(json.lines().count(), 1);
    assert!(lines.contains(json.trim()));
    let measured = results.iter().filter(|result| !result["error"].is_null());
    let words = format!("1 of {} that meet it", measured.count());
    assert!(said.contains(&words), "{said}");
}

#[test]
fn what_cannot_be_asked_is_said_with_what_can() {
    let (_sequence, folder) = run();
    for (more, words) in [
        (["--where", "eror > 1"], "rotation"),
        (["--where", "error > far"], "a number expected"),
        (["--sort", "size"], "coverage"),
        (["--columns", "query,size"], "coverage"),
    ] {
        let (code, table, said) = results_of(&folder, &more);
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(words) && table.is_empty(), "{said}");
    }
    let (code, _, said) = results_of(&folder.join("nothing"), &[]);
    assert_eq!(code, Some(3), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
}

#[test]
fn tables_and_figures_come_in_the_form_that_is_asked_for() {
    let (sequence, folder) = run();
    let text = |more: &[&str]| {
        let (code, text, said) = results_of(&folder, more);
        assert_eq!(code, Some(0), "{more:?}: {said}");
        text
    };
    let csv = text(&["--as", "csv", "--where", "method = fb"]);
    assert!(csv.starts_with("scene,") || csv.contains("query,"), "{csv}");
    let queries = text(&["--where", "method = fb"]).lines().count();
    assert_eq!(csv.lines().count(), queries);
    let markdown = text(&["--as", "markdown", "--columns", "query,method"]);
    assert!(markdown.starts_with("| query | method |"), "{markdown}");
    let summary = text(&["--table", "summary", "--as", "markdown"]);
    assert!(summary.contains("| success (%) |"), "{summary}");
    assert!(text(&["--table", "summary", "--as", "latex"]).contains("\\begin{tabular}"));
    assert!(text(&["--table", "paper:1"]).contains("kitti/00"));

    let plot = sequence.path().join("recall.svg");
    let out = plot.to_str().expect("a plain path");
    text(&["--plot", "recall", "--out", out]);
    let svg = std::fs::read_to_string(&plot).expect("written");
    assert!(svg.starts_with("<svg") && svg.contains("kitti/42"), "{svg}");
}
