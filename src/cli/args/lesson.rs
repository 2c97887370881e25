//! The arguments of `posescope lesson`.

use std::path::PathBuf;

use clap::Args;

#[derive(Debug, Args)]
pub struct LessonArgs {
    /// A lesson by its name, or the file of one; without it, all are listed
    #[arg(value_name = "NAME|FILE.md")]
    pub name: Option<String>,
    /// Write the lesson as a recording for a Rerun viewer instead of opening the window
    #[arg(long, value_name = "FILE.rrd", requires = "name")]
    pub save: Option<PathBuf>,
    /// Print the pages instead of opening the window
    #[arg(long, requires = "name", conflicts_with = "save")]
    pub text: bool,
}
