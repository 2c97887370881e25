//! Run folders that others sent: each line is checked against the plan, nothing outside of the folder changes, and a name
//! is a name in every export.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::PathBuf;

use image::GrayImage;
use tempfile::TempDir;

use crate::binary::{has, objects, run_in, text, write};
use crate::scene_toml;
use crate::small_sequence::SmallSequence;
use crate::strangers::{pipe, run};

const EVAL: &str = "eval sequences/42 --method fb,mi --radius 3 --reference nearest:1 -q --out";

/// A sequence with two finished shards, of which the second may be changed.
fn shards() -> SmallSequence {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    for shard in ["1/2", "2/2"] {
        let name = &shard[..1];
        sequence.run(&format!("{EVAL} {name} --shard {shard}")).ok();
    }
    sequence
}

#[test]
fn only_the_results_of_a_part_are_merged_as_its_results() {
    let sequence = shards();
    sequence.run("eval merge 1 2 --out whole").ok();
    assert_eq!(sequence.text("whole/results.jsonl").lines().count(), 8);
    let own = sequence.text("2/results.jsonl");
    let lines: Vec<&str> = own.split_inclusive('\n').collect();
    let other = sequence.text("1/results.jsonl");
    let later = own.replacen("posescope.result/1", "posescope.result/9", 1);
    let elsewhere = own.replace("\"scene\":\"kitti/42\"", "\"scene\":\"kitti/43\"");
    assert_ne!(elsewhere, own);
    for (damaged, words) in [
        (
            other.clone(),
            "2/results.jsonl:1: query 000001 with fb expected, 000000 with fb found ~ (4 lines)",
        ),
        (own.clone() + &own, "2/results.jsonl:5: no further line expected"),
        (
            [lines[0], lines[0], lines[2], lines[3]].concat(),
            "2/results.jsonl:2: query 000001 with mi expected",
        ),
        (later, "2/results.jsonl:1: schema posescope.result/1 expected, posescope.result/9 found"),
        (elsewhere, "2/results.jsonl:1: query 000001 of kitti/42 in kitti/42 expected"),
        (lines[..3].concat(), "1 of 2 queries done"),
    ] {
        write(sequence.path().join("2/results.jsonl"), &damaged);
        sequence.run("eval merge 1 2 --out merged").fails_in_one_line(3, words);
        assert!(!sequence.path().join("merged/run.toml").exists());
        // Other commands say the same of such a folder; a part of it is no mistake.
        if !words.contains("queries done") {
            for command in ["results 2", "results 2 --as html", "view 2", "compare 1 2"] {
                sequence.run(command).fails_in_one_line(3, words);
            }
            sequence.run(&format!("{EVAL} 2 --shard 2/2 --resume")).fails_in_one_line(3, words);
            assert_eq!(sequence.text("2/results.jsonl"), damaged);
        }
    }
    let times = sequence.text("1/timings.jsonl");
    write(sequence.path().join("2/results.jsonl"), own);
    write(sequence.path().join("2/timings.jsonl"), times);
    sequence.run("eval merge 1 2 --out merged").fails_in_one_line(3, "2/timings.jsonl:1:");
}

#[test]
fn no_link_leads_a_run_out_of_its_folder() {
    let sequence = SmallSequence::write();
    sequence.blacken("000005");
    sequence.run(&format!("{EVAL} run")).ok();
    let outside = sequence.path().join("precious");
    fs::create_dir(&outside).expect("writable");
    let precious = outside.join("file");
    write(&precious, "precious\n");
    let run = sequence.path().join("run");
    for name in ["results.jsonl", "timings.jsonl", "run.toml", "failures"] {
        let kept = sequence.path().join("kept");
        fs::rename(run.join(name), &kept).expect("is there");
        let target = if name == "failures" { &outside } else { &precious };
        symlink(target, run.join(name)).expect("writable");
        let said = sequence.run(&format!("{EVAL} run --resume"));
        said.fails_in_one_line(3, &format!("run/{name}: ~ a link found"));
        assert_eq!(text(&precious), "precious\n");
        assert_eq!(fs::read_dir(&outside).expect("ours").count(), 1);
        fs::remove_file(run.join(name)).expect("ours");
        fs::rename(&kept, run.join(name)).expect("ours");
    }
    // A second name of a file is one outside, too, and what only reads it may.
    for name in ["results.jsonl", "timings.jsonl"] {
        let other = outside.join(name);
        fs::hard_link(run.join(name), &other).expect("writable");
        let lines = text(&other);
        let last = lines.trim_end().rfind('\n').expect("several lines");
        write(run.join(name), &lines[..=last]);
        let said = sequence.run(&format!("{EVAL} run --resume"));
        said.fails_in_one_line(3, &format!("run/{name}: ~ 2 names (hard links) found"));
        assert_eq!(text(&other), &lines[..=last]);
        sequence.run("results run").ok();
        fs::remove_file(run.join(name)).expect("ours");
        fs::remove_file(other).expect("ours");
        write(run.join(name), lines);
    }
    // So is a link in the folder of an export.
    fs::create_dir(sequence.path().join("model")).expect("writable");
    symlink(&precious, sequence.path().join("model/images.txt")).expect("writable");
    sequence.run("results run --where 'method = mi' --as colmap --out model").ok();
    assert_eq!(text(&precious), "precious\n");
    has(&sequence.text("model/images.txt"), "# IMAGE_ID");
    // A recording that is a link is none of the part's.
    let recording = fs::read_dir(run.join("failures")).expect("ours").flatten().next();
    let recording = recording.expect("a failure").path();
    fs::remove_file(&recording).expect("ours");
    symlink(&precious, &recording).expect("writable");
    sequence.run("eval merge run --out merged").ok();
    let copied = fs::read_dir(sequence.path().join("merged/failures")).expect("made").flatten();
    let copied: Vec<PathBuf> = copied.map(|entry| entry.path()).collect();
    assert!(copied.iter().all(|path| fs::read(path).expect("ours") != b"precious\n"), "{copied:?}");
    sequence.run(&format!("{EVAL} run --resume")).ok();
}

#[test]
fn what_is_no_file_of_a_run_is_not_waited_for() {
    let sequence = SmallSequence::write();
    sequence.run(&format!("{EVAL} run")).ok();
    let path = |name: &str| sequence.path().join(name);
    for (name, command) in [
        ("run/run.toml", "results run"),
        ("run/results.jsonl", "results run"),
        ("run/timings.jsonl", "eval merge run --out merged"),
        ("run/summary.json", "results run --as html --out x.html"),
    ] {
        let kept = path("kept");
        fs::rename(path(name), &kept).expect("is there");
        pipe(&path(name));
        let words = format!("{name}: a file expected, a pipe found");
        run(sequence.path(), command).fails_in_one_line(3, &words);
        fs::remove_file(path(name)).expect("ours");
        symlink("/dev/zero", path(name)).expect("writable");
        let words = format!("{name}: a file expected");
        run(sequence.path(), command).fails_in_one_line(3, &words);
        fs::remove_file(path(name)).expect("ours");
        fs::rename(&kept, path(name)).expect("ours");
    }
    // A run names its files: none of them is read without end.
    let run_file = sequence.text("run/run.toml");
    let with_gps = run_file.replacen("[protocol]\n", "[protocol]\ngps = \"/dev/zero\"\n", 1);
    assert_ne!(with_gps, run_file);
    write(path("run/run.toml"), with_gps);
    let said = run(sequence.path(), "results run --as html --out x.html").ok();
    has(&said.err, "x.html");
    has(&sequence.text("x.html"), "/dev/zero: a file expected, a device found");
}

#[test]
fn a_position_of_no_place_is_refused_where_it_enters() {
    let sequence = SmallSequence::write();
    let estimates = sequence.path().join("other.txt");
    let line = format!("{EVAL} run --estimates other=other.txt").replace("fb,mi", "fb,other");
    for (content, words) in [
        (
            "name x y z qx qy qz qw\n000004 1e155 0 0 0 0 0 1\n000005 0 0 5 0 0 0 1\n",
            "other.txt:2: a position within 1e12",
        ),
        (
            "1 0 0 1e155 0 1 0 0 0 0 1 4\n1 0 0 0 0 1 0 0 0 0 1 5\n1 0 0 0 0 1 0 0 0 0 1 6\n",
            "other.txt: a position within 1e12",
        ),
    ] {
        write(&estimates, content);
        // What was there stays, and nothing is left besides.
        let refused = sequence.path().join("refused");
        let line = line.replace("--out run", "--out refused");
        sequence.run(&line).fails_in_one_line(3, words);
        assert!(!refused.exists());
        fs::create_dir(&refused).expect("writable");
        sequence.run(&line).fails_in_one_line(3, words);
        assert_eq!(fs::read_dir(&refused).expect("still there").count(), 0);
        fs::remove_dir(&refused).expect("ours");
    }
    write(&estimates, "name x y z qx qy qz qw\n000004 1e6 0 0 0 0 0 1\n000005 0 0 5 0 0 0 1\n");
    sequence.run(&line).ok();
    sequence.run("results run").ok();
    // A result that was edited: one line, and no axis of a million numbers.
    let results = sequence.text("run/results.jsonl");
    let whole: Vec<serde_json::Value> = objects(&results);
    for (key, number, refusal) in [
        ("/error/translation_m", 1e308, "lengths up to 1e150 expected"),
        ("/error/translation_m", 1e120, ""),
        ("/error/translation_m", -5.0, "an error from 0 on"),
        ("/error/rotation_deg", 1e308, "angles up to 180° expected"),
        ("/initial_error/max_euler_deg", -1.0, "angles up to 180° expected"),
        ("/confidence/probability", 1e308, "a probability from 0 to 1 expected, 1e308 found"),
        ("/confidence/probability", -0.5, "a probability from 0 to 1 expected"),
    ] {
        let mut lines = whole.clone();
        let mut places = lines.iter_mut().filter_map(|line| line.pointer_mut(key));
        *places.next().expect("there") = number.into();
        let text: String = lines.iter().map(|line| format!("{line}\n")).collect();
        write(sequence.path().join("run/results.jsonl"), text);
        for command in ["results run --as html --out x.html", "results run --table summary"] {
            let said = sequence.run(command);
            if refusal.is_empty() {
                said.ok();
            } else {
                said.fails(3, refusal);
            }
        }
    }
    let poses: String = (0..8).map(|z| format!("1 0 0 1e200 0 1 0 0 0 0 1 {z}\n")).collect();
    write(sequence.poses(), poses);
    sequence.run("doctor sequences/42").fails(3, "position within 1e12");
}

#[test]
fn a_name_of_any_length_has_a_recording_of_its_own() {
    let root = TempDir::new().expect("a folder");
    scene_toml::write(root.path());
    let names = ["x".repeat(200) + "1", "x".repeat(200) + "2", "a b".to_owned(), "a+b".to_owned()];
    let photos = root.path().join("photos");
    let black = GrayImage::new(160, 64);
    for name in &names {
        black.save(photos.join(format!("{name}.png"))).expect("writable");
    }
    let [x, y, z] = scene_toml::ORIGIN;
    let pose = |at: usize| format!("1 0 0 {x} 0 1 0 {y} 0 0 1 {}\n", z + at as f64);
    let poses: String = (0..3 + names.len()).map(pose).collect();
    write(root.path().join("poses.txt"), poses);
    let queries: String = names.iter().map(|name| format!("--query '{name}' ")).collect();
    let line =
        format!("eval . {queries} --method fb --reference nearest:1 --radius 3 -q --out run");
    run_in(root.path(), &line).ok();
    let files = fs::read_dir(root.path().join("run/failures")).expect("made").flatten();
    let files: Vec<String> =
        files.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    assert_eq!(files.len(), 4, "{files:?}");
    assert!(files.iter().all(|file| file.len() <= 110), "{files:?}");
    let page = text(root.path().join("run/report.html"));
    for file in &files {
        has(&page, file);
    }
}

/// Names as bad as the formats of scenes allow, and of a run that somebody edited.
#[test]
fn no_writer_takes_a_name_for_more_than_a_name() {
    let sequence = SmallSequence::write();
    sequence.run(&format!("{EVAL} run").replace("fb,mi", "fb")).ok();
    let (run_file, results) = (sequence.text("run/run.toml"), sequence.text("run/results.jsonl"));
    let renamed = |name: &str| {
        let (toml, json) =
            (toml::Value::from(name).to_string(), serde_json::json!(name).to_string());
        write(sequence.path().join("run/run.toml"), run_file.replace("\"000005\"", &toml));
        let results = results.replace("\"query\":\"000005\"", &format!("\"query\":{json}"));
        write(
            sequence.path().join("run/results.jsonl"),
            results.replace("[\"000005\"]", &format!("[{json}]")),
        );
    };
    let said = |line: &str| sequence.run(line).ok().out;
    for name in ["a\nb", "a\u{1b}[31mb", "z\n000004 1 0 0 0 7 7 7\nz"] {
        renamed(name);
        for command in [
            "results run",
            "results run --as vloc",
            "results run --as html --out x.html",
            "view run",
        ] {
            let said = sequence
                .run(command)
                .fails_in_one_line(3, "names without control characters expected");
            assert!(!said.err.contains('\u{1b}'));
        }
    }
    renamed("=cmd|' /C calc'!A0");
    has(&said("results run --as csv"), "\"'=cmd|' /C calc'!A0\"");
    renamed("</td><script>alert(1)</script>");
    for command in ["results run --as markdown", "results run --as html --out x.html"] {
        let all = said(command);
        assert!(!all.contains("<script>alert"), "{all}");
    }
    assert!(!sequence.text("x.html").contains("<script>alert"));
    renamed("[x](http://evil)");
    assert!(!said("results run --as markdown").contains("](http"));
    renamed("\\input{/etc/passwd}%");
    assert!(!said("results run --as latex").contains("\\input"));
    for name in ["IMG 0815 (1)", "a,b", "#a"] {
        renamed(name);
        sequence.run("results run --as vloc").fails(2, "vloc has names without white space");
        sequence.run("results run --as colmap --out model").ok();
        has(&sequence.text("model/images.txt"), name);
    }
    renamed("cam0/ü-1.x_y");
    has(&said("results run --as vloc"), "cam0/ü-1.x_y ");
    // A mark that turns the direction, and a control of eight bits, are shown.
    renamed("a\u{202e}b");
    assert!(!said("results run").contains('\u{202e}'));
}
