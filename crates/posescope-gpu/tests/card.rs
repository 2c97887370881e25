//! The card against the processor, on whatever card there is.

use std::sync::Arc;

use nalgebra::{Point3, Rotation3, Translation3, Vector3};
use posescope_core::camera::Intrinsics;
use posescope_core::cost::{self, Cost};
use posescope_core::geometry::Pose;
use posescope_core::image::FloatImage;
use posescope_core::params::Params;
use posescope_core::render::{ColoredCloud, ColoredPoint, Device, Scorer, use_device};
use posescope_gpu::{Gpu, GpuError};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

/// The card of all tests, or `None` after it was said that there is none.
fn gpu() -> Option<Arc<Gpu>> {
    match Gpu::requested() {
        Ok(gpu) => Some(Arc::new(gpu)),
        Err(why @ GpuError::NoAdapter(_)) => {
            println!("skipped: {why}");
            None
        }
        Err(why) => panic!("{why}"),
    }
}

fn camera() -> Intrinsics {
    Intrinsics { fx: 80.0, fy: 81.0, cx: 59.7, cy: 30.2, width: 121, height: 60 }
}

struct World {
    cloud: Arc<ColoredCloud>,
    query: Arc<FloatImage>,
    poses: Vec<Pose>,
}

/// A cloud of which many points fall into one pixel and some are exactly behind each other or twice there,
/// a query, and cameras that look at it from everywhere.
fn world(seed: u64, points: usize, poses: usize) -> World {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut drawn = |least: f64, most: f64| random.random_range(least..most);
    let mut cloud: Vec<ColoredPoint> = (0..points)
        .map(|_| ColoredPoint {
            position: Point3::new(
                drawn(-12.0, 12.0) as f32,
                drawn(-3.0, 3.0) as f32,
                drawn(-5.0, 30.0) as f32,
            ),
            intensity: drawn(0.0, 255.0) as f32,
        })
        .collect();
    for place in (0..points).step_by(7) {
        let twin = ColoredPoint { intensity: 255.0 - cloud[place].intensity, ..cloud[place] };
        cloud.push(twin);
    }
    let values: Vec<f32> = (0..121 * 60).map(|_| drawn(0.0, 255.0) as f32).collect();
    let query = FloatImage::from_raw(121, 60, values).expect("as many pixels");
    let poses = (0..poses)
        .map(|_| {
            let centre = Vector3::new(drawn(-9.0, 9.0), drawn(-1.0, 1.0), drawn(-9.0, 9.0));
            let turn =
                Rotation3::from_euler_angles(drawn(-0.1, 0.1), drawn(-3.0, 3.0), drawn(-0.1, 0.1));
            Pose::from_parts(Translation3::from(centre), turn.into())
        })
        .collect();
    let cloud = ColoredCloud { points: cloud, ..ColoredCloud::default() };
    World { cloud: Arc::new(cloud), query: Arc::new(query), poses }
}

fn cost_of(name: &str, setting: &str) -> Box<dyn Cost> {
    let mut params = Params::default();
    if !setting.is_empty() {
        params.assign(setting).expect("a parameter");
    }
    let entry = cost::ALL.iter().find(|entry| entry.name == name);
    let entry = entry.expect("a registered cost");
    params.costs.of(entry).expect("its parameters").cost.boxed()
}

#[test]
fn scores_are_those_of_the_threads_to_the_last_bit() {
    let Some(gpu) = gpu() else { return };
    let asked = [
        ("mi", "", 1),
        ("mi", "mi.bins=2", 1),
        ("mi", "mi.bins=60", 3),
        ("nid", "", 5),
        ("pm", "", 1),
        ("pm", "", 3),
    ];
    // More hypotheses than are drawn between two clearings.
    for (seed, points, poses) in [(1, 4000, 600), (2, 30_000, 40), (3, 1, 20)] {
        let world = world(seed, points, poses);
        for (name, setting, splat_px) in asked {
            let cost = cost_of(name, setting);
            let query = Arc::clone(&world.query);
            let scorer = || {
                Scorer::new(world.cloud.clone(), query.clone(), &camera(), splat_px, cost.as_ref())
            };
            let expected = scorer().on(None).score(&world.poses);
            let device = Arc::clone(&gpu) as Arc<dyn Device>;
            let found = scorer().on(Some(device)).score(&world.poses);
            let differ = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
            assert_eq!(differ, 0, "{name} {setting} {splat_px} px, {points} points");
            assert_eq!(gpu.complaint(), None);
        }
        let costs = expected_costs(&world);
        assert!(points == 1 || costs > poses / 2, "{costs} of {poses} see something");
    }
}

fn expected_costs(world: &World) -> usize {
    let cost = cost_of("mi", "");
    let scorer = Scorer::new(world.cloud.clone(), world.query.clone(), &camera(), 1, cost.as_ref());
    let scores = scorer.on(None).score(&world.poses);
    scores.iter().filter(|score| score.cost.is_some()).count()
}

#[test]
fn what_is_too_large_is_left_to_the_processor_and_said() {
    let Some(gpu) = gpu() else { return };
    let world = world(4, 500, 50);
    let cost = cost_of("mi", "mi.bins=61");
    let scorer = Scorer::new(world.cloud.clone(), world.query.clone(), &camera(), 1, cost.as_ref());
    let device = Arc::clone(&gpu) as Arc<dyn Device>;
    let scores = scorer.on(Some(device)).score(&world.poses);
    assert_eq!(scores.len(), 50);
    let why = gpu.complaint().expect("a reason").to_string();
    assert!(why.contains("61 × 61 bins does not fit"), "{why}");
    // Another query may fit.
    assert!(gpu.batch(1000).is_some());
}

#[test]
fn few_hypotheses_wake_no_card_and_the_device_of_a_process_is_named_once() {
    let gpu = Arc::new(Gpu::if_any());
    assert_eq!(gpu.batch(500), None);
    assert_eq!((gpu.name(), gpu.complaint()), (None, None));
    assert!(use_device(Arc::clone(&gpu) as Arc<dyn Device>));
    assert!(!use_device(gpu));
}
