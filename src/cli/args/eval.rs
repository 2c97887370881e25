//! The arguments of `posescope eval`.

use std::path::PathBuf;

use clap::Args;
use posescope::measure::Gate;
use posescope::report::PICTURES;
use posescope::run::{Experiment, PaperProtocol, Protocol, Shard, Sweep};

use super::positive;
use super::protocol::{ProtocolArgs, share};

#[derive(Clone, Debug, Args)]
pub struct EvalArgs {
    /// Where the references are, as in `run`; several scenes are evaluated one after the other
    #[arg(value_name = "SCENE", required_unless_present_any = ["merge", "failed"])]
    pub scenes: Vec<String>,
    /// Take the queries from this scene in the same world frame; repeatable: every scene of
    /// references is paired with every one of queries
    #[arg(long, value_name = "SCENE")]
    pub queries: Vec<String>,
    /// One of the paper's experiments, which sets other defaults. single: one random reference within
    /// 10, 15, 20, 25 m, methods fb,pm,mi; multi: random:5 within 10 m, 1 to 5 of them with all
    /// fusions, methods fb,pm,mi; large: retrieve:5 within a prior of 200 m, RobotCar 50 m. All: a
    /// tenth of the frames as queries
    #[arg(long, value_name = "single|multi|large")]
    pub experiment: Option<Experiment>,
    /// The index that retrieve:K asks; repeatable, one per scene of references, in their order
    /// [default: where `posescope index` puts it]
    #[arg(long, value_name = "FILE")]
    pub index: Vec<PathBuf>,
    #[arg(
        long,
        value_name = "METRES",
        value_delimiter = ',',
        value_parser = positive,
        help = format!("Uncertainty radius; several are run one by one [m] [default: {}]", Protocol::RADIUS_M)
    )]
    pub radius: Vec<f64>,
    #[command(flatten)]
    pub protocol: ProtocolArgs,
    /// Draw this share of the frames as queries; the others are the references [default: 1, where
    /// every frame is a query of all others; experiments: 0.1]
    #[arg(long, value_name = "SHARE", value_parser = share)]
    pub queries_share: Option<f64>,
    /// At most as many queries, drawn by the seed
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub limit: Option<u32>,
    /// Only this one of the queries; repeatable
    #[arg(long, value_name = "FRAME")]
    pub only: Vec<String>,
    /// Hold the scenes to what the paper asked of this data set. kitti: a prior of 200 m in the
    /// experiment `large`, failures from 10 m; robotcar: 50 m and 20 m [default: by the scene]
    #[arg(long = "protocol", value_name = "kitti|robotcar")]
    pub paper: Option<PaperProtocol>,
    /// A pose as far off counts as a failure [m] [default: 10, RobotCar 20]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub failure_radius: Option<f64>,
    /// The run folder [default: below runs/, named after what is asked]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Go on with the run in the folder
    #[arg(long, conflicts_with = "merge")]
    pub resume: bool,
    /// Run one part of N; every query is in one of them
    #[arg(long, value_name = "I/N", conflicts_with = "merge")]
    pub shard: Option<Shard>,
    /// Instead of running: bring all parts of a run together in one folder
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with = "scenes", requires = "out")]
    pub merge: Vec<PathBuf>,
    /// Run the evaluation at each of these values of a parameter or of a step of --degrade, into a folder
    /// of its own below --out, and draw success and error over them: gamma=0.2:1:0.1,
    /// fb.ratio=0.5:0.9:0.05
    #[arg(
        long,
        value_name = "KEY=FROM:TO:STEP",
        conflicts_with_all = ["merge", "shard", "baseline", "failed"]
    )]
    pub sweep: Option<Sweep>,
    /// Run the queries that failed in this run, as it asked but for what is given here, such as --set; ends
    /// with what changed, and with exit code 1 if anything broke
    #[arg(
        long,
        value_name = "RUN",
        conflicts_with_all = [
            "scenes", "merge", "baseline", "queries", "experiment", "queries_share", "limit", "paper"
        ]
    )]
    pub failed: Option<PathBuf>,
    /// Exit with code 1 unless this holds, such as \"success@mi >= 0.9\", \"recall@0.5m,5deg@fb >= 0.8\",
    /// \"share(D3)@mi <= 0.05\", \"median(confidence)@fb >= 0.9\" or \"median(time)@mi <= 2\" [s]; repeatable
    #[arg(long, value_name = "CONDITION")]
    pub gate: Vec<Gate>,
    /// Failures that are known, which gates and --baseline leave out: `QUERY METHOD` or `QUERY METHOD CODE` a
    /// line, comments behind #; one that is right now is said
    #[arg(long, value_name = "FILE")]
    pub known_failures: Option<PathBuf>,
    /// Exit with code 1 if a query fails that succeeded in this run
    #[arg(long, value_name = "RUN")]
    pub baseline: Option<PathBuf>,
    /// Keep recordings of at most as many failures [default: 20; with --sweep 0]
    #[arg(long, value_name = "N")]
    pub max_recordings: Option<usize>,
    /// Draw matches and costs of at most as many failures in report.html [default: 24; with --sweep 0]
    #[arg(long, value_name = "N")]
    pub pictures: Option<usize>,
    /// Write every event as JSON, one object per line: all that was decided, for a notebook. --resume goes on
    /// behind what the file has
    #[arg(long, value_name = "FILE.jsonl", conflicts_with_all = ["merge", "sweep"])]
    pub events: Option<PathBuf>,
    /// Keep recordings of failures of at most this size together [MB]
    #[arg(long, value_name = "MB", default_value_t = 500)]
    pub max_recording_mb: u64,
}

impl EvalArgs {
    /// How many recordings of failures are kept.
    pub fn recordings(&self) -> usize {
        let default = if self.sweep.is_some() { 0 } else { 20 };
        self.max_recordings.unwrap_or(default)
    }

    /// How many failures have pictures in the report.
    pub fn pictures(&self) -> usize {
        let default = if self.sweep.is_some() { 0 } else { PICTURES };
        self.pictures.unwrap_or(default)
    }
}
