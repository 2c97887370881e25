//! The arguments of `posescope surface`.

use std::path::PathBuf;

use clap::Args;

use super::{TaskArgs, positive};

#[derive(Debug, Args)]
pub struct SurfaceArgs {
    /// Where the frames are; see `posescope run --help`
    pub scene: String,
    /// The frame, or the photo that is no frame of any scene
    #[arg(long, value_name = "FRAME|PHOTO")]
    pub query: String,
    #[command(flatten)]
    pub task: TaskArgs,
    /// Step of the positions within --radius [m]
    #[arg(long, value_name = "METRES", default_value_t = 0.1, value_parser = positive)]
    pub step: f64,
    /// Step of the headings within grid.yaw_range [°]
    #[arg(long, value_name = "DEGREES", default_value_t = 0.5, value_parser = positive)]
    pub yaw_step: f64,
    /// Where it goes: a table (.csv) or a picture (.png) of the cheapest heading at each position
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}
