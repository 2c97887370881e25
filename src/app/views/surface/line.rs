//! The cost along the line from the result to the truth: what lies between them.

use egui::{Ui, vec2};
use egui_plot::{HoverPosition, Line, LineStyle, MarkerShape, Plot, PlotPoint, Points, VLine};

use super::marks::{MapMark, MarkKind};
use super::scale::number;
use super::search::Search;
use crate::app::{Command, CostAlong, CostLine, ViewContext, theme};
use crate::geometry::Pose;

/// How far from the line a minimum of the search may lie to be shown on it \[m\].
const NEAR_M: f64 = 0.5;

/// The line of the method's result to the truth, as far as both are known and shown. The costs of a run
/// that is kept are not worked out anew.
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
    marks: &[MapMark],
    floor: f64,
    width: f32,
) -> Option<Pose> {
    ui.strong("From the result to the truth");
    let Some(line) = wanted(context, search) else {
        ui.weak(match (context.options.shows_truth, context.is_present()) {
            (false, _) => "The truth is hidden (G shows it)",
            (true, false) => "Drawn for the present run, B",
            (true, true) => "Drawn once there are a result and a truth to it",
        });
        return None;
    };
    let Some(along) = known(context, line) else {
        context.send(Command::TraceLine(line));
        ui.weak("Working it out");
        return None;
    };
    let step_m = context.run.params.grid.fine_step_m;
    let profile = Profile::of(along, search.least_covered(floor), step_m);
    ui.label(profile.words());
    if profile.length <= 0.0 {
        return None;
    }
    draw(ui, context, search, marks, &profile, width)
}

fn known<'a>(context: &ViewContext<'a>, line: CostLine) -> Option<&'a CostAlong> {
    let along = context.cost_along(line.method);
    along.filter(|along| along.line == line)
}

/// What lies along the axis of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Measure {
    Metres,
    Degrees,
}

/// The costs along a line, over the way from its first end.
struct Profile {
    line: CostLine,
    measure: Measure,
    /// How far the second end is, in the measure.
    length: f64,
    /// Way and cost, rising; no cost where too little is covered, and before it is known.
    costs: Vec<(f64, Option<f64>)>,
    /// Costs of what may not win under the floor.
    below_floor: Vec<[f64; 2]>,
    /// Whether all of them are known.
    is_complete: bool,
    step_m: f64,
}

impl Profile {
    /// `step_m` is how far apart the finest positions of the search are.
    fn of(along: &CostAlong, least_covered: u32, step_m: f64) -> Self {
        /// Below this the two ends are turned against each other rather than apart \[m\].
        const APART_M: f64 = 1e-3;
        let line = along.line;
        let (measure, length) = match line.length_m() {
            metres if metres >= APART_M => (Measure::Metres, metres),
            _ => {
                let angle = line.from.rotation.angle_to(&line.to.rotation);
                (Measure::Degrees, angle.to_degrees())
            }
        };
        let costs = along.scores.iter().map(|(share, score)| {
            let cost = score.and_then(|score| score.eligible_cost(least_covered));
            (share * length, cost)
        });
        let below_floor = along.scores.iter().filter_map(|(share, score)| {
            let score = score.filter(|score| score.covered < least_covered)?;
            Some([share * length, score.cost.filter(|cost| cost.is_finite())?])
        });
        Self {
            line,
            measure,
            length,
            costs: costs.collect(),
            below_floor: below_floor.collect(),
            is_complete: along.is_complete(),
            step_m,
        }
    }

    fn unit(&self) -> &'static str {
        match self.measure {
            Measure::Metres => "m",
            Measure::Degrees => "°",
        }
    }

    /// The cost at a way that was tried.
    fn at(&self, way: f64) -> Option<f64> {
        let mut costs = self.costs.iter();
        costs.find(|(at, _)| *at == way)?.1
    }

    fn way(&self, way: f64) -> String {
        format!("{way:.2} {}", self.unit())
    }

    /// The greatest cost between the two ends, and where.
    fn highest(&self) -> Option<(f64, f64)> {
        let between = |(way, _): &&(f64, Option<f64>)| (0.0..=self.length).contains(way);
        let known = self.costs.iter().filter(between);
        let known = known.filter_map(|(way, cost)| Some((*way, (*cost)?)));
        known.max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Where the cost is less than on both sides.
    fn minima(&self) -> Vec<[f64; 2]> {
        let windows = self.costs.windows(3);
        let minima = windows.filter_map(|three| {
            let [before, here, after] = [three[0].1?, three[1].1?, three[2].1?];
            (here < before && here <= after).then_some([three[1].0, here])
        });
        minima.collect()
    }

    /// What lies between result and truth, in one sentence.
    fn words(&self) -> String {
        if self.length <= 0.0 {
            return "The result is the truth".to_owned();
        }
        let far = self.way(self.length);
        let (Some(result), Some(truth)) = (self.at(0.0), self.at(self.length)) else {
            return if self.is_complete {
                format!("{far} apart; one of both covers too little to have a say")
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
        if self.measure == Measure::Metres && self.length < self.step_m {
            return format!(
                "{costs}: closer than the steps of the search, {} m",
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
            "the search did not find what lies behind it"
        } else {
            "the cost prefers the result"
        };
        format!(
            "{costs}; between them it rises to {wall}, {} from the result and {} above the lower of both: {meaning}",
            self.way(way),
            number(highest - lower_end)
        )
    }

    /// The pose so far along the line.
    fn pose(&self, way: f64) -> Pose {
        self.line.pose(way / self.length.max(f64::MIN_POSITIVE))
    }

    /// How far along the line a pose lies, and how far off it \[m\]; for a line with a length.
    fn place_of(&self, pose: &Pose) -> Option<(f64, f64)> {
        if self.measure != Measure::Metres {
            return None;
        }
        let from = self.line.from.translation.vector;
        let along = (self.line.to.translation.vector - from) / self.length;
        let there = pose.translation.vector - from;
        let way = there.dot(&along);
        Some((way, (there - way * along).norm()))
    }
}

fn draw(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    search: &Search<'_>,
    marks: &[MapMark],
    profile: &Profile,
    width: f32,
) -> Option<Pose> {
    const HEIGHT: f32 = 150.0;
    let unit = profile.unit();
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
    let answer = Plot::new(("cost line", profile.length.to_bits()))
        .width(width)
        .height(HEIGHT)
        .allow_scroll(false)
        .allow_drag(false)
        .x_axis_label(format!("from the result [{unit}]"))
        .y_axis_label("cost")
        .label_formatter(label)
        .show(ui, |plot| {
            plot.points(
                Points::new("below the floor", profile.below_floor.clone())
                    .color(super::scale::NO_SAY)
                    .radius(1.5),
            );
            for (index, stretch) in stretches.into_iter().enumerate() {
                let line = Line::new(search.method.label(), stretch).color(color);
                plot.line(line.width(2.0).id(("along", index)));
            }
            plot.points(
                Points::new("minimum on the line", profile.minima())
                    .shape(MarkerShape::Circle)
                    .filled(false)
                    .radius(5.0)
                    .color(color),
            );
            for mark in marks {
                let is_minimum = matches!(
                    mark.kind,
                    MarkKind::Coarse | MarkKind::Fine | MarkKind::Ranked(_)
                );
                let place = profile.place_of(&mark.pose).filter(|_| is_minimum);
                if let (Some((way, off)), Some(cost)) = (place, mark.cost)
                    && off <= NEAR_M
                {
                    let points = Points::new(mark.words.clone(), [way, cost]);
                    let shape = mark.kind.plot_shape();
                    plot.points(points.shape(shape).radius(4.0).color(mark.kind.color()));
                }
            }
            // The truth last, so that nothing hides it.
            let ends = [
                ("result", theme::ESTIMATE, LineStyle::Solid, 0.0),
                (
                    "truth",
                    theme::TRUTH,
                    LineStyle::dashed_loose(),
                    profile.length,
                ),
            ];
            for (name, color, style, way) in ends {
                let end = VLine::new(name, way).color(color).style(style).width(1.5);
                plot.vline(end.allow_hover(false));
                if let Some(cost) = profile.at(way) {
                    let shape = match name {
                        "truth" => MarkerShape::Plus,
                        _ => MarkerShape::Diamond,
                    };
                    let point = Points::new(name, [way, cost]).shape(shape).radius(7.0);
                    plot.points(point.color(color));
                }
            }
        });
    let spoken = profile.words();
    answer.response.widget_info(|| {
        let words = format!("Cost from the result to the truth: {spoken}");
        egui::WidgetInfo::labeled(egui::Role::Image, true, words)
    });
    legend(ui, profile);
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

fn legend(ui: &mut Ui, profile: &Profile) {
    ui.horizontal_wrapped(|ui| {
        for (color, style, name) in [
            (theme::ESTIMATE, LineStyle::Solid, "result"),
            (theme::TRUTH, LineStyle::dashed_loose(), "truth"),
        ] {
            super::slices::key(ui, color, style);
            ui.weak(name);
        }
        let (rect, _) = ui.allocate_exact_size(vec2(12.0, 10.0), egui::Sense::hover());
        let ring = egui::Stroke::new(1.5, theme::method(profile.line.method));
        ui.painter().circle_stroke(rect.center(), 4.0, ring);
        ui.weak("minimum on the line");
        if !profile.below_floor.is_empty() {
            super::scale::swatch(ui, super::scale::NO_SAY);
            ui.weak("covers too little");
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
        assert!(wall.contains("did not find"), "{wall}");
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
        assert_eq!(
            profile(&[0.5, 0.2, 0.4, 0.1, 0.3]).minima(),
            [[1.0, 0.2], [3.0, 0.1]]
        );
        // Before all is known nothing is said of what lies between.
        let mut early = profile(&[0.5, 0.4, 0.3]);
        early.is_complete = false;
        let early = early.words();
        assert!(early.ends_with("4.00 m away"), "{early}");
    }

    #[test]
    fn a_pose_beside_the_line_is_found_on_it() {
        let profile = profile(&[1.0, 0.0]);
        let (way, off) = profile
            .place_of(&Pose::translation(0.3, 0.4, 1.5))
            .expect("a line with a length");
        assert!((way - 1.5).abs() < 1e-12 && (off - 0.5).abs() < 1e-12);
    }
}
