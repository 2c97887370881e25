//! Hashes of a run's input files besides its scenes: a resumed run must read the same content.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use posescope_core::files as door;
use xxhash_rust::xxh3::Xxh3;

use super::protocol::Protocol;
use super::run_file::CONTENT_OF;
use super::run_folder::FolderError;

/// One entry per file or folder of the protocol: its path and a hash of its content.
///
/// # Errors
/// A file that cannot be read.
pub fn inputs(protocol: &Protocol) -> Result<BTreeMap<String, String>, FolderError> {
    let estimates = protocol.estimates.iter().map(|file| &file.path);
    let others = protocol.matches.iter().chain(&protocol.gps);
    estimates
        .chain(others)
        .map(|path| Ok((format!("{CONTENT_OF}{}", path.display()), content(path)?)))
        .collect()
}

/// A hash of a file, or of the files of a folder with their names.
///
/// # Errors
/// A file that cannot be read.
pub fn content(path: &Path) -> Result<String, FolderError> {
    let mut sum = Xxh3::new();
    for file in files(path).map_err(FolderError::io(path))? {
        sum.update(file.file_name().unwrap_or_default().as_encoded_bytes());
        add(&mut sum, &file).map_err(FolderError::io(file))?;
    }
    Ok(format!("{:032x}", sum.digest128()))
}

/// The file itself, or the files of the folder in the order of their names.
fn files(path: &Path) -> io::Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let entries = fs::read_dir(path)?.map(|entry| entry.map(|entry| entry.path()));
    let mut files = entries.collect::<io::Result<Vec<_>>>()?;
    files.retain(|file| file.is_file());
    files.sort();
    Ok(files)
}

fn add(sum: &mut Xxh3, file: &Path) -> io::Result<()> {
    let mut file = door::open(file)?;
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(()),
            read => sum.update(&buffer[..read]),
        }
    }
}
