//! The map of every position with every heading: its steps, its progress, and how the search compares
//! with it.

use egui::{DragValue, Ui};

use super::scale::{LEAST_DIFFERENCE, number};
use super::search::Search;
use crate::app::{Command, DenseAsk, DenseMap, ViewContext};
use crate::geometry::{Pose, PoseError};
use crate::grid::{DenseSurface, MOST_CELLS};
use crate::method::Method;

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

    /// The steps, the progress, and how the search compares.
    pub(super) fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>, search: &Search<'_>) {
        if !context.options.shows_dense_map {
            return;
        }
        if !context.is_present() {
            ui.weak("The dense map is filled for the present run, B, only");
            return;
        }
        ui.horizontal_wrapped(|ui| {
            let mut number = |name: &str, value: &mut f64, range, suffix: &str| {
                let label = ui.label(name);
                let drag = DragValue::new(value)
                    .range(range)
                    .speed(0.01)
                    .max_decimals(2)
                    .suffix(suffix)
                    // Each change empties the map, so wait until the number is complete.
                    .update_while_editing(false);
                ui.add(drag).labelled_by(label.id).changed()
            };
            let (mut step_m, mut yaw_step_deg) = (self.step_m(search), self.yaw_step_deg());
            if number("Positions every", &mut step_m, STEPS_M, " m") {
                self.step_m = Some(step_m);
            }
            if number("headings every", &mut yaw_step_deg, YAW_STEPS_DEG, "°") {
                self.yaw_step_deg = Some(yaw_step_deg);
            }
            match known(context, search.method) {
                Some(map) => progress(ui, map),
                None => {
                    ui.weak("starting");
                }
            }
        });
        if let Some(map) = known(context, search.method)
            && let Ok(surface) = map.surface()
            && let Some(words) = compared(context, search, surface)
        {
            ui.label(words);
        }
    }
}

/// The map of a method, where there is one.
fn known<'a>(context: &ViewContext<'a>, method: Method) -> Option<&'a DenseMap> {
    context.dense_map(method)
}

/// How much of the map is filled.
fn progress(ui: &mut Ui, map: &DenseMap) {
    let surface = match map.surface() {
        Ok(surface) => surface,
        Err(error) => {
            let words = format!(
                "{:.0} positions are too many (at most {MOST_CELLS}). Choose a larger step",
                error.cells
            );
            ui.colored_label(ui.visuals().error_fg_color, words);
            return;
        }
    };
    let (tried, all, seconds) = (
        surface.tried(),
        surface.hypotheses(),
        map.took().as_secs_f64(),
    );
    let rate = tried as f64 / seconds.max(1e-9);
    if surface.is_complete() {
        ui.weak(format!("all {} tried in {seconds:.1} s", grouped(all)))
            .on_hover_text(format!("{} a second", grouped(rate as usize)));
        return;
    }
    let share = tried as f32 / all.max(1) as f32;
    let left = match tried {
        0 => String::new(),
        _ => format!(", {:.0} s left", (all - tried) as f64 / rate),
    };
    let words = format!("{} of {} tried{left}", grouped(tried), grouped(all));
    ui.add(
        egui::ProgressBar::new(share)
            .desired_width(260.0)
            .text(words),
    );
}

/// A number with a comma after its thousands.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut words = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            words.push(',');
        }
        words.push(digit);
    }
    words
}

/// The lowest cost of all hypotheses, how far it is from the truth, and how far the search ended from it.
fn compared(
    context: &ViewContext<'_>,
    search: &Search<'_>,
    surface: &DenseSurface,
) -> Option<String> {
    let (offset, score) = surface.minimum()?;
    let (least, pose) = (score.cost?, search.pose(&offset));
    let so_far = if surface.is_complete() { "" } else { " so far" };
    let mut words = format!("Lowest of all{so_far}: cost {}", number(least));
    if let Some(truth) = context.truth() {
        words += &format!(", {} from the truth", apart(truth, &pose));
    }
    let result = context.estimate(search.span.part.method()?);
    let best = search.assessed.map(|assessed| assessed.best);
    if let (Some(result), Some(best)) = (result, best) {
        let compared = match best - least {
            more if more > LEAST_DIFFERENCE => format!("at a cost {} higher", number(more)),
            more if more < -LEAST_DIFFERENCE => format!("at a cost {} lower", number(-more)),
            _ => "at the same cost".to_owned(),
        };
        let apart = apart(&result, &pose);
        words += &format!("; the search ended {apart} away, {compared}");
    }
    Some(words)
}

/// How far two cameras are from each other, in words.
fn apart(a: &Pose, b: &Pose) -> String {
    let error = PoseError::between(a, b);
    format!("{} and {}", error.translation(), error.rotation())
}

/// Shows or hides the map.
pub(super) fn switch(ui: &mut Ui, context: &ViewContext<'_>) {
    let mut shown = context.options.shows_dense_map;
    let help =
        "Score every position with every heading, and show the lowest cost at each position (F)";
    if ui
        .toggle_value(&mut shown, "Dense")
        .on_hover_text(help)
        .clicked()
    {
        context.send(Command::ShowDenseMap);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_set_apart() {
        let words = [0, 999, 1000, 1_288_097].map(grouped);
        assert_eq!(words, ["0", "999", "1,000", "1,288,097"]);
    }
}
