//! A survey of a map: its own frames are localised in it, each left out, and show how far confidence can be trusted
//! there.
//!
//! A survey is a few evaluations, each in a run folder of its own, so that it can be resumed, and every photo can be
//! looked at: photos near a reference, the same in worse light if asked for, photos far from their reference, and
//! mirrored ones, which no pose fits. [`Survey`] says what is fitted to them.

mod answers;
mod fit;
mod page;
mod parts;
mod places;
mod prediction;

use std::collections::BTreeMap;
use std::path::PathBuf;

use posescope_core::files::write_whole;
use posescope_core::survey::Survey;

use crate::estimator;
use crate::image::Degradation;
use crate::method::Method;
use crate::run::{
    Evaluation, EvaluationRequest, FolderError, Judging, Plan, PlanError, Poses, Protocol,
    ProtocolError, RunError, RunFolder, SurveyError, SurveyFile, read_results,
};
use crate::scene::{self, Scene, SceneError, SceneSize};
use crate::sink::{Follower, RunRecords};

pub use answers::{Part, Surveyed};
pub use prediction::{Prediction, Tried};

use answers::Answer;
use parts::Pairs;

/// The name of the table of places in the folder of a survey.
pub const PLACES: &str = "places.csv";

/// The name of the page in the folder of a survey.
pub const SURVEY_PAGE: &str = "survey.html";

/// What is surveyed.
#[derive(Clone, Debug)]
pub struct SurveyRequest {
    /// The scene, as an argument.
    pub scene: String,
    /// Its format; detected without one.
    pub format: Option<String>,
    /// The methods. A hybrid stands for the two that it runs.
    pub methods: Vec<Method>,
    /// How far from a reference photos are searched \[m\]; by default what the scene has.
    pub radius_m: Option<f64>,
    /// The least distance of a photo from its reference \[m\]; without one, any frame within the radius may be its
    /// reference.
    pub spacing_m: Option<f64>,
    /// How many photos are localised near a reference. A fifth as many are localised far from one, and as many mirrored.
    pub queries: usize,
    /// Degrades the photos near a reference, in a part of its own.
    pub degrade: Degradation,
    /// The seed of every random choice.
    pub seed: u64,
    /// A TOML file of parameters, or `paper`.
    pub config: Option<PathBuf>,
    /// Parameters, each as `KEY=VALUE`.
    pub assignments: Vec<String>,
    /// The folder of the survey.
    pub out: PathBuf,
}

/// Why there is no survey.
#[derive(Debug, thiserror::Error)]
pub enum SurveyingError {
    /// The evaluations cannot start.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// They stopped.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Their results cannot be read, or the page cannot be written.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The numbers cannot be written.
    #[error(transparent)]
    Survey(#[from] SurveyError),
    /// No photo has a reference near it.
    #[error(
        "{scene}: no frame has another with a known pose and a cloud within {reach}; survey it with a larger --radius"
    )]
    Alone {
        /// The scene.
        scene: String,
        /// The distances that were looked at, with their unit.
        reach: String,
    },
}

impl From<SceneError> for SurveyingError {
    fn from(error: SceneError) -> Self {
        Self::Plan(error.into())
    }
}

/// The evaluations of a survey.
pub struct SurveyPlan {
    request: SurveyRequest,
    scene: Box<dyn Scene>,
    radius_m: f64,
    parts: Vec<(Part, Plan)>,
}

/// What a survey found.
pub struct Found {
    /// What is kept.
    pub file: SurveyFile,
    /// By method, in the order of the registry.
    pub methods: Vec<Surveyed>,
    /// The page.
    pub page: PathBuf,
    /// Where later runs find the numbers by themselves.
    pub kept: Option<PathBuf>,
}

impl SurveyPlan {
    /// Chooses the photos and their references.
    ///
    /// # Errors
    /// [`SurveyingError`]: whatever would fail after the first photo and can be known before.
    pub fn of(request: SurveyRequest) -> Result<Self, SurveyingError> {
        let scene = scene::open(&request.scene, request.format.as_deref())?;
        let size = SceneSize::of(scene.as_ref());
        let radius_m = request.radius_m.unwrap_or_else(|| size.radius_m());
        let pairs = parts::choose(scene.as_ref(), radius_m, &request);
        if !pairs.contains_key(&Part::Near) {
            let unit = size.scale.unit();
            let from = request.spacing_m.map_or(String::new(), |least| format!("{least} to "));
            let reach = unit.words(&format!("{from}{radius_m} m"));
            return Err(SurveyingError::Alone { scene: scene.name().to_owned(), reach });
        }
        let mut parts = Vec::new();
        for (part, pairs) in pairs {
            parts.push((part, request.plan(part, &pairs, radius_m)?));
        }
        Ok(Self { request, scene, radius_m, parts })
    }

    /// How many photos are localised in all.
    pub fn queries(&self) -> usize {
        self.parts.iter().map(|(_, plan)| plan.run.items().count()).sum()
    }

    /// Localises the photos. Says how many were done already.
    ///
    /// # Errors
    /// [`SurveyingError`]. What is finished stays, and the survey can be resumed.
    pub fn run(
        &self,
        is_resumed: bool,
        follower: &mut dyn Follower,
        already: &mut dyn FnMut(usize),
    ) -> Result<(), SurveyingError> {
        for (part, plan) in &self.parts {
            let path = self.request.folder(*part);
            let folder = if is_resumed { RunFolder::resume } else { RunFolder::create };
            let mut folder = folder(&path, &plan.run)?;
            already(folder.done() - folder.unread().len());
            let mut records = RunRecords::new(0, &folder, plan, None, follower)?;
            Evaluation::run(plan, &mut folder, &mut records)?;
        }
        Ok(())
    }

    /// Fits what the results show, and writes `survey.toml`, `survey.html` and `places.csv`.
    ///
    /// # Errors
    /// [`SurveyingError`].
    pub fn found(&self) -> Result<Found, SurveyingError> {
        let scene = self.scene.as_ref();
        let mut answers = Vec::new();
        for (part, plan) in &self.parts {
            let results = read_results(&self.request.folder(*part), &plan.run)?;
            let answers_of = results.into_iter().map(|result| Answer::of(*part, result, scene));
            answers.extend(answers_of);
        }
        let is_paper = self.parts.first().is_some_and(|(_, plan)| plan.params.scale.is_paper());
        let methods: Vec<Surveyed> = self
            .request
            .methods()
            .into_iter()
            .map(|method| Surveyed::of(method, &answers, is_paper))
            .collect();
        let fitted = methods.iter().filter_map(|one| Some((one.method, one.numbers?)));
        let survey: Survey = fitted.collect();
        let poses: BTreeMap<String, Poses> = methods
            .iter()
            .filter(|one| one.numbers.is_some())
            .map(|one| (one.method.name().to_owned(), one.poses()))
            .collect();
        let file = SurveyFile::of(scene, self.queries(), self.radius_m, poses, survey);
        let page = self.request.out.join(SURVEY_PAGE);
        let places = places::predicted(scene, self.radius_m, self.request.spacing_m, &methods);
        let html = page::page(scene, &self.request, self.radius_m, &methods, &answers, &places);
        write_whole(&page, html.as_bytes()).map_err(FolderError::io(&page))?;
        let table = self.request.out.join(PLACES);
        write_whole(&table, places::table(&places).to_csv().as_bytes())
            .map_err(FolderError::io(&table))?;
        let kept = file.write(&self.request.out, scene, &self.request.scene)?;
        Ok(Found { file, methods, page, kept })
    }
}

impl SurveyRequest {
    /// How many photos are localised near a reference by default. With the default methods, that takes some minutes on
    /// two cores.
    pub const QUERIES: usize = 100;

    /// The methods by default: those whose poses are most often trusted.
    pub const METHODS: [Method; 3] = [Method::FB, Method::named("fb2"), Method::named("robust")];

    /// The run folder of a part.
    fn folder(&self, part: Part) -> PathBuf {
        self.out.join(part.name())
    }

    /// The methods that make the poses, each once, in the order of the registry.
    fn methods(&self) -> Vec<Method> {
        let parts = |method: Method| match estimator::find(method).and_then(|one| one.hybrid()) {
            Some(hybrid) => vec![hybrid.first, hybrid.second],
            None => vec![method],
        };
        let asked: Vec<Method> = self.methods.iter().copied().flat_map(parts).collect();
        estimator::methods().filter(|method| asked.contains(method)).collect()
    }

    /// The evaluation of a part.
    fn plan(&self, part: Part, pairs: &Pairs, radius_m: f64) -> Result<Plan, PlanError> {
        let mut degrade = Degradation::default();
        match part {
            Part::Near | Part::Far => {}
            Part::Worse => degrade = self.degrade,
            Part::Mirrored => degrade.mirror = true,
        }
        let protocol = |defaults: Protocol| -> Result<Protocol, ProtocolError> {
            let protocol = Protocol {
                methods: self.methods(),
                radii_m: vec![radius_m],
                format: self.format.clone(),
                seed: self.seed,
                degrade,
                ..defaults
            };
            protocol.checked()
        };
        let queries: Vec<String> = pairs.keys().cloned().collect();
        Plan::of(&EvaluationRequest {
            scenes: std::slice::from_ref(&self.scene),
            queries: &queries,
            pairs,
            protocol: &protocol,
            config: self.config.as_deref(),
            assignments: &self.assignments,
            shard: None,
            rerun_failed: None,
            judging: &Judging::default(),
            is_survey: true,
            folder: &self.folder(part),
            events: None,
        })
    }
}
