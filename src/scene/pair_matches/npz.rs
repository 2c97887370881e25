//! Matches as `.npz`: `keypoints0` and `keypoints1` (N × 2), and the matches as `matches` or `matches0`. They are the
//! partner of each keypoint of the first or −1 (SuperGlue), or pairs of keypoints, K × 2 (LightGlue). Arrays may have a
//! batch axis of length 1 in front.

use std::io::Read as _;
use std::path::Path;

use half::f16;
use posescope_core::files;
use zip::ZipArchive;

use super::{MAX_KEYPOINTS, RawMatches};
use crate::scene::SceneError;
use crate::scene::lines::excerpt;

/// The largest array \[bytes\]: two numbers of eight bytes for the most keypoints.
const MAX_BYTES: u64 = 16 * MAX_KEYPOINTS as u64 + 4096;

pub(super) fn read(path: &Path) -> Result<RawMatches, SceneError> {
    let error = |expected: String| SceneError::expected(path, expected.replace('\n', " "));
    let file = files::open(path).map_err(SceneError::io(path))?;
    let mut archive =
        ZipArchive::new(file).map_err(|why| error(format!("an .npz archive expected: {why}")))?;
    let names: Vec<String> = archive.file_names().flatten().map(|name| name.into_owned()).collect();
    let mut array = |name: &str| -> Result<Option<Array>, SceneError> {
        let file = format!("{name}.npy");
        if !names.contains(&file) {
            return Ok(None);
        }
        let named = |why: String| error(format!("{name}: {why}"));
        let entry = archive.by_name(&file).map_err(|why| named(why.to_string()))?;
        // The announced size may be wrong, so reading is limited.
        let mut bytes = Vec::new();
        let read = entry.take(MAX_BYTES + 1).read_to_end(&mut bytes);
        read.map_err(|why| named(why.to_string()))?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(named(format!("an array of at most {MAX_BYTES} bytes expected")));
        }
        Array::parse(&bytes).map(Some).map_err(named)
    };
    let missing = |expected: &str| {
        let names: Vec<String> =
            names.iter().take(8).map(|name| excerpt(name.trim_end_matches(".npy"))).collect();
        error(format!("{expected} expected, {} found", names.join(", ")))
    };
    let mut points = |name: &str| -> Result<(Vec<[f32; 2]>, bool), SceneError> {
        let array = array(name)?.ok_or_else(|| missing("the arrays keypoints0 and keypoints1"))?;
        let points = array.points().map_err(|why| error(format!("{name}: {why}")))?;
        Ok((points, array.shape.len() == 3))
    };
    let ((first, is_batch), (second, _)) = (points("keypoints0")?, points("keypoints1")?);
    let mut read = |name: &str| -> Result<Option<Vec<Option<usize>>>, SceneError> {
        let partners = array(name)?.map(|array| {
            if name == "matches" && array.are_pairs(is_batch) {
                array.pairs(first.len())
            } else {
                array.partners()
            }
        });
        partners.transpose().map_err(|why| error(format!("{name}: {why}")))
    };
    let partners = match (read("matches")?, read("matches0")?) {
        (Some(one), Some(other)) if one != other => {
            return Err(error("matches and matches0 with the same matches expected".to_owned()));
        }
        (Some(partners), _) | (None, Some(partners)) => partners,
        (None, None) => return Err(missing("an array matches or matches0")),
    };
    Ok(RawMatches { first, second, partners })
}

struct Array {
    shape: Vec<u64>,
    numbers: Vec<f64>,
}

impl Array {
    /// Reads a `.npy` file: a magic number, a version, the length of a header, the header as a Python dictionary, the
    /// numbers. The existing crates contain a grammar of Python literals, which takes longer to build than all other
    /// formats of matches together.
    fn parse(bytes: &[u8]) -> Result<Self, String> {
        let header = Header::read(bytes).ok_or("an array of numpy (.npy) expected")?;
        let Header { shape, kind, is_column_major, data } = header;
        let count = shape.iter().try_fold(1_u64, |all, &side| all.checked_mul(side));
        let numbers = match kind {
            "<f2" => numbers(data, |bytes| f16::from_le_bytes(bytes).into()),
            "<f4" => numbers(data, |bytes| f32::from_le_bytes(bytes).into()),
            "<f8" => numbers(data, f64::from_le_bytes),
            "<i8" => numbers(data, |bytes| i64::from_le_bytes(bytes) as f64),
            "<i4" => numbers(data, |bytes| i32::from_le_bytes(bytes).into()),
            "<i2" => numbers(data, |bytes| i16::from_le_bytes(bytes).into()),
            "<u8" => numbers(data, |bytes| u64::from_le_bytes(bytes) as f64),
            "<u4" => numbers(data, |bytes| u32::from_le_bytes(bytes).into()),
            "<u2" => numbers(data, |bytes| u16::from_le_bytes(bytes).into()),
            _ => {
                let kind = excerpt(kind);
                return Err(format!(
                    "numbers <f2 … <f8, <i2 … <i8 or <u2 … <u8 expected, `{kind}` found"
                ));
            }
        };
        if count != Some(numbers.len() as u64) {
            return Err(format!(
                "an array of shape {shape:?} expected, the file is shorter or longer"
            ));
        }
        // A transposed array is stored column by column.
        let numbers = if is_column_major { row_major(&shape, &numbers) } else { numbers };
        Ok(Self { shape, numbers })
    }

    /// The shape without a batch axis.
    fn bare_shape(&self) -> &[u64] {
        match self.shape.as_slice() {
            [1, rest @ ..] if !rest.is_empty() => rest,
            shape => shape,
        }
    }

    fn points(&self) -> Result<Vec<[f32; 2]>, String> {
        let ([_, 2] | [1, _, 2]) = self.shape[..] else {
            return Err("positions expected, an array N × 2".to_owned());
        };
        let (pairs, _) = self.numbers.as_chunks();
        Ok(pairs.iter().map(|[x, y]| [*x as f32, *y as f32]).collect())
    }

    /// Whether matches are pairs of keypoints. An array of the shape 1 × 2 is one pair, or with a batch axis the
    /// partners of two keypoints.
    fn are_pairs(&self, is_batch: bool) -> bool {
        match self.shape[..] {
            [1, 2] => !is_batch,
            [_, 2] | [1, _, 2] => true,
            _ => false,
        }
    }

    fn partners(&self) -> Result<Vec<Option<usize>>, String> {
        let partner = |&number: &f64| match number {
            -1.0 => Some(None),
            number => whole(number).map(Some),
        };
        let partners = match self.bare_shape() {
            [_] => self.numbers.iter().map(partner).collect(),
            _ => None,
        };
        partners.ok_or_else(|| {
            let shape = &self.shape;
            format!("whole numbers expected, one for each keypoint, or pairs K × 2; shape {shape:?} found")
        })
    }

    /// The partners of so many keypoints, from pairs.
    fn pairs(&self, keypoints: usize) -> Result<Vec<Option<usize>>, String> {
        let mut partners = vec![None; keypoints];
        let (pairs, _) = self.numbers.as_chunks();
        for [first, second] in pairs {
            let (Some(keypoint), Some(partner)) = (whole(*first), whole(*second)) else {
                return Err(format!("pairs of whole numbers expected, {first} and {second} found"));
            };
            let place = partners.get_mut(keypoint).ok_or_else(|| {
                format!("the number of a keypoint below {keypoints} expected, {keypoint} found")
            })?;
            if place.replace(partner).is_some() {
                return Err(format!(
                    "one partner per keypoint expected, keypoint {keypoint} has two"
                ));
            }
        }
        Ok(partners)
    }
}

fn whole(number: f64) -> Option<usize> {
    (number >= 0.0 && number.fract() == 0.0).then_some(number as usize)
}

/// The numbers of an array row by row, from those column by column.
fn row_major(shape: &[u64], numbers: &[f64]) -> Vec<f64> {
    let sides: Vec<usize> = shape.iter().map(|&side| side as usize).collect();
    let place = |mut index: usize| {
        // The last axis of the index changes fastest, and has the largest step here.
        let mut step = numbers.len();
        let mut place = 0;
        for &side in sides.iter().rev() {
            step /= side;
            place += index % side * step;
            index /= side;
        }
        place
    };
    (0..numbers.len()).map(|index| numbers[place(index)]).collect()
}

fn numbers<const N: usize>(data: &[u8], read: fn([u8; N]) -> f64) -> Vec<f64> {
    let (numbers, _) = data.as_chunks();
    numbers.iter().map(|bytes| read(*bytes)).collect()
}

/// The header of an array, and the bytes after it.
struct Header<'a> {
    shape: Vec<u64>,
    kind: &'a str,
    is_column_major: bool,
    data: &'a [u8],
}

impl<'a> Header<'a> {
    fn read(bytes: &'a [u8]) -> Option<Self> {
        let rest = bytes.strip_prefix(b"\x93NUMPY")?;
        let (&[major, _minor], rest) = rest.split_first_chunk()?;
        let (length, rest) = match major {
            1 => {
                let (length, rest) = rest.split_first_chunk()?;
                (usize::from(u16::from_le_bytes(*length)), rest)
            }
            2 | 3 => {
                let (length, rest) = rest.split_first_chunk()?;
                (usize::try_from(u32::from_le_bytes(*length)).ok()?, rest)
            }
            _ => return None,
        };
        let (text, data) = rest.split_at_checked(length)?;
        let text = std::str::from_utf8(text).ok()?;
        let value = |key: &str| {
            let (_, after) = text.split_once(&format!("'{key}':"))?;
            Some(after.trim_start())
        };
        let order = value("fortran_order")?;
        let is_column_major = order.starts_with("True");
        (is_column_major || order.starts_with("False")).then_some(())?;
        let (kind, _) = value("descr")?.strip_prefix('\'')?.split_once('\'')?;
        let (sides, _) = value("shape")?.strip_prefix('(')?.split_once(')')?;
        let sides = sides.split(',').map(str::trim).filter(|side| !side.is_empty());
        let shape = sides.map(|side| side.parse().ok()).collect::<Option<_>>()?;
        Some(Self { shape, kind, is_column_major, data })
    }
}
