//! The fingerprint of the street's renderer: frames that an older renderer has left in the cache are
//! never taken for those of this one, and nobody has to remember to raise a number.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::{fs, io};

/// What the bytes of a frame follow from.
const SOURCES: [&str; 4] = [
    "src/scene/street.rs",
    "src/scene/street",
    "src/camera.rs",
    "src/geometry.rs",
];

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    let mut files = Vec::new();
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
        collect(Path::new(source), &mut files)?;
    }
    // A folder's listing comes in no particular order.
    files.sort();
    let mut hasher = DefaultHasher::new();
    env!("CARGO_PKG_VERSION").hash(&mut hasher);
    for file in files {
        fs::read(file)?.hash(&mut hasher);
    }
    println!(
        "cargo::rustc-env=POSESCOPE_STREET_FINGERPRINT={:016x}",
        hasher.finish()
    );
    Ok(())
}

/// The file, or all files below the folder.
fn collect(path: &Path, files: &mut Vec<PathBuf>) -> io::Result<()> {
    if path.is_dir() {
        for entry in fs::read_dir(path)? {
            collect(&entry?.path(), files)?;
        }
    } else {
        files.push(path.to_owned());
    }
    Ok(())
}
