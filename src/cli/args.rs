//! The arguments.

mod eval;
mod lesson;
mod protocol;
mod run_folder;
mod scene;
#[cfg(feature = "app")]
mod shot;
mod surface;
mod task;
mod triage;

use std::path::PathBuf;

use clap::{ArgAction, Args, Parser, Subcommand};
use posescope::params::Params;

pub use eval::EvalArgs;
pub use lesson::LessonArgs;
pub use protocol::check_known;
pub use run_folder::{DiffArgs, ExportArgs, ReportArgs};
pub use scene::{DoctorArgs, IndexArgs, OverviewArgs, SynthArgs};
#[cfg(feature = "app")]
pub use shot::ShotArgs;
pub use surface::SurfaceArgs;
#[cfg(feature = "app")]
pub use task::ViewArgs;
pub use task::{RecordingArgs, RunArgs, TaskArgs};
pub use triage::TriageArgs;

use super::failure::CliError;

/// See why a camera pose estimate fails.
///
/// Without a command: runs all four estimators on the built-in street, prints the table of results,
/// saves recordings/demo.rrd for the Rerun viewer, and opens the window where there is a display.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
#[command(after_help = "\
Exit codes: 0 done, 1 a gate or a regression failed, 2 usage, 3 bad data or output, 4 internal,
5 no graphics card for --compute gpu.
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
    /// Open the window: step through the estimators, see everything, try another pose
    #[cfg(feature = "app")]
    View(Box<ViewArgs>),
    /// Save a picture of the window, or of one of its views, without a window
    #[cfg(feature = "app")]
    Shot(Box<ShotArgs>),
    /// List the lessons, or go through one: in the window, or with --save as a recording
    Lesson(LessonArgs),
    /// Run an experiment over many queries into a run folder
    Eval(Box<EvalArgs>),
    /// List the queries that a run fixed, broke or changed against another; exit code 1 if it broke
    /// any
    Diff(DiffArgs),
    /// List the results of a run that meet a condition, in an order
    Triage(TriageArgs),
    /// Write report.html: a run, or a run against another, in one file for a browser
    Report(ReportArgs),
    /// Write the poses or tables of a run in formats of other programs
    Export(ExportArgs),
    /// Say how many photos scenes have and how far the camera went, and draw the routes
    Overview(OverviewArgs),
    /// Check a scene: what is there, what is missing, and which of the usual mistakes it has; exit code 3
    /// if it cannot work
    Doctor(DoctorArgs),
    /// Score a dense grid of positions and headings, and write the cheapest heading at each position
    Surface(Box<SurfaceArgs>),
    /// Write the built-in street to disk in the layout of a data set, one drive per condition
    Synth(SynthArgs),
    /// Build the retrieval index of a scene, which --references retrieve:K asks
    Index(IndexArgs),
    /// List all parameters with unit, range, default and meaning
    Params(ConfigArgs),
    /// Print what makes a shell complete posescope's arguments
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Write the manual pages of posescope and its commands into a folder
    Man {
        /// The folder, which is made where there is none
        folder: PathBuf,
    },
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
#[derive(Clone, Debug, Default, Args)]
pub struct ConfigArgs {
    /// Read parameters from a TOML file with a table per group
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Set a parameter, after --config; repeatable, for example fb.ratio=0.7
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub assignments: Vec<String>,
}

impl ConfigArgs {
    /// The parameters that the arguments describe.
    pub fn resolve(&self) -> Result<Params, CliError> {
        self.over(Params::default())
    }

    /// These parameters with what the arguments change.
    pub fn over(&self, mut params: Params) -> Result<Params, CliError> {
        if let Some(path) = &self.config {
            let text = std::fs::read_to_string(path).map_err(CliError::io(path))?;
            params
                .merge_toml(&text)
                .map_err(|source| CliError::Config {
                    path: path.clone(),
                    source,
                })?;
        }
        for assignment in &self.assignments {
            params.assign(assignment)?;
        }
        Ok(params)
    }
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
    use posescope::method::Method;
    use posescope::session::Task;

    #[test]
    fn the_definition_is_consistent() {
        Arguments::command().debug_assert();
    }

    /// The task of a command line.
    fn task(words: &[&str]) -> (Task, Vec<String>) {
        let words = ["posescope"].iter().chain(words);
        match Arguments::try_parse_from(words).map(|parsed| parsed.command) {
            Ok(Some(Command::Run(args))) => {
                let task = args.task.task(&args.scene).expect("good parameters");
                (task, args.task.reference)
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_task_is_read_from_the_command_line_that_it_writes() {
        for line in [
            &["run", "street", "--query", "70"][..],
            &[
                "run",
                "my data/00",
                "--query",
                "70",
                "--format",
                "kitti",
                "--queries",
                "it's",
                "--references",
                "retrieve:3",
                "--index",
                "an index",
                "--radius",
                "12.5",
                "--prior",
                "80",
                "--method",
                "mi,fb",
                "--fusion",
                "avg,r-wavg",
                "--seed",
                "9",
                "--degrade",
                "invert,noise=8,gamma=0.4",
                "--set",
                "fb.ratio=0.75",
                "--break",
                "inliers < 10",
                "--break",
                "fb.ransac",
            ],
            &[
                "run",
                "street",
                "--query",
                "70",
                "--reference",
                "62",
                "--reference",
                "64",
                "--prior",
                "80",
            ],
        ] {
            let (task, references) = self::task(line);
            let again = task.arguments("70", &references);
            let again: Vec<&str> = again.iter().map(String::as_str).collect();
            assert_eq!(self::task(&again), (task, references), "{again:?}");
        }
    }

    #[test]
    fn methods_run_once_each_in_the_order_of_the_registry() {
        let (task, _) = task(&["run", "street", "--all", "--method", "mi,fb,mi"]);
        let expected = [Method::FB, Method::MI];
        assert_eq!(task.protocol.methods, expected);
    }
}
