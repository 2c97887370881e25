//! Accumulates the scans around a frame to one cloud.

use std::path::{Path, PathBuf};

use nalgebra::Point3;
use posescope_core::files;

use super::super::file_scene::{Clouds, Frame};
use super::super::folder::numbered;
use super::super::trajectory::Trajectory;
use super::super::view_crop::in_view;
use super::super::{Lengths, SceneError};
use super::sdk::Sdk;
use crate::cloud::Cloud;
use crate::geometry::Pose;

/// Scans up to this time before and after a frame are accumulated, if the car was near \[µs\].
const AROUND_US: u64 = 15_000_000;
/// Scans from farther away are skipped \[m\].
const NEAR_M: f64 = 50.0;
/// The largest scan file \[bytes\]; a scan of the LMS has 13 kB.
const LONGEST_SCAN: u64 = 1 << 26;

/// The laser scanners, and whether they scan a plane (x, y, reflectance) or space (x, y, z).
const SCANNERS: [(&str, bool); 3] = [("lms_front", true), ("lms_rear", true), ("ldmrs", false)];

pub(super) struct ScanFile {
    /// The time of the scan \[µs\].
    time: u64,
    path: PathBuf,
    is_planar: bool,
    vehicle_from_scanner: Pose,
}

/// All scans of a traversal, by time.
pub(super) fn scan_files(traversal: &Path, sdk: &Sdk) -> Result<Vec<ScanFile>, SceneError> {
    let mut files = Vec::new();
    for (scanner, is_planar) in SCANNERS {
        let folder = traversal.join(scanner);
        if !folder.is_dir() {
            continue;
        }
        let vehicle_from_scanner = sdk.extrinsics(scanner)?;
        let scans = numbered(&folder, "bin")?.into_iter();
        files.extend(scans.map(|(time, path)| ScanFile {
            time,
            path,
            is_planar,
            vehicle_from_scanner,
        }));
    }
    files.sort_by(|a, b| (a.time, &a.path).cmp(&(b.time, &b.path)));
    Ok(files)
}

/// The scans of a traversal. A frame's cloud is made of the scans around it.
pub(super) struct Scans {
    pub files: Vec<ScanFile>,
    /// The motion of the vehicle.
    pub motion: Trajectory,
    /// The times of the frames \[µs\].
    pub times: Vec<u64>,
    pub image_from_vehicle: Pose,
}

impl Scans {
    fn around(&self, time: u64) -> &[ScanFile] {
        let before = |limit: u64| move |file: &ScanFile| file.time < limit;
        let first = before(time.saturating_sub(AROUND_US));
        let end = before(time.saturating_add(AROUND_US + 1));
        &self.files[self.files.partition_point(first)..self.files.partition_point(end)]
    }
}

impl Clouds for Scans {
    fn has(&self, index: usize) -> bool {
        let time = self.times[index];
        self.motion.at(time as f64).is_some() && !self.around(time).is_empty()
    }

    fn lengths(&self) -> Lengths {
        Lengths::Street
    }

    fn missing(&self) -> Option<&str> {
        Some(
            "scans of lms_front, lms_rear or ldmrs around its time expected, and the motion of the car in \
             vo/vo.csv or gps/ins.csv",
        )
    }

    fn read(&self, index: usize, frame: &Frame) -> Result<Cloud, SceneError> {
        let time = self.times[index];
        let Some(here) = self.motion.at(time as f64) else {
            return Ok(Cloud::default());
        };
        let mut gathered: Vec<Point3<f64>> = Vec::new();
        for file in self.around(time) {
            let Some(there) = self.motion.at(file.time as f64) else {
                continue;
            };
            let now_from_then = here.inverse() * there;
            if now_from_then.translation.vector.norm() > NEAR_M {
                continue;
            }
            let image_from_scanner =
                self.image_from_vehicle * now_from_then * file.vehicle_from_scanner;
            let points = read(file)?.into_iter();
            gathered.extend(points.map(|point| image_from_scanner * point));
        }
        Ok(in_view(gathered.into_iter(), &frame.intrinsics))
    }
}

/// The points of a scan in the scanner's frame: triples of `f64`.
fn read(file: &ScanFile) -> Result<Vec<Point3<f64>>, SceneError> {
    let path = &file.path;
    let io = SceneError::io(path);
    let size = std::fs::metadata(path).map_err(io)?.len();
    if size % 24 != 0 || size > LONGEST_SCAN {
        return Err(SceneError::expected(
            path,
            format!(
                "a scan of 24 bytes per point and at most {LONGEST_SCAN} bytes expected, {size} bytes found"
            ),
        ));
    }
    let bytes = files::read(path, files::TEXT).map_err(io)?;
    let (points, _) = bytes.as_chunks::<24>();
    let point = |point: &[u8; 24]| {
        let (numbers, _) = point.as_chunks::<8>();
        let [x, y, third] = [0, 1, 2].map(|at| f64::from_le_bytes(numbers[at]));
        let z = if file.is_planar { 0.0 } else { third };
        let is_finite = x.is_finite() && y.is_finite() && z.is_finite();
        is_finite
            .then_some(Point3::new(x, y, z))
            .ok_or_else(|| SceneError::expected(path, "finite positions expected"))
    };
    points.iter().map(point).collect()
}
