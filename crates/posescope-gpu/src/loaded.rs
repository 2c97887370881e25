//! A query and its points on a card.

use std::sync::Arc;

use posescope_core::cost::{LesserHalf, Statistic, bin};
use posescope_core::render::{Loaded, ProjectionRows, Tally, Workload};
use wgpu::BufferUsages;

use crate::card::lock;
use crate::engine::Engine;
use crate::failure::GpuError;
use crate::kernels::{Kernel, Shape};
use crate::slots::Batch;

/// Bins per axis whose histogram a workgroup has room for.
const MAX_BINS: usize = 60;
/// Places of points take 28 bits.
const MAX_POINTS: usize = 1 << 28;
/// Points times hypotheses that a card is given at once, so that no driver takes it for hung.
const MAX_WORK: usize = 1 << 27;
/// The same of software.
const MAX_WORK_OF_SOFTWARE: usize = 1 << 22;

/// A query and its points on a card.
pub(crate) struct OnCard {
    engine: Arc<Engine>,
    kernel: Kernel,
    /// What a batch does not change.
    shape: Shape,
    points: wgpu::Buffer,
    query: wgpu::Buffer,
    uniform: wgpu::Buffer,
}

impl OnCard {
    /// Copies a query and its points.
    pub fn new(engine: &Arc<Engine>, workload: &Workload<'_>) -> Result<Self, GpuError> {
        let card = &engine.card;
        let too_small = |what: String| GpuError::TooSmall { name: card.name().to_owned(), what };
        let count = workload.points.len();
        let most_bytes = card.limits.max_storage_buffer_binding_size;
        if count >= MAX_POINTS || 16 * count as u64 > most_bytes {
            return Err(too_small(format!("{count} points do not fit")));
        }
        let (kernel, value): (_, &dyn Fn(f32) -> u32) = match *workload.statistic {
            Statistic::Histogram { bins, .. } if bins > MAX_BINS => {
                return Err(too_small(format!(
                    "a joint histogram of {bins} × {bins} bins does not fit, at most \
                     {MAX_BINS} × {MAX_BINS} do"
                )));
            }
            Statistic::Histogram { bins, .. } => {
                (Kernel::Counts { bins: bins as u32 }, &move |value| bin(value, bins) as u32)
            }
            // The core asks for nothing that is not counted.
            _ => (Kernel::LesserHalf, &f32::to_bits),
        };
        let points: Vec<[u32; 4]> = workload
            .points
            .iter()
            .map(|point| {
                let [x, y, z] = point.position.coords.map(f32::to_bits).into();
                [x, y, z, value(point.intensity)]
            })
            .collect();
        let values = workload.query.iter().map(|&of_pixel| value(of_pixel));
        let query: Vec<u8> = match kernel {
            // Four to a word.
            Kernel::Counts { .. } => values.map(|bin| bin as u8).collect(),
            Kernel::LesserHalf | Kernel::Probe => values.flat_map(u32::to_le_bytes).collect(),
        };
        let mut query = query;
        query.resize(query.len().next_multiple_of(4), 0);
        let storage = BufferUsages::STORAGE;
        let uniform = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
        Ok(Self {
            points: card.filled("points", bytemuck::cast_slice(&points), storage),
            query: card.filled("query", &query, storage),
            uniform: card.buffer("shape", size_of::<Shape>() as u64, uniform),
            engine: Arc::clone(engine),
            kernel,
            shape: Shape {
                points: count as u32,
                poses: 0,
                width: workload.width,
                height: workload.height,
                reach: workload.reach,
                rounds: 0,
                zero: 0,
                padding: 0,
            },
        })
    }

    /// Words of the answer to a hypothesis; the last one says whether the card could not decide it.
    fn words(&self) -> usize {
        match self.kernel {
            Kernel::Counts { bins } => (bins * bins) as usize + 1,
            Kernel::LesserHalf | Kernel::Probe => 7,
        }
    }

    /// Hypotheses that are drawn at once.
    fn at_once(&self) -> usize {
        let card = &self.engine.card;
        let work = if card.is_software { MAX_WORK_OF_SOFTWARE } else { MAX_WORK };
        let most_bytes = card.limits.max_storage_buffer_binding_size as usize;
        let by_work = work / (self.shape.points as usize).max(1);
        by_work.min(most_bytes / (4 * self.words())).clamp(1, card.most_at_a_time())
    }

    fn draw(&self, projections: &[ProjectionRows]) -> Option<Vec<u32>> {
        let (card, poses) = (&self.engine.card, projections.len() as u32);
        let words = self.words() * projections.len();
        let pixels = u64::from(self.shape.width) * u64::from(self.shape.height);
        let has_errors = self.kernel == Kernel::LesserHalf;
        let mut slots = lock(&self.engine.slots);
        let batch = slots.batch(
            card,
            (pixels, has_errors),
            size_of_val(projections) as u64,
            4 * words as u64,
        );
        let batch = match batch {
            Ok(batch) => batch,
            Err(why) => {
                card.refuse(why);
                return None;
            }
        };
        let groups = batch.drawing.count.min(poses);
        let shape = Shape { poses, rounds: poses.div_ceil(groups), ..self.shape };
        card.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&shape));
        card.queue.write_buffer(batch.projections, 0, bytemuck::cast_slice(projections));
        let encoder = self.encode(&batch, groups);
        card.run_and_read(encoder, batch.answer, batch.staging, words)
    }

    fn encode(&self, batch: &Batch<'_>, groups: u32) -> wgpu::CommandEncoder {
        let Engine { card, kernels, .. } = self.engine.as_ref();
        let drawing = batch.drawing;
        let buffers = [
            &self.uniform,
            &self.points,
            &self.query,
            batch.projections,
            &drawing.nearest,
            &drawing.first,
            &drawing.errors,
            &drawing.ages,
            batch.answer,
        ];
        kernels.encoded(card, self.kernel, buffers, groups)
    }

    fn read(&self, words: &[u32]) -> Option<Tally> {
        let (&is_undecided, words) = words.split_last()?;
        if is_undecided != 0 {
            return None;
        }
        match (self.kernel, words) {
            (Kernel::LesserHalf, &[covered, counted, ref limbs @ ..]) => {
                let places = limbs.iter().zip([0, 16, 32, 48]);
                let sum: u128 = places.map(|(&limb, place)| u128::from(limb) << place).sum();
                let sum = u64::try_from(sum).ok()?;
                (sum < LesserHalf::MAX_UNITS)
                    .then_some(Tally::LesserHalf { covered, half: LesserHalf { counted, sum } })
            }
            (_, counts) => Some(Tally::Counts(counts.to_vec())),
        }
    }
}

impl Loaded for OnCard {
    fn tally(&self, projections: &[ProjectionRows]) -> Option<Vec<Option<Tally>>> {
        let mut tallies = Vec::with_capacity(projections.len());
        for some in projections.chunks(self.at_once()) {
            let answer = self.draw(some)?;
            tallies.extend(answer.chunks(self.words()).map(|words| self.read(words)));
        }
        Some(tallies)
    }
}
