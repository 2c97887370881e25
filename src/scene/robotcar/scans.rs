//! Scans around a frame, gathered into one cloud.

use std::path::{Path, PathBuf};

use nalgebra::Point3;

use super::super::SceneError;
use super::super::view_crop::in_view;
use super::poses::Track;
use super::sdk::Sdk;
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::geometry::Pose;

/// Scans from this long before and after a frame are gathered, as long as the car was near \[µs\].
const AROUND_US: u64 = 15_000_000;
/// Scans from farther away than this are left out \[m\].
const NEAR_M: f64 = 50.0;
/// Bytes of a scan at most; a scan of the LMS has 13 kB.
const LONGEST_SCAN: u64 = 1 << 26;

/// A laser scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scanner {
    /// In a plane: x, y, reflectance.
    Lms(&'static str),
    /// In space: x, y, z.
    Ldmrs,
}

impl Scanner {
    const ALL: [Self; 3] = [Self::Lms("lms_front"), Self::Lms("lms_rear"), Self::Ldmrs];

    fn name(self) -> &'static str {
        match self {
            Self::Lms(name) => name,
            Self::Ldmrs => "ldmrs",
        }
    }
}

/// A scan that is there.
#[derive(Debug)]
pub(super) struct ScanFile {
    /// When it was taken \[µs\].
    time: u64,
    scanner: Scanner,
    path: PathBuf,
}

/// All scans of a traversal, by time.
pub(super) fn scan_files(traversal: &Path, sdk: &Sdk) -> Result<Vec<ScanFile>, SceneError> {
    let mut files = Vec::new();
    for scanner in Scanner::ALL {
        let folder = traversal.join(scanner.name());
        if !folder.is_dir() {
            continue;
        }
        sdk.extrinsics(scanner.name())?;
        let io = SceneError::io(&folder);
        for entry in std::fs::read_dir(&folder).map_err(io)? {
            let path = entry.map_err(io)?.path();
            let name = path.file_name().and_then(|name| name.to_str());
            let time = name.and_then(|name| name.strip_suffix(".bin")?.parse().ok());
            if let Some(time) = time {
                files.push(ScanFile {
                    time,
                    scanner,
                    path,
                });
            }
        }
    }
    files.sort_by(|a, b| (a.time, &a.path).cmp(&(b.time, &b.path)));
    Ok(files)
}

fn around(files: &[ScanFile], time: u64) -> &[ScanFile] {
    let first = files.partition_point(|file| file.time < time.saturating_sub(AROUND_US));
    let last = files.partition_point(|file| file.time <= time.saturating_add(AROUND_US));
    &files[first..last]
}

/// Whether there is a scan around a time.
pub(super) fn any_around(files: &[ScanFile], time: u64) -> bool {
    !around(files, time).is_empty()
}

/// The points that a camera has in view at a time, in its frame.
pub(super) fn gathered(
    files: &[ScanFile],
    sdk: &Sdk,
    motion: &Track,
    time: u64,
    image_from_vehicle: &Pose,
    camera: &Intrinsics,
) -> Result<Cloud, SceneError> {
    let mut gathered: Vec<Point3<f64>> = Vec::new();
    let Some(here) = motion.at(time) else {
        return Ok(Cloud::default());
    };
    let mut mounts: Vec<(Scanner, Pose)> = Vec::new();
    for file in around(files, time) {
        let Some(there) = motion.at(file.time) else {
            continue;
        };
        let now_from_then = here.inverse() * there;
        if now_from_then.translation.vector.norm() > NEAR_M {
            continue;
        }
        let known = mounts.iter().find(|(scanner, _)| *scanner == file.scanner);
        let vehicle_from_scanner = match known {
            Some((_, mount)) => *mount,
            None => {
                let mount = sdk.extrinsics(file.scanner.name())?;
                mounts.push((file.scanner, mount));
                mount
            }
        };
        let image_from_scanner = image_from_vehicle * now_from_then * vehicle_from_scanner;
        let points = read(file)?.into_iter();
        gathered.extend(points.map(|point| image_from_scanner * point));
    }
    Ok(in_view(gathered.into_iter(), camera))
}

/// The points of a scan in the scanner's frame: triples of numbers of eight bytes.
fn read(file: &ScanFile) -> Result<Vec<Point3<f64>>, SceneError> {
    let path = &file.path;
    let io = SceneError::io(path);
    let error = |expected: String| SceneError::expected(path, expected);
    let size = std::fs::metadata(path).map_err(io)?.len();
    if size % 24 != 0 || size > LONGEST_SCAN {
        return Err(error(format!(
            "a scan of 24 bytes for each point expected, at most {LONGEST_SCAN}, {size} found"
        )));
    }
    let bytes = std::fs::read(path).map_err(io)?;
    let number = |bytes: &[u8]| f64::from_le_bytes(bytes.try_into().unwrap_or([0; 8]));
    bytes
        .chunks_exact(24)
        .map(|point| {
            let [x, y, third] = [0, 8, 16].map(|at| number(&point[at..at + 8]));
            let z = match file.scanner {
                // The third is the reflectance.
                Scanner::Lms(_) => 0.0,
                Scanner::Ldmrs => third,
            };
            let point = Point3::new(x, y, z);
            let is_finite = point.iter().all(|value| value.is_finite());
            is_finite
                .then_some(point)
                .ok_or_else(|| error("finite positions expected".to_owned()))
        })
        .collect()
}
