//! The arguments of the commands that localise a query: `run` and `view`.

use std::path::PathBuf;

use clap::{Args, Parser as _};
use posescope::params::Params;
use posescope::run::Protocol;
use posescope::scene::{CameraArgument, SceneSize};
use posescope::session::{Breakpoint, Task};

use super::{Arguments, Command, ConfigArgs, Given};
use crate::cli::failure::CliError;

#[derive(Debug, Args)]
pub struct RunArgs {
    /// The scene of the references: street, street:night, a folder; --help lists the formats
    #[arg(long_help = scene_formats())]
    pub scene: String,
    /// The frame to localise, or a photo; repeatable
    ///
    /// 3823 finds the frame 003823. A photo is an image file that is not a frame of the scene.
    #[arg(long, value_name = "FRAME|PHOTO", help_heading = "Queries")]
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
    /// Write the matches of fb into this folder, in the format that --matches reads
    #[arg(long, value_name = "DIR")]
    #[arg(help_heading = "Output", hide_short_help = true)]
    pub export_matches: Option<PathBuf>,
    /// Score a dense grid and write its costs as a picture or a table, without localising
    ///
    /// Scores every position and heading (surface.step, surface.yaw_step) for one query, reference and method, and
    /// writes the lowest cost at each position.
    #[arg(
        long,
        value_name = "FILE.png|FILE.csv",
        conflicts_with_all = ["all", "json", "events", "export_matches", "save", "connect", "spawn", "breakpoints"]
    )]
    #[arg(help_heading = "Output")]
    pub surface: Option<PathBuf>,
}

impl RunArgs {
    /// The arguments of a command line that begins with `posescope run`.
    pub fn parse(words: impl IntoIterator<Item = String>) -> Result<Box<Self>, CliError> {
        match Arguments::try_parse_from(words).map(|parsed| parsed.command) {
            Ok(Some(Command::Run(args))) => Ok(args),
            Ok(_) => unreachable!("the words begin with `run`"),
            Err(error) => Err(CliError::Usage(error.to_string())),
        }
    }
}

#[cfg(feature = "app")]
impl ViewArgs {
    /// The arguments of a command line that begins with `posescope view`.
    pub fn parse(words: impl IntoIterator<Item = String>) -> Result<Box<Self>, CliError> {
        match Arguments::try_parse_from(words).map(|parsed| parsed.command) {
            Ok(Some(Command::View(args))) => Ok(args),
            Ok(_) => unreachable!("the words begin with `view`"),
            Err(error) => Err(CliError::Usage(error.to_string())),
        }
    }
}

#[cfg(feature = "app")]
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// The scene of the references, or the folder of a run; see `posescope run --help`
    #[arg(default_value = "street", value_name = "SCENE|RUN")]
    pub scene: String,
    /// The frame to start with, or a photo that is not a frame of the scene
    #[arg(long, help_heading = "Queries", value_name = "FRAME|PHOTO")]
    pub query: Option<String>,
    /// Compare the results of RUN with those of this run
    #[arg(long, help_heading = "Runs", value_name = "RUN")]
    pub before: Option<PathBuf>,
    #[command(flatten)]
    pub task: TaskArgs,
    #[command(flatten)]
    pub screenshot: super::ScreenshotArgs,
}

/// How a query is localised, in the window or without it.
#[derive(Debug, Args)]
pub struct TaskArgs {
    /// The camera of a photo [default: from EXIF]
    ///
    /// Focal lengths and principal point [px], with OpenCV's k1,k2,p1,p2,k3,k4,k5,k6 if the lens distorts; a camera line
    /// of COLMAP; its cameras.txt; or hloc's list of queries with intrinsics.
    #[arg(long, value_name = "fx,fy,cx,cy", requires = "query", conflicts_with = "query_scene")]
    #[arg(help_heading = "Queries", hide_short_help = true)]
    pub camera: Option<CameraArgument>,
    #[command(flatten)]
    pub protocol: Given,
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Stop at a stage (fb.ransac) or when a number crosses a limit (inliers < 10); repeatable
    #[arg(long = "break", value_name = "EXPR")]
    #[arg(help_heading = "Runs", hide_short_help = true)]
    pub breakpoints: Vec<Breakpoint>,
}

/// Options of a protocol that only `eval` takes.
const ONLY_EVAL: [(&str, &str); 3] =
    [("limit", "--limit"), ("preset", "--preset"), ("failure_radius_m", "--failure-radius")];

impl TaskArgs {
    /// The task that these arguments describe for a scene of this size.
    pub fn task(&self, scene: &str, size: &SceneSize) -> Result<Task, CliError> {
        self.refuse_many_queries()?;
        let protocol = self.protocol.over(Protocol::default().at_size(size))?;
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
            params: self.config.over(Params::at_scale(size.scale))?,
            breakpoints: self.breakpoints.clone(),
            ..Task::of(scene)
        })
    }

    /// Refuses options that have no effect here.
    pub fn refuse_many_queries(&self) -> Result<(), CliError> {
        match ONLY_EVAL.iter().find(|(field, _)| self.protocol.has(field)) {
            Some((_, option)) => Err(CliError::Usage(format!(
                "{option} has no effect here; use it with `posescope eval`"
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

/// The help of the scene argument: every format.
fn scene_formats() -> String {
    let formats = posescope::scene::ALL.iter();
    let lines = formats.map(|entry| format!("\n- {}: {}", entry.name, entry.about));
    format!(
        "The scene of the references. Its format is detected; --format overrides it:{}",
        lines.collect::<String>()
    )
}
