//! `posescope index` and `--reference retrieve:K`, as their user drives them.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use assert_cmd::Command;
use posescope::event::{Event, ReferencesRanked, Stage};
use posescope::geometry::Pose;
use posescope::localize::{
    LocalizeError, LocalizeObserver, Localizer, QueryResult, References, Request,
};
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::retrieval::{Criterion, Geometry, Ranked, RankedReference, ReferenceRanking};
use posescope::sink::rerun::entities;
use posescope::trace::{Cancelled, Record, Sink};
use serde_json::Value;
use tempfile::TempDir;

use crate::binary::posescope;
use crate::recording::{chunks, timelines};
use crate::walls_scene::{UNREADABLE, Walls};

/// Every hundredth frame of the street.
fn index(file: &Path) -> Command {
    index_of(file, "300")
}

fn index_of(file: &Path, words: &str) -> Command {
    let mut command = posescope();
    command
        .args(["index", "street", "--every", "100"])
        .args(["--set", &format!("index.words={words}"), "--out"])
        .arg(file);
    command
}

fn run(file: &Path) -> Command {
    let mut command = posescope();
    command
        .args(["run", "street", "--query", "203", "--method", "fb", "-q"])
        .args(["--reference", "retrieve:2", "--radius", "150"])
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

    let recording = file.with_extension("rrd");
    let output = run(&file).arg("--save").arg(&recording).output();
    let output = output.expect("the binary starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    let results: Vec<Value> = String::from_utf8_lossy(&output.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).expect("one object per line"))
        .collect();
    // Within 150 m there are others; what looks alike is 3 m away.
    assert_eq!(results[0]["references"], serde_json::json!(["000200"]));
    assert_eq!(results[0]["status"], "ok");
    let shown = timelines(&chunks(&recording));
    for entity in [
        entities::RETRIEVAL_TABLE.to_owned(),
        entities::RETRIEVAL_PLACES.to_owned(),
        entities::rank(0),
        entities::rank_part(0, "matches"),
    ] {
        assert!(shown.contains_key(&entity), "{entity} is missing");
    }
}

#[test]
fn frames_that_are_left_out_of_an_index_are_not_found_and_make_it_another() {
    let (folder, file) = file();
    let (code, message) = said(index(&file).args(["--without", "200"]));
    assert_eq!(code, Some(0), "{message}");
    assert!(message.contains("8 frames without 1"), "{message}");
    let output = run(&file).output().expect("the binary starts");
    let results = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(results.contains("\"references\":") && !results.contains("\"000200\""));
    // With that frame it is another index, which is built anew.
    let (code, message) = said(&mut index(&file));
    assert_eq!(code, Some(0), "{message}");
    assert!(message.contains("9 frames,"), "{message}");
    let (code, message) = said(index(&file).args(["--without", "no such frame"]));
    assert_eq!(code, Some(3), "{message}");

    // The queries of a run, which its folder names.
    let runs = folder.path().join("run");
    let eval = posescope()
        .args(["eval", "street", "--query", "200", "--method", "fb", "-q"])
        .args(["--reference", "nearest:1", "--out"])
        .arg(&runs)
        .output();
    assert!(eval.expect("the binary starts").status.success());
    let (code, message) = said(index(&file).arg("--without").arg(&runs));
    assert_eq!(code, Some(0), "{message}");
    assert!(message.contains("8 frames without 1"), "{message}");
}

#[test]
fn an_experiment_asks_the_index_that_is_named_for_each_scene() {
    let (folder, file) = file();
    assert!(index(&file).output().expect("starts").status.success());
    let runs = folder.path().join("run");
    let eval = |files: &[&Path]| {
        let mut command = posescope();
        command
            .args(["eval", "street", "--query", "203", "--method", "fb", "-q"])
            .args(["--reference", "retrieve:2", "--prior", "150"])
            .arg("--out")
            .arg(&runs);
        for file in files {
            command.arg("--index").arg(file);
        }
        command
    };
    let (code, message) = said(&mut eval(&[&file, &file]));
    assert_eq!(code, Some(2), "{message}");
    assert!(message.contains("2 times for 1 scenes"), "{message}");
    let elsewhere = folder.path().join("elsewhere");
    let (code, message) = said(&mut eval(&[&elsewhere]));
    assert_eq!(code, Some(3), "{message}");
    let command = format!("`posescope index street --out {}`", elsewhere.display());
    assert!(message.contains(&command), "{message}");

    let (code, message) = said(&mut eval(&[&file]));
    assert_eq!(code, Some(0), "{message}");
    let results = fs::read_to_string(runs.join("results.jsonl")).expect("was written");
    let result: Value = serde_json::from_str(results.trim()).expect("one result");
    assert_eq!(result["references"][0], "000200");
    assert_eq!(result["fusion"], "r-wavg");
}

#[test]
fn an_index_that_cannot_be_used_is_named_with_the_command_that_builds_it() {
    let (_folder, file) = file();
    let command = format!("`posescope index street --out {}`", file.display());
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
    assert!(message.contains("--set index.words"), "{message}");
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
    assert!(message.contains("--out"), "{message}");
}

/// Writes down what comes between the beginning of a query and that of its first method.
#[derive(Default)]
struct RecordingObserver {
    notes: Vec<String>,
    rankings: Vec<ReferencesRanked>,
}

impl Sink for RecordingObserver {
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        match &record.event {
            Event::StageStarted(event) if event.stage == Stage::Retrieve => {
                self.notes.push("retrieve".to_owned());
            }
            Event::StageEnded(event) if event.stage == Stage::Retrieve => {
                self.notes.push("retrieved".to_owned());
            }
            Event::ReferencesRanked(event) => {
                self.notes.push("ranking".to_owned());
                self.rankings.push(event.clone());
            }
            _ => {}
        }
        Ok(())
    }
}

impl LocalizeObserver for RecordingObserver {
    fn begin_query(&mut self, _: usize, _: &[Problem], _: Option<&Pose>) {
        self.notes.push("query".to_owned());
    }
    fn begin_method(&mut self, _: usize, method: Method) {
        self.notes.push(method.name().to_owned());
    }
}

fn localized(requests: &[Request], observer: &mut dyn LocalizeObserver) -> Vec<QueryResult> {
    let (scene, params) = (Walls::new(), Params::default());
    let mut results = Vec::new();
    Localizer::new(&scene, &scene, &params, 7)
        .localize(0, 1, requests, &[Method::FB], observer, |result, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        })
        .expect("readable");
    results
}

#[test]
fn a_ranking_is_told_once_after_the_query_and_a_lost_photo_does_not_matter() {
    let frames = [0, UNREADABLE].map(|frame| RankedReference {
        name: format!("{frame:06}"),
        world_from_camera: None,
        ranked: Ranked {
            frame,
            score: 0.5,
            geometry: Geometry::Unchecked,
        },
    });
    let ranking = Arc::new(ReferenceRanking {
        criterion: Criterion::Words,
        candidates: 2,
        chosen: 1,
        frames: frames.into(),
    });
    let request = |radius_m, ranking| Request {
        radius_m,
        references: References {
            frames: vec![0],
            ranking,
            within_m: None,
        },
        fusions: Vec::new(),
        setting: None,
    };
    let asked = |ranking: Option<&Arc<ReferenceRanking>>| {
        [3.0, 4.0].map(|radius_m| request(radius_m, ranking.cloned()))
    };
    let mut observer = RecordingObserver::default();
    let results = localized(&asked(Some(&ranking)), &mut observer);
    let expected = ["query", "retrieve", "ranking", "retrieved", "fb", "fb"];
    assert_eq!(observer.notes, expected);
    let told = &observer.rankings[0];
    assert_eq!(told.ranking, ranking);
    let is_there: Vec<bool> = told.photos.iter().map(Option::is_some).collect();
    assert_eq!(is_there, [true, false]);

    let mut other = RecordingObserver::default();
    assert_eq!(localized(&asked(None), &mut other), results);
    assert_eq!(other.notes, ["query", "fb", "fb"]);
}
