//! Whether a map can be believed: what `posescope doctor` says of it decides whether its poses have a confidence.
//!
//! Where clouds, photos, cameras and poses do not fit together, matches and costs agree on poses that are wrong, and
//! nothing that a method leaves behind tells. The answer is kept in the user's cache and stays until the map changes.

use std::hash::Hasher as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use posescope_core::files::{self, write_whole};
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::Xxh3;

use crate::doctor;
use crate::scene::{Scene, cache_file, format_of, street};

/// The version of the file.
const SCHEMA: &str = "posescope.map-check/1";

/// Clouds whose points tell one state of a map from another.
const CLOUDS: usize = 3;

/// What was found in a map.
#[derive(Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MapCheck {
    schema: String,
    /// The version of posescope.
    version: String,
    /// What the map holds.
    content: String,
    /// What is wrong with it; empty where nothing was found.
    mistake: String,
}

impl MapCheck {
    fn new(content: String, mistake: String) -> Self {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Self { schema: SCHEMA.to_owned(), version, content, mistake }
    }

    /// What was found before, if the map and posescope are the same.
    fn read(path: &Path, content: &str) -> Option<Self> {
        let text = files::read_text(path, files::DESCRIPTION).ok()?;
        let known: Self = toml::from_str(&text).ok()?;
        let expected = Self::new(content.to_owned(), known.mistake.clone());
        (known == expected).then_some(known)
    }

    /// Keeps it. A cache that cannot be written only costs time.
    fn write(&self, path: &Path) {
        let text = toml::to_string(self).unwrap_or_default();
        let folder = path.parent().map_or(Ok(()), std::fs::create_dir_all);
        if let Err(error) = folder.and_then(|()| write_whole(path, text.as_bytes())) {
            log::debug!("{}: {error}", path.display());
        }
    }
}

/// What is wrong with the map of a scene, in a phrase; `None` where `posescope doctor` finds nothing, and in scenes
/// without clouds. `examines` is asked where that is not known yet; if it declines, it stays unknown.
pub fn mistake_of_map(
    scene: &dyn Scene,
    argument: &str,
    examines: impl FnOnce() -> bool,
) -> Option<String> {
    let format = format_of(argument, None);
    let is_generated = format.is_some_and(|format| format.name == street::ENTRY.name);
    if is_generated || !(0..scene.frames().len()).any(|frame| scene.has_cloud(frame)) {
        return None;
    }
    let content = content(scene);
    let path = cache_file("map-check", "toml", scene, argument);
    let known = path.as_deref().and_then(|path| MapCheck::read(path, &content));
    if known.is_none() && !examines() {
        return None;
    }
    let check = known.unwrap_or_else(|| {
        // Nobody asked for it, so a map that cannot be examined is none with a mistake.
        let found = catch_unwind(AssertUnwindSafe(|| doctor::mistake(scene))).ok().flatten();
        let words = found.map(|found| found.mistake.about().to_owned());
        let check = MapCheck::new(content, words.unwrap_or_default());
        path.iter().for_each(|path| check.write(path));
        check
    });
    Some(check.mistake).filter(|mistake| !mistake.is_empty())
}

/// What is said where a map has a mistake.
pub fn mistake_line(scene: &dyn Scene, mistake: &str) -> String {
    format!(
        "{}: {mistake}; poses have no confidence until that is mended (`posescope doctor` says more)",
        scene.name()
    )
}

/// What a map holds, as far as three of its clouds, all poses and cameras tell.
fn content(scene: &dyn Scene) -> String {
    let mut sum = Xxh3::new();
    sum.update(&scene.fingerprint().to_le_bytes());
    let frames = scene.frames().len();
    let with_cloud: Vec<usize> = (0..frames).filter(|&frame| scene.has_cloud(frame)).collect();
    let step = with_cloud.len().div_ceil(CLOUDS).max(1);
    for &frame in with_cloud.iter().step_by(step) {
        if let Ok(photo) = scene.photo(frame) {
            sum.update(photo.gray.as_raw());
        }
        for point in scene.cloud(frame).iter().flat_map(|cloud| &cloud.points) {
            for part in point.iter() {
                sum.update(&part.to_le_bytes());
            }
        }
    }
    format!("{:016x}", sum.finish())
}
