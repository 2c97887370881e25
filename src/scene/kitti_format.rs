//! The common parts of both KITTI layouts: cameras, labelled lines, projection matrices and scans.

use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Matrix3x4, Point3, Translation3, UnitQuaternion, Vector3};
use posescope_core::files;

use super::file_scene::{Clouds, Frame};
use super::lens::pinhole;
use super::lines::TextFile;
use super::{Lengths, SceneError};
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;

/// The folder of a camera's images in the folder of a drive.
pub(super) struct Camera<'a> {
    /// The drive.
    pub folder: &'a Path,
    /// The camera, if the path names one.
    pub wanted: Option<&'static str>,
    known: &'a [&'static str],
}

impl<'a> Camera<'a> {
    /// Splits the path of a drive or of one of its cameras. `known` lists the cameras in the order of preference.
    pub fn of_path(path: &'a Path, known: &'a [&'static str]) -> Self {
        let last = path.file_name().and_then(|name| name.to_str());
        let named = known.iter().find(|camera| last == Some(camera)).copied();
        let (folder, wanted) = match (path.parent(), named) {
            (Some(drive), Some(camera)) => (drive, Some(camera)),
            _ => (path, None),
        };
        Self { folder, wanted, known }
    }

    /// The camera's folder: the one in the path, or the first that exists.
    pub fn name(&self) -> Result<&'static str, SceneError> {
        let mut known = self.known.iter().copied();
        let found = || known.find(|camera| self.folder.join(camera).is_dir());
        self.wanted.or_else(found).ok_or_else(|| {
            let known = self.known.join(", ");
            SceneError::expected(
                self.folder,
                format!("an image folder expected ({known}), none found"),
            )
        })
    }
}

/// The numbers of the line `LABEL: …`.
pub(super) fn labelled<const N: usize>(
    file: &TextFile,
    label: &str,
) -> Result<[f64; N], SceneError> {
    optional(file, label)?
        .ok_or_else(|| file.error(format!("a line `{label}:` expected, none found")))
}

/// The numbers of the line `LABEL: …`, if there is one.
pub(super) fn optional<const N: usize>(
    file: &TextFile,
    label: &str,
) -> Result<Option<[f64; N]>, SceneError> {
    for line in file.lines() {
        if let Some((found, text)) = line.text.split_once(':')
            && found.trim() == label
        {
            return line.numbers_of(text).map(Some);
        }
    }
    Ok(None)
}

/// The intrinsics of a projection matrix P = K [I | t], and the transform from the rectified camera 0.
pub(super) fn split_projection(
    projection: &[f64; 12],
    size: (u32, u32),
    file: &TextFile,
) -> Result<(Intrinsics, Pose), SceneError> {
    let projection = Matrix3x4::from_row_slice(projection);
    let k: Matrix3<f64> = projection.fixed_columns::<3>(0).into_owned();
    let inverse = k
        .try_inverse()
        .ok_or_else(|| file.error("a projection matrix with positive focal lengths expected"))?;
    let camera = [k[(0, 0)], k[(1, 1)], k[(0, 2)], k[(1, 2)]];
    let intrinsics = pinhole(camera, size).map_err(|why| file.error(why))?;
    let translation: Vector3<f64> = inverse * projection.column(3);
    let camera_from_camera0 =
        Pose::from_parts(Translation3::from(translation), UnitQuaternion::identity());
    Ok((intrinsics, camera_from_camera0))
}

/// The scans of a drive.
pub(super) struct Scans {
    /// The path of each frame's scan, whether it exists or not.
    pub paths: Vec<PathBuf>,
    /// Whether it existed when the scene was opened: files that vanish later are errors, not another choice of
    /// references.
    pub exist: Vec<bool>,
    /// What all frames lack.
    pub missing: Option<&'static str>,
    /// Moves a point of the scan of a frame, by the frame's position, to the camera's frame.
    pub into_camera: Box<dyn Fn(usize, Point3<f64>) -> Point3<f64> + Send + Sync>,
}

impl Clouds for Scans {
    fn has(&self, index: usize) -> bool {
        self.missing.is_none() && self.exist[index]
    }

    fn lengths(&self) -> Lengths {
        Lengths::Street
    }

    fn place<'a>(&'a self, index: usize, _frame: &'a Frame) -> &'a Path {
        &self.paths[index]
    }

    fn missing(&self) -> Option<&str> {
        self.missing
    }

    fn read(&self, index: usize, _frame: &Frame) -> Result<Cloud, SceneError> {
        read_scan(&self.paths[index], |point| (self.into_camera)(index, point))
    }
}

/// Reads a scan (little-endian `f32` x, y, z, reflectance) and moves its points.
fn read_scan(
    path: &Path,
    into_camera: impl Fn(Point3<f64>) -> Point3<f64>,
) -> Result<Cloud, SceneError> {
    const BYTES_PER_POINT: usize = 16;
    let bytes = files::read(path, files::SCAN).map_err(SceneError::io(path))?;
    let content = |expected: String| SceneError::expected(path, expected);
    if bytes.is_empty() {
        return Err(content("points expected, the scan is empty".to_owned()));
    }
    let (records, []) = bytes.as_chunks::<BYTES_PER_POINT>() else {
        return Err(content(format!(
            "whole points of {BYTES_PER_POINT} bytes expected, {} bytes found; the file is cut off",
            bytes.len()
        )));
    };
    let point = |(index, record): (usize, &[u8; BYTES_PER_POINT])| {
        let (numbers, _) = record.as_chunks::<4>();
        let [x, y, z] = [0, 1, 2].map(|axis| f64::from(f32::from_le_bytes(numbers[axis])));
        if !(x.is_finite() && y.is_finite() && z.is_finite()) {
            return Err(content(format!(
                "finite coordinates expected, point {index} (byte {}) is {x}, {y}, {z}",
                index * BYTES_PER_POINT
            )));
        }
        Ok(into_camera(Point3::new(x, y, z)).cast())
    };
    let points = records.iter().enumerate().map(point);
    Ok(Cloud { points: points.collect::<Result<_, _>>()? })
}

/// The text of a file in which the line `LABEL: …` has other numbers.
pub(super) fn with_labelled(text: &str, label: &str, numbers: &[f64]) -> String {
    let is_it = |line: &&str| line.split_once(':').is_some_and(|(found, _)| found.trim() == label);
    let numbers: Vec<String> = numbers.iter().map(|number| format!("{number:.12}")).collect();
    let lines = text.lines().map(|line| match Some(line).filter(is_it) {
        Some(_) => format!("{label}: {}\n", numbers.join(" ")),
        None => format!("{line}\n"),
    });
    lines.collect()
}

/// The change in the frame of the rectified camera 0 for one in the frame of a camera.
pub(super) fn in_camera0(change: &Pose, camera_from_camera0: &Pose) -> Pose {
    camera_from_camera0.inverse() * change * camera_from_camera0
}
