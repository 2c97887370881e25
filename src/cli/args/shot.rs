//! The arguments of `posescope shot`.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use posescope::app::{Arrangement, Moment, NamedPose, views};

use super::ViewArgs;

#[derive(Debug, Args)]
pub struct ShotArgs {
    #[command(flatten)]
    pub view_args: ViewArgs,
    /// The view that is painted, without the bars around it [default: the whole window]
    #[arg(
        long,
        value_name = "NAME",
        value_parser = PossibleValuesParser::new(views::ALL.iter().map(|entry| entry.name))
    )]
    pub view: Option<String>,
    /// What the window is arranged for
    #[arg(
        long,
        value_name = "NAME",
        default_value = "inspect",
        value_parser = PossibleValuesParser::new(["inspect", "teach", "batch"])
            .try_map(|name: String| arrangement(&name).ok_or("a layout expected"))
    )]
    pub layout: Arrangement,
    /// The moment of the run: its end, the end of a method, or the step of a number
    #[arg(long, value_name = "end|METHOD|STEP", default_value_t = Moment::End)]
    pub at: Moment,
    /// Show the methods so many steps into each of them, as in the view lockstep
    #[arg(long, value_name = "STEP")]
    pub lockstep: Option<usize>,
    /// Look from this pose: costs and synthetic views are those at it
    #[arg(
        long,
        value_name = "POSE",
        value_parser = PossibleValuesParser::new(poses())
            .try_map(|name: String| NamedPose::from_word(&name).ok_or("a pose expected"))
    )]
    pub pose: Option<NamedPose>,
    /// Fill the cost surface with every position and heading first
    #[arg(long)]
    pub dense: bool,
    /// Size of the picture [px]
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "1500x950", value_parser = size)]
    pub size: [u32; 2],
    /// Pixels per point: how large words and marks are
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = scale)]
    pub scale: f32,
    /// On a light ground
    #[arg(long)]
    pub light: bool,
    /// The picture to write: PNG, JPEG, or SVG of a view that is drawn, by its ending
    #[arg(long, value_name = "FILE.png|FILE.jpg|FILE.svg")]
    pub out: PathBuf,
}

fn arrangement(name: &str) -> Option<Arrangement> {
    let mut all = Arrangement::ALL.into_iter();
    all.find(|(_, title, _)| title.eq_ignore_ascii_case(name))
        .map(|(arrangement, ..)| arrangement)
}

/// The names of the poses that there are before anybody has moved the camera.
fn poses() -> impl Iterator<Item = &'static str> {
    let poses = NamedPose::ALL.into_iter();
    poses
        .filter(|pose| *pose != NamedPose::Last)
        .map(NamedPose::word)
}

/// The smallest and the largest side of a picture \[px\].
const SIDES: std::ops::RangeInclusive<u32> = 64..=8192;

fn size(text: &str) -> Result<[u32; 2], String> {
    let side = |word: &str| word.parse().ok().filter(|side| SIDES.contains(side));
    text.split_once('x')
        .and_then(|(width, height)| Some([side(width)?, side(height)?]))
        .ok_or_else(|| {
            format!(
                "two sides such as 1500x950 expected, each of {} to {} px",
                SIDES.start(),
                SIDES.end()
            )
        })
}

fn scale(text: &str) -> Result<f32, String> {
    text.parse()
        .ok()
        .filter(|scale| (0.5..=4.0).contains(scale))
        .ok_or_else(|| "a number of 0.5 to 4 expected".to_owned())
}
