//! The cost along the line from the result to the truth.

use egui::Ui;
use egui_plot::{Line, LineStyle, Plot, PlotPoint, Points, VLine};

use super::scale::number;
use super::search::Search;
use crate::app::views::legend::{at_points, name_picture, plot_shape, result, stretches};
use crate::app::{CostAlong, CostLine, Sends, ViewContext, theme};
use crate::geometry::Pose;
use crate::proof::Thing;

/// The least rise between the ends that is a wall, as a share of the difference of the costs there: less is hardly seen
/// in the plot.
const LEAST_WALL: f64 = 0.2;

/// Height of the plot \[points\].
const PLOT_HEIGHT: f32 = 124.0;

/// The line from the method's result to the truth, if both are known, shown and differ. Only the present run is
/// scored again.
pub(super) fn wanted(context: &ViewContext<'_>, search: &Search<'_>) -> Option<CostLine> {
    if !context.is_present() {
        return None;
    }
    let line = CostLine {
        method: search.method,
        from: context.estimate(search.span.part.method()?)?,
        to: *context.truth()?,
    };
    (line.from != line.to).then_some(line)
}

/// Draws the costs along the line; answers the pose under the pointer.
pub(super) fn ui(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    search: &Search<'_>,
    line: CostLine,
) -> Option<Pose> {
    let along = context.state.scoring.along(line.method);
    let Some(along) = along.filter(|along| along.line == line) else {
        context.send(move |app| app.state.trace_line(line));
        ui.weak("Computing the cost from the result to the truth");
        return None;
    };
    let step_m = context.run.params.grid.fine_step_m;
    let profile = Profile::of(along, search.least_covered, step_m);
    ui.label(context.in_unit(&profile.words()));
    draw(ui, context, search, &profile)
}

/// The costs along a line, by distance from the result.
struct Profile {
    line: CostLine,
    /// Distance of the truth: in m, or in ° where the poses differ by their heading alone.
    length: f64,
    unit: &'static str,
    /// Distance, rising, and cost; no cost where too little is covered.
    costs: Vec<(f64, Option<f64>)>,
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
        Self { line, length, unit, costs: costs.collect(), step_m }
    }

    /// The cost at a distance that was tried.
    fn at(&self, way: f64) -> Option<f64> {
        let mut costs = self.costs.iter();
        costs.find(|(at, _)| *at == way)?.1
    }

    /// The highest cost between the two ends.
    fn highest(&self) -> Option<f64> {
        let between = |(way, _): &&(f64, Option<f64>)| (0.0..=self.length).contains(way);
        let known = self.costs.iter().filter(between);
        known.filter_map(|(_, cost)| *cost).max_by(f64::total_cmp)
    }

    /// What the curve says, in one sentence.
    fn words(&self) -> String {
        let far = format!("{:.2} {}", self.length, self.unit);
        let (Some(result), Some(truth)) = (self.at(0.0), self.at(self.length)) else {
            return format!("{far} apart; one of the two poses covers too few pixels");
        };
        let (from, to) = (number(result), number(truth));
        let costs = format!("Cost {from} at the result, {to} at the truth, {far} away");
        let highest = self.highest().unwrap_or(result.max(truth));
        if self.unit == "m" && self.length < self.step_m {
            let step_m = self.step_m;
            return format!("{costs}: nearer than the steps of the search, {step_m} m");
        }
        let is_missed = truth < result;
        if highest - result.max(truth) > LEAST_WALL * (result - truth).abs() {
            let wall = number(highest - result.min(truth));
            let meaning = if is_missed {
                "the search did not cross this barrier"
            } else {
                "the cost prefers the result"
            };
            return format!("{costs}; it is {wall} higher between them: {meaning}");
        }
        let meaning = if is_missed {
            "it falls from the result to the truth: the search stopped early"
        } else {
            "it falls from the truth to the result: the cost prefers the result"
        };
        format!("{costs}; {meaning}")
    }
}

fn draw(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    search: &Search<'_>,
    profile: &Profile,
) -> Option<Pose> {
    let unit = profile.unit;
    let label =
        at_points(|name, PlotPoint { x, y }| format!("{name} {} at {x:.2} {unit}", number(y)));
    let costs = profile.costs.iter();
    let curve: Vec<_> = costs.map(|(way, cost)| cost.map(|cost| [*way, cost])).collect();
    let result = result(context, &profile.line.from);
    let dashed = LineStyle::dashed_loose();
    // The truth last, so that nothing hides it.
    let ends = [
        ("result", result, LineStyle::Solid, 0.0),
        ("truth", Thing::Truth, dashed, profile.length),
    ];
    let answer = Plot::new(("cost line", profile.length.to_bits()))
        .height(PLOT_HEIGHT)
        .allow_scroll(false)
        .allow_drag(false)
        .x_axis_label(context.in_unit(&format!("from the result to the truth [{unit}]")))
        .y_axis_label("cost")
        .label_formatter(label)
        .show(ui, |plot| {
            for (index, stretch) in stretches(&curve).enumerate() {
                let line = Line::new(search.method.label(), stretch).width(2.0);
                let line = line.color(theme::method(search.method));
                plot.line(line.id(("along", index)));
            }
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
    name_picture(
        &answer.response,
        context.in_unit(&format!("Cost from the result to the truth: {}", profile.words())),
    );
    let at = answer.response.hover_pos()?;
    if !answer.transform.frame().contains(at) {
        return None;
    }
    let PlotPoint { x: way, .. } = answer.transform.value_from_position(at);
    let pose = profile.line.pose(way / profile.length.max(f64::MIN_POSITIVE));
    answer.response.sends(context, move |app| app.state.camera = Some(pose));
    Some(pose)
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
            let score = Score { cost: Some(cost), covered: 100 };
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
        assert!(wall.contains("it is 0.4000 higher"), "{wall}");
        assert!(wall.contains("did not cross"), "{wall}");
        // A curve that hardly rises before it falls is drawn without a wall.
        let bump = profile(&[0.5, 0.51, 0.4, 0.3]).words();
        assert!(bump.contains("falls from the result to the truth"), "{bump}");
        let slope = profile(&[0.5, 0.4, 0.3]).words();
        assert!(slope.contains("falls from the result to the truth"), "{slope}");
        let preferred = profile(&[0.3, 0.4, 0.5]).words();
        assert!(preferred.contains("the cost prefers the result"), "{preferred}");
    }
}
