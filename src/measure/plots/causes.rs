//! What went wrong, over the distance of the reference from the truth.

use std::collections::BTreeMap;

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::diagnosis::Code;
use crate::measure::metrics::Row;
use crate::method::Method;

/// Bins of distance in which bars stand.
const BINS: usize = 6;

/// A bar is labelled where it is at least so high \[%\].
const LABELLED_FROM: f64 = 5.0;

/// Pale enough for black letters; neighbours differ in lightness, so that they can be told apart
/// without their hue, and every bar says its code.
pub(super) const COLORS: [RGBColor; 6] = [
    RGBColor(0x8C, 0xC5, 0xE3),
    RGBColor(0xF0, 0xC5, 0x71),
    RGBColor(0x59, 0xA8, 0x9C),
    RGBColor(0xF2, 0xA0, 0x8D),
    RGBColor(0xC8, 0xC8, 0xC8),
    RGBColor(0xB0, 0x9C, 0xD8),
];

/// The primary verdicts of the results in one bin of distance.
#[derive(Debug, Default, PartialEq)]
struct Bin {
    queries: usize,
    verdicts: BTreeMap<Code, usize>,
}

/// Bars of the shares of queries by primary failure verdict, each over a bin of the distance between
/// reference and truth; `None` where no distance is known, or nothing went wrong.
pub(super) fn draw(method: Method, rows: &[&Row]) -> Option<Result<String, String>> {
    let (width_m, bins) = binned(method, rows)?;
    let is_failure = bins.iter().any(|bin| !bin.verdicts.is_empty());
    is_failure.then(|| {
        let mut svg = String::new();
        {
            let area = SVGBackend::with_string(&mut svg, (560, 380)).into_drawing_area();
            draw_into(&area, method, width_m, &bins).map_err(|error| error.to_string())?;
            area.present().map_err(|error| error.to_string())?;
        }
        Ok(svg)
    })
}

/// The width of a bin \[m\] and the bins from 0 on.
fn binned(method: Method, rows: &[&Row]) -> Option<(f64, Vec<Bin>)> {
    let of_method: Vec<(f64, Option<Code>)> = rows
        .iter()
        .filter(|row| row.method == method)
        .filter_map(|row| {
            let primary = row.diagnosis.first().map(|finding| finding.code);
            Some((
                row.initial_error?.translation_m,
                primary.filter(|code| code.is_failure()),
            ))
        })
        .filter(|(distance_m, _)| distance_m.is_finite())
        .collect();
    let farthest_m = of_method.iter().map(|row| row.0).reduce(f64::max)?;
    let width_m = round_width(farthest_m / BINS as f64);
    let mut bins: Vec<Bin> = Vec::new();
    for (distance_m, code) in of_method {
        let bin = (distance_m / width_m) as usize;
        if bins.len() <= bin {
            bins.resize_with(bin + 1, Bin::default);
        }
        bins[bin].queries += 1;
        if let Some(code) = code {
            *bins[bin].verdicts.entry(code).or_default() += 1;
        }
    }
    Some((width_m, bins))
}

/// The next of 1, 2, 5 times a power of ten.
fn round_width(width: f64) -> f64 {
    let power = 10_f64.powf(width.max(1e-3).log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    let enough = steps.into_iter().find(|step| step * power >= width);
    enough.unwrap_or(10.0) * power
}

fn draw_into(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    method: Method,
    width_m: f64,
    bins: &[Bin],
) -> Result<(), Box<dyn std::error::Error>> {
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(44)
        .build_cartesian_2d(0.0..width_m * bins.len() as f64, 0.0..108.0)?;
    chart
        .configure_mesh()
        .disable_x_mesh()
        .x_desc("distance of the reference from the truth (m)")
        .y_desc(format!("{}: queries (%)", method.name().to_uppercase()))
        .x_labels(bins.len() + 1)
        .light_line_style(WHITE)
        .draw()?;
    let mut codes: Vec<Code> = bins
        .iter()
        .flat_map(|bin| bin.verdicts.keys().copied())
        .collect();
    codes.sort_unstable();
    codes.dedup();
    for (index, bin) in bins.iter().enumerate().filter(|(_, bin)| bin.queries > 0) {
        let (left, right) = (
            width_m * (index as f64 + 0.08),
            width_m * (index as f64 + 0.92),
        );
        let middle = (left + right) / 2.0;
        let label = ("sans-serif", 11).into_font().color(&BLACK);
        let centred = label.pos(plotters::style::text_anchor::Pos::new(
            plotters::style::text_anchor::HPos::Center,
            plotters::style::text_anchor::VPos::Center,
        ));
        let mut bottom = 0.0;
        for (rank, code) in codes.iter().enumerate() {
            let Some(&count) = bin.verdicts.get(code) else {
                continue;
            };
            let top = bottom + 100.0 * count as f64 / bin.queries as f64;
            let bar = [(left, bottom), (right, top)];
            let color = COLORS[rank % COLORS.len()];
            chart.draw_series([
                Rectangle::new(bar, color.filled()),
                Rectangle::new(bar, BLACK.mix(0.6).stroke_width(1)),
            ])?;
            if top - bottom >= LABELLED_FROM {
                let place = (middle, (bottom + top) / 2.0);
                chart.draw_series([Text::new(code.name(), place, centred.clone())])?;
            }
            bottom = top;
        }
        let words = format!("{} queries", bin.queries);
        chart.draw_series([Text::new(words, (middle, bottom + 3.0), centred)])?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::super::metrics::{Finding, tests::row};
    use super::*;
    use crate::geometry::PoseError;

    fn started(away_m: f64, code: Option<Code>) -> Row {
        Row {
            initial_error: Some(PoseError {
                translation_m: away_m,
                rotation_deg: 0.0,
                max_euler_deg: 0.0,
            }),
            diagnosis: code.map(|code| Finding { code }).into_iter().collect(),
            ..row("a", "mi", Some(1.0))
        }
    }

    #[test]
    fn results_fall_into_bins_of_a_round_width_and_a_doubt_is_no_failure() {
        let rows = [
            started(0.3, None),
            started(1.7, Some(Code::D2)),
            started(2.2, Some(Code::L1)),
            started(11.4, Some(Code::D3)),
            started(11.9, Some(Code::D3)),
            row("b", "mi", None),
        ];
        let rows: Vec<&Row> = rows.iter().collect();
        let (width_m, bins) = binned(Method::MI, &rows).expect("there are distances");
        assert_eq!((width_m, bins.len()), (2.0, 6));
        assert_eq!(bins[0].queries, 2);
        assert_eq!(bins[0].verdicts, BTreeMap::from([(Code::D2, 1)]));
        assert!(bins[1].verdicts.is_empty() && bins[1].queries == 1);
        assert_eq!(bins[5].verdicts, BTreeMap::from([(Code::D3, 2)]));
        let svg = draw(Method::MI, &rows)
            .expect("some failed")
            .expect("drawn");
        assert!(svg.contains("D3") && svg.contains("2 queries"), "{svg}");
        assert_eq!(binned(Method::FB, &rows), None);
    }

    #[test]
    fn a_width_is_rounded_up() {
        let widths = [0.7, 1.0, 1.01, 2.5, 6.0, 30.0].map(round_width);
        assert_eq!(widths, [1.0, 1.0, 2.0, 5.0, 10.0, 50.0]);
    }
}
