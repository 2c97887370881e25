//! `posescope results` as a process.

use serde_json::Value;

use crate::binary::{Said, has, objects, refused};
use crate::small_sequence::SmallSequence;

/// A sequence with a `run` over its frames.
fn finished() -> SmallSequence {
    let sequence = SmallSequence::write();
    sequence.run("eval sequences/42 --method fb,mi --radius 3 --keep-failures 0 --out run").ok();
    sequence
}

#[track_caller]
fn results(sequence: &SmallSequence, words: &str) -> Said {
    sequence.run(&format!("results run {words}")).ok()
}

/// The numbers in the first column of a table.
fn numbers(table: &str) -> Vec<f64> {
    let rows = table.lines().skip(1);
    rows.filter_map(|line| line.split_whitespace().next()?.parse().ok()).collect()
}

#[test]
fn results_are_chosen_sorted_and_counted() {
    let sequence = finished();
    let lines = sequence.text("run/results.jsonl");
    let all: Vec<Value> = objects(&lines);
    let of_mi = all.iter().filter(|result| result["method"] == "mi");
    let errors = of_mi.filter_map(|result| result["error"]["translation_m"].as_f64());
    let mut wanted: Vec<f64> = errors.collect();
    wanted.sort_by(|a, b| b.total_cmp(a));
    // An error that some poses stay below and some do not.
    let limit = wanted[0];
    wanted.retain(|error| *error < limit);
    assert!(!wanted.is_empty());

    let condition = format!("--where 'method = MI and error < {limit}'");
    let said = results(&sequence, &format!("{condition} --sort -error --columns error,query"));
    assert_eq!(said.err.trim(), format!("{} of {} results", wanted.len(), all.len()));
    let shown = numbers(&said.out);
    assert_eq!(shown.len(), wanted.len());
    for (shown, wanted) in shown.iter().zip(&wanted) {
        assert!((shown - wanted).abs() <= 5e-4, "{shown} {wanted}");
    }

    // Of one order the other is the reverse, and what has no error comes last in both.
    let [up, mut down] = ["error", "-error"].map(|order| {
        numbers(&results(&sequence, &format!("--sort {order} --columns error,method")).out)
    });
    assert!(up.is_sorted() && up[0] < up[up.len() - 1], "{up:?}");
    down.reverse();
    assert_eq!(down, up);

    // As JSON the lines are those of the run.
    let said = results(&sequence, "--where 'error >= 0' --as json --rows 1");
    assert_eq!(said.out.lines().count(), 1);
    has(&lines, said.out.trim());
    let measured = all.iter().filter(|result| !result["error"].is_null()).count();
    has(&said.err, &format!("1 of {measured} that meet the condition"));
}

#[test]
fn what_cannot_be_asked_is_said_with_what_can() {
    let sequence = finished();
    for (words, expected) in [
        ("--where 'eror > 1'", "rotation"),
        ("--where 'error > far'", "a number expected"),
        ("--sort size", "coverage"),
        ("--columns query,size", "coverage"),
    ] {
        let said = sequence.run(&format!("results run {words}"));
        assert_eq!((said.code, &*said.out), (Some(2), ""), "{}", said.err);
        has(&said.err, expected);
    }
    refused(sequence.path(), "3 | results nothing | nothing");
}

#[test]
fn tables_and_figures_come_in_the_form_that_is_asked_for() {
    let sequence = finished();
    let text = |words: &str| results(&sequence, words).out;
    let csv = text("--as csv --where 'method = fb'");
    has(csv.lines().next().expect("a head"), "query,");
    assert_eq!(csv.lines().count(), text("--where 'method = fb'").lines().count());
    let markdown = text("--as markdown --columns query,method");
    assert!(markdown.starts_with("| query | method |"), "{markdown}");
    has(&text("--table summary --as markdown"), "| success (%) |");
    has(&text("--table summary --as latex"), "\\begin{tabular}");
    has(&text("--table paper:1"), "kitti/00");
    text("--plot recall --out recall.svg");
    let svg = sequence.text("recall.svg");
    assert!(svg.starts_with("<svg") && svg.contains("kitti/42"), "{svg}");
}

/// Each option with each form: it is obeyed, or refused with its name.
#[test]
fn no_option_is_dropped() {
    let sequence = finished();
    let strict = "--right 0.0000001m,0.0000001deg";
    let options = [
        "--where 'method = fb'",
        "--sort -error",
        "--rows 1",
        "--columns query,error",
        "--table summary",
        strict,
    ];
    for (form, obeyed) in [
        ("--as text", "--where --sort --rows --columns --table --right"),
        ("--as csv", "--where --sort --rows --columns --table --right"),
        ("--as markdown", "--where --sort --rows --columns --table --right"),
        ("--as latex", "--where --sort --rows --columns --table --right"),
        ("--as json", "--where --sort --rows --right"),
        ("--as html", ""),
        ("--as vloc --where 'method = fb'", "--right"),
        ("--plot recall", "--right"),
        ("--table summary", "--where --right"),
    ] {
        for option in options {
            let name = option.split(' ').next().expect("a name");
            if form.contains(name) {
                continue;
            }
            let said = sequence.run(&format!("results run {form} {option}"));
            if obeyed.split(' ').any(|obeyed| obeyed == name) {
                said.ok();
            } else {
                said.fails(2, &format!("{name} has no effect"));
            }
        }
    }
    sequence.run("results run --plot recall --as csv").fails_with(2, "--plot ~ --as");
    // What is right by another measure is so in each form.
    let json = results(&sequence, &format!("--as json {strict}")).out;
    assert!(!json.contains("\"grade\":\"right\""), "{json}");
    has(&results(&sequence, "--as json --right 100m,180deg").out, "\"grade\":\"right\"");
    let right = "--where 'method = fb and grade = right' --as vloc";
    sequence.run(&format!("results run {right} {strict}")).fails(2, "no result");
    assert!(!results(&sequence, &format!("{right} --right 100m,180deg")).out.is_empty());
}
