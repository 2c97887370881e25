//! What shells and `man` know of posescope, made from its arguments.

use std::path::Path;

use clap::CommandFactory as _;
use clap_complete::Shell;

use super::args::Arguments;
use super::failure::CliError;
use super::output;
use super::terminal::Terminal;

/// Prints what makes a shell complete the arguments.
pub fn completions(shell: Shell) -> Result<(), CliError> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Arguments::command(), "posescope", &mut script);
    output::print(&String::from_utf8_lossy(&script).trim_end())
}

/// Writes a page for posescope and one for each command.
pub fn pages(folder: &Path, terminal: &Terminal) -> Result<(), CliError> {
    std::fs::create_dir_all(folder).map_err(CliError::io(folder))?;
    clap_mangen::generate_to(Arguments::command(), folder).map_err(CliError::io(folder))?;
    if !terminal.is_quiet() {
        eprintln!("Manual: {}", folder.display());
    }
    Ok(())
}
