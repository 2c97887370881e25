//! The command line of posescope.

mod args;
mod choice;
mod compute;
mod demo;
mod demo_settings;
mod diff;
mod doctor;
#[cfg(test)]
mod documented;
mod eval;
mod event_export;
mod export;
mod failure;
mod failures;
mod index;
mod interrupt;
mod lesson;
mod manual;
mod match_export;
mod observer;
mod opened;
mod output;
mod overview;
mod params;
mod report;
mod run;
#[cfg(feature = "app")]
mod shot;
mod story;
mod surface;
mod synth;
mod table;
mod terminal;
mod triage;
#[cfg(feature = "app")]
mod view;

use std::process::ExitCode;

use clap::Parser as _;

use args::{Arguments, Command};
use failure::CliError;

/// Parses the arguments, runs the command, says what went wrong in one line.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    failure::report_panics_in_one_line();
    let outcome = std::panic::catch_unwind(|| dispatch(&arguments));
    match outcome {
        Ok(Ok(())) | Ok(Err(CliError::ReaderGone)) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            eprintln!("posescope: {error}");
            error.exit_code()
        }
        Err(_) => ExitCode::from(failure::INTERNAL),
    }
}

fn dispatch(arguments: &Arguments) -> Result<(), CliError> {
    let terminal = terminal::Terminal::new(&arguments.verbosity);
    match &arguments.command {
        None => demo::demo(&terminal),
        Some(Command::Run(args)) => {
            compute::with(args.task.protocol.compute, || run::run(args, &terminal))
        }
        #[cfg(feature = "app")]
        Some(Command::View(args)) => compute::with(args.task.protocol.compute, || {
            view::view(args, posescope::session::RunMode::Paused, &terminal)
        }),
        #[cfg(feature = "app")]
        Some(Command::Shot(args)) => compute::with(args.view_args.task.protocol.compute, || {
            shot::shot(args, &terminal)
        }),
        Some(Command::Lesson(args)) => lesson::lesson(args, &terminal),
        Some(Command::Eval(args)) => {
            compute::with(args.protocol.compute, || eval::eval(args, &terminal))
        }
        Some(Command::Diff(args)) => diff::diff(args, &terminal),
        Some(Command::Triage(args)) => triage::triage(args, &terminal),
        Some(Command::Report(args)) => report::report(args, &terminal),
        Some(Command::Export(args)) => export::run(args, &terminal),
        Some(Command::Index(args)) => index::index(args, &terminal),
        Some(Command::Overview(args)) => overview::overview(args, &terminal),
        Some(Command::Doctor(args)) => doctor::doctor(args, &terminal),
        Some(Command::Surface(args)) => compute::with(args.task.protocol.compute, || {
            surface::surface(args, &terminal)
        }),
        Some(Command::Synth(args)) => synth::synth(args, &terminal),
        Some(Command::Params(params)) => params::print(params, &terminal),
        Some(Command::Completions { shell }) => manual::completions(*shell),
        Some(Command::Man { folder }) => manual::pages(folder, &terminal),
    }
}
