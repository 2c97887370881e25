//! Matches as `.npz`: `keypoints0` and `keypoints1` (N × 2), and `matches`, the partner of each keypoint of the first
//! or −1.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use zip::ZipArchive;

use super::{MAX_KEYPOINTS, RawMatches};
use crate::scene::SceneError;
use crate::scene::lines::excerpt;

/// The largest array \[bytes\]: two numbers of eight bytes for the most keypoints.
const MAX_BYTES: u64 = 16 * MAX_KEYPOINTS as u64 + 4096;

pub(super) fn read(path: &Path) -> Result<RawMatches, SceneError> {
    let error = |expected: String| SceneError::expected(path, expected.replace('\n', " "));
    let file = File::open(path).map_err(SceneError::io(path))?;
    let mut archive =
        ZipArchive::new(file).map_err(|why| error(format!("an .npz archive expected: {why}")))?;
    let mut array = |name: &str| -> Result<Array, String> {
        let entry = archive.by_name(&format!("{name}.npy"));
        let entry = entry.map_err(|why| why.to_string())?;
        // The announced size may be wrong, so reading is limited.
        let mut bytes = Vec::new();
        let read = entry.take(MAX_BYTES + 1).read_to_end(&mut bytes);
        read.map_err(|why| why.to_string())?;
        if bytes.len() as u64 > MAX_BYTES {
            return Err(format!("an array of at most {MAX_BYTES} bytes expected"));
        }
        Array::parse(&bytes)
    };
    let named = |name: &'static str| move |why: String| error(format!("{name}: {why}"));
    let mut points = |name| array(name).and_then(|array| array.points()).map_err(named(name));
    let (first, second) = (points("keypoints0")?, points("keypoints1")?);
    let partners = array("matches").and_then(|array| array.partners());
    Ok(RawMatches { first, second, partners: partners.map_err(named("matches"))? })
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
        let Header { shape, kind, data } = header;
        let count = shape.iter().try_fold(1_u64, |all, &side| all.checked_mul(side));
        let numbers = match kind {
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
                    "numbers <f4, <f8, <i2 … <i8 or <u2 … <u8 expected, `{kind}` found"
                ));
            }
        };
        if count != Some(numbers.len() as u64) {
            return Err(format!(
                "an array of shape {shape:?} expected, the file is shorter or longer"
            ));
        }
        Ok(Self { shape, numbers })
    }

    fn points(&self) -> Result<Vec<[f32; 2]>, String> {
        let [_, 2] = self.shape[..] else {
            return Err("positions expected, an array N × 2".to_owned());
        };
        let (pairs, _) = self.numbers.as_chunks();
        Ok(pairs.iter().map(|[x, y]| [*x as f32, *y as f32]).collect())
    }

    fn partners(&self) -> Result<Vec<Option<usize>>, String> {
        let partner = |&number: &f64| match number {
            -1.0 => Some(None),
            _ if number >= 0.0 && number.fract() == 0.0 => Some(Some(number as usize)),
            _ => None,
        };
        let partners = match self.shape[..] {
            [_] => self.numbers.iter().map(partner).collect(),
            _ => None,
        };
        partners.ok_or_else(|| "whole numbers expected, one for each keypoint".to_owned())
    }
}

fn numbers<const N: usize>(data: &[u8], read: fn([u8; N]) -> f64) -> Vec<f64> {
    let (numbers, _) = data.as_chunks();
    numbers.iter().map(|bytes| read(*bytes)).collect()
}

/// The header of an array, and the bytes after it.
struct Header<'a> {
    shape: Vec<u64>,
    kind: &'a str,
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
        // Row-major order is numpy's default.
        value("fortran_order")?.starts_with("False").then_some(())?;
        let (kind, _) = value("descr")?.strip_prefix('\'')?.split_once('\'')?;
        let (sides, _) = value("shape")?.strip_prefix('(')?.split_once(')')?;
        let sides = sides.split(',').map(str::trim).filter(|side| !side.is_empty());
        let shape = sides.map(|side| side.parse().ok()).collect::<Option<_>>()?;
        Some(Self { shape, kind, data })
    }
}
