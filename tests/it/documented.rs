//! Every command of posescope that README and docs show is run, with fewer queries.

#[path = "../../src/cli/tests/commands.rs"]
mod commands;

use std::path::Path;

use assert_cmd::Command;
use tempfile::TempDir;

use crate::binary::posescope;
use crate::data;
use commands::{commands, documents, own_arguments};

/// What has to be there before the commands of a page are run, as its reader has it.
const BEFORE: [(&str, &[&str]); 2] = [
    ("ci.md", &["eval street --limit 1 --method mi --out baseline -q"]),
    (
        "other-systems.md",
        &[
            "eval street --limit 1 --method fb --radius 5 --out known -q",
            "results known --as vloc --out poses.txt",
            "run …/sequences/00 --query 3823 --reference 3814 --method fb --export-matches hloc-outputs -q",
        ],
    ),
];

/// The pages whose commands build an index or survey a map.
const KEEPING: [&str; 2] = ["retrieval.md", "trust.md"];

/// What is too long for a test, or wants what is not at hand, with the tests that do it otherwise.
const NOT_HERE: [(&str, &str); 11] = [
    ("eval street --query-scene street:night --preset large", "retrieval"),
    ("run SCENE --query IMG_0815.jpg", "loose_photo"),
    ("index …/sequences/00", "retrieval"),
    ("eval …/sequences/", "evaluation"),
    ("eval robotcar/", "robotcar"),
    ("eval MAP", "opinions"),
    ("run …/sequences/00 --all", "foreign"),
    ("view …/sequences/00 --query 3823 --estimates", "foreign"),
    ("lesson four-points", "lessons"),
    ("lesson light", "lessons"),
    ("run …/sequences/00 --query 3823 --reference 3814 --method pm,mi", "compute"),
];

/// The words of a command, as this page's reader would give them to a small machine.
fn adapted(own: &[String], sequences: Option<&Path>) -> Option<Vec<String>> {
    let line = own.join(" ");
    if NOT_HERE.iter().any(|(start, _)| line.starts_with(start)) {
        return None;
    }
    let mut words = Vec::new();
    let mut own = own.iter();
    while let Some(word) = own.next() {
        match word.as_str() {
            // Fewer are taken below.
            "--limit" | "--every" => {
                own.next();
            }
            "SCENE" => words.push("street".to_owned()),
            "…/sequences/00" => words.push(sequences?.join("00").display().to_string()),
            _ => words.push(word.clone()),
        }
    }
    let has = |word: &str| line.split(' ').any(|one| one == word);
    let briefer: &[&str] = match (has("index"), has("eval") && has("large")) {
        (true, _) => &["--set", "index.words=100", "--every", "100"],
        (_, true) => &["--limit", "1", "--method", "fb"],
        _ if has("survey") => &["--method", "fb"],
        _ if has("--limit") => &["--limit", "1"],
        _ if has("--surface") => &["--set", "surface.step=2", "--set", "surface.yaw_step=10"],
        _ => &[],
    };
    words.extend(briefer.iter().map(|word| (*word).to_owned()));
    Some(words)
}

fn run(folder: &Path, words: &[String], keeps: bool) {
    let mut command: Command = posescope();
    if keeps {
        // It is none of other tests' business.
        command.env("POSESCOPE_CACHE", folder.join("cache"));
    }
    command.current_dir(folder).args(words);
    command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    command.env_remove("GITHUB_STEP_SUMMARY");
    let output = command.output().expect("it runs");
    assert!(
        output.status.success(),
        "{words:?}: {}\n{}",
        output.status,
        String::from_utf8_lossy(&output.stderr)
    );
}

fn go_through(page: &str) {
    let sequences = data::sample("kitti/sequences");
    let path = documents().into_iter().find(|path| path.ends_with(page));
    let path = path.unwrap_or_else(|| panic!("{page} is a page"));
    let folder = TempDir::new().expect("a folder");
    let keeps = KEEPING.contains(&page);
    for (_, before) in BEFORE.iter().filter(|(name, _)| *name == page) {
        for line in *before {
            let words = shlex::split(line).expect("words");
            if let Some(words) = adapted(&words, sequences.as_deref()) {
                run(folder.path(), &words, keeps);
            }
        }
    }
    let mut done = 0;
    for words in commands(&path) {
        let Some(own) = own_arguments(&words) else {
            continue;
        };
        let Some(words) = adapted(own, sequences.as_deref()) else {
            println!("skipped: {}", words.join(" "));
            continue;
        };
        run(folder.path(), &words, keeps);
        done += 1;
    }
    assert!(done > 0 || sequences.is_none(), "{page} has no command that could be run");
}

/// The pages with commands of ours. Those with many have a test of their own, so that they run side by side.
const PAGES: [&str; 16] = [
    "README.md",
    "calibration.md",
    "ci.md",
    "compute.md",
    "diagnosis.md",
    "doctor.md",
    "lessons.md",
    "methods.md",
    "other-systems.md",
    "paper.md",
    "recordings.md",
    "results.md",
    "retrieval.md",
    "scenes.md",
    "street.md",
    "trust.md",
];

#[test]
fn every_page_with_commands_is_gone_through() {
    let pages = documents().into_iter().filter(|page| {
        let commands = commands(page);
        commands.iter().any(|words| own_arguments(words).is_some())
    });
    let names = pages.map(|page| page.file_name().expect("a name").to_owned());
    assert_eq!(names.collect::<Vec<_>>(), PAGES);
}

#[test]
fn the_readme_can_be_followed() {
    go_through("README.md");
}

#[test]
#[ignore = "runs every command of a page; .ci/nightly runs it"]
fn the_page_on_ci_can_be_followed() {
    go_through("ci.md");
}

#[test]
#[ignore = "runs every command of a page; .ci/nightly runs it"]
fn the_page_on_where_it_computes_can_be_followed() {
    go_through("compute.md");
}

#[test]
#[ignore = "runs every command of a page; .ci/nightly runs it"]
fn the_page_on_diagnosis_can_be_followed() {
    go_through("diagnosis.md");
}

#[test]
#[ignore = "runs every command of a page; .ci/nightly runs it"]
fn the_page_on_lessons_can_be_followed() {
    go_through("lessons.md");
}

#[test]
#[ignore = "runs every command of a page; .ci/nightly runs it"]
fn the_page_on_other_systems_can_be_followed() {
    go_through("other-systems.md");
}

#[test]
#[ignore = "runs every command of a page; .ci/nightly runs it"]
fn the_page_on_retrieval_can_be_followed() {
    go_through("retrieval.md");
}

#[test]
#[ignore = "runs every command of a page; .ci/nightly runs it"]
fn the_page_on_trust_can_be_followed() {
    go_through("trust.md");
}

#[test]
#[ignore = "runs every command of a page; .ci/nightly runs it"]
fn the_page_on_scenes_can_be_followed() {
    go_through("scenes.md");
}

#[test]
#[ignore = "runs every command of a page; .ci/nightly runs it"]
fn the_pages_with_a_command_or_two_can_be_followed() {
    for page in [
        "calibration.md",
        "doctor.md",
        "methods.md",
        "paper.md",
        "recordings.md",
        "results.md",
        "street.md",
    ] {
        go_through(page);
    }
}
