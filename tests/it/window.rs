//! The window, driven through its accessibility tree and looked at through its pixels.

use std::sync::Arc;
use std::time::{Duration, Instant};

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use posescope::app::{App, Command, ReferencePick, Setup};
use posescope::event::Method;
use posescope::params::Params;
use posescope::session::{RunMode, State};

use crate::walls_scene::Walls;

/// The small world, waiting at its first step.
pub fn setup() -> Setup {
    let scene = Arc::new(Walls::new());
    Setup {
        scene_argument: "walls".to_owned(),
        references: scene.clone(),
        queries_argument: None,
        queries: scene,
        offered: vec![1, 2, 3],
        query: 1,
        reference_frames: vec![0],
        pick: ReferencePick::ByHand,
        results: Default::default(),
        methods: Method::ALL.to_vec(),
        params: Params::default(),
        uncertainty_radius_m: 3.0,
        seed: 7,
        breakpoints: Vec::new(),
        mode: RunMode::Paused,
        folder: std::env::temp_dir(),
    }
}

/// The window without a graphics card: what it shows is not painted.
pub fn window(setup: Setup) -> Harness<'static, App> {
    Harness::builder()
        .with_size([1500.0, 950.0])
        .build_eframe(|creation| App::new(creation, setup))
}

/// Draws frames until the worker needs somebody.
pub fn settle(window: &mut Harness<'_, App>) -> State {
    let begun = Instant::now();
    loop {
        window.step();
        match window.state().desk().state() {
            State::Loading | State::Running => {}
            state => {
                let state = state.clone();
                window.step();
                return state;
            }
        }
        assert!(begun.elapsed() < Duration::from_secs(120), "it hangs");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn the_window_waits_at_the_first_step_and_steps_by_buttons() {
    let mut window = window(setup());
    assert_eq!(settle(&mut window), State::Paused { breakpoint: None });
    assert_eq!(window.state().desk().run().len(), 1);
    window.get_by_label("Into").click();
    window.step();
    settle(&mut window);
    assert_eq!(window.state().desk().run().len(), 2);
}

#[test]
#[ignore = "to be looked at"]
fn picture() {
    let mut window = Harness::builder()
        .with_size([1500.0, 950.0])
        .wgpu()
        .build_eframe(|creation| App::new(creation, setup()));
    settle(&mut window);
    window.state_mut().send(Command::Run);
    settle(&mut window);
    for _ in 0..20 {
        window.step();
    }
    window
        .render()
        .expect("a picture")
        .save("/tmp/window.png")
        .expect("saved");
}
