//! Scenes with better poses than their own.

use std::collections::HashMap;
use std::path::Path;

use nalgebra::Matrix3x4;
use posescope::geometry::{Pose, pose_from_matrix};
use posescope::scene::{self, Scene};

use crate::Failure;

/// A scene with other poses.
struct Corrected {
    scene: Box<dyn Scene>,
    poses: HashMap<String, Pose>,
}

impl Scene for Corrected {
    posescope::inner_scene!(scene: name, frames, intrinsics, time_s, has_cloud, photo, cloud);

    fn pose(&self, frame: usize) -> Option<Pose> {
        self.poses.get(&self.frames()[frame]).copied()
    }
}

/// Opens a scene, with the poses of a file if one is named: lines of a frame's name, which may lack leading zeros,
/// and a 3 × 4 matrix. Frames that the file does not name have no pose.
pub fn open(argument: &str, poses: Option<&Path>) -> Result<Box<dyn Scene>, Failure> {
    let scene = scene::open(argument, None)?;
    let Some(path) = poses else { return Ok(scene) };
    let error_at = |line: &str, error: &str| format!("{}: {line}: {error}", path.display());
    let text = std::fs::read_to_string(path).map_err(|error| error_at("", &error.to_string()))?;
    let mut poses = HashMap::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let mut words = line.split_whitespace();
        let Some(name) = words.next() else { continue };
        let numbers: Vec<f64> = words.filter_map(|word| word.parse().ok()).collect();
        if numbers.len() != 12 {
            return Err(error_at(line, "a name and 12 numbers expected").into());
        }
        let pose = pose_from_matrix(&Matrix3x4::from_row_slice(&numbers));
        let pose = pose.map_err(|error| error_at(line, &error.to_string()))?;
        poses.extend([0, 6, 10].map(|width| (format!("{name:0>width$}"), pose)));
    }
    Ok(Box::new(Corrected { scene, poses }))
}
