//! The plots of the report: drawn by the crate that draws all plots, with words for whoever points at them.

use std::collections::BTreeMap;

use plotters::prelude::*;

use super::ReportedResult;
use crate::diagnosis::Code;
use crate::localize::Status;
use crate::measure::{Measures, method_color, verdict_color};
use crate::method::Method;

/// Width of a plot \[px\].
const WIDTH: u32 = 560;
/// What has no pose is drawn above the greatest error by this factor.
const ABOVE: f64 = 2.0;

/// A plot made fit for a page: no name space, and with words on some of its elements.
///
/// The nth element of this kind, without the first `skipped`, gets the nth words, and leads to its link if it
/// has one.
pub(super) fn with_words(
    svg: &str,
    element: &str,
    skipped: usize,
    words: &[(String, Option<String>)],
) -> String {
    let svg = svg.replace(" xmlns=\"http://www.w3.org/2000/svg\"", " role=\"img\"");
    let opening = format!("<{element} ");
    let mut parts = svg.split(&opening);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for (number, part) in parts.enumerate() {
        let said = number.checked_sub(skipped).and_then(|at| words.get(at));
        match (said, part.split_once("/>")) {
            (Some((words, link)), Some((attributes, rest))) => {
                let title = escaped(words);
                let drawn = format!("{opening}{attributes}><title>{title}</title></{element}>");
                match link {
                    Some(link) => {
                        text += &format!("<a href=\"{}\">{drawn}</a>{rest}", escaped(link));
                    }
                    None => text += &format!("{drawn}{rest}"),
                }
            }
            _ => {
                text += &opening;
                text += part;
            }
        }
    }
    text
}

/// A plot whose lines and bars say to which method they belong.
pub(super) fn with_methods_named(svg: &str, methods: &[Method]) -> String {
    let plain = with_words(svg, "polyline", 0, &[]);
    let lines = titled(
        &plain,
        "polyline",
        |attributes, color| {
            attributes.contains(&format!("stroke=\"{color}\""))
                && attributes.contains("stroke-width=\"2\"")
        },
        methods,
    );
    titled(
        &lines,
        "rect",
        |attributes, color| attributes.contains(&format!("fill=\"{color}\"")),
        methods,
    )
}

/// The name of a method as the title of each such element that is its own, by its colour.
fn titled(
    svg: &str,
    element: &str,
    is_of: impl Fn(&str, &str) -> bool,
    methods: &[Method],
) -> String {
    let opening = format!("<{element} ");
    let mut parts = svg.split(&opening);
    let mut text = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        text += &opening;
        let (attributes, rest) = part.split_once("/>").unwrap_or((part, ""));
        let of_it = |method: &&Method| {
            let (r, g, b) = method_color(**method);
            is_of(attributes, &format!("#{r:02X}{g:02X}{b:02X}"))
        };
        match methods.iter().find(of_it) {
            Some(method) => {
                let name = escaped(&method.name().to_uppercase());
                text += &format!("{attributes}><title>{name}</title></{element}>{rest}");
            }
            None => text += part,
        }
    }
    text
}

/// Text as markup shows it.
fn escaped(text: &str) -> String {
    maud::html! { (text) }.into_string().replace('"', "&quot;")
}

/// Every result's error over the distance of its reference, both where they are known. What has no pose
/// lies on the upper border. Points lead to their rows.
pub(super) fn errors(results: &[ReportedResult]) -> Option<Result<String, String>> {
    let known: Vec<(f64, Option<f64>, &ReportedResult)> = results
        .iter()
        .filter_map(|one| {
            let start = one.result.initial_error?.translation_m;
            let error = one.result.error.map(|error| error.translation_m.max(1e-3));
            let is_failed = one.result.status == Status::Failed;
            (start.is_finite() && (error.is_some() || is_failed)).then_some((start, error, one))
        })
        .collect();
    let errors = || known.iter().filter_map(|(_, error, _)| *error);
    let (least, greatest) = (
        errors().fold(f64::INFINITY, f64::min),
        errors().fold(0.0, f64::max),
    );
    let farthest = known.iter().map(|(start, ..)| *start).fold(0.0, f64::max);
    if !least.is_finite() {
        return None;
    }
    let top = greatest * ABOVE;
    let mut methods: Vec<Method> = Vec::new();
    for (.., one) in &known {
        if !methods.contains(&one.result.method) {
            methods.push(one.result.method);
        }
    }
    let mut words = Vec::new();
    let mut draw = || -> Result<String, Box<dyn std::error::Error>> {
        let mut svg = String::new();
        {
            let area = SVGBackend::with_string(&mut svg, (WIDTH, 380)).into_drawing_area();
            area.fill(&WHITE)?;
            let mut chart = ChartBuilder::on(&area)
                .margin(12)
                .x_label_area_size(36)
                .y_label_area_size(52)
                .build_cartesian_2d(
                    0.0..(1.05 * farthest).max(1e-3),
                    (0.8 * least..1.2 * top).log_scale(),
                )?;
            chart
                .configure_mesh()
                .x_desc("distance of the reference (m)")
                .y_desc("error (m), without a pose above")
                .y_label_formatter(&|value| format!("{value}"))
                .light_line_style(WHITE)
                .draw()?;
            for &method in &methods {
                let (r, g, b) = method_color(method);
                let color = RGBColor(r, g, b);
                let of_method = known.iter().filter(|(.., one)| one.result.method == method);
                let mut dots = Vec::new();
                for (start, error, one) in of_method {
                    words.push((one.headline(), Some(format!("#r{}", one.number))));
                    let style = match error {
                        Some(_) => color.mix(0.7).filled(),
                        None => color.stroke_width(1),
                    };
                    dots.push(Circle::new((*start, error.unwrap_or(top)), 3, style));
                }
                chart
                    .draw_series(dots)?
                    .label(method.name().to_uppercase())
                    .legend(move |(x, y)| {
                        Rectangle::new([(x, y - 4), (x + 8, y + 4)], color.filled())
                    });
            }
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::LowerRight)
                .background_style(WHITE.mix(0.8))
                .border_style(BLACK.mix(0.3))
                .draw()?;
            area.present()?;
        }
        Ok(svg)
    };
    Some(
        draw()
            .map(|svg| with_words(&svg, "circle", 0, &words))
            .map_err(|error| error.to_string()),
    )
}

/// A bar for each method and condition: the shares of its queries by primary verdict.
pub(super) fn verdicts(measures: &[Measures]) -> Option<Result<String, String>> {
    if measures.iter().all(|one| one.verdicts.is_empty()) {
        return None;
    }
    let mut codes: BTreeMap<Code, usize> = BTreeMap::new();
    for code in measures.iter().flat_map(|one| one.verdicts.keys()) {
        let number = codes.len();
        codes.entry(*code).or_insert(number);
    }
    let bars = measures.len();
    let height = 60 + 40 * bars as u32;
    let mut words = Vec::new();
    let mut draw = || -> Result<String, Box<dyn std::error::Error>> {
        let mut svg = String::new();
        {
            let area = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
            area.fill(&WHITE)?;
            let mut chart = ChartBuilder::on(&area)
                .margin(12)
                .margin_right(24)
                .x_label_area_size(36)
                .build_cartesian_2d(0.0..100.0, 0.0..bars as f64)?;
            chart
                .configure_mesh()
                .disable_y_axis()
                .disable_y_mesh()
                .x_desc("queries (%)")
                .light_line_style(WHITE)
                .draw()?;
            let mut labels = Vec::new();
            for (index, one) in measures.iter().enumerate() {
                let low = (bars - 1 - index) as f64;
                let place = match bars {
                    1 => String::new(),
                    _ => format!(" {}", one.group),
                };
                let method = one.method.name().to_uppercase();
                labels.push((format!("{method}{place}"), (0.0, low + 0.95), 13));
                let mut from = 0.0;
                let mut rectangles = Vec::new();
                for (code, &count) in &one.verdicts {
                    let share = 100.0 * one.share(count);
                    let (r, g, b) = verdict_color(codes[code]);
                    rectangles.push(Rectangle::new(
                        [(from, low + 0.08), (from + share, low + 0.58)],
                        RGBColor(r, g, b).filled(),
                    ));
                    words.push((
                        format!(
                            "{method}{place}: {code} {}: {count} of {} queries ({share:.0} %)",
                            code.title(),
                            one.queries
                        ),
                        None,
                    ));
                    if share >= 5.0 {
                        let name = code.name().to_owned();
                        labels.push((name, (from + 0.8, low + 0.50), 13));
                    }
                    from += share;
                }
                chart.draw_series(rectangles)?;
            }
            for (text, place, size) in labels {
                let style = ("sans-serif", size).into_font().color(&BLACK);
                chart.draw_series(std::iter::once(Text::new(text, place, style)))?;
            }
            area.present()?;
        }
        Ok(svg)
    };
    Some(
        draw()
            // The first is the ground.
            .map(|svg| with_words(&svg, "rect", 1, &words))
            .map_err(|error| error.to_string()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_stand_on_their_element_and_are_no_markup() {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\"><rect a=\"1\"/><rect a=\"2\"/></svg>";
        let words = [("a < \"b\"".to_owned(), Some("#r1".to_owned()))];
        assert_eq!(
            with_words(svg, "rect", 1, &words),
            "<svg role=\"img\"><rect a=\"1\"/><a href=\"#r1\"><rect a=\"2\">\
             <title>a &lt; &quot;b&quot;</title></rect></a></svg>"
        );
    }
}
