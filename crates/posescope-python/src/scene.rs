//! Scenes.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

use posescope::scene::{FrameStore, Scene as _, SceneError, SceneSize};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyBool;

use crate::detached::detached;
use crate::errors;
use crate::frames::{Origin, Query, Reference};
use crate::travel::{self, Reduced};

/// The path of a scene, and its format where that is not recognised.
type Key = (String, Option<String>);

/// The scenes in use: frames that travel together come back as frames of one scene.
static IN_USE: Mutex<BTreeMap<Key, Weak<Opened>>> = Mutex::new(BTreeMap::new());

/// An opened scene with the frames used last.
pub struct Opened {
    /// The scene argument.
    pub argument: String,
    /// The format, where it was named.
    format: Option<String>,
    /// The scene.
    pub scene: Arc<dyn posescope::scene::Scene>,
    /// Its frames, with what was computed of them.
    pub store: Arc<FrameStore>,
    size: OnceLock<SceneSize>,
}

impl Opened {
    /// Whether it is the scene of the same path.
    pub fn is_same(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
            || (&self.argument, &self.format) == (&other.argument, &other.format)
    }

    /// How large the scene is.
    pub fn size(&self) -> SceneSize {
        *self.size.get_or_init(|| SceneSize::of(self.scene.as_ref()))
    }
}

/// A scene: frames with photos, cameras, and where they are known poses and clouds.
///
/// `Scene.open` reads KITTI, RobotCar, TUM RGB-D, 7-Scenes, COLMAP and `scene.toml`; `Scene.street` is built in.
#[pyclass(frozen, module = "posescope")]
pub struct Scene {
    /// The scene.
    pub opened: Arc<Opened>,
}

impl Scene {
    fn of(py: Python<'_>, argument: &str, format: Option<&str>) -> PyResult<Self> {
        let opened = detached(py, None, |_| posescope::scene::open(argument, format))?;
        let opened = opened.map_err(|error| errors::scene(&error))?;
        let opened = Arc::new(Opened {
            argument: argument.to_owned(),
            format: format.map(str::to_owned),
            scene: Arc::from(opened),
            store: Arc::default(),
            size: OnceLock::new(),
        });
        let mut in_use = IN_USE.lock().unwrap_or_else(PoisonError::into_inner);
        in_use.retain(|_, known| known.strong_count() > 0);
        let key = (opened.argument.clone(), opened.format.clone());
        in_use.insert(key, Arc::downgrade(&opened));
        Ok(Self { opened })
    }

    /// The frame of this name.
    pub fn find(&self, name: &str) -> PyResult<Origin> {
        let found = self.opened.scene.find(name).map_err(|error| errors::scene(&error))?;
        Ok(Origin { opened: Arc::clone(&self.opened), frame: found })
    }
}

/// The name of a frame: a text, a path, a whole number, or what has a `name`, as queries and references do.
pub fn called(name: &Bound<'_, PyAny>) -> PyResult<String> {
    if let Ok(text) = name.extract::<String>() {
        return Ok(text);
    }
    if let Ok(path) = name.extract::<PathBuf>() {
        return Ok(path.to_string_lossy().into_owned());
    }
    // True is a number in Python.
    if let Ok(number) = name.extract::<u64>()
        && !name.is_instance_of::<PyBool>()
    {
        return Ok(number.to_string());
    }
    if let Some(text) = name.getattr_opt("name")?
        && let Ok(text) = text.extract::<String>()
    {
        return Ok(text);
    }
    let given = name.get_type().fully_qualified_name()?.to_string();
    let words = format!("name: the name of a frame or its number expected, {given} given");
    Err(PyTypeError::new_err(words))
}

#[pymethods]
impl Scene {
    /// Opens a scene.
    ///
    /// Args:
    ///     path: A folder or file, or `street` or `street:CONDITION`, as the command takes it. Or a `Reconstruction` of
    ///         pycolmap, which is written to a temporary folder of this process.
    ///     format: The name of the format, where it is not recognised.
    ///     images: The folder of the photos of a `Reconstruction`.
    ///
    /// Raises:
    ///     InputError: There is no scene, or it cannot be read.
    #[staticmethod]
    #[pyo3(signature = (path, format = None, images = None))]
    fn open(
        py: Python<'_>,
        path: &Bound<'_, PyAny>,
        format: Option<&str>,
        images: Option<PathBuf>,
    ) -> PyResult<Self> {
        let path: PathBuf = if path.hasattr("write_text")? && !path.hasattr("__fspath__")? {
            let written = py.import("posescope._neighbours")?.getattr("written_model")?;
            written.call1((path, images))?.extract()?
        } else {
            path.extract()?
        };
        Self::of(py, &path.to_string_lossy(), format)
    }

    /// The built-in street: photos, scans and exact poses.
    ///
    /// Args:
    ///     condition: `night`, `snow` or another condition; without one, the street by day.
    ///
    /// Raises:
    ///     InputError: There is no such condition; the message lists them.
    #[staticmethod]
    #[pyo3(signature = (condition = None))]
    fn street(py: Python<'_>, condition: Option<&str>) -> PyResult<Self> {
        let argument = condition.map_or("street".to_owned(), |name| format!("street:{name}"));
        Self::of(py, &argument, None)
    }

    /// Its name in results.
    #[getter]
    fn name(&self) -> &str {
        self.opened.scene.name()
    }

    /// The names of its frames, in order.
    #[getter]
    fn frames(&self) -> Vec<String> {
        self.opened.scene.frames().to_vec()
    }

    /// What `Scene.open` took.
    #[getter]
    fn path(&self) -> &str {
        &self.opened.argument
    }

    /// A frame as a query, with its true pose where the scene knows it.
    ///
    /// Args:
    ///     name: The frame's name, whose leading zeros may be left out; a whole number; or a frame with a `name`.
    ///
    /// Raises:
    ///     InputError: There is no such frame, or its photo cannot be read.
    fn query(&self, py: Python<'_>, name: &Bound<'_, PyAny>) -> PyResult<Query> {
        let origin = self.find(&called(name)?)?;
        let read = detached(py, None, |_| {
            let Origin { opened, frame } = &origin;
            opened.store.of(&opened.scene).query(*frame)
        })?;
        let query = read.map_err(|error| errors::scene(&error))?;
        let truth = origin.opened.scene.pose(origin.frame);
        Ok(Query { query, truth, origin: Some(origin) })
    }

    /// A frame as a reference: photo, camera, pose and cloud.
    ///
    /// Args:
    ///     name: The frame's name, whose leading zeros may be left out; a whole number; or a frame with a `name`.
    ///
    /// Raises:
    ///     InputError: There is no such frame, it has no pose or no cloud, or a file cannot be read.
    fn reference(&self, py: Python<'_>, name: &Bound<'_, PyAny>) -> PyResult<Reference> {
        let origin = self.find(&called(name)?)?;
        let read: Result<_, SceneError> = detached(py, None, |_| {
            let Origin { opened, frame } = &origin;
            opened.store.of(&opened.scene).reference(*frame)
        })?;
        let reference = read.map_err(|error| errors::scene(&error))?;
        Ok(Reference { reference, origin: Some(origin) })
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        travel::by(py, "scene", (&self.opened.argument, &self.opened.format))
    }

    fn __len__(&self) -> usize {
        self.opened.scene.frames().len()
    }

    fn __repr__(&self) -> String {
        let scene = &self.opened.scene;
        format!("<Scene {}: {} frames>", scene.name(), scene.frames().len())
    }
}

/// A scene that travelled: the one of its path that is in use, or else the path is opened.
#[pyfunction]
pub fn restored_scene(py: Python<'_>, argument: String, format: Option<String>) -> PyResult<Scene> {
    let key = (argument, format);
    let in_use =
        IN_USE.lock().unwrap_or_else(PoisonError::into_inner).get(&key).and_then(Weak::upgrade);
    match in_use {
        Some(opened) => Ok(Scene { opened }),
        None => Scene::of(py, &key.0, key.1.as_deref()),
    }
}
