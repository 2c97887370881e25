//! The arguments of what localises: `run` and `view`, and what they ask of a query.

use std::path::PathBuf;

use clap::Args;
use posescope::run::Protocol;
use posescope::scene::CameraArgument;
use posescope::session::{Breakpoint, Task};

use super::positive;
use super::protocol::ProtocolArgs;
use crate::cli::failure::CliError;

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

#[cfg(feature = "app")]
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// Where the frames are, or the folder of a run; see `posescope run --help`
    #[arg(default_value = "street", value_name = "SCENE|RUN")]
    pub scene: String,
    /// The frame to begin with, or a photo that is no frame of any scene
    #[arg(long, value_name = "FRAME|PHOTO")]
    pub query: Option<String>,
    /// Hold the results of the run against those of this one: what became of each verdict
    #[arg(long, value_name = "RUN")]
    pub before: Option<PathBuf>,
    #[command(flatten)]
    pub task: TaskArgs,
}

#[cfg(feature = "app")]
impl ViewArgs {
    /// The window of the bare command.
    pub fn demo() -> Self {
        Self {
            scene: crate::cli::demo_settings::settings().scene.clone(),
            query: None,
            before: None,
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
    /// [default: 15; of a run its own]
    #[arg(long, value_name = "METRES", value_parser = positive)]
    pub radius: Option<f64>,
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
            radius_m: self.radius.unwrap_or(Protocol::RADIUS_M),
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
            radius: None,
            protocol: ProtocolArgs::default(),
            breakpoints: Vec::new(),
        }
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
