//! `posescope index` and `--references retrieve:K`, as their user drives them.

use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

use crate::binary::posescope;

/// Every hundredth frame of the street.
fn index(file: &Path) -> Command {
    index_of(file, "300")
}

fn index_of(file: &Path, words: &str) -> Command {
    let mut command = posescope();
    command
        .args(["index", "street", "--every", "100", "--words", words])
        .arg("--output")
        .arg(file);
    command
}

fn run(file: &Path) -> Command {
    let mut command = posescope();
    command
        .args(["run", "street", "--query", "203", "--method", "fb", "-q"])
        .args(["--references", "retrieve:2", "--radius", "150"])
        .args(["--json", "-", "--index"])
        .arg(file);
    command
}

/// Exit code and what is said on stderr.
fn said(command: &mut Command) -> (Option<i32>, String) {
    let output = command.output().expect("the binary starts");
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), message)
}

fn file() -> (TempDir, PathBuf) {
    let folder = TempDir::new().expect("a temporary folder");
    let file = folder.path().join("street.posescope-index");
    (folder, file)
}

#[test]
fn an_index_is_built_once_and_finds_the_reference() {
    let (_folder, file) = file();
    let (code, message) = said(&mut index(&file));
    assert_eq!(code, Some(0), "{message}");
    assert!(message.contains("9 frames"), "{message}");
    let first = fs::read(&file).expect("just written");
    let (code, message) = said(&mut index(&file));
    assert_eq!(code, Some(0), "{message}");
    assert!(message.contains("up to date; --force"), "{message}");
    let (code, message) = said(index(&file).args(["--force", "--threads", "1"]));
    assert_eq!(code, Some(0), "{message}");
    assert!(first == fs::read(&file).expect("is there"), "other bytes");

    let output = run(&file).output().expect("the binary starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    let results: Vec<Value> = String::from_utf8_lossy(&output.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).expect("one object per line"))
        .collect();
    // Within 150 m there are others; what looks alike is 3 m away.
    assert_eq!(results[0]["references"], serde_json::json!(["000200"]));
    assert_eq!(results[0]["status"], "ok");
}

#[test]
fn an_index_that_cannot_be_used_is_named_with_the_command_that_builds_it() {
    let (_folder, file) = file();
    let command = format!("`posescope index street --output {}`", file.display());
    let (code, message) = said(&mut run(&file));
    assert_eq!(code, Some(3), "{message}");
    assert!(message.contains("there is no retrieval index"), "{message}");
    assert!(message.contains(&command), "{message}");
    assert_eq!(message.lines().count(), 1, "{message}");

    assert!(index(&file).output().expect("starts").status.success());
    let whole = fs::read(&file).expect("just written");
    let (code, message) = said(run(&file).args(["--set", "surf.threshold=600"]));
    assert_eq!(code, Some(3), "{message}");
    let words = "stale: it was made with surf.threshold = 500, not 600";
    assert!(message.contains(words), "{message}");

    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    fs::write(&file, damaged).expect("writable");
    let (code, message) = said(&mut run(&file));
    assert_eq!(code, Some(3), "{message}");
    assert!(message.contains("is damaged"), "{message}");
    assert!(message.contains(&command), "{message}");

    let (code, message) = said(&mut index(&file));
    assert_eq!(code, Some(0), "{message}");
    assert!(message.contains("is damaged"), "{message}");
    assert!(message.contains("building it again"), "{message}");
    assert!(whole == fs::read(&file).expect("is there"), "other bytes");
}

#[test]
fn a_file_of_another_kind_is_only_replaced_when_told_to() {
    let (_folder, file) = file();
    fs::write(&file, "a letter that somebody still needs").expect("writable");
    let (code, message) = said(&mut index(&file));
    assert_eq!(code, Some(2), "{message}");
    assert!(
        message.contains("not a retrieval index; --force"),
        "{message}"
    );
    let kept = fs::read_to_string(&file).expect("is there");
    assert_eq!(kept, "a letter that somebody still needs");
    let (code, message) = said(index(&file).arg("--force"));
    assert_eq!(code, Some(0), "{message}");
}

#[test]
fn a_vocabulary_larger_than_its_descriptors_is_a_usage_error() {
    let (_folder, file) = file();
    let (code, message) = said(&mut index_of(&file, "1000000"));
    assert_eq!(code, Some(2), "{message}");
    assert!(message.contains("too few"), "{message}");
    assert!(message.contains("--words"), "{message}");
    assert!(!file.exists());
}

#[test]
fn without_a_cache_directory_a_file_has_to_be_named() {
    let (code, message) = said(
        posescope()
            .env("POSESCOPE_CACHE", "")
            .args(["index", "street"]),
    );
    assert_eq!(code, Some(2), "{message}");
    assert!(message.contains("--output"), "{message}");
}
