//! The arguments of the commands that read run folders: `results` and `compare`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use posescope::diagnosis::{Code, Tolerance};
use posescope::measure::{Condition, Field, Format, Order, Plot, TableName};

use crate::cli::failure::CliError;

#[derive(Debug, Args)]
pub struct ResultsArgs {
    /// The run folder
    pub run: PathBuf,
    /// Only results that meet this condition, for example "method = mi and code = D1"; --help lists the
    /// fields
    #[arg(long = "where", value_name = "CONDITION", long_help = conditions())]
    pub condition: Option<Condition>,
    /// Sort by a field; -FIELD puts the greatest first
    #[arg(long, value_name = "FIELD", allow_hyphen_values = true)]
    pub sort: Option<Order>,
    /// The fields to show [default: a few; all in files]
    #[arg(long, value_name = "FIELDS", value_delimiter = ',', value_parser = field)]
    pub columns: Vec<&'static Field>,
    /// Show at most N rows
    #[arg(long, value_name = "N")]
    pub rows: Option<usize>,
    /// The form: text, json, csv, markdown, latex, html, or poses as tum, kitti, colmap, vloc, ros
    ///
    /// json prints lines of results.jsonl, html writes the report, vloc is the format of visuallocalization.net,
    /// ros a PoseWithCovarianceStamped in YAML for each pose.
    #[arg(long = "as", value_name = "FORM", value_enum, default_value = "text")]
    pub form: Form,
    /// The table: rows, summary, verdicts, rivals, or paper:1 … paper:6
    #[arg(long, value_name = "TABLE", value_enum, default_value = "rows")]
    pub table: TableName,
    #[arg(long, value_name = "NAME", value_enum, conflicts_with = "form", help = plots())]
    pub plot: Option<Plot>,
    /// The file to write, or the folder for colmap [default: stdout]
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// The largest error of a right pose [default: as in the run]
    #[arg(long, value_name = "METRES,DEGREES")]
    pub right: Option<Tolerance>,
}

impl ResultsArgs {
    /// Refuses options that have no effect on what is asked for.
    pub fn refuse_unused(&self) -> Result<(), CliError> {
        let given = [
            ("--where", self.condition.is_some()),
            ("--sort", self.sort.is_some()),
            ("--rows", self.rows.is_some()),
            ("--columns", !self.columns.is_empty()),
            ("--table", self.table != TableName::Rows),
            ("--right", self.right.is_some()),
        ];
        let (asked, used): (&str, &[&str]) = match (self.plot, self.form) {
            (Some(_), _) => ("--plot", &["--right"]),
            (None, Form::Html) => ("--as html", &[]),
            (None, Form::Json) => ("--as json", &["--where", "--sort", "--rows", "--right"]),
            (None, form) if form.poses().is_some() => {
                ("an export of poses", &["--where", "--right"])
            }
            (None, _) if self.table != TableName::Rows => {
                ("a table of the whole run", &["--where", "--table", "--right"])
            }
            (None, _) => return Ok(()),
        };
        match given.iter().find(|(option, is_given)| *is_given && !used.contains(option)) {
            Some((option, _)) => {
                Err(CliError::Usage(format!("{option} has no effect on {asked}; leave it out")))
            }
            None => Ok(()),
        }
    }
}

#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The earlier run
    #[arg(value_name = "RUN_A")]
    pub before: PathBuf,
    /// The later run
    #[arg(value_name = "RUN_B")]
    pub after: PathBuf,
    /// Ignore changes of a pose's error up to this
    #[arg(long, value_name = "METRES,DEGREES", default_value = "0.1m,0.5deg")]
    pub tolerance: Tolerance,
    /// Write the report of RUN_B with its changes since RUN_A
    #[arg(long, value_name = "FILE.html")]
    pub html: Option<PathBuf>,
    /// Save a recording with both runs on the same timelines
    #[arg(long, value_name = "FILE.rrd")]
    pub save: Option<PathBuf>,
}

/// The form of results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Form {
    Text,
    Json,
    Csv,
    Markdown,
    Latex,
    Html,
    Tum,
    Kitti,
    Colmap,
    Vloc,
    Ros,
}

impl Form {
    /// The format of poses, if it is one.
    pub fn poses(self) -> Option<Format> {
        match self {
            Self::Tum => Some(Format::Tum),
            Self::Kitti => Some(Format::Kitti),
            Self::Colmap => Some(Format::Colmap),
            Self::Vloc => Some(Format::Vloc),
            Self::Ros => Some(Format::Ros),
            _ => None,
        }
    }
}

fn field(name: &str) -> Result<&'static Field, String> {
    Field::find(name).map_err(|error| error.to_string())
}

fn conditions() -> String {
    let fields = Field::ALL.iter();
    let fields = fields.map(|field| format!("\n- {}: {}", field.name, field.about()));
    let codes = Code::all().into_iter();
    let codes = codes.map(|code| format!("\n- {code}: {}", code.title()));
    format!(
        "Only results that meet this condition, for example \"method = mi and code = D1 and coverage < 0.1\".\n\n\
         Write FIELD RELATION VALUE, joined by and, or, not and parentheses. Relations: = != < <= > >=, and ~ \
          for text that contains the value. Fields:{}\n\nCodes:{}",
        fields.collect::<String>(),
        codes.collect::<String>()
    )
}

/// The help of `--plot`: every plot.
fn plots() -> String {
    let names = Plot::value_variants().iter().filter_map(ValueEnum::to_possible_value);
    let names: Vec<String> = names.map(|value| value.get_name().to_owned()).collect();
    let (last, first) = names.split_last().map_or(("", &[][..]), |(last, first)| (last, first));
    format!("Draw a figure as SVG: {} or {last}", first.join(", "))
}
