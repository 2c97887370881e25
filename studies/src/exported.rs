//! Cases as files that other programs can read.

use std::fs;
use std::path::Path;
use std::time::Instant;

use image::GrayImage;
use posescope::features::{SiftParams, sift};
use posescope::geometry::PoseError;
use posescope::params::Params;
use posescope::problem::Problem;
use serde_json::{Value, json};

use crate::Failure;
use crate::cases::Case;

/// What a method made of a case.
pub struct Answer {
    pub method: String,
    pub seconds: f64,
    pub error: Option<PoseError>,
}

/// The same problem, of which nothing has been computed yet.
pub fn forgetful(problem: &Problem) -> Problem {
    let (query, reference) = (problem.query().as_ref(), problem.reference().as_ref());
    problem.clone().with_query(query.clone()).with_reference(reference.clone())
}

/// Writes a case into a folder within this one: both photos (`*.u8`), the points that the reference camera sees
/// (`points.f32`, in its frame), our SIFT features as column, row and descriptor (`*_sift.f32`), and `case.json`. All
/// numbers are little-endian.
pub fn write(
    folder: &Path,
    case: &Case,
    answers: impl Iterator<Item = Answer>,
) -> Result<(), Failure> {
    let (query, reference) = (case.problem.query(), case.problem.reference());
    let row = case.rows.first().map_or("", String::as_str);
    let name = format!("{row} {} {}", query.name(), reference.name());
    let name = name.replace(|letter: char| !letter.is_alphanumeric(), "_");
    let folder = folder.join(name);
    fs::create_dir_all(&folder)?;
    let floats = |name: &str, values: &mut dyn Iterator<Item = f32>| {
        fs::write(folder.join(name), values.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
    };
    let mut seconds = Vec::new();
    for (side, photo) in [("query", &query.photo().gray), ("reference", &reference.photo().gray)] {
        fs::write(folder.join(format!("{side}.u8")), photo.as_raw())?;
        let (numbers, took_s) = sift_numbers(photo);
        floats(&format!("{side}_sift.f32"), &mut numbers.into_iter())?;
        seconds.push(took_s);
    }
    let seen = reference.visible_cloud(&Params::default().render);
    floats("points.f32", &mut seen.positions().flat_map(|point| [point.x, point.y, point.z]))?;
    let matrix = |matrix: nalgebra::Matrix4<f64>| matrix.transpose().as_slice().to_vec();
    let truth = case.problem.reference_from_query(&case.truth);
    let camera = |of: &posescope::camera::Intrinsics| json!({ "size": [of.width, of.height], "camera": [of.fx, of.fy, of.cx, of.cy] });
    let answers = answers.map(|answer| {
        let error = answer.error.map(|error| json!([error.translation_m, error.rotation_deg]));
        json!({ "method": answer.method, "seconds": answer.seconds, "error": error })
    });
    let about = json!({
        "row": row,
        "query": camera(query.intrinsics()),
        "reference": camera(reference.intrinsics()),
        "reference_from_query": matrix(truth.to_homogeneous()),
        "sift_seconds": seconds,
        "answers": answers.collect::<Vec<Value>>(),
    });
    fs::write(folder.join("case.json"), serde_json::to_vec_pretty(&about)?)?;
    Ok(())
}

/// The features as fb2 detects them, and how long that took \[s\].
fn sift_numbers(photo: &GrayImage) -> (Vec<f32>, f64) {
    let started = Instant::now();
    let found = sift(photo, &SiftParams::default());
    let seconds = started.elapsed().as_secs_f64();
    let both = found.keypoints.iter().zip(&found.descriptors);
    let numbers = both.flat_map(|(at, of)| [at.x, at.y].into_iter().chain(of.iter().copied()));
    (numbers.collect(), seconds)
}
