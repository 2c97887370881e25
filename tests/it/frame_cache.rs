//! The cache of the street's frames, as its user meets it.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::binary::{Said, command_in};

/// Results and messages of one run on the street.
fn run(cache: impl AsRef<OsStr>, home: &Path) -> (String, String) {
    let line = "run street --query 70 --reference 62 --method fb --json - -q";
    let mut command = command_in(Path::new("."), line);
    command.env("POSESCOPE_CACHE", cache).env("HOME", home);
    let said = Said::by(command.env_remove("XDG_CACHE_HOME")).ok();
    (said.out, said.err)
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.path().is_dir() {
            found.extend(files(&entry.path()));
        } else {
            found.push(entry.path());
        }
    }
    found.sort();
    found
}

#[test]
fn results_are_the_same_fresh_from_the_cache_from_a_damaged_one_and_without() {
    let folder = TempDir::new().expect("a temporary folder");
    let (cache, home) = (folder.path().join("cache"), folder.path().join("home"));
    let (fresh, _) = run(&cache, &home);
    let kept = files(&cache);
    // The poses, two photos, one cloud.
    assert_eq!(kept.len(), 4, "{kept:?}");
    assert_eq!(run(&cache, &home).0, fresh);
    for file in &kept {
        fs::write(file, b"not a frame").expect("writable");
    }
    let (again, message) = run(&cache, &home);
    assert_eq!(again, fresh);
    assert_eq!(message, "", "a damaged cache is nobody's concern");
    assert_eq!(files(&cache), kept);
    assert_eq!(run("", &home).0, fresh);
    assert!(files(&home).is_empty(), "an empty value turns it off");
}

#[test]
fn a_cache_that_cannot_be_written_is_no_error() {
    let folder = TempDir::new().expect("a temporary folder");
    let file = folder.path().join("file");
    fs::write(&file, b"").expect("writable");
    assert_eq!(run(&file, folder.path()).1, "");
    #[cfg(target_os = "linux")]
    assert_eq!(run("/proc", folder.path()).1, "");
}
