//! How the time of the stages grows with what they are given: tables and plots.
//!
//! `cargo bench -p posescope-stages --bench growth -- FOLDER` writes `growth.md` and a plot for each table.
//! Everything runs on one thread, and times are the processor's. The pair is that of the stages, named in
//! the environment.

mod pair;
mod table;

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use cpu_time::ProcessTime;
use posescope::camera::Intrinsics;
use posescope::cost::{Cost, MutualInformation, MutualInformationParams};
use posescope::features::{Descriptor, Features, SurfParams, nearest_neighbours, surf};
use posescope::image::{FloatImage, GrayImage};
use posescope::render::{ColoredPoint, Scorer};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use self::pair::{PAIR, poses_of_a_disc, registered_cost, seen_by};
use self::table::Table;

const POINTS: [usize; 8] = [
    2_000, 5_000, 10_000, 20_000, 50_000, 100_000, 200_000, 500_000,
];
/// Sides of the photo, as multiples of what they are.
const SCALES: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 3.0];
const BINS: [usize; 7] = [4, 8, 16, 32, 64, 128, 256];
const KEYPOINTS: [usize; 6] = [500, 1_000, 2_000, 5_000, 10_000, 20_000];
/// Every so many poses of the disc are scored.
const EVERY: usize = 4;
const ROUNDS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()?;
    let folder = std::env::args()
        .skip(1)
        .find(|argument| argument != "--bench");
    let folder = folder.ok_or("a folder for the tables and plots expected")?;
    let folder = Path::new(&folder);
    fs::create_dir_all(folder)?;
    let mut text = String::new();
    for table in [by_points(), by_size(), by_bins(), by_keypoints()] {
        write(&table, &mut text)?;
        table.draw(&folder.join(table.name).with_extension("svg"))?;
    }
    print!("{text}");
    fs::write(folder.join("growth.md"), text)?;
    Ok(())
}

fn write(table: &Table, text: &mut String) -> std::fmt::Result {
    let Table {
        quantity,
        unit,
        columns,
        ..
    } = table;
    write!(text, "\n| {quantity} |")?;
    for column in columns {
        write!(text, " {column} ({unit}) |")?;
    }
    writeln!(text, "\n|--:|{}", "--:|".repeat(columns.len()))?;
    for (at, times) in &table.rows {
        write!(text, "| {at} |")?;
        for time in times {
            write!(text, " {time:.4} |")?;
        }
        writeln!(text)?;
    }
    Ok(())
}

/// A hypothesis of PM and of MI over the points of the cloud.
fn by_points() -> Table {
    let costs = ["pm", "mi"].map(registered_cost);
    let [(query, cloud), _] = costs.each_ref().map(|cost| seen_by(cost.as_ref()));
    let rows = POINTS.map(|count| {
        let points = dense(&cloud.points, count);
        let times = costs.each_ref().map(|cost| {
            hypothesis(
                &points,
                Arc::clone(&query),
                &PAIR.query.intrinsics,
                cost.as_ref(),
            )
        });
        (count as f64, times.to_vec())
    });
    Table {
        name: "points",
        quantity: "points",
        unit: "µs",
        columns: vec!["PM, a hypothesis", "MI, a hypothesis"],
        rows: rows.to_vec(),
    }
}

/// As many points, from every so manieth to copies that stand a few centimetres aside.
fn dense(points: &[ColoredPoint], count: usize) -> Vec<ColoredPoint> {
    const ASIDE_M: f32 = 0.05;
    let mut rng = Pcg64::seed_from_u64(4);
    (0..count)
        .map(|i| {
            let mut point = points[i * points.len() / count];
            if count > points.len() {
                for coordinate in point.position.coords.iter_mut() {
                    *coordinate += rng.random_range(-ASIDE_M..ASIDE_M);
                }
            }
            point
        })
        .collect()
}

/// A hypothesis over the pixels of the photo.
fn by_size() -> Table {
    let costs = ["pm", "mi"].map(registered_cost);
    let [(query, cloud), _] = costs.each_ref().map(|cost| seen_by(cost.as_ref()));
    let rows = SCALES.map(|scale| {
        let intrinsics = scaled(&PAIR.query.intrinsics, scale);
        let pixel = |x: u32, y: u32| {
            let back = |at: u32, size: u32| ((f64::from(at) / scale) as u32).min(size - 1);
            *query.get_pixel(back(x, query.width()), back(y, query.height()))
        };
        let query = Arc::new(FloatImage::from_fn(
            intrinsics.width,
            intrinsics.height,
            pixel,
        ));
        let times = costs.each_ref().map(|cost| {
            hypothesis(
                &cloud.points,
                Arc::clone(&query),
                &intrinsics,
                cost.as_ref(),
            )
        });
        (intrinsics.area(), times.to_vec())
    });
    Table {
        name: "size",
        quantity: "pixels",
        unit: "µs",
        columns: vec!["PM, a hypothesis", "MI, a hypothesis"],
        rows: rows.to_vec(),
    }
}

fn scaled(intrinsics: &Intrinsics, scale: f64) -> Intrinsics {
    let side = |side: u32| (f64::from(side) * scale) as u32;
    Intrinsics {
        fx: intrinsics.fx * scale,
        fy: intrinsics.fy * scale,
        cx: (intrinsics.cx + 0.5) * scale - 0.5,
        cy: (intrinsics.cy + 0.5) * scale - 0.5,
        width: side(intrinsics.width),
        height: side(intrinsics.height),
    }
}

/// A hypothesis of MI over the bins of its histogram.
fn by_bins() -> Table {
    let rows = BINS.map(|bins| {
        let cost = MutualInformation::new(&MutualInformationParams {
            bins,
            ..MutualInformationParams::default()
        });
        let (query, cloud) = seen_by(&cost);
        let time = hypothesis(&cloud.points, query, &PAIR.query.intrinsics, &cost);
        (bins as f64, vec![time])
    });
    Table {
        name: "bins",
        quantity: "bins",
        unit: "µs",
        columns: vec!["MI, a hypothesis"],
        rows: rows.to_vec(),
    }
}

/// Finding, describing and matching features over their number.
///
/// The photos are enlarged twice and made grainy, and nearly everything counts as a feature, so that there are
/// enough.
fn by_keypoints() -> Table {
    let photos = [&PAIR.query.photo.gray, &PAIR.reference.photo.gray];
    let [query, reference] = photos.map(enlarged);
    let params = |max_keypoints| SurfParams {
        threshold: 1.0,
        max_keypoints,
        ..SurfParams::default()
    };
    let most = KEYPOINTS[KEYPOINTS.len() - 1];
    let features: [Features; 2] = [&query, &reference].map(|photo| surf(photo, &params(most)));
    let there = features
        .iter()
        .map(|features| features.keypoints.len())
        .min()
        .unwrap_or(0);
    let rows = KEYPOINTS
        .into_iter()
        .filter(|&count| count <= there)
        .map(|count| {
            let found = median(|| surf(&query, &params(count)).keypoints.len());
            let [query, reference]: [&[Descriptor]; 2] = features
                .each_ref()
                .map(|features| &features.descriptors[..count]);
            let matched = median(|| nearest_neighbours(query, reference).len());
            (count as f64, vec![1e3 * found, 1e3 * matched])
        });
    Table {
        name: "keypoints",
        quantity: "keypoints in each photo",
        unit: "ms",
        columns: vec!["SURF of a photo", "matching one way"],
        rows: rows.collect(),
    }
}

/// Processor time of one hypothesis \[µs\].
fn hypothesis(
    points: &[ColoredPoint],
    query: Arc<FloatImage>,
    intrinsics: &Intrinsics,
    cost: &dyn Cost,
) -> f64 {
    let poses: Vec<_> = poses_of_a_disc().into_iter().step_by(EVERY).collect();
    let scorer = Scorer::new(points, query, intrinsics, 1, cost);
    scorer.score(&poses[..1]);
    1e6 * median(|| scorer.score(&poses).len()) / poses.len() as f64
}

/// The median of some rounds \[s\].
fn median<T>(mut work: impl FnMut() -> T) -> f64 {
    let mut times = [0.0; ROUNDS];
    for time in &mut times {
        let begun = ProcessTime::now();
        std::hint::black_box(work());
        *time = begun.elapsed().as_secs_f64();
    }
    times.sort_by(f64::total_cmp);
    times[ROUNDS / 2]
}

/// Twice as wide and high, a pixel between two their mean, with grain: enlarging alone adds no blobs.
fn enlarged(photo: &GrayImage) -> GrayImage {
    const GRAIN: i32 = 24;
    let mut rng = Pcg64::seed_from_u64(5);
    let (width, height) = (photo.width(), photo.height());
    let value = |x: u32, y: u32| {
        let at =
            |x: u32, y: u32| u32::from(photo.get_pixel(x.min(width - 1), y.min(height - 1)).0[0]);
        let [left, right] = [x / 2, x.div_ceil(2)];
        let [top, bottom] = [y / 2, y.div_ceil(2)];
        (at(left, top) + at(right, top) + at(left, bottom) + at(right, bottom)) / 4
    };
    GrayImage::from_fn(2 * width, 2 * height, |x, y| {
        let grainy = value(x, y) as i32 + rng.random_range(-GRAIN..=GRAIN);
        [grainy.clamp(0, 255) as u8].into()
    })
}
