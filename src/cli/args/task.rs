//! The arguments of what localises a query: `run` and `view`.

use std::path::PathBuf;

use clap::Args;
use posescope::run::Protocol;
use posescope::scene::CameraArgument;
use posescope::session::{Breakpoint, Task};

use super::{ConfigArgs, Given};
use crate::cli::failure::CliError;

#[derive(Debug, Args)]
pub struct RunArgs {
    /// The scene of the references: street, street:night, a folder; --help lists the formats
    #[arg(long_help = scene_formats())]
    pub scene: String,
    /// The frame to localise, or a photo; repeatable
    ///
    /// 3823 finds the frame 003823. A photo is a file that is no frame of the scene.
    #[arg(long, value_name = "FRAME|PHOTO", required_unless_present = "all")]
    #[arg(help_heading = "Queries")]
    pub query: Vec<String>,
    /// Localise every frame
    #[arg(long, help_heading = "Queries", conflicts_with_all = ["query", "camera"])]
    pub all: bool,
    #[command(flatten)]
    pub task: TaskArgs,
    #[command(flatten)]
    pub recording: RecordingArgs,
    /// Write the results as JSON, one object per line; - for stdout
    #[arg(long, help_heading = "Output", value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write every event as JSON, one object per line
    #[arg(long, value_name = "FILE.jsonl")]
    #[arg(help_heading = "Output", hide_short_help = true)]
    pub events: Option<PathBuf>,
    /// Write the matches of fb into this folder, in the form that --matches reads
    #[arg(long, value_name = "DIR")]
    #[arg(help_heading = "Output", hide_short_help = true)]
    pub export_matches: Option<PathBuf>,
    /// Only score a dense grid and write its costs, as a picture or a table
    ///
    /// Every position and heading (surface.step, surface.yaw_step) of one query, reference and method; written is
    /// the lowest cost at each position.
    #[arg(
        long,
        value_name = "FILE.png|FILE.csv",
        conflicts_with_all = ["all", "json", "events", "export_matches", "save", "connect", "spawn", "breakpoints"]
    )]
    #[arg(help_heading = "Output")]
    pub surface: Option<PathBuf>,
}

#[cfg(feature = "app")]
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// The scene of the references, or the folder of a run; see `posescope run --help`
    #[arg(default_value = "street", value_name = "SCENE|RUN")]
    pub scene: String,
    /// The frame to begin with, or a photo that is no frame of the scene
    #[arg(long, help_heading = "Queries", value_name = "FRAME|PHOTO")]
    pub query: Option<String>,
    /// Compare the results of the run with those of this one
    #[arg(long, help_heading = "Runs", value_name = "RUN")]
    pub before: Option<PathBuf>,
    #[command(flatten)]
    pub task: TaskArgs,
    #[command(flatten)]
    pub screenshot: super::ScreenshotArgs,
}

/// What is asked of a query, in the window or without one.
#[derive(Debug, Args)]
pub struct TaskArgs {
    /// The camera of a photo [default: from EXIF]
    ///
    /// Focal lengths and centre [px], a camera line of COLMAP, or its cameras.txt.
    #[arg(
        long,
        value_name = "fx,fy,cx,cy",
        requires = "query",
        conflicts_with = "query_scene"
    )]
    #[arg(help_heading = "Queries", hide_short_help = true)]
    pub camera: Option<CameraArgument>,
    #[command(flatten)]
    pub protocol: Given,
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Stop at a stage (fb.ransac) or where a number crosses a bound (inliers < 10); repeatable
    #[arg(long = "break", value_name = "EXPR")]
    #[arg(help_heading = "Runs", hide_short_help = true)]
    pub breakpoints: Vec<Breakpoint>,
}

/// Options of a protocol that only a run over many queries has.
const ONLY_EVAL: [(&str, &str); 3] = [
    ("limit", "--limit"),
    ("preset", "--preset"),
    ("failure_radius_m", "--failure-radius"),
];

impl TaskArgs {
    /// What is asked of the queries of a scene.
    pub fn task(&self, scene: &str) -> Result<Task, CliError> {
        self.refuse_many_queries()?;
        let protocol = self.protocol.over(Protocol::default())?;
        let several = [
            ("--radius", protocol.radii_m.len()),
            ("--query-scene", protocol.query_scene.len()),
            ("--index", protocol.index.len()),
        ];
        if let Some((option, _)) = several.iter().find(|(_, given)| *given > 1) {
            return Err(CliError::Usage(format!(
                "{option} takes one value here; `posescope eval` takes several"
            )));
        }
        Ok(Task {
            protocol,
            params: self.config.resolve()?,
            breakpoints: self.breakpoints.clone(),
            ..Task::of(scene)
        })
    }

    /// Refuses options that would change nothing here.
    pub fn refuse_many_queries(&self) -> Result<(), CliError> {
        match ONLY_EVAL.iter().find(|(field, _)| self.protocol.has(field)) {
            Some((_, option)) => Err(CliError::Usage(format!(
                "{option} is an option of `posescope eval`"
            ))),
            None => Ok(()),
        }
    }
}

/// Where the recording goes: Rerun's own options, which can be combined.
#[derive(Debug, Default, Args)]
pub struct RecordingArgs {
    /// Save a Rerun recording
    #[arg(long, help_heading = "Output", value_name = "FILE.rrd")]
    pub save: Option<PathBuf>,
    /// Send the recording to a running Rerun viewer [default URL: the local viewer]
    #[arg(
        long,
        value_name = "URL",
        num_args = 0..=1,
        default_missing_value = ""
    )]
    #[arg(help_heading = "Output", hide_short_help = true)]
    pub connect: Option<String>,
    /// Start a Rerun viewer and send the recording to it
    #[arg(long, help_heading = "Output", hide_short_help = true)]
    pub spawn: bool,
}

/// What a scene argument may be, format by format.
fn scene_formats() -> String {
    let formats = posescope::scene::ALL.iter();
    let lines = formats.map(|entry| format!("\n- {}: {}", entry.name, entry.about));
    format!(
        "The scene of the references. Its format is recognised from its content, or --format names it:{}",
        lines.collect::<String>()
    )
}
