//! What is read and worked out once, and what is kept of it.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Barrier, Mutex};

use posescope_core::camera::Intrinsics;
use posescope_core::cloud::Cloud;
use posescope_core::event::{Event, StageEnded};
use posescope_core::geometry::Pose;
use posescope_core::image::Photo;
use posescope_core::localize::{
    Chooser, LocalizeError, LocalizeObserver, Localizer, NoObserver, QueryResult, References,
    Request, Selection, StageTimes,
};
use posescope_core::method::Method;
use posescope_core::params::Params;
use posescope_core::problem::{Query, ReferenceTuple};
use posescope_core::scene::{CachedScene, FrameStore, Scene, SceneError};
use posescope_core::trace::{Cancelled, Record, Sink};

use crate::walls_scene::{TwoCameras, Walls};

/// The walls, with a count of what was read of which frame.
struct Counting {
    walls: Walls,
    name: &'static str,
    photos: [AtomicUsize; 5],
    clouds: [AtomicUsize; 5],
}

impl Counting {
    fn new() -> Self {
        Self {
            walls: Walls::new(),
            name: "counting",
            photos: Default::default(),
            clouds: Default::default(),
        }
    }

    fn photos(&self) -> [usize; 5] {
        self.photos.each_ref().map(|n| n.load(Ordering::Relaxed))
    }

    fn clouds(&self) -> [usize; 5] {
        self.clouds.each_ref().map(|n| n.load(Ordering::Relaxed))
    }
}

impl Scene for Counting {
    posescope_core::inner_scene!(walls: frames, intrinsics, pose, time_s, has_cloud);

    fn name(&self) -> &str {
        self.name
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        self.photos[frame].fetch_add(1, Ordering::Relaxed);
        self.walls.photo(frame)
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        self.clouds[frame].fetch_add(1, Ordering::Relaxed);
        self.walls.cloud(frame)
    }
}

/// How often each stage was worked out, and how often it was at hand.
#[derive(Default)]
struct StageCounts(BTreeMap<&'static str, [usize; 2]>);

impl StageCounts {
    fn of(&self, stage: &str) -> [usize; 2] {
        self.0.get(stage).copied().unwrap_or_default()
    }
}

impl Sink for StageCounts {
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        if let Event::StageEnded(StageEnded { stage, reused, .. }) = record.event {
            self.0.entry(stage.name()).or_default()[usize::from(reused)] += 1;
        }
        Ok(())
    }
}

impl LocalizeObserver for StageCounts {}

fn request(references: References) -> Request {
    Request { radius_m: 3.0, references, fusions: Vec::new(), setting: None }
}

fn localize(
    localizer: &Localizer<'_>,
    references: References,
    methods: &[Method],
    observer: &mut dyn LocalizeObserver,
) -> Vec<(QueryResult, StageTimes)> {
    let mut results = Vec::new();
    let keep = |result, times| {
        results.push((result, times));
        Ok::<(), LocalizeError>(())
    };
    localizer.localize(0, 1, &[request(references)], methods, observer, keep).expect("good data");
    results
}

fn without_features() -> Params {
    let mut params = Params::default();
    params.assign("surf.threshold=1000000").expect("a good assignment");
    params
}

#[test]
fn three_methods_color_a_cloud_once_and_read_each_frame_once() {
    let scene = Counting::new();
    // FB finds nothing, so the hybrid searches too.
    let params = without_features();
    let localizer = Localizer::new(&scene, &scene, &params, 7);
    let mut counts = StageCounts::default();
    let direct = [Method::PM, Method::MI, Method::HY];
    let results = localize(&localizer, vec![0].into(), &direct, &mut counts);
    assert!(results.iter().all(|(result, _)| result.pose.is_some()));
    assert_eq!(counts.of("color"), [1, 2]);
    // The hybrid's search is that of MI.
    assert_eq!(counts.of("position_coarse"), [2, 1]);
    assert_eq!(scene.photos(), [1, 1, 0, 0, 0]);
    assert_eq!(scene.clouds(), [1, 0, 0, 0, 0]);
}

#[test]
fn features_are_found_once_for_ranking_and_for_every_reference() {
    let scene = Counting::new();
    let params = Params::default();
    let localizer = Localizer::new(&scene, &scene, &params, 7);
    let chooser = Chooser {
        localizer: &localizer,
        params: &params,
        selection: Selection::Matched(2),
        radius_m: 3.0,
        seed: 7,
        index: None,
    };
    let chosen = chooser.choose(1, &|_| false, &mut NoObserver).expect("readable");
    assert_eq!(chosen.frames.len(), 2);
    assert_eq!(scene.clouds(), [0; 5]);
    let mut counts = StageCounts::default();
    localize(&localizer, chosen, &[Method::FB], &mut counts);
    assert_eq!(counts.of("detect"), [0, 2]);
    assert_eq!(scene.photos(), [1, 1, 1, 0, 0]);
    assert_eq!(scene.clouds(), [1, 0, 1, 0, 0]);
}

#[test]
fn a_hybrid_takes_as_long_whoever_watches() {
    let stages = |times: &StageTimes| -> Vec<String> {
        times.iter().map(|(name, _)| name.to_owned()).collect()
    };
    for params in [Params::default(), without_features()] {
        let scene = Walls::new();
        let all = |observer: &mut dyn LocalizeObserver| {
            let localizer = Localizer::new(&scene, &scene, &params, 7);
            localize(&localizer, vec![0].into(), &Method::PAPER, observer)
        };
        let unseen = all(&mut NoObserver);
        let watched = all(&mut StageCounts::default());
        for ((a, a_times), (b, b_times)) in unseen.iter().zip(&watched) {
            assert_eq!(a, b);
            assert_eq!(stages(a_times), stages(b_times));
        }
        let times = watched.iter().map(|(_, times)| times.total());
        let times: Vec<_> = times.collect();
        assert!(times[3] >= times[0]);
    }
}

#[test]
fn a_store_keeps_to_its_frames_and_what_others_hold() {
    let counting = Arc::new(Counting::new());
    let scene: Arc<dyn Scene> = counting.clone();
    let store = Arc::new(FrameStore::new(2, usize::MAX));
    let cached = store.of(&scene);
    let look = |frame| cached.query(frame).expect("readable");
    for frame in [0, 1, 2, 2, 1] {
        look(frame);
    }
    assert_eq!(counting.photos(), [1, 1, 1, 0, 0]);
    // The one that was not asked for the longest has made room.
    look(0);
    assert_eq!(counting.photos(), [2, 1, 1, 0, 0]);
    look(1);
    assert_eq!(counting.photos(), [2, 1, 1, 0, 0]);

    let held = look(2);
    for frame in [0, 1, 3, 0, 1, 3] {
        look(frame);
    }
    assert!(Arc::ptr_eq(&held, &look(2)));
    assert_eq!(counting.photos()[2], 2);
}

#[test]
fn a_store_keeps_to_its_bytes_whatever_is_worked_out() {
    let scene = Counting::new();
    let params = Params::default();
    let (references, queries) = CachedScene::pair(&scene, &scene);
    let store = Arc::clone(references.store());
    let localizer = Localizer::with_cached_scenes((references, queries), &params, 7);
    localize(&localizer, vec![0].into(), &Method::PAPER, &mut NoObserver);
    let of_two = store.bytes();
    // Both photos, the cloud, and what follows from them.
    assert!(of_two > 2 * 24_000 + 12 * 12_000, "{of_two}");

    let counting: Arc<dyn Scene> = Arc::new(Counting::new());
    let small = Arc::new(FrameStore::new(64, of_two / 2));
    for _ in 0..3 {
        for query in [1, 3] {
            let scenes = (small.of(&counting), small.of(&counting));
            let localizer = Localizer::with_cached_scenes(scenes, &params, 7);
            let keep = |_, _| Ok::<(), LocalizeError>(());
            let requests = [request(vec![0, 2].into())];
            localizer
                .localize(0, query, &requests, &Method::PAPER, &mut NoObserver, keep)
                .expect("good data");
            // Nobody holds anything now: the next look makes room.
            store_is_within(&small, &counting, of_two / 2);
        }
    }
}

/// Asked for a frame that is small, a store lets others go.
fn store_is_within(store: &Arc<FrameStore>, scene: &Arc<dyn Scene>, limit: usize) {
    let cached = store.of(scene);
    for _ in 0..2 {
        drop(cached.query(3).expect("readable"));
    }
    assert!(store.bytes() <= limit, "{} of {limit}", store.bytes());
}

#[test]
fn scenes_of_one_name_are_not_taken_for_each_other() {
    let store = Arc::new(FrameStore::default());
    let scenes: [Arc<Counting>; 2] = [Arc::new(Counting::new()), Arc::new(Counting::new())];
    for scene in &scenes {
        let scene: Arc<dyn Scene> = scene.clone();
        store.of(&scene).query(0).expect("readable");
        store.of(&scene).query(0).expect("readable");
    }
    assert_eq!(scenes.map(|scene| scene.photos()[0]), [1, 1]);
}

/// Reads a photo only when two threads want it.
struct RendezvousScene(Walls, Barrier);

impl Scene for RendezvousScene {
    posescope_core::inner_scene!(0: frames, intrinsics, pose, time_s, has_cloud, cloud);

    fn name(&self) -> &str {
        "meeting"
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        self.1.wait();
        self.0.photo(frame)
    }
}

#[test]
fn two_threads_may_read_a_frame_at_once_and_get_the_same() {
    let scene = RendezvousScene(Walls::new(), Barrier::new(2));
    let (cached, _) = CachedScene::pair(&scene, &scene);
    let got: Mutex<Vec<(Arc<ReferenceTuple>, Arc<Query>)>> = Mutex::default();
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                let tuple = cached.reference(0).expect("readable");
                let query = cached.query(0).expect("is there");
                got.lock().expect("whole").push((tuple, query));
            });
        }
    });
    let got = got.into_inner().expect("whole");
    assert!(Arc::ptr_eq(&got[0].0, &got[1].0));
    assert!(Arc::ptr_eq(&got[0].1, &got[1].1));
    assert!(Arc::ptr_eq(got[0].0.photo(), got[0].1.photo()));
}

/// A scene that answers everything in its own way.
struct UnusualScene(Walls);

impl Scene for UnusualScene {
    posescope_core::inner_scene!(0: frames, has_cloud, photo, cloud);

    fn name(&self) -> &str {
        "peculiar"
    }

    fn intrinsics(&self, frame: usize) -> Intrinsics {
        Intrinsics { fx: 200.0 + frame as f64, ..self.0.intrinsics(frame) }
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        (frame != 2).then(|| self.0.pose(frame)).flatten()
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        (frame != 1).then_some(7.5 * frame as f64)
    }

    fn query(&self, frame: usize) -> Result<Arc<Query>, SceneError> {
        let photo = Arc::clone(self.0.query(frame)?.photo());
        let query = Query::new(format!("query {frame}"), photo, self.intrinsics(frame));
        Ok(Arc::new(query.expect("the photo fits")))
    }

    fn fingerprint(&self) -> u64 {
        0x0123_4567_89AB_CDEF
    }
}

/// Everything that a scene says of a frame, as text: its methods one by one, so that one more in the
/// trait is one more here.
fn said(scene: &dyn Scene, frame: usize) -> Vec<String> {
    let error = |error: SceneError| error.to_string();
    let query = scene
        .query(frame)
        .map_err(error)
        .map(|query| (query.name().to_owned(), query.photo().gray.clone(), *query.intrinsics()));
    let reference = scene.reference(frame).map_err(error).map(|tuple| {
        let (name, pixels) = (tuple.name().to_owned(), tuple.photo().gray.clone());
        let pose = *tuple.world_from_camera();
        (name, pixels, *tuple.intrinsics(), pose, tuple.cloud().points.clone())
    });
    vec![
        scene.name().to_owned(),
        format!("{:?}", scene.frames()),
        format!("{:?}", scene.intrinsics(frame)),
        format!("{:?}", scene.pose(frame)),
        format!("{:?}", scene.time_s(frame)),
        format!("{:?}", scene.has_cloud(frame)),
        format!("{:?}", scene.photo(frame).map_err(error)),
        format!("{query:?}"),
        format!("{reference:?}"),
        format!("{:?}", scene.fingerprint()),
    ]
}

#[test]
fn a_scene_at_hand_says_all_that_the_scene_says() {
    let scene = UnusualScene(Walls::new());
    let (cached, other) = CachedScene::pair(&scene, &scene);
    // Frame 0 is whole, 2 has no pose, the photo of 4 cannot be read.
    for frame in [0, 2, 4] {
        for _ in 0..2 {
            assert_eq!(said(&cached, frame), said(&scene, frame));
            assert_eq!(said(&other, frame), said(&scene, frame));
        }
    }
    let cloud = |scene: &dyn Scene| scene.cloud(0).expect("has one").points;
    assert_eq!(cloud(&cached), cloud(&scene));
}

#[test]
fn a_query_may_have_another_camera_than_its_reference() {
    let scene = TwoCameras(Walls::new());
    let params = Params::default();
    let localizer = Localizer::new(&scene, &scene, &params, 7);
    let direct = [Method::PM, Method::MI];
    for (result, _) in localize(&localizer, vec![0].into(), &direct, &mut NoObserver) {
        let error = result.error.expect("a pose");
        assert!(error.translation_m < 0.6, "{}: {error:?}", result.method);
    }
}
