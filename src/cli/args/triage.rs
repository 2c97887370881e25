//! The arguments of `posescope triage`.

use std::path::PathBuf;

use clap::Args;
use posescope::diagnosis::{Code, Tolerance};
use posescope::measure::{Condition, Field, Order};

#[derive(Debug, Args)]
pub struct TriageArgs {
    /// The run folder
    pub run: PathBuf,
    /// Only results that meet this, for example "method = mi and code = D1 and coverage < 0.1"
    #[arg(long = "where", value_name = "CONDITION", long_help = conditions())]
    pub condition: Option<Condition>,
    /// Sort by a field; -FIELD for the greatest first
    #[arg(long, value_name = "FIELD", allow_hyphen_values = true)]
    pub sort: Option<Order>,
    /// The fields to show
    #[arg(
        long,
        value_name = "FIELDS",
        value_delimiter = ',',
        value_parser = field,
        default_value = "query,reference,method,grade,error,rotation,code,probability"
    )]
    pub columns: Vec<&'static Field>,
    /// At most as many
    #[arg(long, value_name = "N")]
    pub limit: Option<usize>,
    /// What counts as right [default: as in the run]
    #[arg(long, value_name = "METRES,DEGREES")]
    pub right: Option<Tolerance>,
    /// Write the results as JSON instead, one object per line; - for stdout
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
}

fn field(name: &str) -> Result<&'static Field, String> {
    Field::find(name).map_err(|error| error.to_string())
}

fn conditions() -> String {
    let fields = Field::ALL.iter();
    let fields = fields.map(|field| format!("\n- {}: {}", field.name, field.about));
    let codes = Code::all().into_iter();
    let codes = codes.map(|code| format!("\n- {code}: {}", code.title()));
    format!(
        "Only results that meet this, for example \"method = mi and code = D1 and coverage < 0.1\".\n\n\
         FIELD RELATION VALUE, joined by and, or, not and parentheses. Relations: = != < <= > >=, and ~ \
         for words that contain others. Fields:{}\n\nCodes:{}",
        fields.collect::<String>(),
        codes.collect::<String>()
    )
}
