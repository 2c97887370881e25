//! The targets of a recording, and its identity.

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

/// The targets of a recording, which can be combined.
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
    /// Only a file.
    pub fn file(path: &Path) -> Self {
        Self { save: Some(path.to_owned()), ..Self::default() }
    }

    /// Whether there is no target at all.
    pub fn is_none(&self) -> bool {
        self.save.is_none() && self.connect.is_none() && !self.spawn
    }

    /// Opens all targets.
    pub(super) fn open(&self) -> Result<OpenTargets, RecordError> {
        let mut sinks: Vec<Box<dyn LogSink>> = Vec::new();
        let file = self.save.as_deref().map(RecordingFile::create).transpose()?;
        if let Some(file) = &file {
            sinks.push(Box::new(file.clone()));
        }
        if let Some(url) = &self.connect {
            sinks.push(Box::new(connect(url)?));
        }
        if self.spawn {
            sinks.push(Box::new(spawn()?));
        }
        Ok((sinks, file))
    }
}

/// The data that the stable id of a recording is derived from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Identity {
    /// The scene's name.
    pub scene: String,
    /// The name of the queries' scene, if it is another one.
    pub query_scene: Option<String>,
    /// The query frames' names.
    pub queries: Vec<String>,
    /// The reference frames' names.
    pub references: Vec<String>,
    /// The configuration, as TOML.
    pub configuration: String,
    /// The degradation of the query photos.
    pub degraded: Degradation,
    /// The seed of every random choice.
    pub seed: u64,
}

impl Identity {
    /// The identity of a run between two scenes, without the frames, which the caller adds.
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

    /// A query's name, with its scene if there are two, which may share names.
    pub fn query_label(&self, name: &str) -> String {
        match &self.query_scene {
            Some(scene) => format!("{scene} {name}"),
            None => name.to_owned(),
        }
    }

    /// A reference's name, with its scene if there are two.
    pub fn reference_label(&self, name: &str) -> String {
        match &self.query_scene {
            Some(_) => format!("{} {name}", self.scene),
            None => name.to_owned(),
        }
    }

    /// The name of the recording in a viewer.
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

    /// The recording id: the same for the same run at any time and place.
    pub fn recording_id(&self) -> String {
        // The debug form quotes every string, so different identities have different texts.
        format!("{:032x}", xxh3_128(format!("{self:?}").as_bytes()))
    }
}

/// The sinks of all targets, and the file among them, which also reports its errors.
pub(super) type OpenTargets = (Vec<Box<dyn LogSink>>, Option<RecordingFile>);

fn connect(url: &str) -> Result<Viewer, RecordError> {
    let url = if url.is_empty() { DEFAULT_CONNECT_URL } else { url };
    let refused = |message: String| RecordError::Address { url: url.to_owned(), message };
    match url.parse() {
        Ok(RedapUri::Proxy(uri)) => Ok(Viewer::new(GrpcSink::new(uri))),
        Ok(_) => Err(refused("the URL of a viewer ends in /proxy".to_owned())),
        Err(error) => Err(refused(error.to_string())),
    }
}

fn spawn() -> Result<Viewer, RecordError> {
    let options = SpawnOptions { hide_welcome_screen: true, ..SpawnOptions::default() };
    let viewer = rerun::spawn(&options).map_err(|error| {
        RecordError::Spawn(match error {
            // Rerun's own message is a page long.
            SpawnError::ExecutableNotFoundInPath {
                executable_name, ..
            } => format!(
                "there is no `{executable_name}` in the PATH; install it with `pip install rerun-sdk`"
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
        let elsewhere =
            line(Targets { connect: Some("http://example.org".to_owned()), ..Targets::default() });
        assert!(elsewhere.starts_with("cannot connect to `http://example.org`: "), "{elsewhere}");
        assert!(!nowhere.contains('\n') && !elsewhere.contains('\n'));
    }
}
