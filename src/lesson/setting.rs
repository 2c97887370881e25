//! The settings of a lesson.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Deserialize as _;
use toml::Spanned;

use crate::describe::ParamError;
use crate::params::Params;
use crate::run::Protocol;
use crate::scene::{FrameStore, Scene, SceneError};
use crate::session::{IndexFile, Job, Task, TaskScenes};

/// The run of a lesson or of a variant: the options of the command line by name, with `scene`, `query` and `set`.
/// Missing fields have their defaults.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Setting(toml::Table);

/// The fields in a file, with their positions.
pub(super) type Fields = BTreeMap<String, Spanned<toml::Value>>;

/// Why a setting is invalid.
#[derive(Debug, thiserror::Error)]
pub enum SettingError {
    /// A required field is missing.
    #[error("`{0}` expected in the header, none found")]
    Missing(&'static str),
    /// A field is not a text.
    #[error("a text in quotation marks expected for `{0}`")]
    NoText(&'static str),
    /// An unknown field or an invalid value.
    #[error("{}", .0.message())]
    Field(#[from] toml::de::Error),
    /// An unknown parameter or an invalid value.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// A scene or a frame that cannot be opened.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// A setting with its scenes opened.
#[derive(Clone)]
pub struct OpenSetting {
    /// The task.
    pub task: Task,
    /// The scenes.
    pub scenes: TaskScenes,
    /// The query's position in its scene.
    pub query: usize,
    /// The references' positions in their scene; empty if they are chosen for the query.
    pub references: Vec<usize>,
}

impl OpenSetting {
    /// The scenes by their names in the setting.
    pub fn named_scenes(&self) -> Vec<(String, Arc<dyn Scene>)> {
        named_scenes(&self.task, &self.scenes.references, &self.scenes.queries)
    }

    /// The job that localises it, with this cache of frames.
    pub fn job(&self, frames: &Arc<FrameStore>) -> Job {
        Job {
            references: Arc::clone(&self.scenes.references),
            queries: Arc::clone(&self.scenes.queries),
            query: self.query,
            chosen: self.references.clone().into(),
            task: self.task.clone(),
            index: Arc::new(IndexFile::of(&self.task)),
            frames: Arc::clone(frames),
        }
    }
}

/// The scenes of a task by their names in it. Queries without their own scene use that of the references, perhaps
/// with degraded photos, and have no name.
pub fn named_scenes(
    task: &Task,
    references: &Arc<dyn Scene>,
    queries: &Arc<dyn Scene>,
) -> Vec<(String, Arc<dyn Scene>)> {
    let own = task.query_scene();
    let own = own.map(|name| (name.to_owned(), Arc::clone(queries)));
    own.into_iter().chain([(task.scene.clone(), Arc::clone(references))]).collect()
}

impl Setting {
    /// Checks each field alone, so an error has its position.
    pub(super) fn of(fields: &Fields) -> Result<Self, (usize, SettingError)> {
        let mut all = toml::Table::new();
        for (key, value) in fields {
            let one = Self(toml::Table::from_iter([(key.clone(), value.get_ref().clone())]));
            one.task_of("").map_err(|error| (value.span().start, error))?;
            all.extend(one.0);
        }
        Ok(Self(all))
    }

    /// The fields of this setting, and those of `base` for the rest.
    pub(super) fn over(&self, base: &Self) -> Self {
        let mut table = base.0.clone();
        table.extend(self.0.clone());
        Self(table)
    }

    /// The task of the setting.
    ///
    /// # Errors
    /// The scene is missing, or a field is invalid.
    pub fn task(&self) -> Result<Task, SettingError> {
        let scene = self.text("scene")?;
        self.task_of(scene.ok_or(SettingError::Missing("scene"))?)
    }

    fn task_of(&self, scene: &str) -> Result<Task, SettingError> {
        let mut protocol = self.0.clone();
        for key in ["scene", "query"] {
            self.text(key)?;
            protocol.remove(key);
        }
        let assignments = protocol.remove("set").map(Vec::<String>::deserialize);
        let mut params = Params::default();
        for assignment in assignments.transpose()?.unwrap_or_default() {
            params.assign(&assignment)?;
        }
        Ok(Task { protocol: Protocol::deserialize(protocol)?, params, ..Task::of(scene) })
    }

    fn text(&self, key: &'static str) -> Result<Option<&str>, SettingError> {
        match self.0.get(key) {
            None => Ok(None),
            Some(toml::Value::String(text)) => Ok(Some(text)),
            Some(_) => Err(SettingError::NoText(key)),
        }
    }

    /// Opens the scenes and finds the frames. `opened` returns a scene that is open already.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn open(
        &self,
        opened: &dyn Fn(&str) -> Option<Arc<dyn Scene>>,
    ) -> Result<OpenSetting, SettingError> {
        let task = self.task()?;
        let query = self.text("query")?.ok_or(SettingError::Missing("query"))?;
        let scenes = task.open(opened)?;
        let references = task.protocol.named_references();
        Ok(OpenSetting {
            query: scenes.queries.find(query)?,
            references: references
                .map(|name| scenes.references.find(name))
                .collect::<Result<_, _>>()?,
            task,
            scenes,
        })
    }
}
