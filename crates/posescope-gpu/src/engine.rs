//! A card with its shaders, and what they draw on.

use std::sync::Mutex;

use crate::card::Card;
use crate::failure::GpuError;
use crate::kernels::Kernels;
use crate::probe;
use crate::slots::Slots;

/// A card that computes as the processor does.
pub(crate) struct Engine {
    pub card: Card,
    pub kernels: Kernels,
    /// What hypotheses are drawn on; one batch at a time.
    pub slots: Mutex<Slots>,
}

impl Engine {
    /// Opens a card, and asks it what is known.
    pub fn open(software_will_do: bool) -> Result<Self, GpuError> {
        let card = Card::open(software_will_do)?;
        let kernels = Kernels::new(&card.device);
        let is_exact = probe::is_exact(&card, &kernels);
        if let Some(failure) = card.failure() {
            return Err(failure);
        }
        if !is_exact {
            return Err(GpuError::Inexact(card.name().to_owned()));
        }
        Ok(Self { card, kernels, slots: Mutex::default() })
    }
}
