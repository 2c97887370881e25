//! The frames of a scene by the names that other programs may use.

use std::collections::{BTreeMap, BTreeSet};

use posescope_core::scene::{stem, without_extension, without_kind};

use super::Scene;
use super::lines::excerpt_of;

/// The names of frames whose photos have these paths below the folder of the images: the paths without extension.
/// Photos that differ in the extension alone keep it.
pub(super) fn names_of(photos: &[String]) -> Vec<String> {
    let paths: Vec<String> = photos.iter().map(|photo| photo.replace('\\', "/")).collect();
    let mut count: BTreeMap<&str, usize> = BTreeMap::new();
    for path in &paths {
        *count.entry(bare(path)).or_default() += 1;
    }
    let name = |path: &String| if count[bare(path)] == 1 { bare(path) } else { path }.to_owned();
    paths.iter().map(name).collect()
}

/// A path without the extension of its file.
pub(super) fn bare(path: &str) -> &str {
    let folder = path.rfind('/').map_or(0, |at| at + 1);
    match path[folder..].rfind('.') {
        Some(at) if at > 0 => &path[..folder + at],
        _ => path,
    }
}

/// Looks frames up by the names in a file. A name means a frame by the whole relative path of its photo, with `-` in
/// place of `/`, as hloc writes it, or by the name of the photo's file, if only one frame and only one name have it.
/// Plain numbers mean frames that are called by this number alone.
pub(super) struct FrameNames<'a> {
    /// The name of the scene.
    scene: &'a str,
    frames: &'a [String],
    /// Frames by name, and by name with `-`; `None` if several share one.
    whole: BTreeMap<String, Option<usize>>,
    /// By the names of the files; `None` if several share one.
    stems: BTreeMap<&'a str, Option<usize>>,
    /// By number; `None` if several share one.
    numbers: BTreeMap<u64, Option<usize>>,
    /// By other names.
    others: OtherNames,
}

impl<'a> FrameNames<'a> {
    pub fn new(scene: &'a dyn Scene) -> Self {
        Self { others: OtherNames::of(scene), ..Self::of(scene.name(), scene.frames()) }
    }

    /// The frames of a scene that is not complete yet.
    pub fn of(scene: &'a str, frames: &'a [String]) -> Self {
        let named = || frames.iter().enumerate();
        let flat = named().map(|(at, name)| (flat(name), at));
        let numbers = named().filter_map(|(at, name)| Some((name.parse().ok()?, at)));
        let mut whole = unique(flat);
        whole.extend(named().map(|(at, name)| (name.clone(), Some(at))));
        Self {
            scene,
            frames,
            whole,
            stems: unique(named().map(|(at, name)| (stem(name), at))),
            numbers: unique(numbers),
            others: OtherNames::default(),
        }
    }

    /// The frames that all names of a file mean.
    pub fn find_all<'b>(&self, names: impl Iterator<Item = &'b str> + Clone) -> Vec<Option<usize>> {
        let mut of_stem: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
        for name in names.clone() {
            of_stem.entry(stem(name)).or_default().insert(without_extension(name));
        }
        let find = |name: &str| {
            let is_only = of_stem.get(stem(name)).is_some_and(|names| names.len() == 1);
            let by_stem = || self.find_stem(name).filter(|_| is_only);
            let by_path = || self.find_whole(name).or_else(|| self.others.find(name));
            by_path().or_else(by_stem).or_else(|| self.find_number(name))
        };
        names.map(find).collect()
    }

    fn find_whole(&self, name: &str) -> Option<usize> {
        let find = |name: &str| self.whole.get(name).copied().flatten();
        find(name).or_else(|| find(without_extension(name))).or_else(|| {
            let flat = flat(name);
            find(&flat).or_else(|| find(without_extension(&flat)))
        })
    }

    /// By the name of the file. Where both have folders, the name must end with the whole path of the photo.
    fn find_stem(&self, name: &str) -> Option<usize> {
        let frame = self.stems.get(stem(name)).copied().flatten()?;
        agree(without_extension(name), &self.frames[frame]).then_some(frame)
    }

    fn find_number(&self, name: &str) -> Option<usize> {
        let number = without_extension(name).parse().ok()?;
        self.numbers.get(&number).copied().flatten()
    }

    /// Says how many names of a file mean no frame.
    pub fn warn_of_strangers(&self, file: &str, what: &str, strangers: &[&str], all: usize) {
        // The file of a whole set serves a single photo.
        if let Some(first) = strangers.first().filter(|_| self.frames.len() > 1) {
            log::warn!(
                "{file}: {} of {all} {what} are of no frame of {}, such as `{}`",
                strangers.len(),
                self.scene,
                excerpt_of(first, 60)
            );
        }
    }

    /// The error of a file that has something (`what`) for unknown frames only, one of which it calls `called`.
    pub fn none_found(&self, what: &str, called: &str) -> String {
        format!(
            "{what} of {} expected, with names like `{}`; the file has names like `{}`",
            self.scene,
            self.frames.first().map_or("", String::as_str),
            excerpt_of(called, 60)
        )
    }
}

/// The frames of a scene by what other programs call their photos.
#[derive(Default)]
pub(super) struct OtherNames {
    /// By the whole other name.
    whole: BTreeMap<String, Option<usize>>,
    /// By each end of it, with `-` in place of `/`; `None` if several share one.
    ends: BTreeMap<String, Option<usize>>,
}

impl OtherNames {
    pub fn of(scene: &dyn Scene) -> Self {
        let others = (0..scene.frames().len()).filter_map(|at| Some((scene.other_name(at)?, at)));
        let others: Vec<(&str, usize)> = others.collect();
        let ends =
            others.iter().flat_map(|&(name, at)| ends_of(name).map(move |end| (flat(end), at)));
        Self {
            whole: unique(others.iter().map(|&(name, at)| (name.to_owned(), at))),
            ends: unique(ends),
        }
    }

    /// The frame whose other name this is, or the end of it, or the end of this.
    pub fn find(&self, name: &str) -> Option<usize> {
        let name = without_kind(without_extension(name));
        let by_end = self.ends.get(&flat(name)).copied().flatten();
        by_end.or_else(|| ends_of(name).find_map(|end| self.whole.get(end).copied().flatten()))
    }
}

/// A path, and what is left of it without its first folders.
pub(super) fn ends_of(path: &str) -> impl Iterator<Item = &str> {
    std::iter::successors(Some(path), |path| Some(path.split_once('/')?.1))
}

/// Whether a name in a file may mean a frame: one of them has no folder, or the name ends with the whole path of the
/// frame's photo. A shorter end may be the path of another photo.
pub(super) fn agree(name: &str, frame: &str) -> bool {
    let is_end = || name.strip_suffix(frame).is_some_and(|b| b.is_empty() || b.ends_with('/'));
    !name.contains('/') || !frame.contains('/') || is_end()
}

/// A name with `-` in place of `/`.
pub(super) fn flat(name: &str) -> String {
    name.replace(['/', '\\'], "-")
}

/// The only value of each key; `None` for keys with several.
fn unique<K: Ord>(values: impl Iterator<Item = (K, usize)>) -> BTreeMap<K, Option<usize>> {
    let mut found = BTreeMap::new();
    for (key, value) in values {
        found.entry(key).and_modify(|known| *known = None).or_insert(Some(value));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn owned(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn a_frame_is_called_by_the_path_of_its_photo() {
        let names = |photos: &[&str]| names_of(&owned(photos));
        assert_eq!(names(&["cam0/1.jpg", "cam1/1.jpg"]), ["cam0/1", "cam1/1"]);
        assert_eq!(names(&["a\\1.jpg", "2.5.jpg", ".x"]), ["a/1", "2.5", ".x"]);
        assert_eq!(names(&["a/1.jpg", "a/1.png", "a/2.png"]), ["a/1.jpg", "a/1.png", "a/2"]);
    }

    #[test]
    fn a_name_means_a_frame_by_path_and_by_file_only_where_one_is_called_so() {
        let found = |frames: &[&str], names: &[&str]| {
            let frames = owned(frames);
            FrameNames::of("scene", &frames).find_all(names.iter().copied())
        };
        let rig = ["cam0/000001", "cam0/000002", "cam1/000001"];
        let numbers = ["000001", "000002"];
        for name in ["cam1/000001.jpg", "cam1/000001", "cam1-000001.png", "cam1-000001"] {
            assert_eq!(found(&rig, &[name]), [Some(2)], "{name}");
        }
        // Both cameras have a file of this name, one has the other.
        assert_eq!(found(&rig, &["000001.jpg", "000002.jpg"]), [None, Some(1)]);
        assert_eq!(found(&numbers, &["a/000002.jpg", "b/000002.jpg"]), [None, None]);
        assert_eq!(found(&rig, &["data/cam0/000002.jpg"]), [Some(1)]);
        // Not by a shorter end of the path, which may be that of another photo.
        let deep = ["a/cam0/000001", "a/cam1/000002"];
        assert_eq!(found(&deep, &["cam0/000001.jpg", "000002.jpg"]), [None, Some(1)]);
        assert_eq!(found(&deep, &["data/a/cam0/000001.jpg"]), [Some(0)]);
        // A number says nothing about a folder or about letters.
        assert_eq!(found(&rig, &["2", "cam2/000002", "img2"]), [None, None, None]);
        assert_eq!(found(&["left2", "right3"], &["2", "3"]), [None, None]);
        assert_eq!(found(&numbers, &["2", "1.png", "x/000001.png"]), [Some(1), Some(0), Some(0)]);
        assert_eq!(found(&numbers, &["photos/000002.jpg", "3"]), [Some(1), None]);
        assert_eq!(found(&["a.jpg", "a.png"], &["a.png", "a"]), [Some(1), None]);
    }
}
