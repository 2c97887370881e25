//! Features and matches of hloc (Sarlin et al., *From Coarse to Fine*, CVPR 2019): one file with `IMAGE/keypoints`
//! (N × 2, often in 16 bits), one with `IMAGE0/IMAGE1/matches0`, where names have `-` instead of `/`. Older files have
//! `IMAGE0_IMAGE1/matches0`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use half::f16;
use hdf5_pure::{
    DType, Dataset, Datatype, DatatypeByteOrder, File, FloatingPointLayout, FormatError, Group,
    ReadSeekSource, Source,
};

use posescope_core::files;
use posescope_core::scene::{stem, without_kind};

use super::{MAX_KEYPOINTS, Names, RawMatches};
use crate::scene::SceneError;
use crate::scene::frame_names::{agree, flat};
use crate::scene::lines::excerpt_of;

/// How deep groups are searched for images.
const DEEPEST: usize = 8;
/// The most images and pairs; limits the search in a damaged file.
const MAX_ENTRIES: usize = 1 << 20;

/// The least bytes of a link from a group to what it contains.
const LEAST_LINK: u64 = 8;

/// A file that is read no more than so many times over while it is searched. A large group may be linked by many names,
/// and each link reads it.
struct Metered {
    source: ReadSeekSource<std::fs::File>,
    /// How many more bytes may be read.
    left: Arc<AtomicU64>,
}

impl Metered {
    /// How often a file may be read over. Files of hloc are read up to five times.
    const TIMES: u64 = 32;
    /// Small files have more overhead \[bytes\].
    const AT_LEAST: u64 = 1 << 20;

    fn new(file: std::fs::File) -> Result<Self, FormatError> {
        let source = ReadSeekSource::new(file)?;
        let left = source.len().saturating_mul(Self::TIMES).max(Self::AT_LEAST);
        Ok(Self { source, left: Arc::new(AtomicU64::new(left)) })
    }
}

impl Source for Metered {
    fn len(&self) -> u64 {
        self.source.len()
    }

    fn read_at(&self, offset: u64, bytes: &mut [u8]) -> Result<(), FormatError> {
        let without = |left: u64| left.checked_sub(bytes.len() as u64);
        self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, without).map_err(|_| {
            FormatError::Source(format!(
                "the same groups are linked more than {} times",
                Self::TIMES
            ))
        })?;
        self.source.read_at(offset, bytes)
    }
}

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
            let source = files::open(path).map_err(SceneError::io(path))?;
            let source = Metered::new(source).map_err(|why| content(path, &why))?;
            let (size, left) = (source.len(), Arc::clone(&source.left));
            let file = File::from_source(source).map_err(|why| content(path, &why))?;
            let mut found = Found { links_left: size / LEAST_LINK, ..Found::default() };
            walk(&file.root(), &mut Vec::new(), &mut found).map_err(|why| content(path, &why))?;
            // Pairs are read as often as they are asked for.
            left.store(u64::MAX, Ordering::Relaxed);
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
            let found = found.and_then(|set| positions(&set, self.features.file_size()));
            found.map_err(|why| content(&self.features_path, &format!("{place}: {why}")))
        };
        let (first, second) = (keypoints(stored[0])?, keypoints(stored[1])?);
        let [one, other] = stored;
        let group = &self.pairs[&(one.clone(), other.clone())];
        let place = format!("{group}/matches0");
        let partners = self.matches.dataset(&place).map_err(text_of);
        let partners = partners
            .and_then(|set| partners_of(&set, self.matches.file_size()))
            .map_err(|why| content(&self.matches_path, &format!("{place}: {why}")))?;
        let found = RawMatches { first, second, partners };
        found.checked(&self.matches_path).map(Some)
    }
}

fn text_of(why: hdf5_pure::Error) -> String {
    // What a link by name has in place of the address of an object.
    let nowhere = u64::MAX.to_string();
    match why.to_string() {
        said if said.contains(&nowhere) => {
            "arrays and groups expected, a soft link found; store the array itself".to_owned()
        }
        said => said,
    }
}

/// IEEE 754 in 16 bits.
const HALF: FloatingPointLayout = FloatingPointLayout {
    bit_offset: 0,
    bit_precision: 16,
    exponent_location: 10,
    exponent_size: 5,
    mantissa_location: 0,
    mantissa_size: 10,
    exponent_bias: 15,
};

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
    /// How many more links the file has room for: groups that contain each other would be visited without end.
    links_left: u64,
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
    let named = |why: hdf5_pure::Error| {
        let place = if path.is_empty() { "/".to_owned() } else { path.join("/") };
        format!("{}: {}", excerpt_of(&place, 100), text_of(why))
    };
    let sets = group.datasets().map_err(named)?;
    // By name, each group would be searched for again.
    let groups = group.iter_groups().map_err(named)?;
    let links = (sets.len() + groups.len()) as u64;
    found.links_left = found.links_left.checked_sub(links).ok_or_else(|| {
        "groups that contain each other at most once expected, a group is reached on many ways"
            .to_owned()
    })?;
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
    for (name, inside) in groups {
        path.push(name);
        walk(&inside, path, found)?;
        path.pop();
    }
    Ok(())
}

/// Refuses arrays and parts of them that are larger than any photo's keypoints, or than the file \[bytes\], before
/// reading them.
fn check_size(set: &Dataset, file: u64) -> Result<Vec<u64>, String> {
    let shape = set.shape().map_err(text_of)?;
    let chunk = set.chunk_shape().map_err(text_of)?;
    for sides in chunk.iter().chain([&shape]) {
        let count = sides.iter().try_fold(1_u64, |all, &side| all.checked_mul(side));
        if count.is_none_or(|count| count > 2 * MAX_KEYPOINTS as u64) {
            return Err(format!(
                "at most {MAX_KEYPOINTS} keypoints in a photo expected, an array of {sides:?} found"
            ));
        }
    }
    let chunks = if chunk.is_some() { set.chunks().map_err(text_of)? } else { Vec::new() };
    let is_inside = |at: u64, size: u64| at.checked_add(size).is_some_and(|end| end <= file);
    match chunks.iter().find(|chunk| !is_inside(chunk.address, chunk.storage_size)) {
        Some(chunk) => Err(format!(
            "a part of {} bytes expected, but the file has only {file} bytes; it is cut off or damaged",
            chunk.storage_size
        )),
        None => Ok(shape),
    }
}

fn no_numbers(kind: &dyn std::fmt::Display) -> String {
    format!("positions as numbers expected, {} found", excerpt_of(&kind.to_string(), 40))
}

fn positions(set: &Dataset, file: u64) -> Result<Vec<[f32; 2]>, String> {
    let [_, 2] = check_size(set, file)?[..] else {
        return Err("positions expected, an array N × 2".to_owned());
    };
    let numbers: Vec<f32> = match (set.dtype().map_err(text_of)?, set.datatype().map_err(text_of)?)
    {
        // hloc stores half floats, which the crate cannot convert.
        (_, Datatype::FloatingPoint { size: 2, byte_order, layout }) if layout == HALF => {
            let bytes = set.read_raw().map_err(text_of)?;
            let (halves, _) = bytes.as_chunks();
            let number = match byte_order {
                DatatypeByteOrder::LittleEndian => f16::from_le_bytes,
                DatatypeByteOrder::BigEndian => f16::from_be_bytes,
                DatatypeByteOrder::Vax => return Err(no_numbers(&"VAX half floats")),
            };
            halves.iter().map(|half| number(*half).to_f32()).collect()
        }
        (DType::F32 | DType::F64, _) => set.read_f32().map_err(text_of)?,
        (DType::I8 | DType::I16 | DType::I32 | DType::I64, _) => {
            let numbers = set.read_i64().map_err(text_of)?;
            numbers.into_iter().map(|number| number as f32).collect()
        }
        (DType::U8 | DType::U16 | DType::U32 | DType::U64, _) => {
            let numbers = set.read_u64().map_err(text_of)?;
            numbers.into_iter().map(|number| number as f32).collect()
        }
        (other, _) => return Err(no_numbers(&other)),
    };
    Ok(numbers.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect())
}

fn partners_of(set: &Dataset, file: u64) -> Result<Vec<Option<usize>>, String> {
    let [_] = check_size(set, file)?[..] else {
        return Err("one number for each keypoint expected".to_owned());
    };
    let kind = set.dtype().map_err(text_of)?;
    let is_whole = matches!(
        kind,
        DType::I8
            | DType::I16
            | DType::I32
            | DType::I64
            | DType::U8
            | DType::U16
            | DType::U32
            | DType::U64
    );
    if !is_whole {
        return Err(format!("whole numbers expected, {} found", excerpt_of(&kind.to_string(), 40)));
    }
    let numbers = set.read_i64().map_err(text_of)?;
    let partner = |number: i64| match number {
        -1 => Ok(None),
        _ => usize::try_from(number)
            .map(Some)
            .map_err(|_| format!("numbers of keypoints or -1 expected, {number} found")),
    };
    numbers.into_iter().map(partner).collect()
}
