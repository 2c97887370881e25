//! PTX of laser scanners: scans one after the other, each with its size, its pose, and a point per line in the
//! scanner's frame. A beam without return is a point at 0 0 0.

use nalgebra::{Matrix4, Point3};

use super::Lines;
use super::words::{Separator, expected_number, is_comment, lone_count, number};
use crate::scene::SceneError;
use crate::scene::cloud_file::Collector;

/// The lines before the points of a scan: columns, rows, position, three axes, and a matrix.
const HEADER: usize = 10;

/// Whether a file begins like a scan.
pub(super) fn is_ptx(lines: &[String]) -> bool {
    let lines: Vec<&String> = lines.iter().filter(|line| !is_comment(line)).take(HEADER).collect();
    let has = |line: &String, count: usize| {
        let mut words = Separator::Blanks.words(line).map(|word| number(word, false));
        words.all(|number| number.is_some()) && Separator::Blanks.words(line).count() == count
    };
    lines.len() == HEADER
        && lines[..2].iter().all(|line| lone_count(line).is_some())
        && lines[2..6].iter().all(|line| has(line, 3))
        && lines[6..].iter().all(|line| has(line, 4))
}

/// Reads all scans.
pub(super) fn read(lines: &mut Lines, cloud: &mut Collector) -> Result<(), SceneError> {
    while let Some(columns) = count(lines)? {
        let rows = count(lines)?.ok_or_else(|| lines.error("a number of rows expected"))?;
        for _ in 0..4 {
            // The scanner's position and axes, which the matrix has, too.
            numbers::<3>(lines)?;
        }
        let mut world_from_scanner = Matrix4::zeros();
        for column in 0..4 {
            // The file has the matrix for points that are rows, so its rows are our columns.
            world_from_scanner.set_column(column, &numbers::<4>(lines)?.into());
        }
        let last = world_from_scanner.row(3);
        if [0.0, 0.0, 0.0, 1.0] != [last[0], last[1], last[2], last[3]] {
            let expected = "a matrix with 0, 0, 0 and 1 as its last column expected, and the position as its last row";
            return Err(lines.error(expected));
        }
        let announced = columns.saturating_mul(rows);
        for found in 0..announced {
            let Some(line) = lines.next()? else {
                let expected = format!(
                    "{announced} points of a scan expected, {found} found; the file is cut off"
                );
                return Err(SceneError::expected(&lines.path, expected));
            };
            let mut words = Separator::Blanks.words(line);
            let mut next = || {
                let word = words.next().unwrap_or_default();
                number(word, false).ok_or_else(|| expected_number(word))
            };
            let point = (|| Ok([next()?, next()?, next()?]))();
            let added = point.and_then(|point: [f64; 3]| {
                if point == [0.0; 3] {
                    cloud.add_no_return();
                    return Ok(());
                }
                let Point3 { coords } = world_from_scanner.transform_point(&Point3::from(point));
                cloud.add(coords.into())
            });
            added.map_err(|expected| lines.error(expected))?;
        }
    }
    Ok(())
}

/// The number in the next line that is not empty.
fn count(lines: &mut Lines) -> Result<Option<u64>, SceneError> {
    while let Some(line) = lines.next()? {
        if !is_comment(line) {
            let expected =
                format!("a number of columns or rows expected: {}", expected_number(line));
            return lone_count(line).map(Some).ok_or_else(|| lines.error(expected));
        }
    }
    Ok(None)
}

fn numbers<const N: usize>(lines: &mut Lines) -> Result<[f64; N], SceneError> {
    let line = lines.next()?.unwrap_or_default();
    let read: Option<Vec<f64>> =
        Separator::Blanks.words(line).map(|word| number(word, false)).collect();
    let read = read.filter(|numbers| numbers.iter().all(|number| number.is_finite()));
    let read: Option<[f64; N]> = read.and_then(|numbers| numbers.try_into().ok());
    read.ok_or_else(|| lines.error(format!("{N} numbers of a scan's header expected")))
}
