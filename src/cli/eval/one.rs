//! One evaluation: planned, run and judged.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use indicatif::ProgressBar;
use posescope::run::{
    Evaluation, EvaluationRequest, Judgement, Judging, Plan, Protocol, ProtocolError, RunError,
    RunFile, RunFolder, Sweep, examine, frame_pairs_line, survey_line,
};
use posescope::session::command_line;
use posescope::sink::{EventExport, Follower, KEPT_FAILURES, RunRecords};
use posescope::trace::Cancelled;

use crate::cli::args::EvalArgs;
use crate::cli::failure::CliError;
use crate::cli::interrupt::Interrupt;
use crate::cli::opened;
use crate::cli::stderr::plain;
use crate::cli::terminal::Terminal;

/// A run that is complete and judged.
pub struct Evaluated {
    pub folder: PathBuf,
    pub run: RunFile,
    pub judgement: Judgement,
}

/// Evaluates at one value of a sweep, or without a sweep.
pub fn evaluate(
    args: &EvalArgs,
    swept: Option<(&Sweep, &str)>,
    judging: &Judging,
    folder: &Path,
    terminal: &Terminal,
) -> Result<Evaluated, CliError> {
    let plan = plan(args, swept, judging, folder)?;
    let Plan { run, params, .. } = &plan;
    if let Some(line) = opened::size_line(&plan.size, &run.protocol, params) {
        terminal.say(|| line);
    }
    if let Some(file) = &plan.survey {
        terminal.say(|| survey_line(file));
    } else if let Some(pairs) = &plan.params.frame_pairs {
        terminal.say(|| frame_pairs_line(&run.scenes.join(" "), pairs));
    }
    let first = plan.scenes.references.first().filter(|scene| !scene.frames().is_empty());
    let camera = first.map(|scene| scene.intrinsics(0));
    let misfit = |camera| opened::misfit(&plan.size, &run.protocol, params, &camera);
    if let Some(warning) = camera.and_then(misfit) {
        log::warn!("{warning}");
    }
    let events = args.events.as_deref().map(EventExport::after).transpose()?;
    let mut run_folder =
        if args.resume { RunFolder::resume(folder, run)? } else { RunFolder::create(folder, run)? };
    if let Some(events) = events.as_ref().filter(|_| !args.resume) {
        events.clear()?;
    }
    let queries = run.items().count();
    let bar = terminal.bar(queries as u64);
    bar.set_position((run_folder.done() - run_folder.unread().len()) as u64);
    let mut user = User { bar, interrupt: Interrupt::listen() };
    let kept = if swept.is_some() { 0 } else { KEPT_FAILURES };
    let kept = args.judging.keep_failures.unwrap_or(kept);
    let mut records = RunRecords::new(kept, &run_folder, &plan, events, &mut user)?;
    let outcome = Evaluation::run(&plan, &mut run_folder, &mut records);
    let closed = records.close();
    user.bar.finish_and_clear();
    if matches!(outcome, Err(RunError::Cancelled(_))) && user.interrupt.is_raised() {
        return Err(CliError::Interrupted(format!(
            "{} of {queries} queries done; continue with: {}",
            run_folder.done(),
            resuming()
        )));
    }
    outcome?;
    closed?;
    let judgement = Judgement::of(folder, run, judging, |rows| examine(run, &plan.scenes, rows))?;
    Ok(Evaluated { folder: folder.to_owned(), run: plan.run, judgement })
}

/// The plan that the arguments ask for.
fn plan(
    args: &EvalArgs,
    swept: Option<(&Sweep, &str)>,
    judging: &Judging,
    folder: &Path,
) -> Result<Plan, CliError> {
    let mut assignments = args.config.assignments.clone();
    assignments.extend(swept.and_then(|(sweep, value)| sweep.assignment(value)));
    let protocol = |defaults: Protocol| {
        let mut protocol = args.protocol.over(defaults)?;
        if let Some((sweep, value)) = swept {
            let degraded = sweep.degrade(value, &mut protocol.degrade);
            degraded.map_err(|error| ProtocolError::Option(error.to_string()))?;
        }
        Ok(protocol)
    };
    Ok(Plan::of(&EvaluationRequest {
        pairs: &BTreeMap::new(),
        scenes: &args.scenes,
        queries: &args.query,
        protocol: &protocol,
        config: args.config.config.as_deref(),
        assignments: &assignments,
        shard: args.shard,
        rerun_failed: args.rerun_failed.as_deref(),
        judging,
        is_survey: false,
        folder,
        events: args.events.as_deref(),
    })?)
}

/// The command line that continues this run.
pub fn resuming() -> String {
    let words = std::env::args_os().skip(1);
    let mut words: Vec<String> = words.map(|word| word.to_string_lossy().into_owned()).collect();
    if !words.iter().any(|word| word == "--resume") {
        words.push("--resume".to_owned());
    }
    command_line(&words)
}

/// The user before the terminal, who sees a progress bar and presses Ctrl-C.
pub struct User {
    pub bar: ProgressBar,
    pub interrupt: Interrupt,
}

impl Follower for User {
    fn done(&mut self, query: &str) {
        self.bar.set_message(plain(query));
        self.bar.inc(1);
    }

    fn check(&self) -> Result<(), Cancelled> {
        self.interrupt.check()
    }

    fn attention(&self) -> Arc<AtomicBool> {
        self.interrupt.attention()
    }
}
