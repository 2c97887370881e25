//! The arguments of `posescope eval`.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use posescope::measure::{Gate, KnownFailures};
use posescope::run::{FolderError, Judging, Preset, Shard, Sweep};

use super::{ConfigArgs, Given};

#[derive(Clone, Debug, Args)]
#[command(args_conflicts_with_subcommands = true)]
pub struct EvalArgs {
    #[command(subcommand)]
    pub command: Option<EvalCommand>,
    /// The scenes of the references, as for `run`; several are evaluated one after the other
    #[arg(value_name = "SCENE", required_unless_present = "rerun_failed")]
    pub scenes: Vec<String>,
    /// Only this query; repeatable
    #[arg(long, help_heading = "Queries", value_name = "FRAME")]
    pub query: Vec<String>,
    #[command(flatten)]
    pub protocol: Given,
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Repeat the run at each value of a parameter or of a --degrade step
    ///
    /// Each value gets its own folder below --out, and a table shows success and error over the values. For
    /// example gamma=0.2:1:0.1 or fb.ratio=0.5:0.9:0.05.
    #[arg(
        long,
        value_name = "PARAM=FROM:TO:STEP",
        conflicts_with_all = ["shard", "baseline", "rerun_failed", "events"]
    )]
    #[arg(help_heading = "Methods", hide_short_help = true)]
    pub sweep: Option<Sweep>,
    #[command(flatten)]
    pub judging: JudgingArgs,
    /// The run folder [default: below runs/, named after scenes and options]
    #[arg(long, help_heading = "Output", value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write every event as JSON, one object per line
    ///
    /// With --resume, events are appended to the file.
    #[arg(long, value_name = "FILE.jsonl")]
    #[arg(help_heading = "Output", hide_short_help = true)]
    pub events: Option<PathBuf>,
    /// Continue the run in the folder --out
    #[arg(long, help_heading = "Runs")]
    pub resume: bool,
    /// Run part I of N; `posescope eval merge` puts the parts together
    #[arg(long, value_name = "I/N")]
    #[arg(help_heading = "Runs", hide_short_help = true)]
    pub shard: Option<Shard>,
    /// Repeat the failed queries of RUN with other settings
    ///
    /// Prints what changed. Exit code 1 if a query broke.
    #[arg(
        long,
        value_name = "RUN",
        conflicts_with_all = ["scenes", "baseline", "query_scene", "preset", "limit"]
    )]
    #[arg(help_heading = "Runs")]
    pub rerun_failed: Option<PathBuf>,
}

#[derive(Clone, Debug, Subcommand)]
pub enum EvalCommand {
    /// Put the parts of a run together in one folder
    Merge(MergeArgs),
}

#[derive(Clone, Debug, Args)]
pub struct MergeArgs {
    /// The folders of all parts
    #[arg(value_name = "DIR", required = true)]
    pub parts: Vec<PathBuf>,
    /// The folder of the whole run
    #[arg(long, help_heading = "Output", value_name = "DIR", required = true)]
    pub out: PathBuf,
    #[command(flatten)]
    pub judging: JudgingArgs,
}

/// How a run is judged, and which of its failures are recorded.
#[derive(Clone, Debug, Args)]
pub struct JudgingArgs {
    /// Exit with code 1 unless this holds; repeatable
    ///
    /// "right@mi >= 0.9", "recall@0.5m,5deg@fb >= 0.8", "share(D3)@mi <= 0.05", "median(confidence)@fb >= 0.9",
    /// "median(time)@mi <= 2" [s], the paper's "success@mi >= 0.9".
    #[arg(long, help_heading = "Judging", value_name = "EXPR")]
    pub gate: Vec<Gate>,
    /// A list of failures that gates and --baseline ignore
    ///
    /// One entry per line, `QUERY METHOD` or `QUERY METHOD CODE`; # starts a comment. Entries that no longer fail
    /// are reported.
    #[arg(long, value_name = "FILE")]
    #[arg(help_heading = "Judging", hide_short_help = true)]
    pub known_failures: Option<PathBuf>,
    /// Exit with code 1 if a query fails that succeeded in this run
    #[arg(long, help_heading = "Runs", value_name = "RUN")]
    pub baseline: Option<PathBuf>,
    /// Keep recordings of the first N failures [default: 20; with --sweep 0]
    #[arg(long, value_name = "N")]
    #[arg(help_heading = "Output", hide_short_help = true)]
    pub keep_failures: Option<usize>,
}

impl EvalArgs {
    /// The run folder: `--out`, or a folder below `runs`, named after scenes and options.
    pub fn folder(&self, preset: Option<Preset>) -> PathBuf {
        if let Some(out) = &self.out {
            return out.clone();
        }
        let scenes: Vec<String> = self.scenes.iter().map(|scene| plain_name(scene)).collect();
        let mut name = scenes.join("-");
        if let Some(preset) = preset {
            name = format!("{name}-{preset}").to_lowercase();
        }
        if let Some(failed) = &self.rerun_failed {
            let run = failed.file_name().unwrap_or_default().to_string_lossy();
            name = format!("{run}-failed");
        }
        if let Some(sweep) = &self.sweep {
            name = format!("{name}-{}", sweep.key());
        }
        if let Some(shard) = self.shard {
            name = format!("{name}-{}-of-{}", shard.number, shard.of);
        }
        Path::new("runs").join(name)
    }
}

/// A scene's argument as the name of a folder. `.` and `..` have the names of their folders.
pub(super) fn plain_name(argument: &str) -> String {
    let path = Path::new(argument);
    let folder = path.canonicalize().ok().filter(|_| path.file_name().is_none());
    let own = folder.as_deref().and_then(Path::file_name).map(|name| name.to_string_lossy());
    let name = own.as_deref().unwrap_or(argument);
    let plain: String = name.chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    match plain.trim_matches('-') {
        "" => "scene".to_owned(),
        plain => plain.to_owned(),
    }
}

impl JudgingArgs {
    /// How a run is judged that repeats failed queries of another, or does not.
    ///
    /// # Errors
    /// A list of known failures that cannot be read.
    pub fn judging(&self, rerun_failed: Option<&Path>) -> Result<Judging, FolderError> {
        let known = self.known_failures.as_deref().map(KnownFailures::read).transpose()?;
        Ok(Judging {
            gates: self.gate.clone(),
            known: known.unwrap_or_default(),
            before: self.baseline.as_deref().or(rerun_failed).map(Path::to_owned),
            only_repeated: rerun_failed.is_some(),
        })
    }
}
