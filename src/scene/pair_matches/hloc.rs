//! Features and matches as hloc (Sarlin et al., *From Coarse to Fine*, CVPR 2019) writes them: one file
//! with `IMAGE/keypoints` (N × 2, often in 16 bits), one with `IMAGE0/IMAGE1/matches0`, where the names
//! have `-` for `/`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use half::f16;
use hdf5_pure::{Dataset, File, Group};

use super::{MOST_KEYPOINTS, RawMatches};
use crate::scene::SceneError;

/// Folders within folders that images are looked for in.
const DEEPEST: usize = 8;
/// Images and pairs at most, so that a damaged file ends the search.
const MOST_ENTRIES: usize = 1 << 20;

/// The open files, and what is where.
pub(super) struct HlocFiles {
    features: File,
    features_path: PathBuf,
    matches: File,
    matches_path: PathBuf,
    /// Images by their names with `-` for `/`.
    images: BTreeMap<String, String>,
    /// Pairs as they are stored, by the frames' names.
    pairs: BTreeMap<(String, String), Vec<[String; 2]>>,
}

impl HlocFiles {
    /// Finds out which of the files has the features and which the matches.
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
                    "one file of features and one of matches expected in a folder; `{}` is another of its \
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
        let images: BTreeMap<String, String> = found
            .keypoints
            .into_iter()
            .map(|name| (name.replace('/', "-"), name))
            .collect();
        let mut pairs: BTreeMap<_, Vec<[String; 2]>> = BTreeMap::new();
        for [first, second] in stored.matches {
            let frame = |name: &str| frame_name(images.get(name).map_or(name, String::as_str));
            let key = (frame(&first), frame(&second));
            pairs.entry(key).or_default().push([first, second]);
        }
        Ok(Self {
            features,
            features_path,
            matches,
            matches_path,
            images,
            pairs,
        })
    }

    /// The matches of two frames, if they are stored in this order.
    pub(super) fn read(&self, first: &str, second: &str) -> Result<Option<RawMatches>, SceneError> {
        let key = (first.to_owned(), second.to_owned());
        let stored = match self.pairs.get(&key).map(Vec::as_slice) {
            None | Some([]) => return Ok(None),
            Some([stored]) => stored,
            Some([a, b, ..]) => {
                let expected = format!(
                    "one pair of images called {first} and {second} expected, `{}` and `{}` are both",
                    a.join("/"),
                    b.join("/")
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
            let found = self.features.dataset(&place).map_err(said);
            let found = found.and_then(|set| positions(&set));
            found.map_err(|why| content(&self.features_path, &format!("{place}: {why}")))
        };
        let (first, second) = (keypoints(&stored[0])?, keypoints(&stored[1])?);
        let place = format!("{}/{}/matches0", stored[0], stored[1]);
        let partners = self.matches.dataset(&place).map_err(said);
        let partners = partners
            .and_then(|set| partners_of(&set))
            .map_err(|why| content(&self.matches_path, &format!("{place}: {why}")))?;
        let found = RawMatches {
            first,
            second,
            partners,
        };
        found.checked(&self.matches_path).map(Some)
    }
}

fn said(why: hdf5_pure::Error) -> String {
    why.to_string()
}

fn content(path: &Path, expected: &dyn std::fmt::Display) -> SceneError {
    SceneError::expected(path, expected.to_string().replace('\n', " "))
}

/// The name of a frame whose image goes by this name.
fn frame_name(image: &str) -> String {
    let base = image.rsplit('/').next().unwrap_or(image);
    match base.rsplit_once('.') {
        Some((stem, ending)) if ending.len() <= 4 => stem.to_owned(),
        _ => base.to_owned(),
    }
}

#[derive(Default)]
struct Found {
    keypoints: Vec<String>,
    matches: Vec<[String; 2]>,
}

/// Looks for groups that have keypoints or matches.
fn walk(group: &Group, path: &mut Vec<String>, found: &mut Found) -> Result<(), String> {
    let sets = group.datasets().map_err(said)?;
    if sets.iter().any(|name| name == "keypoints") {
        found.keypoints.push(path.join("/"));
    }
    if let (true, [first, second]) = (sets.iter().any(|name| name == "matches0"), path.as_slice()) {
        found.matches.push([first.clone(), second.clone()]);
    }
    if found.keypoints.len().max(found.matches.len()) > MOST_ENTRIES {
        return Err(format!("at most {MOST_ENTRIES} images or pairs expected"));
    }
    if path.len() == DEEPEST {
        return Ok(());
    }
    for name in group.groups().map_err(said)? {
        let inside = group.group(&name).map_err(said)?;
        path.push(name);
        walk(&inside, path, found)?;
        path.pop();
    }
    Ok(())
}

/// Refuses what is larger than any photo's keypoints before it is read.
fn check_size(set: &Dataset) -> Result<Vec<u64>, String> {
    let shape = set.shape().map_err(said)?;
    let count = shape
        .iter()
        .try_fold(1_u64, |all, &side| all.checked_mul(side));
    match count {
        Some(count) if count <= 2 * MOST_KEYPOINTS as u64 => Ok(shape),
        _ => Err(format!(
            "at most {MOST_KEYPOINTS} keypoints in a photo expected, an array of {shape:?} found"
        )),
    }
}

fn positions(set: &Dataset) -> Result<Vec<[f32; 2]>, String> {
    let [_, 2] = check_size(set)?[..] else {
        return Err("positions expected, an array N × 2".to_owned());
    };
    let numbers: Vec<f32> = match set.element_size().map_err(said)? {
        // hloc stores halves, which the crate hands out as they are.
        2 => {
            let bytes = set.read_raw().map_err(said)?;
            let halves = bytes.chunks_exact(2);
            halves
                .map(|half| f16::from_le_bytes([half[0], half[1]]).to_f32())
                .collect()
        }
        _ => set.read_f32().map_err(said)?,
    };
    Ok(numbers
        .chunks_exact(2)
        .map(|pair| [pair[0], pair[1]])
        .collect())
}

fn partners_of(set: &Dataset) -> Result<Vec<Option<usize>>, String> {
    let [_] = check_size(set)?[..] else {
        return Err("one number for each keypoint expected".to_owned());
    };
    let numbers = set.read_i64().map_err(said)?;
    let partner = |number: i64| match number {
        -1 => Ok(None),
        _ => usize::try_from(number)
            .map(Some)
            .map_err(|_| format!("numbers of keypoints or -1 expected, {number} found")),
    };
    numbers.into_iter().map(partner).collect()
}
