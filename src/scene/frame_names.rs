//! The frames of a scene by the names that other programs may use.

use std::collections::BTreeMap;

use posescope_core::scene::stem;

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

    /// The frame with a name: as it is, without folder and extension, or of the same number.
    pub fn find_named(&self, name: &str) -> Option<usize> {
        let frames = self.scene.frames();
        let whole = frames.iter().position(|frame| frame == name);
        let by_stem = || self.stems.get(stem(name)).copied().flatten();
        let number = name.parse::<u64>().ok();
        let same = |frame: &String| number.is_some() && frame.parse().ok() == number;
        whole.or_else(by_stem).or_else(|| frames.iter().position(same))
    }

    /// The frame with a name, also as a command line would find it.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.find_named(name).or_else(|| self.scene.find(name).ok())
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
