//! Models as binary files: `cameras.bin`, `images.bin`, `points3D.bin`, little-endian.
//!
//! Every count is checked against the rest of the file before anything is allocated.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};

use posescope_core::files;

use super::super::{SceneError, lines};
use super::camera::{ModelCamera, model_of_number};
use super::model::{Model, ModelImage, Points};

/// The longest name of an image \[bytes\], the limit of a path on most systems.
const LONGEST_NAME: u64 = 4096;
/// The id of a feature without a point.
const NO_POINT: u64 = u64::MAX;

pub(super) fn read(folder: &Path) -> Result<Model, SceneError> {
    let cameras = cameras(&folder.join("cameras.bin"))?;
    let points = points(&folder.join("points3D.bin"))?;
    let images = images(&folder.join("images.bin"), &points)?;
    Ok(Model { cameras, images, points: points.positions })
}

fn cameras(path: &Path) -> Result<BTreeMap<u32, Result<ModelCamera, SceneError>>, SceneError> {
    let mut file = BinaryFile::open(path)?;
    let mut cameras = BTreeMap::new();
    for _ in 0..file.count("cameras", 40)? {
        let id = u32::from_le_bytes(file.take()?);
        let number = u32::from_le_bytes(file.take()?);
        let size = (file.u64()?, file.u64()?);
        let (model, count) = model_of_number(number).map_err(|why| file.error(why))?;
        let parameters: Vec<f64> = (0..count).map(|_| file.f64()).collect::<Result<_, _>>()?;
        let camera = ModelCamera::new(model, size, &parameters).map_err(|why| file.error(why));
        cameras.insert(id, camera);
    }
    Ok(cameras)
}

/// Reads the points. A model without points has no such file.
fn points(path: &Path) -> Result<Points, SceneError> {
    let mut points = Points::default();
    if !path.is_file() {
        return Ok(points);
    }
    let mut file = BinaryFile::open(path)?;
    for _ in 0..file.count("points", 51)? {
        let id = file.u64()?;
        let position = [file.finite()?, file.finite()?, file.finite()?];
        // Colour and error.
        file.skip(3 + 8)?;
        let track = file.count("observations", 8)?;
        file.skip(8 * track)?;
        points.add(id, position);
    }
    Ok(points)
}

fn images(path: &Path, points: &Points) -> Result<Vec<ModelImage>, SceneError> {
    let mut file = BinaryFile::open(path)?;
    let mut images = Vec::new();
    for _ in 0..file.count("images", 73)? {
        let _id = u32::from_le_bytes(file.take()?);
        let [qw, qx, qy, qz] = [file.f64()?, file.f64()?, file.f64()?, file.f64()?];
        let position = [file.f64()?, file.f64()?, file.f64()?];
        let camera_from_world =
            lines::pose(position, [qx, qy, qz, qw]).map_err(|why| file.error(why))?;
        let camera = u32::from_le_bytes(file.take()?);
        let name = file.name()?;
        let mut observed = Vec::new();
        for _ in 0..file.count("features", 24)? {
            file.skip(16)?;
            let id = file.u64()?;
            if id == NO_POINT {
                continue;
            }
            observed.push(points.find(id).map_err(|why| file.error(why))?);
        }
        images.push(ModelImage { name, camera, camera_from_world, observed });
    }
    if images.is_empty() {
        return Err(file.error("images expected, none found"));
    }
    Ok(images)
}

/// How many images a file promises.
pub(super) fn count_images(path: &Path) -> Result<u64, SceneError> {
    BinaryFile::open(path)?.count("images", 73)
}

/// A binary file that is read from start to end, and knows how much is left.
struct BinaryFile {
    path: PathBuf,
    reader: BufReader<File>,
    size: u64,
    left: u64,
}

impl BinaryFile {
    fn open(path: &Path) -> Result<Self, SceneError> {
        let io = SceneError::io(path);
        let file = files::open(path).map_err(io)?;
        let size = file.metadata().map_err(io)?.len();
        Ok(Self { path: path.to_owned(), reader: BufReader::new(file), size, left: size })
    }

    /// An error at the current position.
    fn error(&self, expected: impl Into<String>) -> SceneError {
        SceneError::expected(
            &self.path,
            format!("byte {}: {}", self.size - self.left, expected.into()),
        )
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], SceneError> {
        let mut bytes = [0; N];
        let left = self.left.checked_sub(N as u64);
        match (left, self.reader.read_exact(&mut bytes)) {
            (Some(left), Ok(())) => {
                self.left = left;
                Ok(bytes)
            }
            _ => Err(self.error(format!("{N} more bytes expected, the file is cut off"))),
        }
    }

    fn u64(&mut self) -> Result<u64, SceneError> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, SceneError> {
        self.take().map(f64::from_le_bytes)
    }

    fn finite(&mut self) -> Result<f64, SceneError> {
        let number = self.f64()?;
        if !lines::is_near(&number) {
            return Err(self.error(format!("finite coordinates expected, {number} found")));
        }
        Ok(number)
    }

    /// Reads the number of the following records, each of at least this many bytes.
    fn count(&mut self, what: &str, least_bytes: u64) -> Result<u64, SceneError> {
        let count = self.u64()?;
        if count > self.left / least_bytes {
            return Err(self.error(format!(
                "{count} {what} expected, but only {} bytes are left; the file is cut off",
                self.left
            )));
        }
        Ok(count)
    }

    fn skip(&mut self, bytes: u64) -> Result<(), SceneError> {
        let error = |file: &Self| file.error("more bytes expected, the file is cut off");
        let left = self.left.checked_sub(bytes).ok_or_else(|| error(self))?;
        let offset = i64::try_from(bytes).map_err(|_| error(self))?;
        self.reader.seek_relative(offset).map_err(SceneError::io(&self.path))?;
        self.left = left;
        Ok(())
    }

    /// Reads a text up to a zero byte. Control characters are refused, since it is printed in messages and tables.
    fn name(&mut self) -> Result<String, SceneError> {
        let mut bytes = Vec::new();
        let limited = &mut (&mut self.reader).take(LONGEST_NAME);
        let read = limited.read_until(0, &mut bytes);
        let is_ended = read.is_ok() && bytes.pop() == Some(0);
        let name = String::from_utf8(bytes).ok().filter(|name| {
            is_ended && self.left > name.len() as u64 && !name.contains(char::is_control)
        });
        let name = name.ok_or_else(|| {
            self.error(format!(
                "the name of an image expected: at most {LONGEST_NAME} bytes without control \
                 characters, then a zero byte"
            ))
        })?;
        self.left -= name.len() as u64 + 1;
        Ok(name)
    }
}
