//! The poses that another system found, in one of four texts, told apart by their content:
//!
//! - TUM: `time x y z qx qy qz qw`, camera to world; a frame has the pose of its moment;
//! - KITTI: twelve numbers of `[R|t]`, camera to world; a line per frame in order, or per number from 0
//!   that the frames' names end with;
//! - `images.txt` of a COLMAP model, or the model's folder: world to camera;
//! - visuallocalization.net: `name qw qx qy qz x y z`, world to camera.

use std::path::Path;

use posescope_core::foreign::Estimates;

use super::frame_names::FrameNames;
use super::lines::{Line, TextFile, excerpt_of};
use super::trajectory::{SAME_MOMENT_S, associated};
use super::{Scene, SceneError};
use crate::geometry::Pose;

/// How a line of eight words is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Eight {
    Tum,
    Named,
}

/// Reads the poses of the frames of a scene, `world_from_camera`. Poses of what is no frame of the scene
/// are left out, as long as some are of one.
///
/// # Errors
/// A file that cannot be read, whose lines are none of the four, that has a frame twice, or that is of
/// other frames altogether.
pub fn read_estimates(path: &Path, scene: &dyn Scene) -> Result<Estimates, SceneError> {
    let in_folder = path.join("images.txt");
    let file = TextFile::read(if path.is_dir() { &in_folder } else { path })?;
    let Some(first) = file.lines().next() else {
        return Err(file.error("poses expected, none found"));
    };
    let words = first.words().count();
    let estimates = match words {
        12 => by_line(&file, scene)?,
        8 => match eight(&file, scene)? {
            Eight::Tum => by_time(&file, scene)?,
            Eight::Named => named(&file, scene, named_pose)?,
        },
        10.. => named_model(&file, scene)?,
        _ => {
            return Err(first.error(format!(
                "TUM (8 numbers), KITTI (12 numbers), `name qw qx qy qz x y z` or COLMAP's images.txt \
                 expected, {words} words found"
            )));
        }
    };
    Ok(estimates)
}

/// Eight words are a time and a pose, or a name and a pose: the quaternion tells, and where both could
/// be one, whether the first words are names of frames.
fn eight(file: &TextFile, scene: &dyn Scene) -> Result<Eight, SceneError> {
    let (mut tum, mut named, mut are_frames) = (true, true, true);
    let names = FrameNames::new(scene);
    for line in file.lines() {
        let words: Vec<&str> = line.words().collect();
        let numbers: Vec<Option<f64>> = words.iter().map(|word| word.parse().ok()).collect();
        let is_unit = |range: std::ops::Range<usize>| {
            let parts = numbers.get(range).unwrap_or_default().iter();
            let squares: Option<f64> = parts.map(|part| part.map(|p| p * p)).sum();
            squares.is_some_and(|squares| (squares.sqrt() - 1.0).abs() < 0.02)
        };
        let is_time = numbers.first().is_some_and(Option::is_some);
        tum &= is_time && is_unit(4..8);
        named &= is_unit(1..5);
        are_frames &= words.first().is_some_and(|name| names.find(name).is_some());
        if !tum && !named {
            return Err(line.error(
                "`time x y z qx qy qz qw` or `name qw qx qy qz x y z` expected, with a quaternion of \
                 length 1, as in the lines before",
            ));
        }
    }
    Ok(match (tum, named) {
        (true, true) if are_frames => Eight::Named,
        (true, _) => Eight::Tum,
        (false, _) => Eight::Named,
    })
}

fn by_time(file: &TextFile, scene: &dyn Scene) -> Result<Estimates, SceneError> {
    let mut samples = Vec::new();
    for line in file.lines() {
        let [time, x, y, z, qx, qy, qz, qw] = line.numbers()?;
        samples.push((time, line.pose([x, y, z], [qx, qy, qz, qw])?));
    }
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Frames that say nothing of their time may be called by it.
    let frames = scene.frames();
    let time = |frame: usize| {
        let named = || {
            frames[frame]
                .parse()
                .ok()
                .filter(|time: &f64| time.is_finite())
        };
        scene.time_s(frame).or_else(named)
    };
    let mut timed: Vec<(f64, usize)> = (0..frames.len())
        .filter_map(|frame| Some((time(frame)?, frame)))
        .collect();
    timed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let times: Vec<f64> = timed.iter().map(|(time, _)| *time).collect();
    let moments: Vec<f64> = samples.iter().map(|(time, _)| *time).collect();
    let found = associated(&times, &moments);
    let pairs = timed.iter().zip(found);
    let estimates: Estimates = pairs
        .filter_map(|(&(_, frame), sample)| Some((frames[frame].clone(), samples[sample?].1)))
        .collect();
    if estimates.is_empty() {
        let range = |times: &[f64]| match times {
            [] => "unknown".to_owned(),
            [first, .., last] => format!("{first} … {last}"),
            [only] => only.to_string(),
        };
        return Err(file.error(format!(
            "poses within {SAME_MOMENT_S} s of the frames of {} expected: their times are {}, those of \
             the poses {}",
            scene.name(),
            range(&times),
            range(&moments)
        )));
    }
    Ok(estimates)
}

fn by_line(file: &TextFile, scene: &dyn Scene) -> Result<Estimates, SceneError> {
    let poses = file
        .lines()
        .map(|line| line.matrix_pose())
        .collect::<Result<Vec<_>, _>>()?;
    let frames = scene.frames();
    let line_of = |index: usize, name: &str| -> Option<usize> {
        if poses.len() == frames.len() {
            return Some(index);
        }
        let digits = name.rfind(|c: char| !c.is_ascii_digit());
        name[digits.map_or(0, |at| at + 1)..].parse().ok()
    };
    let estimates: Estimates = frames
        .iter()
        .enumerate()
        .filter_map(|(index, name)| Some((name.clone(), *poses.get(line_of(index, name)?)?)))
        .collect();
    if estimates.is_empty() {
        return Err(file.error(format!(
            "a line for each of the {} frames of {} expected, or for each number from 0 that their names \
             end with; {} lines found, none of a frame",
            frames.len(),
            scene.name(),
            poses.len()
        )));
    }
    Ok(estimates)
}

/// `name qw qx qy qz x y z`
fn named_pose<'a>(line: Line<'a>) -> Result<(&'a str, Pose), SceneError> {
    let mut words = line.words();
    let name = words.next().unwrap_or_default();
    Ok((name, camera_from_world(line, words)?))
}

/// The inverse of `qw qx qy qz x y z` and nothing behind.
fn camera_from_world<'a>(
    line: Line<'a>,
    words: impl Iterator<Item = &'a str>,
) -> Result<Pose, SceneError> {
    let words: Vec<&str> = words.collect();
    let numbers = words
        .iter()
        .map(|word| line.number(word))
        .collect::<Result<Vec<_>, _>>()?;
    let &[qw, qx, qy, qz, x, y, z] = numbers.as_slice() else {
        return Err(line.error(format!("7 numbers expected, {} found", numbers.len())));
    };
    Ok(line.pose([x, y, z], [qx, qy, qz, qw])?.inverse())
}

/// The frames that lines name. Each is named once.
fn named<'a>(
    file: &'a TextFile,
    scene: &dyn Scene,
    read: fn(Line<'a>) -> Result<(&'a str, Pose), SceneError>,
) -> Result<Estimates, SceneError> {
    of_frames(
        file,
        scene,
        file.lines().map(|line| Ok((line, read(line)?))),
    )
}

/// `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME`, each followed by a line of its features.
fn named_model(file: &TextFile, scene: &dyn Scene) -> Result<Estimates, SceneError> {
    let mut lines = file.all_lines();
    let mut said = Vec::new();
    while let Some(line) = lines.next() {
        if line.text.is_empty() || line.text.starts_with('#') {
            continue;
        }
        let _features = lines.next();
        said.push(line);
    }
    of_frames(
        file,
        scene,
        said.into_iter().map(|line| {
            let mut words = line.text.splitn(10, ' ').map(str::trim);
            let _id = words.next();
            let pose = camera_from_world(line, words.by_ref().take(7))?;
            let _camera = words.next();
            let name = words
                .next()
                .filter(|name| !name.is_empty())
                .ok_or_else(|| {
                    line.error(
                        "a line `id qw qx qy qz tx ty tz camera name` expected, it is cut off",
                    )
                })?;
            Ok((line, (name, pose)))
        }),
    )
}

fn of_frames<'a>(
    file: &TextFile,
    scene: &dyn Scene,
    poses: impl Iterator<Item = Result<(Line<'a>, (&'a str, Pose)), SceneError>>,
) -> Result<Estimates, SceneError> {
    let names = FrameNames::new(scene);
    let mut estimates = Estimates::new();
    let mut stranger = None;
    for pose in poses {
        let (line, (name, pose)) = pose?;
        let Some(frame) = names.find(name) else {
            stranger = stranger.or(Some(name));
            continue;
        };
        let frame = &scene.frames()[frame];
        if estimates.insert(frame.clone(), pose).is_some() {
            return Err(line.error(format!("frame {frame} has a pose already")));
        }
    }
    if estimates.is_empty() {
        return Err(file.error(format!(
            "poses of the frames of {} expected, which are called such as `{}`; here they are called such \
             as `{}`",
            scene.name(),
            scene.frames().first().map_or("", String::as_str),
            excerpt_of(stranger.unwrap_or_default(), 60)
        )));
    }
    Ok(estimates)
}
