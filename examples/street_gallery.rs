//! Pictures of the built-in street in every weather, and how long they take.
//!
//! `cargo run --release --no-default-features --example street_gallery -- --out docs/street` writes one picture of half
//! size per condition; `--frame N` (repeatable) chooses the place, `--full` the full size, `--png`
//! lossless files.

use std::path::PathBuf;
use std::time::Instant;

use image::codecs::jpeg::JpegEncoder;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut out = PathBuf::from(".");
    let mut frames = Vec::new();
    let mut size = Size::Half;
    let mut lossless = false;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--out" => out = arguments.next().ok_or("--out needs a folder")?.into(),
            "--frame" => frames.push(arguments.next().ok_or("--frame needs a number")?.parse()?),
            "--full" => size = Size::Full,
            "--png" => lossless = true,
            other => return Err(format!("unknown argument {other}").into()),
        }
    }
    if frames.is_empty() {
        frames.push(30);
    }
    std::fs::create_dir_all(&out)?;
    for condition in Condition::ALL {
        let traversal = Traversal::new(WORLD_SEED, condition, size);
        for &frame in &frames {
            let started = Instant::now();
            let picture = traversal.image(frame % traversal.frame_count());
            let elapsed = started.elapsed();
            let place = if frames.len() == 1 {
                String::new()
            } else {
                format!("-{frame:03}")
            };
            let extension = if lossless { "png" } else { "jpg" };
            let name = format!("{}{place}.{extension}", condition.name());
            if lossless {
                picture.save(out.join(&name))?;
            } else {
                let file = std::fs::File::create(out.join(&name))?;
                picture.write_with_encoder(JpegEncoder::new_with_quality(file, 90))?;
            }
            println!("{name}: {:.0} ms", 1e3 * elapsed.as_secs_f64());
        }
    }
    Ok(())
}
