//! Photos that cannot be read, and outputs that cannot be written: they cost what needs them, and nothing else.

use std::fs;

use posescope::localize::QueryResult;

use crate::binary::{has, objects, refused, write};
use crate::small_sequence::SmallSequence;

const FRAMES: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];

const EVAL: &str = "eval sequences/42 --method fb,pm --radius 3 --reference nearest:1 \
                    --keep-failures 0 --out";

#[test]
fn a_photo_that_cannot_be_read_costs_its_queries_alone_and_is_tried_again() {
    let sequence = SmallSequence::of(&FRAMES);
    sequence.run(&format!("{EVAL} sound")).ok();
    let photos = ["000002", "000005"].map(|name| sequence.image(name));
    let sound = photos.each_ref().map(|photo| fs::read(photo).expect("was written"));
    for photo in &photos {
        write(photo, "no photo");
    }
    let said = sequence.run(&format!("{EVAL} run --gate 'right@fb >= 1'"));
    let said = said.fails(
        3,
        "queries were not localised ~ 000002.png ~ --resume ~ gate `right@fb >= 1` failed",
    );
    has(&said.out, "fb ~ pm");
    for file in ["summary.json", "junit.xml", "report.html"] {
        assert!(sequence.path().join("run").join(file).is_file(), "{file}");
    }
    has(&sequence.text("run/junit.xml"), "type=\"I1\"");
    let results: Vec<QueryResult> = objects(&sequence.text("run/results.jsonl"));
    assert_eq!(results.len(), 2 * FRAMES.len());
    let is_unread = |result: &QueryResult| {
        let reason = result.reason.as_ref();
        reason.is_some_and(|reason| reason.code.name() == "I1")
    };
    assert!(
        results
            .iter()
            .filter(|one| ["000002", "000005"].contains(&one.query.as_str()))
            .all(is_unread)
    );
    assert!(!is_unread(&results[0]));
    // One is repaired, then the other.
    for (photo, sound) in photos.iter().zip(sound) {
        write(photo, sound);
        let last = photo == &photos[1];
        let said = sequence.run(&format!("{EVAL} run --resume"));
        assert_eq!(said.code, Some(if last { 0 } else { 3 }), "{}", said.err);
    }
    for file in ["results.jsonl", "report.html"] {
        let [run, sound] = ["run", "sound"].map(|of| sequence.text(&format!("{of}/{file}")));
        assert!(run == sound, "{file}");
    }
    let entries = fs::read_dir(sequence.path().join("run")).expect("a folder").flatten();
    assert!(
        !entries.map(|one| one.file_name()).any(|name| name.to_string_lossy().starts_with("tmp-"))
    );
}

/// A part of a run has each of its scenes examined.
#[test]
fn an_examination_that_nobody_asked_for_takes_no_report_away() {
    let sequence = SmallSequence::of(&FRAMES);
    write(sequence.image("000007"), "no photo");
    let said = sequence.run(&format!("{EVAL} run --query 0 --query 1 --shard 1/1")).ok();
    for file in ["summary.json", "junit.xml", "report.html"] {
        assert!(sequence.path().join("run").join(file).is_file(), "{file}: {}", said.err);
    }
}

#[test]
fn a_file_that_cannot_be_written_takes_no_other_away() {
    let sequence = SmallSequence::of(&FRAMES);
    sequence.run(&format!("{EVAL} run")).ok();
    let run = sequence.path().join("run");
    for file in ["summary.json", "junit.xml", "report.html"] {
        fs::remove_file(run.join(file)).expect("was written");
    }
    fs::create_dir(run.join("junit.xml")).expect("writable");
    let said = sequence.run(&format!("{EVAL} run --resume"));
    let said = said.fails(3, "junit.xml");
    has(&said.out, "fb ~ pm");
    assert!(run.join("summary.json").is_file() && run.join("report.html").is_file());
}

#[test]
fn what_a_run_is_judged_by_is_checked_before_its_first_query() {
    let sequence = SmallSequence::of(&FRAMES);
    refused(
        sequence.path(),
        &format!(
            "
            3 | {EVAL} run --baseline nothere | nothere ~ not a run folder
            2 | {EVAL} run --gate 'right@mi >= 0.9' | right@mi >= 0.9 ~ not run ~ --method
            "
        ),
    );
    assert!(!sequence.path().join("run").exists());
    sequence.run(&format!("{EVAL} run --gate 'right@fb >= 0' --gate 'right@pm >= 0'")).ok();
}
