//! Queries and references.

use std::sync::Arc;

use posescope_core::{Pose, ReferenceTuple};
use pyo3::prelude::*;

use crate::scene::{Opened, Scene};
use crate::travel::{self, Parts, Reduced};
use crate::{arrays, camera, camera::Camera, errors};

/// The frame of a scene that a query or a reference is.
#[derive(Clone)]
pub struct Origin {
    /// The scene.
    pub opened: Arc<Opened>,
    /// The frame's position in it.
    pub frame: usize,
}

impl Origin {
    /// The scene and the frame's name in it.
    fn named(&self) -> (Scene, String) {
        let name = self.opened.scene.frames()[self.frame].clone();
        (Scene { opened: Arc::clone(&self.opened) }, name)
    }
}

/// The photo whose pose is sought.
///
/// Args:
///     photo: uint8, H × W or H × W × 3 (red, green, blue), with any strides. It is copied.
///     camera: The camera that took it, also a camera of pycolmap without distortion.
///     name: Its name in results. Random choices derive from it, too.
///     truth: The true `world_from_camera`, 4 × 4, where it is known; results then have a grade and an error.
///
/// Raises:
///     ValueError: The photo has another dtype, shape or size than the camera's, or the truth is no pose.
#[pyclass(frozen, module = "posescope")]
pub struct Query {
    /// The query without the truth.
    pub query: Arc<posescope_core::Query>,
    /// The true pose.
    pub truth: Option<Pose>,
    /// The frame that it is, of a scene.
    pub origin: Option<Origin>,
}

#[pymethods]
impl Query {
    #[new]
    #[pyo3(signature = (photo, camera, name = "query", truth = None))]
    fn new(
        photo: &Bound<'_, PyAny>,
        camera: &Bound<'_, PyAny>,
        name: &str,
        truth: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let camera = camera::taken("camera", camera)?;
        let photo = arrays::photo("photo", photo)?;
        let query = posescope_core::Query::new(name, photo, camera.intrinsics);
        Ok(Self {
            query: Arc::new(query.map_err(|error| errors::array(&error))?),
            truth: truth.map(|truth| arrays::pose("truth", truth)).transpose()?,
            origin: None,
        })
    }

    /// Its name in results.
    #[getter]
    fn name(&self) -> &str {
        self.query.name()
    }

    /// The camera; the centre of its top-left pixel is at (0, 0).
    #[getter]
    fn camera(&self) -> Camera {
        Camera::of(*self.query.intrinsics())
    }

    /// A copy of the photo: uint8, H × W × 3 where it has colours, else H × W.
    #[getter]
    fn photo<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::of_photo(py, self.query.photo())
    }

    /// The true `world_from_camera`, 4 × 4, where it is known.
    #[getter]
    fn truth<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.truth.as_ref().map(|truth| arrays::of_pose(py, truth)).transpose()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        match &self.origin {
            Some(origin) => travel::by(py, "query_of", origin.named()),
            None => {
                let truth = self.truth.as_ref().map(travel::parts);
                let numbers = (self.photo(py)?, self.camera(), self.name(), truth);
                travel::by(py, "query", numbers)
            }
        }
    }

    fn __repr__(&self) -> String {
        let (width, height) = self.query.photo().dimensions();
        let truth = if self.truth.is_some() { "known" } else { "unknown" };
        format!("<Query {}: {width} x {height} px, truth {truth}>", self.query.name())
    }
}

/// A photo with a known pose, and the point cloud registered with it.
///
/// Args:
///     photo: uint8, H × W or H × W × 3 (red, green, blue), with any strides. It is copied.
///     camera: The camera that took it, also a camera of pycolmap without distortion.
///     world_from_camera: Its pose, 4 × 4 [m], or an `Image` of pycolmap. Camera frame: x right, y down, z forward.
///     cloud: Points, float32 or float64, N × 3 [m]; a fourth column is left out, and so are points that are not finite.
///     cloud_frame: The frame of the points, `camera` or `world`.
///     name: Its name in results. Random choices derive from it, too.
///
/// Raises:
///     ValueError: An array has another dtype or shape, or the pose is not rigid.
#[pyclass(frozen, module = "posescope")]
pub struct Reference {
    /// The reference.
    pub reference: Arc<ReferenceTuple>,
    /// The frame that it is, of a scene.
    pub origin: Option<Origin>,
}

#[pymethods]
impl Reference {
    #[new]
    #[pyo3(signature = (photo, camera, world_from_camera, cloud, cloud_frame = "camera", name = "reference"))]
    fn from_arrays(
        photo: &Bound<'_, PyAny>,
        camera: &Bound<'_, PyAny>,
        world_from_camera: &Bound<'_, PyAny>,
        cloud: &Bound<'_, PyAny>,
        cloud_frame: &str,
        name: &str,
    ) -> PyResult<Self> {
        let camera = camera::taken("camera", camera)?;
        let photo = arrays::photo("photo", photo)?;
        let pose = arrays::pose("world_from_camera", world_from_camera)?;
        let cloud = match cloud_frame {
            "camera" => arrays::cloud("cloud", cloud, None)?,
            "world" => arrays::cloud("cloud", cloud, Some(&pose))?,
            other => {
                let words = format!("cloud_frame: `camera` or `world` expected, `{other}` given");
                return Err(errors::value(words));
            }
        };
        let reference = ReferenceTuple::new(name, photo, camera.intrinsics, pose, cloud);
        let reference = reference.map_err(|error| errors::array(&error))?;
        Ok(Self { reference: Arc::new(reference), origin: None })
    }

    /// Its name in results.
    #[getter]
    fn name(&self) -> &str {
        self.reference.name()
    }

    /// The camera; the centre of its top-left pixel is at (0, 0).
    #[getter]
    fn camera(&self) -> Camera {
        Camera::of(*self.reference.intrinsics())
    }

    /// A copy of the photo: uint8, H × W × 3 where it has colours, else H × W.
    #[getter]
    fn photo<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::of_photo(py, self.reference.photo())
    }

    /// Its pose `world_from_camera`, 4 × 4 [m].
    #[getter]
    fn world_from_camera<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::of_pose(py, self.reference.world_from_camera())
    }

    /// A copy of the cloud: float32, N × 3 [m], in the camera's frame.
    #[getter]
    fn cloud<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        arrays::of_cloud(py, self.reference.cloud())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        match &self.origin {
            Some(origin) => travel::by(py, "reference_of", origin.named()),
            None => {
                let pose = travel::parts(self.reference.world_from_camera());
                let (photo, cloud) = (self.photo(py)?, self.cloud(py)?);
                travel::by(py, "reference", (photo, self.camera(), pose, cloud, self.name()))
            }
        }
    }

    fn __repr__(&self) -> String {
        let (name, cloud) = (self.reference.name(), self.reference.cloud());
        let (width, height) = self.reference.photo().dimensions();
        let at = self.reference.world_from_camera().translation.vector;
        format!(
            "<Reference {name}: {width} x {height} px, {} points, at ({:.2}, {:.2}, {:.2}) m>",
            cloud.len(),
            at.x,
            at.y,
            at.z
        )
    }
}

/// A query of arrays that travelled.
#[pyfunction]
pub fn restored_query(
    photo: &Bound<'_, PyAny>,
    camera: &Bound<'_, PyAny>,
    name: &str,
    truth: Option<Parts>,
) -> PyResult<Query> {
    let query = Query::new(photo, camera, name, None)?;
    Ok(Query { truth: truth.map(travel::pose), ..query })
}

/// A reference of arrays that travelled.
#[pyfunction]
pub fn restored_reference(
    photo: &Bound<'_, PyAny>,
    camera: &Camera,
    pose: Parts,
    cloud: &Bound<'_, PyAny>,
    name: &str,
) -> PyResult<Reference> {
    let (photo, cloud) = (arrays::photo("photo", photo)?, arrays::cloud("cloud", cloud, None)?);
    let reference = ReferenceTuple::new(name, photo, camera.intrinsics, travel::pose(pose), cloud);
    let reference = reference.map_err(|error| errors::array(&error))?;
    Ok(Reference { reference: Arc::new(reference), origin: None })
}
