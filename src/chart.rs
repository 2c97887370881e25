//! Charts as SVG: two axes, marks in their units, and a legend.

use maud::{Markup, PreEscaped, html};
use nalgebra::Point2;

use crate::palette::Rgb;
use crate::scale::LengthUnit;

/// The size of the plot area \[px\].
const SIZE: (f64, f64) = (500.0, 300.0);
/// The margins: left, top, right, bottom \[px\].
const AROUND: [f64; 4] = [52.0, 24.0, 12.0, 44.0];
/// The height of a line of the legend, and the least width of an entry \[px\].
const LEGEND: (f64, f64) = (18.0, 92.0);
/// What an entry of the legend has around its name, and about the width of a letter \[px\].
const NAMED: (f64, f64) = (24.0, 6.0);

/// A chart with two axes.
#[derive(Clone, Debug)]
pub(crate) struct Chart {
    pub title: String,
    pub x: Axis,
    pub y: Axis,
    /// From bottom to top.
    pub marks: Vec<Mark>,
    pub legend: Vec<(String, Rgb)>,
}

impl Chart {
    /// Says in the unit what titles and labels say in metres.
    pub fn in_words_of(mut self, unit: LengthUnit) -> Self {
        let marked = self.marks.iter_mut().flat_map(|mark| {
            let words = match &mut mark.shape {
                Shape::Words { text, .. } => Some(text),
                _ => None,
            };
            words.into_iter().chain([&mut mark.title])
        });
        let axes = [&mut self.x, &mut self.y].into_iter();
        let labels = axes.flat_map(|axis| {
            let ticks = axis.ticks.iter_mut().map(|(_, label)| label);
            ticks.chain([&mut axis.label])
        });
        for text in marked.chain(labels).chain([&mut self.title]) {
            *text = unit.words(text);
        }
        self
    }
}

/// An axis with its numbers or names.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    label: String,
    ends: (f64, f64),
    is_log: bool,
    ticks: Vec<(f64, String)>,
    length_px: Option<f64>,
}

/// A coloured shape, in the units of the axes.
#[derive(Clone, Debug)]
pub(crate) struct Mark {
    pub shape: Shape,
    pub color: Rgb,
    /// The tooltip.
    pub title: String,
    /// The link target in the page.
    pub link: Option<String>,
}

#[derive(Clone, Debug)]
pub(crate) enum Shape {
    Line(Vec<(f64, f64)>),
    /// A dot, hollow for a result without a measurement.
    Dot {
        at: (f64, f64),
        filled: bool,
    },
    /// A rectangle between two corners.
    Bar {
        from: (f64, f64),
        to: (f64, f64),
    },
    /// Text, moved by `by` pixels.
    Words {
        at: (f64, f64),
        by: (f64, f64),
        text: String,
    },
}

impl Mark {
    pub(crate) fn new(shape: Shape, color: Rgb) -> Self {
        Self { shape, color, title: String::new(), link: None }
    }

    /// Text centred at a position.
    pub(crate) fn words(text: impl Into<String>, at: (f64, f64), by: (f64, f64)) -> Self {
        let text = text.into();
        Self::new(Shape::Words { at, by, text }, [0; 3])
    }

    /// Sets the tooltip.
    pub(crate) fn titled(mut self, title: impl Into<String>) -> Self {
        self.title = title.into();
        self
    }
}

impl Axis {
    /// A linear axis with ticks at round numbers.
    pub(crate) fn linear(label: impl Into<String>, from: f64, to: f64) -> Self {
        let to = if to > from { to } else { from + 1e-3 };
        let step = round_up((to - from) / 6.0);
        let first = (from / step).ceil();
        let ticks = (0..=6).map(|index| first + f64::from(index));
        let ticks = ticks.map(|count| count * step).filter(|tick| *tick <= to * (1.0 + 1e-9));
        let decimals = (-step.log10().floor()).max(0.0) as usize;
        Self {
            label: label.into(),
            ends: (from, to),
            is_log: false,
            ticks: ticks.map(|tick| (tick, format!("{tick:.decimals$}"))).collect(),
            length_px: None,
        }
    }

    /// A linear axis from one end to another, which may be the lesser.
    pub(crate) fn between(label: impl Into<String>, ends: (f64, f64)) -> Self {
        Self { ends, ..Self::linear(label, ends.0.min(ends.1), ends.0.max(ends.1)) }
    }

    /// An axis from 0 to 100 %.
    pub(crate) fn percent(label: impl Into<String>) -> Self {
        Self::linear(label, 0.0, 100.0)
    }

    /// A logarithmic axis with ticks at powers of ten.
    pub(crate) fn log(label: impl Into<String>, from: f64, to: f64) -> Self {
        /// More have no room.
        const MOST: usize = 12;
        let [from, to] = [from, to].map(|end| end.clamp(1e-300, 1e300));
        let powers = from.log10().ceil() as i32..=to.log10().floor() as i32;
        let step = powers.clone().count().div_ceil(MOST).max(1);
        let ticks = powers.step_by(step).map(|power| 10_f64.powi(power));
        Self {
            ticks: ticks.map(|tick| (tick, format!("{tick}"))).collect(),
            is_log: true,
            ..Self::linear(label, from, to)
        }
    }

    /// An axis with a slot of width 1 per name.
    pub(crate) fn named(label: impl Into<String>, names: impl IntoIterator<Item = String>) -> Self {
        let names = names.into_iter().enumerate();
        let ticks: Vec<_> = names.map(|(at, name)| (at as f64 + 0.5, name)).collect();
        Self { ends: (0.0, ticks.len().max(1) as f64), ticks, ..Self::linear(label, 0.0, 1.0) }
    }

    pub(crate) fn long(mut self, length_px: f64) -> Self {
        self.length_px = Some(length_px);
        self
    }

    /// The position of a number on the axis, from 0 to 1.
    fn share(&self, value: f64) -> f64 {
        let scale = |value: f64| if self.is_log { value.log10() } else { value };
        let (from, to) = (scale(self.ends.0), scale(self.ends.1));
        (scale(value) - from) / (to - from)
    }
}

/// Axes for places on the ground, right and ahead of the first. The longer side lies across the page.
pub(crate) struct GroundAxes {
    pub x: Axis,
    pub y: Axis,
    is_long: bool,
}

impl GroundAxes {
    /// `None` for no place.
    pub(crate) fn of(places: &[Point2<f64>]) -> Option<Self> {
        /// The longer side of the plot, and the least of the shorter \[px\].
        const SIDES_PX: [f64; 2] = [700.0, 160.0];
        let first = *places.first()?;
        let (least, most) =
            places.iter().fold((first, first), |(least, most), at| (least.inf(at), most.sup(at)));
        let (middle, extent) = (nalgebra::center(&least, &most), most - least);
        let m_per_px = (extent.max() * 1.1).max(1e-6) / SIDES_PX[0];
        let is_long = extent.y > extent.x;
        let axis = |at: usize| {
            let label = if at == 0 { "right (m)" } else { "ahead (m)" };
            let length_px = (1.1 * extent[at] / m_per_px).max(SIDES_PX[1]);
            let half = 0.5 * length_px * m_per_px;
            let (from, to) = (middle[at] - half, middle[at] + half);
            // With ahead to the right, right is down.
            let ends = if is_long && at == 0 { (to, from) } else { (from, to) };
            Axis::between(label, ends).long(length_px)
        };
        let (across, up) = if is_long { (1, 0) } else { (0, 1) };
        Some(Self { x: axis(across), y: axis(up), is_long })
    }

    /// Where a place is on the axes.
    pub(crate) fn place(&self, at: &Point2<f64>) -> (f64, f64) {
        if self.is_long { (at.y, at.x) } else { (at.x, at.y) }
    }
}

impl Chart {
    fn inside(&self) -> (f64, f64) {
        let (width, height) = (self.x.length_px, self.y.length_px);
        (width.unwrap_or(SIZE.0), height.unwrap_or(SIZE.1))
    }

    /// The width of each entry of the legend, so that the longest name fits \[px\], and how many are in a row.
    fn legend_entries(&self) -> (f64, usize) {
        let letters = self.legend.iter().map(|(name, _)| name.chars().count()).max();
        let width = LEGEND.1.max(NAMED.0 + NAMED.1 * letters.unwrap_or(0) as f64);
        (width, (self.inside().0 / width).max(1.0) as usize)
    }

    fn legend_rows(&self) -> f64 {
        self.legend.len().div_ceil(self.legend_entries().1) as f64
    }

    fn size(&self) -> (f64, f64) {
        let ((width, height), [left, above, right, below]) = (self.inside(), AROUND);
        (width + left + right, height + above + below + LEGEND.0 * self.legend_rows())
    }

    /// The chart as part of a page, or with a title, this far down in a file of its own.
    pub(crate) fn svg(&self, down: Option<f64>) -> Markup {
        let is_alone = down.is_some();
        let ((width, height), (inner, tall)) = (self.size(), self.inside());
        let (left, top) = (AROUND[0], AROUND[1]);
        let x = |value: f64| format!("{:.1}", left + inner * self.x.share(value));
        let y = |value: f64| format!("{:.1}", top + tall * (1.0 - self.y.share(value)));
        let bottom = top + tall;
        let below = bottom + 34.0;
        html! {
            svg role="img" aria-label=(self.title) width=(width) height=(height) y=[down]
                viewBox={ "0 0 " (width) " " (height) } font-family="sans-serif" font-size="11" {
                @if is_alone { text x=(left) y="14" font-size="13" { (self.title) } }
                g stroke="#ddd" {
                    @for (at, _) in &self.y.ticks { path d={ "M" (left) " " (y(*at)) "h" (inner) } {} }
                }
                path d={ "M" (left) " " (top) "v" (tall) "h" (inner) } fill="none" stroke="#000" {}
                g text-anchor="middle" {
                    @for (at, name) in &self.x.ticks { text x=(x(*at)) y=(bottom + 15.0) { (name) } }
                    text x=(left + inner / 2.0) y=(bottom + 31.0) { (self.x.label) }
                    text transform={ "translate(12 " (top + tall / 2.0) ") rotate(-90)" } { (self.y.label) }
                }
                g text-anchor="end" {
                    @for (at, name) in &self.y.ticks { text x=(left - 5.0) y=(y(*at)) dy="4" { (name) } }
                }
                @for mark in &self.marks {
                    @if let (Some(link), false) = (&mark.link, is_alone) {
                        a href=(link) { (drawn(mark, &x, &y)) }
                    } @else { (drawn(mark, &x, &y)) }
                }
                @for (at, (name, color)) in self.legend.iter().enumerate() {
                    @let (wide, in_row) = self.legend_entries();
                    @let (column, row) = ((at % in_row) as f64, (at / in_row) as f64);
                    @let (from, line) = (left + wide * column, below + 4.0 + LEGEND.0 * row);
                    rect x=(from) y=(line) width="10" height="10" fill=(hex(*color)) {}
                    text x=(from + 14.0) y=(line + 9.0) { (name) }
                }
            }
        }
    }
}

fn drawn(mark: &Mark, x: &dyn Fn(f64) -> String, y: &dyn Fn(f64) -> String) -> Markup {
    let color = hex(mark.color);
    let title = html! { @if !mark.title.is_empty() { title { (mark.title) } } };
    match &mark.shape {
        Shape::Line(points) => {
            let points: Vec<String> =
                points.iter().map(|at| format!("{},{}", x(at.0), y(at.1))).collect();
            html! { polyline points=(points.join(" ")) fill="none" stroke=(color) stroke-width="2" { (title) } }
        }
        Shape::Dot { at, filled: true } => {
            html! { circle cx=(x(at.0)) cy=(y(at.1)) r="3" fill=(color) fill-opacity="0.7" { (title) } }
        }
        Shape::Dot { at, filled: false } => {
            html! { circle cx=(x(at.0)) cy=(y(at.1)) r="3" fill="none" stroke=(color) { (title) } }
        }
        Shape::Bar { from, to } => html! {
            path d={ "M" (x(from.0)) " " (y(from.1)) "H" (x(to.0)) "V" (y(to.1)) "H" (x(from.0)) "Z" }
                fill=(color) { (title) }
        },
        Shape::Words { at, by, text } => html! {
            text x=(x(at.0)) y=(y(at.1)) dx=(by.0) dy=(by.1) text-anchor="middle" { (text) }
        },
    }
}

/// An SVG file with the charts below each other.
pub(crate) fn file(charts: &[Chart]) -> String {
    let width = charts.iter().map(|chart| chart.size().0).fold(0.0, f64::max);
    let height: f64 = charts.iter().map(|chart| chart.size().1).sum();
    let mut down = 0.0;
    let stacked = charts.iter().map(|chart| {
        let svg = chart.svg(Some(down));
        down += chart.size().1;
        svg.into_string()
    });
    let stacked: String = stacked.collect();
    html! {
        svg xmlns="http://www.w3.org/2000/svg" width=(width) height=(height)
            viewBox={ "0 0 " (width) " " (height) } {
            rect width="100%" height="100%" fill="#fff" {}
            (PreEscaped(stacked))
        }
    }
    .into_string()
        + "\n"
}

/// A colour in HTML notation.
pub(crate) fn hex([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The next of 1, 2, 5 times a power of ten.
pub(crate) fn round_up(width: f64) -> f64 {
    let power = 10_f64.powf(width.max(1e-9).log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    let enough = steps.into_iter().find(|step| step * power >= width);
    enough.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_lie_between_the_axes_and_their_words_are_no_markup() {
        let dot = Shape::Dot { at: (1.0, 10.0), filled: true };
        let mut mark = Mark::new(dot, [0, 114, 178]).titled("a < \"b\"");
        mark.link = Some("#r1".to_owned());
        let chart = Chart {
            title: "errors".to_owned(),
            x: Axis::linear("start (m)", 0.0, 2.0),
            y: Axis::log("error (m)", 1.0, 100.0),
            marks: vec![mark],
            legend: vec![("FB".to_owned(), [0, 114, 178])],
        };
        let svg = chart.svg(None).into_string();
        let (middle, half) = (AROUND[0] + SIZE.0 / 2.0, AROUND[1] + SIZE.1 / 2.0);
        let dot = format!("<a href=\"#r1\"><circle cx=\"{middle:.1}\" cy=\"{half:.1}\"");
        assert!(svg.contains(&dot), "{svg}");
        assert!(svg.contains("<title>a &lt; &quot;b&quot;</title>"), "{svg}");
        assert!(!svg.contains("xmlns"));
        let file = file(&[chart.clone(), chart]);
        assert!(file.starts_with("<svg xmlns=") && !file.contains("href"), "{file}");
    }

    #[test]
    fn the_names_of_a_legend_have_room() {
        let places = |names: &[&str]| -> Vec<(f64, f64)> {
            let chart = Chart {
                title: String::new(),
                x: Axis::linear("", 0.0, 1.0),
                y: Axis::linear("", 0.0, 1.0),
                marks: Vec::new(),
                legend: names.iter().map(|name| ((*name).to_owned(), [0; 3])).collect(),
            };
            let svg = chart.svg(None).into_string();
            let number = |text: &str| text.split('"').next()?.parse::<f64>().ok();
            let place = |rect: &str| Some((number(rect)?, number(rect.split_once("y=\"")?.1)?));
            svg.split("<rect x=\"").skip(1).filter_map(place).collect()
        };
        let short = places(&["FB", "PM", "MI"]);
        assert_eq!([short[1].0 - short[0].0, short[2].0 - short[1].0], [LEGEND.1; 2]);
        let long = "as long as a name gets, or so";
        let long = places(&[long, long, long, long]);
        assert!(long[1].0 - long[0].0 > 29.0 * NAMED.1, "{long:?}");
        // Where a row is full, the next begins.
        assert_eq!((long[2].0, long[2].1 - long[0].1), (long[0].0, LEGEND.0));
    }

    #[test]
    fn ticks_are_round() {
        let names = |axis: Axis| axis.ticks.into_iter().map(|tick| tick.1).collect::<Vec<_>>();
        assert_eq!(names(Axis::percent("")), ["0", "20", "40", "60", "80", "100"]);
        assert_eq!(names(Axis::linear("", 0.5, 2.0)), ["0.5", "1.0", "1.5", "2.0"]);
        assert_eq!(names(Axis::log("", 0.05, 200.0)), ["0.1", "1", "10", "100"]);
        let widths = [0.7, 1.0, 1.01, 2.5, 6.0, 30.0].map(round_up);
        assert_eq!(widths, [1.0, 1.0, 2.0, 5.0, 10.0, 50.0]);
    }
}
