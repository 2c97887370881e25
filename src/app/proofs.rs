//! The pictures that prove what became of each method, made beside the window's thread.

use std::collections::HashMap;
use std::sync::Arc;

use super::worker::Worker;
use crate::geometry::Pose;
use crate::localize::QueryResult;
use crate::params::Params;
use crate::problem::Problem;
use crate::proof::{self, ProofCase, ProofPicture};
use crate::session::{Part, Run};
use crate::trace::Record;

/// The proofs of the present run.
pub(super) struct Proofs {
    worker: Worker<Question, (Part, Option<ProofPicture>)>,
    /// What was asked: `None` while the picture is made, or where nothing can be drawn.
    known: HashMap<Part, Option<Arc<ProofPicture>>>,
    shows_truth: bool,
}

struct Question {
    part: Part,
    problem: Problem,
    records: Vec<Record>,
    result: QueryResult,
    truth: Option<Pose>,
    params: Arc<Params>,
}

impl Proofs {
    pub(super) fn new(ctx: egui::Context) -> Self {
        let worker = Worker::new("proofs", ctx, |question: Question| {
            let picture = ProofPicture::of(&ProofCase {
                problem: &question.problem,
                records: &question.records,
                result: &question.result,
                truth: question.truth.as_ref(),
                params: &question.params,
            });
            (question.part, picture)
        });
        Self { worker, known: HashMap::new(), shows_truth: true }
    }

    /// Drops everything: the run is another one.
    pub(super) fn forget(&mut self) {
        self.worker.forget();
        self.known.clear();
    }

    /// Takes in the pictures that are ready, and asks for that of each part that has a result.
    pub(super) fn update(&mut self, run: &Run, params: &Arc<Params>, shows_truth: bool) {
        if shows_truth != self.shows_truth {
            self.forget();
            self.shows_truth = shows_truth;
        }
        for (part, picture) in self.worker.poll().into_iter().flatten() {
            self.known.insert(part, picture.map(Arc::new));
        }
        let Some(loaded) = run.loaded.as_deref() else {
            return;
        };
        for span in run.spans() {
            let Some(result) = &span.result else { continue };
            if self.known.contains_key(&span.part) {
                continue;
            }
            let Some(problem) = loaded.problems.get(span.part.reference().unwrap_or(0)) else {
                continue;
            };
            // The ranking of the references belongs to no method, and proves that the right one was not found.
            let ranking = run.span_of(Part::Retrieval).map(|span| span.records.clone());
            let records = ranking.into_iter().chain([span.records.clone()]);
            let records = records.flat_map(|records| &run.records()[records]);
            let records = records.filter(|record| proof::KINDS.contains(record.event.kind()));
            self.known.insert(span.part, None);
            self.worker.ask(Question {
                part: span.part,
                problem: problem.clone(),
                records: records.cloned().collect(),
                result: result.shown(shows_truth),
                truth: loaded.truth.filter(|_| shows_truth),
                params: Arc::clone(params),
            });
        }
    }

    /// The picture of a part, once it is made.
    pub(super) fn of(&self, part: Part) -> Option<&Arc<ProofPicture>> {
        self.known.get(&part)?.as_ref()
    }

    /// Whether pictures are still being made.
    pub(super) fn is_busy(&self) -> bool {
        self.worker.is_busy()
    }
}
