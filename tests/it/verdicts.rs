//! One meaning of success and one way to write an error, wherever a result is shown.

use std::sync::Arc;

use nalgebra::Vector3;
use posescope::app::{Results, Setup, Tab, ViewName};
use posescope::camera::Intrinsics;
use posescope::diagnosis::confidence::Lowered;
use posescope::diagnosis::{Code, Confidence, Diagnosis, Evidence, Subject, Tolerance, diagnose};
use posescope::geometry::{Pose, PoseError};
use posescope::localize::{QueryResult, localize_traced};
use posescope::measure::{Field, measure, read_rows};
use posescope::method::Method;
use posescope::params::Params;
use posescope::problem::{Problem, Query, ReferenceTuple};
use posescope::scene::{self, Scene};
use posescope::trace::Trace;
use serde_json::Value;

use crate::small_sequence::SmallSequence;
use crate::window::{finished, is_said, results, run_until_idle, send, setup, window_with_results};

#[test]
fn the_terminal_and_the_window_write_the_same_numbers_under_the_same_names() {
    let sequence = SmallSequence::write();
    let asked = "--query 5 --reference 4 --method fb --radius 3 --seed 7";
    let line = format!("run sequences/42 {asked} --json results.jsonl");
    let table = sequence.run(&line).out;
    let line = sequence.text("results.jsonl");
    let result: QueryResult = serde_json::from_str(line.trim()).expect("a result");
    let error = result.error.expect("the truth is known");

    let columns = [
        ("error", error.translation()),
        ("rotation", error.rotation()),
        ("max Euler", error.max_euler()),
    ];
    let cells = |line: &str| -> Vec<String> {
        let cells = line.split("  ").map(str::trim);
        let cells = cells.filter(|cell| !cell.is_empty());
        cells.map(str::to_owned).collect()
    };
    let lines: Vec<Vec<String>> = table.lines().map(cells).collect();
    let of = |first: &str| {
        let found = lines.iter().find(|cells| cells.iter().any(|c| c == first));
        found.unwrap_or_else(|| panic!("{first} is missing in {table}"))
    };
    let (names, values) = (of("query"), of("000005"));
    for (name, value) in columns {
        let column = names.iter().position(|cell| cell == name);
        let column = column.unwrap_or_else(|| panic!("no column {name} in {table}"));
        assert_eq!(values[column], value, "{name} in {table}");
    }

    let folder = sequence.folder().display().to_string();
    let scene: Arc<dyn Scene> = scene::open(&folder, None).expect("a scene").into();
    let frame = |name| scene.find(name).expect("a frame");
    let mut setup = Setup { offered: vec![frame("5")], ..setup() };
    setup.query = frame("5");
    setup.chosen = vec![frame("4")].into();
    setup.queries = scene.clone();
    setup.references = scene.clone();
    setup.task.scene = folder;
    setup.task.protocol.methods = vec![Method::FB];
    let mut window = finished(setup);
    send(&mut window, |app| app.app_state_mut().show_tab(Tab::Numbers));
    let result = &results(&window)[0];
    for name in ["error", "rotation"] {
        let text = Field::find(name).expect("a field").text(result);
        assert!(is_said(&window, &text), "{name}: {text}");
    }
}

#[test]
fn the_window_counts_the_failures_that_the_run_counts() {
    let sequence = SmallSequence::of(&[0, 1, 2, 3, 4, 5]);
    let eval = |right: &str, out: &str| {
        let asked = "--method mi --reference random:1 --radius 3 --keep-failures 0";
        let line = format!("eval sequences/42 {asked} --right {right} --out {out}");
        sequence.run(&line).ok();
        read_rows(&sequence.path().join(out)).expect("results")
    };
    let mut errors: Vec<f64> =
        eval("1m,5deg", "first").iter().filter_map(|row| Some(row.error?.translation_m)).collect();
    errors.sort_by(f64::total_cmp);
    // Half of them are right.
    let right = format!("{}m,180deg", errors[errors.len() / 2]);
    let rows = eval(&right, "run");
    let measures = measure(&rows, 10.0);
    let failed = measures[0].queries - measures[0].right;
    assert!(failed > 0 && failed < 6, "{failed} of 6 failed");

    let mut results = Results::new();
    for (query, result) in rows.iter().enumerate() {
        results.insert(query, vec![result.clone()]);
    }
    let setup =
        Setup { offered: results.keys().copied().filter(|query| *query < 3).collect(), ..setup() };
    let mut window = window_with_results(setup, results);
    run_until_idle(&mut window);
    send(&mut window, |app| app.app_state_mut().show_alone(Some(ViewName::Queries)));
    assert!(is_said(&window, &format!("{failed} of 6 failed")));
}

/// Photos of a camera whose focal length is stated too short: the verdict names the camera, not the cloud, although
/// depths look wrong too.
#[test]
fn a_wrong_focal_length_is_named_before_the_cloud() {
    let folder = tempfile::tempdir().expect("a folder");
    let said = |line: &str| crate::binary::run_in(folder.path(), line).ok().out;
    said("synth made --layout toml --condition overcast --every 350 --quiet");
    let scene = folder.path().join("made/overcast/scene.toml");
    let lines = crate::binary::text(&scene);
    let lines = lines.lines().map(|line| match line.split_once(" = ") {
        Some((name @ ("fx" | "fy"), _)) => format!("{name} = 610\n"),
        _ => format!("{line}\n"),
    });
    crate::binary::write(&scene, lines.collect::<String>());
    let words = "run street --query-scene made/overcast --query 350 --reference 347 --method fb";
    let said = said(words);
    let expected =
        "X1 The query camera is suspect: its focal length should be 718 px, not 610. That explains";
    crate::binary::has(&said, expected);
}

/// The calibration belongs to another lens, or to photos of another size: matches are true, and have no right depth.
#[test]
fn a_focal_length_that_is_wrong_for_both_photos_is_named() {
    let street = scene::open("street", None).expect("is built in");
    let truth = street.pose(30).expect("is known");
    let stated = street.intrinsics(30);
    for (scale, of_centre) in [(2.0, 2.0), (2.0, 1.0), (0.6, 1.0)] {
        let camera = Intrinsics {
            fx: scale * stated.fx,
            fy: scale * stated.fy,
            cx: of_centre * stated.cx,
            cy: of_centre * stated.cy,
            ..stated
        };
        let (query, reference) = stated_as(street.as_ref(), [30, 23], camera, &Pose::identity());
        let found = said_of(query, reference, &truth);
        let named = found.first().unwrap_or_else(|| panic!("{scale}: no verdict"));
        assert!(named.text.starts_with("The camera of both photos is suspect"), "{found:?}");
        let camera: Intrinsics =
            serde_json::from_value(named.evidence["camera"].clone()).expect("a camera");
        assert!((camera.fx / stated.fx - 1.0).abs() < 0.06, "{scale}: {camera:?}");
        assert!((camera.cx / stated.cx - 1.0).abs() < 0.04, "{scale}: {camera:?}");
    }
}

/// A query and a reference of the street with another camera, the reference turned.
fn stated_as(
    street: &dyn Scene,
    [query, reference]: [usize; 2],
    camera: Intrinsics,
    turn: &Pose,
) -> (Query, ReferenceTuple) {
    let query = street.query(query).expect("a photo");
    let tuple = street.reference(reference).expect("a cloud");
    let [of_query, of_tuple] = [query.photo(), tuple.photo()].map(Arc::clone);
    let (pose, cloud) = (tuple.world_from_camera() * turn, tuple.cloud().clone());
    let reference = ReferenceTuple::new(tuple.name(), of_tuple, camera, pose, cloud);
    (Query::new(query.name(), of_query, camera).expect("fits"), reference.expect("fits"))
}

/// A pose of a query whose camera is stated wrongly is as wrong as that, however many matches agree on it.
#[test]
fn a_pose_by_the_camera_of_another_photo_is_not_trusted_and_one_by_its_own_is() {
    let street = scene::open("street", None).expect("is built in");
    let mut doubted = 0;
    for frame in [152, 168, 232, 312] {
        let truth = street.pose(frame).expect("is known");
        let stated = street.intrinsics(frame);
        let confidence = |camera: Intrinsics| {
            let (_, reference) =
                stated_as(street.as_ref(), [frame, frame - 8], stated, &Pose::identity());
            let photo = Arc::clone(street.query(frame).expect("a photo").photo());
            let query = Query::new("query", photo, camera).expect("fits");
            let problem = Problem::new(query, reference, 15.0).expect("a radius");
            let (params, mut evidence) = (Params::default(), Evidence::default());
            let outcome =
                localize_traced(&problem, Method::FB, &params, &mut Trace::to(&mut evidence));
            let outcome = outcome.expect("nobody cancels");
            let subject = Subject::new(&problem, Method::FB, &params, &outcome, &evidence);
            let pose = outcome.pose.as_ref().ok()?;
            let error = PoseError::between(&truth, pose).translation_m;
            Some((error, subject.confidence.expect("a pose")))
        };
        let (error, own) = confidence(stated).expect("a pose");
        assert!(error < 0.5 && own.lowered_by.is_empty(), "{frame}: {error} m, {own:?}");
        let short = Intrinsics { fx: 0.8 * stated.fx, fy: 0.8 * stated.fy, ..stated };
        let Some((error, other)) = confidence(short) else { continue };
        assert!(error > 1.0 && other.word != Confidence::Trusted, "{frame}: {error} m, {other:?}");
        let named = other.lowered_by.iter().find_map(|why| match why {
            Lowered::Camera { focal_length_px, .. } => Some(focal_length_px / stated.fx),
            Lowered::Radius { .. } | Lowered::Freedoms { .. } => None,
        });
        doubted += usize::from(named.is_some_and(|ratio| (ratio - 1.0).abs() < 0.1));
    }
    // Of the others FB gives no pose, or is unsure of it.
    assert!(doubted >= 1, "{doubted}");
}

/// What FB's verdicts are of a query with these words for its truth.
fn said_of(query: Query, reference: ReferenceTuple, truth: &Pose) -> Vec<Diagnosis> {
    let problem = Problem::new(query, reference, 15.0).expect("a radius");
    let (params, mut evidence) = (Params::default(), Evidence::default());
    let mut trace = Trace::to(&mut evidence);
    let outcome = localize_traced(&problem, Method::FB, &params, &mut trace);
    let outcome = outcome.expect("nobody cancels");
    let subject = Subject::new(&problem, Method::FB, &params, &outcome, &evidence);
    let tolerance = Tolerance { translation_m: 1.0, rotation_deg: 5.0 };
    diagnose(&subject.against(Some(truth), tolerance))
}

/// One query alone is not sure of what several then agree on.
#[test]
fn queries_give_the_same_hint_of_a_camera_and_the_same_reading_of_poses() {
    let street = scene::open("street", None).expect("is built in");
    let flip = Pose::rotation(Vector3::new(std::f64::consts::PI, 0.0, 0.0));
    let [mut lengths, mut centres, mut readings] = [0; 3];
    for frame in [152, 168, 232, 312] {
        let truth = street.pose(frame).expect("is known");
        let stated = street.intrinsics(frame);
        let of = |camera: Intrinsics, turn: &Pose| {
            let (query, reference) = stated_as(street.as_ref(), [frame, frame - 8], camera, turn);
            let found = said_of(query, reference, &(truth * turn));
            let place = found.iter().position(|one| one.code == Code::X1)?;
            let hint = found[place].clone();
            let is_hint = hint.evidence.get("certain").is_some_and(|certain| certain == false);
            assert!(!is_hint || place + 1 == found.len(), "{found:?}");
            Some(hint.evidence)
        };
        let number = |found: &Value, key: &str| found["camera"][key].as_f64();
        let still = Pose::identity();
        let short = Intrinsics { fx: 0.8 * stated.fx, fy: 0.8 * stated.fy, ..stated };
        let length = of(short, &still).and_then(|found| number(&found, "fx"));
        lengths += usize::from(length.is_some_and(|fx| (fx / stated.fx - 1.0).abs() < 0.07));
        let aside = Intrinsics { cx: stated.cx + 90.0, ..stated };
        let centre = of(aside, &still).and_then(|found| number(&found, "cx"));
        centres += usize::from(centre.is_some_and(|cx| (cx - stated.cx).abs() < 20.0));
        let reading = of(stated, &flip);
        let axes = "camera axes (x, -y, -z)";
        readings += usize::from(reading.is_some_and(|found| found["reading"] == axes));
    }
    assert!(lengths >= 3 && centres >= 3 && readings >= 3, "{lengths} {centres} {readings}");
}

/// A room has other defaults than a street, and a model without metres keeps its own unit.
#[test]
fn a_room_is_searched_at_its_own_scale() {
    let Some(data) = std::env::var_os("POSESCOPE_DATA") else {
        println!("skipped: no data (POSESCOPE_DATA)");
        return;
    };
    let sequence = SmallSequence::write();
    let room = std::path::Path::new(&data).join("7scenes/redkitchen");
    let asked = format!("run {} --query 25 --reference 50 --method mi", room.display());
    let ran = sequence.run(&format!("{asked} --json result.jsonl"));
    crate::binary::has(
        &ran.err,
        "search radius 1 m, steps 0.1 m and 0.02 m, right within 0.1 m and 5°",
    );
    let result: QueryResult =
        serde_json::from_str(sequence.text("result.jsonl").trim()).expect("a result");
    assert_eq!(result.scale, 0.1);
    assert_eq!(result.confidence, None);
    let ran = sequence.run(&format!("{asked} --set grid.coarse_step=1"));
    crate::binary::has(&ran.err, "--set grid.coarse_step=0.1 fits");
    let model = std::path::Path::new(&data).join("colmap/lund_door");
    let asked =
        format!("run {} --query DSC_0003 --reference DSC_0002 --method fb", model.display());
    let ran = sequence.run(&format!("{asked},mi --right 0.1,5deg --json model.jsonl"));
    crate::binary::has(&sequence.text("model.jsonl"), r#""unit":null"#);
    says_no_metres(&ran.out);
    says_no_metres(&ran.err);
    says_no_metres(&sequence.text("model.jsonl"));
    says_no_metres(&sequence.run(&format!("doctor {}", model.display())).out);
    let limits = "--limit 4 --method fb,mi --right 0.1,5deg --keep-failures 1";
    let ran = sequence.run(&format!("eval {} {limits} --out model", model.display()));
    for text in [ran.out, ran.err, sequence.text("model/report.html")] {
        says_no_metres(&text);
    }
}

#[track_caller]
fn says_no_metres(text: &str) {
    assert_eq!(crate::binary::first_metre(text), None);
}

/// From one place any camera and any depth explain what is seen; the cost has failed, and nothing else.
#[test]
fn photos_of_one_place_do_not_make_their_camera_suspect() {
    let sequence = SmallSequence::write();
    let asked = "run street --query-scene street:sun --query 600 --reference 600 --method pm";
    sequence.run(&format!("{asked} --json pm.jsonl"));
    let line = sequence.text("pm.jsonl");
    let result: QueryResult = serde_json::from_str(&line).expect("a result");
    assert!(result.diagnosis.iter().all(|found| found.code != Code::X1), "{line}");
    assert!(result.diagnosis.iter().any(|found| found.code == Code::D2), "{line}");
}
