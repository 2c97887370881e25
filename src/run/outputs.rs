//! Files that a command writes beside its run folder: they replace nothing but their like.

use std::path::{Component, Path, PathBuf};

/// The extensions of files with JSON lines.
pub const JSON_LINES: [&str; 2] = ["json", "jsonl"];

/// Why a file must not be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OutputError {
    /// The file is there, and is something else.
    #[error("{option} {}: the file exists and {why}; name another, or remove it first", path.display())]
    Replaces {
        /// The option that names the file.
        option: &'static str,
        /// The file.
        path: PathBuf,
        /// What it is.
        why: &'static str,
    },
    /// The file would lie in the run folder.
    #[error(
        "{option} {}: a file outside the run folder expected; the folder may hold nothing but the run",
        path.display()
    )]
    InRunFolder {
        /// The option that names the file.
        option: &'static str,
        /// The file.
        path: PathBuf,
    },
}

/// Refuses to write to a file that is something else: an existing one with another extension than these, or one that
/// belongs to a scene.
///
/// # Errors
/// [`OutputError::Replaces`].
pub fn refuse_to_replace<'a>(
    option: &'static str,
    path: &Path,
    extensions: &[&str],
    scenes: impl IntoIterator<Item = &'a str>,
) -> Result<(), OutputError> {
    // Devices and pipes are no files.
    if !path.is_file() {
        return Ok(());
    }
    let extension = path.extension().unwrap_or_default();
    let is_ours = extensions.iter().any(|ours| extension.eq_ignore_ascii_case(ours));
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let folders = scenes.into_iter().filter_map(|scene| Path::new(scene).canonicalize().ok());
    let mut folders = folders.map(|scene| match scene.parent() {
        Some(folder) if scene.is_file() => folder.to_owned(),
        _ => scene,
    });
    // No scene has recordings.
    let is_data =
        !extension.eq_ignore_ascii_case("rrd") && folders.any(|folder| whole.starts_with(folder));
    if is_ours && !is_data {
        return Ok(());
    }
    let why = if is_data { "is a file of the scene" } else { "is another kind of file" };
    Err(OutputError::Replaces { option, path: path.to_owned(), why })
}

/// Refuses a file in the run folder, which may not be there yet.
///
/// # Errors
/// [`OutputError::InRunFolder`].
pub fn refuse_in_folder(
    option: &'static str,
    path: &Path,
    folder: &Path,
) -> Result<(), OutputError> {
    if normal(path).starts_with(normal(folder)) {
        return Err(OutputError::InRunFolder { option, path: path.to_owned() });
    }
    Ok(())
}

/// An absolute path without `.` and `..`.
fn normal(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let mut normal = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(normal.pop()),
            Component::CurDir => {}
            part => normal.push(part),
        }
    }
    normal
}
