//! Reads the poses of another system: a file in one of the formats of [`PoseFile`], or a COLMAP model's folder.

use std::path::Path;

use posescope_core::foreign::Estimates;

use super::frame_names::FrameNames;
use super::lines::{FARTHEST, TextFile, is_near};
use super::pose_text::{NamedPose, PoseFile, PoseLines, PoseText, TimedPoses, line_of};
use super::time_unit::{TimeUnit, time_of_name};
use super::trajectory::{SAME_MOMENT_S, associated};
use super::{Scene, SceneError};
use crate::geometry::Pose;

/// Reads the poses of a scene's frames, `world_from_camera`. Poses of unknown frames are skipped, as long as some
/// are of known frames.
///
/// # Errors
/// A file that cannot be read, has another format, has a frame twice, or has no frame of the scene.
pub fn read_estimates(path: &Path, scene: &dyn Scene) -> Result<Estimates, SceneError> {
    let in_folder = path.join("images.txt");
    let file =
        if path.is_dir() { TextFile::of_images(&in_folder)? } else { TextFile::named(path)? };
    let names = FrameNames::new(scene);
    let PoseFile { poses, is_of_body, .. } = PoseFile::read(&file, &names)?;
    if is_of_body {
        log::warn!(
            "{}: the poses of an EuRoC file are those of the body, and are taken as those of the camera; multiply each \
             by the camera's T_BS from its sensor.yaml",
            file.name()
        );
    }
    let estimates = match poses {
        PoseText::Timed(poses) => by_time(&file, poses, scene),
        PoseText::Lines(poses) => by_line(&file, &poses, scene),
        PoseText::Named(poses) => by_name(&file, &poses, scene, &names),
    }?;
    // Poses of matrices have no check of their own.
    let is_near = |pose: &Pose| pose.translation.vector.iter().all(is_near);
    match estimates.iter().find(|(_, pose)| !is_near(pose)) {
        Some((name, _)) => Err(file.error(format!(
            "a position within {FARTHEST:e} of 0 expected, that of {name} is another"
        ))),
        None => Ok(estimates),
    }
}

/// Associates poses and frames by time. Where the file names no unit of its times, it is the one in which most fit.
fn by_time(
    file: &TextFile,
    TimedPoses { mut samples, unit }: TimedPoses,
    scene: &dyn Scene,
) -> Result<Estimates, SceneError> {
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    // The name of a frame may be its time.
    let frames = scene.frames();
    let time = |frame: usize| {
        let time = scene.time_s(frame).or_else(|| time_of_name(&frames[frame]));
        time.filter(|time| time.is_finite())
    };
    let mut timed: Vec<(f64, usize)> =
        (0..frames.len()).filter_map(|frame| Some((time(frame)?, frame))).collect();
    timed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let times: Vec<f64> = timed.iter().map(|(time, _)| *time).collect();
    let in_unit = |unit: TimeUnit| {
        let moments: Vec<f64> = samples.iter().map(|(time, _)| unit.seconds(*time)).collect();
        let pairs = timed.iter().zip(associated(&times, &moments));
        let estimates: Estimates = pairs
            .filter_map(|(&(_, frame), sample)| Some((frames[frame].clone(), samples[sample?].1)))
            .collect();
        (unit, estimates)
    };
    let units = unit.map_or(TimeUnit::ALL.to_vec(), |unit| vec![unit]);
    let read = units.iter().map(|&unit| in_unit(unit));
    // The first of those that are equally good: seconds.
    let best = read.reduce(|best, next| if next.1.len() > best.1.len() { next } else { best });
    let (read_in, estimates) = best.unwrap_or((TimeUnit::Second, Estimates::new()));
    if estimates.is_empty() {
        let range = |times: &[f64]| match times {
            [] => "unknown".to_owned(),
            [first, .., last] => format!("{first} … {last}"),
            [only] => only.to_string(),
        };
        let moments: Vec<f64> = samples.iter().map(|(time, _)| *time).collect();
        let units: Vec<&str> = units.into_iter().map(TimeUnit::symbol).collect();
        return Err(file.error(format!(
            "poses within {SAME_MOMENT_S} s of the frames of {} expected: the frames' times are {}, the poses' \
             times {}, read as {}",
            scene.name(),
            range(&times),
            range(&moments),
            units.join(", ")
        )));
    }
    if unit.is_none() && read_in != TimeUnit::Second {
        log::warn!(
            "{}: the times are read as {}, in which {} frames have a pose",
            file.name(),
            read_in.symbol(),
            estimates.len()
        );
    }
    Ok(estimates)
}

/// Poses without names. Fewer lines than frames could belong to any of them, unless numbers begin them.
fn by_line(file: &TextFile, poses: &PoseLines, scene: &dyn Scene) -> Result<Estimates, SceneError> {
    let frames = scene.frames();
    let last = frames.iter().filter_map(|name| line_of(name)).max();
    if poses.numbers().is_none()
        && poses.count() != frames.len()
        && last.is_none_or(|last| poses.count() as u64 <= last)
    {
        return Err(file.error(format!(
            "one line per frame expected ({} of {}), or one per number from 0 at the end of their names; {} lines \
             found. Poses of some frames need names: `name qw qx qy qz x y z`, world to camera",
            frames.len(),
            scene.name(),
            poses.count()
        )));
    }
    let named = frames.iter().enumerate();
    let posed = named.filter_map(|(index, name)| {
        let pose = poses.get(poses.line_of_frame(index, frames.len(), name)?)?;
        Some((name.clone(), pose))
    });
    let estimates: Estimates = posed.collect();
    if let (true, Some((first, last))) = (estimates.is_empty(), poses.numbers()) {
        return Err(file.error(format!(
            "numbers at the end of the names of frames of {} expected, which are called like `{}`, or numbers \
             from 0 to {}; {} lines with numbers from {first} to {last} found",
            scene.name(),
            frames.first().map_or("", String::as_str),
            frames.len().saturating_sub(1),
            poses.count()
        )));
    }
    Ok(estimates)
}

/// Looks poses up by name; each frame may occur once.
fn by_name(
    file: &TextFile,
    poses: &[NamedPose<'_>],
    scene: &dyn Scene,
    names: &FrameNames<'_>,
) -> Result<Estimates, SceneError> {
    let mut estimates = Estimates::new();
    let mut strangers: Vec<&str> = Vec::new();
    let found = names.find_all(poses.iter().map(|pose| pose.name.as_str()));
    for (NamedPose { line, name, world_from_camera }, frame) in poses.iter().zip(found) {
        let Some(frame) = frame else {
            strangers.push(name);
            continue;
        };
        let frame = &scene.frames()[frame];
        if estimates.insert(frame.clone(), *world_from_camera).is_some() {
            return Err(
                line.error(format!("one pose per frame expected, frame {frame} has one already"))
            );
        }
    }
    if estimates.is_empty() {
        let called = strangers.first().copied().unwrap_or_default();
        return Err(file.error(names.none_found("poses of the frames", called)));
    }
    names.warn_of_strangers(&file.name(), "poses", &strangers, poses.len());
    Ok(estimates)
}
