//! Where a cost lies between no relation at all and the truth.

use egui::{Color32, Mesh, RichText, Role, Sense, Ui, WidgetInfo, pos2, vec2};

use crate::app::theme;
use crate::app::view_context::CostBounds;
use crate::app::views::mesh_painter::{MarkShape, MeshPainter};
use crate::method::Method;

/// Height of the bar with its marks \[points\].
const HEIGHT: f32 = 16.0;
/// How far a mark may lie beyond an end, as a share of the bar.
const BEYOND: f64 = 0.04;

/// A bar from the cost of shuffled pixels to the least known cost, with a mark for each cost.
pub(super) fn ui(ui: &mut Ui, method: Method, bounds: &CostBounds, present: Option<f64>) {
    let range = BarRange::of(bounds);
    let costs = [
        NamedCost::new("shuffled", "■", MarkShape::Square, bounds.shuffled, |ui| {
            ui.visuals().text_color()
        }),
        NamedCost::new("best", "▲", MarkShape::Triangle, bounds.best, |_| theme::ESTIMATE),
        NamedCost::new("truth", "◆", MarkShape::Diamond, bounds.truth, |_| theme::TRUTH),
        NamedCost::new("present", "○", MarkShape::Ring, present, |_| theme::CAMERA),
    ];
    let name = method.name().to_uppercase();
    if let Some(range) = &range {
        bar(ui, &name, range, &costs);
    }
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.label(RichText::new(&name).strong());
        for cost in &costs {
            let Some(value) = cost.value else { continue };
            ui.label(RichText::new(cost.glyph).color(theme::text(ui.visuals(), (cost.color)(ui))));
            ui.label(format!("{} {value:.4}", cost.name));
            ui.add_space(6.0);
        }
        match (&range, present) {
            (Some(range), Some(present)) => {
                let share = 100.0 * range.share(present);
                ui.weak(format!("{share:.0} % of the way from shuffled pixels"));
            }
            (None, _) => {
                ui.weak("what shuffled pixels cost is told at the end of the search");
            }
            (Some(_), None) => {
                ui.weak("no cost here");
            }
        }
    });
}

/// A cost with its mark.
struct NamedCost {
    name: &'static str,
    glyph: &'static str,
    mark: MarkShape,
    value: Option<f64>,
    color: fn(&Ui) -> Color32,
}

impl NamedCost {
    fn new(
        name: &'static str,
        glyph: &'static str,
        mark: MarkShape,
        value: Option<f64>,
        color: fn(&Ui) -> Color32,
    ) -> Self {
        Self { name, glyph, mark, value, color }
    }
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

fn bar(ui: &mut Ui, name: &str, range: &BarRange, costs: &[NamedCost]) {
    let size = vec2(ui.available_width(), HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    let spoken = format!("{name} cost from shuffled pixels to the least");
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &spoken));
    response.on_hover_text(
        "Left: what no relation at all costs. Right: the truth, or the best where that costs less",
    );
    let line = rect.shrink2(vec2(0.05 * rect.width(), 0.5 * HEIGHT - 3.0));
    let at = |share: f64| {
        let share = share.clamp(-BEYOND, 1.0 + BEYOND) as f32;
        pos2(line.left() + share * line.width(), line.center().y)
    };
    const STEPS: u32 = 24;
    let mut mesh = Mesh::default();
    for step in 0..=STEPS {
        let share = f64::from(step) / f64::from(STEPS);
        let (color, x) = (theme::viridis(share), at(share).x);
        mesh.colored_vertex(pos2(x, line.top()), color);
        mesh.colored_vertex(pos2(x, line.bottom()), color);
        if step > 0 {
            let here = 2 * step;
            mesh.add_triangle(here - 2, here - 1, here);
            mesh.add_triangle(here, here - 1, here + 1);
        }
    }
    ui.painter().add(mesh);
    let mut mesh = MeshPainter::new(ui.pixels_per_point());
    for cost in costs {
        let Some(value) = cost.value else { continue };
        let place = at(range.share(value));
        // The present cost goes around those that it equals.
        if cost.mark == MarkShape::Ring {
            mesh.ring(place, 7.0, 2.2, (cost.color)(ui));
        } else {
            mesh.disc(place, 7.0, ui.visuals().panel_fill);
            mesh.mark(cost.mark, place, 4.5, (cost.color)(ui));
        }
    }
    mesh.paint_on(ui.painter());
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
