//! The camera.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};

use posescope_core::Intrinsics;
use pyo3::prelude::*;

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
