//! Where a cost lies between no relation at all and the truth.

use egui::{RichText, Sense, Ui, pos2, vec2};

use crate::app::view_context::CostBounds;
use crate::app::views::legend;
use crate::app::{ViewContext, theme};
use crate::method::Method;
use crate::palette;
use crate::proof::Thing;

/// Height of the bar with its marks \[points\].
const HEIGHT: f32 = 16.0;
/// How far a mark may lie beyond an end, as a share of the bar.
const BEYOND: f64 = 0.04;

/// A bar from the cost of shuffled pixels to the least known cost, with a mark for each cost.
pub(super) fn ui(ui: &mut Ui, context: &ViewContext<'_>, method: Method, present: Option<f64>) {
    let bounds = context.cost_bounds(method);
    let range = BarRange::of(&bounds);
    let result = context.estimate(method).map(|pose| legend::result(context, &pose));
    let result = result.unwrap_or(Thing::Result(palette::NO_POSE));
    let costs = [
        ("shuffled", Thing::Dot(palette::NO_POSE), bounds.shuffled),
        ("best", result, bounds.best),
        ("truth", Thing::Truth, bounds.truth),
        ("present", Thing::Dot(palette::UNDECIDED), present),
    ];
    let costs = costs.into_iter().filter_map(|(name, thing, cost)| Some((name, thing, cost?)));
    let costs: Vec<(&str, Thing, f64)> = costs.collect();
    let name = method.label();
    if let Some(range) = &range {
        bar(ui, &name, range, &costs);
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.label(RichText::new(&name).strong());
        for (name, thing, cost) in &costs {
            let (place, _) = ui.allocate_exact_size(vec2(12.0, 12.0), Sense::hover());
            legend::paint_mark(ui.painter(), *thing, place.center(), 4.0);
            ui.label(format!("{name} {cost:.4}"));
            ui.add_space(6.0);
        }
        match (&range, present) {
            (Some(range), Some(present)) => {
                let share = 100.0 * range.share(present);
                ui.weak(format!("{share:.0} % of the way from shuffled pixels"))
            }
            (None, _) => ui.weak("The search computes the cost of shuffled pixels at its end"),
            (Some(_), None) => ui.weak("no cost here"),
        }
    });
}

/// The costs at the ends of the bar.
#[derive(Clone, Copy, Debug, PartialEq)]
struct BarRange {
    shuffled: f64,
    least: f64,
}

impl BarRange {
    /// From shuffled pixels to the truth, or to the best where that costs less still; `None` before
    /// they are known, and where nothing lies between them.
    fn of(bounds: &CostBounds) -> Option<Self> {
        let shuffled = bounds.shuffled?;
        let known = [bounds.truth, bounds.best].into_iter().flatten();
        let least = known.fold(f64::INFINITY, f64::min);
        (least.is_finite() && least < shuffled).then_some(Self { shuffled, least })
    }

    /// 0 for the cost of shuffled pixels, 1 for the least.
    fn share(&self, cost: f64) -> f64 {
        (self.shuffled - cost) / (self.shuffled - self.least)
    }
}

fn bar(ui: &mut Ui, name: &str, range: &BarRange, costs: &[(&str, Thing, f64)]) {
    let size = vec2(ui.available_width(), HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    legend::name_picture(&response, format!("{name} cost from shuffled pixels to the least"));
    response.on_hover_text(
        "Left: what no relation at all costs. Right: the truth, or the best where that costs less",
    );
    let line = rect.shrink2(vec2(0.05 * rect.width(), 0.5 * HEIGHT - 3.0));
    legend::gradient(ui.painter(), line, theme::viridis);
    for (_, thing, cost) in costs {
        let share = range.share(*cost).clamp(-BEYOND, 1.0 + BEYOND) as f32;
        let at = pos2(line.left() + share * line.width(), line.center().y);
        legend::paint_mark(ui.painter(), *thing, at, 5.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_reaches_from_shuffled_pixels_to_the_least_known_cost() {
        let mut bounds = CostBounds { shuffled: Some(0.9), best: Some(0.7), truth: None };
        let range = BarRange::of(&bounds).expect("both are known");
        assert!((range.share(0.8) - 0.5).abs() < 1e-12);
        bounds.truth = Some(0.5);
        let range = BarRange::of(&bounds).expect("all are known");
        assert!((range.share(0.7) - 0.5).abs() < 1e-12);
        assert!(range.share(1.1) < 0.0);
    }

    #[test]
    fn there_is_no_bar_where_nothing_lies_between_its_ends() {
        let flat = CostBounds { shuffled: Some(0.5), best: Some(0.5), truth: None };
        assert_eq!(BarRange::of(&flat), None);
        assert_eq!(BarRange::of(&CostBounds::default()), None);
    }
}
