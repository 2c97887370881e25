//! Where a recording goes, and what it is known by.

use std::path::{Path, PathBuf};

use rerun::external::re_uri::RedapUri;
use rerun::sink::{GrpcSink, LogSink};
use rerun::{DEFAULT_CONNECT_URL, SpawnError, SpawnOptions};
use xxhash_rust::xxh3::xxh3_128;

use super::error::RecordError;
use super::file::RecordingFile;
use super::viewer::Viewer;
use crate::image::Degradation;
use crate::params::Params;
use crate::run::Protocol;
use crate::scene::Scene;

/// Where a recording goes. All of them can be combined; none is a recording that nobody keeps.
#[derive(Clone, Debug, Default)]
pub struct Targets {
    /// A file to save to.
    pub save: Option<PathBuf>,
    /// The URL of a running viewer, empty for a local one.
    pub connect: Option<String>,
    /// Whether to start a viewer.
    pub spawn: bool,
}

impl Targets {
    /// A file alone.
    pub fn file(path: &Path) -> Self {
        Self {
            save: Some(path.to_owned()),
            ..Self::default()
        }
    }
}

/// What the stable id of a recording follows from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Identity {
    /// The scene's name.
    pub scene: String,
    /// The name of the queries' scene, where it is another one.
    pub query_scene: Option<String>,
    /// The query frames' names.
    pub queries: Vec<String>,
    /// The reference frames' names.
    pub references: Vec<String>,
    /// The configuration, as TOML.
    pub configuration: String,
    /// What was done to the photos of the queries before.
    pub degraded: Degradation,
    /// The seed of every random choice.
    pub seed: u64,
}

impl Identity {
    /// That of a run between two scenes, some of whose frames the caller names.
    pub fn of(
        references: &dyn Scene,
        queries: &dyn Scene,
        params: &Params,
        protocol: &Protocol,
    ) -> Self {
        let (scene, query_scene) = (references.name(), queries.name());
        Self {
            scene: scene.to_owned(),
            query_scene: (query_scene != scene).then(|| query_scene.to_owned()),
            configuration: params.to_toml(),
            degraded: protocol.degrade,
            seed: protocol.seed,
            ..Self::default()
        }
    }

    /// A query's name, with its scene where there are two: frames of both may be called alike.
    pub fn query_label(&self, name: &str) -> String {
        match &self.query_scene {
            Some(scene) => format!("{scene} {name}"),
            None => name.to_owned(),
        }
    }

    /// A reference's name, with its scene where there are two.
    pub fn reference_label(&self, name: &str) -> String {
        match &self.query_scene {
            Some(_) => format!("{} {name}", self.scene),
            None => name.to_owned(),
        }
    }

    /// What a viewer calls the recording.
    pub fn recording_name(&self) -> String {
        let queries = self.queries.join(" ");
        match &self.query_scene {
            Some(scene) => {
                let references = self.references.join(" ");
                format!("{scene} {queries} ← {} {references}", self.scene)
            }
            None => format!("{} {queries}", self.scene),
        }
    }

    /// The recording id: equal for equal runs, whenever and wherever they are made.
    pub fn recording_id(&self) -> String {
        // The debug form quotes every string, so that no two identities are spelled alike.
        format!("{:032x}", xxh3_128(format!("{self:?}").as_bytes()))
    }
}

/// Targets that are ready to be written to.
pub(super) struct OpenTargets {
    /// The sinks that get every message.
    pub(super) sinks: Vec<Box<dyn LogSink>>,
    /// The file among them, which can also tell what became of it.
    pub(super) file: Option<RecordingFile>,
}

impl Targets {
    /// Whether there is no target at all.
    pub fn is_none(&self) -> bool {
        self.save.is_none() && self.connect.is_none() && !self.spawn
    }

    /// Opens all targets.
    pub(super) fn open(&self) -> Result<OpenTargets, RecordError> {
        let mut sinks: Vec<Box<dyn LogSink>> = Vec::new();
        let file = match &self.save {
            Some(path) => Some(RecordingFile::create(path)?),
            None => None,
        };
        if let Some(file) = &file {
            sinks.push(Box::new(file.clone()));
        }
        if let Some(url) = &self.connect {
            sinks.push(Box::new(connect(url)?));
        }
        if self.spawn {
            sinks.push(Box::new(spawn()?));
        }
        Ok(OpenTargets { sinks, file })
    }
}

fn connect(url: &str) -> Result<Viewer, RecordError> {
    let url = if url.is_empty() {
        DEFAULT_CONNECT_URL
    } else {
        url
    };
    let refused = |message: String| RecordError::Address {
        url: url.to_owned(),
        message,
    };
    match url.parse() {
        Ok(RedapUri::Proxy(uri)) => Ok(Viewer::new(GrpcSink::new(uri))),
        Ok(_) => Err(refused("the URL of a viewer ends in /proxy".to_owned())),
        Err(error) => Err(refused(error.to_string())),
    }
}

fn spawn() -> Result<Viewer, RecordError> {
    let options = SpawnOptions {
        hide_welcome_screen: true,
        ..SpawnOptions::default()
    };
    let viewer = rerun::spawn(&options).map_err(|error| {
        RecordError::Spawn(match error {
            // Rerun's own message is a page long.
            SpawnError::ExecutableNotFoundInPath {
                executable_name, ..
            } => format!(
                "there is no `{executable_name}` in the PATH (`pip install rerun-sdk` brings it)"
            ),
            other => other.to_string(),
        })
    })?;
    connect(&format!("rerun+http://127.0.0.1:{}/proxy", viewer.port))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_recording_id_follows_from_every_part_of_the_identity_and_nothing_else() {
        let identity = Identity {
            scene: "street".to_owned(),
            queries: vec!["a".to_owned(), "b".to_owned()],
            ..Identity::default()
        };
        let id = identity.recording_id();
        assert_eq!(id, identity.clone().recording_id());
        let mut other = identity.clone();
        other.queries = vec!["a, b".to_owned()];
        assert_ne!(id, other.recording_id());
        other = identity.clone();
        other.seed = 1;
        assert_ne!(id, other.recording_id());
        other = identity.clone();
        other.degraded = "invert".parse().expect("a degradation");
        assert_ne!(id, other.recording_id());
    }

    #[test]
    fn what_cannot_be_opened_is_named_in_one_line() {
        let line = |targets: Targets| match targets.open() {
            Ok(_) => unreachable!("the target is no good"),
            Err(error) => error.to_string(),
        };
        let nowhere = line(Targets {
            save: Some(PathBuf::from("/nonexistent/run.rrd")),
            ..Targets::default()
        });
        assert!(
            nowhere.starts_with("cannot create the recording /nonexistent/run.rrd: "),
            "{nowhere}"
        );
        let elsewhere = line(Targets {
            connect: Some("http://example.org".to_owned()),
            ..Targets::default()
        });
        assert!(
            elsewhere.starts_with("cannot connect to `http://example.org`: "),
            "{elsewhere}"
        );
        assert!(!nowhere.contains('\n') && !elsewhere.contains('\n'));
    }
}
