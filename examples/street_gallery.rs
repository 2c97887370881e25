//! Pictures of the built-in street in every weather, and how long they take.
//!
//! `cargo run --release --example street_gallery -- --out docs/street` writes one PNG of half size
//! per condition; `--frame N` chooses the place, `--full` the full size.

use std::path::PathBuf;
use std::time::Instant;

use image::ImageEncoder as _;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use posescope::scene::street::{Condition, Size, Traversal};

/// The town of the built-in scene.
const WORLD_SEED: u64 = 7;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut out = PathBuf::from(".");
    let mut frames = Vec::new();
    let mut size = Size::Half;
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--out" => out = arguments.next().ok_or("--out needs a folder")?.into(),
            "--frame" => frames.push(arguments.next().ok_or("--frame needs a number")?.parse()?),
            "--full" => size = Size::Full,
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
            let name = if frames.len() == 1 {
                format!("{}.png", condition.name())
            } else {
                format!("{}-{frame:03}.png", condition.name())
            };
            let file = std::fs::File::create(out.join(&name))?;
            PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive)
                .write_image(
                    picture.as_raw(),
                    picture.width(),
                    picture.height(),
                    image::ExtendedColorType::Rgb8,
                )?;
            println!("{name}: {:.0} ms", 1e3 * elapsed.as_secs_f64());
        }
    }
    Ok(())
}
