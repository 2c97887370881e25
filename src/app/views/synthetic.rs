//! The synthetic view beside the query, and what the cost of PM or MI makes of the two.

mod cost_bar;
mod mode;

use std::time::Duration;

use egui::{Color32, Sense, TextureHandle, Ui, Vec2, vec2};

use self::mode::Mode;
use super::View;
use super::canvas::{self, PanZoom};
use super::legend::name_picture;
use super::ovals::Ovals;
use crate::app::action::{Action, toggle};
use crate::app::textures::color_image;
use crate::app::{ShownReason, ShownView, ViewContext};
use crate::event::{Moment, Side};
use crate::method::Method;
use crate::place::place;
use crate::problem::Problem;

/// How long each of two blinking pictures is shown \[s\].
const BLINK_S: f64 = 0.4;
/// From this width on there is room for switches, costs and a legend \[points\].
const LARGE: f32 = 560.0;

/// One picture of a direct method at a time.
pub struct SynthesisView {
    mode: Mode,
    /// Share of the view in the blend.
    blend: f32,
    pan_zoom: PanZoom,
}

impl Default for SynthesisView {
    fn default() -> Self {
        Self { mode: Mode::View, blend: 0.5, pan_zoom: PanZoom::default() }
    }
}

impl View for SynthesisView {
    fn ui(&mut self, ui: &mut Ui, context: &ViewContext<'_>) {
        let Some(problem) = context.problem() else {
            ui.weak("The photos are being read.");
            return;
        };
        let method = context.direct_method();
        let is_large = ui.available_width() >= LARGE;
        if is_large {
            self.switches(ui, context, method);
        }
        let shown = context.shown(method);
        match &shown {
            Some(shown) => caption(ui, context, problem, method, shown),
            None => {
                let name = method.label();
                let words =
                    format!("{name} has rendered nothing yet. Click on a map to see its view.");
                ui.add(egui::Label::new(egui::RichText::new(words).weak()).truncate());
            }
        }
        if let Some(shown) = shown.as_ref().filter(|_| is_large) {
            costs(ui, context, method, shown);
            self.legend(ui, method, Some(shown));
        }
        self.picture(ui, context, problem, method, shown.as_ref());
    }
}

impl SynthesisView {
    fn switches(&mut self, ui: &mut Ui, context: &ViewContext<'_>, method: Method) {
        ui.horizontal_wrapped(|ui| {
            for mode in Mode::ALL {
                let name = mode.name(method);
                let response = ui.selectable_label(self.mode == mode, name);
                let spoken = format!("Show {}", name.to_lowercase());
                let response = response.accessible_name(spoken);
                if response.on_hover_text(mode.about(method)).clicked() {
                    self.mode = mode;
                }
            }
            let blink = toggle(
                ui,
                context,
                "Blink",
                const { Action::named("Blink between query and synthetic view") },
            );
            blink.accessible_name("Blink pictures");
        });
    }

    /// What the picture's colours mean; always of one height, so that the picture stays in its place.
    fn legend(&mut self, ui: &mut Ui, method: Method, shown: Option<&ShownView>) {
        let size = Vec2::new(ui.available_width(), 24.0);
        let layout = egui::Layout::left_to_right(egui::Align::Center);
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
        name_picture(&response, format!("{} picture: {name}", method.label()));

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
            (_, Some(picture)) => at.paint(&painter, picture.id(), Color32::WHITE),
        }
        // They belong to the query as the result sees it.
        let is_result = shown.is_some_and(|shown| shown.reason == ShownReason::Event(Moment::End));
        let ovals = match mode {
            Mode::Query | Mode::View | Mode::Blend if is_result => {
                Ovals::of(context, problem, method)
            }
            _ => Ovals::default(),
        };
        ovals.draw(&at.painter(&painter), &at);
        let words = match (shown, blinks) {
            (None, _) => {
                format!("query {}", context.setup.label_of(Side::Query, problem.query().name()))
            }
            (Some(_), true) => format!("{name} (blinking)"),
            (Some(_), false) => name,
        };
        canvas::tag(&painter, at.visible().min, &(words + ovals.words()), Color32::WHITE);
    }
}

/// The picture of this moment: the query and the chosen one in turn. The next frame is asked for when
/// it is time for the other one.
fn blinking(ui: &Ui, mode: Mode) -> Mode {
    let turns = ui.input(|input| input.time) / BLINK_S;
    let rest = (turns.floor() + 1.0 - turns) * BLINK_S;
    ui.ctx().request_repaint_after(Duration::from_secs_f64(rest));
    match (turns.rem_euclid(2.0) < 1.0, mode) {
        (true, _) => Mode::Query,
        (false, Mode::Query) => Mode::View,
        (false, mode) => mode,
    }
}

/// The query in grey values, as the costs see it but for their smoothing.
fn gray_query(ui: &Ui, context: &ViewContext<'_>, problem: &Problem) -> TextureHandle {
    let textures = &context.state.textures;
    textures.of(ui.ctx(), "gray photo", problem.query(), |query| {
        color_image(&query.photo().gray.clone().into())
    })
}

/// Why the view is shown, where its camera is, what it costs and covers; in one line, whole on hover.
fn caption(
    ui: &mut Ui,
    context: &ViewContext<'_>,
    problem: &Problem,
    method: Method,
    shown: &ShownView,
) {
    let score = &shown.comparison.score;
    let cost = score.cost.map_or("no cost".to_owned(), |cost| format!("cost {cost:.4}"));
    let share = 100.0 * f64::from(score.covered) / problem.query().intrinsics().area();
    let words = format!(
        "{}, {}: {cost}, {} px covered ({share:.1} %), {}",
        method.label(),
        shown.reason.name(),
        score.covered,
        place(&problem.reference_from_query(&shown.pose))
    );
    ui.horizontal(|ui| {
        if context.state.is_probing() {
            ui.spinner();
        }
        ui.add(egui::Label::new(context.in_unit(&words)).wrap());
    });
}

/// The place of the cost between that of shuffled pixels and that of the truth; for both methods
/// where a pose of one's own was tried.
fn costs(ui: &mut Ui, context: &ViewContext<'_>, method: Method, shown: &ShownView) {
    match context.state.looking_at().and_then(|_| context.state.scoring.probe()) {
        Some(probe) => {
            for (method, comparison) in &probe.comparisons {
                cost_bar::ui(ui, context, *method, comparison.score.cost);
            }
        }
        None => cost_bar::ui(ui, context, method, shown.comparison.score.cost),
    }
}
