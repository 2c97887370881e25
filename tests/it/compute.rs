//! `--compute`: on a graphics card results have the bytes that they have on the processor.

use std::fs;
use std::path::Path;

use crate::binary::posescope;
use crate::small_sequence::SmallSequence;

/// What hides every driver.
const NOWHERE: [(&str, &str); 2] = [
    ("VK_DRIVER_FILES", "/nonexistent.json"),
    ("VK_ICD_FILENAMES", "/nonexistent.json"),
];

/// The exit code of an evaluation and what it said; its results are in the folder.
fn eval(
    sequence: &SmallSequence,
    compute: &str,
    out: &Path,
    hidden: bool,
) -> (Option<i32>, String) {
    let mut command = posescope();
    command.arg("eval").arg(sequence.folder());
    command.args([
        "--method",
        "pm,mi,hy,nid",
        "--radius",
        "3",
        "--reference",
        "random:2",
    ]);
    command.args([
        "--query",
        "0",
        "--query",
        "3",
        "--set",
        "grid.coarse_step=0.25",
        "-q",
    ]);
    command.args(["--compute", compute]).arg("--out").arg(out);
    if hidden {
        command.envs(NOWHERE);
    }
    let output = command.output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), said)
}

#[test]
fn results_have_the_same_bytes_wherever_hypotheses_are_scored() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let folder = |compute: &str| sequence.path().join(compute);
    let run = |compute: &str| eval(&sequence, compute, &folder(compute), false);
    let results = |compute| fs::read(folder(compute).join("results.jsonl")).expect("results");
    let (code, said) = run("gpu");
    if code == Some(5) && said.contains("no graphics card") {
        println!("skipped: {}", said.trim());
        return;
    }
    assert_eq!(code, Some(0), "{said}");
    for compute in ["cpu", "auto"] {
        let (code, said) = run(compute);
        assert_eq!(code, Some(0), "{said}");
        assert!(
            results(compute) == results("gpu"),
            "{compute} differs from gpu"
        );
    }
}

#[test]
fn who_asks_for_a_card_is_told_once_which_methods_search_without_it() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let said = |compute: &str| {
        let mut command = posescope();
        command.arg("run").arg(sequence.folder());
        command.args(["--query", "0", "--query", "3", "--reference", "nearest:1"]);
        command.args(["--radius", "2", "--method", "pm,mi6", "--compute", compute]);
        let output = command.output().expect("it starts");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said)
    };
    let (code, asked) = said("gpu");
    if code == Some(5) {
        println!("skipped: {}", asked.trim());
        return;
    }
    let without = |said: &str| -> Vec<String> {
        let lines = said
            .lines()
            .filter(|line| line.contains("not on the graphics card"));
        lines.map(str::to_owned).collect()
    };
    let lines = without(&asked);
    assert_eq!(lines.len(), 1, "{asked}");
    assert!(
        lines[0].ends_with(
            "mi6 searches on the processor, not on the graphics card: it compares three channels at once"
        ),
        "{asked}"
    );
    assert!(without(&said("auto").1).is_empty());
}

#[test]
fn without_a_card_who_asks_for_one_is_told_in_one_line_and_others_are_served() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let out = sequence.path().join("gpu");
    let (code, said) = eval(&sequence, "gpu", &out, true);
    assert_eq!(code, Some(5), "{said}");
    assert_eq!(said.trim().lines().count(), 1, "{said}");
    assert!(said.contains("no graphics card to compute on"), "{said}");
    assert!(!out.exists(), "nothing was begun");

    let out = sequence.path().join("auto");
    let (code, said) = eval(&sequence, "auto", &out, true);
    assert_eq!((code, said.as_str()), (Some(0), ""));
    assert!(out.join("results.jsonl").is_file());
}

#[test]
fn a_dense_surface_is_written_and_least_near_the_truth() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3]);
    let surface = |out: &str, extra: &[&str]| {
        let mut command = posescope();
        command.arg("run").arg(sequence.folder());
        command.args(["--query", "2", "--radius", "2"]);
        command.args(["--set", "surface.yaw_step=5", "--set", "surface.step=0.5"]);
        command
            .args(extra)
            .arg("--surface")
            .arg(sequence.path().join(out));
        command.output().expect("it starts")
    };
    let output = surface("surface.csv", &["--reference", "1"]);
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    assert!(said.starts_with("least cost 0."), "{said}");
    assert!(said.contains("from the truth"), "{said}");
    let table = fs::read_to_string(sequence.path().join("surface.csv")).expect("a table");
    let (head, rows) = table.split_once('\n').expect("a head");
    assert_eq!(head, "right_m,forward_m,yaw_deg,cost,covered_px");
    // The disc of 2 m in steps of half a metre.
    assert_eq!(rows.lines().count(), 49);
    let png = surface("surface.png", &["--reference", "1", "--method", "pm"]);
    assert_eq!(png.status.code(), Some(0), "{png:?}");
    let size = image::image_dimensions(sequence.path().join("surface.png")).expect("a picture");
    assert_eq!(size, (27, 27));
    for (out, extra, expected) in [
        ("surface.txt", ["--reference", "1"], "ends in .csv or .png"),
        (
            "surface.csv",
            ["--method", "mi"],
            "name them with --query and --reference",
        ),
        ("surface.csv", ["--method", "fb"], "searches no grid"),
    ] {
        let output = surface(out, &extra);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(expected), "{said}");
    }
}
