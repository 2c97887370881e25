//! The bar of a lecture: the stage at the cursor in one sentence, and the latest decision.

use egui::{Align, Button, Layout, RichText, Ui};

use super::action;
use super::command::Queue;
use super::frame::storyboard::part_name;
use super::state::AppState;
use super::theme;
use crate::event::Stage;
use crate::grid::Phase;
use crate::narration;
use crate::session::{Run, Span};

/// Size of the sentence, and of the one below it \[points\].
const LARGE: f32 = 24.0;
const SMALL: f32 = 17.0;
/// Width of the count of stages, and of the buttons \[points\].
const COUNT: f32 = 120.0;
const BUTTONS: f32 = 130.0;

pub(super) fn ui(ui: &mut Ui, state: &AppState, commands: &Queue) {
    let (run, cursor) = (state.shown_run(), state.shown_cursor());
    ui.horizontal_centered(|ui| {
        let span = state.shown_span();
        let stages = span.map_or(Vec::new(), |span| state.stages_of(span));
        let place = stages.iter().position(|bar| bar.records.contains(&cursor));
        let size = egui::vec2(COUNT, ui.available_height());
        ui.allocate_ui_with_layout(size, Layout::top_down(Align::Min), |ui| {
            ui.set_min_width(COUNT);
            ui.add_space(size.y / 2.0 - 24.0);
            if let Some(span) = span {
                let method = span.part.method();
                let color = method.map_or(ui.visuals().text_color(), theme::method);
                let color = theme::text(ui.visuals(), color);
                ui.label(RichText::new(part_name(span.part)).size(15.0).color(color).strong());
            }
            if let Some(place) = place {
                ui.weak(format!("stage {}", place + 1));
            }
        });
        let size = egui::vec2(ui.available_width() - BUTTONS, ui.available_height());
        ui.allocate_ui_with_layout(size, Layout::top_down(Align::Min), |ui| {
            ui.set_min_width(size.x);
            let (first, second) = sentences(state, run, span, cursor);
            ui.add_space(size.y / 2.0 - 34.0);
            let color = ui.visuals().strong_text_color();
            ui.add(egui::Label::new(RichText::new(first).size(LARGE).color(color)).wrap());
            ui.add(egui::Label::new(RichText::new(second).size(SMALL).weak()).truncate());
        });
        let texts = match state.options.lockstep {
            Some(_) => ["All methods one step back", "All methods one step on"],
            None => ["Previous stage", "Next stage"],
        };
        for (name, action) in ["◀", "▶"].into_iter().zip(texts.into_iter().filter_map(action::of))
        {
            let button = ui.add_sized([52.0, 34.0], Button::new(name));
            if button.on_hover_text(action.tooltip(ui.ctx())).clicked() {
                commands.send(action.run);
            }
        }
    });
}

fn sentences(state: &AppState, run: &Run, span: Option<&Span>, cursor: usize) -> (String, String) {
    if state.options.lockstep.is_some() {
        return (
            "Every method goes on by one step at a time, beside the others.".to_owned(),
            "The . key goes on, the , key back, with Shift by fifty steps.".to_owned(),
        );
    }
    let Some(span) = span else {
        return ("I takes the first step, Space runs to the end.".to_owned(), String::new());
    };
    let stage = run.stages_at(cursor).last().map(|bar| bar.stage);
    let first = stage.map_or("", about).to_owned();
    (first, latest(run, span, cursor).unwrap_or_default())
}

/// The latest decision of a part of a run, in words.
pub(super) fn latest(run: &Run, span: &Span, cursor: usize) -> Option<String> {
    let last = span.records.end.checked_sub(1)?.min(cursor);
    let records = run.records().get(span.records.start..=last)?;
    let mut latest = records.iter().rev();
    latest.find_map(|record| narration::sentence(&record.event))
}

/// What a stage does, for someone who sees it for the first time.
fn about(stage: Stage) -> &'static str {
    match stage {
        Stage::Estimator(_) => "The method begins with two photos. One has a pose and a scan.",
        Stage::Retrieve => "The photos' looks suggest which places could be the right one.",
        Stage::Detect => "It finds points that stand out, and describes the surroundings of each.",
        Stage::Match => {
            "Each query point looks for its like in the reference and keeps only a clear winner."
        }
        Stage::DepthLift => {
            "The scan gives matched points a depth, so they become points in space."
        }
        Stage::MatchGuided => {
            "A first pose says where each point must be seen, so it may match more freely."
        }
        Stage::Consensus => {
            "Three matches give a pose, a fourth tells which; the pose with most support wins."
        }
        Stage::Accept => "Would chance alone explain as many matches? Then there is no pose.",
        Stage::Color => "The scan takes its colours from the reference photo.",
        Stage::Search(Phase::PositionCoarse) => {
            "It renders the map at each position of a coarse grid and compares it with the query."
        }
        Stage::Search(Phase::PositionFine) => {
            "Around the position of lowest cost the grid becomes finer."
        }
        Stage::Search(Phase::YawCoarse) => {
            "At the position of lowest cost the camera turns left and right."
        }
        Stage::Search(Phase::YawFine) => {
            "Around the heading of lowest cost the steps become finer."
        }
        Stage::Descend => {
            "From the reference it goes downhill, first over blurred photos, then over sharper ones."
        }
        Stage::SearchCoarse => {
            "Smaller copies of the photos have wider basins, so it searches them first."
        }
        Stage::RefinePlane => "The best coarse minima go downhill in position and heading.",
        Stage::RefineSix => "Now height, pitch and roll may change too.",
        Stage::Judge => "One cost compares the poses of several methods.",
        Stage::Assess => {
            "How good is the minimum? It is compared with its rivals and with shuffled pixels."
        }
        Stage::Fuse => "The poses from all references become one.",
        _ => stage.name(),
    }
}
