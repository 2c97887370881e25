//! Queries whose photos are made worse: on the command line, in run folders and in the window.

use egui::accesskit::Role;
use egui_kittest::kittest::Queryable as _;
use image::imageops;
use posescope::app::{SaveTarget, Setup, ViewName};
use posescope::image::Degradation;
use posescope::scene;

use crate::binary::has;
use crate::small_sequence::{HEIGHT, SmallSequence, WIDTH, wall};
use crate::window::{app, finish, finished, run_until_idle, save, send, setup};

/// The lines of `run --json -` without what says that the photo was degraded.
fn results(sequence: &SmallSequence, words: &str) -> (String, usize) {
    let line = "run sequences/42 --query 5 --reference 4 --method fb,mi --radius 3 --json - -q";
    let text = sequence.run(&format!("{line} {words}")).ok().out;
    let mark = "\"degraded\":\"fog=0.25,invert\",";
    (text.replace(mark, ""), text.matches(mark).count())
}

/// The sequence with the photo of a frame as it comes out of the degradation.
fn worse_on_disk(text: &str) -> SmallSequence {
    let sequence = SmallSequence::write();
    let degradation: Degradation = text.parse().expect("a degradation");
    let photo = posescope::Photo::from_gray(wall(WIDTH, HEIGHT));
    let worse = degradation.of(&photo, 0, "000005").gray;
    worse.save(sequence.image("000005")).expect("writable");
    sequence
}

#[test]
fn a_degraded_query_is_the_photo_that_was_degraded_before_and_its_references_stay() {
    let text = "invert,fog=0.25";
    let sequence = SmallSequence::write();
    let (there, _) = results(&worse_on_disk(text), "");
    let (here, marks) = results(&sequence, &format!("--degrade {text}"));
    assert_eq!((&here, marks), (&there, 2));
    assert_ne!(here, results(&sequence, "").0);
}

#[test]
fn a_run_folder_says_what_was_degraded_and_goes_on_with_nothing_else() {
    let (plain, worse) = (SmallSequence::write(), worse_on_disk("invert"));
    let line =
        "eval sequences/42 --method fb,mi --radius 3 -q --reference nearest:1 --query 5 --out";
    // Without a scene of queries of their own, the references keep their photos all the same.
    plain.run(&format!("{line} run --degrade invert")).ok();
    worse.run(&format!("{line} run")).ok();
    let results = plain.text("run/results.jsonl");
    let results = results.replace("\"degraded\":\"invert\",", "");
    assert_eq!(results, worse.text("run/results.jsonl"));
    has(&plain.text("run/run.toml"), "degrade = \"invert\"\n");
    assert!(!worse.text("run/run.toml").contains("degrade"));
    let said = plain.run(&format!("{line} run --degrade gamma=2 --resume"));
    said.fails_with(2, "`degrade = \"invert\"` instead of `degrade = \"gamma=2\"`");

    // Noise is the same on any number of threads, and another for another seed.
    let [one, three, seed] = ["--threads 1", "--threads 3", "--seed 4"].map(|words| {
        let out = words.replace(' ', "");
        plain.run(&format!("{line} ./{out} --degrade noise=20 {words}")).ok();
        plain.text(&format!("{out}/results.jsonl"))
    });
    assert_eq!(one, three);
    assert_ne!(one, seed.replace("\"seed\":4", "\"seed\":0"));
}

#[test]
fn poses_clouds_and_names_of_a_degraded_scene_are_its_own() {
    let street = scene::open("street", None).expect("is built in").into();
    let worse = scene::degraded(&street, "invert".parse().expect("a degradation"), 0);
    let frame = worse.find("70").expect("is there");
    assert_eq!(worse.name(), street.name());
    assert_eq!(worse.pose(frame), street.pose(frame));
    assert_ne!(worse.fingerprint(), street.fingerprint());
    let [taken, degraded] = [&street, &worse].map(|scene| scene.photo(frame).expect("is made"));
    let mut negative = taken.gray.clone();
    imageops::invert(&mut negative);
    assert_eq!(degraded.gray, negative);
    // Another degradation takes the place of the first; none brings the scene itself back.
    let again = scene::degraded(&worse, Degradation::default(), 0);
    assert_eq!(again.photo(frame).expect("is made").gray, taken.gray);
}

fn query_photo(setup: &Setup) -> image::GrayImage {
    setup.queries.photo(setup.query).expect("is there").gray
}

#[test]
fn a_slider_degrades_the_photo_runs_again_and_is_kept_in_the_session() {
    let mut window = finished(setup());
    let taken = query_photo(&app(&window).setup);
    send(&mut window, |app| app.app_state_mut().show_view(ViewName::Parameters));
    let invert = window.get_by_role_and_label(Role::CheckBox, "invert");
    invert.click_accesskit();
    window.run_steps(2);
    finish(&mut window);
    let state = app(&window);
    let degraded = |state: &posescope::app::AppState| state.setup.task.protocol.degrade.to_string();
    assert_eq!(degraded(state), "invert");
    let loaded = state.run().loaded.as_deref().expect("it ran");
    let mut negative = taken.clone();
    imageops::invert(&mut negative);
    assert_eq!(loaded.problems[0].query().photo().gray, negative);
    assert_ne!(loaded.problems[0].reference().photo().gray, negative);
    assert!(state.setup.command_line().contains(" --degrade invert"));
    assert!(state.setup.title().contains("(invert)"));

    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("session.json");
    window.state_mut().save(SaveTarget::Session, path.clone());
    window.step();
    // The strength of a step is set as assistive technology does it.
    let gamma = window.get_by_role_and_label(Role::SpinButton, "gamma");
    gamma.set_value_accesskit(0.5);
    window.run_steps(2);
    run_until_idle(&mut window);
    let both = degraded(app(&window));
    assert_eq!(both, "gamma=0.5,invert");
    window.get_by_label("As taken").click_accesskit();
    window.run_steps(2);
    run_until_idle(&mut window);
    let setup = &app(&window).setup;
    assert_eq!(query_photo(setup), taken);
    save(&mut window, SaveTarget::Restored, &path);
    run_until_idle(&mut window);
    let state = app(&window);
    assert_eq!(degraded(state), "invert");
    assert_eq!(query_photo(&state.setup), negative);
}
