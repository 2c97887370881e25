//! What a run reads besides its scenes, by content: whoever goes on with the run must read the same.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use xxhash_rust::xxh3::Xxh3;

use super::protocol::Protocol;
use super::run_folder::FolderError;

/// A line for each file or folder that the protocol names: what it is, and a hash of what it holds.
///
/// # Errors
/// One that cannot be read.
pub fn inputs(protocol: &Protocol) -> Result<BTreeMap<String, String>, FolderError> {
    let estimates = protocol.estimates.iter().map(|file| &file.path);
    let others = protocol.matches.iter().chain(&protocol.gps);
    estimates
        .chain(others)
        .map(|path| Ok((format!("content of {}", path.display()), content(path)?)))
        .collect()
}

/// A hash of a file, or of the files of a folder with their names. The folder of a COLMAP model holds
/// what is read of it.
fn content(path: &Path) -> Result<String, FolderError> {
    let mut sum = Xxh3::new();
    for file in files(path).map_err(FolderError::io(path))? {
        sum.update(file.file_name().unwrap_or_default().as_encoded_bytes());
        add(&mut sum, &file).map_err(FolderError::io(file))?;
    }
    Ok(format!("{:032x}", sum.digest128()))
}

/// The file itself, or those of the folder in the order of their names.
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
    let mut file = File::open(file)?;
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(()),
            read => sum.update(&buffer[..read]),
        }
    }
}
