//! The figures of a run, as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;

mod bars;
mod basins;
mod causes;

use super::metrics::{Measures, Row};
use super::tables::slug;
use crate::estimator;
use crate::method::Method;
use crate::run::Experiment;
use crate::run::RunFile;

/// A name and a drawing, or what went wrong.
pub type Plot = (String, Result<String, String>);

/// Colours that colour-blind readers tell apart on white, the first after Okabe and Ito: the paper's four
/// methods, and those behind them in the registry, which take turns.
const COLORS: [RGBColor; 8] = [
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xD5, 0x5E, 0x00),
    RGBColor(0x56, 0xB4, 0xE9),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0x7A, 0x5C, 0x2E),
    RGBColor(0x70, 0x70, 0x70),
];

/// The colour of a method in plots; black for one of another system.
pub fn method_color(method: Method) -> (u8, u8, u8) {
    let place = estimator::methods().position(|known| known == method);
    let paper = Method::PAPER.len();
    match place {
        Some(place) if place < COLORS.len() => COLORS[place].rgb(),
        Some(place) => COLORS[paper + (place - paper) % (COLORS.len() - paper)].rgb(),
        None => (0, 0, 0),
    }
}

/// The colour of the bars of the nth verdict.
pub fn verdict_color(number: usize) -> (u8, u8, u8) {
    causes::COLORS[number % causes::COLORS.len()].rgb()
}

/// One line of a plot.
#[derive(Debug)]
pub(super) struct Line {
    /// Whose line it is, which says its colour.
    pub(super) method: Method,
    /// Its corners.
    pub(super) points: Vec<(f64, f64)>,
}

/// The success rate over what the experiment varies, the recall over the translation error, what went
/// wrong over the distance of the reference, and how wide and deep the basins of the truth are.
pub fn plots(run: &RunFile, measures: &[Measures], rows: &[Row]) -> Vec<Plot> {
    let mut all = Vec::new();
    if run.experiment == Some(Experiment::Large) && run.pairs.len() > 1 {
        let groups = bars::by_pair(run, measures);
        let axis = "references of each scene, queries of it or of another";
        all.push(("success".to_owned(), bars::draw(axis, &groups)));
    }
    for pair in &run.pairs {
        let of_pair: Vec<&Measures> = measures
            .iter()
            .filter(|one| {
                let queries = one.group.query_scene.as_ref().unwrap_or(&one.group.scene);
                one.group.scene == pair.scene && *queries == pair.query_scene
            })
            .collect();
        let name = |what: &str| match pair.scene == pair.query_scene {
            true => format!("{what}-{}", slug(&pair.scene)),
            false => format!("{what}-{}-{}", slug(&pair.scene), slug(&pair.query_scene)),
        };
        if let Some((axis, groups)) = bars::by_setting(run, &of_pair) {
            all.push((name("success"), bars::draw(axis, &groups)));
        }
        let lines = recall_lines(&run.protocol.methods, &of_pair);
        if !lines.is_empty() {
            let axis = "translation error (m), failures infinite";
            all.push((name("recall"), draw(axis, "queries (%)", &lines, false)));
        }
        let of_pair: Vec<&Row> = rows
            .iter()
            .filter(|row| {
                let queries = row.query_scene.as_ref().unwrap_or(&row.scene);
                row.scene == pair.scene && *queries == pair.query_scene
            })
            .collect();
        for &method in &run.protocol.methods {
            if let Some(plot) = causes::draw(method, &of_pair) {
                all.push((name(&format!("causes-{method}")), plot));
            }
        }
        for (what, axis, lines) in basins::curves(&run.protocol.methods, &of_pair) {
            all.push((name(what), draw(axis, "queries (%)", &lines, false)));
        }
    }
    all
}

/// Dotted lines over a setting; what is a share of a hundred has an axis up to there.
pub(super) fn curves(x_axis: &str, y_axis: &str, lines: &[Line]) -> Result<String, String> {
    draw(x_axis, y_axis, lines, true)
}

/// For the last group alone: the largest radius, or the most references. Steps, all as long as the
/// longest: a method does not lose what it has found.
fn recall_lines(methods: &[Method], measures: &[&Measures]) -> Vec<Line> {
    let mut all = lines(methods, |method| {
        let last = measures.iter().rfind(|one| one.method == method);
        let Some(errors) = last.and_then(|one| one.errors.as_ref()) else {
            return Vec::new();
        };
        let mut metres: Vec<f64> = errors.iter().map(|error| error.0).collect();
        metres.sort_unstable_by(f64::total_cmp);
        let queries = metres.len() as f64;
        let found = metres
            .iter()
            .take_while(|error| error.is_finite())
            .enumerate();
        let steps = found.flat_map(|(index, &error)| {
            [index, index + 1].map(|count| (error, 100.0 * count as f64 / queries))
        });
        std::iter::once((0.0, 0.0)).chain(steps).collect()
    });
    let ends = all.iter().filter_map(|line| line.points.last());
    let end = ends.map(|point| point.0).fold(0.0, f64::max);
    for line in &mut all {
        if let Some(&(_, share)) = line.points.last() {
            line.points.push((end, share));
        }
    }
    all
}

fn lines(methods: &[Method], points: impl Fn(Method) -> Vec<(f64, f64)>) -> Vec<Line> {
    let lines = methods.iter().map(|&method| Line {
        method,
        points: points(method),
    });
    lines.filter(|line| !line.points.is_empty()).collect()
}

fn draw(x_axis: &str, y_axis: &str, lines: &[Line], dotted: bool) -> Result<String, String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (560, 380)).into_drawing_area();
        draw_into(&area, x_axis, y_axis, lines, dotted).map_err(|error| error.to_string())?;
        area.present().map_err(|error| error.to_string())?;
    }
    Ok(svg)
}

fn draw_into(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    x_axis: &str,
    y_axis: &str,
    lines: &[Line],
    dotted: bool,
) -> Result<(), Box<dyn std::error::Error>> {
    area.fill(&WHITE)?;
    let xs = || {
        lines
            .iter()
            .flat_map(|line| line.points.iter().map(|point| point.0))
    };
    let (least, most) = (xs().fold(f64::INFINITY, f64::min), xs().fold(0.0, f64::max));
    let least = if least.is_finite() { least } else { 0.0 };
    let highest = match y_axis.ends_with("(%)") {
        true => 100.0,
        false => {
            let ys = lines.iter().flat_map(|line| &line.points);
            1.1 * ys.map(|point| point.1).fold(1e-3, f64::max)
        }
    };
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(44)
        .build_cartesian_2d(least..most.max(least + 1e-3), 0.0..highest)?;
    chart
        .configure_mesh()
        .x_desc(x_axis)
        .y_desc(y_axis)
        .x_labels(6)
        .light_line_style(WHITE)
        .draw()?;
    for line in lines {
        let (r, g, b) = method_color(line.method);
        let color = RGBColor(r, g, b);
        chart
            .draw_series(LineSeries::new(
                line.points.iter().copied(),
                color.stroke_width(2),
            ))?
            .label(line.method.name().to_uppercase())
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
        if dotted {
            let dots = line
                .points
                .iter()
                .map(|&point| Circle::new(point, 3, color.filled()));
            chart.draw_series(dots)?;
        }
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::metrics::{measure, tests::row};
    use super::*;

    #[test]
    fn recall_rises_in_steps_and_stays_where_failures_begin() {
        let rows = [
            row("a", "fb", Some(3.0)),
            row("b", "fb", Some(1.0)),
            row("c", "fb", None),
            row("d", "fb", None),
            row("a", "mi", Some(2.0)),
        ];
        let measures = measure(&rows, 10.0);
        let measures: Vec<&Measures> = measures.iter().collect();
        let methods = [Method::FB, Method::MI];
        let lines = recall_lines(&methods, &measures);
        let fb = [
            (0.0, 0.0),
            (1.0, 0.0),
            (1.0, 25.0),
            (3.0, 25.0),
            (3.0, 50.0),
            (3.0, 50.0),
        ];
        assert_eq!(lines[0].points, fb);
        assert_eq!(
            lines[1].points,
            [(0.0, 0.0), (2.0, 0.0), (2.0, 100.0), (3.0, 100.0)]
        );
    }
}
