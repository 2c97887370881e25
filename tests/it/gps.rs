//! Rough positions of queries, around which their references are sought.

use std::path::PathBuf;
use std::sync::Arc;

use posescope::scene::{self, Scene};
use serde_json::{Value, json};

use crate::binary::{Said, objects, write};
use crate::damage;
use crate::small_sequence::{HEIGHT, SmallSequence, WIDTH, wall};

fn table(sequence: &SmallSequence, text: &str) -> PathBuf {
    let path = sequence.path().join("gps.csv");
    write(&path, text);
    path
}

/// A run of a loose photo called `mine`.
fn run(sequence: &SmallSequence, radius: &str) -> Said {
    let photo = sequence.path().join("mine.png");
    wall(WIDTH, HEIGHT).save(&photo).expect("writable");
    let photo = "--query mine.png --camera 100,100,80,32 --gps gps.csv";
    let line = format!("run sequences/42 {photo} --method mi --reference nearest:1 --json - -q");
    sequence.run(&format!("{line} --radius {radius}"))
}

fn references(said: Said) -> Value {
    let results: Vec<Value> = objects(&said.ok().out);
    results[0]["references"].clone()
}

#[test]
fn references_are_sought_around_the_position_that_is_given() {
    let sequence = SmallSequence::write();
    for (position, nearest) in [("0 0 4.2", "000004"), ("0.1 0 6.8", "000007")] {
        let text = format!("# from a phone\nname x y z\nmine.png {position}\n");
        table(&sequence, &text);
        assert_eq!(references(run(&sequence, "1")), json!([nearest]));
    }
    table(&sequence, "name,x,y,z\nmine,0,0,50\n");
    run(&sequence, "1").fails(3, "within 1 m of query mine");
}

#[test]
fn latitudes_and_longitudes_are_tied_to_the_scene_by_its_own_frames() {
    let sequence = SmallSequence::write();
    // The road runs east.
    let degrees = |way_m: f64| (way_m / (6_371_000.0 * 48.0_f64.to_radians().cos())).to_degrees();
    let mut text = "filename,Latitude,Longitude,Altitude\n".to_owned();
    for (name, way_m) in [("000004", 4.0), ("000005.png", 5.0), ("7", 7.0), ("mine.jpg", 6.8)] {
        text += &format!("{name},48.0,{:.9},300\n", 11.0 + degrees(way_m));
    }
    table(&sequence, &text);
    assert_eq!(references(run(&sequence, "0.5")), json!(["000007"]));
}

#[test]
fn a_table_that_is_none_is_refused_in_one_line() {
    let sequence = SmallSequence::write();
    let scene: Arc<dyn Scene> = damage::open(sequence.folder()).into();
    for (text, words) in [
        ("", "none found"),
        ("5 1 2 3\n", "gps.csv:1: a header with the columns"),
        ("name x y z\n", "one line per frame"),
        ("name x y z\n5 1 2\n", "gps.csv:2: 4 columns expected, 3 found"),
        ("name x y z\n5 1 2 north\n", "gps.csv:2: a number expected, `north` found"),
        ("name x y z\nother 1 2 3\n", "names like `000004`"),
        (
            "name x y z\n5 1 2 3\n000005.png 1 2 3\n",
            "gps.csv:3: one position per frame expected, frame 000005",
        ),
        ("name lat lon\n5 95 0\n", "gps.csv:2: a latitude"),
        ("name lat lon\n4 1 0\n5 2 0\n", "gps.csv: at least 3 frames with a known pose"),
        (
            "name lat lon\n4 1 0\n5 1 0\n7 1 0\n",
            "gps.csv: frames with a known pose at different places",
        ),
    ] {
        let gps = table(&sequence, text);
        let located = scene::located(Arc::clone(&scene), scene.as_ref(), &gps);
        let error = located.err().expect(text).to_string();
        damage::expect_words(&error, words);
    }
}

#[test]
fn an_evaluation_seeks_references_where_the_file_says_and_goes_on_with_the_same_file_only() {
    let sequence = SmallSequence::write();
    table(&sequence, "name x y z\n000005 0 0 4.1\n");
    let line = "eval sequences/42 --gps gps.csv --radius 0.5 --reference nearest:1 --method mi -q --out run";
    sequence.run(line).ok();
    let results: Vec<Value> = objects(&sequence.text("run/results.jsonl"));
    let found: Vec<&Value> = results.iter().map(|result| &result["references"]).collect();
    // The others are where their poses are, and nothing is near.
    assert_eq!(found, [&json!([]), &json!(["000004"]), &json!([])]);
    let again = format!("{line} --resume");
    sequence.run(&again).ok();
    table(&sequence, "name x y z\n000005 0 0 6.9\n");
    sequence.run(&again).fails(2, "gps.csv ~ other settings");
}
