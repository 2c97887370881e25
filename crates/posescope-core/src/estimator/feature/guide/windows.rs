//! Keypoints by the square of the image that they lie in.

use nalgebra::Point2;

use crate::camera::Intrinsics;
use crate::features::Keypoint;

/// Keypoints by the square of the image that they lie in.
pub(super) struct Windows {
    side: f64,
    columns: usize,
    rows: usize,
    members: Vec<Vec<usize>>,
}

impl Windows {
    /// Keypoints of a photo, in squares of `side` \[px\].
    pub(super) fn new(keypoints: &[Keypoint], camera: &Intrinsics, side: f64) -> Self {
        let along = |length: u32| (f64::from(length) / side) as usize + 1;
        let (columns, rows) = (along(camera.width), along(camera.height));
        let mut windows = Self { side, columns, rows, members: vec![Vec::new(); columns * rows] };
        for (number, keypoint) in keypoints.iter().enumerate() {
            let (column, row) = windows.square(&keypoint.pixel());
            windows.members[row * columns + column].push(number);
        }
        windows
    }

    fn square(&self, pixel: &Point2<f64>) -> (usize, usize) {
        let place = |at: f64, count: usize| ((at.max(0.0) / self.side) as usize).min(count - 1);
        (place(pixel.x, self.columns), place(pixel.y, self.rows))
    }

    /// The keypoints in the square of a pixel and those around it.
    pub(super) fn around(&self, pixel: &Point2<f64>) -> impl Iterator<Item = usize> + '_ {
        let (column, row) = self.square(pixel);
        let rows = row.saturating_sub(1)..(row + 2).min(self.rows);
        rows.flat_map(move |row| {
            let columns = column.saturating_sub(1)..(column + 2).min(self.columns);
            columns
                .flat_map(move |column| self.members[row * self.columns + column].iter().copied())
        })
    }
}
