//! Arrays of numpy as photos, clouds, poses and points, and back.

use nalgebra::{Matrix3x4, Point3};
use numpy::ndarray::Array2;
use numpy::{
    Element, IntoPyArray as _, PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods as _,
    PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods as _,
};
use posescope_core::geometry::pose_from_matrix;
use posescope_core::image::{GrayImage, RgbImage};
use posescope_core::{Cloud, Photo, Pose};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;

/// The most elements of a photo or a cloud. A larger array is a mistake, such as one that repeats an element.
const MAX_ELEMENTS: usize = 1 << 30;

/// What is wrong with an array: its name, what was expected, and its dtype and shape.
fn wrong(name: &str, expected: &str, array: &Bound<'_, PyUntypedArray>) -> PyErr {
    let sides: Vec<String> = array.shape().iter().map(ToString::to_string).collect();
    let dtype = array.dtype();
    errors::value(format!(
        "{name}: {expected} expected, {dtype} of shape ({}) given",
        sides.join(", ")
    ))
}

/// Anything as an array, without a copy where it is one.
fn array<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    if let Ok(array) = value.cast::<PyUntypedArray>() {
        return Ok(array.clone());
    }
    let numpy = value.py().import("numpy")?;
    match numpy.call_method1("asarray", (value,)) {
        Ok(array) => Ok(array.cast_into::<PyUntypedArray>()?),
        Err(error) => Err(errors::value(format!(
            "{name}: an array expected, {} given ({error})",
            value.get_type().name()?
        ))),
    }
}

/// `kind` and size in bytes of an element.
fn kind(array: &Bound<'_, PyUntypedArray>) -> (u8, usize) {
    let dtype = array.dtype();
    (numpy::PyArrayDescrMethods::kind(&dtype), numpy::PyArrayDescrMethods::itemsize(&dtype))
}

/// The elements of an array row by row, as they are or converted.
fn elements<T: Element + Clone>(
    array: &Bound<'_, PyUntypedArray>,
    dtype: &str,
) -> PyResult<Vec<T>> {
    let py = array.py();
    let order = PyDict::new(py);
    order.set_item("dtype", dtype)?;
    let numpy = py.import("numpy")?;
    let rows = numpy.call_method("ascontiguousarray", (array,), Some(&order))?;
    let rows: PyReadonlyArrayDyn<'_, T> = rows.cast::<PyArrayDyn<T>>()?.try_readonly()?;
    Ok(rows.as_slice()?.to_vec())
}

/// A photo: uint8, H × W or H × W × 3.
pub fn photo(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Photo> {
    const EXPECTED: &str = "uint8 of shape (H, W) or (H, W, 3)";
    let given = array(name, value)?;
    let wrong = || wrong(name, EXPECTED, &given);
    if kind(&given) != (b'u', 1) || given.len() > MAX_ELEMENTS {
        return Err(wrong());
    }
    let side = |side: usize| u32::try_from(side).map_err(|_| wrong());
    match *given.shape() {
        [height, width] => {
            let (width, height) = (side(width)?, side(height)?);
            let gray = GrayImage::from_raw(width, height, elements(&given, "uint8")?);
            Ok(Photo::from_gray(gray.ok_or_else(wrong)?))
        }
        [height, width, 3] => {
            let (width, height) = (side(width)?, side(height)?);
            let color = RgbImage::from_raw(width, height, elements(&given, "uint8")?);
            Ok(Photo::from_color(color.ok_or_else(wrong)?))
        }
        _ => Err(wrong()),
    }
}

/// A cloud: float32 or float64, N × 3, in the camera's frame or, with its pose, in the world's. Points that are not
/// finite are left out.
pub fn cloud(
    name: &str,
    value: &Bound<'_, PyAny>,
    world_from_camera: Option<&Pose>,
) -> PyResult<Cloud> {
    const EXPECTED: &str = "float32 or float64 of shape (N, 3)";
    let given = array(name, value)?;
    if given.len() > MAX_ELEMENTS || !matches!(*given.shape(), [_, 3]) {
        return Err(wrong(name, EXPECTED, &given));
    }
    let is_finite = |point: &Point3<f32>| point.iter().all(|x| x.is_finite());
    let points: Vec<Point3<f32>> = match (kind(&given), world_from_camera) {
        ((b'f', 4), None) => {
            let numbers: Vec<f32> = elements(&given, "float32")?;
            numbers.as_chunks().0.iter().copied().map(Point3::from).filter(is_finite).collect()
        }
        ((b'f', 4 | 8), pose) => {
            // Map coordinates do not fit f32, so they become the camera's before they are rounded.
            let camera_from_given = pose.map_or_else(Pose::identity, Pose::inverse);
            let numbers: Vec<f64> = elements(&given, "float64")?;
            let points = numbers.as_chunks().0.iter().copied().map(Point3::<f64>::from);
            match pose {
                None => points.map(|point| point.cast()).filter(is_finite).collect(),
                Some(_) => points
                    .map(|point| (camera_from_given * point).cast())
                    .filter(is_finite)
                    .collect(),
            }
        }
        _ => return Err(wrong(name, EXPECTED, &given)),
    };
    Ok(Cloud { points })
}

/// A pose: numbers, 4 × 4 or 3 × 4.
pub fn pose(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Pose> {
    const EXPECTED: &str = "numbers of shape (4, 4), world_from_camera,";
    let given = array(name, value)?;
    if !matches!(kind(&given).0, b'f' | b'i' | b'u') || !matches!(*given.shape(), [3 | 4, 4]) {
        return Err(wrong(name, EXPECTED, &given));
    }
    let numbers: Vec<f64> = elements(&given, "float64")?;
    if numbers.get(12..).is_some_and(|last| !last.is_empty() && *last != [0.0, 0.0, 0.0, 1.0]) {
        return Err(errors::value(format!(
            "{name}: the last row 0 0 0 1 expected, {:?} given",
            &numbers[12..]
        )));
    }
    let matrix = Matrix3x4::from_row_iterator(numbers.into_iter().take(12));
    pose_from_matrix(&matrix).map_err(|error| errors::value(format!("{name}: {error}")))
}

/// Points of a photo: numbers, N × 2.
pub fn points(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<[f32; 2]>> {
    let given = array(name, value)?;
    let is_numbers = matches!(kind(&given).0, b'f' | b'i' | b'u');
    if !is_numbers || !matches!(*given.shape(), [_, 2]) || given.len() > MAX_ELEMENTS {
        return Err(wrong(name, "numbers of shape (N, 2)", &given));
    }
    let numbers: Vec<f32> = elements(&given, "float32")?;
    if !numbers.iter().all(|x| x.is_finite()) {
        return Err(errors::value(format!("{name}: finite numbers expected")));
    }
    Ok(numbers.as_chunks().0.to_vec())
}

/// A number for each of `count` matches.
pub fn scores(name: &str, value: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<f64>> {
    let given = array(name, value)?;
    if !matches!(kind(&given).0, b'f' | b'i' | b'u') || *given.shape() != [count] {
        return Err(wrong(name, &format!("numbers of shape ({count},)"), &given));
    }
    elements(&given, "float64")
}

/// A photo as an array: H × W × 3 where it has colours, else H × W.
pub fn of_photo<'py>(py: Python<'py>, photo: &Photo) -> PyResult<Bound<'py, PyAny>> {
    let (width, height) = photo.dimensions();
    let (width, height) = (width as usize, height as usize);
    Ok(match &photo.color {
        Some(color) => {
            let pixels = PyArray1::from_slice(py, color.as_raw());
            let image: Bound<'_, PyArray3<u8>> = pixels.reshape([height, width, 3])?;
            image.into_any()
        }
        None => {
            let pixels = PyArray1::from_slice(py, photo.gray.as_raw());
            let image: Bound<'_, PyArray2<u8>> = pixels.reshape([height, width])?;
            image.into_any()
        }
    })
}

/// A pose as a 4 × 4 array.
pub fn of_pose<'py>(py: Python<'py>, pose: &Pose) -> Bound<'py, PyArray2<f64>> {
    let matrix = pose.to_homogeneous();
    Array2::from_shape_fn((4, 4), |(row, column)| matrix[(row, column)]).into_pyarray(py)
}

/// A cloud as an N × 3 array.
pub fn of_cloud<'py>(py: Python<'py>, cloud: &Cloud) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let numbers: Vec<f32> =
        cloud.points.iter().flat_map(|point| [point.x, point.y, point.z]).collect();
    PyArray1::from_vec(py, numbers).reshape([cloud.len(), 3])
}
