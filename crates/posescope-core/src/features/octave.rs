//! One octave of the search for blobs.
//!
//! It goes down the image with a few rows of each filter's responses at a time, which stay in the caches of a
//! processor: whole layers would be written to memory and read back from it.

use std::ops::Range;

use rayon::prelude::*;

use super::Keypoint;
use super::blob::{Neighbourhood, Sampling};
use super::hessian::{BoxFilter, Room};
use super::responses::Responses;

/// Fewer rows in a band are not worth the rows that it shares with its neighbours.
const MIN_BAND: usize = 16;
/// Two bands for each thread, so that none waits long for another, and few rows are filtered twice.
const BANDS_PER_THREAD: usize = 2;

/// The filters of one octave and where they are applied.
pub(super) struct Octave<'a> {
    pub(super) sampling: Sampling<'a>,
    pub(super) filters: Vec<BoxFilter>,
    /// Half of the sizes of an octave occur in the one below it already.
    pub(super) known: Known,
}

/// Responses that an octave passes on to the next one, at every second of its samples.
#[derive(Default)]
pub(super) struct Known {
    lobes: Vec<usize>,
    responses: Responses,
}

/// What the search of one band takes, kept from band to band for its memory.
struct BandRoom {
    responses: Responses,
    room: Room,
    peaks: Vec<bool>,
}

impl Octave<'_> {
    /// Finds the blobs, and keeps the responses of those filters that the next octave has too, by their lobes.
    pub(super) fn search(&self, next: &[usize]) -> (Vec<Keypoint>, Known) {
        let columns = self.sampling.integral.width.div_ceil(self.sampling.step);
        let rows = self.sampling.integral.height.div_ceil(self.sampling.step);
        let layers = 0..self.filters.len();
        let shared = layers.filter(|&layer| next.contains(&self.filters[layer].lobe));
        let shared: Vec<usize> = shared.collect();
        let half = columns.div_ceil(2);
        let mut kept = Responses::new(shared.len(), half, rows.div_ceil(2));

        let bands = BANDS_PER_THREAD * rayon::current_num_threads();
        // Even, so that no row that is kept belongs to two bands.
        let height = rows.div_ceil(bands).max(MIN_BAND).next_multiple_of(2);
        let firsts = (0..rows).step_by(height);
        let kept_of_bands = kept.bands_mut(height / 2);
        let kept_of_bands = kept_of_bands.chain(std::iter::repeat_with(<&mut [f32]>::default));
        let bands: Vec<(usize, &mut [f32])> = firsts.zip(kept_of_bands).collect();
        let room = || BandRoom {
            responses: Responses::new(self.filters.len(), columns, 2 * self.sampling.reach + 1),
            room: Room::default(),
            peaks: Vec::new(),
        };
        let found = bands.into_par_iter().map_init(room, |room, (first, kept)| {
            let band = first..(first + height).min(rows);
            self.search_band(band, room, |row, responses| {
                let kept = kept.chunks_exact_mut(half).skip((row - first) / 2 * shared.len());
                for (&layer, kept) in shared.iter().zip(kept) {
                    let samples = responses.row(layer, row).iter().step_by(2);
                    kept.iter_mut().zip(samples).for_each(|(kept, &sample)| *kept = sample);
                }
            })
        });
        let found = found.flatten_iter().collect();
        let lobes = shared.iter().map(|&layer| self.filters[layer].lobe);
        let known = Known { lobes: lobes.collect(), responses: kept };
        (found, known)
    }

    /// Finds the blobs in a band of rows of samples. Every second row is to be kept.
    fn search_band(
        &self,
        band: Range<usize>,
        room: &mut BandRoom,
        mut keep: impl FnMut(usize, &Responses),
    ) -> Vec<Keypoint> {
        let rows = self.sampling.integral.height.div_ceil(self.sampling.step);
        let mut found = Vec::new();
        for row in band.start.saturating_sub(self.sampling.reach)
            ..(band.end + self.sampling.reach).min(rows)
        {
            self.respond(row, room);
            if row % 2 == 0 && band.contains(&row) {
                keep(row, &room.responses);
            }
            // What is found on a row exceeds rows down to the newest.
            let middle = row.checked_sub(self.sampling.reach);
            if let Some(middle) = middle.filter(|middle| band.contains(middle)) {
                self.find(middle, room, &mut found);
            }
        }
        found
    }

    /// Takes in the responses along one row of samples.
    fn respond(&self, row: usize, room: &mut BandRoom) {
        for (layer, filter) in self.filters.iter().enumerate() {
            let samples = room.responses.row_mut(layer, row);
            let known = self.known.lobes.iter().position(|&lobe| lobe == filter.lobe);
            match known {
                Some(known) => samples.copy_from_slice(self.known.responses.row(known, row)),
                None => {
                    let y = row * self.sampling.step;
                    filter.respond(
                        self.sampling.integral,
                        y,
                        self.sampling.step,
                        &mut room.room,
                        samples,
                    );
                }
            }
        }
    }

    /// Finds the blobs in one row of samples, filter by filter.
    fn find(&self, row: usize, room: &mut BandRoom, found: &mut Vec<Keypoint>) {
        for (below, filters) in self.filters.array_windows().enumerate() {
            let responses = &room.responses;
            let neighbourhood =
                Neighbourhood { sampling: self.sampling, filters, responses, below };
            if neighbourhood.inside(self.sampling.integral.height).contains(&row) {
                neighbourhood.find(row, &mut room.peaks, found);
            }
        }
    }
}
