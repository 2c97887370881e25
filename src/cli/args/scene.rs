//! The arguments of the commands on whole scenes: `doctor`, `survey`, `index` and `synth`.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use posescope::image::{Degradation, DegradationError};
use posescope::method::Method;
use posescope::scene::layout::LAYOUTS;
use posescope::scene::street::{Size, Street};
use posescope::survey::SurveyRequest;

use super::ConfigArgs;
use super::eval::plain_name;

#[derive(Debug, Args)]
pub struct SynthArgs {
    /// The folder to write to: DIR/CONDITION, or for the layout kitti DIR/sequences/CONDITION and
    /// DIR/poses/CONDITION.txt
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
    /// The layout, named after the scene format that reads it. tum stores depths up to 13 m only;
    /// colmap stores some of each scan's points
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
        value_parser = PossibleValuesParser::new(Size::ALL.map(Size::name))
            .try_map(|name: String| {
                Size::ALL.into_iter().find(|size| size.name() == name).ok_or("a size expected")
            })
    )]
    pub size: Size,
    /// Write only every Nth frame; frames keep their numbers, poses and times stay complete
    #[arg(long, value_name = "N", default_value = "1")]
    pub every: NonZeroUsize,
    /// Write only this traversal; repeatable
    #[arg(long, value_parser = PossibleValuesParser::new(Street::conditions()))]
    pub condition: Vec<String>,
    /// Write into a folder that is not empty and replace its sequences of the same name
    #[arg(long)]
    pub force: bool,
}

#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// The scenes, as for `run`
    #[arg(value_name = "SCENE", required = true)]
    pub scenes: Vec<String>,
    /// The format of the scenes [default: detected]
    #[arg(long, value_name = "NAME")]
    pub format: Option<String>,
    /// Save a picture of the cloud of a frame on its photo, and of the route
    #[arg(long, value_name = "FILE.png")]
    pub picture: Option<PathBuf>,
    /// Save a recording of the compared frames
    #[arg(long, value_name = "FILE.rrd")]
    pub save: Option<PathBuf>,
    /// Say instead how far the calibration between camera and scanner is off
    ///
    /// Puts the depth edges of up to 25 clouds on the edges of their photos, and prints turn, shift, focal length and
    /// delay with 90 % intervals. --picture shows the depth edges on a photo, as stated above and as found below, and a
    /// curve of the measure for each of the six values. The exit code is 3 if the calibration is off.
    #[arg(long, conflicts_with = "save")]
    pub calibration: bool,
    /// With --calibration: write the better calibration file
    ///
    /// It is the scene's own file with another place of the scanner: calib.txt of KITTI, calib_velo_to_cam.txt of KITTI
    /// raw, or scene.toml. The scene itself is not changed. Nothing is written if the calibration is consistent.
    #[arg(long, value_name = "FILE", requires = "calibration")]
    pub out: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub struct SurveyArgs {
    /// The scene, as for `run`
    pub scene: String,
    /// The methods; a hybrid stands for the two that it runs
    #[arg(long = "method", value_name = "fb,fb2,robust", value_delimiter = ',')]
    #[arg(value_parser = posescope::run::method, default_value = "fb,fb2,robust")]
    pub methods: Vec<Method>,
    /// Localise this many photos near a reference
    ///
    /// They are spread over the map. A fifth as many are localised from a reference that is far away, and as many
    /// mirrored.
    #[arg(long, value_name = "N", default_value_t = SurveyRequest::QUERIES)]
    #[arg(value_parser = clap::value_parser!(usize))]
    pub queries: usize,
    /// How far from the reference to search, in metres [default: as `run`]
    #[arg(long, value_name = "METRES", value_parser = posescope::run::positive)]
    pub radius: Option<f64>,
    /// Localise each photo by the nearest reference that is at least this far away, in metres
    ///
    /// [default: any reference within the radius]
    #[arg(long, value_name = "METRES", value_parser = posescope::run::positive)]
    pub spacing: Option<f64>,
    /// Localise the photos near a reference once more, degraded, for example exposure=-2,noise=8
    #[arg(long, value_name = "STEP=STRENGTH,…", default_value = "")]
    #[arg(value_parser = degradation, hide_default_value = true)]
    pub degrade: Degradation,
    /// The format of the scene [default: detected]
    #[arg(long, value_name = "NAME")]
    pub format: Option<String>,
    /// The folder of the survey [default: runs/SCENE-survey]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Continue the survey in the folder --out
    #[arg(long)]
    pub resume: bool,
    /// The seed of every random choice
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    #[command(flatten)]
    pub config: ConfigArgs,
}

/// A degradation, or none.
fn degradation(text: &str) -> Result<Degradation, DegradationError> {
    if text.is_empty() { Ok(Degradation::default()) } else { text.parse() }
}

impl SurveyArgs {
    /// What is surveyed.
    pub fn request(&self) -> SurveyRequest {
        let default = || Path::new("runs").join(format!("{}-survey", plain_name(&self.scene)));
        SurveyRequest {
            scene: self.scene.clone(),
            format: self.format.clone(),
            methods: self.methods.clone(),
            radius_m: self.radius,
            spacing_m: self.spacing,
            queries: self.queries,
            degrade: self.degrade,
            seed: self.seed,
            config: self.config.config.clone(),
            assignments: self.config.assignments.clone(),
            out: self.out.clone().unwrap_or_else(default),
        }
    }
}

#[derive(Debug, Args)]
pub struct IndexArgs {
    /// The scene, as for `run`
    pub scene: String,
    /// The format of the scene [default: detected]
    #[arg(long, value_name = "NAME")]
    pub format: Option<String>,
    /// Index only every Nth frame
    #[arg(long, value_name = "N", default_value = "1")]
    pub every: NonZeroUsize,
    /// Leave out a frame, or all queries of a run folder; repeatable
    ///
    /// Use this if queries and index come from the same drive; otherwise retrieval finds the query itself.
    #[arg(long, value_name = "FRAME|RUN")]
    pub without: Vec<String>,
    /// The file to write [default: in the user's cache directory, where `run` finds it]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// The seed of every random choice
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Build the index even if it is up to date, and overwrite any existing file
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub config: ConfigArgs,
}
