//! `--compute`: on a graphics card results have the bytes that they have on the processor.

use crate::binary::{Said, command_in, has, refused};
use crate::small_sequence::SmallSequence;

/// What hides every driver.
const NOWHERE: [(&str, &str); 2] =
    [("VK_DRIVER_FILES", "/nonexistent.json"), ("VK_ICD_FILENAMES", "/nonexistent.json")];

/// An evaluation into a folder of the name of what it computes on.
fn eval(compute: &str) -> String {
    let methods = "--method pm,mi,hy,nid --radius 2 --reference random:2 --query 3";
    let grid = "--set grid.coarse_step=0.5 -q";
    format!("eval sequences/42 {methods} {grid} --compute {compute} --out {compute}")
}

/// Whether there is no card to test with.
fn is_skipped(said: &Said) -> bool {
    let is_skipped = said.code == Some(5) && said.err.contains("no graphics card");
    if is_skipped {
        println!("skipped: {}", said.err.trim());
    }
    is_skipped
}

#[test]
fn results_have_the_same_bytes_wherever_hypotheses_are_scored() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let said = sequence.run(&eval("gpu"));
    if is_skipped(&said) {
        return;
    }
    said.ok();
    for compute in ["cpu", "auto"] {
        sequence.run(&eval(compute)).ok();
        let results = |name: &str| sequence.text(&format!("{name}/results.jsonl"));
        assert!(results(compute) == results("gpu"), "{compute} differs");
    }
}

#[test]
fn who_asks_for_a_card_is_told_once_which_methods_search_without_it() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let run = |compute: &str| {
        let line = "run sequences/42 --query 0 --query 3 --reference nearest:1 --radius 2";
        sequence.run(&format!("{line} --method pm,mi6 --compute {compute}"))
    };
    let without = |said: &Said| said.err.matches("does not use the graphics card").count();
    let asked = run("gpu");
    if is_skipped(&asked) {
        return;
    }
    assert_eq!(without(&asked), 1, "{}", asked.err);
    has(&asked.err, "mi6 does not use the graphics card: it compares more than grey values\n");
    assert_eq!(without(&run("auto")), 0);
}

#[test]
fn without_a_card_who_asks_for_one_is_told_in_one_line_and_others_are_served() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let hidden = |compute| Said::by(command_in(sequence.path(), &eval(compute)).envs(NOWHERE));
    hidden("gpu").fails_in_one_line(5, "no graphics card found");
    assert!(!sequence.path().join("gpu").exists(), "nothing was begun");
    assert_eq!(hidden("auto").ok().err, "");
    assert!(sequence.path().join("auto/results.jsonl").is_file());
}

#[test]
fn of_a_driver_the_user_hears_what_we_say_and_not_what_it_prints() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let line = eval("gpu").replace(" -q", "");
    let mut command = command_in(sequence.path(), &line);
    let said = Said::by(command.env_remove("XDG_RUNTIME_DIR").env_remove("WAYLAND_DISPLAY"));
    if is_skipped(&said) {
        return;
    }
    assert!(!said.err.contains("XDG_RUNTIME_DIR"), "{}", said.err);
    // What comes after the driver was loaded is heard again: without ground truth within a millimetre, a failure.
    let line = line.replace("--out gpu", "--out gate --gate 'median_m@pm < 0.000001'");
    let mut command = command_in(sequence.path(), &line);
    Said::by(command.env_remove("XDG_RUNTIME_DIR")).fails(1, "median_m@pm");
}

#[test]
fn a_dense_surface_is_written_and_least_near_the_truth() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let line =
        "run sequences/42 --query 2 --radius 2 --set surface.yaw_step=5 --set surface.step=0.5";
    let surface = format!("{line} --reference 1");
    let said = sequence.run(&format!("{surface} --surface surface.csv")).ok();
    assert!(said.out.starts_with("lowest cost 0."), "{}", said.out);
    has(&said.out, "from the truth");
    let table = sequence.text("surface.csv");
    let (head, rows) = table.split_once('\n').expect("a head");
    assert_eq!(head, "right_m,forward_m,yaw_deg,cost,covered_px");
    // The disc of 2 m in steps of half a metre.
    assert_eq!(rows.lines().count(), 49);
    sequence.run(&format!("{surface} --method pm --surface surface.png")).ok();
    let size = image::image_dimensions(sequence.path().join("surface.png")).expect("a picture");
    assert_eq!(size, (27, 27));
    let table = format!(
        "
        2 | {surface} --surface surface.txt | ends in .csv or .png
        2 | {line} --method mi --surface surface.csv | name them with --query and --reference
        2 | {line} --method fb --surface surface.csv | has no cost on a grid
        "
    );
    refused(sequence.path(), &table);
}
