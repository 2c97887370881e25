//! What the window is opened on.

use std::ops::{Deref, DerefMut};
use std::path::PathBuf;

use crate::estimator;
use crate::event::Side;
use crate::localize::Selection;
use crate::method::Method;
use crate::session::{Job, RunMode};

/// What is run, and how the window begins.
#[derive(Clone)]
pub struct Setup {
    /// The query to begin with, its references, and what is asked of every query.
    pub job: Job,
    /// The queries that the list offers, as positions in their scene.
    pub offered: Vec<usize>,
    /// Whether it waits at the first step or runs.
    pub mode: RunMode,
    /// Where recordings, pictures and sessions are saved unless somebody names another place.
    pub folder: PathBuf,
}

impl Deref for Setup {
    type Target = Job;

    fn deref(&self) -> &Job {
        &self.job
    }
}

impl DerefMut for Setup {
    fn deref_mut(&mut self) -> &mut Job {
        &mut self.job
    }
}

impl Setup {
    /// What a lesson localises.
    pub fn of_lesson(job: Job, folder: PathBuf) -> Self {
        Self { offered: vec![job.query], job, mode: RunMode::Running, folder }
    }

    /// The methods whose cost can be looked at: those asked for that search one, those of the paper
    /// where there are none.
    pub fn direct_methods(&self) -> Vec<Method> {
        let direct = estimator::direct_methods(&self.task.protocol.methods);
        match direct.as_slice() {
            [] => vec![Method::PM, Method::MI],
            _ => direct,
        }
    }

    /// How the references of queries are chosen; `None` by hand.
    pub fn pick(&self) -> Option<Selection> {
        let protocol = &self.task.protocol;
        (!protocol.is_by_hand()).then(|| protocol.selection())
    }

    /// What the window is about, for its title.
    pub fn title(&self) -> String {
        let references = self.chosen.frames.iter();
        let references: Vec<String> =
            references.map(|&frame| self.label(Side::Reference, frame)).collect();
        let query = self.label(Side::Query, self.query);
        let from = if references.is_empty() {
            String::new()
        } else {
            format!(" ← {}", references.join(", "))
        };
        let scene = if self.queries.name() == self.references.name() {
            format!("{} ", self.task.scene)
        } else {
            String::new()
        };
        let degradation = self.task.protocol.degrade;
        let degraded =
            if degradation.is_none() { String::new() } else { format!(" ({degradation})") };
        format!("posescope: {scene}{query}{degraded}{from}")
    }
}
