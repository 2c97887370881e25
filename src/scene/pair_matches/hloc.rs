//! Features and matches of hloc (Sarlin et al., *From Coarse to Fine*, CVPR 2019): one file with `IMAGE/keypoints`
//! (N × 2, often in 16 bits), one with `IMAGE0/IMAGE1/matches0`, where names have `-` instead of `/`. Older files have
//! `IMAGE0_IMAGE1/matches0`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use half::f16;
use hdf5_pure::{Dataset, File, Group};

use posescope_core::scene::{stem, without_kind};

use super::{MAX_KEYPOINTS, Names, RawMatches};
use crate::scene::SceneError;
use crate::scene::frame_names::{agree, flat};

/// How deep groups are searched for images.
const DEEPEST: usize = 8;
/// The most images and pairs; limits the search in a damaged file.
const MAX_ENTRIES: usize = 1 << 20;

/// The open files, and their content by name.
pub(super) struct HlocFiles {
    features: File,
    features_path: PathBuf,
    matches: File,
    matches_path: PathBuf,
    /// Images by their names with `-` instead of `/`.
    images: BTreeMap<String, String>,
    /// The same names of images by what is left without the extension.
    by_path: BTreeMap<String, Vec<String>>,
    /// The same names of images by the names of their files without extension.
    by_file: BTreeMap<String, Vec<String>>,
    /// The groups of stored pairs, by these names.
    pairs: BTreeMap<(String, String), String>,
}

impl HlocFiles {
    /// Opens the files, and detects which contains features and which matches.
    pub(super) fn open(folder: &Path, files: &[&PathBuf]) -> Result<Self, SceneError> {
        let (mut features, mut matches) = (None, None);
        for path in files {
            let file = File::open_streaming(path).map_err(|why| content(path, &why))?;
            let mut found = Found::default();
            walk(&file.root(), &mut Vec::new(), &mut found).map_err(|why| content(path, &why))?;
            let slot = match (found.keypoints.is_empty(), found.matches.is_empty()) {
                (false, _) => &mut features,
                (true, false) => &mut matches,
                (true, true) => continue,
            };
            if let Some((other, ..)) = slot.replace(((*path).clone(), file, found)) {
                let expected = format!(
                    "one file of features and one of matches expected in a folder; `{}` has the same \
                     kind",
                    other.display()
                );
                return Err(content(path, &expected));
            }
        }
        let (Some((features_path, features, found)), Some((matches_path, matches, stored))) =
            (features, matches)
        else {
            let expected = "a file of hloc's features and one of its matches expected, both .h5";
            return Err(content(folder, &expected));
        };
        let images: BTreeMap<String, String> =
            found.keypoints.into_iter().map(|name| (name.replace('/', "-"), name)).collect();
        let mut pairs = BTreeMap::new();
        for group in stored.matches {
            let pair = pair_of(&group, &images).map_err(|why| content(&matches_path, &why))?;
            if let Some(pair) = pair {
                pairs.insert(pair, group.join("/"));
            }
        }
        if pairs.is_empty() {
            let expected = "matches of images that the features have expected, none found";
            return Err(content(&matches_path, &expected));
        }
        let (mut by_path, mut by_file) = (BTreeMap::new(), BTreeMap::new());
        for name in pairs.keys().flat_map(|(a, b)| [a, b]).collect::<BTreeSet<_>>() {
            let own: &mut Vec<String> = by_path.entry(without_ending(name)).or_default();
            own.push(name.clone());
            let path = images.get(name).unwrap_or(name);
            let file = path.rsplit('/').next().unwrap_or(path);
            let same: &mut Vec<String> = by_file.entry(without_ending(file)).or_default();
            same.push(name.clone());
        }
        Ok(Self { features, features_path, matches, matches_path, images, by_path, by_file, pairs })
    }

    /// The images that a frame may be: those of its path, or the only one of its file.
    fn images_of(&self, names: &Names<'_>) -> Vec<&String> {
        let flat = flat(names.frame);
        if let Some((image, _)) = self.images.get_key_value(&flat) {
            return vec![image];
        }
        if let Some(images) = self.by_path.get(&flat) {
            return images.iter().collect();
        }
        if let Some(image) = names.other.and_then(|other| self.image_called(other)) {
            return vec![image];
        }
        let of_file = self.by_file.get(stem(names.frame)).map(Vec::as_slice);
        match of_file {
            Some([image]) if names.is_file_unique => {
                let path = self.images.get(image).unwrap_or(image);
                let may_be = agree(&without_ending(path), names.frame);
                may_be.then_some(image).into_iter().collect()
            }
            _ => Vec::new(),
        }
    }

    /// The only image that another name of a frame means.
    fn image_called(&self, other: &str) -> Option<&String> {
        let path = |image: &String| without_ending(self.images.get(image).unwrap_or(image));
        let file = stem(other);
        let called = [file.to_owned(), format!("{file}.color")];
        let called = called.iter().filter_map(|file| self.by_file.get(file)).flatten();
        let mut meant = called.filter(|image| agree(without_kind(&path(image)), other));
        meant.next().filter(|_| meant.next().is_none())
    }

    /// Reads the matches of two frames, if they are stored in this order.
    pub(super) fn read(
        &self,
        first: &Names<'_>,
        second: &Names<'_>,
    ) -> Result<Option<RawMatches>, SceneError> {
        let seconds = self.images_of(second);
        let both = self.images_of(first).into_iter();
        let both = both.flat_map(|a| seconds.iter().map(move |b| (a.clone(), (*b).clone())));
        let stored: Vec<(String, String)> =
            both.filter(|pair| self.pairs.contains_key(pair)).collect();
        let stored = match stored.as_slice() {
            [] => return Ok(None),
            [(a, b)] => [a, b],
            [a, b, ..] => {
                let expected = format!(
                    "one pair of images called {} and {} expected, `{}/{}` and `{}/{}` are both",
                    first.frame, second.frame, a.0, a.1, b.0, b.1
                );
                return Err(content(&self.matches_path, &expected));
            }
        };
        let keypoints = |image: &str| {
            let name = self.images.get(image).ok_or_else(|| {
                let expected = format!("the image `{image}` expected");
                content(&self.features_path, &expected)
            })?;
            let place = format!("{name}/keypoints");
            let found = self.features.dataset(&place).map_err(text_of);
            let found = found.and_then(|set| positions(&set));
            found.map_err(|why| content(&self.features_path, &format!("{place}: {why}")))
        };
        let (first, second) = (keypoints(stored[0])?, keypoints(stored[1])?);
        let [one, other] = stored;
        let group = &self.pairs[&(one.clone(), other.clone())];
        let place = format!("{group}/matches0");
        let partners = self.matches.dataset(&place).map_err(text_of);
        let partners = partners
            .and_then(|set| partners_of(&set))
            .map_err(|why| content(&self.matches_path, &format!("{place}: {why}")))?;
        let found = RawMatches { first, second, partners };
        found.checked(&self.matches_path).map(Some)
    }
}

fn text_of(why: hdf5_pure::Error) -> String {
    why.to_string()
}

fn content(path: &Path, expected: &dyn std::fmt::Display) -> SceneError {
    SceneError::expected(path, expected.to_string().replace('\n', " "))
}

/// The name of an image without the extension of its file.
fn without_ending(image: &str) -> String {
    match image.rsplit_once('.') {
        Some((stem, ending)) if ending.len() <= 4 && !ending.contains('/') => stem.to_owned(),
        _ => image.to_owned(),
    }
}

#[derive(Default)]
struct Found {
    keypoints: Vec<String>,
    /// The groups with matches.
    matches: Vec<Vec<String>>,
}

/// The images of a group `IMAGE0/IMAGE1`, or of an older `IMAGE0_IMAGE1`; `None` if it names no two images of the
/// features. Names may contain `_`.
fn pair_of(
    group: &[String],
    images: &BTreeMap<String, String>,
) -> Result<Option<(String, String)>, String> {
    let name = match group {
        [first, second] => return Ok(Some((first.clone(), second.clone()))),
        [name] => name,
        _ => return Ok(None),
    };
    let splits = name.match_indices('_').map(|(at, _)| (&name[..at], &name[at + 1..]));
    let pairs = splits.filter(|(a, b)| images.contains_key(*a) && images.contains_key(*b));
    match pairs.collect::<Vec<_>>().as_slice() {
        [] => Ok(None),
        [(first, second)] => Ok(Some(((*first).to_owned(), (*second).to_owned()))),
        [(a, b), (c, d), ..] => Err(format!(
            "the names of two images expected, `{name}` may be `{a}` and `{b}`, or `{c}` and `{d}`"
        )),
    }
}

/// Searches groups for keypoints and matches.
fn walk(group: &Group, path: &mut Vec<String>, found: &mut Found) -> Result<(), String> {
    let sets = group.datasets().map_err(text_of)?;
    if sets.iter().any(|name| name == "keypoints") {
        found.keypoints.push(path.join("/"));
    }
    if sets.iter().any(|name| name == "matches0") && (1..=2).contains(&path.len()) {
        found.matches.push(path.clone());
    }
    if found.keypoints.len().max(found.matches.len()) > MAX_ENTRIES {
        return Err(format!("at most {MAX_ENTRIES} images or pairs expected"));
    }
    if path.len() == DEEPEST {
        return Ok(());
    }
    for name in group.groups().map_err(text_of)? {
        let inside = group.group(&name).map_err(text_of)?;
        path.push(name);
        walk(&inside, path, found)?;
        path.pop();
    }
    Ok(())
}

/// Refuses arrays that are larger than any photo's keypoints, before reading them.
fn check_size(set: &Dataset) -> Result<Vec<u64>, String> {
    let shape = set.shape().map_err(text_of)?;
    let count = shape.iter().try_fold(1_u64, |all, &side| all.checked_mul(side));
    match count {
        Some(count) if count <= 2 * MAX_KEYPOINTS as u64 => Ok(shape),
        _ => Err(format!(
            "at most {MAX_KEYPOINTS} keypoints in a photo expected, an array of {shape:?} found"
        )),
    }
}

fn positions(set: &Dataset) -> Result<Vec<[f32; 2]>, String> {
    let [_, 2] = check_size(set)?[..] else {
        return Err("positions expected, an array N × 2".to_owned());
    };
    let numbers: Vec<f32> = match set.element_size().map_err(text_of)? {
        // hloc stores half floats, which the crate cannot convert.
        2 => {
            let bytes = set.read_raw().map_err(text_of)?;
            let halves = bytes.chunks_exact(2);
            halves.map(|half| f16::from_le_bytes([half[0], half[1]]).to_f32()).collect()
        }
        _ => set.read_f32().map_err(text_of)?,
    };
    Ok(numbers.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect())
}

fn partners_of(set: &Dataset) -> Result<Vec<Option<usize>>, String> {
    let [_] = check_size(set)?[..] else {
        return Err("one number for each keypoint expected".to_owned());
    };
    let numbers = set.read_i64().map_err(text_of)?;
    let partner = |number: i64| match number {
        -1 => Ok(None),
        _ => usize::try_from(number)
            .map(Some)
            .map_err(|_| format!("numbers of keypoints or -1 expected, {number} found")),
    };
    numbers.into_iter().map(partner).collect()
}
