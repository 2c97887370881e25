//! The camera.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use posescope_core::Intrinsics;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors;
use crate::travel::{self, Reduced};

/// A rectified pinhole camera.
///
/// Args:
///     fx, fy: Focal lengths [px].
///     cx, cy: Principal point [px].
///     width, height: Size of its photos [px].
///     pixel_center: Coordinate of the centre of the top-left pixel: 0 as in OpenCV and KITTI, 0.5 as in COLMAP.
///
/// Raises:
///     ValueError: A focal length is not above 0, a number is not finite, or there is no pixel.
#[pyclass(frozen, eq, module = "posescope")]
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// With the centre of the top-left pixel at (0, 0).
    pub intrinsics: Intrinsics,
    pixel_center: f64,
}

impl Camera {
    /// A camera whose top-left pixel has its centre at (0, 0).
    pub fn of(intrinsics: Intrinsics) -> Self {
        Self { intrinsics, pixel_center: 0.0 }
    }
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (fx, fy, cx, cy, width, height, pixel_center = 0.0))]
    fn new(
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        width: u32,
        height: u32,
        pixel_center: f64,
    ) -> PyResult<Self> {
        let is_focal = |length: f64| length.is_finite() && length > 0.0;
        if !is_focal(fx) || !is_focal(fy) {
            return Err(errors::value(format!(
                "Camera: focal lengths above 0 expected, fx={fx}, fy={fy} given"
            )));
        }
        if ![cx, cy, pixel_center].into_iter().all(f64::is_finite) {
            return Err(errors::value(format!(
                "Camera: finite numbers expected, cx={cx}, cy={cy}, pixel_center={pixel_center} given"
            )));
        }
        // Then the focal length along y is the middle of the photo's width, and so on.
        let is_middle = |at: f64, side: u32| (2.0 * at / f64::from(side) - 1.0).abs() < 0.2;
        if is_middle(fy, width) && is_middle(cx, height) && cy.abs() < 1.0 {
            return Err(errors::value(format!(
                "Camera: fx, fy, cx, cy expected, {fx}, {fy}, {cx}, {cy} look like f, cx, cy, k of COLMAP's \
                 SIMPLE_RADIAL; give the pycolmap.Camera itself"
            )));
        }
        if width == 0 || height == 0 {
            return Err(errors::value(format!(
                "Camera: at least one pixel expected, {width} x {height} given"
            )));
        }
        let (cx, cy) = (cx - pixel_center, cy - pixel_center);
        Ok(Self { intrinsics: Intrinsics { fx, fy, cx, cy, width, height }, pixel_center })
    }

    /// Focal length along x [px].
    #[getter]
    fn fx(&self) -> f64 {
        self.intrinsics.fx
    }

    /// Focal length along y [px].
    #[getter]
    fn fy(&self) -> f64 {
        self.intrinsics.fy
    }

    /// Principal point, x [px], as given: it depends on `pixel_center`.
    #[getter]
    fn cx(&self) -> f64 {
        self.intrinsics.cx + self.pixel_center
    }

    /// Principal point, y [px], as given: it depends on `pixel_center`.
    #[getter]
    fn cy(&self) -> f64 {
        self.intrinsics.cy + self.pixel_center
    }

    /// Width of its photos [px].
    #[getter]
    fn width(&self) -> u32 {
        self.intrinsics.width
    }

    /// Height of its photos [px].
    #[getter]
    fn height(&self) -> u32 {
        self.intrinsics.height
    }

    /// Coordinate of the centre of the top-left pixel.
    #[getter]
    fn pixel_center(&self) -> f64 {
        self.pixel_center
    }

    fn __hash__(&self) -> u64 {
        let Intrinsics { fx, fy, cx, cy, width, height } = self.intrinsics;
        let mut hasher = DefaultHasher::new();
        // Zero and minus zero are equal.
        let bits = [fx, fy, cx, cy, self.pixel_center].map(|number| (number + 0.0).to_bits());
        (bits, width, height).hash(&mut hasher);
        hasher.finish()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        let Intrinsics { fx, fy, cx, cy, width, height } = self.intrinsics;
        let numbers = (fx, fy, cx, cy, width, height, self.pixel_center);
        travel::by(py, "camera", numbers)
    }

    fn __repr__(&self) -> String {
        let Intrinsics { fx, fy, width, height, .. } = self.intrinsics;
        let (cx, cy, center) = (self.cx(), self.cy(), self.pixel_center);
        format!(
            "Camera(fx={fx}, fy={fy}, cx={cx}, cy={cy}, width={width}, height={height}, pixel_center={center})"
        )
    }
}

/// The models of COLMAP that a rectified pinhole camera can be, and how many of their parameters are focal lengths; two
/// are the centre, and the rest is distortion.
const MODELS: [(&str, usize); 6] = [
    ("SIMPLE_PINHOLE", 1),
    ("PINHOLE", 2),
    ("SIMPLE_RADIAL", 1),
    ("RADIAL", 1),
    ("OPENCV", 2),
    ("FULL_OPENCV", 2),
];

/// A camera of ours or of pycolmap: an object or a dict with `model`, `width`, `height` and `params`.
pub fn taken(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Camera> {
    if let Ok(camera) = value.cast::<Camera>() {
        return Ok(camera.get().clone());
    }
    let part = |key: &str| -> PyResult<Option<Bound<'_, PyAny>>> {
        match value.cast::<PyDict>() {
            Ok(dict) => dict.get_item(key),
            Err(_) => value.getattr_opt(key),
        }
    };
    let parts = (part("model")?, part("params")?, part("width")?, part("height")?);
    let (Some(model), Some(params), Some(width), Some(height)) = parts else {
        let given = value.get_type().fully_qualified_name()?.to_string();
        return Err(PyTypeError::new_err(format!(
            "{name}: a posescope.Camera or pycolmap.Camera expected, {given} given"
        )));
    };
    let model = match part("model_name")?.or(model.getattr_opt("name")?) {
        Some(name) => name.str()?.to_string(),
        None => model.str()?.to_string(),
    };
    let numbers: Vec<f64> =
        params.try_iter()?.map(|one| one?.extract()).collect::<PyResult<_>>()?;
    let (width, height): (u32, u32) = (width.extract()?, height.extract()?);
    let known = MODELS.iter().find(|(name, _)| *name == model);
    let focal = known.map(|(_, focal)| *focal).filter(|focal| numbers.len() >= focal + 2);
    let remedy = "undistort photo and camera first, or open the folder of the COLMAP model, whose photos posescope \
                  undistorts";
    let Some(focal) = focal else {
        let models: Vec<&str> = MODELS.iter().map(|(name, _)| *name).collect();
        return Err(errors::value(format!(
            "{name}: one of the models {} expected, {model} with {} parameters given; {remedy}",
            models.join(", "),
            numbers.len()
        )));
    };
    let (center, distortion) = numbers[focal..].split_at(2);
    if distortion.iter().any(|k| *k != 0.0) {
        return Err(errors::value(format!(
            "{name}: a camera without distortion expected, {model} with {distortion:?} given; {remedy}"
        )));
    }
    let (fx, fy) = (numbers[0], numbers[focal - 1]);
    Camera::new(fx, fy, center[0], center[1], width, height, 0.5)
}

/// The camera, of ours or of pycolmap, as ours.
#[pyfunction]
pub fn camera_of(value: &Bound<'_, PyAny>) -> PyResult<Camera> {
    taken("camera", value)
}

/// A camera that travelled: its principal point is where the centre of the top-left pixel is at (0, 0).
#[pyfunction]
pub fn restored_camera(
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    width: u32,
    height: u32,
    pixel_center: f64,
) -> PyResult<Camera> {
    let mut camera = Camera::new(fx, fy, cx, cy, width, height, 0.0)?;
    camera.pixel_center = pixel_center;
    Ok(camera)
}
