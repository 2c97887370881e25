use std::fs;
use std::io::{BufRead as _, Write as _};
use std::path::{Path, PathBuf};

use cpu_time::ProcessTime;
use image::{GrayImage, Luma};
use nalgebra::{Point2, Rotation2};
use posescope::features::{sift, surf};
use posescope::geometry::Pose;
use posescope::image::cubic_interpolated;
use posescope::robust::MlesacParams;
use posescope_studies::stages::{TRIALS, turning, turning_sift, with_stage};
use posescope_studies::{Outliers, PAIR, poses_of_a_disc, registered_cost, seen_by};
use serde_json::json;

use crate::Failure;

/// Our side of studies/peers/peers.py, which compares posescope with others.
///
/// Reads names of stages, one a line, runs each once on one thread, and answers with a line of JSON: processor time
/// [s], how many items it took them for, and how good the outcome is. The pair is one of the street, or the one that
/// POSESCOPE_SCENE and POSESCOPE_PAIR name.
#[derive(clap::Args)]
pub struct Options {
    /// Write the inputs as plain little-endian numbers into this folder, described in `meta.json`, and end.
    #[arg(long)]
    export: Option<PathBuf>,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    if let Some(folder) = &options.export {
        return export(folder);
    }
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let answer = with_stage(line.trim(), |items, work| {
            let begun = ProcessTime::now();
            let outcome = std::hint::black_box(work());
            let seconds = begun.elapsed().as_secs_f64();
            json!({ "seconds": seconds, "items": items, "outcome": outcome })
        });
        println!("{}", answer.ok_or(format!("{line}: no stage"))?);
        std::io::stdout().flush()?;
    }
    Ok(())
}

fn export(folder: &Path) -> Result<(), Failure> {
    fs::create_dir_all(folder)?;
    let write = |name: &str, bytes: Vec<u8>| fs::write(folder.join(name), bytes);
    let floats = |name: &str, values: &mut dyn Iterator<Item = f32>| {
        write(&format!("{name}.f32"), values.flat_map(f32::to_le_bytes).collect())
    };
    let doubles = |name: &str, values: &mut dyn Iterator<Item = f64>| {
        write(&format!("{name}.f64"), values.flat_map(f64::to_le_bytes).collect())
    };
    for (name, photo) in [("query", PAIR.query().photo()), ("reference", PAIR.reference().photo())]
    {
        write(&format!("{name}.u8"), photo.gray.as_raw().clone())?;
        let descriptors = surf(&photo.gray, &turning()).descriptors;
        let numbers = descriptors.as_flattened().iter().copied();
        floats(&format!("{name}_descriptors"), &mut { numbers })?;
    }
    let (warped, to_warped) = warped(&PAIR.reference().photo().gray);
    write("warped.u8", warped.as_raw().clone())?;
    for (name, photo) in [("reference", &PAIR.reference().photo().gray), ("warped", &warped)] {
        let found = sift(photo, &turning_sift());
        let both = found.keypoints.iter().zip(&found.descriptors);
        let numbers = both.flat_map(|(at, of)| [at.x, at.y].into_iter().chain(of.iter().copied()));
        floats(&format!("{name}_sift"), &mut { numbers })?;
    }
    let (query, cloud) = seen_by(registered_cost("mi").as_ref());
    floats("query_channel", &mut query.iter().copied())?;
    let points = || cloud.points.iter();
    floats("points", &mut points().flat_map(|point| point.position.coords.data.0[0]))?;
    floats("values", &mut points().map(|point| point.intensity))?;
    let poses = poses_of_a_disc();
    doubles("poses", &mut poses.iter().flat_map(|pose| rows_of(&pose.inverse())))?;
    for (name, case) in Outliers::cases() {
        let numbers = (0..TRIALS).flat_map(|trial| {
            let (correspondences, truth) = case.draw(trial);
            let numbers = correspondences
                .into_iter()
                .flat_map(|c| [c.pixel.x, c.pixel.y, c.point.x, c.point.y, c.point.z]);
            rows_of(&truth).into_iter().chain(numbers).collect::<Vec<f64>>()
        });
        doubles(&name, &mut { numbers })?;
    }
    let intrinsics = PAIR.query().intrinsics();
    let params = MlesacParams::default();
    let meta = json!({
        "query": PAIR.query().name(),
        "reference": PAIR.reference().name(),
        "width": intrinsics.width,
        "height": intrinsics.height,
        "camera": [intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy],
        "warped": [warped.width(), warped.height()],
        "to_warped": to_warped,
        "points": cloud.points.len(),
        "poses": poses.len(),
        "trials": TRIALS,
        "cases": Outliers::cases().map(|(name, _)| name).collect::<Vec<_>>(),
        "inlier_px": params.inlier_threshold_px,
        "confidence": params.confidence,
        "most_trials": params.max_trials,
    });
    fs::write(folder.join("meta.json"), serde_json::to_vec_pretty(&meta)?)?;
    Ok(())
}

/// The photo turned by 15° and enlarged 1.3 times, large enough for all of it; and what takes one of its pixels there,
/// two rows of three numbers.
fn warped(photo: &GrayImage) -> (GrayImage, [f32; 6]) {
    let turn = Rotation2::new(15_f32.to_radians()).into_inner() * 1.3;
    let (right, bottom) = ((photo.width() - 1) as f32, (photo.height() - 1) as f32);
    let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
    let corners = corners.map(|(x, y)| turn * Point2::new(x, y));
    let low = corners.iter().fold(corners[0], |low, corner| low.inf(corner));
    let high = corners.iter().fold(corners[0], |high, corner| high.sup(corner));
    let size = (high - low).map(|side| side.ceil() as u32 + 1);
    let back = turn.transpose() / (1.3 * 1.3);
    let copy = GrayImage::from_fn(size.x, size.y, |x, y| {
        let at = back * (Point2::new(x as f32, y as f32) + low.coords);
        Luma([cubic_interpolated(photo, at.x, at.y).round().clamp(0.0, 255.0) as u8])
    });
    (copy, [turn.m11, turn.m12, -low.x, turn.m21, turn.m22, -low.y])
}

/// Rotation and translation, row by row.
fn rows_of(pose: &Pose) -> [f64; 12] {
    let m = pose.to_homogeneous();
    std::array::from_fn(|i| m[(i / 4, i % 4)])
}
