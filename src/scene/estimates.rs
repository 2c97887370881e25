//! Reads the poses of another system: a file in one of the formats of [`PoseText`], or a COLMAP model's folder.

use std::path::Path;

use posescope_core::foreign::Estimates;

use super::frame_names::FrameNames;
use super::lines::TextFile;
use super::pose_text::{NamedPose, PoseLines, PoseText, line_of};
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
    let file = TextFile::read(if path.is_dir() { &in_folder } else { path })?;
    let names = FrameNames::new(scene);
    match PoseText::read(&file, Some(&names))? {
        PoseText::Timed(samples) => by_time(&file, samples, scene),
        PoseText::Lines(poses) => by_line(&file, &poses, scene),
        PoseText::Named(poses) => by_name(&file, &poses, scene, &names),
    }
}

/// Associates poses and frames by time.
fn by_time(
    file: &TextFile,
    mut samples: Vec<(f64, Pose)>,
    scene: &dyn Scene,
) -> Result<Estimates, SceneError> {
    samples.sort_by(|a, b| a.0.total_cmp(&b.0));
    // The name of a frame may be its time.
    let frames = scene.frames();
    let time = |frame: usize| {
        let named = || frames[frame].parse().ok();
        let time: Option<f64> = scene.time_s(frame).or_else(named);
        time.filter(|time| time.is_finite())
    };
    let mut timed: Vec<(f64, usize)> =
        (0..frames.len()).filter_map(|frame| Some((time(frame)?, frame))).collect();
    timed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let times: Vec<f64> = timed.iter().map(|(time, _)| *time).collect();
    let moments: Vec<f64> = samples.iter().map(|(time, _)| *time).collect();
    let pairs = timed.iter().zip(associated(&times, &moments));
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
            "poses within {SAME_MOMENT_S} s of the frames of {} expected: the frames' times are {}, the poses' \
             times {}",
            scene.name(),
            range(&times),
            range(&moments)
        )));
    }
    Ok(estimates)
}

/// Poses without names. Fewer lines than frames could belong to any of them.
fn by_line(file: &TextFile, poses: &PoseLines, scene: &dyn Scene) -> Result<Estimates, SceneError> {
    let frames = scene.frames();
    let last = frames.iter().filter_map(|name| line_of(name)).max();
    if poses.count() != frames.len() && last.is_none_or(|last| poses.count() as u64 <= last) {
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
        let pose = poses.of_frame(index, frames.len(), name)?;
        Some((name.clone(), pose))
    });
    Ok(posed.collect())
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
