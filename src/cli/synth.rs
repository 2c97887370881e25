//! `posescope synth`: writes the street to disk in the layout of a data set.

use std::fs;
use std::path::Path;

use posescope::scene::layout::{Drive, LAYOUTS, Layout, Shot};
use posescope::scene::street::Street;
use posescope::scene::{Scene as _, SceneError};
use rayon::prelude::*;

use super::args::SynthArgs;
use super::failure::CliError;
use super::terminal::Terminal;

/// Runs the command: one drive per condition, named after it.
pub fn synth(args: &SynthArgs, terminal: &Terminal) -> Result<(), CliError> {
    let layout = LAYOUTS.iter().find(|layout| layout.name == args.layout).ok_or_else(|| {
        CliError::Usage(format!("there is no layout `{}`; --help lists them", args.layout))
    })?;
    let streets = streets(args)?;
    if !args.force && holds_anything(&args.folder)? {
        return Err(CliError::Usage(format!(
            "{}: the folder is not empty; name another, or write there with --force, which replaces sequences \
             of the same name",
            args.folder.display()
        )));
    }
    let every = args.every.get();
    let frames_of = |street: &Street| street.frames().len().div_ceil(every);
    let frames: usize = streets.iter().map(|(_, street)| frames_of(street)).sum();
    let bar = terminal.bar(frames as u64);
    let outcome = streets.iter().try_for_each(|(name, street)| {
        bar.set_message(*name);
        write(street, name, layout, &args.folder, every, || bar.inc(1))
    });
    bar.finish_and_clear();
    outcome?;
    terminal.say(|| {
        let places = streets.iter().map(|(name, _)| (layout.place)(name));
        let places = places.collect::<Vec<_>>().join(", ");
        format!("{frames} frames in {}: {places}", args.folder.display())
    });
    Ok(())
}

/// The requested traversals in the order of the registry, each once.
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

/// Writes one traversal. It bypasses the frame cache, which a whole traversal would only flush.
fn write(
    street: &Street,
    name: &str,
    layout: &Layout,
    root: &Path,
    every: usize,
    tick: impl Fn() + Sync,
) -> Result<(), CliError> {
    let all = 0..street.frames().len();
    let drive = Drive {
        intrinsics: street.intrinsics(0),
        names: street.frames().to_vec(),
        poses: all.clone().filter_map(|frame| street.pose(frame)).collect(),
        times_s: all.clone().filter_map(|frame| street.time_s(frame)).collect(),
        written: all.clone().step_by(every).collect(),
        scanner: Street::scanner_position(),
    };
    let writer = (layout.create)(root, name, drive)?;
    let traversal = street.traversal();
    all.into_par_iter().step_by(every).try_for_each(|index| {
        let scan = traversal.cloud(index).into_iter();
        let scan: Vec<_> = scan.map(|point| (point.position, point.reflectance)).collect();
        (writer.frame)(&Shot {
            index,
            photo: &traversal.image(index),
            scan: &scan,
            depth: &|pixel| traversal.depth(index, pixel),
        })?;
        tick();
        Ok::<(), CliError>(())
    })?;
    Ok((writer.finish)()?)
}
