//! The frames of a scene by the names that other programs may use.

use std::collections::BTreeMap;

use super::Scene;
use super::lines::excerpt_of;

/// Looks frames up by the names in a file.
pub(super) struct FrameNames<'a> {
    scene: &'a dyn Scene,
    /// Names without folder and extension; `None` if several frames share one.
    stems: BTreeMap<&'a str, Option<usize>>,
}

impl<'a> FrameNames<'a> {
    pub fn new(scene: &'a dyn Scene) -> Self {
        let mut stems = BTreeMap::new();
        for (index, name) in scene.frames().iter().enumerate() {
            let known = stems.entry(stem(name)).or_insert(Some(index));
            if *known != Some(index) {
                *known = None;
            }
        }
        Self { scene, stems }
    }

    /// The frame with a name: as it is, or without folder and extension, or by number.
    pub fn find(&self, name: &str) -> Option<usize> {
        let frames = self.scene.frames();
        let whole = frames.iter().position(|frame| frame == name);
        let by_stem = || self.stems.get(stem(name)).copied().flatten();
        let by_number = || self.scene.find(stem(name)).ok();
        whole.or_else(by_stem).or_else(by_number)
    }

    /// The error of a file that has something (`what`) for unknown frames only, one of which it calls `called`.
    pub fn none_found(&self, what: &str, called: &str) -> String {
        format!(
            "{what} of {} expected, with names like `{}`; the file has names like `{}`",
            self.scene.name(),
            self.scene.frames().first().map_or("", String::as_str),
            excerpt_of(called, 60)
        )
    }
}

/// A name without folder and image extension.
fn stem(name: &str) -> &str {
    const ENDINGS: [&str; 6] = ["png", "jpg", "jpeg", "bmp", "tif", "tiff"];
    let base = name.rsplit(['/', '\\']).next().unwrap_or(name);
    match base.rsplit_once('.') {
        Some((stem, ending)) if ENDINGS.contains(&ending.to_ascii_lowercase().as_str()) => stem,
        _ => base,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_known_without_folder_and_ending() {
        assert_eq!(stem("rear/1418381798086398.jpg"), "1418381798086398");
        assert_eq!(stem("1305031102.175304"), "1305031102.175304");
        assert_eq!(stem("a\\b.c.PNG"), "b.c");
    }
}
