//! The matches of another system, in a folder: hloc's files, or one file per pair.
//!
//! | files | content |
//! |---|---|
//! | `QUERY_REFERENCE_matches.txt` | a match per line, `x y x y`: in the query and in the reference \[px\] |
//! | `QUERY_REFERENCE_matches.npz` | `keypoints0`, `keypoints1`, and `matches` or `matches0`, as of SuperGlue and LightGlue |
//! | `*.h5` | features and matches as hloc writes them |
//!
//! Keypoints are in the pixels of the image files, also where posescope undistorts photos. The centre of the top-left
//! pixel is at (0, 0) in all of them. The reference may also come first.

mod hloc;
mod npz;
mod text;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Point2;
use posescope_core::features::{FoundMatches, PairMatches};
use posescope_core::foreign::MatchSource;
use posescope_core::scene::stem;

use self::hloc::HlocFiles;
use super::folder::entries;
use super::frame_names::{ends_of, flat};
use super::{PixelMap, Scene, SceneError};

pub use self::text::write_matches;

/// The most keypoints of a photo, more than any photo of 8,000 × 8,000 pixels has.
const MAX_KEYPOINTS: usize = 1 << 20;

/// The farthest keypoint from the first pixel \[px\].
const FARTHEST_PX: f32 = 1e6;

/// Which photo of a pair comes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    QueryFirst,
    ReferenceFirst,
}

/// The keypoints of two photos \[px\], and the partner of each keypoint of the first.
#[derive(Debug)]
struct RawMatches {
    first: Vec<[f32; 2]>,
    second: Vec<[f32; 2]>,
    partners: Vec<Option<usize>>,
}

impl RawMatches {
    /// Checks counts, partners and positions; the error names the file.
    fn checked(self, path: &Path) -> Result<Self, SceneError> {
        let error = |expected: String| SceneError::expected(path, expected);
        if self.partners.len() != self.first.len() {
            return Err(error(format!(
                "one entry per keypoint ({}) expected, {} found",
                self.first.len(),
                self.partners.len()
            )));
        }
        let most = self.first.len().max(self.second.len());
        if most > MAX_KEYPOINTS {
            return Err(error(format!(
                "at most {MAX_KEYPOINTS} keypoints in a photo expected, {most} found"
            )));
        }
        let mut named = self.partners.iter().flatten();
        if let Some(beyond) = named.find(|&&partner| partner >= self.second.len()) {
            return Err(error(format!(
                "the number of a keypoint below {} expected, {beyond} found",
                self.second.len()
            )));
        }
        let mut places = self.first.iter().chain(&self.second).flatten();
        if let Some(place) = places.find(|place| !(-FARTHEST_PX..=FARTHEST_PX).contains(*place)) {
            return Err(error(format!(
                "positions of keypoints within {FARTHEST_PX:e} px of 0 expected, {place} found; numpy writes large \
                 numbers where an array is masked"
            )));
        }
        Ok(self)
    }

    /// The keypoints in undistorted photos. Those that no pinhole camera sees are dropped.
    fn undistorted(self, first: Option<&dyn PixelMap>, second: Option<&dyn PixelMap>) -> Self {
        if first.is_none() && second.is_none() {
            return self;
        }
        let moved = |at: &[f32; 2], map: Option<&dyn PixelMap>| {
            let Some(map) = map else { return Some(*at) };
            let pixel = map.to_photo(Point2::from(*at).cast())?.cast::<f32>();
            (pixel.x.is_finite() && pixel.y.is_finite()).then_some([pixel.x, pixel.y])
        };
        let mut seconds = Vec::with_capacity(self.second.len());
        let places: Vec<Option<usize>> = self
            .second
            .iter()
            .map(|at| {
                seconds.push(moved(at, second)?);
                Some(seconds.len() - 1)
            })
            .collect();
        let kept = self.first.iter().zip(&self.partners);
        let kept = kept.filter_map(|(at, &partner)| {
            Some((moved(at, first)?, partner.and_then(|partner| places[partner])))
        });
        let (first, partners) = kept.unzip();
        Self { first, second: seconds, partners }
    }

    /// The matches from the query to the reference.
    fn of_query(self, order: Order) -> FoundMatches {
        let Self { first, second, partners } = self;
        match order {
            Order::QueryFirst => FoundMatches::new(&first, &second, &partners),
            Order::ReferenceFirst => {
                let mut turned = vec![None; second.len()];
                for (index, &partner) in partners.iter().enumerate() {
                    if let Some(partner) = partner {
                        turned[partner] = turned[partner].or(Some(index));
                    }
                }
                FoundMatches::new(&second, &first, &turned)
            }
        }
    }
}

/// A folder with the matches of pairs of frames.
pub struct MatchFolder {
    folder: PathBuf,
    hloc: Option<HlocFiles>,
    /// Names of files that several frames have, of the queries' scene and of the references'.
    shared: [BTreeSet<String>; 2],
    /// What other programs call the frames of both.
    others: [BTreeMap<String, String>; 2],
    /// Where the pixels of both are in their files.
    maps: [PixelMaps; 2],
}

/// Where pixels of undistorted photos are in their files, by the name of the frame.
#[derive(Default)]
pub struct PixelMaps(BTreeMap<String, Arc<dyn PixelMap>>);

impl PixelMaps {
    /// Those of the frames of a scene whose photos are undistorted.
    #[must_use]
    pub fn of(scene: &dyn Scene) -> Self {
        let named = scene.frames().iter().enumerate();
        Self(named.filter_map(|(at, frame)| Some((frame.clone(), scene.pixel_map(at)?))).collect())
    }

    fn get(&self, frame: &str) -> Option<&dyn PixelMap> {
        self.0.get(frame).map(|map| &**map)
    }
}

/// What a frame may be called in the files.
struct Names<'a> {
    frame: &'a str,
    /// Whether no other frame's photo has a file of this name.
    is_file_unique: bool,
    /// Another name of the frame.
    other: Option<&'a str>,
    /// Where pixels of its photo are in the file.
    map: Option<&'a dyn PixelMap>,
}

impl MatchFolder {
    /// Lists the folder; matches are read on demand.
    ///
    /// # Errors
    /// A folder that cannot be read or contains no matches.
    pub fn open(folder: &Path) -> Result<Self, SceneError> {
        let files = entries(folder)?;
        let has_ending =
            |path: &&PathBuf, ending: &str| path.extension().is_some_and(|e| e == ending);
        let h5: Vec<&PathBuf> = files.iter().filter(|path| has_ending(path, "h5")).collect();
        let is_pair = |path: &PathBuf| {
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            name.ends_with(PAIR_ENDING)
        };
        if h5.is_empty() && !files.iter().any(is_pair) {
            return Err(SceneError::expected(
                folder,
                format!(
                    "hloc's features and matches (.h5) or files such as \
                     QUERY_REFERENCE{PAIR_ENDING}.txt or .npz expected, none found"
                ),
            ));
        }
        let hloc = match h5.as_slice() {
            [] => None,
            files => Some(HlocFiles::open(folder, files)?),
        };
        Ok(Self {
            folder: folder.to_owned(),
            hloc,
            shared: Default::default(),
            others: Default::default(),
            maps: Default::default(),
        })
    }

    /// The matches of frames of these scenes.
    #[must_use]
    pub fn between(self, queries: &dyn Scene, references: &dyn Scene) -> Self {
        let shared = [queries, references].map(|scene| {
            let mut seen = BTreeSet::new();
            let stems = scene.frames().iter().map(|frame| stem(frame));
            stems.filter(|stem| !seen.insert(*stem)).map(str::to_owned).collect()
        });
        let others = [queries, references].map(|scene| {
            let named = scene.frames().iter().enumerate();
            let other = |(at, frame): (usize, &String)| {
                Some((frame.clone(), scene.other_name(at)?.to_owned()))
            };
            named.filter_map(other).collect()
        });
        let maps = [queries, references].map(PixelMaps::of);
        Self { shared, others, maps, ..self }
    }

    /// The names of a frame of the queries' scene (0) or of the references' (1).
    fn names<'a>(&'a self, scene: usize, frame: &'a str) -> Names<'a> {
        Names {
            frame,
            is_file_unique: !self.shared[scene].contains(stem(frame)),
            other: self.others[scene].get(frame).map(String::as_str),
            map: self.maps[scene].get(frame),
        }
    }
}

impl MatchSource for MatchFolder {
    fn matches(&self, query: &str, reference: &str) -> Result<Option<PairMatches>, SceneError> {
        let (query, reference) = (self.names(0, query), self.names(1, reference));
        let orders =
            [(Order::QueryFirst, &query, &reference), (Order::ReferenceFirst, &reference, &query)];
        for (order, first, second) in orders {
            let found = match self.file(first, second) {
                Some(file) if file.extension().is_some_and(|ending| ending == "txt") => {
                    Some(text::read(&file)?.checked(&file)?)
                }
                Some(file) => Some(npz::read(&file)?.checked(&file)?),
                None => {
                    let found = self.hloc.as_ref().map(|hloc| hloc.read(first, second));
                    found.transpose()?.flatten()
                }
            };
            if let Some(found) = found {
                let found = found.undistorted(first.map, second.map);
                return Ok(Some(PairMatches::Found(found.of_query(order))));
            }
        }
        Ok(None)
    }
}

impl MatchFolder {
    /// The file of a pair: by the paths of its frames, or by the names of their files where these are unique.
    fn file(&self, first: &Names<'_>, second: &Names<'_>) -> Option<PathBuf> {
        let file = |first: &str, second: &str| {
            let files = ["txt", "npz"].map(|ending| format!("{}.{ending}", pair(first, second)));
            files.into_iter().map(|file| self.folder.join(file)).find(|file| file.is_file())
        };
        let by_file = || file(stem(first.frame), stem(second.frame));
        let is_unique = first.is_file_unique && second.is_file_unique;
        let others = [first, second].map(|names| names.other.map(ends_of));
        let by_other = || match others {
            [Some(first), Some(second)] => first.zip(second).find_map(|(first, second)| {
                let kinds = [format!("{first}.color"), format!("{second}.color")];
                file(&kinds[0], &kinds[1]).or_else(|| file(first, second))
            }),
            _ => None,
        };
        let found = file(first.frame, second.frame).or_else(by_other);
        found.or_else(|| is_unique.then(by_file).flatten())
    }
}

/// The end of the name of a pair's file.
const PAIR_ENDING: &str = "_matches";

/// The name of a pair's file without extension. Folders in frame names are kept with `-`, as in hloc.
fn pair(first: &str, second: &str) -> String {
    format!("{}_{}{PAIR_ENDING}", flat(first), flat(second))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raw() -> RawMatches {
        RawMatches {
            first: vec![[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]],
            second: vec![[4.0, 4.0], [5.0, 5.0]],
            partners: vec![Some(1), None, Some(0)],
        }
    }

    #[test]
    fn a_pair_stored_the_other_way_round_is_the_same_pair() {
        let pairs = |found: &FoundMatches| -> Vec<([f32; 2], [f32; 2])> {
            let at = |features: &posescope_core::features::Features, index: usize| {
                let keypoint = features.keypoints[index];
                [keypoint.x, keypoint.y]
            };
            let decisions = found.decisions.iter().flatten();
            let mut pairs: Vec<_> = decisions
                .map(|d| (at(&found.query, d.query), at(&found.reference, d.reference)))
                .collect();
            pairs.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
            pairs
        };
        let direct = pairs(&raw().of_query(Order::QueryFirst));
        assert_eq!(direct, [([1.0; 2], [5.0; 2]), ([3.0; 2], [4.0; 2])]);
        let turned = pairs(&raw().of_query(Order::ReferenceFirst));
        assert_eq!(turned, [([4.0; 2], [3.0; 2]), ([5.0; 2], [1.0; 2])]);
    }

    #[test]
    fn partners_that_are_not_there_are_refused() {
        let path = Path::new("a.npz");
        assert!(raw().checked(path).is_ok());
        let beyond = RawMatches { partners: vec![Some(2), None, None], ..raw() };
        let short = RawMatches { partners: vec![None], ..raw() };
        let infinite = RawMatches { second: vec![[f32::INFINITY, 0.0]; 2], ..raw() };
        for wrong in [beyond, short, infinite] {
            assert!(wrong.checked(path).is_err());
        }
    }
}
