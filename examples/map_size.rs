//! How long a map of many points takes, and how much memory: the street's scans as one LAZ.
//!
//! ```sh
//! posescope synth town --layout toml --condition overcast --every 5
//! cargo run --release --no-default-features --example map_size -- town/overcast 10000000
//! ```
//!
//! writes `map.laz` beside the `scene.toml` that `synth` wrote, of as many points as are asked for (the
//! scans of all frames, and the same again some millimetres beside), has the scene name it, and prints
//! what opening it and cropping it to a frame take.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;

use las::{Builder, Point, Writer, point::Format};
use posescope::scene;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let folder = words.next().ok_or("the folder of a scene expected")?;
    let count: usize = words.next().ok_or("a number of points expected")?.parse()?;
    let folder = Path::new(&folder);
    let map = folder.join("map.laz");
    if !map.exists() {
        write(folder, &map, count)?;
    }
    let megabytes = fs::metadata(&map)?.len() / 1_000_000;
    let before = resident_mb("VmRSS:");
    let scene = scene::open(folder.to_str().ok_or("a plain path expected")?, None)?;
    let begun = Instant::now();
    let first = scene.cloud(0)?;
    println!(
        "{count} points, a file of {megabytes} MB: opened in {:.1} s; {} MB more than before, {} MB at most",
        begun.elapsed().as_secs_f64(),
        resident_mb("VmRSS:").saturating_sub(before),
        resident_mb("VmHWM:").saturating_sub(before)
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

fn write(folder: &Path, map: &Path, count: usize) -> Result<(), Box<dyn Error>> {
    let description = folder.join("scene.toml");
    let scene = scene::open(folder.to_str().ok_or("a plain path expected")?, None)?;
    let mut builder = Builder::from((1, 4));
    builder.point_format = Format::new(0)?;
    builder.point_format.is_compressed = true;
    let mut writer = Writer::from_path(map, builder.into_header()?)?;
    let mut written = 0;
    for pass in 0.. {
        for frame in 0..scene.frames().len() {
            let pose = scene.pose(frame).ok_or("a pose expected")?;
            for point in scene.cloud(frame)?.points {
                if written == count {
                    writer.close()?;
                    let text = fs::read_to_string(&description)?;
                    let named = text.split("\n[clouds]").next().unwrap_or(&text);
                    fs::write(&description, format!("cloud = \"map.laz\"\n{named}"))?;
                    return Ok(());
                }
                let at = pose * point.cast::<f64>();
                let beside = 0.004 * f64::from(pass);
                writer.write_point(Point {
                    x: at.x + beside,
                    y: at.y,
                    z: at.z + beside,
                    ..Point::default()
                })?;
                written += 1;
            }
        }
    }
    Ok(())
}

/// Memory of this process \[MB\]; 0 where nobody says.
fn resident_mb(what: &str) -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(what));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) / 1000
}
