//! The arguments of `posescope lesson`.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Args)]
pub struct LessonArgs {
    /// The name or the file of a lesson; without it, all lessons are listed
    #[arg(value_name = "NAME|FILE.md")]
    pub name: Option<String>,
    /// Save the lesson as a Rerun recording instead of opening the window
    #[arg(long, value_name = "FILE.rrd", requires = "name")]
    pub save: Option<PathBuf>,
}
