//! Changes to the parameters of the estimators: a file and single settings.

use std::io;
use std::path::{Path, PathBuf};

use posescope_core::files;

use crate::describe::ParamError;
use crate::params::Params;

/// Why parameters cannot be changed as asked.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The file has an unknown parameter, or a value out of its range.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The error.
        source: ParamError,
    },
    /// So has a setting.
    #[error(transparent)]
    Param(#[from] ParamError),
}

/// The parameters with the changes of a TOML file, or of the word `paper`, and then those of assignments such as
/// `fb.ratio=0.7`.
///
/// # Errors
/// [`ConfigError`].
pub fn with_config(
    mut params: Params,
    file: Option<&Path>,
    assignments: &[String],
) -> Result<Params, ConfigError> {
    if let Some(path) = file {
        let text = match path.to_str() {
            Some("paper") => include_str!("../../assets/paper.toml").to_owned(),
            _ => files::read_text(path, files::DESCRIPTION)
                .map_err(|source| ConfigError::Io { path: path.to_owned(), source })?,
        };
        params
            .merge_toml(&text)
            .map_err(|source| ConfigError::File { path: path.to_owned(), source })?;
    }
    for assignment in assignments {
        params.assign(assignment)?;
    }
    Ok(params)
}
