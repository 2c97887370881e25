//! The grid search of posescope on a graphics card.
//!
//! [`Gpu`] is a [`Device`] of the core: it draws the points of a cloud for a batch of hypotheses, tells
//! which of them are seen, and answers with whole numbers, from which the core makes the same costs as
//! from its own. That they are the same to the last bit is no luck:
//!
//! - A pixel and a depth come from sums and products that are rounded one by one, as the processor rounds
//!   them: nothing that a compiler may fuse stands beside each other. The quotient, which cards may round
//!   as they like, is corrected in whole numbers (`shaders/project.wgsl`).
//! - Depths are compared as whole numbers by atomic maxima, and of two points at the same depth the first
//!   one is seen, so that no order of threads has a part in what is drawn (`shaders/draw.wgsl`).
//! - Histograms are counts, and so are the errors of the photometric cost, in units of 2⁻¹⁶
//!   (`shaders/counts.wgsl`, `shaders/half.wgsl`).
//!
//! A card is asked a few thousand questions with known answers before it is trusted, and the core scores
//! some of each batch on its own threads.

mod adapter;
mod card;
mod engine;
mod failure;
mod kernels;
mod loaded;
mod probe;
mod slots;

use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use posescope_core::method::Method;
use posescope_core::render::{Device, Loaded, Workload};

use engine::Engine;
use loaded::OnCard;

pub use failure::GpuError;

/// Hypotheses that are worth waking a card for, where nobody asked for it.
const LEAST_UNASKED: usize = 1024;
/// Hypotheses that are worth handing over, where somebody asked for the card.
const LEAST_ASKED: usize = 16;

/// A graphics card that scores hypotheses, found when it is first needed.
pub struct Gpu {
    engine: OnceLock<Result<Arc<Engine>, GpuError>>,
    is_asked_for: bool,
    /// Methods of which was said that they do without the card.
    left_out: Mutex<BTreeSet<Method>>,
}

impl Gpu {
    /// A card of this computer, for searches of some thousand hypotheses; it is looked for when the first
    /// of them comes. Software that plays a card is none.
    pub fn if_any() -> Self {
        Self {
            engine: OnceLock::new(),
            is_asked_for: false,
            left_out: Mutex::default(),
        }
    }

    /// A card of this computer, or where there is none, software that plays one, which is said as a
    /// warning.
    ///
    /// # Errors
    /// [`GpuError`]: there is neither, or it computes otherwise than the processor.
    pub fn asked_for() -> Result<Self, GpuError> {
        let engine = Engine::open(true)?;
        Ok(Self {
            engine: OnceLock::from(Ok(Arc::new(engine))),
            is_asked_for: true,
            left_out: Mutex::default(),
        })
    }

    /// The card's name and how it is driven; `None` where none was needed or found.
    pub fn name(&self) -> Option<String> {
        let engine = self.engine.get()?.as_ref().ok()?;
        Some(engine.card.name().to_owned())
    }

    /// Why the processor did what the card was to do: it was never found, was lost, or could not take a
    /// query. `None` while nothing is wrong.
    pub fn complaint(&self) -> Option<GpuError> {
        match self.engine.get()? {
            Ok(engine) => engine.card.complaint(),
            Err(error) => Some(error.clone()),
        }
    }

    /// The card, while it works.
    fn engine(&self) -> Option<&Arc<Engine>> {
        let opened = self.engine.get_or_init(|| {
            let opened = Engine::open(false).map(Arc::new);
            match &opened {
                Ok(engine) => log::info!("searching on {}", engine.card.name()),
                Err(why) => log::info!("{why}; searching on the processor"),
            }
            opened
        });
        let engine = opened.as_ref().ok()?;
        engine.card.failure().is_none().then_some(engine)
    }
}

impl fmt::Debug for Gpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Gpu").field("name", &self.name()).finish()
    }
}

impl Device for Gpu {
    fn batch(&self, hypotheses: usize) -> Option<usize> {
        let least = if self.is_asked_for {
            LEAST_ASKED
        } else {
            LEAST_UNASKED
        };
        if hypotheses < least {
            return None;
        }
        Some(self.engine()?.card.most_at_a_time())
    }

    fn load(&self, workload: &Workload<'_>) -> Option<Box<dyn Loaded>> {
        let engine = self.engine()?;
        match OnCard::new(engine, workload) {
            Ok(loaded) => Some(Box::new(loaded)),
            Err(why) => {
                engine.card.refuse(why);
                None
            }
        }
    }

    fn distrust(&self) {
        if let Some(Ok(engine)) = self.engine.get() {
            let card = &engine.card;
            card.fail(GpuError::Disagrees(card.name().to_owned()));
        }
    }

    fn left_out(&self, method: Method, why: &str) {
        let mut told = self.left_out.lock().unwrap_or_else(PoisonError::into_inner);
        // Once, and not for each of a thousand queries.
        if self.is_asked_for && told.insert(method) {
            log::warn!("{method} searches on the processor, not on the graphics card: it {why}");
        }
    }
}
