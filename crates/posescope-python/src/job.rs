//! One localisation: its inputs, and its run with an observer. The same job gives the same result.

use std::sync::Arc;

use posescope::diagnosis::Tolerance;
use posescope::foreign::Foreign;
use posescope::localize::{LocalizeError, LocalizeObserver, Localizer, QueryResult, Request};
use posescope::run::Protocol;
use posescope::scene::{FrameStore, LoosePhotos, Scene, SceneSize};
use posescope::sink::SceneNames;
use posescope::sink::rerun::Identity;
use posescope_core::{InputError, Method, Params, Pose, ReferenceTuple};

use crate::frames;
use crate::held::{Held, HeldFrame};

/// The scenes of a query and its references, which may be one.
pub struct Frames {
    /// The scene of the references.
    pub references: Arc<dyn Scene>,
    /// The references, as positions in their scene.
    pub chosen: Vec<usize>,
    /// The scene of the query.
    pub queries: Arc<dyn Scene>,
    /// The query, as its position in its scene.
    pub query: usize,
    /// The size of the references' scene.
    pub size: SceneSize,
    /// Where frames of opened scenes are kept.
    store: Option<Arc<FrameStore>>,
}

impl Frames {
    /// The frames of scenes as those, all others as scenes of what is held.
    ///
    /// # Errors
    /// A camera or photo that cannot be used.
    pub fn of(
        query: &frames::Query,
        references: &[&frames::Reference],
        truth: Option<&Pose>,
    ) -> Result<Self, InputError> {
        let opened = references.first().and_then(|first| first.origin.as_ref());
        let opened = opened.map(|origin| &origin.opened).filter(|opened| {
            references.iter().all(|one| {
                one.origin.as_ref().is_some_and(|origin| Arc::ptr_eq(&origin.opened, opened))
            })
        });
        let (scene, chosen, size): (Arc<dyn Scene>, Vec<usize>, SceneSize) = match opened {
            Some(opened) => {
                let origins = references.iter().filter_map(|one| one.origin.as_ref());
                let frames = origins.map(|origin| origin.frame).collect();
                (Arc::clone(&opened.scene), frames, opened.size())
            }
            None => {
                let scene = Held::new(Held::ARRAYS, named_apart(references)?);
                (Arc::new(scene), (0..references.len()).collect(), SceneSize::PAPER)
            }
        };
        let (queries, at) = match &query.origin {
            Some(origin) if truth.is_none() => (Arc::clone(&origin.opened.scene), origin.frame),
            origin => {
                let name =
                    origin.as_ref().map_or(LoosePhotos::NAME, |origin| origin.opened.scene.name());
                let pose = truth.copied().or(query.truth);
                let frame = HeldFrame { query: Arc::clone(&query.query), pose, reference: None };
                let held: Arc<dyn Scene> = Arc::new(Held::new(name, vec![frame]));
                (held, 0)
            }
        };
        Ok(Self {
            references: scene,
            chosen,
            queries,
            query: at,
            size,
            store: opened.map(|opened| Arc::clone(&opened.store)),
        })
    }

    /// The names of the scenes in events.
    pub fn scene_names(&self) -> SceneNames {
        let name = |scene: &Arc<dyn Scene>| scene.name().to_owned();
        let references = name(&self.references);
        SceneNames {
            query: Some(name(&self.queries)).filter(|query| *query != references),
            references,
        }
    }
}

/// The references as frames with names of their own.
fn named_apart(references: &[&frames::Reference]) -> Result<Vec<HeldFrame>, InputError> {
    let mut names: Vec<String> = Vec::new();
    let mut held = Vec::new();
    for one in references {
        let wanted = one.reference.name();
        let numbered = (2..).map(|number| format!("{wanted}-{number}"));
        let mut free = [wanted.to_owned()].into_iter().chain(numbered);
        let name = free.find(|name| !names.contains(name)).unwrap_or_else(|| wanted.to_owned());
        names.push(name.clone());
        let reference = ReferenceTuple::clone(&one.reference).with_name(name);
        held.push(HeldFrame::of_reference(&Arc::new(reference))?);
    }
    Ok(held)
}

/// A query, its references, and how it is localised.
pub struct Job {
    /// The frames.
    pub frames: Frames,
    /// What is asked.
    pub request: Request,
    /// The method.
    pub method: Method,
    /// The parameters.
    pub params: Params,
    /// The seed of every random choice.
    pub seed: u64,
    /// The largest error of a right pose.
    pub right: Tolerance,
    /// How many variations of a wrong result are tried.
    pub explain: usize,
    /// Poses and matches of another system.
    pub foreign: Foreign,
}

impl Job {
    /// The true pose of the query.
    pub fn truth(&self) -> Option<Pose> {
        self.frames.queries.pose(self.frames.query)
    }

    /// Localises the query.
    ///
    /// # Errors
    /// A frame that cannot be read, and a run that its observer stopped.
    pub fn run(&self, observer: &mut dyn LocalizeObserver) -> Result<QueryResult, LocalizeError> {
        // Of frames that Python holds nothing is kept, so that a result stays small.
        self.run_with(&self.frames.store.clone().unwrap_or_default(), self.explain, observer)
    }

    /// Localises the query as if nothing were cached: the events are those of the command.
    ///
    /// # Errors
    /// Those of [`Self::run`].
    pub fn watch(&self, observer: &mut dyn LocalizeObserver) -> Result<QueryResult, LocalizeError> {
        self.run_with(&Arc::default(), 0, observer)
    }

    fn run_with(
        &self,
        store: &Arc<FrameStore>,
        explain: usize,
        observer: &mut dyn LocalizeObserver,
    ) -> Result<QueryResult, LocalizeError> {
        let Frames { references, queries, query, .. } = &self.frames;
        let scenes = (store.of(references), store.of(queries));
        let localizer = Localizer::with_cached_scenes(scenes, &self.params, self.seed)
            .with_foreign(self.foreign.clone())
            .with_tolerance(self.right)
            .explaining(explain);
        let mut found = None;
        localizer.localize(
            0,
            *query,
            std::slice::from_ref(&self.request),
            &[self.method],
            observer,
            |result, _| {
                found = Some(result);
                Ok::<(), LocalizeError>(())
            },
        )?;
        let scene = references.name();
        let missing = || posescope::scene::SceneError::expected(scene, "a reference expected");
        Ok(found.ok_or_else(missing)?)
    }

    /// The identity of its recording.
    pub fn identity(&self) -> Identity {
        let Frames { references, queries, query, chosen, .. } = &self.frames;
        let protocol = Protocol { seed: self.seed, ..Protocol::default() };
        let named = chosen.iter().map(|&frame| references.frames()[frame].clone());
        Identity {
            queries: vec![queries.frames()[*query].clone()],
            references: named.collect(),
            ..Identity::of(references.as_ref(), queries.as_ref(), &self.params, &protocol)
        }
    }
}
