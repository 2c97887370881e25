//! What the demonstration shows: `assets/demo.toml`.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// What the demonstration runs, and where its recording goes.
#[derive(serde::Deserialize)]
pub struct Settings {
    pub scene: String,
    pub query: String,
    pub reference: String,
    pub recording: PathBuf,
}

/// The settings of `assets/demo.toml`.
pub fn settings() -> &'static Settings {
    static SETTINGS: LazyLock<Settings> = LazyLock::new(|| {
        let settings = toml::from_str(include_str!("../../assets/demo.toml"));
        settings.unwrap_or_else(|error| unreachable!("a test reads it: {error}"))
    });
    &SETTINGS
}

/// Where things are saved unless somebody names another place.
pub fn folder() -> &'static Path {
    settings().recording.parent().unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::settings;

    #[test]
    fn the_settings_are_read() {
        assert_eq!(settings().scene, "street");
    }
}
