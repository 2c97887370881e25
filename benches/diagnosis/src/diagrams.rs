//! How well a probability holds, drawn: reliability and ROC, as SVG.

use plotters::prelude::*;

/// A probability, and whether the pose is near.
pub type Scored = (f64, bool);

/// Side of a diagram \[px\].
const SIDE: u32 = 420;

/// Okabe and Ito's colours, which colour-blind readers tell apart.
const COLORS: [RGBColor; 5] = [
    RGBColor(0x00, 0x72, 0xB2),
    RGBColor(0x00, 0x9E, 0x73),
    RGBColor(0xCC, 0x79, 0xA7),
    RGBColor(0xE6, 0x9F, 0x00),
    RGBColor(0x00, 0x00, 0x00),
];

/// A name and its points; both axes go from 0 to 1.
type Line = (String, Vec<(f64, f64)>);

/// Ten bins of equal count of sorted samples.
pub fn tenths(sorted: &[Scored]) -> impl Iterator<Item = &[Scored]> {
    (0..10)
        .map(|k| &sorted[k * sorted.len() / 10..(k + 1) * sorted.len() / 10])
        .filter(|bin| !bin.is_empty())
}

/// The mean probability of a bin, and the share of its poses that are near.
pub fn said_and_was(bin: &[Scored]) -> (f64, f64) {
    let count = bin.len() as f64;
    let said = bin.iter().map(|s| s.0).sum::<f64>() / count;
    (said, bin.iter().filter(|s| s.1).count() as f64 / count)
}

/// The share of near poses over the probability that was said, by tenths of each method's poses.
///
/// # Errors
/// What the drawing library says.
pub fn reliability(methods: &[(String, Vec<Scored>)]) -> Result<String, String> {
    let lines: Vec<Line> = methods
        .iter()
        .map(|(name, scored)| {
            let mut sorted = scored.clone();
            sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
            (name.clone(), tenths(&sorted).map(said_and_was).collect())
        })
        .collect();
    let axes = ["probability of being within 1 m", "share within 1 m"];
    draw(axes, &lines, true)
}

/// The share of near poses that are believed over the share of far ones that are, for every limit of
/// the probability.
///
/// # Errors
/// What the drawing library says.
pub fn roc(methods: &[(String, Vec<Scored>)]) -> Result<String, String> {
    let lines: Vec<Line> = methods
        .iter()
        .map(|(name, scored)| {
            let mut sorted = scored.clone();
            sorted.sort_by(|a, b| b.0.total_cmp(&a.0));
            let near = sorted.iter().filter(|s| s.1).count().max(1) as f64;
            let far = sorted.iter().filter(|s| !s.1).count().max(1) as f64;
            let mut believed = (0.0, 0.0);
            let steps = sorted.iter().map(|(_, is_near)| {
                match is_near {
                    true => believed.1 += 1.0 / near,
                    false => believed.0 += 1.0 / far,
                }
                believed
            });
            let points = std::iter::once((0.0, 0.0)).chain(steps).collect();
            (name.clone(), points)
        })
        .collect();
    draw(["far poses believed", "near poses believed"], &lines, false)
}

fn draw(axes: [&str; 2], lines: &[Line], dotted: bool) -> Result<String, String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (SIDE, SIDE)).into_drawing_area();
        let drawn = draw_into(&area, axes, lines, dotted);
        drawn.map_err(|error| error.to_string())?;
        area.present().map_err(|error| error.to_string())?;
    }
    Ok(svg)
}

fn draw_into(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    axes: [&str; 2],
    lines: &[Line],
    dotted: bool,
) -> Result<(), Box<dyn std::error::Error>> {
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(44)
        .build_cartesian_2d(0.0..1.0, 0.0..1.0)?;
    chart
        .configure_mesh()
        .x_desc(axes[0])
        .y_desc(axes[1])
        .x_labels(6)
        .y_labels(6)
        .light_line_style(WHITE)
        .draw()?;
    // What would be perfect in one diagram and chance in the other.
    let diagonal = LineSeries::new([(0.0, 0.0), (1.0, 1.0)], BLACK.mix(0.3));
    chart.draw_series(diagonal)?;
    for (index, (name, points)) in lines.iter().enumerate() {
        let style = COLORS[index % COLORS.len()].stroke_width(2);
        chart
            .draw_series(LineSeries::new(points.iter().copied(), style))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], style));
        if dotted {
            let dot = |&point| Circle::new(point, 3, COLORS[index % COLORS.len()].filled());
            chart.draw_series(points.iter().map(dot))?;
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
