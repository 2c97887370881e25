//! Real sample data, which the project does not ship.

use std::path::PathBuf;

/// A folder below `POSESCOPE_DATA`; says that the test is skipped where there is none.
pub fn sample(folder: &str) -> Option<PathBuf> {
    let path = std::env::var_os("POSESCOPE_DATA").map(|root| PathBuf::from(root).join(folder));
    let found = path.filter(|path| path.exists());
    if found.is_none() {
        println!("skipped: no data");
    }
    found
}
