//! Choosing references in the window, and what is made of several.

use std::path::Path;
use std::sync::Arc;

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use posescope::app::{App, SaveTarget, Setup, ViewName};
use posescope::camera::Intrinsics;
use posescope::cloud::Cloud;
use posescope::event::KindSet;
use posescope::geometry::Pose;
use posescope::image::Photo;
use posescope::localize::{Chooser, LocalizeObserver, Localizer, Selection};
use posescope::method::Method;
use posescope::params::Params;
use posescope::scene::{IndexOptions, Retriever, Scene, SceneError};
use posescope::session::{IndexFile, Part, RunMode, RunState};
use posescope::sink::rerun::entities;
use posescope::trace::{Cancelled, Record, Sink};

use crate::binary::has;
use crate::recording::{chunks, timelines};
use crate::walls_scene::Walls;
use crate::window::{app, finish, finished, is_said, results, run_until_idle, save, send, setup};

fn maximize(window: &mut Harness<'_, App>, view: ViewName) {
    send(window, |app| app.app_state_mut().show_alone(Some(view)));
}

fn pick(window: &mut Harness<'_, App>, selection: Selection) -> RunState {
    send(window, |app| app.app_state_mut().pick_references(Some(selection)));
    run_until_idle(window)
}

fn index(file: &Path, params: &Params) {
    let scene = Walls::new();
    let options = IndexOptions { words: 400, every: 1, seed: 0 };
    // The photos behind the first three cannot all be read.
    let mut request = Retriever::request(&scene, &options, &Default::default(), params);
    request.frames.truncate(3);
    Retriever::build(&scene, file, &request, params, |_| {}).expect("an index");
}

#[test]
fn references_are_chosen_by_hand_and_their_poses_fused() {
    let mut window = finished(setup());
    maximize(&mut window, ViewName::References);
    assert!(is_said(&window, "1 of 2 frames within 3 m"));
    window.get_by_role_and_label(egui::Role::CheckBox, "000002").click();
    window.run_steps(2);
    finish(&mut window);
    assert_eq!(results(&window).len(), 2 * Method::PAPER.len());
    assert!(results(&window).iter().all(|result| result.fusion.is_none()));

    let stages = app(&window).run().stages();
    let inner = stages.iter().filter(|bar| bar.stage.name() == "detect");
    assert!(inner.count() >= 2);
    window.get_by_label("wavg").click();
    window.run_steps(2);
    finish(&mut window);
    let fused: Vec<_> = results(&window)
        .into_iter()
        .filter(|result| result.fusion.is_some_and(|f| f.name == "wavg"))
        .collect();
    assert_eq!(fused.len(), Method::PAPER.len());
    // Only the fusion is new.
    let run = app(&window).run();
    for bar in run.stages() {
        let name = bar.stage.name();
        assert!(name != "detect" && name != "color" || bar.reused, "{name}");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let recording = folder.path().join("fused.rrd");
    save(&mut window, SaveTarget::Recording, &recording);
    let recorded = timelines(&chunks(&recording));
    assert!(recorded.contains_key(&entities::fusion_weights(Method::FB)));
    assert!(!recorded.contains_key(entities::RETRIEVAL_TABLE));

    let command = app(&window).setup.command_line();
    has(&command, "--reference 000000 --reference 000002");
    has(&command, "--fusion wavg");

    maximize(&mut window, ViewName::Fusion);
    send(&mut window, |app| app.act("To the last step"));
    assert!(is_said(&window, "HY, 2 references"));
    let error = fused[3].error.expect("the truth is known");
    assert!(is_said(&window, &format!("{:.3} m", error.translation_m)));
    send(&mut window, |app| app.app_state_mut().select_method(Method::FB));
    assert!(is_said(&window, "FB, 2 references"));

    // Without a second reference there is nothing to fuse, but a fusion of one is its pose.
    maximize(&mut window, ViewName::References);
    window.get_by_role_and_label(egui::Role::CheckBox, "000002").click();
    window.run_steps(2);
    window.get_by_role_and_label(egui::Role::CheckBox, "000000").click();
    window.run_steps(2);
    assert!(is_said(&window, "at least one reference"));
}

#[test]
fn references_may_be_as_far_away_as_the_prior_allows() {
    let mut narrow = setup();
    narrow.task.protocol.radii_m = vec![0.6];
    assert_eq!(narrow.candidates(1), [2]);
    narrow.task.protocol.prior_m = Some(3.0);
    assert_eq!(narrow.candidates(1), [2, 0]);
    let mut window = finished(narrow);
    assert_eq!(pick(&mut window, Selection::Nearest(2)), RunState::Finished);
    assert_eq!(app(&window).setup.chosen.frames, [2, 0]);
    maximize(&mut window, ViewName::References);
    assert!(is_said(&window, "2 of 2 frames within 3 m"));
}

#[test]
fn references_are_ranked_by_their_matches() {
    let mut window = finished(setup());
    assert_eq!(pick(&mut window, Selection::Matched(1)), RunState::Finished);
    let setup = &app(&window).setup;
    let ranking = setup.chosen.ranking.as_ref().expect("they were ranked");
    assert_eq!(setup.chosen.frames, [ranking.frames[0].ranked.frame]);
    let scores: Vec<f32> = ranking.frames.iter().map(|f| f.ranked.score).collect();
    assert!(scores.len() == 2 && scores[0] >= scores[1], "{scores:?}");
    let run = app(&window).run();
    assert_eq!(run.spans()[0].part, Part::Retrieval);
    maximize(&mut window, ViewName::Retrieval);
    assert!(is_said(&window, "1 of 2 frames are references, ranked by feature matches"));
    // What a setting changes does not change the references.
    let key = "fb.ratio".to_owned();
    let value = "0.7".to_owned();
    send(&mut window, |app| app.app_state_mut().set_param(&key, &value));
    finish(&mut window);
    let again = &app(&window).run().spans()[0];
    assert_eq!(again.part, Part::Retrieval);
}

#[test]
fn references_are_found_by_an_index_and_a_missing_one_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("walls.posescope-index");
    let mut asked = setup();
    asked.index = Arc::new(IndexFile::new("walls", Some(file.clone())));
    let mut window = finished(asked);
    let state = pick(&mut window, Selection::Retrieved(2));
    assert!(matches!(state, RunState::Broken(_)), "{state:?}");
    assert!(is_said(
        &window,
        "the retrieval index does not exist; build it with `posescope index walls"
    ));

    index(&file, &Params::default());
    assert_eq!(pick(&mut window, Selection::Retrieved(2)), RunState::Finished);
    let chosen = &app(&window).setup.chosen;
    assert_eq!(chosen.frames.len(), 2);
    assert_eq!(results(&window).len(), 2 * Method::PAPER.len());
    maximize(&mut window, ViewName::Retrieval);
    assert!(is_said(&window, "2 of 2 frames are references, ranked by visual words"));
    let ranking = app(&window).setup.chosen.ranking.clone();
    let first = &ranking.expect("an index ranks").frames[0];
    let found = first.ranked.verification().expect("the walls are the same");
    let recording = folder.path().join("ranked.rrd");
    save(&mut window, SaveTarget::Recording, &recording);
    assert!(timelines(&chunks(&recording)).contains_key(entities::RETRIEVAL_TABLE));
    let name = format!("{} matches with {}", found.matches.len(), first.name);
    assert!(is_said(&window, &name), "{name}");
}

/// Hears how many candidates were looked at.
#[derive(Default)]
struct Counted(Vec<(usize, usize)>);

impl Sink for Counted {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }

    fn accept(&mut self, _record: &Record) -> Result<(), Cancelled> {
        Ok(())
    }
}

impl LocalizeObserver for Counted {
    fn choosing(&mut self, looked_at: usize, candidates: usize) {
        self.0.push((looked_at, candidates));
    }
}

#[test]
fn a_choice_by_matches_says_how_far_it_is() {
    let (scene, params) = (Walls::new(), Params::default());
    let localizer = Localizer::new(&scene, &scene, &params, 7);
    let chooser = Chooser {
        localizer: &localizer,
        params: &params,
        selection: Selection::Matched(1),
        radius_m: 3.0,
        seed: 7,
        index: None,
    };
    let mut heard = Counted::default();
    let chosen = chooser.choose(1, &|_| false, &mut heard).expect("readable");
    assert_eq!(chosen.frames.len(), 1);
    assert_eq!(heard.0, [(1, 2), (2, 2)]);
}

/// The small world, whose photos take long to be read.
struct Slow(Walls);

impl Scene for Slow {
    fn name(&self) -> &str {
        self.0.name()
    }
    fn frames(&self) -> &[String] {
        self.0.frames()
    }
    fn intrinsics(&self, frame: usize) -> Intrinsics {
        self.0.intrinsics(frame)
    }
    fn pose(&self, frame: usize) -> Option<Pose> {
        self.0.pose(frame)
    }
    fn time_s(&self, frame: usize) -> Option<f64> {
        self.0.time_s(frame)
    }
    fn has_cloud(&self, frame: usize) -> bool {
        self.0.has_cloud(frame)
    }
    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        std::thread::sleep(std::time::Duration::from_millis(400));
        self.0.photo(frame)
    }
    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        self.0.cloud(frame)
    }
}

#[test]
fn the_bar_says_how_many_frames_were_looked_at() {
    let scene: Arc<dyn Scene> = Arc::new(Slow(Walls::new()));
    let mut slow = Setup { mode: RunMode::Running, ..setup() };
    slow.references = Arc::clone(&scene);
    slow.queries = scene;
    slow.chosen = Vec::new().into();
    slow.task.protocol.select(Selection::Matched(1));
    let mut window = crate::window::window(slow);
    let mut is_told = false;
    while *app(&window).run_state() == RunState::Loading {
        window.step();
        is_told |= is_said(&window, "choosing references, 2 of 2");
    }
    assert!(is_told);
}

#[test]
fn radius_and_seed_are_changed_beside_the_references_and_start_nothing_as_they_are() {
    let mut window = finished(setup());
    let (radius_m, seed) = (3.0, 7);
    window.get_by_label_contains("References: ").click();
    window.run_steps(3);
    for label in ["Radius", "Seed", "Radius"] {
        window.get_by_label(label).focus();
        window.run_steps(2);
    }
    let state = app(&window);
    assert_eq!(*state.run_state(), RunState::Finished);
    assert_eq!(state.setup.task.radius_m(), radius_m);
    window.get_by_label("Seed").focus();
    window.step();
    window.get_by_label("Seed").type_text("9");
    window.step();
    window.get_by_label("Radius").focus();
    window.run_steps(3);
    let seed_now = app(&window).setup.task.protocol.seed;
    assert_ne!(seed_now, seed);
    window.get_by_label("Radius").type_text("2");
    window.step();
    window.get_by_label("Seed").focus();
    window.run_steps(3);
    assert_ne!(app(&window).setup.task.radius_m(), radius_m);
}
