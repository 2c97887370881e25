//! How many hypotheses a second the card and the processor score, beside each other in one run.
//!
//! ```sh
//! cargo run --release -p posescope-gpu --example hypotheses
//! ```
//!
//! A pair of the street, its points thinned out or, moved by some millimetres, repeated to the number that
//! the line says; poses of the 10 m disc. Each figure is the median of paired runs, which alternate. With
//! `POSESCOPE_THREADS=N` the processor works on as many threads.

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use nalgebra::Vector3;
use posescope_core::cost;
use posescope_core::geometry::Pose;
use posescope_core::grid::{GridParams, Lattice, Offset, Phase};
use posescope_core::params::Params;
use posescope_core::render::{ColoredCloud, ColoredPoint, Device, Objective as _, Scorer};
use posescope_core::scene::Scene as _;
use posescope_gpu::Gpu;
use posescope_street::Street;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

const RUNS: usize = 5;
/// What one run of the slower of both may take \[s\], which decides how many hypotheses are scored.
const SECONDS: f64 = 3.0;
/// Steps of the 10 m disc that are tried, the finest first \[m\].
const STEPS_M: [f64; 6] = [0.1, 0.25, 0.5, 1.0, 2.0, 4.0];

fn main() -> Result<(), Box<dyn Error>> {
    if let Ok(threads) = std::env::var("POSESCOPE_THREADS") {
        rayon::ThreadPoolBuilder::new().num_threads(threads.parse()?).build_global()?;
    }
    let gpu = Arc::new(Gpu::requested()?);
    let card = gpu.name().unwrap_or_default();
    println!("card: {card}; threads: {}", rayon::current_num_threads());
    println!("points   cost  hypotheses     threads/s        card/s   card : threads");

    let street = Street::open("street")?;
    let (query, reference) = (street.query(70)?, street.reference(62)?);
    let params = Params::default();
    for count in [16_384, 500_000] {
        for name in ["mi", "pm"] {
            let entry = cost::ALL.iter().find(|entry| entry.name == name);
            let entry = entry.ok_or("a registered cost")?;
            let cost = params.costs.of(entry).ok_or("its parameters")?.cost.boxed();
            let channel = cost.reference_channel().of(&reference.photo().gray);
            let visible = reference.visible_cloud(&params.render);
            let colored = visible.colored_by(channel);
            let points = resized(&colored.points, count);
            let cloud = Arc::new(ColoredCloud { points, ..colored });
            let channel = Arc::new(cost.query_channel().of(&query.photo().gray));
            let scorer = || {
                let (cloud, channel) = (Arc::clone(&cloud), Arc::clone(&channel));
                Scorer::new(cloud, channel, query.intrinsics(), 1, cost.as_ref())
            };
            let on_threads = scorer().on(None);
            let on_card = scorer().on(Some(Arc::clone(&gpu) as Arc<dyn Device>));
            // Both have made what they make once before anything is timed.
            let few = poses(2.0)?;
            if on_card.score(&few) != on_threads.score(&few) {
                return Err("the card has other scores".into());
            }
            let slower = per_second(&on_threads, &few).min(per_second(&on_card, &few));
            let poses = affordable(slower * SECONDS)?;
            let (mut by_threads, mut by_card) = (Vec::new(), Vec::new());
            for _ in 0..RUNS {
                by_threads.push(per_second(&on_threads, &poses));
                by_card.push(per_second(&on_card, &poses));
            }
            let ratios = by_card.iter().zip(&by_threads).map(|(card, threads)| card / threads);
            let ratio = median(ratios.collect());
            let hypotheses = poses.len();
            let [threads, card] = [median(by_threads), median(by_card)];
            println!(
                "{count:>7}  {name:>4}  {hypotheses:>10}  {threads:>12.0}  {card:>12.0}  {ratio:>15.3}"
            );
            if let Some(why) = gpu.complaint() {
                return Err(why.into());
            }
        }
    }
    Ok(())
}

/// So many points: every so many-th of them, or all again and again, each time a little aside.
fn resized(points: &[ColoredPoint], count: usize) -> Vec<ColoredPoint> {
    let mut random = Pcg64::seed_from_u64(1);
    let mut aside = || random.random_range(-0.02_f32..0.02);
    let spread = points.len() as f64 / count as f64;
    (0..count)
        .map(|place| {
            if spread >= 1.0 {
                points[(place as f64 * spread) as usize]
            } else {
                let mut point = points[place % points.len()];
                point.position += Vector3::new(aside(), aside(), aside());
                point
            }
        })
        .collect()
}

/// The positions of the 10 m disc, in steps \[m\].
fn poses(step_m: f64) -> Result<Vec<Pose>, Box<dyn Error>> {
    let mut params = GridParams::default();
    params.coarse_step_m = step_m;
    let lattice = Lattice::new(Phase::PositionCoarse, Offset::default(), 10.0, &params)?;
    let hypotheses = lattice.hypotheses();
    Ok(hypotheses.map(|(_, offset)| offset.reference_from_camera()).collect())
}

/// As many positions of the 10 m disc as that, at most.
fn affordable(hypotheses: f64) -> Result<Vec<Pose>, Box<dyn Error>> {
    for step_m in STEPS_M {
        let poses = poses(step_m)?;
        if (poses.len() as f64) < hypotheses {
            return Ok(poses);
        }
    }
    poses(4.0)
}

fn per_second(scorer: &Scorer<'_>, poses: &[Pose]) -> f64 {
    let start = Instant::now();
    for some in poses.chunks(scorer.batch(poses.len())) {
        std::hint::black_box(scorer.score(some));
    }
    poses.len() as f64 / start.elapsed().as_secs_f64()
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
