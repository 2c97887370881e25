//! The map of every position with every heading: its progress and its lowest cost.

use egui::Ui;

use super::scale::number;
use super::search::Search;
use crate::app::{DenseAsk, DenseMap, ViewContext};
use crate::geometry::PoseError;
use crate::grid::{DenseSurface, MAX_CELLS};

/// The map to fill, if it is shown, for the present run.
pub(super) fn wanted(context: &ViewContext<'_>, search: &Search<'_>) -> Option<DenseAsk> {
    let is_wanted = context.options.shows_dense_map && context.is_present();
    Some(DenseAsk {
        method: search.method,
        reference: search.span.part.reference().filter(|_| is_wanted)?,
        least_covered: search.least_covered,
    })
}

/// The progress and the lowest cost; nothing where the map is off.
pub(super) fn ui(ui: &mut Ui, context: &ViewContext<'_>, search: &Search<'_>) {
    if !context.options.shows_dense_map {
        return;
    }
    if !context.is_present() {
        ui.weak("The dense map is filled for the present run, B, only");
        return;
    }
    let known = context.state.scoring.dense_map(search.method);
    ui.horizontal_wrapped(|ui| {
        match known.map(progress) {
            Some(Ok(words)) => ui.weak(words),
            Some(Err(words)) => ui.colored_label(ui.visuals().error_fg_color, words),
            None => ui.weak("starting"),
        };
        let surface = known.and_then(|map| map.surface.as_ref().ok());
        if let Some(words) = surface.and_then(|surface| lowest(context, search, surface)) {
            ui.label(words);
        }
    });
}

/// How much of the map is filled, or why it cannot be.
fn progress(map: &DenseMap) -> Result<String, String> {
    let surface = map.surface.as_ref().map_err(|error| {
        format!(
            "{:.0} positions are too many (at most {MAX_CELLS}). Raise surface.step",
            error.cells
        )
    })?;
    let (tried, all) = (surface.tried() as f64, surface.hypotheses() as f64);
    let seconds = map.took.as_secs_f64();
    Ok(if surface.is_complete() {
        format!("all {all} tried in {seconds:.1} s")
    } else {
        let left = seconds * (all - tried) / tried.max(1.0);
        format!("{:.0} % tried, {left:.0} s left", 100.0 * tried / all)
    })
}

/// The lowest cost of all hypotheses, and how far it is from the truth.
fn lowest(
    context: &ViewContext<'_>,
    search: &Search<'_>,
    surface: &DenseSurface,
) -> Option<String> {
    let (offset, score) = surface.minimum()?;
    let so_far = if surface.is_complete() { "" } else { " so far" };
    let mut words = format!("Lowest of all{so_far}: cost {}", number(score.cost?));
    if let Some(truth) = context.truth() {
        let error = PoseError::between(truth, &search.pose(&offset));
        let (distance, angle) = (context.in_unit(&error.translation()), error.rotation());
        words += &format!(", {distance} and {angle} from the truth");
    }
    Some(words)
}
