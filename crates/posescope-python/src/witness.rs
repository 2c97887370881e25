//! Observers of a run that is repeated to be looked at: its events as JSON.

use posescope::localize::{LocalizeObserver, QueryResult};
use posescope::sink::{SceneNames, write_event};
use posescope_core::event::KindSet;
use posescope_core::{Cancelled, Method, Pose, Problem, Record, Sink};

/// Collects every event as a line of JSON, as `--events` writes them.
#[derive(Default)]
pub struct EventLines {
    scenes: SceneNames,
    problems: Vec<Problem>,
    current: Option<(usize, Method)>,
    lines: Vec<u8>,
}

impl EventLines {
    /// For a run between these scenes.
    pub fn new(scenes: SceneNames) -> Self {
        Self { scenes, ..Self::default() }
    }

    /// All lines.
    pub fn into_text(self) -> String {
        String::from_utf8_lossy(&self.lines).into_owned()
    }
}

impl Sink for EventLines {
    fn wanted(&self) -> KindSet {
        KindSet::ALL
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        if let Some((problem, method)) = self.current
            && let Some(problem) = self.problems.get(problem)
        {
            // A vector takes all bytes.
            write_event(&mut self.lines, &self.scenes, problem, method, record).ok();
        }
        Ok(())
    }
}

impl LocalizeObserver for EventLines {
    fn begin_query(&mut self, _index: usize, problems: &[Problem], _truth: Option<&Pose>) {
        self.problems = problems.to_vec();
    }

    fn begin_method(&mut self, problem: usize, method: Method) {
        self.current = Some((problem, method));
    }

    fn begin_fusion(&mut self, method: Method) {
        self.current = Some((0, method));
    }

    fn end_fusion(&mut self, _result: &QueryResult) {
        self.current = None;
    }
}
