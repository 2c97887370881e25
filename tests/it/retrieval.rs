//! `posescope index` and `--reference retrieve:K`, as their user drives them.

use std::fs;
use std::sync::Arc;

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
use tempfile::TempDir;

use crate::binary::{Said, has, objects, posescope, refused, run_in, text, write};
use crate::recording::{chunks, timelines};
use crate::walls_scene::{UNREADABLE, Walls};

/// Every two-hundredth frame of the street.
const INDEX: &str = "index street --every 200 --set index.words=300 --out an.index";

const RUN: &str = "run street --query 203 --method fb -q --reference retrieve:2 --radius 250 --json - \
                   --index an.index";

#[test]
fn an_index_is_built_once_and_finds_the_reference() {
    let folder = TempDir::new().expect("a folder");
    let run = |line: &str| run_in(folder.path(), line).ok();
    let index = || fs::read(folder.path().join("an.index")).expect("just written");
    has(&run(INDEX).err, "5 frames");
    let first = index();
    has(&run(INDEX).err, "up to date; --force");
    run(&format!("{INDEX} --force --threads 1"));
    assert!(first == index(), "other bytes");

    let results = run(&format!("{RUN} --save a.rrd")).results();
    // Within 250 m there are others; what looks alike is 3 m away.
    assert_eq!(results[0].references, ["000200"]);
    assert!(results[0].pose.is_some());
    let shown = timelines(&chunks(&folder.path().join("a.rrd")));
    for entity in [
        entities::RETRIEVAL_TABLE.to_owned(),
        entities::RETRIEVAL_PLACES.to_owned(),
        entities::rank(0),
        entities::rank_part(0, "matches"),
    ] {
        assert!(shown.contains_key(&entity), "{entity} is missing");
    }

    // Frames that are left out are not found and make it another index.
    has(
        &run(&format!("{INDEX} --without 200")).err,
        "4 frames without 1",
    );
    let found = run(RUN).results();
    assert!(!found[0].references.contains(&"000200".to_owned()));
    has(&run(INDEX).err, "5 frames,");
    refused(
        folder.path(),
        &format!("3 | {INDEX} --without 'no such frame' | no such frame"),
    );

    // An experiment asks the index that is named for each scene.
    let eval =
        "eval street --query 203 --method fb -q --reference retrieve:2 --prior 250 --out run";
    let table = format!(
        "
        2 | {eval} --index an.index --index an.index | 2 times for 1 scenes
        3 | {eval} --index elsewhere | `posescope index street --out elsewhere`
        "
    );
    refused(folder.path(), &table);
    run(&format!("{eval} --index an.index"));
    let results: Vec<QueryResult> = objects(&text(folder.path().join("run/results.jsonl")));
    assert_eq!(results[0].references[0], "000200");
    assert_eq!(results[0].fusion.map(|fusion| fusion.name), Some("r-wavg"));

    // The queries of a run, which its folder names.
    run("eval street --query 200 --method fb -q --reference nearest:1 --out of-200");
    has(
        &run(&format!("{INDEX} --without of-200")).err,
        "4 frames without 1",
    );
}

#[test]
fn an_index_that_cannot_be_used_is_named_with_the_command_that_builds_it() {
    let folder = TempDir::new().expect("a folder");
    let run = |line: &str| run_in(folder.path(), line);
    let file = folder.path().join("an.index");
    let command = "`posescope index street --out an.index`";
    let missing = format!("there is no retrieval index ~ {command}");
    run(RUN).fails_in_one_line(3, &missing);

    run(INDEX).ok();
    let whole = fs::read(&file).expect("just written");
    let stale = "stale: it was made with surf.threshold = 500, not 600";
    run(&format!("{RUN} --set surf.threshold=600")).fails_with(3, stale);

    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    write(&file, damaged);
    run(RUN).fails_with(3, &format!("is damaged ~ {command}"));
    has(&run(INDEX).ok().err, "is damaged ~ building it again");
    assert!(whole == fs::read(&file).expect("is there"), "other bytes");

    let letter = "a letter that somebody still needs";
    write(&file, letter);
    run(INDEX).fails_with(2, "not a retrieval index; --force");
    assert_eq!(text(&file), letter);
    run(&format!("{INDEX} --force")).ok();
    assert!(whole == fs::read(&file).expect("is there"), "other bytes");
}

#[test]
fn a_vocabulary_larger_than_its_descriptors_is_a_usage_error() {
    let folder = TempDir::new().expect("a folder");
    let line = "index street --every 400 --set index.words=1000000 --out an.index";
    run_in(folder.path(), line).fails_with(2, "too few ~ --set index.words");
    assert!(!folder.path().join("an.index").exists());
}

#[test]
fn without_a_cache_directory_a_file_has_to_be_named() {
    let mut command = posescope();
    command.env("POSESCOPE_CACHE", "").args(["index", "street"]);
    Said::by(&mut command).fails_with(2, "--out");
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
