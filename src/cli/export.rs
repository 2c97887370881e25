//! `posescope export`: the poses and tables of a run for other programs.

use std::fs;

use posescope::localize::QueryResult;
use posescope::measure::{Export, ExportError, export};
use posescope::run::{FolderError, read_run};

use super::args::ExportArgs;
use super::failure::CliError;
use super::output;
use super::terminal::Terminal;

/// Runs the command.
pub fn run(args: &ExportArgs, terminal: &Terminal) -> Result<(), CliError> {
    let run = read_run(&args.run)?;
    let takes = |result: &QueryResult| {
        let setting = result.setting;
        let radius = setting.map(|setting| setting.radius_m);
        let references = setting.map(|setting| setting.references);
        args.method.is_none_or(|method| method == result.method)
            && (args.scene.as_ref()).is_none_or(|scene| *scene == result.scene)
            && (args.fusion.is_none() || args.fusion == result.fusion)
            && (args.radius.is_none() || args.radius == radius)
            && (args.references.is_none() || args.references == references)
    };
    let Export { files, left_out } = match export(&args.run, &run, args.format, &takes) {
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
