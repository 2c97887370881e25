use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use las::{Builder, Point, Writer, point::Format};
use posescope::scene;

use crate::Failure;
use crate::numbers::memory_mb;

/// How long does a map of many points take, and how much memory?
///
/// Writes the scans of a scene, and the same again some millimetres beside, as `map.laz` beside its `scene.toml`, has
/// the scene name it, and prints what opening it and cropping it to a frame take. The scene:
/// `posescope synth town --layout toml --condition overcast --every 5`.
#[derive(clap::Args)]
pub struct Options {
    /// The folder of a scene with a `scene.toml`.
    folder: PathBuf,
    /// Points of the map.
    points: usize,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let Options { folder, points: count } = options;
    let path = folder.to_str().ok_or("a plain path expected")?;
    let map = folder.join("map.laz");
    if !map.exists() {
        write(path, &map, *count)?;
    }
    let megabytes = fs::metadata(&map)?.len() / 1_000_000;
    let before = memory_mb("VmRSS");
    let scene = scene::open(path, None)?;
    let begun = Instant::now();
    let first = scene.cloud(0)?;
    println!(
        "{count} points, a file of {megabytes} MB: opened in {:.1} s; {:.0} MB more than before, {:.0} MB at most",
        begun.elapsed().as_secs_f64(),
        memory_mb("VmRSS") - before,
        memory_mb("VmHWM") - before
    );
    let begun = Instant::now();
    let frames = scene.frames().len();
    let mut points = first.len();
    for frame in 1..frames {
        points += scene.cloud(frame)?.len();
    }
    println!(
        "{:.0} ms for each of {frames} frames, which have {} points on average",
        begun.elapsed().as_secs_f64() * 1e3 / (frames - 1).max(1) as f64,
        points / frames
    );
    Ok(())
}

fn write(folder: &str, map: &Path, count: usize) -> Result<(), Failure> {
    let description = map.with_file_name("scene.toml");
    let scene = scene::open(folder, None)?;
    let mut builder = Builder::from((1, 4));
    builder.point_format = Format::new(0)?;
    builder.point_format.is_compressed = true;
    let mut writer = Writer::from_path(map, builder.into_header()?)?;
    let mut written = 0;
    'map: for pass in 0.. {
        for frame in 0..scene.frames().len() {
            let pose = scene.pose(frame).ok_or("a pose expected")?;
            for point in scene.cloud(frame)?.points {
                if written == count {
                    break 'map;
                }
                let at = pose * point.cast::<f64>();
                let beside = 0.004 * f64::from(pass);
                let (x, z) = (at.x + beside, at.z + beside);
                writer.write_point(Point { x, y: at.y, z, ..Point::default() })?;
                written += 1;
            }
        }
    }
    writer.close()?;
    let text = fs::read_to_string(&description)?;
    let named = text.split("\n[clouds]").next().unwrap_or(&text);
    fs::write(&description, format!("cloud = \"map.laz\"\n{named}"))?;
    Ok(())
}
