//! How long a frame of the window takes on the software adapter, with one query of the street.
//!
//! A frame here is all that happens between two pictures: the pass over the widgets, their painting
//! and reading the finished picture back, which a window on a screen does without.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::sync::Arc;

use divan::Bencher;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use nalgebra::Point3;
use posescope::app::{App, Command, ReferencePick, Setup};
use posescope::camera::Intrinsics;
use posescope::cloud::Cloud;
use posescope::event::Method;
use posescope::geometry::Pose;
use posescope::image::Photo;
use posescope::params::Params;
use posescope::scene::{self, Scene, SceneError};
use posescope::session::{RunMode, State};

/// Points of a scan of a car's LiDAR.
const POINTS: usize = 120_000;

fn main() {
    divan::main();
}

/// The street with as many points in each cloud as a LiDAR of 64 beams gives.
struct DenseStreet(Box<dyn Scene>);

impl Scene for DenseStreet {
    fn name(&self) -> &str {
        self.0.name()
    }
    fn frames(&self) -> &[String] {
        self.0.frames()
    }
    fn intrinsics(&self) -> Intrinsics {
        self.0.intrinsics()
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
        self.0.photo(frame)
    }
    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        let sparse = self.0.cloud(frame)?.points;
        // Once more around, a hair farther away each time.
        let rounds = POINTS.div_ceil(sparse.len().max(1));
        let farther = |round: usize| 1.0 + 1e-3 * round as f32;
        let points = (0..rounds)
            .flat_map(|round| {
                sparse
                    .iter()
                    .map(move |point| Point3::from(farther(round) * point.coords))
            })
            .take(POINTS)
            .collect();
        Ok(Cloud { points })
    }
}

type Window = Harness<'static, App>;

thread_local! {
    /// The window after its run; made once, on the thread of the first benchmark.
    static WINDOW: RefCell<Option<Window>> = const { RefCell::new(None) };
}

/// Runs a benchmark on the window; says so where there is nothing to draw it with.
fn with_window(run: impl FnOnce(&mut Window)) {
    WINDOW.with_borrow_mut(|window| {
        if window.is_none() {
            *window = open();
        }
        match window {
            Some(window) => run(window),
            None => println!("skipped: no graphics adapter"),
        }
    });
}

fn open() -> Option<Window> {
    if !has_adapter() {
        return None;
    }
    let street: Arc<dyn Scene> = Arc::new(DenseStreet(scene::open("street", None).ok()?));
    let query = street.find("000070").ok()?;
    let reference = street.find("000062").ok()?;
    let setup = Setup {
        scene_argument: "street".to_owned(),
        references: Arc::clone(&street),
        queries_argument: None,
        queries: Arc::clone(&street),
        offered: vec![query],
        query,
        chosen: vec![reference].into(),
        pick: ReferencePick::ByHand,
        index: Arc::default(),
        methods: Method::ALL.to_vec(),
        fusions: Vec::new(),
        params: Params::default(),
        uncertainty_radius_m: 15.0,
        prior_m: None,
        seed: 0,
        breakpoints: Vec::new(),
        mode: RunMode::Running,
        results: BTreeMap::new(),
        folder: std::env::temp_dir(),
    };
    let mut window = Harness::builder()
        .with_size([1500.0, 950.0])
        .wgpu()
        .build_eframe(|creation| App::new(creation, setup));
    while matches!(
        window.state().desk().state(),
        State::Loading | State::Running
    ) {
        window.step();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert_eq!(window.state().desk().state(), &State::Finished);
    draw(&mut window);
    Some(window)
}

fn has_adapter() -> bool {
    use eframe::wgpu;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let options = wgpu::RequestAdapterOptions::default();
    let mut future = std::pin::pin!(instance.request_adapter(&options));
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    matches!(
        Future::poll(future.as_mut(), &mut context),
        std::task::Poll::Ready(Ok(_))
    )
}

/// One frame.
fn draw(window: &mut Window) -> image::RgbaImage {
    window.step();
    window.render().expect("a picture")
}

/// Nothing has changed. A window on a screen would not draw such a frame at all.
#[divan::bench(sample_count = 30, sample_size = 1)]
fn idle(bencher: Bencher) {
    with_window(|window| {
        draw(window);
        bencher.bench_local(|| draw(window));
    });
}

/// The cursor goes over the run.
#[divan::bench(sample_count = 60, sample_size = 1)]
fn scrubbing(bencher: Bencher) {
    with_window(|window| {
        let records = window.state().desk().run().len();
        let mut cursor = 0;
        bencher.bench_local(|| {
            cursor = (cursor + records / 60) % records;
            window.state_mut().send(Command::MoveCursor(cursor));
            draw(window)
        });
        window.state_mut().send(Command::Last);
    });
}

/// The pointer turns the scene with 120,000 points.
#[divan::bench(sample_count = 40, sample_size = 1)]
fn orbiting(bencher: Bencher) {
    with_window(|window| {
        window.state_mut().send(Command::ShowView("space"));
        draw(window);
        let pane = window.get_by_label_contains("3-D view of").rect();
        let begin = pane.min + 0.25 * pane.size();
        window.hover_at(begin);
        window.step();
        window.drag_at(begin);
        window.step();
        let mut moves = 0;
        bencher.bench_local(|| {
            moves += 1;
            window.hover_at(begin + egui::vec2(3.0 * moves as f32, 0.0));
            draw(window)
        });
        window.drop_at(begin);
        window.step();
    });
}

/// The camera in hand moves: until costs and pictures of both methods are there and drawn.
#[divan::bench(sample_count = 30, sample_size = 1)]
fn what_if_move(bencher: Bencher) {
    with_window(|window| {
        let loaded = window.state().desk().run().loaded.clone();
        let loaded = loaded.expect("the run is over");
        let start = loaded.problems[0].reference.world_from_camera;
        let mut moves = 0;
        bencher.bench_local(|| {
            moves += 1;
            let pose = start * Pose::translation(0.0, 0.0, 0.05 * f64::from(moves));
            window.state_mut().send(Command::TakeCamera(Some(pose)));
            window.step();
            loop {
                window.step();
                let desk = window.state().desk();
                if desk.probe().is_some_and(|probe| probe.pose == pose) {
                    break;
                }
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
            window.render().expect("a picture")
        });
        window.state_mut().send(Command::TakeCamera(None));
        window.step();
    });
}
