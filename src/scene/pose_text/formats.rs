//! Formats of poses without a header.

use std::iter;

use nalgebra::Matrix3x4;

use super::super::colmap::{image_of_line, lines_of_images};
use super::super::lines::{Line, TextFile, excerpt, fields, pose};
use super::{Key, Row};
use crate::geometry::{Pose, pose_from_matrix};

/// A format that is recognised by the words of its lines.
pub(super) struct Format {
    pub name: &'static str,
    /// What a line is made of.
    pub form: &'static str,
    pub is_camera_from_world: bool,
    /// The lines that have a pose.
    lines: for<'a> fn(&'a TextFile) -> Vec<Line<'a>>,
    row: fn(&str) -> Keyed,
}

/// The pose of a line and what it belongs to.
type Keyed = Result<(Key, Option<Pose>), Why>;

/// Why a line does not fit.
pub(super) enum Why {
    /// It has other words.
    Form(String),
    /// It has the words of the format, but they are no pose.
    Pose(String),
}

/// The first line that does not fit a format.
pub(super) struct Misfit<'a> {
    pub line: Line<'a>,
    pub why: String,
    /// Whether the line has the words of the format.
    pub has_its_form: bool,
}

pub(super) const TUM: Format = Format {
    name: "TUM",
    form: "time x y z qx qy qz qw",
    is_camera_from_world: false,
    lines: all_lines,
    row: |text| {
        let [time, x, y, z, qx, qy, qz, qw] = spaced(text)?;
        if !time.is_finite() {
            return Err(Why::Form(format!("a time expected, {time} found")));
        }
        Ok((Key::Time(time), posed([x, y, z], [qx, qy, qz, qw])?))
    },
};

pub(super) const KITTI: Format = Format {
    name: "KITTI",
    form: "12 or 16 numbers of a matrix",
    is_camera_from_world: false,
    lines: all_lines,
    row: |text| Ok((Key::Order, matrix(&fields(text))?)),
};

/// Every format, in the order in which errors name them.
pub(super) const ALL: &[Format] = &[
    TUM,
    Format {
        name: "hloc",
        form: "name qw qx qy qz x y z",
        is_camera_from_world: true,
        lines: all_lines,
        row: |text| {
            let (name, numbers) = name_and::<7>(text)?;
            Ok((Key::Name(name), camera_from_world(numbers)?))
        },
    },
    KITTI,
    Format {
        name: "KITTI-360",
        form: "a frame's number and a matrix",
        is_camera_from_world: false,
        lines: all_lines,
        row: |text| {
            let words = fields(text);
            let number = words.first().and_then(|word| word.parse().ok());
            let number = number.ok_or_else(|| Why::Form("no whole number first".to_owned()))?;
            Ok((Key::Number(number), matrix(&words[1..])?))
        },
    },
    Format {
        name: "named matrices",
        form: "a name and a matrix",
        is_camera_from_world: false,
        lines: all_lines,
        row: |text| {
            let words = fields(text);
            let numbers = words.iter().rev().take_while(|word| number(word).is_ok()).count();
            let count = if numbers >= 16 { 16 } else { 12 };
            let numbers = &words[words.len() - count.min(numbers)..];
            let pose = matrix(numbers)?;
            // The name may contain blanks.
            let before = numbers[0].as_ptr() as usize - text.as_ptr() as usize;
            let name = text[..before].trim_end_matches([',', ';', ' ', '\t', '"']);
            Ok((Key::Name(checked_name(name.trim_start_matches('"'))?), pose))
        },
    },
    Format {
        name: "COLMAP",
        form: "images.txt: id qw qx qy qz x y z camera name",
        is_camera_from_world: true,
        lines: lines_of_images,
        row: |text| {
            let image = image_of_line(text).map_err(Why::Form)?;
            Ok((Key::Name(image.name.to_owned()), camera_from_world(image.numbers)?))
        },
    },
    Format {
        name: "ACE",
        form: "name qw qx qy qz x y z, 2 errors, inliers",
        is_camera_from_world: true,
        lines: all_lines,
        row: |text| {
            let (name, [qw, qx, qy, qz, x, y, z, _, _, inliers]) = name_and::<10>(text)?;
            if inliers < 0.0 || inliers.fract() != 0.0 {
                return Err(Why::Form("no whole number of inliers last".to_owned()));
            }
            Ok((Key::Name(name), camera_from_world([qw, qx, qy, qz, x, y, z])?))
        },
    },
    Format {
        name: "ACE0",
        form: "name qw qx qy qz x y z focal confidence",
        is_camera_from_world: true,
        lines: all_lines,
        row: |text| {
            let (name, [qw, qx, qy, qz, x, y, z, focal, _]) = name_and::<9>(text)?;
            if focal <= 0.0 {
                return Err(Why::Form(format!("a focal length expected, {focal} found")));
            }
            Ok((Key::Name(name), camera_from_world([qw, qx, qy, qz, x, y, z])?))
        },
    },
];

impl Format {
    /// The rows of a file whose lines all fit, some of them with a pose.
    pub fn read<'a>(&self, file: &'a TextFile) -> Result<Vec<Row<'a>>, Misfit<'a>> {
        let lines = (self.lines)(file);
        let rows = lines.iter().map(|&line| {
            let (key, pose) = (self.row)(line.text).map_err(|why| match why {
                Why::Form(why) => Misfit { line, why, has_its_form: false },
                Why::Pose(why) => Misfit { line, why, has_its_form: true },
            })?;
            Ok(Row { line, key, pose })
        });
        let rows: Vec<Row<'_>> = rows.collect::<Result<_, _>>()?;
        match rows.first() {
            Some(first) if rows.iter().all(|row| row.pose.is_none()) => Err(Misfit {
                line: first.line,
                why: "finite numbers expected, no line has them".to_owned(),
                has_its_form: true,
            }),
            _ => Ok(rows),
        }
    }
}

fn all_lines(file: &TextFile) -> Vec<Line<'_>> {
    file.lines().collect()
}

/// A number, which may be NaN or infinite.
pub(super) fn number(word: &str) -> Result<f64, Why> {
    let error = |_| Why::Form(format!("a number expected, `{}` found", excerpt(word)));
    word.parse().map_err(error)
}

/// Numbers between white space. Tables with commas differ in the order of the columns, so they need a header.
fn spaced<const N: usize>(text: &str) -> Result<[f64; N], Why> {
    without_separators(text)?;
    let words: Vec<&str> = text.split_whitespace().collect();
    let words: [&str; N] = words
        .as_slice()
        .try_into()
        .map_err(|_| Why::Form(format!("{N} numbers expected, {} found", words.len())))?;
    let mut numbers = [0.0; N];
    for (place, word) in iter::zip(&mut numbers, words) {
        *place = number(word)?;
    }
    Ok(numbers)
}

fn without_separators(text: &str) -> Result<(), Why> {
    if text.contains([',', ';']) {
        return Err(Why::Form(
            "white space between the columns expected, or a first line that names the columns, since tables with \
             commas differ in their order"
                .to_owned(),
        ));
    }
    Ok(())
}

fn of_words(expected: usize, found: usize) -> Why {
    Why::Form(format!("{expected} words expected, {found} found"))
}

/// The name before the last numbers of a line. It may contain blanks.
fn name_and<const N: usize>(text: &str) -> Result<(String, [f64; N]), Why> {
    without_separators(text)?;
    let found = text.split_whitespace().count();
    if found <= N {
        return Err(of_words(N + 1, found));
    }
    let mut rest = text;
    let mut numbers = [0.0; N];
    for place in numbers.iter_mut().rev() {
        let (before, word) = rest.rsplit_once(char::is_whitespace).unwrap_or_default();
        *place = number(word)?;
        rest = before.trim_end();
    }
    Ok((checked_name(rest)?, numbers))
}

/// A name: one word, or several that are not all numbers.
fn checked_name(name: &str) -> Result<String, Why> {
    let words = name.split_whitespace().count();
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    if words == 0 || words > 1 && name.split_whitespace().all(is_number) {
        return Err(Why::Form(format!("a name expected, `{}` found", excerpt(name))));
    }
    Ok(name.to_owned())
}

/// The pose of a position and a quaternion x y z w; `None` if the camera was lost.
pub(super) fn posed(position: [f64; 3], quaternion: [f64; 4]) -> Result<Option<Pose>, Why> {
    if position.iter().chain(&quaternion).any(|number| !number.is_finite()) {
        return Ok(None);
    }
    pose(position, quaternion).map(Some).map_err(Why::Pose)
}

/// The inverse of the pose `qw qx qy qz x y z`.
fn camera_from_world([qw, qx, qy, qz, x, y, z]: [f64; 7]) -> Result<Option<Pose>, Why> {
    let pose = posed([x, y, z], [qx, qy, qz, qw])?;
    Ok(pose.map(|camera_from_world| camera_from_world.inverse()))
}

/// The pose of a 3 × 4 or 4 × 4 matrix, row by row; `None` if the camera was lost.
fn matrix(words: &[&str]) -> Result<Option<Pose>, Why> {
    let count = words.len();
    if count != 12 && count != 16 {
        return Err(Why::Form(format!("12 or 16 numbers of a matrix expected, {count} found")));
    }
    let mut numbers = [0.0; 16];
    for (place, word) in iter::zip(&mut numbers, words) {
        *place = number(word)?;
    }
    let numbers = &numbers[..count];
    if numbers.iter().any(|number| !number.is_finite()) {
        return Ok(None);
    }
    let (rows, last) = numbers.split_at(12);
    if !last.is_empty() && last != [0.0, 0.0, 0.0, 1.0] {
        return Err(Why::Pose(format!("the last row 0 0 0 1 expected, {last:?} found")));
    }
    let pose = pose_from_matrix(&Matrix3x4::from_row_slice(rows));
    pose.map(Some).map_err(|error| Why::Pose(error.to_string()))
}
