//! Where cached files go.

use std::env;
use std::path::PathBuf;

use directories::ProjectDirs;

/// Names the cache directory; empty turns caching off.
const CACHE_VARIABLE: &str = "POSESCOPE_CACHE";

/// The folder `name` of the user's cache directory, where the environment or else the system says;
/// `None` where caching is turned off or the user has no cache directory.
pub fn user_cache_folder(name: &str) -> Option<PathBuf> {
    let folder = match env::var_os(CACHE_VARIABLE) {
        Some(folder) => PathBuf::from(folder),
        None => ProjectDirs::from("", "", "posescope")?.cache_dir().to_owned(),
    };
    (!folder.as_os_str().is_empty()).then(|| folder.join(name))
}
