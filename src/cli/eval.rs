//! `posescope eval`: localises many queries into a run folder.

mod ending;
mod one;
mod sweep;

use posescope::measure::StoredSummary;
use posescope::run::{
    Judgement, Protocol, RunFile, append_step_summary, failed_queries, merge, publish, step_summary,
};
use posescope::sink::{KEPT_FAILURES, merge_failures};

use self::ending::ending;
use self::one::{Evaluated, evaluate};
pub use self::one::{User, resuming};
use super::args::{EvalArgs, EvalCommand, MergeArgs};
use super::compare::shown;
use super::failure::CliError;
use super::output;
use super::terminal::Terminal;

pub fn eval(args: &EvalArgs, terminal: &Terminal) -> Result<(), CliError> {
    if let Some(EvalCommand::Merge(args)) = &args.command {
        return merge_parts(args, terminal);
    }
    let preset = args.protocol.over(Protocol::default())?.preset;
    let judging = args.judging.judging(args.rerun_failed.as_deref())?;
    if let Some(before) = &args.rerun_failed
        && failed_queries(before)?.is_empty()
    {
        terminal.say(|| format!("No query failed in {}", before.display()));
        return Ok(());
    }
    let folder = args.folder(preset);
    if let Some(sweep) = &args.sweep {
        return sweep::sweep(args, sweep, &judging, &folder, terminal);
    }
    let evaluated = evaluate(args, None, &judging, &folder, terminal)?;
    finish(&evaluated, terminal)
}

/// Puts the parts of a run together.
fn merge_parts(args: &MergeArgs, terminal: &Terminal) -> Result<(), CliError> {
    let judging = args.judging.judging(None)?;
    let run = merge(&args.parts, &args.out)?;
    let kept = args.judging.keep_failures.unwrap_or(KEPT_FAILURES);
    merge_failures(&args.parts, &args.out, kept, &run)?;
    let examined = StoredSummary::examined_in(&args.parts)?;
    let judgement = Judgement::of(&args.out, &run, &judging, |_| examined)?;
    finish(&Evaluated { folder: args.out.clone(), run, judgement }, terminal)
}

/// Publishes and prints a judgement, and fails if the run is not good enough.
fn finish(evaluated: &Evaluated, terminal: &Terminal) -> Result<(), CliError> {
    let Evaluated { folder, run, judgement } = evaluated;
    let published = publish(folder, judgement);
    append_step_summary(&step_summary(run, folder, judgement));
    if !terminal.is_quiet {
        print(run, folder, judgement, terminal)?;
    }
    published?;
    good_unless(judgement.report.unread.as_slice(), &judgement.failures)
}

fn print(
    run: &RunFile,
    folder: &std::path::Path,
    judgement: &Judgement,
    terminal: &Terminal,
) -> Result<(), CliError> {
    let width = terminal.width();
    output::print(&ending(run, &judgement.report, folder, width).trim_end())?;
    match &judgement.comparison {
        Some(comparison) => output::print(&shown(comparison, width).trim_end()),
        None => Ok(()),
    }
}

/// An error if there are failures, or queries whose files cannot be read.
fn good_unless(unread: &[String], failures: &[String]) -> Result<(), CliError> {
    if let Some(unread) = unread.first() {
        let more: String = failures.iter().map(|failure| format!("; {failure}")).collect();
        return Err(CliError::Unusable(format!(
            "{unread}; replace the file and continue with --resume{more}"
        )));
    }
    if failures.is_empty() {
        return Ok(());
    }
    Err(CliError::NotGoodEnough(failures.join("; ")))
}
