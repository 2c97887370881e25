//! The observer of the command line's queries: progress, recording, exports.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use posescope::event::{Event, KindSet};
use posescope::geometry::Pose;
use posescope::lesson::{LessonError, PageTurner, Results};
use posescope::localize::{LocalizeObserver, QueryResult, StageTimes};
use posescope::method::Method;
use posescope::problem::Problem;
use posescope::session::{Explaining, StopAtBreakpoint};
use posescope::sink::EventExport;
use posescope::sink::rerun::Recorder;
use posescope::trace::{Cancelled, Record, Sink};

use super::interrupt::Interrupt;
use super::match_export::MatchExport;
use super::stderr::{plain, tell};

/// From this number of candidates, an index is worth building.
const MANY: usize = 100;

/// Advances a progress bar with every finished method, and feeds recorder and exports.
pub struct CliObserver {
    pub recorder: Option<Recorder>,
    /// Writes matches if requested.
    pub export: Option<MatchExport>,
    /// The pages of a lesson, each recorded at its moment.
    pub pages: Option<PageTurner>,
    /// Writes events if requested.
    pub events: Option<EventExport>,
    /// Ends the run at a breakpoint, if one is set.
    pub stop: Option<StopAtBreakpoint>,
    /// The scene whose photos are compared one by one, if an index should be recommended for it.
    pub index_for: Option<String>,
    pub bar: indicatif::ProgressBar,
    interrupt: Interrupt,
    /// The open stages of the current method.
    stages: Vec<&'static str>,
    /// The start of the current explanation.
    explaining_since: Instant,
    problems: Vec<Problem>,
    /// The current problem.
    problem: usize,
}

impl CliObserver {
    pub fn new(bar: indicatif::ProgressBar, interrupt: Interrupt) -> Self {
        Self {
            recorder: None,
            export: None,
            pages: None,
            events: None,
            stop: None,
            index_for: None,
            interrupt,
            bar,
            stages: Vec::new(),
            explaining_since: Instant::now(),
            problems: Vec::new(),
            problem: 0,
        }
    }

    fn record(&mut self, record: impl FnOnce(&mut Recorder)) {
        if let Some(recorder) = &mut self.recorder {
            record(recorder);
        }
    }

    /// Turns the remaining pages of a lesson, which show the end of the run, and records all of them with the numbers
    /// of its results.
    pub fn show_pages(&mut self, results: &Results) -> Result<(), LessonError> {
        let (Some(pages), Some(recorder)) = (self.pages.take(), &mut self.recorder) else {
            return Ok(());
        };
        for _ in 0..pages.rest() {
            recorder.turn_page();
        }
        let (texts, is_filled) = pages.texts(results);
        recorder.show_pages(texts);
        is_filled
    }
}

impl Sink for CliObserver {
    fn wanted(&self) -> KindSet {
        if self.stop.is_some() || self.pages.is_some() || self.events.is_some() {
            return KindSet::ALL;
        }
        let recorder = self.recorder.as_ref();
        let recorded = recorder.map_or(KindSet::NONE, posescope::trace::Sink::wanted);
        match &self.export {
            Some(_) => recorded.union(MatchExport::wanted()),
            None => recorded,
        }
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        let problem = self.problems.get(self.problem);
        let is_stage = matches!(record.event, Event::StageStarted(_) | Event::StageEnded(_));
        match &record.event {
            Event::StageStarted(started) => {
                self.stages.push(started.stage.name());
                let names =
                    problem.map(|problem| (problem.query().name(), problem.reference().name()));
                let task = names.map(|(query, reference)| format!("{query} ← {reference}"));
                let path = self.stages.join(" › ");
                self.bar.set_message(plain(&format!("{} {path}", task.unwrap_or_default())));
            }
            Event::StageEnded(_) => drop(self.stages.pop()),
            _ => {}
        }
        match &mut self.recorder {
            Some(recorder) if is_stage || recorder.wanted().contains(record.event.kind()) => {
                recorder.accept(record)?;
            }
            _ => {}
        }
        if let (Some(pages), Some(recorder)) = (&mut self.pages, &mut self.recorder) {
            for _ in 0..pages.turn(record) {
                recorder.turn_page();
            }
        }
        if let (Some(export), Some(problem)) = (&mut self.export, problem) {
            export.accept(record, problem);
        }
        if let Some(events) = &mut self.events {
            events.lines.accept(record)?;
        }
        if let Some(stop) = &mut self.stop {
            stop.accept(record)?;
        }
        self.interrupt.check()
    }

    fn attend(&mut self) -> Result<(), Cancelled> {
        self.interrupt.check()
    }
}

impl LocalizeObserver for CliObserver {
    fn begin_query(&mut self, index: usize, problems: &[Problem], truth: Option<&Pose>) {
        self.problems = problems.to_vec();
        self.stages.clear();
        if let Some(events) = &mut self.events {
            events.lines.begin_query(index, problems, truth);
        }
        self.record(|recorder| recorder.begin_query(index, problems, truth));
    }

    fn choosing(&mut self, looked_at: usize, candidates: usize) {
        if candidates >= MANY
            && let Some(scene) = self.index_for.take()
        {
            tell(&format!(
                "Comparing the query with {candidates} photos. An index is faster: run `posescope index {scene}`, then use \
                 --reference retrieve:1"
            ));
        }
        self.bar.set_message("choosing references");
        self.bar.set_length(candidates as u64);
        self.bar.set_position(looked_at as u64);
    }

    fn begin_method(&mut self, problem: usize, method: Method) {
        self.stages.clear();
        self.problem = problem;
        if let Some(events) = &mut self.events {
            events.lines.begin_method(problem, method);
        }
        self.record(|recorder| recorder.begin_method(problem, method));
    }

    fn end_method(&mut self, result: &QueryResult, times: &StageTimes) {
        self.bar.inc(1);
        self.record(|recorder| recorder.end_method(result, times));
    }

    fn explaining(&mut self, result: &QueryResult, tried: usize, remedies: usize) {
        if tried == 0 {
            self.explaining_since = Instant::now();
        }
        let explaining =
            Explaining { method: result.method, tried, remedies, since: self.explaining_since };
        self.bar.set_message(plain(&format!("{} {explaining}", result.query)));
    }

    fn explained(&mut self, result: &QueryResult) {
        self.record(|recorder| recorder.explained(result));
    }

    fn begin_fusion(&mut self, method: Method) {
        self.problem = 0;
        if let Some(events) = &mut self.events {
            events.lines.begin_fusion(method);
        }
        self.record(|recorder| recorder.begin_fusion(method));
    }

    fn attention(&self) -> Option<Arc<AtomicBool>> {
        Some(self.interrupt.attention())
    }

    fn end_fusion(&mut self, result: &QueryResult) {
        self.record(|recorder| recorder.end_fusion(result));
    }
}
