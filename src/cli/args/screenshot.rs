//! The arguments of `posescope view` for the size of the window and for a picture of it.

use std::path::PathBuf;

use clap::Args;
use posescope::app::ShotTime;

/// Saves a picture of the window instead of opening it.
#[derive(Debug, Args)]
#[command(next_help_heading = "Screenshot")]
pub struct ScreenshotArgs {
    /// Save a picture of the window as PNG or JPEG; needs no display
    #[arg(long, value_name = "FILE.png|FILE.jpg")]
    #[arg(hide_short_help = true)]
    pub screenshot: Option<PathBuf>,
    /// The moment to show: the end of the run, the end of a method, or a step number
    #[arg(
        long,
        value_name = "end|METHOD|STEP",
        default_value_t = ShotTime::End,
        requires = "screenshot"
    )]
    #[arg(hide_short_help = true)]
    pub at: ShotTime,
    /// The size of the window [px]
    #[arg(
        long,
        value_name = "WIDTHxHEIGHT",
        default_value = "1500x950",
        value_parser = size
    )]
    #[arg(hide_short_help = true)]
    pub window: [u32; 2],
    /// Pixels per point
    #[arg(
        long,
        value_name = "FACTOR",
        default_value_t = 1.0,
        value_parser = scale,
        requires = "screenshot"
    )]
    #[arg(hide_short_help = true)]
    pub scale: f32,
    /// Use the light theme
    #[arg(long, requires = "screenshot")]
    #[arg(hide_short_help = true)]
    pub light: bool,
}

/// The smallest and the largest side of a picture \[px\].
const SIDES: std::ops::RangeInclusive<u32> = 64..=8192;

fn size(text: &str) -> Result<[u32; 2], String> {
    let side = |word: &str| word.parse().ok().filter(|side| SIDES.contains(side));
    text.split_once('x').and_then(|(width, height)| Some([side(width)?, side(height)?])).ok_or_else(
        || {
            format!(
                "a width and a height such as 1500x950 expected, each from {} to {} px",
                SIDES.start(),
                SIDES.end()
            )
        },
    )
}

fn scale(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|scale| (0.5..=4.0).contains(scale))
        .ok_or_else(|| "a number from 0.5 to 4 expected".to_owned())
}
