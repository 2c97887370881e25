//! Bad input ends with one clear line and exit code 3, never with a panic.

use std::fs;
use std::path::Path;

use assert_cmd::Command;

use crate::binary::posescope;
use crate::small_sequence::SmallSequence;

fn run(scene: &Path, extra: &[&str]) -> Command {
    let mut command = posescope();
    command
        .arg("run")
        .arg(scene)
        .args(["--query", "5", "--method", "mi"])
        .args(extra);
    command
}

/// Runs, and expects exit code 3 and a single line that holds all of `words`.
fn expect_one_line(command: &mut Command, words: &[&str]) {
    let output = command.output().expect("the binary starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    for word in words {
        assert!(message.contains(word), "`{word}` is missing in: {message}");
    }
}

const REFERENCE: [&str; 2] = ["--reference", "4"];

#[test]
fn the_undamaged_sequence_works() {
    let sequence = SmallSequence::write();
    run(&sequence.folder(), &REFERENCE).assert().code(0);
}

#[test]
fn a_missing_sequence_is_named() {
    let sequence = SmallSequence::write();
    let missing = sequence.path().join("sequences/77");
    expect_one_line(&mut run(&missing, &REFERENCE), &["sequences/77", "no such"]);
}

#[test]
fn a_folder_of_another_kind_is_not_taken_for_a_scene() {
    let sequence = SmallSequence::write();
    expect_one_line(
        &mut run(sequence.path(), &REFERENCE),
        &["not recognised", "kitti", "--format"],
    );
}

#[test]
fn an_unknown_query_is_told_which_frames_there_are() {
    let sequence = SmallSequence::write();
    let mut command = posescope();
    command
        .arg("run")
        .arg(sequence.folder())
        .args(["--query", "99", "--reference", "4"]);
    expect_one_line(&mut command, &["`99`", "000004 … 000007", "3 in all"]);
}

#[test]
fn a_damaged_file_is_named() {
    let sequence = SmallSequence::write();
    fs::write(sequence.scan("000004"), b"").expect("writable");
    expect_one_line(
        &mut run(&sequence.folder(), &REFERENCE),
        &["velodyne/000004.bin", "empty"],
    );
}

#[test]
fn outputs_that_cannot_be_written_are_named() {
    let sequence = SmallSequence::write();
    for option in ["--json", "--save"] {
        let nowhere = sequence.path().join("no/such/folder/out");
        let nowhere = nowhere.to_str().expect("a plain path");
        let arguments = [REFERENCE[0], REFERENCE[1], option, nowhere];
        expect_one_line(
            &mut run(&sequence.folder(), &arguments),
            &["no/such/folder/out"],
        );
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_and_the_table_is_shown_all_the_same() {
    let sequence = SmallSequence::write();
    let arguments = [REFERENCE[0], REFERENCE[1], "--save", "/dev/full"];
    expect_one_line(
        &mut run(&sequence.folder(), &arguments),
        &["/dev/full", "No space left"],
    );
    let arguments = [REFERENCE[0], REFERENCE[1], "--json", "/dev/full"];
    let mut command = run(&sequence.folder(), &arguments);
    expect_one_line(&mut command, &["/dev/full", "No space left"]);
    let output = command.output().expect("the binary starts");
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(table.contains("000005"), "{table}");
}

/// A limit on the size of files stands in for a disk that fills while the recording is written.
#[cfg(target_os = "linux")]
#[test]
fn a_recording_that_breaks_off_costs_no_result() {
    let sequence = SmallSequence::write();
    let recording = sequence.path().join("cut.rrd");
    let binary = assert_cmd::cargo::cargo_bin!("posescope");
    let script = format!(
        "trap '' XFSZ; ulimit -f 40; exec '{}' run '{}' --query 5 --reference 4 --save '{}'",
        binary.display(),
        sequence.folder().display(),
        recording.display()
    );
    let mut command = Command::new("bash");
    command.args(["-c", &script]);
    expect_one_line(&mut command, &["cut.rrd", "incomplete", "File too large"]);
    let table = command.output().expect("the binary starts").stdout;
    let table = String::from_utf8_lossy(&table);
    for method in ["fb", "pm", "mi", "hy"] {
        assert!(table.contains(method), "{table}");
    }
}

#[test]
fn a_configuration_that_cannot_be_read_or_understood_is_named() {
    let sequence = SmallSequence::write();
    let config = sequence.path().join("tuned.toml");
    let name = config.to_str().expect("a plain path");
    let arguments = [REFERENCE[0], REFERENCE[1], "--config", name];
    expect_one_line(&mut run(&sequence.folder(), &arguments), &["tuned.toml"]);
    fs::write(&config, "[fb]\nratio = 3\n").expect("writable");
    expect_one_line(
        &mut run(&sequence.folder(), &arguments),
        &["tuned.toml", "`fb.ratio` takes"],
    );
}
