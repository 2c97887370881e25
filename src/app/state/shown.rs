//! What is shown of the state: the run, the cursor in it, its results, with nothing in them that is hidden.

use std::rc::Rc;

use super::AppState;
use crate::app::run_pictures::RunPictures;
use crate::app::selection::{ResultRow, Wanted};
use crate::app::view_options::CompareMode;
use crate::diagnosis::Grade;
use crate::event::Stage;
use crate::localize::QueryResult;
use crate::measure::ConditionError;
use crate::method::Method;
use crate::session::{Part, Run, Span, StageBar};

impl AppState {
    /// Whether a part came to something that needs an explanation.
    pub(crate) fn needs_why(&self, part: Part) -> bool {
        let span = self.shown_run().span_of(part);
        let result = span.and_then(|span| self.outcome(span));
        result.is_some_and(|result| result.grade != Grade::Right)
    }

    /// Whether the run A is shown.
    pub(crate) fn is_showing_kept(&self) -> bool {
        self.kept.is_some() && self.options.compare_mode == CompareMode::Kept
    }

    /// The run that is shown: the present one, or A.
    pub(crate) fn shown_run(&self) -> &Run {
        match &self.kept {
            Some(kept) if self.is_showing_kept() => &kept.run,
            _ => self.run(),
        }
    }

    /// The cursor in the run that is shown.
    pub(crate) fn shown_cursor(&self) -> usize {
        match self.kept_cursor() {
            Some(cursor) if self.is_showing_kept() => cursor,
            _ => self.cursor(),
        }
    }

    /// The part of the run that is shown at the cursor.
    pub(crate) fn shown_span(&self) -> Option<&Span> {
        self.shown_run().span_at(self.shown_cursor())
    }

    /// The stage at the cursor that chooses what the canvas shows.
    pub(crate) fn shown_stage(&self) -> Option<Stage> {
        let (run, cursor) = (self.shown_run(), self.shown_cursor());
        let here = run.stages_at(cursor).last()?;
        let Stage::Estimator(_) = here.stage else {
            return Some(here.stage);
        };
        // Between the stages of a method its latest one is shown, at its end the one that gave the result.
        let inside = |bar: &&StageBar| {
            here.records.start <= bar.records.start && bar.records.start <= cursor
        };
        let mut inside = run.stages().iter().filter(inside).rev();
        let latest = inside.find(|bar| !matches!(bar.stage, Stage::Estimator(_)));
        latest.or(Some(here)).map(|bar| bar.stage)
    }

    /// The part that a method is judged by: its fused pose, else that of the selected reference, else its last.
    pub(crate) fn deciding_span(&self, method: Method) -> Option<&Span> {
        let run = self.shown_run();
        let reference = run.reference_at(self.shown_cursor());
        let own = || {
            let spans = run.spans().iter().filter(|span| self.is_finished_at_cursor(span));
            spans.filter(move |span| span.part.method() == Some(method) && span.result.is_some())
        };
        let fused = own().rfind(|span| span.part == Part::Fusion(method));
        let here = || own().find(|span| span.part == Part::Reference(method, reference));
        fused.or_else(here).or_else(|| own().next_back())
    }

    /// The result of a part with nothing in it that is hidden.
    pub(crate) fn shown_result(&self, span: &Span) -> Option<QueryResult> {
        Some(span.result.as_ref()?.shown(self.options.shows_truth))
    }

    /// The same, once the part has come to its end.
    pub(crate) fn outcome(&self, span: &Span) -> Option<QueryResult> {
        self.is_finished_at_cursor(span).then(|| self.shown_result(span)).flatten()
    }

    /// What an earlier run found for the method of a part, with nothing in it that is hidden.
    pub(crate) fn known_result(&self, part: Part) -> Option<QueryResult> {
        let known = self.results.get(&self.setup.query)?;
        let result = known.iter().rfind(|result| Some(result.method) == part.method())?;
        Some(result.shown(self.options.shows_truth))
    }

    /// The same result in the other run, with nothing in it that is hidden.
    pub(crate) fn other_result(&self, result: &QueryResult) -> Option<QueryResult> {
        let kept = self.kept.as_ref()?;
        let other = if self.is_showing_kept() { self.run() } else { &kept.run };
        let is_same = |other: &&QueryResult| {
            other.method == result.method
                && other.fusion == result.fusion
                && other.references == result.references
        };
        let found = other.results().find(is_same)?;
        Some(found.shown(self.options.shows_truth))
    }

    /// The results that are looked at, in the order of the queries: those that meet the condition that was typed,
    /// whose verdict became what was asked for.
    pub(crate) fn selected_results(&self) -> Result<Rc<[ResultRow]>, ConditionError> {
        let wanted = Wanted {
            condition: self.options.results_filter.clone(),
            change: self.options.verdict_change.clone(),
            only_changed: self.options.only_differences && self.results.has_before(),
        };
        self.results.select(wanted)
    }

    /// Whether a record is known at the cursor: in a lecture what comes later is not.
    pub(crate) fn has_begun(&self, record: usize) -> bool {
        !self.options.hides_future || record <= self.shown_cursor()
    }

    /// The pictures of the run that is shown.
    pub(in crate::app) fn shown_pictures(&self) -> &RunPictures {
        match &self.kept {
            Some(kept) if self.is_showing_kept() => &kept.pictures,
            _ => &self.pictures,
        }
    }

    /// Whether proofs are still being made.
    pub(crate) fn is_proving(&self) -> bool {
        self.shown_pictures().is_proving() || self.session.is_alive()
    }

    /// The stages right below a part of the run, those only that are known at the cursor.
    pub(crate) fn stages_of(&self, span: &Span) -> Vec<&StageBar> {
        let run = self.shown_run();
        let inside = |bar: &&StageBar| {
            span.records.contains(&bar.records.start) && self.has_begun(bar.records.start)
        };
        let inside: Vec<&StageBar> = run.stages().iter().filter(inside).collect();
        // Choosing and fusing are stages themselves.
        let depth = match span.part {
            Part::Reference(..) => 2,
            Part::Retrieval | Part::Fusion(_) => 1,
        };
        inside.into_iter().filter(|bar| bar.depth == depth).collect()
    }

    /// The last record of a stage of a part. What a part reports after its last stage belongs to that stage.
    pub(crate) fn stage_end(&self, span: &Span, bar: &StageBar) -> usize {
        let stages = self.stages_of(span);
        let is_last = stages.last().is_some_and(|last| last.records == bar.records);
        let end = if is_last && self.is_finished_at_cursor(span) {
            span.records.end
        } else {
            bar.records.end
        };
        end - 1
    }
}
