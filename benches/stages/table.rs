//! Tables of times, and a plot for each.

use std::error::Error;
use std::path::Path;

use plotters::prelude::*;

/// Times over a quantity.
pub struct Table {
    pub name: &'static str,
    pub quantity: &'static str,
    pub unit: &'static str,
    pub columns: Vec<&'static str>,
    /// The quantity, and the times in `unit`.
    pub rows: Vec<(f64, Vec<f64>)>,
}

impl Table {
    /// Both axes are logarithmic: a straight line is a power.
    pub fn draw(&self, path: &Path) -> Result<(), Box<dyn Error>> {
        /// Okabe and Ito's colours, which colour-blind readers tell apart.
        const COLORS: [RGBColor; 3] = [
            RGBColor(0x00, 0x72, 0xB2),
            RGBColor(0xD5, 0x5E, 0x00),
            RGBColor(0x00, 0x9E, 0x73),
        ];
        let all = || {
            self.rows
                .iter()
                .flat_map(|(_, times)| times.iter().copied())
        };
        let least = all().fold(f64::INFINITY, f64::min) * 0.7;
        let most = all().fold(0.0, f64::max) * 1.4;
        let (Some(first), Some(last)) = (self.rows.first(), self.rows.last()) else {
            return Ok(());
        };
        let area = SVGBackend::new(path, (640, 400)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .margin_right(24)
            .x_label_area_size(40)
            .y_label_area_size(60)
            .build_cartesian_2d((first.0..last.0).log_scale(), (least..most).log_scale())?;
        chart
            .configure_mesh()
            .x_labels(4)
            .x_label_formatter(&|quantity| format!("{quantity}"))
            .x_desc(self.quantity)
            .y_desc(format!("time ({})", self.unit))
            .draw()?;
        for (index, name) in self.columns.iter().enumerate() {
            let color = COLORS[index % COLORS.len()];
            let line = self.rows.iter().map(|(at, times)| (*at, times[index]));
            let corners = line
                .clone()
                .map(|corner| Circle::new(corner, 3, color.filled()));
            chart
                .draw_series(LineSeries::new(line, color.stroke_width(2)))?
                .label(*name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], color));
            chart.draw_series(corners)?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .border_style(BLACK)
            .background_style(WHITE)
            .draw()?;
        area.present()?;
        Ok(())
    }
}
