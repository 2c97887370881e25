//! XYZ text: one point per line; further columns are ignored.

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::Path;

use super::MapCloud;
use crate::scene::SceneError;

/// Reads the points. The first line may be a header or the number of points.
pub(super) fn read(path: &Path) -> Result<MapCloud, SceneError> {
    let io = SceneError::io(path);
    let mut cloud = MapCloud::default();
    for (index, line) in BufReader::new(File::open(path).map_err(io)?).lines().enumerate() {
        let line = line.map_err(io)?;
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') || line.starts_with("//") {
            continue;
        }
        match position(line) {
            Ok(point) => cloud.add(point),
            Err(_) if index == 0 => Ok(()),
            Err(expected) => Err(expected),
        }
        .map_err(|expected| SceneError::line(path, index + 1, expected))?;
    }
    if cloud.points.is_empty() {
        return Err(SceneError::expected(path, "lines `x y z` expected, none found"));
    }
    Ok(cloud)
}

fn position(line: &str) -> Result<[f64; 3], String> {
    let words = line.split(|c: char| c.is_whitespace() || c == ',' || c == ';');
    let mut words = words.filter(|word| !word.is_empty());
    let mut next = || {
        let word = words.next().ok_or("a line `x y z` expected")?;
        word.parse::<f64>().map_err(|_| {
            let found = super::super::lines::excerpt(word);
            format!("a number expected, `{found}` found")
        })
    };
    Ok([next()?, next()?, next()?])
}
