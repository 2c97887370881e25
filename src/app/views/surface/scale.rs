//! The colours of the maps: one scale for costs and one for coverages, the same all through a run.

use egui::{Color32, Mesh, Rect, Sense, Ui, Vec2, pos2, vec2};

use super::search::Search;
use crate::app::theme;
use crate::event::Event;
use crate::grid::DenseSurface;
use crate::render::Score;
use crate::session::Run;

/// Costs that differ by less are equal: the search calls them flat.
pub(super) const LEAST_DIFFERENCE: f64 = 1e-9;

/// What has no colour of the scale: a cell that may not win.
pub(super) const NO_SAY: Color32 = Color32::from_gray(110);

/// The ends of the colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// Least and greatest cost of the positions that may win under the run's floor.
    costs: Option<(f64, f64)>,
    /// Greatest coverage.
    coverage: f64,
}

impl Scale {
    /// The scale of everything that the method has told, behind the cursor too: looking back must
    /// not change what a colour means.
    pub(super) fn of(run: &Run, search: &Search<'_>) -> Self {
        let floor = run.params.grid.coverage_floor;
        let least_covered = search.least_covered(floor);
        let mut scale = Self {
            costs: None,
            coverage: 1.0,
        };
        let records = run.records().get(search.span.records.clone());
        for record in records.unwrap_or_default() {
            match &record.event {
                Event::PoseScored(scored) if !scored.phase.is_yaw() => {
                    scale.take(&scored.score, scored.coverage, least_covered);
                }
                // A surface that is shown under a descent is told at once.
                Event::PhaseSearched(searched) if scale.costs.is_none() => {
                    for score in searched.surface.scores.iter().flatten() {
                        scale.take(score, search.coverage(score.covered), least_covered);
                    }
                }
                _ => {}
            }
        }
        scale
    }

    /// The scale of a dense map, as far as it is filled.
    pub(super) fn of_dense(dense: &DenseSurface, search: &Search<'_>) -> Self {
        let mut scale = Self {
            costs: None,
            coverage: 1.0,
        };
        let cheapest = dense.cheapest();
        for score in cheapest.scores.iter().flatten() {
            let coverage = search.coverage(score.covered);
            scale.take(score, coverage, cheapest.least_covered);
        }
        scale
    }

    fn take(&mut self, score: &Score, coverage: f64, least_covered: u32) {
        self.coverage = self.coverage.max(coverage);
        if let Some(cost) = score.eligible_cost(least_covered) {
            let (least, greatest) = self.costs.unwrap_or((cost, cost));
            self.costs = Some((least.min(cost), greatest.max(cost)));
        }
    }

    /// The colour of a cost; grey where it is no number.
    pub(super) fn cost(&self, cost: f64) -> Color32 {
        match self.costs {
            Some((least, greatest)) if !cost.is_nan() => {
                theme::viridis(merit(least, greatest, cost))
            }
            _ => NO_SAY,
        }
    }

    /// The colour of a coverage.
    pub(super) fn coverage(&self, coverage: f64) -> Color32 {
        theme::viridis(coverage / self.coverage)
    }

    /// What the dark and the bright end of the cost colours are.
    pub(super) fn cost_ends(&self) -> Option<[String; 2]> {
        let (least, greatest) = self.costs?;
        Some([number(greatest), number(least)])
    }

    /// What the dark and the bright end of the coverage colours are.
    pub(super) fn coverage_ends(&self) -> [String; 2] {
        ["0".to_owned(), format!("{:.2}", self.coverage)]
    }
}

/// 1 for the least cost, 0 for the greatest; what differs by rounding alone has one colour.
fn merit(least: f64, greatest: f64, cost: f64) -> f64 {
    if greatest - least > LEAST_DIFFERENCE {
        (greatest - cost) / (greatest - least)
    } else {
        1.0
    }
}

/// A cost with four digits behind the point where it is small, fewer where it is large.
pub(super) fn number(cost: f64) -> String {
    match cost.abs() {
        large if large >= 1000.0 => format!("{cost:.1}"),
        large if large >= 10.0 => format!("{cost:.2}"),
        _ => format!("{cost:.4}"),
    }
}

/// A bar of the colours with the numbers at its ends.
pub(super) fn bar(ui: &mut Ui, width: f32, what: &str, [dark, bright]: &[String; 2]) {
    const HEIGHT: f32 = 8.0;
    let (rect, response) = ui.allocate_exact_size(vec2(width, HEIGHT), Sense::hover());
    let mut mesh = Mesh::default();
    const STEPS: u32 = 32;
    for step in 0..=STEPS {
        let share = step as f32 / STEPS as f32;
        let color = theme::viridis(f64::from(share));
        let x = rect.left() + share * rect.width();
        mesh.colored_vertex(pos2(x, rect.top()), color);
        mesh.colored_vertex(pos2(x, rect.bottom()), color);
        if step > 0 {
            let first = 2 * (step - 1);
            mesh.add_triangle(first, first + 1, first + 2);
            mesh.add_triangle(first + 1, first + 2, first + 3);
        }
    }
    ui.painter().add(mesh);
    let stroke = ui.visuals().widgets.noninteractive.bg_stroke;
    ui.painter()
        .rect_stroke(rect, 0.0, stroke, egui::StrokeKind::Inside);
    let words = format!("Colours of {what}: {dark} is dark, {bright} is bright");
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &words));
    response.on_hover_text(words);
    let (labels, _) = ui.allocate_exact_size(vec2(width, 12.0), Sense::hover());
    ends(ui, labels, dark, bright);
}

fn ends(ui: &Ui, rect: Rect, dark: &str, bright: &str) {
    let font = theme::small();
    let color = ui.visuals().weak_text_color();
    let painter = ui.painter();
    painter.text(
        rect.left_top(),
        egui::Align2::LEFT_TOP,
        dark,
        font.clone(),
        color,
    );
    painter.text(
        rect.right_top(),
        egui::Align2::RIGHT_TOP,
        bright,
        font,
        color,
    );
}

/// A square of a colour, for a legend.
pub(super) fn swatch(ui: &mut Ui, color: Color32) {
    let (rect, _) = ui.allocate_exact_size(Vec2::splat(10.0), Sense::hover());
    ui.painter().rect_filled(rect, 1.0, color);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_cost_is_the_brightest_and_a_flat_surface_all_bright() {
        assert_eq!(
            [2.0, 4.0, 6.0].map(|cost| merit(2.0, 6.0, cost)),
            [1.0, 0.5, 0.0]
        );
        assert_eq!(merit(3.0, 3.0, 3.0), 1.0);
        assert_eq!(merit(1.0, 1.0 + 4e-16, 1.0 + 4e-16), 1.0);
        let scale = Scale {
            costs: Some((2.0, 6.0)),
            coverage: 1.0,
        };
        assert_eq!(scale.cost(2.0), theme::viridis(1.0));
        assert_eq!(scale.cost(f64::NAN), NO_SAY);
    }

    #[test]
    fn numbers_have_about_as_many_digits() {
        assert_eq!(
            [0.81234, 12.3456, 2301.25].map(number),
            ["0.8123", "12.35", "2301.2"]
        );
    }
}
