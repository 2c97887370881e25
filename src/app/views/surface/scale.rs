//! The colours of costs and coverages on the map and on the ground in 3-D, the same all through a run.

use egui::Color32;

use super::search::Search;
use crate::app::theme;
use crate::event::Event;
use crate::grid::DenseSurface;
use crate::render::Score;
use crate::session::Run;

/// Costs that differ by less are equal: the search calls them flat.
const MIN_DIFFERENCE: f64 = 1e-9;

/// The colour of a cell below the coverage floor.
pub(super) const BELOW_FLOOR: Color32 = Color32::from_gray(110);

/// The ends of the colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// Lowest and highest cost of the positions above the coverage floor.
    costs: Option<(f64, f64)>,
    /// Greatest coverage.
    coverage: f64,
}

impl Scale {
    /// The scale of every position that the method scored, after the cursor too: a step must not
    /// change what a colour means.
    pub(super) fn of(run: &Run, search: &Search<'_>) -> Self {
        let records = run.records().get(search.span.records.clone()).unwrap_or_default();
        let scored = records.iter().filter_map(|record| match &record.event {
            Event::PoseScored(scored) if !scored.phase.is_yaw() => Some(&scored.score),
            _ => None,
        });
        let scale = Self::over(scored, search);
        // A descent emits the surface below it at once.
        let mut surfaces = records.iter().filter_map(|record| match &record.event {
            Event::PhaseSearched(searched) if scale.costs.is_none() => Some(&searched.surface),
            _ => None,
        });
        let first = surfaces.next().map(|surface| surface.scores.iter().flatten());
        first.map_or(scale, |scores| Self::over(scores, search))
    }

    /// The scale of a dense map, as far as it is filled.
    pub(super) fn of_dense(dense: &DenseSurface, search: &Search<'_>) -> Self {
        Self::over(dense.cheapest().scores.iter().flatten(), search)
    }

    fn over<'s>(scores: impl Iterator<Item = &'s Score>, search: &Search<'_>) -> Self {
        let mut scale = Self { costs: None, coverage: 1.0 };
        for score in scores {
            scale.coverage = scale.coverage.max(search.coverage(score.covered));
            if let Some(cost) = score.eligible_cost(search.least_covered) {
                let (least, greatest) = scale.costs.unwrap_or((cost, cost));
                scale.costs = Some((least.min(cost), greatest.max(cost)));
            }
        }
        scale
    }

    /// The colour of a cost; grey where it is no number.
    pub(super) fn cost(&self, cost: f64) -> Color32 {
        match self.costs {
            Some((least, greatest)) if !cost.is_nan() => {
                theme::viridis(merit(least, greatest, cost))
            }
            _ => BELOW_FLOOR,
        }
    }

    /// The colour of a coverage.
    pub(super) fn coverage(&self, coverage: f64) -> Color32 {
        theme::viridis(coverage / self.coverage)
    }

    /// The highest and the lowest cost: the dark and the bright end.
    pub(super) fn cost_ends(&self) -> Option<[String; 2]> {
        let (least, greatest) = self.costs?;
        Some([number(greatest), number(least)])
    }

    /// No and the greatest coverage: the dark and the bright end.
    pub(super) fn coverage_ends(&self) -> [String; 2] {
        ["0".to_owned(), format!("{:.2}", self.coverage)]
    }
}

/// 1 for the lowest cost, 0 for the highest; what differs by rounding alone has one colour.
fn merit(least: f64, greatest: f64, cost: f64) -> f64 {
    if greatest - least > MIN_DIFFERENCE { (greatest - cost) / (greatest - least) } else { 1.0 }
}

/// A cost with four decimals where it is small, fewer where it is large.
pub(super) fn number(cost: f64) -> String {
    match cost.abs() {
        large if large >= 1000.0 => format!("{cost:.1}"),
        large if large >= 10.0 => format!("{cost:.2}"),
        _ => format!("{cost:.4}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_cost_is_the_brightest_and_a_flat_surface_all_bright() {
        assert_eq!([2.0, 4.0, 6.0].map(|cost| merit(2.0, 6.0, cost)), [1.0, 0.5, 0.0]);
        assert_eq!(merit(3.0, 3.0, 3.0), 1.0);
        assert_eq!(merit(1.0, 1.0 + 4e-16, 1.0 + 4e-16), 1.0);
        let scale = Scale { costs: Some((2.0, 6.0)), coverage: 1.0 };
        assert_eq!(scale.cost(2.0), theme::viridis(1.0));
        assert_eq!(scale.cost(f64::NAN), BELOW_FLOOR);
    }

    #[test]
    fn numbers_have_about_as_many_digits() {
        assert_eq!([0.81234, 12.3456, 2301.25].map(number), ["0.8123", "12.35", "2301.2"]);
    }
}
