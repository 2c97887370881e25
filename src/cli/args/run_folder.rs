//! The arguments of what reads run folders: `diff`, `report` and `export`.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use posescope::fusion::Fusion;
use posescope::measure::{Format, RunComparison};
use posescope::method::Method;
use posescope::report::PICTURES;

use super::positive;
use super::protocol::method;

#[derive(Debug, Args)]
pub struct DiffArgs {
    /// The run folder to compare with
    #[arg(value_name = "RUN_A")]
    pub before: PathBuf,
    /// The run folder that may be better or worse
    #[arg(value_name = "RUN_B")]
    pub after: PathBuf,
    /// Changes of the translation error up to this are none [m]
    #[arg(long, value_name = "METRES", default_value_t = RunComparison::TOLERANCE.translation_m)]
    pub tolerance_m: f64,
    /// Changes of the rotation error up to this are none [°]
    #[arg(long, value_name = "DEGREES", default_value_t = RunComparison::TOLERANCE.rotation_deg)]
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
