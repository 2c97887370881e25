//! What colours and marks of a picture mean, one bar and one mark for one thing in every view; and what is under the
//! pointer.

use egui::{
    Align, Align2, Color32, FontId, Label, Mesh, Painter, Pos2, Rect, Response, RichText, Role,
    Sense, Shape, Stroke, StrokeKind, TextStyle, Ui, UiBuilder, Vec2, WidgetInfo, pos2, vec2,
};
use egui_plot::{HoverPosition, MarkerShape, PlotPoint};

use crate::app::{ViewContext, theme};
use crate::diagnosis::Grade;
use crate::geometry::{Pose, PoseError};
use crate::method::Method;
use crate::palette;
use crate::proof::Thing;

/// Says to assistive technology what a picture shows.
pub(super) fn name_picture(response: &Response, words: impl Into<String>) {
    let words = words.into();
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, &words));
}

/// A bar of colours from 0 to 1, with words at some of its places beneath it. `name` says what it
/// shows, with the unit.
pub(super) fn color_bar(
    ui: &mut Ui,
    width: f32,
    name: &str,
    color: impl Fn(f64) -> Color32,
    ticks: &[(f64, &str)],
) {
    const BAR: f32 = 9.0;
    let font = TextStyle::Small.resolve(ui.style());
    let size = vec2(width, BAR + 2.0 + font.size);
    let (rect, response) = ui.allocate_exact_size(size, Sense::hover());
    name_picture(&response, name);
    response.on_hover_text(name);
    let at = |share: f64| rect.left() + share as f32 * rect.width();
    let painter = ui.painter();
    let bar = rect.with_max_y(rect.top() + BAR);
    gradient(painter, bar, color);
    let text = ui.visuals().text_color();
    for (share, words) in ticks {
        let x = at(*share);
        painter.vline(x, bar.bottom() - 3.0..=bar.bottom() + 2.0, (1.0, text));
        let galley = painter.layout_no_wrap((*words).to_owned(), font.clone(), text);
        // Words at an end stay within the bar.
        let half = 0.5 * galley.size().x;
        let middle = x.max(rect.left() + half).min(rect.right() - half);
        painter.galley(pos2(middle - half, bar.bottom() + 1.0), galley, text);
    }
}

/// Fills a rectangle with colours from 0 on the left to 1 on the right.
pub(super) fn gradient(painter: &Painter, rect: Rect, color: impl Fn(f64) -> Color32) {
    const STEPS: u32 = 32;
    let mut mesh = Mesh::default();
    for step in 0..=STEPS {
        let share = f64::from(step) / f64::from(STEPS);
        let x = rect.left() + share as f32 * rect.width();
        mesh.colored_vertex(pos2(x, rect.top()), color(share));
        mesh.colored_vertex(pos2(x, rect.bottom()), color(share));
        if step > 0 {
            let here = 2 * step;
            mesh.add_triangle(here - 2, here - 1, here);
            mesh.add_triangle(here, here - 1, here + 1);
        }
    }
    painter.add(mesh);
}

/// The bar of [`palette::viridis`] between two numbers.
pub(super) fn cost_bar(ui: &mut Ui, width: f32, what: &str, [dark, bright]: &[String; 2]) {
    let name = format!("Colours of {what}: {dark} is dark, {bright} is bright");
    color_bar(ui, width, &name, theme::viridis, &[(0.0, dark), (1.0, bright)]);
}

/// A square of a colour.
pub(super) fn swatch(ui: &mut Ui, color: Color32) {
    let (rect, _) = ui.allocate_exact_size(Vec2::splat(10.0), Sense::hover());
    let rim = Stroke::new(1.0, ui.visuals().weak_text_color());
    ui.painter().rect(rect, 1.0, color, rim, StrokeKind::Inside);
}

/// The mark of a result. It has the colour of its grade, which is grey where the truth is unknown or hidden.
pub(super) fn result(context: &ViewContext<'_>, pose: &Pose) -> Thing {
    let right = context.setup.task.protocol.right;
    let grade = match context.truth() {
        None => Grade::Unmeasured,
        Some(truth) if right.contains(&PoseError::between(truth, pose)) => Grade::Right,
        Some(_) => Grade::Wrong,
    };
    Thing::Result(palette::grade(grade))
}

/// The name of a method in its colour.
pub(super) fn method_name(ui: &Ui, method: Method) -> RichText {
    RichText::new(method.label()).color(theme::text(ui.visuals(), theme::method(method)))
}

/// How far a pose is from the truth, in words, if that is known and shown.
pub(super) fn from_truth(context: &ViewContext<'_>, pose: &Pose) -> Option<String> {
    let error = PoseError::between(context.truth()?, pose);
    Some(context.in_unit(&format!("{}, {}", error.translation(), error.rotation())))
}

/// Writes what is at the point of a plot under the pointer; `words` take the name of its line.
pub(super) fn at_points<'a>(
    words: impl Fn(&str, PlotPoint) -> String + 'a,
) -> impl Fn(&HoverPosition<'_>) -> Option<String> + 'a {
    move |position| match position {
        HoverPosition::NearDataPoint { plot_name, position, .. } => {
            Some(words(plot_name, *position))
        }
        HoverPosition::Elsewhere { .. } => None,
    }
}

/// The stretches of a curve where it is known.
pub(super) fn stretches(curve: &[Option<[f64; 2]>]) -> impl Iterator<Item = Vec<[f64; 2]>> {
    let known = curve.split(Option::is_none).filter(|stretch| !stretch.is_empty());
    known.map(|stretch| stretch.iter().copied().flatten().collect())
}

/// Paints a mark of a radius \[points\] in its shape and colour, with a dark rim.
pub(crate) fn paint_mark(painter: &Painter, thing: Thing, at: Pos2, radius: f32) {
    let color = theme::rgb(thing.color());
    for stroke in [Stroke::new(5.0, Color32::BLACK), Stroke::new(2.5, color)] {
        match thing {
            Thing::Reference => {
                painter.circle_stroke(at, radius, stroke);
            }
            Thing::Truth => {
                painter.hline(at.x - radius..=at.x + radius, at.y, stroke);
                painter.vline(at.x, at.y - radius..=at.y + radius, stroke);
            }
            Thing::Result(_) => {
                let corners = [vec2(0.0, -1.0), vec2(1.0, 0.0), vec2(0.0, 1.0), vec2(-1.0, 0.0)];
                let corners = corners.map(|corner| at + radius * corner);
                painter.add(Shape::closed_line(corners.to_vec(), stroke));
            }
            Thing::Dot(_) => {
                painter.circle_stroke(at, 3.0 / 7.0 * radius, stroke);
            }
            Thing::Words => {}
        }
    }
}

/// Paints the ring of a minimum with its number.
pub(super) fn paint_minimum(painter: &Painter, number: &str, at: Pos2, radius: f32) {
    painter.circle_filled(at, radius + 1.5, Color32::BLACK);
    painter.circle_stroke(at, radius, Stroke::new(1.5, Color32::WHITE));
    let font = FontId::proportional(1.7 * radius);
    painter.text(at, Align2::CENTER_CENTER, number, font, Color32::WHITE);
}

/// The shape of a mark in a plot.
pub(super) fn plot_shape(thing: Thing) -> MarkerShape {
    match thing {
        Thing::Truth => MarkerShape::Plus,
        Thing::Result(_) => MarkerShape::Diamond,
        Thing::Reference | Thing::Dot(_) | Thing::Words => MarkerShape::Circle,
    }
}

/// A mark for a place in a photo; the shape tells the state as the colour does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MarkShape {
    /// A cross of two diagonals.
    Cross,
    /// A cross of an upright and a level line.
    Plus,
    /// An open triangle.
    Triangle,
    /// An open circle.
    Ring,
    /// An open diamond.
    Diamond,
    /// A filled circle.
    Disc,
    /// An open square.
    Square,
}

impl MarkShape {
    /// Paints the mark with a radius \[points\].
    pub(super) fn paint(self, painter: &Painter, at: Pos2, radius: f32, color: Color32) {
        let thin = Stroke::new(1.3, color);
        let cross = |arms: [egui::Vec2; 2], stroke: Stroke| {
            for arm in arms {
                painter.line_segment([at - radius * arm, at + radius * arm], stroke);
            }
        };
        // A regular polygon; its first corner is on top for a turn of 0 sides.
        let outline = |sides: u16, turn: f32, size: f32| {
            let corner = |side: u16| {
                let angle = std::f32::consts::TAU * (f32::from(side) + turn) / f32::from(sides);
                at + size * radius * vec2(angle.sin(), -angle.cos())
            };
            painter.add(Shape::closed_line((0..sides).map(corner).collect(), thin));
        };
        match self {
            Self::Cross => cross([vec2(0.75, 0.75), vec2(0.75, -0.75)], thin),
            Self::Plus => cross([vec2(1.0, 0.0), vec2(0.0, 1.0)], Stroke::new(2.0, color)),
            Self::Triangle => outline(3, 0.0, 1.25),
            Self::Diamond => outline(4, 0.0, 1.2),
            Self::Square => outline(4, 0.5, 1.2),
            Self::Ring => {
                painter.circle_stroke(at, radius, thin);
            }
            Self::Disc => {
                painter.circle_filled(at, radius, color);
            }
        }
    }
}

/// Room for the line. What is under the pointer is known only when the picture is drawn, but it is
/// written above it, where it stays in its place.
pub(super) struct Readout(Rect);

impl Readout {
    pub(super) fn reserve(ui: &mut Ui) -> Self {
        let size = vec2(ui.available_width(), ui.text_style_height(&TextStyle::Body));
        Self(ui.allocate_space(size).1)
    }

    /// Writes what is under the pointer, or else what could be done.
    pub(super) fn say(self, ui: &mut Ui, words: Option<&str>, otherwise: &str) -> Response {
        let text = match words {
            Some(words) => RichText::new(words).strong(),
            None => RichText::new(otherwise).weak(),
        };
        let mut line = ui.new_child(UiBuilder::new().max_rect(self.0));
        line.add(Label::new(text).truncate().halign(Align::LEFT))
    }
}
