//! The settings of a lesson.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::Deserialize as _;
use toml::Spanned;

use crate::describe::ParamError;
use crate::params::Params;
use crate::run::Protocol;
use crate::scene::{Scene, SceneError};
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

    /// The job of the setting, with its scenes opened and a cache of frames of its own. `opened` returns a scene that
    /// is open already.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn open(
        &self,
        opened: &dyn Fn(&str) -> Option<Arc<dyn Scene>>,
    ) -> Result<Job, SettingError> {
        let task = self.task()?;
        let query = self.text("query")?.ok_or(SettingError::Missing("query"))?;
        let TaskScenes { references, queries } = task.open(opened)?;
        let query = queries.find(query)?;
        let named = task.protocol.named_references().map(|name| references.find(name));
        Ok(Job {
            query,
            chosen: named.collect::<Result<Vec<_>, _>>()?.into(),
            index: Arc::new(IndexFile::of(&task)),
            frames: Arc::default(),
            references,
            queries,
            task,
        })
    }
}
