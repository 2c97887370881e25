//! MLESAC: every hypothesis, the best so far, and the test of the result.

mod trials;
mod verdict;

use std::ops::Range;
use std::sync::Arc;

use egui::{Color32, Ui};
use egui_plot::{GridInput, GridMark, Line, LineStyle, Plot, PlotPoint, PlotUi, Points, VLine};

use super::View;
use crate::app::{Command, ViewContext, theme};
use crate::event::HypothesisTried;
use crate::method::Method;
use crate::session::{Loaded, Span};

use trials::Trials;

/// Likelihood and inliers by hypothesis, the sample at the cursor, and the test of the result.
#[derive(Default)]
pub struct RansacView {
    known: Option<(TrialsKey, Trials)>,
}

/// What the trials were read from.
struct TrialsKey {
    /// Kept alive, so that its address stays its own: each run has one.
    loaded: Arc<Loaded>,
    records: Range<usize>,
}

/// The number of each trial that a plot shows.
#[derive(Clone, Copy, PartialEq, Eq)]
enum PlotQuantity {
    Likelihood,
    Inliers,
    Needed,
}

impl PlotQuantity {
    const ALL: [Self; 3] = [Self::Likelihood, Self::Inliers, Self::Needed];

    fn name(self) -> &'static str {
        match self {
            Self::Likelihood => "log likelihood",
            Self::Inliers => "inliers",
            Self::Needed => "trials needed",
        }
    }
}

impl View for RansacView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            let source = source(context);
            let trials = source.and_then(|(span, end)| self.read(context, span.records.start..end));
            let (Some((span, end)), Some(trials)) = (source, trials) else {
                ui.weak(
                    "No hypothesis yet. Run FB (1), which tries hypotheses in its stage ransac",
                );
                return;
            };
            head(ui, context, span, trials);
            plots(ui, context, trials);
            verdict::ui(ui, context, span, end, trials);
        });
    }
}

/// The part of the run with the trials, and the end of its records up to the cursor. That of FB, unless the
/// cursor is in the hybrid, which runs FB inside itself.
fn source<'a>(context: &ViewContext<'a>) -> Option<(&'a Span, usize)> {
    let is_inside =
        context.is_inside_hybrid(Method::FB) && context.latest::<HypothesisTried>().is_some();
    let (span, cursor) =
        if is_inside { (context.span()?, context.cursor) } else { context.part_of(Method::FB)? };
    Some((span, span.records.end.min(cursor + 1)))
}

impl RansacView {
    /// The trials among some records. They are read again only when the cursor moves.
    fn read(&mut self, context: &ViewContext<'_>, records: Range<usize>) -> Option<&Trials> {
        let loaded = context.run.loaded.as_ref()?;
        let is_known = self
            .known
            .as_ref()
            .is_some_and(|(key, _)| Arc::ptr_eq(&key.loaded, loaded) && key.records == records);
        if !is_known {
            let key = TrialsKey { loaded: Arc::clone(loaded), records: records.clone() };
            let trials = Trials::read(context.run.records().get(records.clone())?, records.start);
            self.known = Some((key, trials));
        }
        let (_, trials) = self.known.as_ref()?;
        (trials.made() > 0).then_some(trials)
    }
}

fn head(ui: &mut Ui, context: &ViewContext<'_>, span: &Span, trials: &Trials) {
    ui.horizontal_wrapped(|ui| {
        if let Some(method) = span.part.method().filter(|method| *method != Method::FB) {
            ui.weak(format!("inside {}", method.label()));
        }
        let most = context.run.params.fb.mlesac.max_trials;
        let made = trials.made();
        ui.label(match trials.needed().filter(|needed| *needed < most) {
            Some(needed) => format!("{made} trials made, {needed} needed"),
            None => format!("{made} trials made, more are needed than the {most} allowed"),
        });
        if trials.without_pose > 0 {
            ui.weak(format!("{} samples have no pose", trials.without_pose));
        }
    });
    ui.horizontal_wrapped(|ui| {
        let legend = |ui: &mut Ui, color: Color32, words: &str| {
            let (rect, _) = ui.allocate_exact_size(egui::vec2(14.0, 3.0), egui::Sense::hover());
            ui.painter().rect_filled(rect, 0.0, color);
            ui.weak(words);
        };
        legend(ui, hypothesis_color(), "hypothesis");
        legend(ui, theme::ESTIMATE, "best so far, refined");
        legend(ui, ui.visuals().strong_text_color(), "cursor");
        ui.weak("(click a point to go there)");
    });
}

fn hypothesis_color() -> Color32 {
    theme::method(Method::FB)
}

fn plots(ui: &mut Ui, context: &ViewContext<'_>, trials: &Trials) {
    let group = ui.make_persistent_id("trials");
    for quantity in PlotQuantity::ALL {
        let height = if quantity == PlotQuantity::Needed { 110.0 } else { 130.0 };
        let is_last = quantity == PlotQuantity::Needed;
        let mut plot = Plot::new(quantity.name())
            .height(height)
            .link_axis(group, [true, false])
            .allow_scroll(false)
            .show_x(false)
            .show_y(false)
            .y_axis_min_width(62.0)
            .y_axis_label(quantity.name());
        if is_last {
            plot = plot
                .x_axis_label("trial")
                .y_grid_spacer(decades)
                .y_axis_formatter(|mark, _| format!("{:.0}", 10_f64.powf(mark.value)));
        }
        let answer = plot.show(ui, |plot| draw(plot, trials, quantity));
        let name = format!("{} by trial, {} trials", quantity.name(), trials.made());
        answer.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &name));
        if let (true, Some(at)) =
            (answer.response.clicked(), answer.response.interact_pointer_pos())
        {
            let distance = |[trial, value]: [f64; 2]| {
                let point = PlotPoint::new(trial, value);
                answer.transform.position_from_point(&point).distance_sq(at)
            };
            if let Some(record) = trials.nearest(points_of(trials, quantity), distance) {
                context.send(Command::MoveCursor(record));
            }
        }
    }
}

/// The points of a plot that can be clicked; the last plot has the corners of its line.
fn points_of(trials: &Trials, quantity: PlotQuantity) -> &[[f64; 2]] {
    match quantity {
        PlotQuantity::Likelihood => &trials.likelihood.points,
        PlotQuantity::Inliers => &trials.inliers.points,
        PlotQuantity::Needed => &trials.needed_steps,
    }
}

fn draw<'p>(plot: &mut PlotUi<'p>, trials: &'p Trials, quantity: PlotQuantity) {
    let line = |name: &str, points: &'p [[f64; 2]]| // Bands would fill the corners of steps.
        Line::new(name, points.to_vec())
            .allow_band(false)
            .allow_hover(false);
    if let Some(trial) = trials.at_cursor() {
        let color = plot.ctx().global_style().visuals.strong_text_color();
        let cursor = VLine::new("cursor", trial.index as f64).color(color);
        plot.vline(cursor.width(1.0).allow_hover(false));
    }
    let series = match quantity {
        PlotQuantity::Likelihood => &trials.likelihood,
        PlotQuantity::Inliers => &trials.inliers,
        PlotQuantity::Needed => {
            let needed = line("needed", &trials.needed_steps);
            plot.line(needed.color(theme::ESTIMATE).width(1.5));
            let made = line("made", &trials.made_curve);
            let color = plot.ctx().global_style().visuals.weak_text_color();
            plot.line(made.color(color).style(LineStyle::dashed_loose()));
            return;
        }
    };
    let points = Points::new("hypotheses", series.points.clone());
    plot.points(points.radius(1.6).color(hypothesis_color()).allow_hover(false));
    plot.line(line("best", &series.best).color(theme::ESTIMATE).width(1.5));
}

/// Lines at 1, 10, 100 …, for logarithms to base ten.
fn decades(input: GridInput) -> Vec<GridMark> {
    let (from, to) = input.bounds;
    (from.ceil().max(0.0) as i32..=to.floor().min(12.0) as i32)
        .map(|decade| GridMark { value: f64::from(decade), step_size: 1.0 })
        .collect()
}
