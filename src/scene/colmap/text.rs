//! Models as text: `cameras.txt`, `images.txt`, `points3D.txt`.

use std::collections::BTreeMap;
use std::path::Path;

use super::super::SceneError;
use super::super::lines::{FARTHEST, Line, TextFile, excerpt, is_near};
use super::camera::ModelCamera;
use super::model::{Model, ModelImage, Points};

pub(super) fn read(folder: &Path) -> Result<Model, SceneError> {
    let file = TextFile::read(&folder.join("cameras.txt"))?;
    file.expect_order(CAMERA_COLUMNS)?;
    let cameras = file
        .lines()
        .map(|line| {
            let (id, camera) = camera_of_line(line)?;
            Ok((whole(&line, id)?, camera))
        })
        .collect::<Result<BTreeMap<_, _>, SceneError>>()?;
    let points = points(&folder.join("points3D.txt"))?;
    let images = images(&folder.join("images.txt"), &points)?;
    Ok(Model { cameras, images, points: points.positions })
}

/// The columns of cameras after their key, as comments name them.
pub(in super::super) const CAMERA_COLUMNS: &[&str] = &["model", "width", "height", "params"];

/// A line `KEY MODEL WIDTH HEIGHT PARAMS…`: its key, which is an id in COLMAP's files and a photo in hloc's, and the
/// camera, or why it cannot be used.
pub(in super::super) fn camera_of_line(
    line: Line<'_>,
) -> Result<(&str, Result<ModelCamera, SceneError>), SceneError> {
    let words: Vec<&str> = line.text.split_whitespace().collect();
    let [key, model, width, height, parameters @ ..] = words.as_slice() else {
        return Err(line.error("a line `id model width height parameters` expected"));
    };
    let camera = || {
        let size = (whole(&line, width)?, whole(&line, height)?);
        let parameters =
            parameters.iter().map(|word| line.number(word)).collect::<Result<Vec<_>, _>>()?;
        ModelCamera::new(model, size, &parameters).map_err(|why| line.error(why))
    };
    Ok((*key, camera()))
}

/// `POINT3D_ID X Y Z R G B ERROR TRACK…`; a model without points has no such file.
fn points(path: &Path) -> Result<Points, SceneError> {
    let mut points = Points::default();
    if !path.is_file() {
        return Ok(points);
    }
    let file = TextFile::of_points(path)?;
    file.expect_order(&["point3d_id", "x", "y", "z", "r"])?;
    for line in file.lines() {
        let words: Vec<&str> = line.text.split_ascii_whitespace().take(4).collect();
        let [id, x, y, z] = words[..] else {
            return Err(line.error("a line `id x y z …` expected, it is cut off"));
        };
        let position = [line.number(x)?, line.number(y)?, line.number(z)?];
        if !position.iter().all(is_near) {
            return Err(line.error(format!("a position within {FARTHEST:e} of 0 expected")));
        }
        points.add(whole(&line, id)?, position);
    }
    Ok(points)
}

/// Two lines per image: `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, then `X Y POINT3D_ID` of each feature. The
/// second line may be empty or missing.
fn images(path: &Path, points: &Points) -> Result<Vec<ModelImage>, SceneError> {
    let file = TextFile::of_images(path)?;
    file.expect_order(&[
        "image_id",
        "qw",
        "qx",
        "qy",
        "qz",
        "tx",
        "ty",
        "tz",
        "camera_id",
        "name",
    ])?;
    let mut images = Vec::new();
    for (line, features) in pairs_of_lines(&file) {
        let ImageLine { name, camera, numbers } =
            image_of_line(line.text).map_err(|why| line.error(why))?;
        if let Some(number) = numbers.iter().find(|number| !number.is_finite()) {
            return Err(line.error(format!("finite numbers expected, {number} found")));
        }
        let [qw, qx, qy, qz, x, y, z] = numbers;
        images.push(ModelImage {
            name: name.to_owned(),
            camera,
            camera_from_world: line.pose([x, y, z], [qx, qy, qz, qw])?,
            observed: features.map_or_else(|| Ok(Vec::new()), |line| observed(line, points))?,
        });
    }
    if images.is_empty() {
        return Err(file.error("images expected, none found"));
    }
    Ok(images)
}

/// The line of each image with that of its features. Programs that skip blank lines drop the second lines of images
/// without features, so the content decides.
fn pairs_of_lines(file: &TextFile) -> impl Iterator<Item = (Line<'_>, Option<Line<'_>>)> {
    let mut lines = file.all_lines().peekable();
    std::iter::from_fn(move || {
        let image = lines.find(Line::has_content)?;
        Some((image, lines.next_if(|line| line.has_content() && !is_image(line.text))))
    })
}

/// Whether a line is that of an image and not of features, which are triples of numbers.
fn is_image(text: &str) -> bool {
    let mut words = text.split_ascii_whitespace();
    if words.nth(8).is_none_or(|word| word.parse::<u32>().is_err()) {
        return false;
    }
    let count = 9 + words.clone().count();
    // Features are many, so their bytes are looked at before their numbers. A date has a sign behind a digit.
    let is_of_number = |byte: &u8| byte.is_ascii_digit() || b" \t.+-eE".contains(byte);
    let is_in_date = |pair: &[u8]| pair[0].is_ascii_digit() && pair[1] == b'-';
    let bytes = text.as_bytes();
    let is_odd = || !bytes.iter().all(is_of_number) || bytes.windows(2).any(is_in_date);
    let mut has_name = || words.any(|word| word.parse::<f64>().is_err());
    count >= 10 && (!count.is_multiple_of(3) || (is_odd() && has_name()))
}

/// How many images a file lists.
pub(super) fn count_images(path: &Path) -> Result<u64, SceneError> {
    Ok(pairs_of_lines(&TextFile::of_images(path)?).count() as u64)
}

/// The lines of the images of a text, without those of their features.
pub(in super::super) fn lines_of_images(file: &TextFile) -> Vec<Line<'_>> {
    pairs_of_lines(file).map(|(line, _)| line).collect()
}

/// The line of an image.
pub(in super::super) struct ImageLine<'a> {
    /// It may contain blanks.
    pub name: &'a str,
    pub camera: u32,
    /// `qw qx qy qz x y z`, world to camera. They may be NaN.
    pub numbers: [f64; 7],
}

pub(in super::super) fn image_of_line(text: &str) -> Result<ImageLine<'_>, String> {
    let mut rest = text;
    let mut next = || {
        let (word, after) = rest
            .split_once(char::is_whitespace)
            .ok_or("a line `id qw qx qy qz tx ty tz camera name` expected, it is cut off")?;
        rest = after.trim_start();
        Ok::<&str, String>(word)
    };
    let _id: u32 = whole_number(next()?)?;
    let mut numbers = [0.0; 7];
    for number in &mut numbers {
        let word = next()?;
        let error = |_| format!("a number expected, `{}` found", excerpt(word));
        *number = word.parse().map_err(error)?;
    }
    let camera = whole_number(next()?)?;
    Ok(ImageLine { name: rest, camera, numbers })
}

/// The points of the features; −1 means none.
fn observed(line: Line<'_>, points: &Points) -> Result<Vec<u32>, SceneError> {
    let words = line.text.split_ascii_whitespace().collect::<Vec<_>>();
    if words.len() % 3 != 0 {
        return Err(
            line.error(format!("features `x y point` expected, {} numbers found", words.len()))
        );
    }
    let ids = words.chunks_exact(3).map(|feature| feature[2]);
    ids.filter(|id| *id != "-1")
        .map(|id| {
            let point = points.find(whole(&line, id)?);
            point.map_err(|why| line.error(why))
        })
        .collect()
}

fn whole<T: std::str::FromStr>(line: &Line<'_>, word: &str) -> Result<T, SceneError> {
    whole_number(word).map_err(|why| line.error(why))
}

fn whole_number<T: std::str::FromStr>(word: &str) -> Result<T, String> {
    word.parse().map_err(|_| format!("a whole number expected, `{}` found", excerpt(word)))
}
