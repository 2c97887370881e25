//! `posescope params`: the table of parameters.

use comfy_table::{ContentArrangement, Table, presets};
use posescope::params::Params;

use super::args::ConfigArgs;
use super::failure::CliError;
use super::output;

/// Prints all parameters; those that differ from their default are marked.
pub fn print(config: &ConfigArgs) -> Result<(), CliError> {
    let params = config.resolve()?;
    let mut table = Table::new();
    table
        .load_preset(presets::NOTHING)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_header(["parameter", "value", "unit", "range", "meaning"]);
    for (row, default) in params.list().into_iter().zip(Params::default().list()) {
        let value = if row.value == default.value {
            row.value.to_string()
        } else {
            format!("{} (default {})", row.value, default.value)
        };
        table.add_row([
            row.key,
            value,
            row.about.unit.to_owned(),
            row.domain.to_string(),
            row.about.help(),
        ]);
    }
    output::print(&table)
}
