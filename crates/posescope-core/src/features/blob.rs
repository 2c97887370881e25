//! Blobs among the responses around them (section 3.4).

use std::ops::Range;

use fearless_simd::{Level, dispatch};
use nalgebra::{Matrix3, Vector3};

use super::Keypoint;
use super::hessian::BoxFilter;
use super::integral::IntegralImage;
use super::responses::Responses;

/// Where filters are applied, and what a maximum exceeds.
#[derive(Clone, Copy)]
pub(super) struct Sampling<'a> {
    pub(super) integral: &'a IntegralImage,
    /// Distance between samples \[px\].
    pub(super) step: usize,
    /// Distance to which a maximum exceeds all other responses of its filter, and between those through which
    /// its peak is interpolated \[samples\].
    pub(super) reach: usize,
    /// What a blob's response exceeds.
    pub(super) threshold: f32,
}

/// Three layers with filters of successive sizes, the middle one searched for maxima.
pub(super) struct Neighbourhood<'a> {
    pub(super) sampling: Sampling<'a>,
    pub(super) filters: &'a [BoxFilter; 3],
    pub(super) responses: &'a Responses,
    /// The place of the first filter among the responses.
    pub(super) below: usize,
}

impl Neighbourhood<'_> {
    /// The samples along `extent` pixels that have all neighbours: where the largest filter still fits.
    pub(super) fn inside(&self, extent: usize) -> Range<usize> {
        let Sampling { step, reach, .. } = self.sampling;
        let margin = self.filters[2].margin();
        let last = extent.saturating_sub(margin + 1) / step;
        margin.div_ceil(step) + reach..(last + 1).saturating_sub(reach)
    }

    /// Finds the maxima along a row of samples that is [`Self::inside`].
    pub(super) fn find(&self, row: usize, peaks: &mut Vec<bool>, found: &mut Vec<Keypoint>) {
        let rows = [row - 1, row, row + 1].map(|row| self.layer(1, row));
        dispatch!(Level::new(), _simd => mark_peaks(rows, self.sampling.threshold, peaks));
        let maxima = self
            .inside(self.sampling.integral.width)
            .filter(|&column| peaks[column])
            .filter(|&column| self.is_maximum(column, row))
            .filter_map(|column| self.localise(column, row));
        found.extend(maxima);
    }

    /// A row of the lower, the middle or the upper layer.
    fn layer(&self, index: usize, row: usize) -> &[f32] {
        self.responses.row(self.below + index, row)
    }

    /// Whether a sample of the middle layer exceeds those around it. Of equal ones, the first
    /// counts.
    fn is_maximum(&self, column: usize, row: usize) -> bool {
        let value = self.layer(1, row)[column];
        for (index, radius) in [1, self.sampling.reach, 1].into_iter().enumerate() {
            for y in row - radius..=row + radius {
                let around = column - radius..=column + radius;
                let samples = &self.layer(index, y)[around.clone()];
                for (x, &other) in around.zip(samples) {
                    let earlier = (index, y, x) < (1, row, column);
                    if other > value || (earlier && other == value) {
                        return false;
                    }
                }
            }
        }
        true
    }

    /// Moves a maximum to the peak of the quadratic through the samples around it in position and
    /// scale (Brown and Lowe, BMVC 2002, equations 2 and 3). None where the peak is further
    /// away than those samples are, and so not supported by any.
    fn localise(&self, column: usize, row: usize) -> Option<Keypoint> {
        let Sampling { integral, step, reach, .. } = self.sampling;
        let spacing = (reach * step) as f32;
        let reach = reach as isize;
        let value = |dx: isize, dy: isize, ds: isize| {
            let x = column.wrapping_add_signed(dx * reach);
            let y = row.wrapping_add_signed(dy * reach);
            self.layer((1 + ds) as usize, y)[x]
        };
        let peak = value(0, 0, 0);
        let gradient = 0.5
            * Vector3::new(
                value(1, 0, 0) - value(-1, 0, 0),
                value(0, 1, 0) - value(0, -1, 0),
                value(0, 0, 1) - value(0, 0, -1),
            );
        let xx = value(1, 0, 0) + value(-1, 0, 0) - 2.0 * peak;
        let yy = value(0, 1, 0) + value(0, -1, 0) - 2.0 * peak;
        let ss = value(0, 0, 1) + value(0, 0, -1) - 2.0 * peak;
        let xy = 0.25 * (value(1, 1, 0) + value(-1, -1, 0) - value(1, -1, 0) - value(-1, 1, 0));
        let xs = 0.25 * (value(1, 0, 1) + value(-1, 0, -1) - value(1, 0, -1) - value(-1, 0, 1));
        let ys = 0.25 * (value(0, 1, 1) + value(0, -1, -1) - value(0, 1, -1) - value(0, -1, 1));
        #[rustfmt::skip]
        let hessian = Matrix3::new(
            xx, xy, xs,
            xy, yy, ys,
            xs, ys, ss,
        );
        let offset = -(hessian.try_inverse()? * gradient);
        if offset.amax() > 1.0 {
            return None;
        }
        let [below, filter, _] = self.filters;
        let (x, y) = (column * step, row * step);
        let scale = filter.scale();
        Some(Keypoint {
            x: x as f32 + spacing * offset.x,
            y: y as f32 + spacing * offset.y,
            // Filter sizes within an octave are equally spaced.
            scale: scale + offset.z * (scale - below.scale()),
            angle: 0.0,
            response: peak + 0.5 * gradient.dot(&offset),
            laplacian_positive: filter.laplacian(integral, x, y) > 0,
        })
    }
}

/// Marks which samples of the middle one of three rows exceed a threshold and their neighbours right, left,
/// above and below, of equal ones the first: few others are left to be compared with all around them.
#[inline(always)]
fn mark_peaks([above, row, below]: [&[f32]; 3], threshold: f32, peaks: &mut Vec<bool>) {
    let count = row.len();
    peaks.clear();
    peaks.resize(count, false);
    let inner = count.saturating_sub(2);
    let (above, below) = (&above[1..][..inner], &below[1..][..inner]);
    let (left, middle, right) = (&row[..inner], &row[1..][..inner], &row[2..][..inner]);
    for (i, peak) in peaks[1..][..inner].iter_mut().enumerate() {
        let value = middle[i];
        *peak = (value > threshold)
            & (value > above[i])
            & (value > left[i])
            & (value >= right[i])
            & (value >= below[i]);
    }
}
