//! `survey.toml`: what a survey of a map found; and which survey the confidence of a run follows.

use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use posescope_core::diagnosis::confidence;
use posescope_core::files::{self, write_whole};
use posescope_core::survey::Survey;
use serde::{Deserialize, Serialize};

use crate::scene::{Scene, cache_file};

/// The name of the file in the folder of a survey.
const SURVEY_FILE: &str = "survey.toml";

/// The version of its format.
const SCHEMA: &str = "posescope.survey/1";

/// The argument of `--survey`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SurveyFrom {
    /// No survey: confidence as it was fitted on generated towns.
    Nowhere,
    /// The folder of a survey.
    Folder(PathBuf),
}

impl FromStr for SurveyFrom {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "none" => Ok(Self::Nowhere),
            "" => Err("the folder of a survey, or none, expected".to_owned()),
            folder => Ok(Self::Folder(folder.into())),
        }
    }
}

impl fmt::Display for SurveyFrom {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Nowhere => f.write_str("none"),
            Self::Folder(folder) => folder.display().fmt(f),
        }
    }
}

posescope_core::serde_as_text!(SurveyFrom);

/// What a survey of a map found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurveyFile {
    schema: String,
    /// The version of posescope.
    version: String,
    /// The scene.
    pub scene: String,
    /// What its frames, poses and cameras are.
    fingerprint: String,
    /// What the numbers move: the confidence as it was fitted.
    fitted: String,
    /// How many photos were localised.
    pub queries: usize,
    /// How far from a reference they were searched \[m, or the unit of the scene\].
    pub radius: f64,
    /// How many poses each method's numbers rest on.
    pub poses: BTreeMap<String, Poses>,
    /// The numbers, by method.
    pub survey: Survey,
}

/// The poses that the numbers of a method rest on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Poses {
    /// Those that are right.
    pub right: usize,
    /// Those that are wrong.
    pub wrong: usize,
}

/// Why a survey cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SurveyError {
    /// The file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: io::Error,
    },
    /// The file is no survey.
    #[error("{}: {message}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// It is of another map, or of an earlier state of this one.
    #[error("{}: {why}; make it again with `{command}`", path.display())]
    Stale {
        /// The file.
        path: PathBuf,
        /// What has changed.
        why: String,
        /// The command that makes it again.
        command: String,
    },
    /// A survey is of one map.
    #[error("--survey takes one scene of references, and there are {0}; evaluate each by itself")]
    Scenes(usize),
}

impl SurveyFile {
    /// The description of a survey of this scene.
    pub fn of(
        scene: &dyn Scene,
        queries: usize,
        radius: f64,
        methods: BTreeMap<String, Poses>,
        survey: Survey,
    ) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            scene: scene.name().to_owned(),
            fingerprint: fingerprint(scene),
            fitted: confidence::fit().to_owned(),
            queries,
            radius,
            poses: methods,
            survey,
        }
    }

    /// Reads the file in the folder of a survey.
    ///
    /// # Errors
    /// [`SurveyError::Io`] and [`SurveyError::Damaged`].
    pub fn read(path: &Path) -> Result<Self, SurveyError> {
        let text = files::read_text(path, files::DESCRIPTION)
            .map_err(|source| SurveyError::Io { path: path.to_owned(), source })?;
        let damaged = |message: String| SurveyError::Damaged { path: path.to_owned(), message };
        let file: Self = toml::from_str(&text).map_err(|error| {
            let line = error
                .span()
                .map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
            damaged(format!("line {line}: {}", error.message().replace('\n', " ")))
        })?;
        if file.schema != SCHEMA {
            return Err(damaged(format!("schema {SCHEMA} expected, {} found", file.schema)));
        }
        if !file.survey.is_sound() {
            return Err(damaged("finite numbers, and factors above 0, expected".to_owned()));
        }
        Ok(file)
    }

    /// Writes `survey.toml` into a folder, and a copy to where runs find it. Returns the path of the copy; `None` where
    /// there is no cache.
    ///
    /// # Errors
    /// [`SurveyError::Io`].
    pub fn write(
        &self,
        folder: &Path,
        scene: &dyn Scene,
        argument: &str,
    ) -> Result<Option<PathBuf>, SurveyError> {
        let text = toml::to_string(self);
        let text = text.unwrap_or_else(|error| unreachable!("every field has a form: {error}"));
        let write = |path: &Path| {
            let parent = path.parent().map_or(Ok(()), std::fs::create_dir_all);
            parent
                .and_then(|()| write_whole(path, text.as_bytes()))
                .map_err(|source| SurveyError::Io { path: path.to_owned(), source })
        };
        write(&folder.join(SURVEY_FILE))?;
        let copy = cached(scene, argument);
        copy.as_deref().map_or(Ok(()), write)?;
        Ok(copy)
    }

    /// Refuses the survey of another map.
    fn check(&self, path: &Path, scene: &dyn Scene, argument: &str) -> Result<(), SurveyError> {
        let why = if self.fitted != confidence::fit() {
            "this version of posescope fits confidence in another way"
        } else if self.fingerprint != fingerprint(scene) {
            "the survey is of another map, or frames, poses or cameras have changed since"
        } else {
            return Ok(());
        };
        let (path, why) = (path.to_owned(), why.to_owned());
        let command = format!("posescope survey {argument}");
        Err(SurveyError::Stale { path, why, command })
    }
}

fn fingerprint(scene: &dyn Scene) -> String {
    format!("{:016x}", scene.fingerprint())
}

/// Where the survey of a scene lies that runs find by themselves.
fn cached(scene: &dyn Scene, argument: &str) -> Option<PathBuf> {
    cache_file("survey", "toml", scene, argument)
}

/// The survey that confidence follows in a scene: the named one, or without a name the last that was made of it. A
/// named survey must fit. Another that does not is left out with a warning.
///
/// # Errors
/// [`SurveyError`] of a named survey.
pub fn survey_of(
    from: Option<&SurveyFrom>,
    scene: &dyn Scene,
    argument: &str,
) -> Result<Option<SurveyFile>, SurveyError> {
    let fitting = |path: &Path| {
        let file = SurveyFile::read(path)?;
        file.check(path, scene, argument)?;
        Ok(file)
    };
    match from {
        Some(SurveyFrom::Nowhere) => Ok(None),
        Some(SurveyFrom::Folder(folder)) => fitting(&folder.join(SURVEY_FILE)).map(Some),
        None => {
            let Some(path) = cached(scene, argument).filter(|path| path.is_file()) else {
                return Ok(None);
            };
            let found = fitting(&path);
            if let Err(error) = &found {
                log::warn!("{error}; until then, confidence is as without a survey");
            }
            Ok(found.ok())
        }
    }
}

/// Which survey a run follows, in one line.
pub fn survey_line(file: &SurveyFile) -> String {
    format!(
        "Confidence follows the survey of this map with {} photos; --survey none leaves it out",
        file.queries
    )
}
