//! Where hypotheses are scored: `--compute`.

#[cfg(feature = "gpu")]
pub use posescope_gpu::GpuError as ComputeError;

/// A card was asked for.
#[cfg(not(feature = "gpu"))]
#[derive(Debug, thiserror::Error)]
#[error("--compute gpu needs a posescope that is built with the feature `gpu`; use --compute cpu")]
pub struct ComputeError;

/// Where the hypotheses of a search are scored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Compute {
    /// A graphics card if there is one and the search is large, otherwise the processor
    #[default]
    Auto,
    /// The processor
    Cpu,
    /// A graphics card or a software emulation of one; exit code 5 if there is neither
    Gpu,
}

impl Compute {
    /// The one of this name.
    ///
    /// # Errors
    /// Which names there are.
    pub fn named(name: &str) -> Result<Self, String> {
        <Self as clap::ValueEnum>::from_str(name, false)
            .map_err(|_| "auto, cpu or gpu expected".to_owned())
    }
}

/// Runs a command with its hypotheses scored there.
///
/// # Errors
/// Those of the command, and a card that was asked for and is missing or failed.
#[cfg(feature = "gpu")]
pub fn with<T, E: From<ComputeError>>(
    compute: Compute,
    command: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    use std::sync::Arc;

    use posescope::render::{Device, use_device};
    use posescope_gpu::Gpu;

    let gpu = match compute {
        Compute::Cpu => return command(),
        Compute::Auto => Arc::new(Gpu::if_any()),
        Compute::Gpu => Arc::new(Gpu::requested()?),
    };
    use_device(Arc::clone(&gpu) as Arc<dyn Device>);
    let done = command()?;
    // With `--compute gpu`, report that the processor had to take over.
    match gpu.complaint() {
        Some(why) if compute == Compute::Gpu || matches!(why, ComputeError::Disagrees(_)) => {
            Err(why.into())
        }
        _ => Ok(done),
    }
}

/// Runs a command with its hypotheses scored there.
///
/// # Errors
/// Those of the command, and that a card was asked for.
#[cfg(not(feature = "gpu"))]
pub fn with<T, E: From<ComputeError>>(
    compute: Compute,
    command: impl FnOnce() -> Result<T, E>,
) -> Result<T, E> {
    match compute {
        Compute::Auto | Compute::Cpu => command(),
        Compute::Gpu => Err(ComputeError.into()),
    }
}
