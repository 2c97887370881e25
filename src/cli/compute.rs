//! Where hypotheses are scored: `--compute`.

use super::failure::CliError;

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

/// Runs a command with its hypotheses scored there.
#[cfg(feature = "gpu")]
pub fn with(
    compute: Compute,
    command: impl FnOnce() -> Result<(), CliError>,
) -> Result<(), CliError> {
    use std::sync::Arc;

    use posescope::render::{Device, use_device};
    use posescope_gpu::{Gpu, GpuError};

    let gpu = match compute {
        Compute::Cpu => return command(),
        Compute::Auto => Arc::new(Gpu::if_any()),
        Compute::Gpu => Arc::new(Gpu::requested()?),
    };
    use_device(Arc::clone(&gpu) as Arc<dyn Device>);
    command()?;
    // With `--compute gpu`, report that the processor had to take over.
    match gpu.complaint() {
        Some(why) if compute == Compute::Gpu || matches!(why, GpuError::Disagrees(_)) => {
            Err(why.into())
        }
        _ => Ok(()),
    }
}

/// Runs a command with its hypotheses scored there.
#[cfg(not(feature = "gpu"))]
pub fn with(
    compute: Compute,
    command: impl FnOnce() -> Result<(), CliError>,
) -> Result<(), CliError> {
    match compute {
        Compute::Auto | Compute::Cpu => command(),
        Compute::Gpu => Err(CliError::NoGpu),
    }
}
