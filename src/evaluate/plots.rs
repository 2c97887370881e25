//! The figures of a run, as SVG.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::experiment::Experiment;
use super::metrics::Measures;
use super::run_file::RunFile;
use super::tables::slug;

/// A name and a drawing, or what went wrong.
pub type Plot = (String, Result<String, String>);

/// Okabe and Ito's colours, which colour-blind readers tell apart; by method.
const COLORS: [(&str, RGBColor); 4] = [
    ("fb", RGBColor(0x00, 0x72, 0xB2)),
    ("pm", RGBColor(0xE6, 0x9F, 0x00)),
    ("mi", RGBColor(0x00, 0x9E, 0x73)),
    ("hy", RGBColor(0xD5, 0x5E, 0x00)),
];

/// One line of a plot.
struct Line {
    method: String,
    points: Vec<(f64, f64)>,
}

/// The success rate over what the experiment varies, and the recall over the translation error.
pub fn plots(run: &RunFile, measures: &[Measures]) -> Vec<Plot> {
    let mut all = Vec::new();
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
        let axis = match run.experiment {
            Some(Experiment::Single) => Some("uncertainty radius (m)"),
            Some(Experiment::Multi) => Some("reference images (r-wavg)"),
            _ => None,
        };
        if let Some(axis) = axis {
            let lines = success_lines(run, &of_pair);
            all.push((name("success"), draw(axis, "success rate (%)", &lines)));
        }
        let lines = recall_lines(run, &of_pair);
        if !lines.is_empty() {
            let axis = "translation error (m), failures infinite";
            all.push((name("recall"), draw(axis, "queries (%)", &lines)));
        }
    }
    all
}

fn success_lines(run: &RunFile, measures: &[&Measures]) -> Vec<Line> {
    let is_multi = run.experiment == Some(Experiment::Multi);
    let robust = |one: &&&Measures| !is_multi || one.group.fusion.as_deref() == Some("r-wavg");
    let point = |one: &&Measures| {
        let setting = one.group.setting?;
        let x = if is_multi {
            setting.references as f64
        } else {
            setting.radius_m
        };
        Some((x, 100.0 * one.success_rate))
    };
    lines(run, |method| {
        let of_method = measures.iter().filter(|one| one.method == method);
        of_method.filter(robust).filter_map(point).collect()
    })
}

/// For the last group alone: the largest radius, or the most references.
fn recall_lines(run: &RunFile, measures: &[&Measures]) -> Vec<Line> {
    lines(run, |method| {
        let last = measures.iter().rfind(|one| one.method == method);
        let Some(errors) = last.and_then(|one| one.errors.as_ref()) else {
            return Vec::new();
        };
        let mut metres: Vec<f64> = errors.iter().map(|error| error.0).collect();
        metres.sort_unstable_by(f64::total_cmp);
        let all = metres.len() as f64;
        let found = metres
            .iter()
            .take_while(|error| error.is_finite())
            .enumerate();
        let steps = found.map(|(index, &error)| (error, 100.0 * (index + 1) as f64 / all));
        std::iter::once((0.0, 0.0)).chain(steps).collect()
    })
}

fn lines(run: &RunFile, points: impl Fn(&str) -> Vec<(f64, f64)>) -> Vec<Line> {
    let lines = run.methods.iter().map(|method| Line {
        method: method.clone(),
        points: points(method),
    });
    lines.filter(|line| !line.points.is_empty()).collect()
}

fn draw(x_axis: &str, y_axis: &str, lines: &[Line]) -> Result<String, String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (560, 380)).into_drawing_area();
        draw_into(&area, x_axis, y_axis, lines).map_err(|error| error.to_string())?;
        area.present().map_err(|error| error.to_string())?;
    }
    Ok(svg)
}

fn draw_into(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    x_axis: &str,
    y_axis: &str,
    lines: &[Line],
) -> Result<(), Box<dyn std::error::Error>> {
    area.fill(&WHITE)?;
    let xs = || {
        lines
            .iter()
            .flat_map(|line| line.points.iter().map(|point| point.0))
    };
    let (least, most) = (xs().fold(f64::INFINITY, f64::min), xs().fold(0.0, f64::max));
    let least = if least.is_finite() { least } else { 0.0 };
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(44)
        .build_cartesian_2d(least..most.max(least + 1e-3), 0.0..100.0)?;
    chart
        .configure_mesh()
        .x_desc(x_axis)
        .y_desc(y_axis)
        .x_labels(6)
        .light_line_style(WHITE)
        .draw()?;
    for line in lines {
        let known = COLORS.iter().find(|(method, _)| *method == line.method);
        let color = known.map_or(BLACK, |(_, color)| *color);
        chart
            .draw_series(LineSeries::new(
                line.points.iter().copied(),
                color.stroke_width(2),
            ))?
            .label(line.method.to_uppercase())
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
        if line.points.len() <= 12 {
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
