//! Surveys of a map, and how the confidence of later runs follows them.

use std::fs;
use std::path::Path;

use posescope::diagnosis::confidence::{Calibration, Lowered};
use posescope::localize::QueryResult;
use tempfile::TempDir;

use crate::binary::{Said, command_in, has, objects, text};

/// A folder with a cache of its own: a survey is none of other tests' business.
struct Desk {
    root: TempDir,
}

impl Desk {
    fn new() -> Self {
        Self { root: TempDir::new().expect("a folder") }
    }

    fn path(&self) -> &Path {
        self.root.path()
    }

    fn run(&self, line: &str) -> Said {
        let cache = self.path().join("cache");
        Said::by(command_in(self.path(), line).env("POSESCOPE_CACHE", cache))
    }

    /// What the confidence of FB's pose of one query was fitted on, its probability, and what was said on stderr.
    #[track_caller]
    fn confidence(&self, words: &str) -> (Calibration, f64, String) {
        let said =
            self.run(&format!("run street --query 70 --reference 66 --method fb --json - {words}"));
        let err = said.err.clone();
        let results = said.results();
        let confidence = results[0].confidence.as_ref().expect("a pose");
        (confidence.calibrated_on, confidence.probability, err)
    }

    /// The copy of the survey that runs find by themselves.
    fn kept(&self) -> std::path::PathBuf {
        let folder = fs::read_dir(self.path().join("cache/survey")).expect("a folder");
        let files: Vec<_> = folder.map(|entry| entry.expect("a file").path()).collect();
        assert_eq!(files.len(), 1, "{files:?}");
        files[0].clone()
    }
}

#[test]
fn the_confidence_of_later_runs_follows_a_survey_until_the_map_changes() {
    let desk = Desk::new();
    let (on, before, said) = desk.confidence("");
    assert_eq!(on, Calibration::Generated);
    assert!(!said.contains("survey"), "{said}");

    let said = desk.run("survey street --queries 10 --method fb --radius 10 --out s").ok();
    has(&said.out, "FB ~ of 10 ~ s/survey.html ~ --survey none");
    let [toml, page] =
        ["survey.toml", "survey.html"].map(|file| text(desk.path().join("s").join(file)));
    has(&toml, "queries = 14 ~ radius = 10.0 ~ [survey.fb] ~ [poses.fb]");
    has(
        &page,
        "Where photos are localised ~ How far to trust a pose here ~ What a survey cannot know",
    );
    assert_eq!(text(desk.kept()), toml);
    // What the map says of its frames: half the radius away from another, with a chance of the method.
    has(&page, "Where photos will be localised ~ from 80 % on");
    let places = text(desk.path().join("s/places.csv"));
    let (header, rows) = places.split_once('\n').expect("rows");
    assert_eq!(header, "frame,reference,distance,fb");
    assert_eq!(rows.lines().count(), 400);
    for row in rows.lines() {
        let numbers: Vec<f64> = row.split(',').filter_map(|cell| cell.parse().ok()).collect();
        assert!((4.0..6.0).contains(&numbers[2]) && (0.0..=1.0).contains(&numbers[3]), "{row}");
    }
    // Its parts are runs, and confidence is as it was fitted there.
    has(
        &text(desk.path().join("s/mirrored/run.toml")),
        "degrade = \"mirror\" ~ [params.survey.fb]",
    );
    let rows: Vec<QueryResult> = objects(&text(desk.path().join("s/near/results.jsonl")));
    assert_eq!(rows.len(), 10);
    let confidences = rows.iter().filter_map(|row| row.confidence.as_ref());
    assert!(confidences.clone().count() > 5);
    assert!(confidences.clone().all(|one| one.calibrated_on == Calibration::Generated));

    let (on, after, said) = desk.confidence("");
    assert_eq!(on, Calibration::Map);
    assert!(before != after);
    has(&said, "Confidence follows the survey of this map with 14 photos");
    assert_eq!(desk.confidence("--survey s").1, after);
    let (on, without, said) = desk.confidence("--survey none");
    assert_eq!((on, without), (Calibration::Generated, before));
    assert!(!said.contains("survey"), "{said}");

    // A run keeps the numbers that it began with.
    let eval = "eval street --limit 1 --method fb --radius 10 --out run -q";
    desk.run(eval).ok();
    has(&text(desk.path().join("run/run.toml")), "[params.survey.fb]");
    desk.run(&format!("{eval} --resume")).ok();
    desk.run(&format!("{eval} --resume --survey none")).fails_with(2, "other settings");

    // Another map has other numbers, and a named survey must fit.
    desk.run("run street:night --query 70 --reference 66 --method fb --survey s")
        .fails(3, "of another map ~ posescope survey street:night");
    desk.run("eval street street:night --limit 1 --survey s").fails(2, "one scene");
    let stale = toml.replace("fingerprint = \"", "fingerprint = \"0");
    fs::write(desk.kept(), stale).expect("writable");
    let (on, stale, said) = desk.confidence("");
    assert_eq!((on, stale), (Calibration::Generated, before));
    has(&said, "have changed since ~ `posescope survey street`");
}

#[test]
fn a_survey_that_is_there_is_continued_and_a_damaged_one_refused() {
    let desk = Desk::new();
    let line = "survey street --queries 5 --method fb --radius 10 --out s -q";
    desk.run(line).ok();
    let [toml, page] = ["s/survey.toml", "s/survey.html"].map(|file| desk.path().join(file));
    let (numbers, html) = (text(&toml), text(&page));
    desk.run(line).fails(2, "--resume");
    // As after Ctrl-C: half of a part is missing, and another was not begun.
    let results = desk.path().join("s/near/results.jsonl");
    let lines = text(&results);
    let half: Vec<&str> = lines.split_inclusive('\n').take(2).collect();
    fs::write(&results, half.concat()).expect("writable");
    fs::remove_dir_all(desk.path().join("s/mirrored")).expect("there");
    desk.run(&format!("{line} --resume --threads 3")).ok();
    assert_eq!((text(&toml), text(&page)), (numbers.clone(), html));
    assert_eq!(text(&results), lines);

    let run = "run street --query 70 --reference 66 --method fb --survey s";
    for (from, to, words) in [
        (
            "schema = \"posescope.survey/1\"",
            "schema = \"posescope.survey/9\"",
            "posescope.survey/1 expected",
        ),
        ("radius = ", "radios = ", "survey.toml: line 7 ~ radios"),
    ] {
        fs::write(&toml, numbers.replace(from, to)).expect("writable");
        desk.run(run).fails(3, words);
    }
    desk.run("survey street --radius 0.001").fails(3, "within 0.001 m ~ --radius");
}

/// Probabilities were fitted up to 25 m.
#[test]
fn a_search_beyond_all_that_was_fitted_lowers_the_confidence_and_one_within_does_not() {
    let desk = Desk::new();
    let known = |radius: u32| {
        let asked = "run street --query 70 --reference 62 --method fb --json -";
        let said = desk.run(&format!("{asked} --radius {radius}"));
        said.results()[0].confidence.clone().expect("a pose")
    };
    let [within, beyond] = [25, 40].map(known);
    assert!(within.lowered_by.is_empty(), "{within:?}");
    let is_radius =
        |why: &Lowered| matches!(why, Lowered::Radius { searched_m, .. } if *searched_m == 40.0);
    assert!(beyond.lowered_by.iter().any(is_radius), "{beyond:?}");
    assert!(beyond.probability < within.probability, "{within:?} {beyond:?}");
}

/// A box on a desk: its frames fit each other, if less closely than generated ones.
#[test]
fn poses_in_a_room_have_a_confidence_by_how_closely_its_frames_fit_each_other() {
    let Some(data) = std::env::var_os("POSESCOPE_DATA") else {
        println!("skipped: no data (POSESCOPE_DATA)");
        return;
    };
    let desk = Desk::new();
    let (from, to) = (Path::new(&data).join("box"), desk.path().join("box"));
    fs::create_dir(&to).expect("writable");
    for file in fs::read_dir(&from).expect("a folder") {
        let file = file.expect("a file");
        fs::copy(file.path(), to.join(file.file_name())).expect("writable");
    }
    fs::copy(from.join("intrinsics.K.txt"), to.join("camera-intrinsics.txt")).expect("writable");
    let said = desk.run("run box --query 55 --reference 63 --method fb2,mi --json -");
    has(&said.err, "Confidence follows how closely the map's frames fit each other ~ survey box");
    let results = said.results();
    // In the order of methods.
    let [mi, fb2] = &results[..] else { panic!("{results:?}") };
    let known = fb2.confidence.as_ref().expect("a pose");
    assert_eq!(known.calibrated_on, Calibration::FramePairs);
    // What is fitted says 0.98 and more; so few pairs cannot.
    assert!((0.8..0.97).contains(&known.probability), "{known:?}");
    let (held, error) = (known.within_95.expect("an interval"), fb2.error.expect("a truth"));
    assert!(error.translation_m <= held.m && error.rotation_deg <= held.deg, "{held:?} {error:?}");
    // It is held in a hand, and MI looks for a camera that keeps its height and tilt.
    assert!(known.lowered_by.is_empty(), "{known:?}");
    let level = mi.confidence.as_ref().expect("a pose");
    let Some(Lowered::Freedoms { reached }) = level.lowered_by.first() else {
        panic!("{level:?}");
    };
    assert!((0.1..0.4).contains(reached) && level.probability < *reached, "{level:?}");
}

/// A camera on a car keeps its height and tilt.
#[test]
fn a_search_of_three_freedoms_is_believed_on_a_real_drive() {
    let Some(data) = std::env::var_os("POSESCOPE_DATA") else {
        println!("skipped: no data (POSESCOPE_DATA)");
        return;
    };
    let drive = "kitti_raw_dense/2011_09_26/2011_09_26_drive_0013_sync";
    let drive = Path::new(&data).join(drive);
    let asked = format!("run {} --query 10 --reference 6 --method mi --json -", drive.display());
    let said = Desk::new().run(&asked);
    has(&said.err, "Confidence follows how closely the map's frames fit each other");
    let results = said.results();
    let known = results[0].confidence.as_ref().expect("a pose");
    assert!(known.lowered_by.is_empty() && known.probability > 0.5, "{known:?}");
}
