//! Arrays of numpy as photos, clouds, poses and points, and back.

use nalgebra::{Matrix3x4, Point3};
use posescope_core::geometry::pose_from_matrix;
use posescope_core::image::{GrayImage, RgbImage};
use posescope_core::{Cloud, Photo, Pose};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes, PyDict, PyString};

use crate::errors;

/// The most elements of a photo or a cloud. A larger array is a mistake, such as one that repeats an element.
const MAX_ELEMENTS: usize = 1 << 30;

/// An array of numpy: its elements are read through numpy itself, in any order in memory.
struct Array<'py> {
    /// What the caller calls it.
    name: &'py str,
    array: Bound<'py, PyAny>,
    shape: Vec<usize>,
    /// The kind of its elements, such as `f`, and their size in bytes.
    element: (char, usize),
}

impl<'py> Array<'py> {
    /// Anything as an array, without a copy where it is one.
    fn of(name: &'py str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        let numpy = value.py().import("numpy")?;
        let array = numpy.call_method1("asarray", (value,)).map_err(|error| {
            let given = value.get_type();
            errors::value(format!("{name}: an array expected, {given} given ({error})"))
        })?;
        let dtype = array.getattr("dtype")?;
        let element = (dtype.getattr("kind")?.extract()?, dtype.getattr("itemsize")?.extract()?);
        Ok(Self { name, shape: array.getattr("shape")?.extract()?, element, array })
    }

    /// What is wrong with it: its name, what was expected, and its dtype and shape.
    fn wrong(&self, expected: &str) -> PyErr {
        errors::value(self.wrong_words(expected))
    }

    fn wrong_words(&self, expected: &str) -> String {
        let sides: Vec<String> = self.shape.iter().map(ToString::to_string).collect();
        let dtype = self.array.getattr("dtype").map_or("?".to_owned(), |dtype| dtype.to_string());
        let (name, shape) = (self.name, sides.join(", "));
        format!("{name}: {expected} expected, {dtype} of shape ({shape}) given")
    }

    /// What is wrong with a photo, and what makes one of it where that is known.
    fn wrong_photo(&self) -> PyErr {
        let words = self.wrong_words(PHOTO);
        let remedy = match (self.element, &*self.shape) {
            (('f', _), _) => {
                "; if its values are from 0 to 1: (255 * photo).round().astype(numpy.uint8)"
            }
            (('u', 1), [_, _, 4]) => "; without its transparency: photo[..., :3]",
            (('u', 1), [_, _, 1]) => "; photo[..., 0]",
            _ => "",
        };
        errors::value(words + remedy)
    }

    fn is_small(&self) -> bool {
        let mut sides = self.shape.iter();
        let elements = sides.try_fold(1, |product: usize, side| product.checked_mul(*side));
        elements.is_some_and(|elements| elements <= MAX_ELEMENTS)
    }

    fn has_numbers(&self) -> bool {
        matches!(self.element.0, 'f' | 'i' | 'u')
    }

    /// Its bytes row by row, as elements of this dtype.
    fn bytes(&self, dtype: &str) -> PyResult<Bound<'py, PyBytes>> {
        let numpy = self.array.py().import("numpy")?;
        let converted = numpy.call_method1("asarray", (&self.array, dtype))?;
        Ok(converted.call_method0("tobytes")?.cast_into::<PyBytes>()?)
    }

    fn f32s(&self) -> PyResult<Vec<f32>> {
        if self.element.1 > 4 {
            // Numpy would warn of a number that is too large.
            return Ok(self.f64s()?.into_iter().map(|number| number as f32).collect());
        }
        let bytes = self.bytes("<f4")?;
        Ok(bytes.as_bytes().as_chunks().0.iter().map(|four| f32::from_le_bytes(*four)).collect())
    }

    fn f64s(&self) -> PyResult<Vec<f64>> {
        let bytes = self.bytes("<f8")?;
        Ok(bytes.as_bytes().as_chunks().0.iter().map(|eight| f64::from_le_bytes(*eight)).collect())
    }
}

/// What a photo is.
const PHOTO: &str = "uint8 of shape (H, W) or (H, W, 3)";

/// A photo: uint8, H × W or H × W × 3.
pub fn photo(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Photo> {
    let given = photo_array(name, value)?;
    let (width, height, has_color) = size_of_photo(&given)?;
    let bytes = given.bytes("u1")?;
    let values = bytes.as_bytes();
    let photo = value.py().detach(|| {
        let values = values.to_vec();
        if has_color {
            RgbImage::from_raw(width, height, values).map(Photo::from_color)
        } else {
            GrayImage::from_raw(width, height, values).map(Photo::from_gray)
        }
    });
    photo.ok_or_else(|| given.wrong_photo())
}

/// A photo as an array. What is no array at all is named with what people may have meant.
fn photo_array<'py>(name: &'py str, value: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
    if value.is_none() {
        return Err(errors::value(format!(
            "{name}: {PHOTO} expected, None given; cv2.imread returns None where it finds no photo"
        )));
    }
    if value.is_instance_of::<PyString>() || value.hasattr("__fspath__")? {
        let read = "read the file first, for example by cv2.imread";
        return Err(errors::value(format!("{name}: {PHOTO} expected, a path given; {read}")));
    }
    Array::of(name, value)
}

/// Checks that a value is a photo of this size, without copying it.
pub fn check_photo(name: &str, value: &Bound<'_, PyAny>, size: (u32, u32)) -> PyResult<()> {
    let given = photo_array(name, value)?;
    let (width, height, _) = size_of_photo(&given)?;
    if (width, height) == size {
        return Ok(());
    }
    let (camera_width, camera_height) = size;
    Err(given.wrong(&format!("a photo of its camera, {camera_height} x {camera_width},")))
}

/// Width and height \[px\], and whether it has colours.
fn size_of_photo(given: &Array<'_>) -> PyResult<(u32, u32, bool)> {
    let is_bytes = given.element == ('u', 1) && given.is_small();
    let side = |side: usize| u32::try_from(side).map_err(|_| given.wrong_photo());
    match *given.shape {
        [height, width] if is_bytes => Ok((side(width)?, side(height)?, false)),
        [height, width, 3] if is_bytes => Ok((side(width)?, side(height)?, true)),
        _ => Err(given.wrong_photo()),
    }
}

/// A cloud: float32 or float64, N × 3, in the camera's frame or, with its pose, in the world's. Of N × 4, the last column
/// is left out: scanners have the reflectance there, and homogeneous points 1. Points that are not finite are left out.
pub fn cloud(
    name: &str,
    value: &Bound<'_, PyAny>,
    world_from_camera: Option<&Pose>,
) -> PyResult<Cloud> {
    let given = Array::of(name, value)?;
    let columns = match *given.shape {
        [_, columns @ (3 | 4)] if given.is_small() && matches!(given.element, ('f', 4 | 8)) => {
            columns
        }
        _ => return Err(given.wrong("float32 or float64 of shape (N, 3) or (N, 4)")),
    };
    fn xyz<T: Copy>(row: &[T]) -> [T; 3] {
        [row[0], row[1], row[2]]
    }
    let is_finite = |point: &Point3<f32>| point.iter().all(|x| x.is_finite());
    let points = match world_from_camera {
        None => {
            let numbers = given.f32s()?;
            let points = numbers.chunks_exact(columns).map(|row| Point3::from(xyz(row)));
            points.filter(is_finite).collect()
        }
        Some(pose) => {
            // Map coordinates do not fit f32, so they become the camera's before they are rounded.
            let camera_from_world = pose.inverse();
            let numbers = given.f64s()?;
            let points = numbers.chunks_exact(columns).map(|row| Point3::<f64>::from(xyz(row)));
            let points = points.map(|point| (camera_from_world * point).cast());
            points.filter(is_finite).collect()
        }
    };
    Ok(Cloud { points })
}

/// A pose: numbers, 4 × 4 or 3 × 4, or what pycolmap has: a `Rigid3d` in the direction of the argument, or whatever has
/// a `cam_from_world`, such as an `Image` or the answer of an estimator, which is inverted.
pub fn pose(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Pose> {
    let of_dict = match value.cast::<PyDict>() {
        Ok(answer) => answer.get_item("cam_from_world")?,
        Err(_) => None,
    };
    let camera_from_world = match of_dict {
        None if value.hasattr("cam_from_world")? => Some(value.getattr("cam_from_world")?),
        found => found,
    };
    if let Some(mut found) = camera_from_world {
        // Older versions have the pose, newer ones a method.
        if found.is_callable() {
            found = found.call0()?;
        }
        return Ok(pose(name, &found)?.inverse());
    }
    if value.hasattr("rotation")? && value.hasattr("translation")? && value.hasattr("matrix")? {
        return pose(name, &value.call_method0("matrix")?);
    }
    let given = Array::of(name, value)?;
    if !given.has_numbers() || !matches!(*given.shape, [3 | 4, 4]) {
        return Err(given.wrong("numbers of shape (4, 4)"));
    }
    let numbers = given.f64s()?;
    if let Some(last @ [_, ..]) = numbers.get(12..)
        && *last != [0.0, 0.0, 0.0, 1.0]
    {
        let words = format!("{name}: the last row 0 0 0 1 expected, {last:?} given");
        return Err(errors::value(words));
    }
    let matrix = Matrix3x4::from_row_iterator(numbers.into_iter().take(12));
    pose_from_matrix(&matrix).map_err(|error| errors::value(format!("{name}: {error}")))
}

/// Points of a photo: numbers, N × 2.
pub fn points(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<[f32; 2]>> {
    let given = Array::of(name, value)?;
    if !given.has_numbers() || !matches!(*given.shape, [_, 2]) || !given.is_small() {
        return Err(given.wrong("numbers of shape (N, 2)"));
    }
    let numbers = given.f32s()?;
    if !numbers.iter().all(|x| x.is_finite()) {
        return Err(errors::value(format!("{name}: finite numbers expected")));
    }
    Ok(numbers.as_chunks().0.to_vec())
}

/// A number for each of `count` matches.
pub fn scores(name: &str, value: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<f64>> {
    let given = Array::of(name, value)?;
    if !given.has_numbers() || *given.shape != [count] {
        return Err(given.wrong(&format!("numbers of shape ({count},)")));
    }
    given.f64s()
}

/// Bytes as an array that can be written to.
fn made<'py>(
    py: Python<'py>,
    bytes: &[u8],
    dtype: &str,
    shape: &[usize],
) -> PyResult<Bound<'py, PyAny>> {
    let buffer = PyByteArray::new(py, bytes);
    let flat = py.import("numpy")?.call_method1("frombuffer", (buffer, dtype))?;
    flat.call_method1("reshape", (shape.to_vec(),))
}

/// A photo as an array: H × W × 3 where it has colours, else H × W.
pub fn of_photo<'py>(py: Python<'py>, photo: &Photo) -> PyResult<Bound<'py, PyAny>> {
    let (width, height) = photo.dimensions();
    let (width, height) = (width as usize, height as usize);
    match &photo.color {
        Some(color) => made(py, color.as_raw(), "u1", &[height, width, 3]),
        None => made(py, photo.gray.as_raw(), "u1", &[height, width]),
    }
}

/// A pose as a 4 × 4 array.
pub fn of_pose<'py>(py: Python<'py>, pose: &Pose) -> PyResult<Bound<'py, PyAny>> {
    // nalgebra stores columns.
    let rows = pose.to_homogeneous().transpose();
    let bytes: Vec<u8> = rows.iter().flat_map(|number| number.to_le_bytes()).collect();
    made(py, &bytes, "<f8", &[4, 4])
}

/// A cloud as an N × 3 array.
pub fn of_cloud<'py>(py: Python<'py>, cloud: &Cloud) -> PyResult<Bound<'py, PyAny>> {
    let numbers = cloud.points.iter().flat_map(|point| [point.x, point.y, point.z]);
    let bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
    made(py, &bytes, "<f4", &[cloud.len(), 3])
}
