//! The pictures of a run that are made beside the window's thread: a small one for each stage, a proof for each result.

use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use egui::{TextureHandle, TextureOptions};

use super::thumbnails::{Drawn, is_drawn};
use super::worker::Answers;
use crate::geometry::Pose;
use crate::localize::QueryResult;
use crate::params::Params;
use crate::problem::Problem;
use crate::proof::{self, ProofCase, ProofPicture};
use crate::session::{Part, Run};
use crate::trace::Record;

/// The pictures of one run.
pub(super) struct RunPictures {
    stages: RefCell<Stages>,
    /// `None` where nothing can be drawn.
    proofs: Answers<Part, Question, Option<Arc<ProofPicture>>>,
    shows_truth: bool,
}

/// The small pictures, by the record that each shows.
struct Stages {
    pictures: Answers<usize, Drawn, TextureHandle>,
    /// The record that shows a range of records best.
    shows: HashMap<(usize, usize), Option<usize>>,
}

/// What a proof is made from.
struct Question {
    problem: Problem,
    records: Vec<Record>,
    result: QueryResult,
    truth: Option<Pose>,
    params: Params,
}

impl RunPictures {
    pub(super) fn new(ctx: &egui::Context) -> Self {
        let painter = ctx.clone();
        let pictures = Answers::new("stages", ctx.clone(), move |_: &usize, drawn: Drawn| {
            let image = drawn.picture();
            // A few cells of a map stay squares.
            let is_map = image.size[0] < 64;
            let options = if is_map { TextureOptions::NEAREST } else { TextureOptions::LINEAR };
            painter.load_texture("stage", image, options)
        });
        let proofs = Answers::new("proofs", ctx.clone(), |_: &Part, question: Question| {
            let picture = ProofPicture::of(&ProofCase {
                problem: &question.problem,
                records: &question.records,
                result: &question.result,
                truth: question.truth.as_ref(),
                params: &question.params,
            });
            picture.map(Arc::new)
        });
        let stages = RefCell::new(Stages { pictures, shows: HashMap::new() });
        Self { stages, proofs, shows_truth: true }
    }

    /// Takes in what is ready, and asks for the proof of each part that has a result.
    pub(super) fn update(&mut self, run: &Run, shows_truth: bool) {
        self.stages.get_mut().pictures.poll();
        if shows_truth != self.shows_truth {
            self.proofs.forget();
            self.shows_truth = shows_truth;
        }
        self.proofs.poll();
        let Some(loaded) = run.loaded.as_deref() else {
            return;
        };
        for span in run.spans() {
            let Some(result) = &span.result else { continue };
            self.proofs.ask(span.part, || {
                let problem = match span.part.reference() {
                    Some(reference) => loaded.problems.get(reference)?,
                    None => proof::problem_of(result, &loaded.problems)?,
                };
                // The ranking of the references belongs to no method, and proves that the right one was not found.
                let ranking = run.span_of(Part::Retrieval).map(|span| span.records.clone());
                let records = ranking.into_iter().chain([span.records.clone()]);
                let records = records.flat_map(|records| &run.records()[records]);
                let records = records.filter(|record| proof::KINDS.contains(record.event.kind()));
                Some(Question {
                    problem: problem.clone(),
                    records: records.cloned().collect(),
                    result: result.shown(shows_truth),
                    truth: loaded.truth.filter(|_| shows_truth),
                    params: run.params.clone(),
                })
            });
        }
    }

    /// Drops everything: the run is another one.
    pub(super) fn forget(&mut self) {
        let stages = self.stages.get_mut();
        stages.pictures.forget();
        stages.shows.clear();
        self.proofs.forget();
    }

    /// The picture of a stage: of the last record in it, or before it in its part, that can be drawn. Asking for it
    /// has it made.
    pub(super) fn stage(
        &self,
        run: &Run,
        part: &Range<usize>,
        stage: &Range<usize>,
    ) -> Option<TextureHandle> {
        let Stages { pictures, shows } = &mut *self.stages.borrow_mut();
        let shown = *shows.entry((part.start, stage.end)).or_insert_with(|| {
            let records = &run.records()[part.start..stage.end];
            let last = records.iter().rposition(|record| is_drawn(&record.event))?;
            Some(part.start + last)
        });
        let record = shown?;
        pictures.ask(record, || Drawn::of(run, part.start, record));
        pictures.get(&record).cloned()
    }

    /// The proof of a part's result, once it is made.
    pub(super) fn proof(&self, part: Part) -> Option<&Arc<ProofPicture>> {
        self.proofs.get(&part)?.as_ref()
    }

    /// Whether proofs are being made.
    pub(super) fn is_proving(&self) -> bool {
        self.proofs.is_busy()
    }

    /// Whether any picture is being made.
    pub(super) fn is_busy(&self) -> bool {
        self.is_proving() || self.stages.borrow().pictures.is_busy()
    }
}
