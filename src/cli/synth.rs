//! `posescope synth`: the street on disk, in KITTI odometry layout.

use std::fs;
use std::path::Path;

use posescope::scene::street::Street;
use posescope::scene::{Scene as _, SceneError, SequenceWriter};
use rayon::prelude::*;

use super::args::SynthArgs;
use super::failure::CliError;
use super::terminal::Terminal;

/// Runs the command: one sequence per condition, named after it.
pub fn synth(args: &SynthArgs, terminal: &Terminal) -> Result<(), CliError> {
    let streets = streets(args)?;
    if !args.force && holds_anything(&args.folder)? {
        return Err(CliError::Usage(format!(
            "{}: the folder is not empty; --force writes there all the same, replacing sequences \
             of the same names",
            args.folder.display()
        )));
    }
    let every = args.every.get();
    let frames_of = |street: &Street| street.frames().len().div_ceil(every);
    let frames: usize = streets.iter().map(|(_, street)| frames_of(street)).sum();
    let bar = terminal.bar(frames as u64);
    let outcome = streets.iter().try_for_each(|(name, street)| {
        bar.set_message(*name);
        write(street, name, &args.folder, every, || bar.inc(1))
    });
    bar.finish_and_clear();
    outcome?;
    if !terminal.is_quiet() {
        let names: Vec<&str> = streets.iter().map(|(name, _)| *name).collect();
        eprintln!(
            "{frames} frames in {}: {}",
            args.folder.join("sequences").display(),
            names.join(", ")
        );
    }
    Ok(())
}

/// The wanted traversals in the order of the registry, each once.
fn streets(args: &SynthArgs) -> Result<Vec<(&'static str, Street)>, SceneError> {
    Street::conditions()
        .filter(|name| args.condition.is_empty() || args.condition.iter().any(|c| c == name))
        .map(|name| Ok((name, Street::new(name, args.size)?)))
        .collect()
}

fn holds_anything(folder: &Path) -> Result<bool, CliError> {
    match fs::read_dir(folder) {
        Ok(mut entries) => Ok(entries.next().is_some()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(CliError::io(folder)(error)),
    }
}

/// Writes one traversal. Frames are made past the cache: a whole traversal would only push out
/// what is used again.
fn write(
    street: &Street,
    name: &str,
    root: &Path,
    every: usize,
    tick: impl Fn() + Sync,
) -> Result<(), CliError> {
    let writer = SequenceWriter::create(root, name, Street::scanner_position())?;
    let all = 0..street.frames().len();
    let poses: Vec<_> = all.clone().filter_map(|frame| street.pose(frame)).collect();
    let times_s: Vec<_> = all
        .clone()
        .filter_map(|frame| street.time_s(frame))
        .collect();
    writer.calibration(&street.intrinsics(0))?;
    writer.poses(&poses, &times_s)?;
    let traversal = street.traversal();
    all.into_par_iter().step_by(every).try_for_each(|frame| {
        let scan = traversal.cloud(frame).into_iter();
        writer.frame(
            &street.frames()[frame],
            &traversal.image(frame),
            scan.map(|point| (point.position, point.reflectance)),
        )?;
        tick();
        Ok(())
    })
}
