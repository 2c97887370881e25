//! Text files of poses, read by what their lines say.
//!
//! A header names the columns ([`table`]): the first line, or a comment above it as in EuRoC's files. Without a header,
//! the format is the one of [`formats`] that fits every line.

mod formats;
mod table;

use std::collections::BTreeMap;

use posescope_core::scene::trailing_number;

use self::formats::{Format, KITTI, TUM};
use super::SceneError;
use super::frame_names::FrameNames;
use super::lines::{Line, TextFile};
use super::time_unit::TimeUnit;
use crate::geometry::Pose;

/// A file of poses.
pub(super) struct PoseFile<'a> {
    pub poses: PoseText<'a>,
    /// Whether the format says that its poses are `camera_from_world`. They are inverted already.
    pub is_camera_from_world: bool,
    /// Whether the format says that its poses are those of a body that carries cameras, `world_from_body`.
    pub is_of_body: bool,
}

/// The poses of a file, `world_from_camera`.
pub(super) enum PoseText<'a> {
    Timed(TimedPoses),
    Lines(PoseLines),
    Named(Vec<NamedPose<'a>>),
}

/// Poses by time.
pub(super) struct TimedPoses {
    /// In any order, in the unit of the file.
    pub samples: Vec<(f64, Pose)>,
    /// The unit that the file names.
    pub unit: Option<TimeUnit>,
}

/// A pose with the name of its image.
pub(super) struct NamedPose<'a> {
    pub line: Line<'a>,
    pub name: String,
    pub world_from_camera: Pose,
}

/// What a line says.
struct Row<'a> {
    line: Line<'a>,
    key: Key,
    /// `world_from_camera`; `None` where the camera was lost, which trackers write as NaN.
    pose: Option<Pose>,
}

/// What a line says its pose belongs to.
enum Key {
    Name(String),
    Time(f64),
    Number(u64),
    /// Nothing: lines are in the order of the frames.
    Order,
}

impl<'a> PoseFile<'a> {
    /// Reads a file. Where several formats fit all lines, the names of the frames decide.
    ///
    /// # Errors
    /// Where no format fits, the error names each of them with the first line that does not fit.
    pub fn read(file: &'a TextFile, names: &FrameNames<'_>) -> Result<Self, SceneError> {
        if file.lines().next().is_none() {
            return Err(file.error("poses expected, none found"));
        }
        if let Some(read) = table::read(file)? {
            return Ok(read);
        }
        let tried = formats::ALL.iter().map(|format| (format, format.read(file)));
        let mut fitting = Vec::new();
        let mut broken = Vec::new();
        for (format, rows) in tried {
            match rows {
                Ok(rows) => fitting.push((format, rows)),
                Err(misfit) => broken.push((format, misfit)),
            }
        }
        let (format, rows) = match fitting.len() {
            0 => return Err(no_format(&broken)),
            1 => fitting.remove(0),
            _ => best_named(file, fitting, names)?,
        };
        let direction =
            if format.is_camera_from_world { "camera from world" } else { "world from camera" };
        log::info!(
            "{}: read as poses of {} ({}), {direction}",
            file.name(),
            format.name,
            format.form
        );
        Self::of_rows(file, rows, None, format.is_camera_from_world)
    }

    fn of_rows(
        file: &TextFile,
        rows: Vec<Row<'a>>,
        unit: Option<TimeUnit>,
        is_camera_from_world: bool,
    ) -> Result<Self, SceneError> {
        warn_of_lost(file, &rows);
        let poses = match rows.first().map(|row| &row.key) {
            Some(Key::Time(_)) => PoseText::Timed(TimedPoses { samples: timed(rows), unit }),
            Some(Key::Name(_)) => PoseText::Named(rows.into_iter().filter_map(named).collect()),
            _ => PoseText::Lines(PoseLines::new(rows)?),
        };
        Ok(Self { poses, is_camera_from_world, is_of_body: false })
    }
}

/// The format of several under which most names are those of frames. A format without names is right where no name
/// is that of a frame.
fn best_named<'a>(
    file: &TextFile,
    mut fitting: Vec<(&'static Format, Vec<Row<'a>>)>,
    names: &FrameNames<'_>,
) -> Result<(&'static Format, Vec<Row<'a>>), SceneError> {
    let found = |rows: &[Row<'_>]| {
        let called = rows.iter().filter_map(|row| match &row.key {
            Key::Name(name) => Some(name.as_str()),
            _ => None,
        });
        names.find_all(called).iter().flatten().count()
    };
    let score = |rows: &[Row<'_>]| (found(rows), !matches!(rows[0].key, Key::Name(_)));
    fitting.sort_by_key(|(_, rows)| std::cmp::Reverse(score(rows)));
    if score(&fitting[0].1) == score(&fitting[1].1) {
        let [one, other] = [0, 1].map(|at| fitting[at].0);
        return Err(file.error(format!(
            "poses of one format expected, but all lines fit {} ({}) and {} ({}); name the columns in a first line: \
             name x y z qx qy qz qw",
            one.name, one.form, other.name, other.form
        )));
    }
    Ok(fitting.remove(0))
}

/// The error of a file that fits no format: the one that fits most lines comes first.
fn no_format(broken: &[(&Format, formats::Misfit<'_>)]) -> SceneError {
    let mut sorted: Vec<_> = broken.iter().collect();
    sorted.sort_by_key(|(_, misfit)| std::cmp::Reverse((misfit.line.number, misfit.has_its_form)));
    let said = sorted.iter().map(|(format, misfit)| {
        let Format { name, form, .. } = format;
        let line = misfit.line.number;
        let is_first = line == sorted[0].1.line.number;
        let at = if is_first { String::new() } else { format!("line {line}: ") };
        format!("{name} ({form}): {at}{}", misfit.why)
    });
    let said = said.collect::<Vec<_>>().join("; ");
    let line = sorted[0].1.line;
    line.error(format!("a line of one of the formats of poses expected: {said}"))
}

fn warn_of_lost(file: &TextFile, rows: &[Row<'_>]) {
    let lost: Vec<&Row<'_>> = rows.iter().filter(|row| row.pose.is_none()).collect();
    if let Some(first) = lost.first() {
        log::warn!(
            "{}: {} of {} poses are not finite, such as that of line {}, and are skipped",
            file.name(),
            lost.len(),
            rows.len(),
            first.line.number
        );
    }
}

fn timed(rows: Vec<Row<'_>>) -> Vec<(f64, Pose)> {
    let sample = |row: Row<'_>| match row.key {
        Key::Time(time) => Some((time, row.pose?)),
        _ => None,
    };
    rows.into_iter().filter_map(sample).collect()
}

fn named(row: Row<'_>) -> Option<NamedPose<'_>> {
    match row.key {
        Key::Name(name) => Some(NamedPose { line: row.line, name, world_from_camera: row.pose? }),
        _ => None,
    }
}

/// The poses of a TUM text, or of a table, with their times \[s\].
pub(super) fn by_time(file: &TextFile) -> Result<Vec<(f64, Pose)>, SceneError> {
    if let Some(read) = table::read(file)? {
        let PoseText::Timed(TimedPoses { samples, unit }) = read.poses else {
            return Err(file.error("poses by time expected, poses by name found"));
        };
        let unit = unit.unwrap_or(TimeUnit::Second);
        return Ok(samples.into_iter().map(|(time, pose)| (unit.seconds(time), pose)).collect());
    }
    let rows = TUM.read(file).map_err(|misfit| misfit.line.error(misfit.why))?;
    warn_of_lost(file, &rows);
    Ok(timed(rows))
}

/// The poses of a KITTI text.
pub(super) fn by_line(file: &TextFile) -> Result<PoseLines, SceneError> {
    let rows = KITTI.read(file).map_err(|misfit| misfit.line.error(misfit.why))?;
    warn_of_lost(file, &rows);
    PoseLines::new(rows)
}

/// A pose per line, without names.
pub(super) struct PoseLines {
    poses: Vec<Option<Pose>>,
    /// The positions in the list by the numbers that begin the lines, if any do.
    numbers: Option<BTreeMap<u64, usize>>,
}

impl PoseLines {
    fn new(rows: Vec<Row<'_>>) -> Result<Self, SceneError> {
        let mut numbers = BTreeMap::new();
        for (at, row) in rows.iter().enumerate() {
            if let Key::Number(number) = row.key
                && numbers.insert(number, at).is_some()
            {
                let expected = format!("one pose per number expected, {number} has one already");
                return Err(row.line.error(expected));
            }
        }
        let poses = rows.into_iter().map(|row| row.pose).collect();
        Ok(Self { poses, numbers: Some(numbers).filter(|numbers| !numbers.is_empty()) })
    }

    pub fn count(&self) -> usize {
        self.poses.len()
    }

    /// The range of the numbers that begin the lines, if any do.
    pub fn numbers(&self) -> Option<(u64, u64)> {
        let numbers = self.numbers.as_ref()?;
        Some((*numbers.first_key_value()?.0, *numbers.last_key_value()?.0))
    }

    /// The pose of a line, counted from 0; `None` where the camera was lost.
    pub fn get(&self, line: usize) -> Option<Pose> {
        self.poses.get(line).copied().flatten()
    }

    /// The line of a frame. If there are as many lines as frames, numbered from 0 or not at all, they are in the order
    /// of the frames. Otherwise the number at the end of the frame's name is that of its line.
    pub fn line_of_frame(&self, index: usize, frames: usize, name: &str) -> Option<usize> {
        let are_in_order = self.count() == frames
            && self.numbers().is_none_or(|range| range == (0, frames as u64 - 1));
        let line = match &self.numbers {
            Some(numbers) if are_in_order => *numbers.get(&(index as u64))?,
            Some(numbers) => *numbers.get(&line_of(name)?)?,
            None if are_in_order => index,
            None => line_of(name)?.try_into().ok()?,
        };
        (line < self.count()).then_some(line)
    }
}

/// The line of a frame in a file with a line per number. Cameras of a rig share their numbers, so folders have none.
pub(super) fn line_of(name: &str) -> Option<u64> {
    trailing_number(name).filter(|_| !name.contains('/'))
}

#[cfg(test)]
mod tests;
