//! The arguments.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use clap::{ArgAction, Args, Parser, Subcommand};
use posescope::evaluate::Selection;
use posescope::event::Method;
use posescope::fusion;
use posescope::scene::street::{Size, Street};

/// See why a camera pose estimate fails.
///
/// Without a command: runs all four estimators on the built-in street, prints the table of results
/// and saves recordings/demo.rrd for the Rerun viewer.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
#[command(after_help = "\
Exit codes: 0 done, 1 a gate or a regression failed, 2 usage, 3 bad data or output, 4 internal.
A query that cannot be localised is a result, not an error.")]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub verbosity: Verbosity,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Localise one query, or several, and record every decision
    Run(Box<RunArgs>),
    /// Write the built-in street to disk in KITTI odometry layout, one sequence per condition
    Synth(SynthArgs),
    /// List all parameters with unit, range, default and meaning
    Params(ConfigArgs),
}

#[derive(Debug, Args)]
pub struct Verbosity {
    /// No progress and no table; errors only
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more on stderr; twice for debugging
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,
}

/// Which parameters differ from their defaults.
#[derive(Debug, Default, Args)]
pub struct ConfigArgs {
    /// Read parameters from a TOML file with a table per group
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Set a parameter, after --config; repeatable, for example fb.ratio=0.7
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub assignments: Vec<String>,
}

#[derive(Debug, Args)]
pub struct RunArgs {
    /// Where the frames are: street, street:night and so on, or a folder such as …/sequences/00
    /// (KITTI odometry)
    pub scene: String,
    /// The format of the scene, if its content does not tell
    #[arg(long, value_name = "NAME")]
    pub format: Option<String>,
    /// Take the queries from another scene in the same world frame
    #[arg(long, value_name = "SCENE")]
    pub queries: Option<String>,
    /// The frame to localise; repeatable (3823 finds 003823)
    #[arg(long, value_name = "FRAME", required_unless_present = "all")]
    pub query: Vec<String>,
    /// Localise every frame
    #[arg(long, conflicts_with = "query")]
    pub all: bool,
    /// A frame with known pose and cloud to localise against; repeatable
    #[arg(long, value_name = "FRAME")]
    pub reference: Vec<String>,
    /// How references are chosen where --reference names none: random:K, nearest:K or maxf:K (those
    /// with the most feature matches) of the frames within the radius of the query's known position
    #[arg(
        long,
        value_name = "HOW",
        default_value = "random:1",
        conflicts_with = "reference"
    )]
    pub references: Selection,
    /// How far the query may be from its reference: the disc that the direct methods search [m]
    #[arg(long, value_name = "METRES", default_value_t = 15.0, value_parser = positive)]
    pub radius: f64,
    /// The methods to run
    #[arg(
        long,
        value_name = "fb,pm,mi,hy",
        value_delimiter = ',',
        value_parser = method,
        default_value = "fb,pm,mi,hy"
    )]
    pub method: Vec<Method>,
    /// Fuse the poses of several references into one; otherwise each reference gives its own
    #[arg(long, value_name = "maxf|avg|wavg|r-wavg", value_parser = fusion)]
    pub fusion: Option<&'static fusion::Entry>,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Number of threads [default: one per core]; results do not depend on it
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
    #[command(flatten)]
    pub recording: RecordingArgs,
    /// Write the results as JSON, one object per line; - for stdout
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

/// Where the recording goes: Rerun's own options, which can be combined.
#[derive(Debug, Default, Args)]
pub struct RecordingArgs {
    /// Save the recording to a file
    #[arg(long, value_name = "FILE.rrd")]
    pub save: Option<PathBuf>,
    /// Send the recording to a running viewer [default URL: the local viewer]
    #[arg(long, value_name = "URL", num_args = 0..=1, default_missing_value = "")]
    pub connect: Option<String>,
    /// Start a Rerun viewer and send the recording to it
    #[arg(long)]
    pub spawn: bool,
    /// Serve the recording, so that viewers can connect to this process
    #[arg(long)]
    pub serve: bool,
}

#[derive(Debug, Args)]
pub struct SynthArgs {
    /// Where to write: DIR/sequences/CONDITION and DIR/poses/CONDITION.txt
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// The size of the images: 620x188 or 1241x376 pixels
    #[arg(
        long,
        default_value = "full",
        value_parser = PossibleValuesParser::new(Street::sizes())
            .try_map(|name: String| Street::size(&name).ok_or("a size expected"))
    )]
    pub size: Size,
    /// Write every Nth frame only; frames keep their numbers, poses and times stay complete
    #[arg(long, value_name = "N", default_value = "1")]
    pub every: NonZeroUsize,
    /// Write this traversal only; repeatable
    #[arg(long, value_parser = PossibleValuesParser::new(Street::conditions()))]
    pub condition: Vec<String>,
    /// Write into a folder that is not empty, replacing sequences of the same names
    #[arg(long)]
    pub force: bool,
}

fn fusion(name: &str) -> Result<&'static fusion::Entry, String> {
    fusion::find(name).ok_or_else(|| {
        let names: Vec<&str> = fusion::ALL.iter().map(|entry| entry.name).collect();
        format!("{} expected", names.join(", "))
    })
}

fn method(name: &str) -> Result<Method, String> {
    Method::from_name(name).ok_or_else(|| "fb, pm, mi or hy expected".to_owned())
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|number: &f64| *number > 0.0 && number.is_finite())
        .ok_or_else(|| "a positive number expected".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn the_definition_is_consistent() {
        Arguments::command().debug_assert();
    }
}
