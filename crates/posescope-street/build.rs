//! The fingerprint of the street's renderer: frames that an older renderer has left in the cache are
//! never taken for those of this one, and nobody has to remember to raise a number.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::{fs, io};

/// What the bytes of a frame follow from: this package, what it takes from the core, and the versions
/// of the packages that it computes with. Outside of the workspace, the version of this package fixes that of the
/// core, whose sources are not there.
const SOURCES: [&str; 6] = [
    "src",
    "../posescope-core/src/recent.rs",
    "../posescope-core/src/camera.rs",
    "../posescope-core/src/cloud.rs",
    "../posescope-core/src/geometry.rs",
    "../posescope-core/src/image.rs",
];

/// Packages whose version decides about a byte.
const PACKAGES: [&str; 6] = ["image", "libm", "nalgebra", "rand", "rand_pcg", "zune-jpeg"];

/// Where the versions stand, if the package is built in its workspace.
const LOCK: &str = "../../Cargo.lock";

fn main() -> io::Result<()> {
    println!("cargo::rerun-if-changed=build.rs");
    let mut files = Vec::new();
    for source in SOURCES.into_iter().filter(|source| Path::new(source).exists()) {
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
    if Path::new(SOURCES[1]).exists() && Path::new(LOCK).exists() {
        println!("cargo::rerun-if-changed={LOCK}");
        versions(&fs::read_to_string(LOCK)?).hash(&mut hasher);
    }
    println!("cargo::rustc-env=POSESCOPE_STREET_FINGERPRINT={:016x}", hasher.finish());
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

/// The lines of a lock file that name one of [`PACKAGES`], and the version below each.
fn versions(lock: &str) -> Vec<&str> {
    let lines: Vec<_> = lock.lines().collect();
    let is_meant = |pair: &&[&str]| {
        let name = pair[0].strip_prefix("name = ");
        name.is_some_and(|name| PACKAGES.contains(&name.trim_matches('"')))
    };
    lines.windows(2).filter(is_meant).flatten().copied().collect()
}
