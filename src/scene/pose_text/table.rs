//! Tables of poses whose header names the columns, in any order: the first line, or a comment above it.
//!
//! Poses are `world_from_camera`. Those of a kapture trajectory are `camera_from_world`, as its `device_id` shows.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::SceneError;
use super::super::lines::{Line, NAMES, TextFile, fields};
use super::super::time_unit::TimeUnit;
use super::formats::{Why, number, posed};
use super::{Key, PoseFile, Row};

/// The columns of a table by their positions.
struct Columns {
    count: usize,
    key: usize,
    is_name: bool,
    unit: Option<TimeUnit>,
    position: [usize; 3],
    /// x y z w.
    quaternion: [usize; 4],
    /// The camera of a kapture trajectory.
    device: Option<usize>,
    /// Whether the poses are those of a body that carries cameras, as in EuRoC's files.
    is_of_body: bool,
    /// A column of positions that are not in metres.
    other_unit: Option<String>,
}

/// Reads a file whose header names the columns; `None` without one.
pub(super) fn read(file: &TextFile) -> Result<Option<PoseFile<'_>>, SceneError> {
    let Some(first) = file.lines().next() else { return Ok(None) };
    if let Some(header) = first.header() {
        if ["image_id", "camera_id"].iter().all(|column| header.contains(&(*column).to_owned())) {
            return Err(first.error("`#` expected before the header of COLMAP's images"));
        }
        let columns = Columns::named(first.text).ok_or_else(|| {
            first.error(
                "a header with the columns `name` or `time`, and `x y z qx qy qz qw`, expected",
            )
        })?;
        columns.warn_of_direction(file, first);
        return columns.read(file, 1).map(Some);
    }
    let comments = file.all_lines().take_while(|line| !line.has_content());
    let found = fields(first.text).len();
    let named = comments
        .filter_map(|line| Some((line, Columns::named(line.text.trim_start_matches('#').trim())?)));
    let (of_names, others): (Vec<_>, Vec<_>) = named.partition(|(_, columns)| columns.is_name);
    // Comments also describe formats that need no header, such as COLMAP's, whose images have names.
    if let Some((line, _)) = of_names.iter().find(|(_, columns)| !columns.are_in_usual_order()) {
        return Err(line.error(
            "the columns in the order qw qx qy qz x y z expected, or as a first line without `#` and with poses from \
             camera to world",
        ));
    }
    let mut others = others.into_iter().map(|(_, columns)| columns);
    let header = others.rfind(|columns| columns.count == found);
    header.map(|columns| columns.read(file, 0)).transpose()
}

impl Columns {
    fn named(text: &str) -> Option<Self> {
        let columns: Vec<String> = fields(text).into_iter().map(str::to_lowercase).collect();
        let bare = |column: &str| column.split(['[', '(']).next().unwrap_or("").trim().to_owned();
        let bare: Vec<String> = columns.iter().map(|column| bare(column)).collect();
        let find =
            |called: &[&str]| bare.iter().position(|column| called.contains(&column.as_str()));
        let position = ["x", "y", "z"].map(|axis| {
            find(&[axis, &format!("t{axis}"), &format!("p{axis}"), &format!("p_rs_r_{axis}")])
        });
        let [x, y, z] = position;
        let [qx, qy, qz, qw] = ["x", "y", "z", "w"].map(|part| {
            find(&[&format!("q{part}"), &format!("q_{part}"), &format!("q_rs_{part}")])
        });
        let name = find(NAMES);
        let key = name.or_else(|| find(&["time", "timestamp"]))?;
        let is_metric = |column: &str| {
            let unit =
                column.split_once(['[', '(']).map(|(_, unit)| unit.trim_end_matches([']', ')']));
            unit.is_none_or(|unit| ["", "m"].contains(&unit.trim()))
        };
        let of_positions = position.into_iter().flatten().map(|at| columns[at].as_str());
        let other_unit = of_positions.clone().find(|column| !is_metric(column)).map(str::to_owned);
        let is_of_body = of_positions.clone().any(|column| column.starts_with("p_rs_r_"));
        let unit = columns[key].split_once(['[', '(']).and_then(|(_, unit)| {
            TimeUnit::ALL
                .into_iter()
                .find(|known| unit.trim_end_matches([']', ')']) == known.symbol())
        });
        Some(Self {
            count: columns.len(),
            key,
            is_name: name.is_some(),
            unit,
            position: [x?, y?, z?],
            quaternion: [qx?, qy?, qz?, qw?],
            device: find(&["device_id"]),
            is_of_body,
            other_unit,
        })
    }

    /// The columns of hloc's results, which have no header and the other direction.
    fn warn_of_direction(&self, file: &TextFile, header: Line<'_>) {
        let ([x, y, z], [qx, qy, qz, qw]) = (self.position, self.quaternion);
        if self.is_name && [self.key, qw, qx, qy, qz, x, y, z] == [0, 1, 2, 3, 4, 5, 6, 7] {
            log::warn!(
                "{}: line {}: with a header, poses are read as camera to world; hloc's are world to camera, and have \
                 no header",
                file.name(),
                header.number
            );
        }
    }

    /// Whether quaternion and position stand as in the formats that have names and need no header.
    fn are_in_usual_order(&self) -> bool {
        let ([x, y, z], [qx, qy, qz, qw]) = (self.position, self.quaternion);
        [qw, qx, qy, qz, x, y, z].is_sorted()
    }

    fn read<'a>(&self, file: &'a TextFile, header: usize) -> Result<PoseFile<'a>, SceneError> {
        if let Some(column) = &self.other_unit {
            return Err(file.error(format!("positions in metres expected, `{column}` found")));
        }
        let photos = match self.device {
            Some(_) => photos_of_kapture(file)?,
            None => BTreeMap::new(),
        };
        let rows = file.lines().skip(header).map(|line| {
            let (key, pose) = self.row(line, &photos).map_err(|why| match why {
                Why::Form(why) | Why::Pose(why) => line.error(why),
            })?;
            let pose = if self.device.is_some() { pose.map(|pose| pose.inverse()) } else { pose };
            Ok(Row { line, key, pose })
        });
        let rows = rows.collect::<Result<Vec<_>, SceneError>>()?;
        if rows.iter().all(|row| row.pose.is_none()) {
            return Err(file.error("poses with finite numbers expected, none found"));
        }
        let read = PoseFile::of_rows(file, rows, self.unit, self.device.is_some())?;
        Ok(PoseFile { is_of_body: self.is_of_body, ..read })
    }

    fn row(
        &self,
        line: Line<'_>,
        photos: &BTreeMap<(String, String), String>,
    ) -> Result<(Key, Option<crate::geometry::Pose>), Why> {
        let words = fields(line.text);
        if words.len() != self.count {
            let (count, found) = (self.count, words.len());
            return Err(Why::Form(format!("{count} columns expected, {found} found")));
        }
        // Tables of pandas have empty cells where there is no number.
        let cell = |column: usize| match words[column] {
            "" => Ok(f64::NAN),
            word => number(word),
        };
        let [x, y, z] = self.position.map(cell);
        let [qx, qy, qz, qw] = self.quaternion.map(cell);
        let pose = posed([x?, y?, z?], [qx?, qy?, qz?, qw?])?;
        let key = words[self.key];
        let photo = self
            .device
            .and_then(|device| photos.get(&(key.to_owned(), words[device].to_owned())).cloned());
        let key = match photo {
            Some(photo) => Key::Name(photo),
            None if self.is_name || !photos.is_empty() => Key::Name(key.to_owned()),
            None => match number(key)? {
                time if time.is_finite() => Key::Time(time),
                time => return Err(Why::Form(format!("a finite time expected, {time} found"))),
            },
        };
        Ok((key, pose))
    }
}

/// The photos of a kapture data set by time and camera: `records_camera.txt` beside `trajectories.txt`. Empty without
/// such a file.
fn photos_of_kapture(
    trajectories: &TextFile,
) -> Result<BTreeMap<(String, String), String>, SceneError> {
    let path = Path::new(&trajectories.name()).with_file_name("records_camera.txt");
    if !path.is_file() {
        return Ok(BTreeMap::new());
    }
    let records = TextFile::read(&path)?;
    let record = |line: Line<'_>| match fields(line.text)[..] {
        [time, device, photo] => Ok(((time.to_owned(), device.to_owned()), photo.to_owned())),
        _ => Err(line.error("a line `timestamp, device_id, image_path` expected")),
    };
    records.lines().map(record).collect()
}
