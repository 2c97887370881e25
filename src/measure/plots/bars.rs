//! Success rates as bars: a group per setting, a bar per method.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::method_color;
use crate::measure::metrics::Measures;
use crate::method::Method;
use crate::run::{Experiment, RunFile};

/// The least width of a plot and what a bar takes of it \[px\].
const WIDTH: u32 = 560;
const BAR_WIDTH: u32 = 26;
/// The share of a group's width that its bars fill.
const FILLED: f64 = 0.84;

/// The bars of one setting: what it is called, and the success rate of each method that has one \[%\].
#[derive(Debug, PartialEq)]
pub(super) struct Bars {
    label: String,
    rates: Vec<(Method, f64)>,
}

/// The success rates of a pair of scenes over what the experiment varies, with what that is; of several
/// references those of r-wavg. `None` where nothing is varied.
pub(super) fn by_setting(
    run: &RunFile,
    measures: &[&Measures],
) -> Option<(&'static str, Vec<Bars>)> {
    let (axis, is_multi) = match run.experiment? {
        Experiment::Single => ("uncertainty radius (m)", false),
        Experiment::Multi => ("reference images (r-wavg)", true),
        Experiment::Large => return None,
    };
    let shown: Vec<&Measures> = measures
        .iter()
        .copied()
        .filter(|one| !is_multi || one.group.fusion.is_some_and(|f| f.name == "r-wavg"))
        .collect();
    let label = |one: &Measures| {
        let setting = one.group.setting?;
        Some(match is_multi {
            true => setting.references.to_string(),
            false => setting.radius_m.to_string(),
        })
    };
    Some((axis, grouped(run, &shown, label)))
}

/// The success rates of every pair of scenes.
pub(super) fn by_pair(run: &RunFile, measures: &[Measures]) -> Vec<Bars> {
    let shown: Vec<&Measures> = measures.iter().collect();
    grouped(run, &shown, |one| {
        Some(match &one.group.query_scene {
            Some(queries) => format!("{} in {}", brief(queries), brief(&one.group.scene)),
            None => brief(&one.group.scene).to_owned(),
        })
    })
}

/// A scene's name without what it has in common with its like: `night` of `street:night`.
fn brief(scene: &str) -> &str {
    scene.rsplit(['/', ':']).next().unwrap_or(scene)
}

/// In the order in which the labels come, the methods in that of the run.
fn grouped(
    run: &RunFile,
    measures: &[&Measures],
    label: impl Fn(&Measures) -> Option<String>,
) -> Vec<Bars> {
    let mut groups: Vec<Bars> = Vec::new();
    for one in measures {
        let Some(label) = label(one) else { continue };
        let rate = (one.method, 100.0 * one.success_rate);
        match groups.iter_mut().find(|group| group.label == label) {
            Some(group) => group.rates.push(rate),
            None => groups.push(Bars {
                label,
                rates: vec![rate],
            }),
        }
    }
    let place = |method: Method| run.protocol.methods.iter().position(|&one| one == method);
    for group in &mut groups {
        group.rates.sort_by_key(|&(method, _)| place(method));
    }
    groups
}

/// The picture.
pub(super) fn draw(axis: &str, groups: &[Bars]) -> Result<String, String> {
    let bars: usize = groups.iter().map(|group| group.rates.len() + 1).sum();
    let size = (WIDTH.max(bars as u32 * BAR_WIDTH), 380);
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        draw_into(&area, axis, groups).map_err(|error| error.to_string())?;
        area.present().map_err(|error| error.to_string())?;
    }
    Ok(svg)
}

fn draw_into(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    axis: &str,
    groups: &[Bars],
) -> Result<(), Box<dyn std::error::Error>> {
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(44)
        .build_cartesian_2d(0.0..groups.len() as f64, 0.0..118.0)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .x_labels(0)
        .y_labels(6)
        .y_label_formatter(&|share| match *share <= 100.0 {
            true => format!("{share}"),
            false => String::new(),
        })
        .y_desc("success rate (%)")
        .light_line_style(WHITE)
        .draw()?;
    let label = ("sans-serif", 11).into_font().color(&BLACK);
    let above = label.pos(Pos::new(HPos::Center, VPos::Bottom));
    let below = label.pos(Pos::new(HPos::Center, VPos::Top));
    let mut methods: Vec<Method> = Vec::new();
    for (index, group) in groups.iter().enumerate() {
        let width = FILLED / group.rates.len().max(1) as f64;
        let first = index as f64 + (1.0 - FILLED) / 2.0;
        for (place, &(method, rate)) in group.rates.iter().enumerate() {
            if !methods.contains(&method) {
                methods.push(method);
            }
            let (left, right) = (
                first + width * place as f64,
                first + width * (place as f64 + 0.9),
            );
            let color = color(method);
            chart.draw_series([Rectangle::new([(left, 0.0), (right, rate)], color.filled())])?;
            let words = format!("{rate:.0}");
            let top = ((left + right) / 2.0, rate);
            chart.draw_series([Text::new(words, top, above.clone())])?;
        }
    }
    // Below the axis, which is beyond what the chart draws.
    let plotting = chart.plotting_area().get_pixel_range();
    let step = (plotting.0.end - plotting.0.start) as f64 / groups.len().max(1) as f64;
    let middle = |index: usize| plotting.0.start + (step * (index as f64 + 0.5)) as i32;
    for (index, group) in groups.iter().enumerate() {
        let place = (middle(index), plotting.1.end + 6);
        area.draw(&Text::new(group.label.clone(), place, below.clone()))?;
    }
    let centre = ((plotting.0.start + plotting.0.end) / 2, plotting.1.end + 24);
    area.draw(&Text::new(axis.to_owned(), centre, below))?;
    for (place, method) in methods.into_iter().enumerate() {
        let x = plotting.0.start + 8 + 84 * place as i32;
        let y = plotting.1.start + 4;
        let square = [(x, y), (x + 10, y + 10)];
        area.draw(&Rectangle::new(square, color(method).filled()))?;
        let name = method.name().to_uppercase();
        area.draw(&Text::new(name, (x + 14, y), label.clone()))?;
    }
    Ok(())
}

fn color(method: Method) -> RGBColor {
    let (r, g, b) = method_color(method);
    RGBColor(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::metrics::{measure, tests::row};
    use crate::measure::tables::tests::run;

    #[test]
    fn bars_stand_by_scene_in_the_order_of_the_methods() {
        let rows = [
            row("a", "mi", Some(1.0)),
            row("b", "mi", None),
            row("a", "fb", Some(0.1)),
            row("b", "fb", Some(0.2)),
        ];
        let measures = measure(&rows, 10.0);
        let run = run(Experiment::Large, &[("street", "street")]);
        let groups = by_pair(&run, &measures);
        assert_eq!(groups.len(), 1);
        assert_eq!(groups[0].rates, [(Method::FB, 100.0), (Method::MI, 50.0)]);
        assert_eq!(by_setting(&run, &[]), None);
        let svg = draw("references", &groups).expect("drawn");
        for words in ["100", "50", "FB", "MI", "references", "#0072B2"] {
            assert!(svg.contains(words), "{words}: {svg}");
        }
    }
}
