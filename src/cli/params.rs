//! `posescope params`: the table of parameters.

use posescope::params::Params;
use posescope::table::Table;

use super::args::ConfigArgs;
use super::failure::CliError;
use super::output;
use super::terminal::Terminal;

/// Prints all parameters, with the default of those that differ from it.
pub fn print(config: &ConfigArgs, terminal: &Terminal) -> Result<(), CliError> {
    let params = config.resolve()?;
    let header = ["parameter", "value", "unit", "range and meaning"];
    let mut table = Table::with_notes(header, &[], 0);
    for (row, default) in params.list().into_iter().zip(Params::default().list()) {
        let value = if row.value == default.value {
            row.value.to_string()
        } else {
            format!("{} (default {})", row.value, default.value)
        };
        let unit = row.about.unit.to_owned();
        let about = format!("{}. {}", row.domain, row.about.help());
        table.push([row.key, value, unit, about]);
    }
    output::print(&table.to_text(terminal.width()).trim_end())
}
