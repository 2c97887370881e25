//! The command-line arguments.

mod eval;
mod given;
mod look;
mod scene;
#[cfg(feature = "app")]
mod screenshot;
mod task;

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::{ArgAction, Args, CommandFactory as _, Parser, Subcommand, ValueEnum as _};
use posescope::params::Params;
use posescope::run::{ConfigError, with_config};

pub use eval::{EvalArgs, EvalCommand, MergeArgs};
pub use given::Given;
pub use look::{CompareArgs, Form, ResultsArgs};
pub use scene::{DoctorArgs, IndexArgs, SurveyArgs, SynthArgs};
#[cfg(feature = "app")]
pub use screenshot::ScreenshotArgs;
#[cfg(feature = "app")]
pub use task::ViewArgs;
pub use task::{RunArgs, TaskArgs};

use super::compute::Compute;

/// See why a camera pose estimate fails.
#[derive(Debug, Parser)]
#[command(
    version,
    max_term_width = 100,
    help_template = HELP,
    override_usage = "posescope [OPTIONS] [COMMAND]\n       posescope [SCENE|RUN]",
    disable_help_subcommand = true
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub everywhere: Everywhere,
}

/// The commands, grouped by purpose. A test checks that the list is complete.
const HELP: &str = "\
{about}

{usage-heading} {usage}

Without arguments, posescope localises a query of the built-in street, prints the results, saves
recordings/demo.rrd and opens the window if there is a display. With a SCENE or a RUN it does the
same as `view`.

Localise:
  run        Localise a query, or several, and print why each result is right or wrong
  view       Step through a query, or browse the results of a run, in the window
  eval       Localise many queries into a run folder; `eval merge` puts shards together

Look at runs:
  results    List, filter and export the results of a run
  compare    Show what changed between two runs; exit code 1 if a query broke

Prepare data:
  doctor     Check scenes: list their contents and find the usual mistakes
  survey     Measure where a map localises photos, and how far to trust its poses
  index      Build the retrieval index for --reference retrieve:K
  synth      Write the built-in street as a KITTI, TUM, COLMAP or scene.toml data set

Learn:
  lesson     List the lessons, or start one
  params     List every parameter with unit, range, default and meaning

Options:
{options}

Exit codes: 0 done, 1 a gate or a comparison failed, 2 usage, 3 bad data or output, 4 internal,
5 no graphics card for --compute gpu. A query without a pose is a result, not an error.

Try: posescope run street --query 70 --reference 62";

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Localise a query, or several, and print why each result is right or wrong
    Run(Box<RunArgs>),
    /// Step through a query, or browse the results of a run, in the window
    #[cfg(feature = "app")]
    View(Box<ViewArgs>),
    /// Localise many queries into a run folder; `eval merge` puts shards together
    Eval(Box<EvalArgs>),
    /// List, filter and export the results of a run
    Results(Box<ResultsArgs>),
    /// Show what changed between two runs; exit code 1 if a query broke
    Compare(CompareArgs),
    /// Check scenes: list their contents and find the usual mistakes; exit code 3 if a scene is unusable
    Doctor(DoctorArgs),
    /// Measure where a map localises photos, and how far to trust its poses
    Survey(SurveyArgs),
    /// Build the retrieval index for --reference retrieve:K
    Index(IndexArgs),
    /// Write the built-in street as a data set, one drive per condition
    Synth(SynthArgs),
    /// List the lessons, or start one
    Lesson(LessonArgs),
    /// List every parameter with unit, range, default and meaning
    Params(ConfigArgs),
    /// Print a shell completion script
    #[command(hide = true)]
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// A scene or a run to open in the window
    #[command(external_subcommand)]
    Open(Vec<OsString>),
}

/// The command line. `run` and `view` hide the options that only apply to many queries.
pub fn definition() -> clap::Command {
    let single = |command: clap::Command| {
        ["limit", "preset"]
            .into_iter()
            .fold(command, |command, id| command.mut_arg(id, |arg| arg.hide(true)))
    };
    let command = Arguments::command().mut_subcommand("run", single);
    #[cfg(feature = "app")]
    let command = command.mut_subcommand("view", single);
    command
}

/// Options of all commands.
#[derive(Debug, Args)]
#[command(next_help_heading = "Everywhere")]
pub struct Everywhere {
    /// Print only errors
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print more; twice for debugging
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub verbose: u8,
    /// Number of threads; results do not depend on it [default: one per core]
    #[arg(long, global = true, value_name = "N", hide_short_help = true)]
    pub threads: Option<NonZeroUsize>,
    /// The processor that scores hypotheses; results do not depend on it
    #[arg(long, global = true, value_name = "WHERE", value_enum, default_value_t)]
    #[arg(hide_short_help = true)]
    pub compute: Compute,
}

impl Everywhere {
    /// The options as words of a command line.
    pub fn words(&self) -> Vec<OsString> {
        let compute = self.compute.to_possible_value();
        let mut words: Vec<OsString> = Vec::new();
        words.extend(compute.map(|value| format!("--compute={}", value.get_name()).into()));
        words.extend(self.quiet.then(|| "--quiet".into()));
        words.extend((0..self.verbose).map(|_| "--verbose".into()));
        words.extend(self.threads.map(|threads| format!("--threads={threads}").into()));
        words
    }
}

/// The arguments of `posescope lesson`.
#[derive(Debug, Args)]
pub struct LessonArgs {
    /// The name or the file of a lesson; without it, all lessons are listed
    #[arg(value_name = "NAME|FILE.md")]
    pub name: Option<String>,
    /// Save the lesson as a Rerun recording instead of opening the window
    #[arg(long, value_name = "FILE.rrd", requires = "name")]
    pub save: Option<PathBuf>,
}

/// Changes to the parameters' defaults.
#[derive(Clone, Debug, Default, Args)]
pub struct ConfigArgs {
    /// Read parameters from a TOML file with one table per group; `paper` runs the estimators as the paper writes them
    #[arg(long, value_name = "FILE.toml|paper")]
    #[arg(help_heading = "Methods", hide_short_help = true)]
    pub config: Option<PathBuf>,
    /// Set a parameter, for example fb.ratio=0.7; repeatable; `posescope params` lists them
    #[arg(long = "set", help_heading = "Methods", value_name = "KEY=VALUE")]
    pub assignments: Vec<String>,
}

impl ConfigArgs {
    /// The parameters that the arguments describe.
    pub fn resolve(&self) -> Result<Params, ConfigError> {
        self.over(Params::default())
    }

    /// These parameters with the changes of the arguments.
    pub fn over(&self, params: Params) -> Result<Params, ConfigError> {
        with_config(params, self.config.as_deref(), &self.assignments)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use posescope::method::Method;
    use posescope::scene::SceneSize;
    use posescope::session::Task;

    #[test]
    fn the_definition_is_consistent() {
        Arguments::command().debug_assert();
    }

    /// The task of a command line.
    fn task(words: &[&str]) -> Task {
        let words = ["posescope"].iter().chain(words);
        match Arguments::try_parse_from(words).map(|parsed| parsed.command) {
            Ok(Some(Command::Run(args))) => {
                args.task.task(&args.scene, &SceneSize::PAPER).expect("good parameters")
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_papers_configuration_is_known_and_options_override_it() {
        let given =
            task(&["run", "street", "--query", "70", "--config", "paper", "--set", "fb.ratio=0.8"])
                .params;
        let defaults = Params::default();
        assert_eq!(given.fb.ratio, 0.8);
        assert!(given.fb.mlesac.fourth && !given.fb.mlesac.local && !given.surf.upright);
        assert_eq!(given.grid.coverage_floor, 0.0);
        let changed =
            given.list().into_iter().zip(defaults.list()).filter(|(a, b)| a.value != b.value);
        assert_eq!(changed.count(), 9);
    }

    #[test]
    fn a_task_is_read_from_the_command_line_that_it_writes() {
        for line in [
            "run street --query 70",
            "run it's --query 70 --format kitti --query-scene street --reference retrieve:3 --index i \
             --radius 12.5 --prior 80 --method mi,fb,other --estimates other=poses.txt --fusion avg,r-wavg --seed 9 \
             --degrade invert,noise=8,gamma=0.4 --set fb.ratio=0.75 --break inliers<10 --break fb.ransac \
             --right 0.5m,2deg --min-confidence 0.5 --explain 3 --gps gps.csv --matches hloc",
            "run street --query 70 --reference 62 --reference 64 --prior 80 --explain",
        ] {
            let words: Vec<&str> = line.split_whitespace().collect();
            let task = self::task(&words);
            let again = task.arguments("70", &[]);
            let again: Vec<&str> = again.iter().map(String::as_str).collect();
            assert_eq!(self::task(&again), task, "{again:?}");
        }
    }

    #[test]
    fn methods_run_once_each_in_the_order_of_the_registry() {
        let task = task(&["run", "street", "--all", "--method", "mi,fb,mi"]);
        assert_eq!(task.protocol.methods, [Method::FB, Method::MI]);
    }

    /// Every command with the commands below it, `help` left out.
    fn commands() -> Vec<clap::Command> {
        fn below(command: &clap::Command, found: &mut Vec<clap::Command>) {
            found.push(command.clone());
            for sub in command.get_subcommands() {
                below(sub, found);
            }
        }
        let mut command = definition();
        command.build();
        let mut found = Vec::new();
        below(&command, &mut found);
        found
    }

    #[test]
    fn the_help_lists_every_command_with_its_own_words() {
        let command = Arguments::command();
        let help = command.clone().render_help().to_string();
        for sub in command.get_subcommands().filter(|sub| !sub.is_hide_set()) {
            let line = help.lines().find(|line| {
                let mut words = line.split_whitespace();
                words.next() == Some(sub.get_name()) && line.starts_with("  ")
            });
            assert!(line.is_some(), "{} is missing in\n{help}", sub.get_name());
        }
    }

    #[test]
    fn every_option_has_help_and_short_help_fits_a_terminal() {
        for mut command in commands() {
            for arg in command.get_arguments() {
                let name = format!("{} {}", command.get_name(), arg.get_id());
                assert!(arg.get_help().is_some(), "{name} has no help");
            }
            let help = command.render_help().to_string();
            let lines = help.lines().count();
            assert!(lines <= 60, "{}: {lines} lines\n{help}", command.get_name());
            let widest = help.lines().map(|line| line.chars().count()).max();
            assert!(widest <= Some(100), "{}: {widest:?}\n{help}", command.get_name());
        }
    }

    #[test]
    fn an_option_has_one_meaning_and_there_are_at_most_sixty_that_are_not_rare() {
        let mut options = std::collections::BTreeMap::new();
        for command in commands() {
            for arg in command.get_arguments().filter(|arg| !arg.is_hide_set()) {
                if let Some(long) = arg.get_long() {
                    let heading = arg.get_help_heading().map(str::to_owned);
                    options.insert(long.to_owned(), heading);
                }
            }
        }
        let names: Vec<&String> = options
            .iter()
            .filter(|(_, heading)| heading.as_deref() != Some("Screenshot"))
            .map(|(name, _)| name)
            .collect();
        assert!(names.len() <= 68, "{}: {names:?}", names.len());
    }
}
