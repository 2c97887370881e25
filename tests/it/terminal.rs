//! Results as a terminal of 80 columns and a pipe show them.

use assert_cmd::Command;

use crate::binary::posescope;
use crate::small_sequence::SmallSequence;

/// What is printed for a terminal of this width, or in a pipe.
fn printed(command: &mut Command, columns: Option<&str>) -> String {
    match columns {
        Some(columns) => command.env("COLUMNS", columns),
        None => command.env_remove("COLUMNS"),
    };
    let output = command.output().expect("the binary starts");
    assert!(output.status.success());
    String::from_utf8(output.stdout).expect("text")
}

fn run(sequence: &SmallSequence) -> Command {
    let mut command = posescope();
    command
        .arg("run")
        .arg(sequence.folder())
        .args(["--query", "5", "--query", "7", "--reference", "4"])
        .args(["--method", "fb,mi"]);
    command
}

#[track_caller]
fn expect_narrow(text: &str, columns: usize) {
    for line in text.lines() {
        assert!(line.chars().count() <= columns, "{line}\n{text}");
    }
}

/// Of every word and number, whatever the arrangement.
fn sorted_words(text: &str) -> Vec<&str> {
    let mut words: Vec<&str> = text.split_whitespace().collect();
    words.sort_unstable();
    words.dedup();
    words
}

#[test]
fn a_pipe_has_a_line_for_each_result_and_no_rules() {
    let sequence = SmallSequence::write();
    let text = printed(&mut run(&sequence), None);
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("query   reference  "), "{text}");
    for (line, (query, method)) in lines[1..].iter().zip([
        ("000005", "fb"),
        ("000005", "mi"),
        ("000007", "fb"),
        ("000007", "mi"),
    ]) {
        let cells: Vec<&str> = line.split("  ").map(str::trim).collect();
        assert_eq!((cells[0], cells[1]), (query, "000004"), "{text}");
        assert!(cells.contains(&method), "{text}");
    }
    assert!(!text.contains(['─', '═', '│']), "{text}");
}

#[test]
fn eighty_columns_hold_every_result_with_whole_words() {
    let sequence = SmallSequence::write();
    let narrow = printed(&mut run(&sequence), Some("80"));
    expect_narrow(&narrow, 80);
    assert!(
        narrow.starts_with("query 000005, reference 000004, start 1.000 m\n"),
        "{narrow}"
    );
    // Nothing of what a wide terminal shows is missing or broken, but the times.
    let wide = printed(&mut run(&sequence), Some("400"));
    let known = sorted_words(&narrow);
    let rows = wide.split_once('\n').map_or("", |(_, rows)| rows);
    for word in sorted_words(rows) {
        let is_time = word.parse::<f64>().is_ok();
        let plain = |word: &str| word.trim_end_matches(',').to_owned();
        let has = |other: &&str| plain(other) == plain(word);
        assert!(
            is_time || known.iter().any(has),
            "`{word}` of\n{wide}\nin\n{narrow}"
        );
    }
}

#[test]
fn parameters_keep_their_names_whole_at_eighty_columns() {
    let narrow = printed(posescope().arg("params"), Some("80"));
    expect_narrow(&narrow, 80);
    let piped = printed(posescope().arg("params"), None);
    for line in piped.lines().skip(1) {
        let name = line.split_whitespace().next().expect("a name");
        assert!(narrow.contains(&format!("\n  {name} ")), "{name}");
    }
}

#[test]
fn an_evaluation_fits_eighty_columns_and_is_markdown_in_a_pipe() {
    let sequence = SmallSequence::write();
    let eval = |out: &str| {
        let mut command = posescope();
        command
            .arg("eval")
            .arg(sequence.folder())
            .args(["--method", "fb,mi", "--out"])
            .arg(sequence.path().join(out));
        command
    };
    let narrow = printed(&mut eval("a"), Some("80"));
    expect_narrow(&narrow, 80);
    assert!(!narrow.contains('|'), "{narrow}");
    let label = narrow.lines().find(|line| line.contains("median (m)"));
    assert_eq!(
        label.map(|line| line.split_whitespace().count()),
        Some(4),
        "{narrow}"
    );
    let piped = printed(&mut eval("b"), None);
    assert!(piped.contains("|:--|--:|"), "{piped}");
}
