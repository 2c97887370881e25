//! The arguments.

mod eval;
mod lesson;
#[cfg(feature = "app")]
mod shot;
mod triage;

use std::fmt;
use std::net::IpAddr;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use clap::{ArgAction, Args, Parser, Subcommand};
use posescope::describe::Domain;
use posescope::diagnosis::Tolerance as Right;
use posescope::estimator;
use posescope::fusion::Fusion;
use posescope::image::Degradation;
use posescope::localize::Selection;
use posescope::measure::{Format, Tolerance};
use posescope::method::Method;
use posescope::params::Params;
use posescope::report::PICTURES;
use posescope::run::{EstimatesFile, Protocol};
use posescope::scene::CameraArgument;
use posescope::scene::layout::LAYOUTS;
use posescope::scene::street::{Size, Street};
use posescope::session::{Breakpoint, Task};
use posescope::text::UnknownWord;

pub use eval::EvalArgs;
pub use lesson::LessonArgs;
#[cfg(feature = "app")]
pub use shot::ShotArgs;
pub use triage::TriageArgs;

use super::failure::CliError;

/// See why a camera pose estimate fails.
///
/// Without a command: runs all four estimators on the built-in street, prints the table of results,
/// saves recordings/demo.rrd for the Rerun viewer, and opens the window where there is a display.
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
    /// Check a scene: what is there, what is missing, and which of the usual mistakes it has; exit code 3
    /// if it cannot work
    Doctor(DoctorArgs),
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

#[derive(Debug, Args)]
pub struct RunArgs {
    /// Where the frames are: street, street:night and so on, or a folder such as …/sequences/00;
    /// --help lists all formats
    #[arg(long_help = scene_formats())]
    pub scene: String,
    /// The frame to localise, or a photo that is no frame of any scene; repeatable (3823 finds 003823)
    #[arg(long, value_name = "FRAME|PHOTO", required_unless_present = "all")]
    pub query: Vec<String>,
    /// Localise every frame
    #[arg(long, conflicts_with_all = ["query", "camera"])]
    pub all: bool,
    #[command(flatten)]
    pub task: TaskArgs,
    #[command(flatten)]
    pub recording: RecordingArgs,
    /// Write the matches of the feature-based method into this folder, in the form that --matches reads
    #[arg(long, value_name = "DIR")]
    pub export_matches: Option<PathBuf>,
    /// Write the results as JSON, one object per line; - for stdout
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write every event as JSON, one object per line: all that was decided, for a notebook
    #[arg(long, value_name = "FILE.jsonl")]
    pub events: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct ViewArgs {
    /// Where the frames are, or the folder of a run; see `posescope run --help`
    #[arg(default_value = "street", value_name = "SCENE|RUN")]
    pub scene: String,
    /// The frame to begin with, or a photo that is no frame of any scene
    #[arg(long, value_name = "FRAME|PHOTO")]
    pub query: Option<String>,
    #[command(flatten)]
    pub task: TaskArgs,
}

#[cfg(feature = "app")]
impl ViewArgs {
    /// The window of the bare command.
    pub fn demo() -> Self {
        Self {
            scene: super::demo_settings::settings().scene.clone(),
            query: None,
            task: TaskArgs::default(),
        }
    }
}

/// What is asked of a query, whether somebody looks on or not.
#[derive(Debug, Args)]
pub struct TaskArgs {
    /// Take the queries from another scene in the same world frame
    #[arg(long, value_name = "SCENE")]
    pub queries: Option<String>,
    /// The camera of photos that are named as --query: focal lengths and centre [px], a camera line of
    /// COLMAP, or its cameras.txt [default: what EXIF tells]
    #[arg(
        long,
        value_name = "fx,fy,cx,cy",
        requires = "query",
        conflicts_with = "queries"
    )]
    pub camera: Option<CameraArgument>,
    /// A frame with known pose and cloud to localise against; repeatable
    #[arg(long, value_name = "FRAME", conflicts_with = "references")]
    pub reference: Vec<String>,
    /// The index that retrieve:K asks [default: where `posescope index` puts it]
    #[arg(long, value_name = "FILE")]
    pub index: Option<PathBuf>,
    /// How far the query may be from its reference: the disc that the direct methods search [m]
    #[arg(long, value_name = "METRES", default_value_t = Protocol::RADIUS_M, value_parser = positive)]
    pub radius: f64,
    #[command(flatten)]
    pub protocol: ProtocolArgs,
    /// Stop at a stage (fb.ransac) or where a number crosses a bound (inliers < 10), with the
    /// recording up to there; repeatable
    #[arg(long = "break", value_name = "EXPR")]
    pub breakpoints: Vec<Breakpoint>,
}

impl TaskArgs {
    /// What is asked of the queries of a scene.
    pub fn task(&self, scene: &str) -> Result<Task, CliError> {
        Ok(Task {
            scene: scene.to_owned(),
            queries: self.queries.clone(),
            format: self.protocol.format.clone(),
            by_hand: !self.reference.is_empty(),
            index: self.index.clone(),
            radius_m: self.radius,
            protocol: self.protocol.over(Protocol::default())?,
            params: self.protocol.config.resolve()?,
            breakpoints: self.breakpoints.clone(),
            photos: None,
        })
    }
}

/// What is asked where no option is given.
impl Default for TaskArgs {
    fn default() -> Self {
        Self {
            queries: None,
            camera: None,
            reference: Vec::new(),
            index: None,
            radius: Protocol::RADIUS_M,
            protocol: ProtocolArgs::default(),
            breakpoints: Vec::new(),
        }
    }
}

/// How queries are localised, one or thousands.
#[derive(Clone, Debug, Default, Args)]
pub struct ProtocolArgs {
    /// The format of the scenes, if their content does not tell
    #[arg(long, value_name = "NAME")]
    pub format: Option<String>,
    /// How references are chosen: random:K, nearest:K, maxf:K (those with the most feature matches)
    /// or retrieve:K (those that the index of `posescope index` ranks first) of the frames around the
    /// query's known position, or of all where nobody knows it and they are chosen by looks, by one of
    /// the latter two [default: random:1; for photos of no scene without --gps: maxf:1]
    #[arg(long, value_name = "HOW")]
    pub references: Option<Selection>,
    /// How far from the query's known position references may be, where that is more than the radius
    /// [m] [default: the radius]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub prior: Option<f64>,
    /// Rough positions of queries, around which references are sought: a table with the columns `name x
    /// y z`, in the world of the scene, or `name latitude longitude`, with three frames of known pose
    /// or more among its lines
    #[arg(long, value_name = "FILE")]
    pub gps: Option<PathBuf>,
    /// The methods to run [default: fb,pm,mi,hy]
    #[arg(long, value_name = "fb,pm,mi,hy", value_delimiter = ',', value_parser = method)]
    pub method: Vec<Method>,
    /// Poses that another system found, as a method of this name beside ours; repeatable. FILE is TUM,
    /// KITTI, COLMAP's images.txt or `name qw qx qy qz x y z` as visuallocalization.net takes it
    #[arg(long, value_name = "NAME=FILE")]
    pub estimates: Vec<EstimatesFile>,
    /// Take the matches of the feature-based method from this folder, instead of finding them: hloc's
    /// features and matches (.h5), or QUERY_REFERENCE_matches.npz or .txt for each pair
    #[arg(long, value_name = "DIR")]
    pub matches: Option<PathBuf>,
    /// Degrade the photos of queries before anybody sees them, as in gamma=0.4,noise=8,invert; --help
    /// lists what there is
    #[arg(long, value_name = "STEP=STRENGTH,…", long_help = degradations())]
    pub degrade: Option<Degradation>,
    /// One pose of several references, by each of these: the poses of each averaged, or, joint, all
    /// references at once (fb, pm, mi, nid, hy) [default: none, and each reference gives its own; eval:
    /// r-wavg]
    #[arg(long, value_name = "maxf,avg,wavg,r-wavg,joint", value_delimiter = ',')]
    pub fusion: Vec<Fusion>,
    /// Seed of every random choice [default: 0]
    #[arg(long)]
    pub seed: Option<u64>,
    /// How near the truth a pose is right; one that is not gets a verdict that says why [default:
    /// 1m,5deg]
    #[arg(long, value_name = "METRES,DEGREES")]
    pub right: Option<Right>,
    /// Refuse poses that are within 1 m of the truth with less than this probability (L1)
    #[arg(long, value_name = "PROBABILITY", value_parser = share)]
    pub accept: Option<f64>,
    /// Localise a query that went wrong again, at most so often for each result, and say what would
    /// have helped
    #[arg(long, value_name = "RUNS", num_args = 0..=1, default_missing_value = "12")]
    pub explain: Option<usize>,
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Number of threads [default: one per core]; results do not depend on it
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
}

impl ProtocolArgs {
    /// What was given, and the defaults for the rest. Methods are put in the order of the registry, and
    /// behind them the other systems.
    pub fn over(&self, defaults: Protocol) -> Result<Protocol, CliError> {
        let wanted = match self.method.as_slice() {
            [] => &defaults.methods,
            wanted => wanted,
        };
        let estimates = match self.estimates.as_slice() {
            [] => defaults.estimates,
            given => given.to_vec(),
        };
        let others: Vec<Method> = estimates.iter().map(|file| file.method).collect();
        check_known(wanted, &others)?;
        if let Some(twice) = (1..others.len()).find(|&at| others[..at].contains(&others[at])) {
            let message = format!("--estimates {} is given twice", others[twice]);
            return Err(CliError::Usage(message));
        }
        let ours = estimator::methods().filter(|method| wanted.contains(method));
        Ok(Protocol {
            references: self.references.unwrap_or(defaults.references),
            prior_m: self.prior.or(defaults.prior_m),
            methods: ours.chain(others).collect(),
            fusions: match self.fusion.as_slice() {
                [] => defaults.fusions,
                wanted => wanted.to_vec(),
            },
            seed: self.seed.unwrap_or(defaults.seed),
            right: self.right.unwrap_or(defaults.right),
            accept: self.accept.or(defaults.accept),
            explain: self.explain.unwrap_or(defaults.explain),
            estimates,
            matches: self.matches.clone().or(defaults.matches),
            gps: self.gps.clone().or(defaults.gps),
            degrade: self.degrade.unwrap_or(defaults.degrade),
        })
    }
}

/// A method of ours or a name that another system may go by.
fn method(name: &str) -> Result<Method, String> {
    Method::called(name).map_err(|_| UnknownMethod(name).to_string())
}

/// Every method that is asked for is one of ours or goes by the name of given poses.
pub fn check_known(asked: &[Method], others: &[Method]) -> Result<(), CliError> {
    let mut asked = asked.iter();
    match asked.find(|method| estimator::find(**method).is_none() && !others.contains(method)) {
        Some(unknown) => Err(CliError::Usage(UnknownMethod(unknown.name()).to_string())),
        None => Ok(()),
    }
}

struct UnknownMethod<'a>(&'a str);

impl fmt::Display for UnknownMethod<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let known = estimator::methods().map(Method::name);
        let error = UnknownWord::among(self.0, "method", known);
        write!(f, "{error}, or a name that --estimates gives")
    }
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
    /// Serve the recording, so that viewers can connect to this process; at 127.0.0.1, which other
    /// machines do not reach, unless an address is given
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1")]
    pub serve: Option<IpAddr>,
}

#[derive(Debug, Args)]
pub struct DiffArgs {
    /// The run folder to compare with
    #[arg(value_name = "RUN_A")]
    pub before: PathBuf,
    /// The run folder that may be better or worse
    #[arg(value_name = "RUN_B")]
    pub after: PathBuf,
    /// Changes of the translation error up to this are none [m]
    #[arg(long, value_name = "METRES", default_value_t = Tolerance::default().metres)]
    pub tolerance_m: f64,
    /// Changes of the rotation error up to this are none [°]
    #[arg(long, value_name = "DEGREES", default_value_t = Tolerance::default().degrees)]
    pub tolerance_deg: f64,
    /// Where to save the recording with both runs on the same timelines [default: RUN_B/diff.rrd]
    #[arg(long, value_name = "FILE.rrd")]
    pub save: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct ReportArgs {
    /// The run folder; of two, the first is the baseline that the second is held against
    #[arg(value_name = "RUN", num_args = 1..=2, required = true)]
    pub runs: Vec<PathBuf>,
    /// The file to write [default: report.html in the folder of the run]
    #[arg(long, value_name = "FILE.html")]
    pub out: Option<PathBuf>,
    /// Draw matches and costs of at most as many failures
    #[arg(long, value_name = "N", default_value_t = PICTURES)]
    pub pictures: usize,
    /// Number of threads [default: one per core]; the report does not depend on it
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
}

#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The run folder
    pub run: PathBuf,
    /// The format
    #[arg(
        long,
        value_parser = PossibleValuesParser::new(Format::ALL.map(|(name, _)| name))
            .try_map(|name: String| Format::from_name(&name).ok_or("a format expected"))
    )]
    pub format: Format,
    /// The file to write, or the folder for colmap [default: stdout]
    #[arg(long, value_name = "PATH")]
    pub out: Option<PathBuf>,
    /// Results of this method only, as the following
    #[arg(long, value_parser = method)]
    pub method: Option<Method>,
    /// Results of this fusion
    #[arg(long)]
    pub fusion: Option<Fusion>,
    /// Results with this uncertainty radius [m]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub radius: Option<f64>,
    /// Results with as many references asked for
    #[arg(long, value_name = "K")]
    pub references: Option<usize>,
    /// Results against this scene of references
    #[arg(long, value_name = "NAME")]
    pub scene: Option<String>,
}

#[derive(Debug, Args)]
pub struct SynthArgs {
    /// Where to write: DIR/CONDITION, or in the layout kitti DIR/sequences/CONDITION and
    /// DIR/poses/CONDITION.txt
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// The layout, by the name of the scene format that reads it. tum can say depths up to 13 m only,
    /// 7scenes up to 65 m; colmap has some of each scan's points
    #[arg(
        long,
        value_name = "NAME",
        default_value = LAYOUTS[0].name,
        value_parser = PossibleValuesParser::new(LAYOUTS.iter().map(|layout| layout.name))
    )]
    pub layout: String,
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

#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Where the frames are, as for `run`
    pub scene: String,
    /// The format of the scene, if its content does not tell
    #[arg(long, value_name = "NAME")]
    pub format: Option<String>,
    /// Write the cloud of a frame on its photo
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
    /// Save a recording of the frames that were compared, with their clouds in the world and on the photos
    #[arg(long, value_name = "FILE.rrd")]
    pub save: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct IndexArgs {
    /// Where the frames are, as for `run`
    pub scene: String,
    /// The format of the scene, if its content does not tell
    #[arg(long, value_name = "NAME")]
    pub format: Option<String>,
    /// Number of visual words
    #[arg(long, value_name = "N", default_value = "10000")]
    pub words: NonZeroUsize,
    /// Index every Nth frame only
    #[arg(long, value_name = "N", default_value = "1")]
    pub every: NonZeroUsize,
    /// Leave out a frame, or the queries of a run folder; repeatable. Where queries are of the same drive,
    /// an index with their own photos knows more of them than another drive would
    #[arg(long, value_name = "FRAME|RUN")]
    pub without: Vec<String>,
    /// The file to write [default: in the user's cache directory, where `run` finds it]
    #[arg(long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Seed of every random choice
    #[arg(long, default_value_t = 0)]
    pub seed: u64,
    /// Build it even if it is up to date, and replace whatever the file is
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Number of threads [default: one per core]; the index does not depend on it
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,
}

/// What a scene argument may be, format by format.
fn scene_formats() -> String {
    let formats = posescope::scene::ALL.iter();
    let lines = formats.map(|entry| format!("\n- {}: {}", entry.name, entry.about));
    format!(
        "Where the frames are; the content tells which of these it is, or --format:{}",
        lines.collect::<String>()
    )
}

/// What --degrade does, step by step.
fn degradations() -> String {
    let mut text = "Degrade the photos of queries before anybody sees them, as in gamma=0.4,noise=8,invert. \
                    References stay as they are. Whatever the order in which the steps are named, they are \
                    taken in this one:"
        .to_owned();
    for step in Degradation::default().steps() {
        let range = match step.domain {
            Domain::Flag => String::new(),
            domain => format!("={domain}"),
        };
        let unit = match step.about.unit {
            "" => String::new(),
            unit => format!(" [{unit}]"),
        };
        text += &format!("\n- {}{range}{unit}: {}", step.key, step.about.help());
    }
    text
}

fn share(text: &str) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|share: &f64| *share > 0.0 && *share <= 1.0)
        .ok_or_else(|| "a number above 0 and up to 1 expected".to_owned())
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
