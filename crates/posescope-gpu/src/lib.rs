//! The grid search of posescope on a graphics card.
//!
//! [`Gpu`] is a [`Device`] of the core. It draws the points of a cloud for a batch of hypotheses, finds the
//! visible points and returns integers, from which the core computes the same costs as from its own. They are
//! equal to the last bit because:
//!
//! - Pixels and depths are sums and products that are rounded one by one, as on the processor. The order of operations leaves a
//!   compiler nothing to fuse. The quotient, which cards may round freely, is corrected in integers (`shaders/project.wgsl`).
//! - Depths are compared as integers by atomic maxima. The first of two points at the same depth is visible, so the result does not
//!   depend on the order of threads (`shaders/draw.wgsl`).
//! - Histograms are counts, and so are the errors of the photometric cost, in units of 2⁻¹⁶
//!   (`shaders/counts.wgsl`, `shaders/half.wgsl`).
//!
//! A card must pass a test of a few thousand known answers before it is used, and the core checks some hypotheses
//! of each batch on the processor.

mod adapter;
mod card;
mod engine;
mod failure;
mod kernels;
mod loaded;
mod probe;
mod quiet;
mod slots;

use std::collections::BTreeSet;
use std::fmt;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use posescope_core::method::Method;
use posescope_core::render::{Device, Loaded, Workload};

use engine::Engine;
use loaded::OnCard;

pub use failure::GpuError;

/// The fewest hypotheses for which a card is used automatically.
const MIN_AUTOMATIC: usize = 1024;
/// The fewest hypotheses for which a requested card is used.
const MIN_REQUESTED: usize = 16;

/// A graphics card that scores hypotheses, opened on first use.
pub struct Gpu {
    engine: OnceLock<Result<Arc<Engine>, GpuError>>,
    is_requested: bool,
    /// Methods that were reported not to use the card.
    left_out: Mutex<BTreeSet<Method>>,
}

impl Gpu {
    /// A card of this computer for large searches, opened on the first of them. Software emulations are not used.
    pub fn if_any() -> Self {
        Self { engine: OnceLock::new(), is_requested: false, left_out: Mutex::default() }
    }

    /// A card of this computer, or a software emulation with a warning.
    ///
    /// # Errors
    /// [`GpuError`]: there is neither, or its results differ from the processor's.
    pub fn requested() -> Result<Self, GpuError> {
        let engine = Engine::open(true)?;
        Ok(Self {
            engine: OnceLock::from(Ok(Arc::new(engine))),
            is_requested: true,
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
        let least = if self.is_requested { MIN_REQUESTED } else { MIN_AUTOMATIC };
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
        let mut reported = self.left_out.lock().unwrap_or_else(PoisonError::into_inner);
        // Once, not for every query.
        if self.is_requested && reported.insert(method) {
            log::warn!("{method} does not use the graphics card: it {why}");
        }
    }
}
