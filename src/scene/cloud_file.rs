//! Cloud files: PLY, PCD, LAS, LAZ, E57 and text (XYZ, CSV, PTS, PTX), detected by their content.
//!
//! Counts in headers are checked against the size of the file before anything is allocated.

mod collector;
mod decoding;
mod e57;
mod las;
mod pcd;
mod ply;
mod text;

use std::io::{BufReader, Read as _};
use std::path::Path;

use nalgebra::{Point3, Vector3};
use posescope_core::files;

pub(super) use collector::Note;
pub use decoding::is_decoding;

use self::collector::Collector;

use super::SceneError;
use super::lines::{excerpt_of, text_start};

/// The most points of a cloud, which take 1.2 GB.
pub(super) const MAX_POINTS: usize = 100_000_000;

/// A cloud in the frame of its file, which may be that of a map.
///
/// Map coordinates do not fit `f32`, so the points are stored relative to a local origin.
#[derive(Debug, Default)]
pub(super) struct MapCloud {
    /// The local origin \[m\].
    pub origin: Vector3<f64>,
    /// The points relative to the origin \[m\].
    pub points: Vec<Point3<f32>>,
    /// The least and the greatest coordinate along each axis \[m\].
    pub extent: [(f64, f64); 3],
    /// What the reader noticed.
    pub notes: Vec<Note>,
}

impl MapCloud {
    /// The points in the frame of their file \[m\].
    pub fn positions(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        let from_origin = |point: &Point3<f32>| point.cast::<f64>() + self.origin;
        self.points.iter().map(from_origin)
    }

    /// The cloud of a file whose coordinates are in a unit of this length \[m\].
    pub fn in_metres(mut self, unit_m: f64) -> Self {
        if unit_m == 1.0 {
            return self;
        }
        self.origin *= unit_m;
        for point in &mut self.points {
            *point = (point.cast::<f64>() * unit_m).cast();
        }
        self.extent = self.extent.map(|(least, most)| (least * unit_m, most * unit_m));
        self.notes = self.notes.into_iter().filter_map(|note| note.in_metres(unit_m)).collect();
        self
    }
}

/// Reads a cloud in any of the formats.
pub(super) fn read(path: &Path) -> Result<MapCloud, SceneError> {
    let io = SceneError::io(path);
    let mut start = Vec::new();
    let file = files::open(path).map_err(io)?;
    let size = file.metadata().map_err(io)?.len();
    BufReader::new(file).take(4096).read_to_end(&mut start).map_err(io)?;
    let read = if start.starts_with(b"ply\n") || start.starts_with(b"ply\r") {
        ply::read
    } else if start.starts_with(b"LASF") {
        las::read
    } else if start.starts_with(b"ASTM-E57") {
        e57::read
    } else if pcd::is_pcd(&start) {
        pcd::read
    } else if let Err(expected) = text_start(&start) {
        return Err(content(path, &expected));
    } else if start.contains(&0) {
        return Err(content(path, "a cloud in PLY, PCD, LAS, LAZ, E57 or text format expected"));
    } else {
        return text::read(path);
    };
    let cloud = read(path, size).map_err(|expected| content(path, &expected))?;
    if cloud.points.is_empty() {
        return Err(content(path, &no_point(&cloud)));
    }
    Ok(cloud)
}

/// The error of a cloud without points.
fn no_point(cloud: &MapCloud) -> String {
    let notes: String = cloud.notes.iter().map(|note| format!("; {note}")).collect();
    format!("at least one point expected, none found{notes}")
}

fn content(path: &Path, expected: &str) -> SceneError {
    // Some libraries have errors of several lines.
    let lines: Vec<&str> = expected.split_whitespace().collect();
    SceneError::expected(path, excerpt_of(&lines.join(" "), 200))
}

/// Refuses a header that announces more points than the file can hold.
fn expect_room(points: u64, least_bytes: u64, size: u64) -> Result<(), String> {
    if points > size / least_bytes.max(1) {
        return Err(format!(
            "{points} points of at least {least_bytes} bytes expected, but the file has only {size} \
             bytes; it is cut off or damaged"
        ));
    }
    Ok(())
}
