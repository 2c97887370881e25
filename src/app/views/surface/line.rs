//! The cost along the line from the result to the truth.

use egui::{Ui, vec2};
use egui_plot::{HoverPosition, Line, LineStyle, Plot, PlotPoint, Points, VLine};

use super::scale::number;
use super::search::Search;
use crate::app::views::legend::{self, paint_mark, plot_shape};
use crate::app::{Command, CostAlong, CostLine, ViewContext, theme};
use crate::geometry::Pose;
use crate::proof::Thing;

/// The line from the method's result to the truth, if both are known and shown. Only the present run is
/// scored again.
pub(super) fn wanted(context: &ViewContext<'_>, search: &Search<'_>) -> Option<CostLine> {
    if !context.is_present() {
        return None;
    }
    Some(CostLine {
        method: search.method,
        from: context.estimate(search.span.part.method()?)?,
        to: *context.truth()?,
    })
}

/// Draws the costs along the line; answers the pose under the pointer.
pub(super) fn ui(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    search: &Search<'_>,
    width: f32,
) -> Option<Pose> {
    ui.strong("From the result to the truth");
    let Some(line) = wanted(context, search) else {
        ui.weak(match (context.options.shows_truth, context.is_present()) {
            (false, _) => "The truth is hidden (G shows it)",
            (true, false) => "Drawn for the present run, B",
            (true, true) => "Appears when there is a result, and the truth is known",
        });
        return None;
    };
    let Some(along) = known(context, line) else {
        context.send(Command::TraceLine(line));
        ui.weak("Computing");
        return None;
    };
    let step_m = context.run.params.grid.fine_step_m;
    let profile = Profile::of(along, search.least_covered, step_m);
    ui.label(profile.words());
    if profile.length <= 0.0 {
        return None;
    }
    draw(ui, context, search, &profile, width)
}

fn known<'a>(context: &ViewContext<'a>, line: CostLine) -> Option<&'a CostAlong> {
    let along = context.cost_along(line.method);
    along.filter(|along| along.line == line)
}

/// The costs along a line, by distance from the result.
struct Profile {
    line: CostLine,
    /// Distance of the truth: in m, or in ° where the poses differ by their heading alone.
    length: f64,
    unit: &'static str,
    /// Distance, rising, and cost; no cost where too little is covered, and before it is known.
    costs: Vec<(f64, Option<f64>)>,
    /// Whether all of them are known.
    is_complete: bool,
    step_m: f64,
}

impl Profile {
    /// `step_m` is the distance of the finest positions of the search.
    fn of(along: &CostAlong, least_covered: u32, step_m: f64) -> Self {
        /// Ends that are nearer than this differ by their heading \[m\].
        const APART_M: f64 = 1e-3;
        let line = along.line;
        let (length, unit) = match line.length_m() {
            metres if metres >= APART_M => (metres, "m"),
            _ => {
                let angle = line.from.rotation.angle_to(&line.to.rotation);
                (angle.to_degrees(), "°")
            }
        };
        let costs = along.scores.iter().map(|(share, score)| {
            let cost = score.and_then(|score| score.eligible_cost(least_covered));
            (share * length, cost)
        });
        Self {
            line,
            length,
            unit,
            costs: costs.collect(),
            is_complete: along.is_complete(),
            step_m,
        }
    }

    /// The cost at a distance that was tried.
    fn at(&self, way: f64) -> Option<f64> {
        let mut costs = self.costs.iter();
        costs.find(|(at, _)| *at == way)?.1
    }

    fn way(&self, way: f64) -> String {
        format!("{way:.2} {}", self.unit)
    }

    /// Where the cost between the two ends is highest, and that cost.
    fn highest(&self) -> Option<(f64, f64)> {
        let between = |(way, _): &&(f64, Option<f64>)| (0.0..=self.length).contains(way);
        let known = self.costs.iter().filter(between);
        let known = known.filter_map(|(way, cost)| Some((*way, (*cost)?)));
        known.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// What the curve says, in one sentence.
    fn words(&self) -> String {
        if self.length <= 0.0 {
            return "The result is the truth".to_owned();
        }
        let far = self.way(self.length);
        let (Some(result), Some(truth)) = (self.at(0.0), self.at(self.length)) else {
            return if self.is_complete {
                format!("{far} apart; one of the two poses covers too few pixels")
            } else {
                format!("{far} apart")
            };
        };
        let costs = format!(
            "Cost {} at the result, {} at the truth, {far} away",
            number(result),
            number(truth)
        );
        let Some((way, highest)) = self.highest().filter(|_| self.is_complete) else {
            return costs;
        };
        if self.unit == "m" && self.length < self.step_m {
            return format!(
                "{costs}: nearer than the steps of the search, {} m",
                self.step_m
            );
        }
        let wall = number(highest);
        let lower_end = result.min(truth);
        if highest <= result.max(truth) {
            let leads = if truth < result {
                "it falls from the result to the truth: the search stopped early"
            } else {
                "it falls from the truth to the result: the cost prefers the result"
            };
            return format!("{costs}; between them {leads}");
        }
        let meaning = if truth < result {
            "the search did not cross this barrier"
        } else {
            "the cost prefers the result"
        };
        format!(
            "{costs}; between them it rises to {wall}, {} from the result and {} above the lower end: {meaning}",
            self.way(way),
            number(highest - lower_end)
        )
    }

    /// The pose at a distance along the line.
    fn pose(&self, way: f64) -> Pose {
        self.line.pose(way / self.length.max(f64::MIN_POSITIVE))
    }
}

fn draw(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    search: &Search<'_>,
    profile: &Profile,
    width: f32,
) -> Option<Pose> {
    const HEIGHT: f32 = 150.0;
    let unit = profile.unit;
    let label = |position: &HoverPosition<'_>| match position {
        HoverPosition::NearDataPoint {
            plot_name,
            position,
            ..
        } => {
            let cost = number(position.y);
            Some(format!("{plot_name} {cost} at {:.2} {unit}", position.x))
        }
        HoverPosition::Elsewhere { .. } => None,
    };
    let color = theme::method(search.method);
    let stretches = profile.costs.split(|(_, cost)| cost.is_none());
    let stretches: Vec<Vec<[f64; 2]>> = stretches
        .map(|stretch| {
            let points = stretch.iter();
            points
                .filter_map(|(way, cost)| Some([*way, (*cost)?]))
                .collect()
        })
        .filter(|stretch: &Vec<_>| !stretch.is_empty())
        .collect();
    let result = legend::result(context, &profile.line.from);
    let ends = [
        ("result", result, LineStyle::Solid, 0.0),
        (
            "truth",
            Thing::Truth,
            LineStyle::dashed_loose(),
            profile.length,
        ),
    ];
    let answer = Plot::new(("cost line", profile.length.to_bits()))
        .width(width)
        .height(HEIGHT)
        .allow_scroll(false)
        .allow_drag(false)
        .x_axis_label(format!("from the result [{unit}]"))
        .y_axis_label("cost")
        .label_formatter(label)
        .show(ui, |plot| {
            for (index, stretch) in stretches.into_iter().enumerate() {
                let line = Line::new(search.method.label(), stretch).color(color);
                plot.line(line.width(2.0).id(("along", index)));
            }
            // The truth last, so that nothing hides it.
            for (name, thing, style, way) in ends {
                let color = theme::rgb(thing.color());
                let end = VLine::new(name, way).color(color).style(style).width(1.5);
                plot.vline(end.allow_hover(false));
                if let Some(cost) = profile.at(way) {
                    let point = Points::new(name, [way, cost]).shape(plot_shape(thing));
                    plot.points(point.radius(7.0).color(color));
                }
            }
        });
    let spoken = profile.words();
    answer.response.widget_info(|| {
        let words = format!("Cost from the result to the truth: {spoken}");
        egui::WidgetInfo::labeled(egui::Role::Image, true, words)
    });
    key(ui, result);
    let at = answer.response.hover_pos()?;
    if !answer.transform.frame().contains(at) || profile.length <= 0.0 {
        return None;
    }
    let PlotPoint { x: way, .. } = answer.transform.value_from_position(at);
    let pose = profile.pose(way);
    if answer.response.clicked() {
        context.send(Command::TakeCamera(Some(pose)));
    }
    Some(pose)
}

fn key(ui: &mut Ui, result: Thing) {
    ui.horizontal_wrapped(|ui| {
        for (thing, name) in [(result, "result"), (Thing::Truth, "truth")] {
            let (rect, _) = ui.allocate_exact_size(vec2(14.0, 12.0), egui::Sense::hover());
            paint_mark(ui.painter(), thing, rect.center(), 4.5);
            ui.weak(name);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::Method;
    use crate::render::Score;

    /// Costs at equal steps along a line of 4 m.
    fn profile(costs: &[f64]) -> Profile {
        let last = (costs.len() - 1) as f64;
        let scores = costs.iter().enumerate().map(|(at, &cost)| {
            let score = Score {
                cost: Some(cost),
                covered: 100,
            };
            (at as f64 / last, Some(score))
        });
        let along = CostAlong {
            line: CostLine {
                method: Method::MI,
                from: Pose::identity(),
                to: Pose::translation(0.0, 0.0, 4.0),
            },
            scores: scores.collect(),
        };
        Profile::of(&along, 10, 0.2)
    }

    #[test]
    fn a_wall_between_result_and_truth_is_told_from_a_slope() {
        let wall = profile(&[0.5, 0.6, 0.7, 0.5, 0.3]).words();
        assert!(
            wall.contains("rises to 0.7000, 2.00 m from the result"),
            "{wall}"
        );
        assert!(wall.contains("0.4000 above the lower"), "{wall}");
        assert!(wall.contains("did not cross"), "{wall}");
        let slope = profile(&[0.5, 0.4, 0.3]).words();
        assert!(
            slope.contains("falls from the result to the truth"),
            "{slope}"
        );
        let preferred = profile(&[0.3, 0.4, 0.5]).words();
        assert!(
            preferred.contains("the cost prefers the result"),
            "{preferred}"
        );
        // An incomplete curve says nothing of what is between.
        let mut early = profile(&[0.5, 0.4, 0.3]);
        early.is_complete = false;
        let early = early.words();
        assert!(early.ends_with("4.00 m away"), "{early}");
    }
}
