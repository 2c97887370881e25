//! `posescope lesson`: lessons in the window and as recordings.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use posescope::estimator;
use posescope::lesson::{Lesson, PageTurner, Results, named_scenes};
use posescope::method::Method;
use posescope::scene::Scene;
use posescope::session::Job;
use posescope::sink::rerun::{Identity, Recorder, Targets};
use posescope::table::Table;

use super::args::LessonArgs;
use super::defaults;
use super::failure::CliError;
use super::interrupt::Interrupt;
use super::observer::CliObserver;
use super::output;
use super::stderr::tell;
use super::terminal::Terminal;

/// Shows a lesson.
type Window = fn(&Lesson, &Terminal) -> Result<(), CliError>;

/// Lists the lessons, or starts one.
pub fn lesson(args: &LessonArgs, terminal: &Terminal, window: Window) -> Result<(), CliError> {
    let Some(name) = &args.name else {
        return list(terminal);
    };
    let lesson = Lesson::open(name)?;
    match &args.save {
        Some(path) => save(&lesson, path, terminal),
        None => window(&lesson, terminal),
    }
}

fn list(terminal: &Terminal) -> Result<(), CliError> {
    let header = ["lesson", "minutes", "title", "about"];
    let mut table = Table::with_notes(header, &[], 0);
    for lesson in Lesson::all()? {
        let minutes = lesson.minutes.to_string();
        table.push([lesson.name, minutes, lesson.title, lesson.about]);
    }
    output::print(&table.to_text(terminal.width()).trim_end())
}

/// What the first page of a lesson localises.
#[cfg(feature = "app")]
pub fn setup_of(lesson: &Lesson) -> Result<posescope::app::Setup, CliError> {
    let first = &lesson.pages[0].variant;
    let open = lesson.setting(first).open(&|_| None)?;
    Ok(posescope::app::Setup::of_lesson(open, defaults::FOLDER.into()))
}

/// Records a lesson in place of a window, and says why.
pub fn save_instead(
    lesson: &Lesson,
    why: &dyn std::fmt::Display,
    terminal: &Terminal,
) -> Result<(), CliError> {
    let folder = Path::new(defaults::FOLDER);
    std::fs::create_dir_all(folder).map_err(CliError::io(folder))?;
    let stem = Path::new(&lesson.name).file_stem().unwrap_or_default();
    let path = folder.join(stem).with_extension("rrd");
    tell(&format!("posescope: {why}; recording {} instead", path.display()));
    save(lesson, &path, terminal)
}

/// Localises the settings of the pages one after the other, and records runs and pages.
fn save(lesson: &Lesson, path: &Path, terminal: &Terminal) -> Result<(), CliError> {
    let interrupt = Interrupt::listen();
    let groups = lesson.groups();
    let mut scenes: BTreeMap<String, Arc<dyn Scene>> = BTreeMap::new();
    let mut jobs: Vec<Job> = Vec::new();
    for (variant, _) in &groups {
        let job = lesson.setting(variant).open(&|name| scenes.get(name).cloned())?;
        scenes.extend(named_scenes(&job.task, &job.references, &job.queries));
        jobs.push(job);
    }
    let recorder = recorder(lesson, &jobs, path)?;
    let bar = terminal.bar(jobs.iter().map(estimates).sum());
    let mut observer = CliObserver::new(bar.clone(), interrupt.clone());
    observer.recorder = Some(recorder);
    let mut outcome = Ok(());
    let mut results = Results::new();
    for (number, ((variant, pages), job)) in groups.iter().zip(jobs).enumerate() {
        observer.pages = Some(PageTurner::new(lesson, pages.clone()));
        let worked = job.work(number, &mut observer, |_| {}).map_err(CliError::from);
        let worked = worked.map(|found| drop(results.insert((*variant).to_owned(), found)));
        let shown = observer.show_pages(&results).map_err(CliError::from);
        outcome = worked.and(shown);
        if outcome.is_err() {
            break;
        }
    }
    bar.finish_and_clear();
    let is_interrupted = interrupt.is_raised();
    interrupt.release();
    observer.recorder.map_or(Ok(()), Recorder::close)?;
    if is_interrupted {
        let words = "the recording contains everything until then";
        return Err(CliError::Interrupted(words.to_owned()));
    }
    outcome?;
    terminal.say(|| format!("Recording: {0} (open it with `rerun {0}`)", path.display()));
    Ok(())
}

/// The expected number of results.
fn estimates(job: &Job) -> u64 {
    let references = job.chosen.frames.len().max(1);
    (references * job.task.protocol.methods.len()) as u64
}

fn recorder(lesson: &Lesson, jobs: &[Job], path: &Path) -> Result<Recorder, CliError> {
    let first = &jobs[0];
    let protocol = &first.task.protocol;
    let (references, queries) = (first.references.as_ref(), first.queries.as_ref());
    let identity = Identity {
        queries: vec![format!("lesson {}", lesson.name)],
        references: protocol.named_references().map(str::to_owned).collect(),
        ..Identity::of(references, queries, &first.task.params, protocol)
    };
    let requested = jobs.iter().flat_map(|job| &job.task.protocol.methods);
    // In the order in which the methods run.
    let methods: Vec<Method> =
        estimator::methods().filter(|method| requested.clone().any(|one| one == method)).collect();
    Ok(Recorder::open(&Targets::file(path), &identity, &methods)?.with_pages())
}
