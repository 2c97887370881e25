//! How long a frame of the window takes, with one query of the street, and how long it takes to look through
//! 10,000 results.
//!
//! Benches named `own_…` measure the part that is ours on any adapter: the pass over the widgets and the triangles made
//! of them, on the processor. The others paint a picture too and read it back.

use std::cell::RefCell;
use std::sync::Arc;

use divan::Bencher;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use nalgebra::Point3;
use posescope::app::{self, App, Arrangement, KnownResults, Results, Setup};
use posescope::cloud::Cloud;
use posescope::localize::QueryResult;
use posescope::method::Method;
use posescope::scene::{self, Scene, SceneError};
use posescope::session::{Job, RunMode, RunState, Task};

/// Size of the window, as it opens.
const SIZE: [f32; 2] = [1500.0, 950.0];
/// Points of a scan of a car's LiDAR.
const POINTS: usize = 120_000;
/// Results that are looked through.
const RESULTS: usize = 10_000;

type Window = Harness<'static, App>;

fn main() {
    divan::main();
    // Other things of this thread that it needs would be gone by the time the thread ends.
    drop(WINDOW.take());
}

/// The street with as many points in each cloud as a LiDAR of 64 beams gives.
struct DenseStreet(Box<dyn Scene>);

impl Scene for DenseStreet {
    posescope::inner_scene!(0: name, frames, intrinsics, pose, time_s, has_cloud, photo);

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        let sparse = self.0.cloud(frame)?.points;
        // Once more around, a hair farther away each time.
        let rounds = POINTS.div_ceil(sparse.len().max(1));
        let farther = |round: usize| 1.0 + 1e-3 * round as f32;
        let points = (0..rounds)
            .flat_map(|round| {
                sparse.iter().map(move |point| Point3::from(farther(round) * point.coords))
            })
            .take(POINTS)
            .collect();
        Ok(Cloud { points })
    }
}

thread_local! {
    /// The window after its run; made once, on the thread of the first benchmark.
    static WINDOW: RefCell<Option<Window>> = const { RefCell::new(None) };
}

fn with_window(run: impl FnOnce(&mut Window)) {
    WINDOW.with_borrow_mut(|window| run(window.get_or_insert_with(open)));
}

fn open() -> Window {
    let street: Arc<dyn Scene> =
        Arc::new(DenseStreet(scene::open("street", None).expect("is built in")));
    let query = street.find("000070").expect("a frame");
    let reference = street.find("000062").expect("a frame");
    let mut task = Task::of("street");
    task.protocol.name_references(&["000062".to_owned()]);
    let job = Job {
        task,
        references: Arc::clone(&street),
        queries: Arc::clone(&street),
        query,
        chosen: vec![reference].into(),
        index: Arc::default(),
        frames: Arc::default(),
    };
    let setup = Setup::of_lesson(job, std::env::temp_dir());
    let mut window = Harness::builder()
        .with_size(SIZE)
        .wgpu()
        .build_eframe(|creation| App::new(creation, setup));
    while matches!(window.state().app_state().run_state(), RunState::Loading | RunState::Running) {
        window.step();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert_eq!(window.state().app_state().run_state(), &RunState::Finished);
    draw(&mut window);
    window
}

/// One frame.
fn draw(window: &mut Window) {
    window.step();
    window.render().expect("a picture");
}

/// What a frame costs on the processor, whoever paints it.
fn draw_own(window: &mut Window) {
    window.step();
    let (shapes, scale) = {
        let output = window.output();
        (output.shapes.clone(), output.pixels_per_point)
    };
    divan::black_box(window.ctx.tessellate(shapes, scale));
}

/// What a frame costs while the cursor goes over the run.
fn scrub(bencher: Bencher, window: &mut Window, draw: fn(&mut Window)) {
    let records = window.state().app_state().run().len();
    let mut cursor = 0;
    bencher.bench_local(|| {
        cursor = (cursor + records / 60) % records;
        window.state_mut().app_state_mut().move_cursor(cursor);
        draw(window);
    });
    window.state_mut().act("To the last step");
}

#[divan::bench(sample_count = 60, sample_size = 1)]
fn own_scrubbing(bencher: Bencher) {
    with_window(|window| scrub(bencher, window, draw_own));
}

#[divan::bench(sample_count = 60, sample_size = 1)]
fn scrubbing(bencher: Bencher) {
    with_window(|window| scrub(bencher, window, draw));
}

/// The window with the 3-D view alone, at the end of MI's search.
fn in_space(window: &mut Window) -> egui::Pos2 {
    window.state_mut().app_state_mut().select_method(Method::MI);
    window.state_mut().app_state_mut().show_alone(Some(app::ViewName::Space));
    window.run_steps(3);
    window.get_by_label_contains("3-D view of").rect().center()
}

/// A frame while the pointer turns the cloud: all points are drawn anew.
#[divan::bench(sample_count = 60, sample_size = 1)]
fn orbiting(bencher: Bencher) {
    with_window(|window| {
        let middle = in_space(window);
        window.drag_at(middle);
        window.step();
        let mut turned = 0.0;
        bencher.bench_local(|| {
            turned += 3.0;
            window.hover_at(middle + egui::vec2(turned, 0.0));
            draw(window);
        });
        window.drop_at(middle);
        window.state_mut().app_state_mut().show_alone(None);
    });
}

/// A frame while the cursor goes over the run beside a cloud that stays where it is.
#[divan::bench(sample_count = 60, sample_size = 1)]
fn scrubbing_in_space(bencher: Bencher) {
    with_window(|window| {
        in_space(window);
        scrub(bencher, window, draw);
        window.state_mut().app_state_mut().show_alone(None);
    });
}

/// The results of the window's query, repeated over the frames of its scene: a run folder of so many.
struct ManyResults {
    folder: tempfile::TempDir,
    scene: Arc<dyn Scene>,
}

impl ManyResults {
    fn write(window: &Window) -> Self {
        let state = window.state().app_state();
        let scene = Arc::clone(&state.setup.queries);
        let own: Vec<QueryResult> = state.run().results().cloned().collect();
        let folder = tempfile::tempdir().expect("a folder");
        let lines: String = (0..RESULTS)
            .map(|at| {
                let mut result = own[at % own.len()].clone();
                let frames = scene.frames();
                result.query.clone_from(&frames[at / own.len() % frames.len()]);
                let line = serde_json::to_string(&result).expect("written");
                line + "\n"
            })
            .collect();
        std::fs::write(folder.path().join("results.jsonl"), lines).expect("written");
        Self { folder, scene }
    }

    fn read(&self) -> Results {
        let mut results = Results::new();
        let text = std::fs::read_to_string(self.folder.path().join("results.jsonl"));
        for line in text.expect("written").lines() {
            let result: QueryResult = serde_json::from_str(line).expect("a result");
            let frame = self.scene.find(&result.query).expect("a frame");
            results.entry(frame).or_default().push(result);
        }
        results
    }

    /// A window with them, arranged for a batch.
    fn open(&self, like: &Window) -> Window {
        let setup = Setup { mode: RunMode::Paused, ..like.state().app_state().setup.clone() };
        let results = self.read();
        let before = results.clone();
        let known = KnownResults { now: results, before: Some(before), ..KnownResults::default() };
        let mut window = Harness::builder()
            .with_size(SIZE)
            .build_eframe(|creation| App::new(creation, setup).with_results(known));
        window.state_mut().arrange(Arrangement::Batch);
        window.run_steps(4);
        window
    }
}

/// A run folder of 10,000 results: until they are there and the first frame shows them.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn open_10000_results(bencher: Bencher) {
    with_window(|window| {
        let many = ManyResults::write(window);
        bencher.bench_local(|| drop(many.open(window)));
    });
}

/// Another condition on 10,000 results: until the frame that shows what meets it.
#[divan::bench(sample_count = 20, sample_size = 1)]
fn filter_10000_results(bencher: Bencher) {
    with_window(|window| {
        let mut batch = ManyResults::write(window).open(window);
        let mut asked = 0;
        bencher.bench_local(|| {
            asked += 1;
            let condition = format!("method = mi and coverage < 5 and error < {asked}");
            batch.state_mut().app_state_mut().options.results_filter = condition;
            draw_own(&mut batch);
        });
    });
}

/// What a view of 10,000 results costs in a frame in which nothing changes.
#[divan::bench(args = ["batch", "charts", "queries"], sample_count = 30, sample_size = 1)]
fn own_frame_of_10000_results(bencher: Bencher, view: &str) {
    with_window(|window| {
        let mut batch = ManyResults::write(window).open(window);
        batch.state_mut().app_state_mut().show_alone(app::ViewName::find(view));
        batch.run_steps(3);
        bencher.bench_local(|| draw_own(&mut batch));
    });
}
