//! Rough positions of queries, around which their references are sought.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use posescope::scene::{self, Scene};
use serde_json::Value;

use crate::binary::posescope;
use crate::damage;
use crate::small_sequence::{HEIGHT, SmallSequence, WIDTH, wall};

fn table(sequence: &SmallSequence, text: &str) -> PathBuf {
    let path = sequence.path().join("gps.csv");
    fs::write(&path, text).expect("writable");
    path
}

/// The references of a loose photo called `mine`, or what was said and the exit code.
fn references(sequence: &SmallSequence, gps: &Path, more: &[&str]) -> Result<Value, (String, i32)> {
    let photo = sequence.path().join("mine.png");
    wall(WIDTH, HEIGHT).save(&photo).expect("writable");
    let output = posescope()
        .arg("run")
        .arg(sequence.folder())
        .arg("--query")
        .arg(&photo)
        .arg("--gps")
        .arg(gps)
        .args(["--camera", "100,100,80,32", "--method", "mi"])
        .args(["--reference", "nearest:1", "--json", "-", "-q"])
        .args(more)
        .output()
        .expect("the binary starts");
    match output.status.code() {
        Some(0) => {
            let result: Value = serde_json::from_slice(&output.stdout).expect("one result");
            Ok(result["references"].clone())
        }
        code => Err((
            String::from_utf8_lossy(&output.stderr).into_owned(),
            code.expect("an exit code"),
        )),
    }
}

#[test]
fn references_are_sought_around_the_position_that_is_given() {
    let sequence = SmallSequence::write();
    for (position, nearest) in [("0 0 4.2", "000004"), ("0.1 0 6.8", "000007")] {
        let gps = table(
            &sequence,
            &format!("# from a phone\nname x y z\nmine.png {position}\n"),
        );
        let found = references(&sequence, &gps, &["--radius", "1"]).expect("it runs");
        assert_eq!(found, serde_json::json!([nearest]));
    }
    let gps = table(&sequence, "name,x,y,z\nmine,0,0,50\n");
    let (said, code) = references(&sequence, &gps, &["--radius", "1"]).expect_err("too far");
    assert!(
        code == 3 && said.contains("within 1 m of query mine"),
        "{said}"
    );
}

#[test]
fn latitudes_and_longitudes_are_tied_to_the_scene_by_its_own_frames() {
    let sequence = SmallSequence::write();
    // The road runs east.
    let degrees = |way_m: f64| way_m / (6_371_000.0 * 48.0_f64.to_radians().cos());
    let line = |name: &str, way_m: f64| {
        format!(
            "{name},48.0,{:.9},300\n",
            11.0 + degrees(way_m).to_degrees()
        )
    };
    let ties = [("000004", 4.0), ("000005.png", 5.0), ("7", 7.0)];
    let mut text = "filename,Latitude,Longitude,Altitude\n".to_owned();
    for (name, way_m) in ties {
        text += &line(name, way_m);
    }
    text += &line("mine.jpg", 6.8);
    let gps = table(&sequence, &text);
    let found = references(&sequence, &gps, &["--radius", "0.5"]).expect("it runs");
    assert_eq!(found, serde_json::json!(["000007"]));
}

#[test]
fn a_table_that_is_none_is_refused_in_one_line() {
    let sequence = SmallSequence::write();
    let folder = sequence.folder();
    let scene = scene::open(folder.to_str().expect("a plain path"), None).expect("our own");
    let scene: Arc<dyn Scene> = scene.into();
    for (text, words) in [
        ("", "none found"),
        ("5 1 2 3\n", "gps.csv:1: a first line with the columns"),
        ("name x y z\n", "a line per frame"),
        (
            "name x y z\n5 1 2\n",
            "gps.csv:2: 4 columns expected, 3 found",
        ),
        (
            "name x y z\n5 1 2 north\n",
            "gps.csv:2: a number expected, `north` found",
        ),
        ("name x y z\nother 1 2 3\n", "called such as `000004`"),
        (
            "name x y z\n5 1 2 3\n000005.png 1 2 3\n",
            "gps.csv:3: frame 000005 has a position already",
        ),
        ("name lat lon\n5 95 0\n", "gps.csv:2: a latitude"),
        (
            "name lat lon\n4 1 0\n5 2 0\n",
            "gps.csv: 3 frames with a known pose",
        ),
        (
            "name lat lon\n4 1 0\n5 1 0\n7 1 0\n",
            "gps.csv: frames with a known pose at different places",
        ),
    ] {
        let gps = table(&sequence, text);
        let located = scene::located(Arc::clone(&scene), scene.as_ref(), &gps);
        let error = located.err().expect(text).to_string();
        damage::expect_words(&error, &[words]);
    }
}

#[test]
fn an_evaluation_seeks_references_where_the_file_says_and_goes_on_with_the_same_file_only() {
    let sequence = SmallSequence::write();
    let gps = table(&sequence, "name x y z\n000005 0 0 4.1\n");
    let out = sequence.path().join("run");
    let eval = |more: &[&str]| {
        let output = posescope()
            .arg("eval")
            .arg(sequence.folder())
            .arg("--gps")
            .arg(&gps)
            .args([
                "--radius",
                "0.5",
                "--reference",
                "nearest:1",
                "--method",
                "mi",
                "-q",
            ])
            .arg("--out")
            .arg(&out)
            .args(more)
            .output()
            .expect("the binary starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said)
    };
    assert_eq!(eval(&[]).0, Some(0));
    let results = fs::read_to_string(out.join("results.jsonl")).expect("results");
    let found: Vec<Value> = results
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("a result")["references"].clone())
        .collect();
    // The others are where their poses are, and nothing is near.
    assert_eq!(
        found,
        [
            serde_json::json!([]),
            serde_json::json!(["000004"]),
            serde_json::json!([])
        ]
    );
    assert_eq!(eval(&["--resume"]).0, Some(0));
    fs::write(&gps, "name x y z\n000005 0 0 6.9\n").expect("writable");
    let (code, said) = eval(&["--resume"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(
        said.contains("gps.csv") && said.contains("asked for otherwise"),
        "{said}"
    );
}
