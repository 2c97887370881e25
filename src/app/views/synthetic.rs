//! The synthetic view beside the query, and what the cost of PM or MI makes of the two.

mod cost_bar;
mod mode;

use std::time::Duration;

use egui::{Color32, Role, Sense, TextureHandle, Ui, Vec2, WidgetInfo, vec2};

use self::mode::Mode;
use super::View;
use super::canvas::{self, PanZoom};
use crate::app::textures::color_image;
use crate::app::{Command, ShownView, ViewContext};
use crate::event::{Moment, Side, ViewRendered};
use crate::method::Method;
use crate::place::place;
use crate::problem::Problem;

/// How long each of two blinking pictures is shown \[s\].
const BLINK_S: f64 = 0.4;
/// Squares of the checkerboard from left to right.
const CHECKS: u32 = 12;

/// One picture of a direct method at a time.
pub struct SynthesisView {
    /// The method a person has chosen; `None` follows the cursor.
    chosen: Option<Method>,
    mode: Mode,
    /// Share of the view in the blend.
    blend: f32,
    pan_zoom: PanZoom,
}

impl Default for SynthesisView {
    fn default() -> Self {
        Self {
            chosen: None,
            mode: Mode::View,
            blend: 0.5,
            pan_zoom: PanZoom::default(),
        }
    }
}

impl View for SynthesisView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some(problem) = context.problem() else {
            ui.weak("The photos are being read");
            return;
        };
        let method = self.chosen.unwrap_or_else(|| context.direct_method());
        self.toolbar(ui, context, method);
        let shown = context.shown(method);
        match &shown {
            Some(shown) => {
                caption(ui, context, problem, method, shown);
                costs(ui, context, method, shown);
            }
            None => {
                let name = method.name().to_uppercase();
                ui.weak(format!(
                    "{name} has rendered nothing at this step; take the camera in hand or go on"
                ));
            }
        }
        self.legend(ui, method, shown.as_ref());
        self.picture(ui, context, problem, method, shown.as_ref());
    }
}

impl SynthesisView {
    fn toolbar(&mut self, ui: &mut Ui, context: &ViewContext<'_>, method: Method) {
        ui.horizontal_wrapped(|ui| {
            for candidate in context.direct_methods() {
                let name = candidate.name().to_uppercase();
                let response = ui.selectable_label(candidate == method, &name);
                let help = format!("Show {name} whatever the cursor is in");
                let response = response.accessible_name(format!("{name} pictures"));
                if response.on_hover_text(help).clicked() {
                    self.chosen = Some(candidate);
                }
            }
            let mut follows = self.chosen.is_none();
            let help = "Show the direct method at the cursor";
            let follow = ui.checkbox(&mut follows, "Follow").on_hover_text(help);
            if follow.accessible_name("Follow the estimator").changed() {
                self.chosen = (!follows).then_some(method);
            }
            ui.separator();
            for mode in Mode::ALL {
                let name = mode.name(method);
                let response = ui.selectable_label(self.mode == mode, name);
                let spoken = format!("Show {}", name.to_lowercase());
                let response = response.accessible_name(spoken);
                if response.on_hover_text(mode.about(method)).clicked() {
                    self.mode = mode;
                }
            }
            let mut blinks = context.options.blinking;
            let blink = ui.toggle_value(&mut blinks, "Blink");
            let help = "Query and picture in turn (B)";
            let blink = blink.accessible_name("Blink pictures").on_hover_text(help);
            if blink.clicked() {
                context.send(Command::Blink);
            }
        });
    }

    /// What the picture's colours mean; always of one height, so that the picture stays in its place.
    fn legend(&mut self, ui: &mut Ui, method: Method, shown: Option<&ShownView>) {
        /// Below this the longest legend takes two lines \[points\].
        const ONE_LINE: f32 = 800.0;
        let width = ui.available_width();
        let size = Vec2::new(width, if width < ONE_LINE { 42.0 } else { 24.0 });
        let layout = egui::Layout::left_to_right(egui::Align::Center).with_main_wrap(true);
        ui.allocate_ui_with_layout(size, layout, |ui| {
            ui.set_min_size(size);
            if self.mode == Mode::Blend {
                let slider = egui::Slider::new(&mut self.blend, 0.0..=1.0).show_value(false);
                ui.label("query");
                ui.add(slider).accessible_name("Share of the view");
                ui.label("view");
            } else {
                self.mode.legend(ui, method, shown);
            }
        });
    }

    fn picture(
        &mut self,
        ui: &mut Ui,
        context: &ViewContext<'_>,
        problem: &Problem,
        method: Method,
        shown: Option<&ShownView>,
    ) {
        let area = ui.available_rect_before_wrap();
        let (mode, blinks) = match (shown, context.options.blinking) {
            (None, _) => (Mode::Query, false),
            (Some(_), true) => (blinking(ui, self.mode), true),
            (Some(_), false) => (self.mode, false),
        };
        let name = mode.name(method).to_lowercase();
        let response = ui.allocate_rect(area, Sense::click_and_drag());
        let spoken = format!("{} picture: {name}", method.name().to_uppercase());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &spoken));

        let query = gray_query(ui, context, problem);
        // At the top, below its legend.
        let place = |pan_zoom: &PanZoom| pan_zoom.place(area, query.size_vec2(), vec2(0.5, 0.0));
        let before = place(&self.pan_zoom);
        self.pan_zoom.handle_input(ui, &response, &before);
        let at = place(&self.pan_zoom);
        let painter = ui.painter_at(area);
        let made = shown.and_then(|shown| mode.texture(ui, context, problem, shown));
        match (mode, made) {
            (Mode::Query, _) | (_, None) => at.paint(&painter, query.id(), Color32::WHITE),
            (Mode::Blend, Some(view)) => {
                at.paint(&painter, query.id(), Color32::WHITE);
                let tint = Color32::WHITE.gamma_multiply(self.blend);
                at.paint(&painter, view.id(), tint);
            }
            (Mode::Checkerboard, Some(view)) => {
                at.paint(&painter, query.id(), Color32::WHITE);
                at.paint_checks(&painter, view.id(), CHECKS);
            }
            (_, Some(picture)) => at.paint(&painter, picture.id(), Color32::WHITE),
        }
        let words = match (shown, blinks) {
            (None, _) => format!("query {}", context.frame_label(Side::Query, problem)),
            (Some(_), true) => format!("{name} (blinking)"),
            (Some(_), false) => name,
        };
        canvas::tag(&painter, at.visible().min, &words, Color32::WHITE);
    }
}

/// The picture of this moment: the query and the chosen one in turn. The next frame is asked for when
/// it is time for the other one.
fn blinking(ui: &Ui, mode: Mode) -> Mode {
    let turns = ui.input(|input| input.time) / BLINK_S;
    let rest = (turns.floor() + 1.0 - turns) * BLINK_S;
    ui.ctx()
        .request_repaint_after(Duration::from_secs_f64(rest));
    match (turns.rem_euclid(2.0) < 1.0, mode) {
        (true, _) => Mode::Query,
        (false, Mode::Query) => Mode::View,
        (false, mode) => mode,
    }
}

/// The query in grey values, as the costs see it but for their smoothing.
fn gray_query(ui: &Ui, context: &ViewContext<'_>, problem: &Problem) -> TextureHandle {
    let textures = context.textures;
    textures.of(ui.ctx(), "gray photo", &problem.query, |query| {
        color_image(&query.photo.gray.clone().into())
    })
}

/// Why the view is shown, where its camera is, what it costs and covers.
fn caption(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    problem: &Problem,
    method: Method,
    shown: &ShownView,
) {
    let name = method.name().to_uppercase();
    let place = place(&problem.reference_from_query(&shown.pose));
    ui.horizontal_wrapped(|ui| {
        ui.strong(format!("{name}, {}", shown.reason.name()));
        ui.label(place);
        if context.is_probing() {
            ui.weak("the pose asked for is being worked out");
        }
    });
    let score = &shown.comparison.score;
    let cost = score
        .cost
        .map_or("no cost".to_owned(), |cost| format!("cost {cost:.4}"));
    let share = 100.0 * f64::from(score.covered) / problem.query.intrinsics.area();
    let mut covered = format!("{} px covered, {share:.2} % of the query", score.covered);
    if let Some(at_reference) = covered_at_reference(context, method).filter(|&covered| covered > 0)
    {
        let share = f64::from(score.covered) / f64::from(at_reference);
        covered.push_str(&format!(", {share:.2} of the coverage at the reference"));
    }
    ui.horizontal_wrapped(|ui| {
        ui.strong(cost);
        ui.label(covered);
    });
}

/// Pixels that the method's view covered at the reference pose.
fn covered_at_reference(context: &ViewContext<'_>, method: Method) -> Option<u32> {
    let start = |cursor: usize| {
        let mut events = context.run.all_until::<ViewRendered>(cursor);
        let start = events.find(|(_, event)| event.moment == Moment::Start)?;
        Some(start.1.comparison.score.covered)
    };
    match context
        .part_of(method)
        .and_then(|(_, cursor)| start(cursor))
    {
        None => start(context.cursor),
        covered => covered,
    }
}

/// The place of the cost between that of shuffled pixels and that of the truth; for both methods
/// where a pose of one's own was tried.
fn costs(ui: &mut Ui, context: &ViewContext<'_>, method: Method, shown: &ShownView) {
    let probe = context.looking_at().and_then(|_| context.probe());
    match probe {
        Some(probe) => {
            for (method, comparison) in &probe.comparisons {
                let bounds = context.cost_bounds(*method);
                cost_bar::ui(ui, *method, &bounds, comparison.score.cost);
            }
        }
        None => {
            let bounds = context.cost_bounds(method);
            cost_bar::ui(ui, method, &bounds, shown.comparison.score.cost);
        }
    }
}
