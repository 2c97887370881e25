//! How long a frame of the window takes on the software adapter, with one query of the street, and how
//! long it takes to look through 10,000 results.
//!
//! A frame here is all that happens between two pictures: the pass over the widgets, and their
//! painting into a texture of the size of the window, to the end. Those named `own_…` are the part that is
//! ours on any adapter: the pass over the widgets and the triangles made of them, on the processor, without
//! painting.

use std::cell::RefCell;
use std::sync::Arc;

use divan::Bencher;
use eframe::egui_wgpu::{
    RenderState, RendererOptions, ScreenDescriptor, WgpuConfiguration, WgpuSetup,
};
use egui_kittest::kittest::Queryable as _;
use egui_kittest::{Harness, TestRenderer};
use nalgebra::Point3;
use posescope::app::{self, App, Arrangement, Command, KnownResults, Results, Setup};
use posescope::cloud::Cloud;
use posescope::geometry::Pose;
use posescope::localize::QueryResult;
use posescope::run::{QueryCamera, ScenePair};
use posescope::scene::{self, Scene, SceneError};
use posescope::session::{RunMode, RunState, Task};

/// Size of the window, as it opens.
const SIZE: [f32; 2] = [1500.0, 950.0];
/// Points of a scan of a car's LiDAR.
const POINTS: usize = 120_000;

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

/// Paints as a window does, but into a texture that nobody reads.
struct Canvas {
    state: RenderState,
    texture: wgpu::TextureView,
}

impl Canvas {
    /// `None` where there is nothing to paint with.
    fn new() -> Option<Self> {
        let setup = WgpuSetup::without_display_handle();
        let instance = ready(setup.new_instance())?;
        let options = RendererOptions {
            dithering: app::window_options().dithering,
            ..RendererOptions::default()
        };
        let configuration = WgpuConfiguration {
            wgpu_setup: setup,
            ..WgpuConfiguration::default()
        };
        let state = ready(RenderState::create(
            &configuration,
            &instance,
            None,
            options,
        ))?
        .ok()?;
        let texture = state.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d {
                width: SIZE[0] as u32,
                height: SIZE[1] as u32,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: state.target_format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        Some(Self {
            state,
            texture: texture.create_view(&wgpu::TextureViewDescriptor::default()),
        })
    }
}

/// The value of a future that is ready, as those of wgpu are outside of browsers.
fn ready<T>(future: impl Future<Output = T>) -> Option<T> {
    let mut context = std::task::Context::from_waker(std::task::Waker::noop());
    match std::pin::pin!(future).poll(&mut context) {
        std::task::Poll::Ready(value) => Some(value),
        std::task::Poll::Pending => None,
    }
}

impl TestRenderer for Canvas {
    fn setup_eframe(&self, creation: &mut eframe::CreationContext<'_>, frame: &mut eframe::Frame) {
        creation.wgpu_render_state = Some(self.state.clone());
        frame.wgpu_render_state = Some(self.state.clone());
    }

    fn handle_delta(&mut self, delta: &mut egui::TexturesDelta) {
        let RenderState { device, queue, .. } = &self.state;
        let mut renderer = self.state.renderer.write();
        for (id, images) in delta.set.drain() {
            for image in images {
                renderer.update_texture(device, queue, id, &image);
            }
        }
        for id in delta.free.drain() {
            renderer.free_texture(&id);
        }
    }

    fn render(
        &mut self,
        ctx: &egui::Context,
        output: &egui::FullOutput,
    ) -> Result<image::RgbaImage, String> {
        let RenderState { device, queue, .. } = &self.state;
        let mut renderer = self.state.renderer.write();
        let screen = ScreenDescriptor {
            pixels_per_point: ctx.pixels_per_point(),
            size_in_pixels: SIZE.map(|side| side as u32),
        };
        let shapes = ctx.tessellate(output.shapes.clone(), screen.pixels_per_point);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let first = renderer.update_buffers(device, queue, &mut encoder, &shapes, &screen);
        let attachment = wgpu::RenderPassColorAttachment {
            view: &self.texture,
            resolve_target: None,
            ops: wgpu::Operations::default(),
            depth_slice: None,
        };
        let mut pass = encoder
            .begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(attachment)],
                ..wgpu::RenderPassDescriptor::default()
            })
            .forget_lifetime();
        renderer.render(&mut pass, &shapes, &screen);
        drop(pass);
        queue.submit(first.into_iter().chain([encoder.finish()]));
        let done = device.poll(wgpu::PollType::wait_indefinitely());
        done.map_err(|error| error.to_string())?;
        Ok(image::RgbaImage::new(1, 1))
    }
}

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
    let canvas = Canvas::new()?;
    let street: Arc<dyn Scene> = Arc::new(DenseStreet(scene::open("street", None).ok()?));
    let query = street.find("000070").ok()?;
    let reference = street.find("000062").ok()?;
    let setup = Setup {
        task: Task {
            by_hand: true,
            ..Task::of("street")
        },
        references: Arc::clone(&street),
        queries: Arc::clone(&street),
        offered: vec![query],
        query,
        chosen: vec![reference].into(),
        index: Arc::default(),
        mode: RunMode::Running,
        folder: std::env::temp_dir(),
    };
    let mut window = Harness::builder()
        .with_size(SIZE)
        .renderer(canvas)
        .build_eframe(|creation| App::new(creation, setup));
    while matches!(
        window.state().app_state().run_state(),
        RunState::Loading | RunState::Running
    ) {
        window.step();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert_eq!(window.state().app_state().run_state(), &RunState::Finished);
    draw(&mut window);
    Some(window)
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

/// The cursor goes over the run: our own part of a frame.
#[divan::bench(sample_count = 120, sample_size = 1)]
fn own_scrubbing(bencher: Bencher) {
    with_window(|window| {
        let records = window.state().app_state().run().len();
        let mut cursor = 0;
        bencher.bench_local(|| {
            cursor = (cursor + records / 120) % records;
            window.state_mut().send(Command::MoveCursor(cursor));
            draw_own(window);
        });
        window.state_mut().send(Command::Last);
    });
}

/// A part of the window has all the room while the cursor goes over the run: our own part of a frame.
#[divan::bench(args = ["images", "synthetic", "space", "surface", "histogram", "ransac", "report", "log"], sample_count = 60, sample_size = 1)]
fn own_scrubbing_of(bencher: Bencher, view: &str) {
    with_window(|window| {
        let name = app::views::find(view).expect("a view");
        window.state_mut().send(Command::Maximize(Some(name)));
        window.step();
        let records = window.state().app_state().run().len();
        let mut cursor = 0;
        bencher.bench_local(|| {
            cursor = (cursor + records / 60) % records;
            window.state_mut().send(Command::MoveCursor(cursor));
            draw_own(window);
        });
        window.state_mut().send(Command::Maximize(None));
        window.state_mut().send(Command::Last);
        window.step();
    });
}

/// Results that are looked through.
const RESULTS: usize = 10_000;

/// The results of the window's query, repeated over the frames of its scene: a run folder of so many.
struct ManyResults {
    folder: tempfile::TempDir,
    pair: ScenePair,
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
                result
                    .query
                    .clone_from(&frames[at / own.len() % frames.len()]);
                let line = serde_json::to_string(&result).expect("written");
                line + "\n"
            })
            .collect();
        std::fs::write(folder.path().join("results.jsonl"), lines).expect("written");
        let camera = scene.intrinsics(0);
        let pair = ScenePair {
            scene_index: 0,
            scene: scene.name().to_owned(),
            query_scene: scene.name().to_owned(),
            camera: QueryCamera {
                width: camera.width,
                height: camera.height,
                fx: camera.fx,
                fy: camera.fy,
                cx: camera.cx,
                cy: camera.cy,
            },
            cameras: Vec::new(),
            drawn: Vec::new(),
            queries: Vec::new(),
            times_s: Vec::new(),
        };
        Self {
            folder,
            pair,
            scene,
        }
    }

    fn read(&self) -> Results {
        let read = app::results_of_run(self.folder.path(), &self.pair, self.scene.as_ref());
        let (results, elsewhere) = read.expect("readable");
        assert_eq!(elsewhere, 0);
        results
    }

    /// A window with them, arranged for a batch.
    fn open(&self, like: &Window) -> Window {
        let setup = Setup {
            mode: RunMode::Paused,
            ..like.state().app_state().setup.clone()
        };
        let results = self.read();
        let before = results.clone();
        let known = KnownResults {
            now: results,
            before: Some(before),
        };
        let mut window = Harness::builder()
            .with_size(SIZE)
            .build_eframe(|creation| App::new(creation, setup).with_results(known));
        window
            .state_mut()
            .send(Command::Arrange(Arrangement::Batch));
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
            batch.state_mut().send(Command::FilterResults(condition));
            draw_own(&mut batch);
        });
    });
}

/// What a view of 10,000 results costs in a frame in which nothing changes.
#[divan::bench(args = ["batch", "charts", "migrations", "queries"], sample_count = 30, sample_size = 1)]
fn own_frame_of_10000_results(bencher: Bencher, view: &str) {
    with_window(|window| {
        let mut batch = ManyResults::write(window).open(window);
        let name = app::views::find(view).expect("a view");
        batch.state_mut().send(Command::Maximize(Some(name)));
        batch.run_steps(3);
        bencher.bench_local(|| draw_own(&mut batch));
    });
}

/// The table of 10,000 results is scrolled by a page.
#[divan::bench(sample_count = 60, sample_size = 1)]
fn own_scrolling_of_10000_results(bencher: Bencher) {
    with_window(|window| {
        let mut batch = ManyResults::write(window).open(window);
        batch.state_mut().send(Command::Maximize(Some("batch")));
        batch.run_steps(3);
        batch.hover_at(egui::pos2(600.0, 600.0));
        batch.step();
        bencher.bench_local(|| {
            batch.event(egui::Event::MouseWheel {
                unit: egui::MouseWheelUnit::Page,
                delta: egui::vec2(0.0, -1.0),
                phase: egui::TouchPhase::Move,
                source: egui::MouseWheelSource::Wheel,
                modifiers: egui::Modifiers::NONE,
            });
            draw_own(&mut batch);
        });
    });
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
        let records = window.state().app_state().run().len();
        let mut cursor = 0;
        bencher.bench_local(|| {
            cursor = (cursor + records / 60) % records;
            window.state_mut().send(Command::MoveCursor(cursor));
            draw(window);
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
            draw(window);
        });
        window.drop_at(begin);
        window.step();
    });
}

/// The camera in hand moves: until the views have costs and pictures of both methods to paint.
#[divan::bench(sample_count = 30, sample_size = 1)]
fn what_if_answer(bencher: Bencher) {
    with_window(|window| bencher.bench_local(what_if(window, |_| ())));
}

/// The camera in hand moves: until costs and pictures of both methods are painted.
#[divan::bench(sample_count = 30, sample_size = 1)]
fn what_if_painted(bencher: Bencher) {
    with_window(|window| bencher.bench_local(what_if(window, draw)));
}

/// One move of the camera at each call.
fn what_if(window: &mut Window, end: impl Fn(&mut Window)) -> impl FnMut() {
    let loaded = window.state().app_state().run().loaded.clone();
    let loaded = loaded.expect("the run is over");
    let start = loaded.problems[0].reference.world_from_camera;
    let mut moves = 0;
    move || {
        moves += 1;
        let pose = start * Pose::translation(0.0, 0.0, 0.05 * f64::from(moves));
        window.state_mut().send(Command::TakeCamera(Some(pose)));
        loop {
            window.step();
            let state = window.state().app_state();
            if state.probe().is_some_and(|probe| probe.pose == pose) {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        end(window);
    }
}

/// An empty view: what it costs to fill the window at all.
#[divan::bench(sample_count = 30, sample_size = 1)]
fn next_to_nothing(bencher: Bencher) {
    with_window(|window| {
        window.state_mut().send(Command::Maximize(Some("fusion")));
        draw(window);
        bencher.bench_local(|| draw(window));
        window.state_mut().send(Command::Maximize(None));
        draw(window);
    });
}
