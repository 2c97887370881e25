//! What a lesson localises.

use std::sync::Arc;

use serde::Deserialize;

use crate::describe::ParamError;
use crate::fusion::Fusion;
use crate::image::Degradation;
use crate::localize::Selection;
use crate::method::Method;
use crate::params::Params;
use crate::run::Protocol;
use crate::scene::{FrameStore, Scene, SceneError};
use crate::session::{IndexFile, Job, Task, TaskScenes};

/// What is localised: the fields of a lesson's header and of its variants. What is not said is as the
/// commands have it by default.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Setting {
    /// The scene of the references.
    pub scene: Option<String>,
    /// The scene of the query, if it is another one.
    pub queries: Option<String>,
    /// The query frame.
    pub query: Option<String>,
    /// The reference frames.
    pub references: Option<Vec<String>>,
    /// How references are chosen where none are named.
    pub choose: Option<Selection>,
    /// The methods.
    pub methods: Option<Vec<Method>>,
    /// How several references are fused.
    pub fusions: Option<Vec<Fusion>>,
    /// The uncertainty radius \[m\].
    pub radius_m: Option<f64>,
    /// How far from the truth the query's position is known \[m\].
    pub prior_m: Option<f64>,
    /// The seed.
    pub seed: Option<u64>,
    /// What is done to the query's photo, as `--degrade` takes it.
    pub degrade: Option<Degradation>,
    /// Parameters, as `--set` takes them.
    pub set: Option<Vec<String>>,
}

/// A setting that cannot be followed.
#[derive(Debug, thiserror::Error)]
pub enum SettingError {
    /// A field that must be said.
    #[error("the header says no `{0}`")]
    Missing(&'static str),
    /// A parameter that there is not.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// A scene or a frame that there is not.
    #[error(transparent)]
    Scene(#[from] SceneError),
}

/// A setting with its scenes opened.
#[derive(Clone)]
pub struct OpenSetting {
    /// What is asked.
    pub task: Task,
    /// The scenes.
    pub scenes: TaskScenes,
    /// The query's position in its scene.
    pub query: usize,
    /// The references' positions in theirs; none where they are to be chosen.
    pub references: Vec<usize>,
}

impl OpenSetting {
    /// The scenes by the names that the setting calls them.
    pub fn named_scenes(&self) -> Vec<(String, Arc<dyn Scene>)> {
        named_scenes(&self.task, &self.scenes.references, &self.scenes.queries)
    }

    /// The work of localising it, with these frames at hand.
    pub fn job(&self, frames: &Arc<FrameStore>) -> Job {
        Job {
            references: Arc::clone(&self.scenes.references),
            queries: Arc::clone(&self.scenes.queries),
            query: self.query,
            chosen: self.references.clone().into(),
            task: self.task.clone(),
            index: Arc::new(IndexFile::new(&self.task.scene, None)),
            frames: Arc::clone(frames),
        }
    }
}

/// The scenes of a task by the names that it calls them. Where queries have no scene of their own, theirs
/// is that of the references, perhaps with degraded photos, and has no name.
pub fn named_scenes(
    task: &Task,
    references: &Arc<dyn Scene>,
    queries: &Arc<dyn Scene>,
) -> Vec<(String, Arc<dyn Scene>)> {
    let own = task.queries.iter();
    let own = own.map(|name| (name.clone(), Arc::clone(queries)));
    own.chain([(task.scene.clone(), Arc::clone(references))])
        .collect()
}

impl Setting {
    /// This setting where it says something, elsewhere `base`.
    pub(super) fn over(&self, base: &Self) -> Self {
        let (own, base) = (self.clone(), base.clone());
        Self {
            scene: own.scene.or(base.scene),
            queries: own.queries.or(base.queries),
            query: own.query.or(base.query),
            references: own.references.or(base.references),
            choose: own.choose.or(base.choose),
            methods: own.methods.or(base.methods),
            fusions: own.fusions.or(base.fusions),
            radius_m: own.radius_m.or(base.radius_m),
            prior_m: own.prior_m.or(base.prior_m),
            seed: own.seed.or(base.seed),
            degrade: own.degrade.or(base.degrade),
            set: own.set.or(base.set),
        }
    }

    /// What is asked of posescope.
    ///
    /// # Errors
    /// No scene, or a parameter that there is not.
    pub fn task(&self) -> Result<Task, SettingError> {
        let scene = self.scene.clone().ok_or(SettingError::Missing("scene"))?;
        let default = Protocol::default();
        let mut params = Params::default();
        for assignment in self.set.iter().flatten() {
            params.assign(assignment)?;
        }
        Ok(Task {
            queries: self.queries.clone(),
            by_hand: self.references.is_some(),
            radius_m: self.radius_m.unwrap_or(Protocol::RADIUS_M),
            protocol: Protocol {
                references: self.choose.unwrap_or(default.references),
                methods: self.methods.clone().unwrap_or(default.methods),
                fusions: self.fusions.clone().unwrap_or_default(),
                prior_m: self.prior_m,
                seed: self.seed.unwrap_or_default(),
                degrade: self.degrade.unwrap_or_default(),
                ..default
            },
            params,
            ..Task::of(scene)
        })
    }

    /// Opens the scenes and finds the frames. `opened` may have a scene by its name already.
    ///
    /// # Errors
    /// [`SettingError`].
    pub fn open(
        &self,
        opened: &dyn Fn(&str) -> Option<Arc<dyn Scene>>,
    ) -> Result<OpenSetting, SettingError> {
        let task = self.task()?;
        let query = self.query.as_deref();
        let query = query.ok_or(SettingError::Missing("query"))?;
        let scenes = task.open(opened)?;
        let references = self.references.iter().flatten();
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
