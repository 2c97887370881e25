//! `posescope export`: the poses and tables of a run for other programs.

use std::fs;

use posescope::measure::{Export, ExportError, ResultChoice, export};
use posescope::run::{FolderError, read_run};

use super::args::ExportArgs;
use super::failure::CliError;
use super::output;
use super::terminal::Terminal;

/// Runs the command.
pub fn run(args: &ExportArgs, terminal: &Terminal) -> Result<(), CliError> {
    let run = read_run(&args.run)?;
    let choice = ResultChoice {
        method: args.method,
        fusion: args.fusion,
        radius_m: args.radius,
        references: args.references,
        scene: args.scene.clone(),
    };
    let Export { files, left_out } = match export(&args.run, &run, args.format, &choice) {
        Ok(export) => export,
        Err(ExportError::Folder(error)) => return Err(error.into()),
        Err(error) => return Err(CliError::Usage(error.to_string())),
    };
    match (files.as_slice(), &args.out) {
        ([only], None) => output::print(&only.text.trim_end_matches('\n'))?,
        ([only], Some(path)) => {
            fs::write(path, &only.text).map_err(FolderError::io(path))?;
        }
        (_, None) => {
            let names: Vec<&str> = files.iter().map(|file| file.name).collect();
            return Err(CliError::Usage(format!(
                "this format has several files ({}); name a folder with --out",
                names.join(", ")
            )));
        }
        (files, Some(folder)) => {
            fs::create_dir_all(folder).map_err(FolderError::io(folder))?;
            for file in files {
                let path = folder.join(file.name);
                fs::write(&path, &file.text).map_err(FolderError::io(path))?;
            }
        }
    }
    if left_out > 0 && !terminal.is_quiet() {
        eprintln!("{left_out} queries without a pose are left out");
    }
    Ok(())
}
