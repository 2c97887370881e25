//! Rows of what filters respond.

/// Rows of samples of several layers, the newest in place of the oldest where there is no room for all.
#[derive(Default)]
pub(super) struct Responses {
    layers: usize,
    columns: usize,
    /// Rows of each layer that there is room for.
    held: usize,
    /// Row by row, of each row layer by layer.
    samples: Vec<f32>,
}

impl Responses {
    pub(super) fn new(layers: usize, columns: usize, held: usize) -> Self {
        Self { layers, columns, held, samples: vec![0.0; layers * columns * held] }
    }

    /// One of the rows that are held.
    #[inline]
    pub(super) fn row(&self, layer: usize, row: usize) -> &[f32] {
        &self.samples[self.start(layer, row)..][..self.columns]
    }

    pub(super) fn row_mut(&mut self, layer: usize, row: usize) -> &mut [f32] {
        let start = self.start(layer, row);
        &mut self.samples[start..][..self.columns]
    }

    /// All rows of all layers in bands of `rows`, of each row layer by layer.
    pub(super) fn bands_mut(&mut self, rows: usize) -> impl Iterator<Item = &mut [f32]> {
        let band = rows * self.layers * self.columns;
        self.samples.chunks_mut(band.max(1))
    }

    #[inline]
    fn start(&self, layer: usize, row: usize) -> usize {
        (row % self.held * self.layers + layer) * self.columns
    }
}
