//! The command line of posescope, for the program and for the Python package.

mod args;
mod compare;
mod compute;
mod defaults;
mod demo;
mod doctor;
mod eval;
mod failure;
mod index;
mod interrupt;
mod lesson;
mod match_export;
mod observer;
mod opened;
#[cfg(feature = "app")]
mod opener;
mod output;
mod params;
mod results;
mod run;
#[cfg(feature = "app")]
mod screenshot;
mod stderr;
mod story;
mod surface;
mod survey;
mod synth;
mod table;
mod terminal;
#[cfg(test)]
mod tests;
#[cfg(feature = "app")]
mod view;

use std::ffi::OsString;
use std::num::NonZeroUsize;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use clap::{CommandFactory as _, FromArgMatches as _, Parser as _};

use args::{Arguments, Command, Everywhere};
use failure::CliError;
#[cfg(feature = "app")]
use opener::lesson_window;
use stderr::tell;

pub use compute::{Compute, ComputeError, with as with_compute};
pub use doctor::calibration::in_words as calibration_in_words;
pub use doctor::report as examination_in_words;

/// Parses the arguments, of which the first is the program's name, runs the command and prints an error in one
/// line. Returns the exit code.
pub fn run(arguments: Vec<OsString>) -> u8 {
    let parsed = args::definition()
        .try_get_matches_from(arguments)
        .and_then(|matches| Arguments::from_arg_matches(&matches));
    let arguments = match parsed {
        Ok(arguments) => arguments,
        Err(error) => return answered(&error),
    };
    failure::report_panics_in_one_line();
    let outcome = catch_unwind(AssertUnwindSafe(|| match &arguments.command {
        Some(Command::Open(words)) => dispatch(&opened_by(words, &arguments.everywhere)?),
        _ => dispatch(&arguments),
    }));
    match outcome {
        Ok(Ok(()) | Err(CliError::ReaderGone)) => failure::DONE,
        Ok(Err(CliError::Arguments(error))) => answered(&error),
        Ok(Err(error)) => {
            tell(&format!("posescope: {}", error.to_string().replace(['\n', '\r'], " ")));
            error.exit_code()
        }
        Err(_) => failure::INTERNAL,
    }
}

/// Prints the help that was asked for, or what is wrong with the arguments.
fn answered(error: &clap::Error) -> u8 {
    // A reader that is gone needs no answer.
    error.print().ok();
    if error.use_stderr() { failure::USAGE } else { failure::DONE }
}

fn dispatch(arguments: &Arguments) -> Result<(), CliError> {
    let everywhere = &arguments.everywhere;
    let terminal = terminal::Terminal::new(everywhere);
    use_threads(everywhere.threads)?;
    let scored =
        |command: &dyn Fn() -> Result<(), CliError>| compute::with(everywhere.compute, command);
    match &arguments.command {
        None => demo::demo(&terminal),
        Some(Command::Open(words)) => unreachable!("{words:?} are parsed already"),
        Some(Command::Run(args)) => scored(&|| match &args.surface {
            Some(path) => surface::surface(args, path, &terminal),
            None => run::run(args, &terminal),
        }),
        #[cfg(feature = "app")]
        Some(Command::View(args)) => scored(&|| match &args.screenshot.screenshot {
            Some(path) => screenshot::screenshot(args, path, &terminal),
            None => view::view(args, &terminal, opener::opener()),
        }),
        Some(Command::Lesson(args)) => lesson::lesson(args, &terminal, lesson_window),
        Some(Command::Eval(args)) => scored(&|| eval::eval(args, &terminal)),
        Some(Command::Results(args)) => results::results(args, &terminal),
        Some(Command::Compare(args)) => compare::compare(args, &terminal),
        Some(Command::Survey(args)) => scored(&|| survey::survey(args, &terminal)),
        Some(Command::Index(args)) => index::index(args, &terminal),
        Some(Command::Doctor(args)) => doctor::doctor(args, &terminal),
        Some(Command::Synth(args)) => synth::synth(args, &terminal),
        Some(Command::Params(params)) => params::print(params, &terminal),
        Some(Command::Completions { shell }) => {
            let mut command = Arguments::command();
            let mut script = Vec::new();
            clap_complete::generate(*shell, &mut command, "posescope", &mut script);
            output::print(&String::from_utf8_lossy(&script).trim_end())
        }
    }
}

/// `posescope SCENE` means `posescope view SCENE`. A word that is not a scene may be a misspelt command.
/// Options before it are kept.
fn opened_by(words: &[OsString], before: &Everywhere) -> Result<Arguments, CliError> {
    let name = words.first().map(|word| word.to_string_lossy());
    let name = name.unwrap_or_default();
    let is_built_in = name.split(':').next() == Some("street");
    if !is_built_in && !Path::new(name.as_ref()).exists() {
        return Err(CliError::Usage(no_command(&name)));
    }
    let line = ["posescope", "view"].map(OsString::from);
    Ok(Arguments::try_parse_from(line.into_iter().chain(before.words()).chain(words.to_vec()))?)
}

/// The error message for a word that is neither a command nor a scene.
fn no_command(name: &str) -> String {
    let command = Arguments::command();
    let commands = command.get_subcommands().filter(|command| !command.is_hide_set());
    let names: Vec<&str> = commands.map(clap::Command::get_name).collect();
    match posescope::text::similar(name, names.iter().copied()) {
        Some(known) => format!("`{name}` is not a command; did you mean `{known}`?"),
        None => format!(
            "`{name}` is not a command, file or folder; the commands are {}",
            names.join(", ")
        ),
    }
}

/// Limits parallel work to a number of threads.
fn use_threads(threads: Option<NonZeroUsize>) -> Result<(), CliError> {
    let Some(threads) = threads else {
        return Ok(());
    };
    // More threads than a few per core only slow each other down, and some systems do not even start them.
    let cores = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let most = (4 * cores).max(64);
    if threads.get() > most {
        return Err(CliError::Usage(format!(
            "--threads {threads}: at most {most} expected, for {cores} cores"
        )));
    }
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.get())
        .build_global()
        .map_err(|error| CliError::Usage(error.to_string()))
}

/// A program without the window records the lesson instead.
#[cfg(not(feature = "app"))]
fn lesson_window(
    opened: &posescope::lesson::Lesson,
    terminal: &terminal::Terminal,
) -> Result<(), CliError> {
    lesson::save_instead(opened, &"this posescope is built without the window", terminal)
}
