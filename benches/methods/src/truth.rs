//! Poses that are better than a scene's.

use std::collections::HashMap;

use nalgebra::Matrix3x4;
use posescope::geometry::{Pose, pose_from_matrix};

/// Poses by the frames' names, which may have leading zeros.
pub fn poses(path: &str) -> Result<HashMap<String, Pose>, String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{path}: {error}"))?;
    let mut poses = HashMap::new();
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let mut words = line.split_whitespace();
        let Some(name) = words.next() else { continue };
        let numbers: Result<Vec<f64>, _> = words.map(str::parse).collect();
        let numbers = numbers.map_err(|error| format!("{path}: {error}"))?;
        if numbers.len() != 12 {
            return Err(format!("{path}: {line}: a name and 12 numbers expected"));
        }
        let pose = pose_from_matrix(&Matrix3x4::from_row_slice(&numbers));
        let pose = pose.map_err(|error| format!("{path}: {error}"))?;
        for width in [0, 6, 10] {
            poses.insert(format!("{name:0>width$}"), pose);
        }
    }
    Ok(poses)
}
