//! The inputs that others are timed on, and our own times on the same: `benches/peers/peers.py` runs it.
//!
//! `… export FOLDER` writes the inputs as plain little-endian numbers, described in `meta.json`.
//! `… serve` reads names of stages, one a line, runs each once on one thread, and answers with a line of
//! JSON: processor time \[s\], how many items it took them for, and how good the outcome is.
//!
//! The pair is that of the stages, named in the environment.

mod both_costs;
mod pair;
mod problems;

use std::error::Error;
use std::fs;
use std::io::{BufRead as _, Write as _};
use std::path::Path;
use std::sync::LazyLock;

use cpu_time::ProcessTime;
use posescope::estimator;
use posescope::features::{Descriptor, Features, SurfParams, nearest_neighbours, surf};
use posescope::geometry::Pose;
use posescope::method::Method;
use posescope::params::Params;
use posescope::render::Scorer;
use posescope::robust::{MlesacParams, mlesac};
use posescope::solver::{Correspondence, p3p};
use posescope::trace::Trace;
use serde_json::{Value, json};

use self::both_costs::with_both_costs;
use self::pair::{PAIR, poses_of_a_disc, registered_cost, seen_by};
use self::problems::{Outliers, P3pProblem, p3p_problems};

const P3P_PROBLEMS: usize = 20_000;
/// Trials of each case of robust estimation.
const TRIALS: u64 = 10;
const PERCENT: [usize; 4] = [30, 60, 80, 90];
const CORRESPONDENCES: [usize; 2] = [200, 1000];

fn main() -> Result<(), Box<dyn Error>> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()?;
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let plain: Vec<&str> = arguments
        .iter()
        .map(String::as_str)
        .filter(|argument| *argument != "--bench")
        .collect();
    match plain.as_slice() {
        ["export", folder] => export(Path::new(folder)),
        ["serve"] => serve(),
        _ => Err("export FOLDER or serve expected".into()),
    }
}

/// The features that turn with the image, as those of the peers do.
fn turning() -> SurfParams {
    SurfParams {
        upright: false,
        ..SurfParams::default()
    }
}

static FEATURES: LazyLock<[Features; 2]> = LazyLock::new(|| {
    let photos = [&PAIR.query.photo.gray, &PAIR.reference.photo.gray];
    photos.map(|gray| surf(gray, &turning()))
});

fn cases() -> impl Iterator<Item = (String, Outliers)> {
    PERCENT.into_iter().flat_map(|percent| {
        CORRESPONDENCES.into_iter().map(move |correspondences| {
            let case = Outliers {
                percent,
                correspondences,
            };
            (format!("pose_{percent}_{correspondences}"), case)
        })
    })
}

fn export(folder: &Path) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    let write = |name: &str, bytes: Vec<u8>| fs::write(folder.join(name), bytes);
    let floats = |values: &mut dyn Iterator<Item = f32>| -> Vec<u8> {
        values.flat_map(f32::to_le_bytes).collect()
    };
    let doubles = |values: &mut dyn Iterator<Item = f64>| -> Vec<u8> {
        values.flat_map(f64::to_le_bytes).collect()
    };
    for (name, photo) in [
        ("query", &PAIR.query.photo),
        ("reference", &PAIR.reference.photo),
    ] {
        write(&format!("{name}.u8"), photo.gray.as_raw().clone())?;
    }
    for (name, features) in ["query", "reference"].into_iter().zip(&*FEATURES) {
        let numbers = features.descriptors.as_flattened();
        write(
            &format!("{name}_descriptors.f32"),
            floats(&mut numbers.iter().copied()),
        )?;
    }
    let cost = registered_cost("mi");
    let (query, cloud) = seen_by(cost.as_ref());
    write("query_channel.f32", floats(&mut query.iter().copied()))?;
    let positions = cloud
        .points
        .iter()
        .flat_map(|point| point.position.coords.data.0[0]);
    write("points.f32", floats(&mut positions.into_iter()))?;
    let values = cloud.points.iter().map(|point| point.intensity);
    write("values.f32", floats(&mut values.into_iter()))?;
    let poses = poses_of_a_disc();
    let rows = poses.iter().flat_map(|pose| rows_of(&pose.inverse()));
    write("poses.f64", doubles(&mut rows.into_iter()))?;
    let problems = p3p_problems(P3P_PROBLEMS);
    let numbers = problems.iter().flat_map(|(bearings, points)| {
        let bearings = bearings.iter().flat_map(|bearing| bearing.data.0[0]);
        let points = points.iter().flat_map(|point| point.coords.data.0[0]);
        bearings.chain(points)
    });
    write("p3p.f64", doubles(&mut numbers.into_iter()))?;
    for (name, case) in cases() {
        let numbers = (0..TRIALS).flat_map(|trial| {
            let (correspondences, truth) = case.draw(trial);
            let numbers = correspondences.into_iter().flat_map(|c| {
                let Correspondence { pixel, point } = c;
                [pixel.x, pixel.y, point.x, point.y, point.z]
            });
            rows_of(&truth)
                .into_iter()
                .chain(numbers)
                .collect::<Vec<f64>>()
        });
        write(&format!("{name}.f64"), doubles(&mut numbers.into_iter()))?;
    }
    let intrinsics = &PAIR.query.intrinsics;
    let meta = json!({
        "query": PAIR.query.name,
        "reference": PAIR.reference.name,
        "width": intrinsics.width,
        "height": intrinsics.height,
        "camera": [intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy],
        "points": cloud.points.len(),
        "poses": poses.len(),
        "trials": TRIALS,
        "cases": cases().map(|(name, _)| name).collect::<Vec<_>>(),
        "inlier_px": MlesacParams::default().inlier_threshold_px,
        "confidence": MlesacParams::default().confidence,
        "most_trials": MlesacParams::default().max_trials,
        "version": env!("CARGO_PKG_VERSION"),
    });
    fs::write(folder.join("meta.json"), serde_json::to_vec_pretty(&meta)?)?;
    Ok(())
}

/// Rotation and translation, row by row.
fn rows_of(pose: &Pose) -> [f64; 12] {
    let m = pose.to_homogeneous();
    std::array::from_fn(|i| m[(i / 4, i % 4)])
}

/// What a stage took and gave.
struct Measured {
    seconds: f64,
    /// What the seconds are divided by.
    items: usize,
    outcome: Value,
}

fn serve() -> Result<(), Box<dyn Error>> {
    let mut bench = Bench::new();
    for line in std::io::stdin().lock().lines() {
        let measured = bench.run(line?.trim())?;
        let answer = json!({
            "seconds": measured.seconds,
            "items": measured.items,
            "outcome": measured.outcome,
        });
        println!("{answer}");
        std::io::stdout().flush()?;
    }
    Ok(())
}

/// All stages with what they work on.
struct Bench {
    problems: Vec<P3pProblem>,
    poses: Vec<Pose>,
}

impl Bench {
    fn new() -> Self {
        Self {
            problems: p3p_problems(P3P_PROBLEMS),
            poses: poses_of_a_disc(),
        }
    }

    fn run(&mut self, stage: &str) -> Result<Measured, Box<dyn Error>> {
        if let Some((_, case)) = cases().find(|(name, _)| name == stage) {
            return Ok(robust_pose(case));
        }
        Ok(match stage {
            "surf" => {
                let gray = &PAIR.reference.photo.gray;
                let (seconds, features) = timed(|| surf(gray, &turning()));
                Measured {
                    seconds,
                    items: features.keypoints.len(),
                    outcome: Value::Null,
                }
            }
            "surf_upright" => {
                let gray = &PAIR.reference.photo.gray;
                let (seconds, features) = timed(|| surf(gray, &SurfParams::default()));
                Measured {
                    seconds,
                    items: features.keypoints.len(),
                    outcome: Value::Null,
                }
            }
            "match" => {
                let [query, reference]: [&[Descriptor]; 2] = FEATURES
                    .each_ref()
                    .map(|features| features.descriptors.as_slice());
                let (seconds, found) = timed(|| nearest_neighbours(query, reference));
                let sum: usize = found.iter().flatten().map(|found| found.nearest).sum();
                Measured {
                    seconds,
                    items: query.len() * reference.len(),
                    outcome: json!({ "sum_of_nearest": sum }),
                }
            }
            "p3p" => {
                let problems = &self.problems;
                let (seconds, solutions) = timed(|| {
                    let solved = problems
                        .iter()
                        .map(|(bearings, points)| p3p(bearings, points));
                    solved.map(|solutions| solutions.len()).sum::<usize>()
                });
                Measured {
                    seconds,
                    items: problems.len(),
                    outcome: json!({ "solutions": solutions }),
                }
            }
            "pm_1" | "pm_3" | "mi_1" | "mi_3" => {
                let (name, splat) = stage.split_once('_').ok_or("a splat")?;
                let cost = registered_cost(name);
                let (query, cloud) = seen_by(cost.as_ref());
                let intrinsics = &PAIR.query.intrinsics;
                let scorer = Scorer::new(
                    &cloud.points,
                    query,
                    intrinsics,
                    splat.parse()?,
                    cost.as_ref(),
                );
                scorer.score(&self.poses[..1]);
                let (seconds, scores) = timed(|| scorer.score(&self.poses));
                let covered: u32 = scores.iter().map(|score| score.covered).sum();
                Measured {
                    seconds,
                    items: scores.len(),
                    outcome: json!({ "covered": covered }),
                }
            }
            "both_1" => self.both_costs(1),
            "both_3" => self.both_costs(3),
            "fb" | "pm" | "mi" => {
                let method: Method = stage.parse()?;
                let estimator = estimator::entry(method).make(&Params::default());
                let (seconds, outcome) = timed(|| estimator.estimate(&PAIR, &mut Trace::off()));
                let answered = outcome.is_ok_and(|outcome| outcome.pose.is_ok());
                Measured {
                    seconds,
                    items: 1,
                    outcome: json!({ "answered": answered }),
                }
            }
            _ => return Err(format!("{stage}: no stage").into()),
        })
    }

    /// One drawing for PM's cost and MI's.
    fn both_costs(&self, splat_px: usize) -> Measured {
        let (seconds, judged) = with_both_costs(splat_px, |judge| timed(|| judge(&self.poses)));
        Measured {
            seconds,
            items: self.poses.len(),
            outcome: json!({ "covered": judged.covered, "sum": judged.sum }),
        }
    }
}

/// All trials of a case; how many found the pose within 0.3 m, and the median distance from it \[m\].
fn robust_pose(case: Outliers) -> Measured {
    let intrinsics = &PAIR.query.intrinsics;
    let params = MlesacParams::default();
    let drawn: Vec<_> = (0..TRIALS).map(|trial| case.draw(trial)).collect();
    let (seconds, found) = timed(|| {
        let solve = |(correspondences, _): &(Vec<Correspondence>, Pose)| {
            mlesac(correspondences, intrinsics, &params, 0, |_| Ok::<_, ()>(())).ok()
        };
        drawn.iter().map(solve).collect::<Vec<_>>()
    });
    let mut distances: Vec<f64> = found
        .iter()
        .zip(&drawn)
        .map(|(found, (_, truth))| {
            let centre = |pose: &Pose| pose.inverse().translation.vector;
            found.as_ref().map_or(f64::INFINITY, |found| {
                (centre(&found.pose) - centre(truth)).norm()
            })
        })
        .collect();
    distances.sort_by(f64::total_cmp);
    Measured {
        seconds,
        items: drawn.len(),
        outcome: json!({
            "found": distances.iter().filter(|&&distance| distance < 0.3).count(),
            "median_m": distances[distances.len() / 2],
        }),
    }
}

/// Processor time of all threads \[s\].
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let begun = ProcessTime::now();
    let made = std::hint::black_box(work());
    (begun.elapsed().as_secs_f64(), made)
}
