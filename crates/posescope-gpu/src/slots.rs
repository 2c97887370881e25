//! What hypotheses are drawn on: memory of the card that outlives a batch, and a query.

use wgpu::{BufferUsages, ErrorFilter};

use crate::card::Card;
use crate::failure::GpuError;

/// Hypotheses that are drawn at a time, at most: several for each core of a large card.
const MAX_SLOTS: u64 = 1024;
/// Software has a few threads.
const MAX_SLOTS_OF_SOFTWARE: u64 = 16;
/// Memory of one of the three buffers, at most \[bytes\].
const MAX_BYTES: u64 = 1 << 30;

/// The buffers of a card that are kept.
#[derive(Default)]
pub(crate) struct Slots {
    drawing: Option<Drawing>,
    projections: Option<wgpu::Buffer>,
    answer: Option<wgpu::Buffer>,
    staging: Option<wgpu::Buffer>,
}

/// Where hypotheses are drawn.
pub(crate) struct Drawing {
    pub nearest: wgpu::Buffer,
    pub first: wgpu::Buffer,
    pub errors: wgpu::Buffer,
    pub ages: wgpu::Buffer,
    /// Hypotheses that are drawn at a time.
    pub count: u32,
    /// Pixels of each.
    pixels: u64,
    has_errors: bool,
}

/// The buffers of a batch.
pub(crate) struct Batch<'a> {
    pub drawing: &'a Drawing,
    pub projections: &'a wgpu::Buffer,
    pub answer: &'a wgpu::Buffer,
    pub staging: &'a wgpu::Buffer,
}

impl Slots {
    /// The buffers for a batch of hypotheses of so many pixels, with room for so many bytes.
    pub fn batch(
        &mut self,
        card: &Card,
        (pixels, has_errors): (u64, bool),
        projection_bytes: u64,
        answer_bytes: u64,
    ) -> Result<Batch<'_>, GpuError> {
        let fits =
            |drawing: &Drawing| drawing.pixels == pixels && (drawing.has_errors || !has_errors);
        if !self.drawing.as_ref().is_some_and(fits) {
            // Before the new buffers are asked for, the old ones are given back.
            self.drawing = None;
            self.drawing = Some(Drawing::new(card, pixels, has_errors)?);
        }
        let (to_card, from_card) = (BufferUsages::COPY_DST, BufferUsages::COPY_SRC);
        let storage = BufferUsages::STORAGE;
        grow(card, &mut self.projections, projection_bytes, storage | to_card);
        grow(card, &mut self.answer, answer_bytes, storage | from_card);
        grow(card, &mut self.staging, answer_bytes, BufferUsages::MAP_READ | to_card);
        match (&self.drawing, &self.projections, &self.answer, &self.staging) {
            (Some(drawing), Some(projections), Some(answer), Some(staging)) => {
                Ok(Batch { drawing, projections, answer, staging })
            }
            _ => unreachable!("they were made above"),
        }
    }
}

/// Makes a buffer larger where it is too small.
fn grow(card: &Card, buffer: &mut Option<wgpu::Buffer>, bytes: u64, usage: BufferUsages) {
    if buffer.as_ref().is_none_or(|buffer| buffer.size() < bytes) {
        *buffer = Some(card.buffer("batch", bytes, usage));
    }
}

impl Drawing {
    /// As many slots as are of use and fit.
    fn new(card: &Card, pixels: u64, has_errors: bool) -> Result<Self, GpuError> {
        let limits = &card.limits;
        let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let most = if card.is_software { MAX_SLOTS_OF_SOFTWARE } else { MAX_SLOTS };
        let mut count = (bytes.min(MAX_BYTES) / (4 * pixels)).min(most);
        while count > 0 {
            match Self::with(card, pixels, has_errors, count) {
                Some(drawing) => return Ok(drawing),
                None => count /= 2,
            }
        }
        Err(GpuError::TooSmall {
            name: card.name().to_owned(),
            what: format!("a query of {pixels} pixels does not fit"),
        })
    }

    /// So many slots; `None` where the card has no memory for them.
    fn with(card: &Card, pixels: u64, has_errors: bool, count: u64) -> Option<Self> {
        let bytes = 4 * pixels * count;
        let scope = card.device.push_error_scope(ErrorFilter::OutOfMemory);
        let storage = |label, bytes| card.buffer(label, bytes, BufferUsages::STORAGE);
        let drawing = Self {
            nearest: storage("nearest", bytes),
            first: storage("first", bytes),
            errors: storage("errors", if has_errors { bytes } else { 0 }),
            ages: storage("ages", 4 * count),
            count: count as u32,
            pixels,
            has_errors,
        };
        pollster::block_on(scope.pop()).is_none().then_some(drawing)
    }
}
