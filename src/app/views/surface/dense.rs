//! The map of every position with every heading: its steps, its progress and its lowest cost.

use egui::{DragValue, Ui};

use super::scale::number;
use super::search::Search;
use crate::app::{Command, DenseAsk, DenseMap, ViewContext};
use crate::geometry::PoseError;
use crate::grid::{DenseSurface, MOST_CELLS};

/// How finely the map is filled, where the user chose.
#[derive(Default)]
pub(super) struct DenseSteps {
    step_m: Option<f64>,
    yaw_step_deg: Option<f64>,
}

/// Steps of positions that are offered \[m\].
const STEPS_M: std::ops::RangeInclusive<f64> = 0.02..=5.0;
/// Steps of headings that are offered \[°\].
const YAW_STEPS_DEG: std::ops::RangeInclusive<f64> = 0.05..=10.0;

impl DenseSteps {
    /// A tenth of a metre; more where the search reaches farther than ten metres.
    fn step_m(&self, search: &Search<'_>) -> f64 {
        let usual_m = (search.problem.uncertainty_radius_m / 100.0).clamp(0.1, *STEPS_M.end());
        self.step_m.unwrap_or(usual_m)
    }

    fn yaw_step_deg(&self) -> f64 {
        self.yaw_step_deg.unwrap_or(0.5)
    }

    /// The map to fill, if it is shown, for the present run.
    pub(super) fn wanted(
        &self,
        context: &ViewContext<'_>,
        search: &Search<'_>,
    ) -> Option<DenseAsk> {
        let is_wanted = context.options.shows_dense_map && context.is_present();
        let reference = search.span.part.reference().filter(|_| is_wanted)?;
        Some(DenseAsk {
            method: search.method,
            reference,
            step_m: self.step_m(search),
            yaw_step_deg: self.yaw_step_deg(),
            least_covered: search.least_covered,
        })
    }

    /// The steps, the progress, and the lowest cost; nothing where the map is off.
    pub(super) fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>, search: &Search<'_>) {
        if !context.options.shows_dense_map {
            return;
        }
        if !context.is_present() {
            ui.weak("The dense map is filled for the present run, B, only");
            return;
        }
        let known = context.dense_map(search.method);
        ui.horizontal_wrapped(|ui| {
            let (mut step_m, mut yaw_step_deg) = (self.step_m(search), self.yaw_step_deg());
            if step(ui, "Positions every", &mut step_m, STEPS_M, " m") {
                self.step_m = Some(step_m);
            }
            if step(ui, "headings every", &mut yaw_step_deg, YAW_STEPS_DEG, "°") {
                self.yaw_step_deg = Some(yaw_step_deg);
            }
            match known.map(progress) {
                Some(Ok(words)) => ui.weak(words),
                Some(Err(words)) => ui.colored_label(ui.visuals().error_fg_color, words),
                None => ui.weak("starting"),
            };
        });
        let surface = known.and_then(|map| map.surface().ok());
        if let Some(words) = surface.and_then(|surface| lowest(context, search, surface)) {
            ui.label(words);
        }
    }
}

/// A field for a step; whether it was changed.
fn step(
    ui: &mut Ui,
    name: &str,
    value: &mut f64,
    range: std::ops::RangeInclusive<f64>,
    suffix: &str,
) -> bool {
    let label = ui.label(name);
    let drag = DragValue::new(value)
        .range(range)
        .speed(0.01)
        .max_decimals(2)
        .suffix(suffix)
        // Each change empties the map, so wait until the number is complete.
        .update_while_editing(false);
    ui.add(drag).labelled_by(label.id).changed()
}

/// How much of the map is filled, or why it cannot be.
fn progress(map: &DenseMap) -> Result<String, String> {
    let surface = map.surface().map_err(|error| {
        format!(
            "{:.0} positions are too many (at most {MOST_CELLS}). Choose a larger step",
            error.cells
        )
    })?;
    let (tried, all) = (surface.tried() as f64, surface.hypotheses() as f64);
    let seconds = map.took().as_secs_f64();
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
        let (distance, angle) = (error.translation(), error.rotation());
        words += &format!(", {distance} and {angle} from the truth");
    }
    Some(words)
}

/// Shows or hides the map.
pub(super) fn switch(ui: &mut Ui, context: &ViewContext<'_>) {
    let mut shown = context.options.shows_dense_map;
    let help =
        "Score every position with every heading, and show the lowest cost at each position (F)";
    let switch = ui.toggle_value(&mut shown, "Dense").on_hover_text(help);
    if switch.clicked() {
        context.send(Command::ShowDenseMap);
    }
}
