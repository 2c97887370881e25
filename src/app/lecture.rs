//! What a lecture shows above the views: the stage at the cursor in one sentence, and what it has just
//! told.

use egui::{RichText, Ui};

use super::state::AppState;
use super::theme;
use crate::event::Stage;
use crate::grid::Phase;
use crate::narration;
use crate::session::{Run, Span};

/// Size of the sentences \[points\].
const LARGE: f32 = 19.0;

pub(super) fn ui(ui: &mut Ui, state: &AppState) {
    let (run, cursor) = (state.run(), state.cursor());
    if state.options.lockstep.is_some() {
        let words = "Every method goes on by one step at a time, beside the others.";
        ui.label(RichText::new(words).size(LARGE));
        ui.weak("The . key goes on, the , key back, with Shift by fifty steps");
        return;
    }
    let Some(span) = run.span_at(cursor) else {
        ui.label(RichText::new("I takes the first step, Space runs to the end").size(LARGE));
        return;
    };
    let stage = run.stages_at(cursor).last().map(|bar| bar.stage);
    ui.horizontal_wrapped(|ui| {
        if let Some(method) = span.part.method() {
            let name = RichText::new(method.label())
                .color(theme::text(ui.visuals(), theme::method(method)));
            ui.label(name.size(LARGE).strong());
        }
        ui.label(RichText::new(stage.map_or("", about)).size(LARGE));
    });
    ui.label(RichText::new(told(run, span, cursor).unwrap_or_default()).weak());
}

/// The latest of what a part of a run has told; the future is not known yet.
pub(super) fn told(run: &Run, span: &Span, cursor: usize) -> Option<String> {
    let last = span.records.end.checked_sub(1)?.min(cursor);
    let told = run.records().get(span.records.start..=last)?;
    let mut latest = told.iter().rev();
    latest.find_map(|record| narration::sentence(&record.event))
}

/// What a stage does, for somebody who sees it for the first time.
fn about(stage: Stage) -> &'static str {
    match stage {
        Stage::Estimator(_) => "begins with two photos, one of which has a pose and a scan.",
        Stage::Retrieve => {
            "First it is guessed from the photos' looks which places could be the right one."
        }
        Stage::Detect => {
            "Points are found that one would find again from nearby, each with a description of its \
             surroundings."
        }
        Stage::Match => {
            "Each point of the query looks for its like in the reference; it keeps a match only if the \
             second best is clearly worse."
        }
        Stage::DepthLift => {
            "The scan gives matched points of the reference a depth, so they become points in space."
        }
        Stage::MatchGuided => {
            "With a first pose it is known where each point must be seen, so the search there may be more generous."
        }
        Stage::Consensus => {
            "Three matches give a pose, a fourth tells which; the pose that explains most matches wins."
        }
        Stage::Accept => "Would chance alone explain as many matches? Then there is no pose.",
        Stage::Color => "The scan takes its colours from the reference photo.",
        Stage::Search(Phase::PositionCoarse) => {
            "At each position of a coarse grid a synthetic view is drawn and compared with the query."
        }
        Stage::Search(Phase::PositionFine) => {
            "Around the cheapest position the grid becomes finer."
        }
        Stage::Search(Phase::YawCoarse) => {
            "At the cheapest position the camera is turned left and right."
        }
        Stage::Search(Phase::YawFine) => "Around the cheapest direction the steps become finer.",
        Stage::Descend => {
            "From the reference it walks downhill, first over blurred photos, then over sharper ones."
        }
        Stage::SearchCoarse => {
            "Smaller copies of the photos have wider basins: they are searched first."
        }
        Stage::RefinePlane => "The best coarse minima walk downhill in position and direction.",
        Stage::RefineSix => "Now height, pitch and roll may change too.",
        Stage::Judge => "The poses of several methods are held against one cost.",
        Stage::Assess => {
            "What is the minimum worth? It is compared with its rivals and with shuffled pixels."
        }
        Stage::Fuse => "The poses that the references gave are made one.",
    }
}
