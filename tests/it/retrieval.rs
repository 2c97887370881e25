//! `posescope index` and `--reference retrieve:K`, as their user drives them.

use std::fs;

use posescope::localize::QueryResult;
use posescope::sink::rerun::entities;
use tempfile::TempDir;

use crate::binary::{Said, has, objects, posescope, refused, run_in, text, write};
use crate::recording::{chunks, timelines};

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
    has(&run(&format!("{INDEX} --without 200")).err, "4 frames without 1");
    let found = run(RUN).results();
    assert!(!found[0].references.contains(&"000200".to_owned()));
    has(&run(INDEX).err, "5 frames,");
    refused(folder.path(), &format!("3 | {INDEX} --without 'no such frame' | no such frame"));

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
    has(&run(&format!("{INDEX} --without of-200")).err, "4 frames without 1");
}

#[test]
fn an_index_that_cannot_be_used_is_named_with_the_command_that_builds_it() {
    let folder = TempDir::new().expect("a folder");
    let run = |line: &str| run_in(folder.path(), line);
    let file = folder.path().join("an.index");
    let command = "`posescope index street --out an.index`";
    let missing = format!("the retrieval index does not exist ~ {command}");
    run(RUN).fails_in_one_line(3, &missing);

    run(INDEX).ok();
    let whole = fs::read(&file).expect("just written");
    let stale = "stale: it was built with surf.threshold = 500 instead of 600";
    run(&format!("{RUN} --set surf.threshold=600")).fails_with(3, stale);

    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    write(&file, damaged);
    run(RUN).fails_with(3, &format!("is damaged ~ {command}"));
    has(&run(INDEX).ok().err, "is damaged ~ rebuilding it");
    assert!(whole == fs::read(&file).expect("is there"), "other bytes");

    let letter = "a letter that must not be overwritten";
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
