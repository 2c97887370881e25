//! Pixels by the square of the image that they are in.

use std::collections::HashMap;

use nalgebra::Point2;

/// Numbered pixels in squares about as wide as a reach, so that those near a pixel are found without looking at all.
pub(super) struct Cells {
    side_px: f64,
    numbers: HashMap<[i64; 2], Vec<usize>>,
}

impl Cells {
    /// No pixels yet, for a search of those within `reach_px`.
    pub(super) fn new(reach_px: f64) -> Self {
        // A little wider than the reach, so that rounding leaves none two squares away.
        Self { side_px: 1.01 * reach_px.max(1.0), numbers: HashMap::new() }
    }

    fn cell(&self, pixel: &Point2<f64>) -> [i64; 2] {
        [pixel.x, pixel.y].map(|along| (along / self.side_px).floor() as i64)
    }

    pub(super) fn insert(&mut self, pixel: &Point2<f64>, number: usize) {
        self.numbers.entry(self.cell(pixel)).or_default().push(number);
    }

    /// The numbers of all pixels within the reach, and of some beyond it.
    pub(super) fn around(&self, pixel: &Point2<f64>) -> impl Iterator<Item = usize> {
        let [column, row] = self.cell(pixel);
        let columns = (-1..=1).map(move |step| column.saturating_add(step));
        columns
            .flat_map(move |column| (-1..=1).map(move |step| [column, row.saturating_add(step)]))
            .filter_map(|cell| self.numbers.get(&cell))
            .flatten()
            .copied()
    }
}
