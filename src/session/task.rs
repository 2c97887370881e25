//! What is asked, by `run`, by `view` and in the window: everything but the query.

use std::fmt::Display;
use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize, Serializer};

use super::breakpoint::Breakpoint;
use crate::diagnosis::Tolerance;
use crate::method::Method;
use crate::params::Params;
use crate::run::Protocol;
use crate::scene::{self, LoosePhotos, Scene, SceneError};

/// Where references and queries are, and how a query is localised. The command line turns into it,
/// the window and its sessions keep it, and [`Self::command_line`] writes it down again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// The scene of the references, as it is named on the command line.
    pub scene: String,
    /// The scene of the queries, if it is another one.
    pub queries: Option<String>,
    /// The format of both, where their content does not tell.
    pub format: Option<String>,
    /// Whether references are named by hand, rather than chosen as the protocol says.
    pub by_hand: bool,
    /// The index that a choice by looks asks; without it, the one in its usual place.
    pub index: Option<PathBuf>,
    /// How far the query may be from a reference \[m\].
    pub radius_m: f64,
    /// How references are chosen and queries localised.
    pub protocol: Protocol,
    /// Parameters of the estimators.
    #[serde(
        serialize_with = "write_params",
        deserialize_with = "posescope_core::text::parsed"
    )]
    pub params: Params,
    /// Where the run is to stop.
    pub breakpoints: Vec<Breakpoint>,
    /// Photos of no scene, which are the queries then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photos: Option<LoosePhotos>,
}

/// The scenes of a task, opened: that of the references and that of the queries, often the same.
#[derive(Clone)]
pub struct TaskScenes {
    /// Where the references are.
    pub references: Arc<dyn Scene>,
    /// Where the queries are.
    pub queries: Arc<dyn Scene>,
}

/// Writes the parameters as a configuration file, every one of them.
fn write_params<S: Serializer>(params: &Params, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&params.to_toml())
}

impl Task {
    /// What is asked of a scene where nobody says more.
    pub fn of(scene: impl Into<String>) -> Self {
        Self {
            scene: scene.into(),
            queries: None,
            format: None,
            by_hand: false,
            index: None,
            radius_m: Protocol::RADIUS_M,
            protocol: Protocol::default(),
            params: Params::default(),
            breakpoints: Vec::new(),
            photos: None,
        }
    }

    /// Opens the scenes. `opened` may have one by its argument already.
    ///
    /// # Errors
    /// A scene, a photo or a file of positions that cannot be read.
    pub fn open(
        &self,
        opened: &dyn Fn(&str) -> Option<Arc<dyn Scene>>,
    ) -> Result<TaskScenes, SceneError> {
        let open = |argument: &str| match opened(argument) {
            Some(scene) => Ok(scene),
            None => scene::open(argument, self.format.as_deref()).map(Arc::from),
        };
        let references = open(&self.scene)?;
        let queries = match (&self.photos, &self.queries) {
            (Some(photos), _) => photos.open()?,
            (None, Some(argument)) => open(argument)?,
            (None, None) => Arc::clone(&references),
        };
        Ok(TaskScenes {
            queries: self.protocol.as_asked(queries, references.as_ref())?,
            references,
        })
    }

    /// How far from a query's known position its references may be \[m\].
    pub fn reach_m(&self) -> f64 {
        self.protocol.reach_m(self.radius_m)
    }

    /// The arguments of `posescope` that ask the same of a query: `run`, the scene, the options.
    /// With `references`, against these frames; without, against those that the protocol chooses.
    pub fn arguments(&self, query: &str, references: &[String]) -> Vec<String> {
        let protocol = &self.protocol;
        let mut arguments = vec!["run".to_owned(), self.scene.clone()];
        let mut option = |name: &str, value: &dyn Display| {
            arguments.extend([format!("--{name}"), value.to_string()]);
        };
        if let Some(format) = &self.format {
            option("format", format);
        }
        if let Some(queries) = &self.queries {
            option("queries", queries);
        }
        match self
            .photos
            .as_ref()
            .and_then(|photos| photos.path_of(query))
        {
            Some(path) => option("query", &path.display()),
            None => option("query", &query),
        }
        if let Some(camera) = self
            .photos
            .as_ref()
            .and_then(|photos| photos.camera.as_ref())
        {
            option("camera", camera);
        }
        for reference in references {
            option("reference", reference);
        }
        if references.is_empty() {
            option("references", &protocol.references);
        }
        if let Some(index) = &self.index {
            option("index", &index.display());
        }
        option("radius", &self.radius_m);
        if let Some(prior_m) = protocol.prior_m {
            option("prior", &prior_m);
        }
        let ours = |method: &&Method| {
            protocol
                .estimates
                .iter()
                .all(|file| file.method != **method)
        };
        let ours: Vec<Method> = protocol.methods.iter().filter(ours).copied().collect();
        if ours != Method::PAPER {
            let methods = if ours.is_empty() {
                &protocol.methods
            } else {
                &ours
            };
            option("method", &joined(methods));
        }
        if !protocol.fusions.is_empty() {
            option("fusion", &joined(&protocol.fusions));
        }
        option("seed", &protocol.seed);
        if protocol.right != Tolerance::default() {
            option("right", &protocol.right);
        }
        if let Some(probability) = protocol.accept {
            option("accept", &probability);
        }
        if protocol.explain > 0 {
            option("explain", &protocol.explain);
        }
        for estimates in &protocol.estimates {
            option("estimates", estimates);
        }
        if let Some(path) = &protocol.gps {
            option("gps", &path.display());
        }
        if !protocol.degrade.is_none() {
            option("degrade", &protocol.degrade);
        }
        if let Some(folder) = &protocol.matches {
            option("matches", &folder.display());
        }
        for change in self.params.changes() {
            option("set", &change);
        }
        for breakpoint in &self.breakpoints {
            option("break", breakpoint);
        }
        arguments
    }

    /// The command line that asks the same of a query, for a POSIX shell. See [`Self::arguments`].
    pub fn command_line(&self, query: &str, references: &[String]) -> String {
        command_line(&self.arguments(query, references))
    }
}

/// The command line with these arguments, for a POSIX shell.
pub fn command_line(arguments: &[String]) -> String {
    let words: Vec<String> = arguments.iter().map(|word| quoted(word)).collect();
    format!("posescope {}", words.join(" "))
}

fn joined(names: &[impl Display]) -> String {
    let names: Vec<String> = names.iter().map(ToString::to_string).collect();
    names.join(",")
}

/// A word as a POSIX shell reads it back.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./:,=+@".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With nothing as it is by default.
    fn task() -> Task {
        let mut params = Params::default();
        params.assign("fb.ratio=0.75").expect("a good value");
        Task {
            queries: Some("street:night".to_owned()),
            format: Some("street".to_owned()),
            index: Some("my index".into()),
            radius_m: 12.5,
            protocol: Protocol {
                references: "retrieve:3".parse().expect("a choice"),
                prior_m: Some(80.0),
                methods: vec![Method::FB, Method::MI, Method::named("other")],
                fusions: ["avg", "r-wavg"]
                    .map(|name| name.parse().expect("a fusion"))
                    .to_vec(),
                seed: 9,
                right: "0.5m,2deg".parse().expect("a tolerance"),
                accept: Some(0.75),
                explain: 4,
                estimates: vec!["other=my poses.txt".parse().expect("a file")],
                matches: Some("hloc".into()),
                gps: Some("gps.csv".into()),
                degrade: "fog=0.25,gamma=0.5,invert".parse().expect("a degradation"),
            },
            params,
            breakpoints: vec!["inliers < 10".parse().expect("a breakpoint")],
            photos: Some(LoosePhotos {
                paths: vec!["my photos/a.jpg".into()],
                camera: Some("500,500,320,240".parse().expect("a camera")),
            }),
            ..Task::of("street")
        }
    }

    #[test]
    fn the_command_line_leaves_nothing_out() {
        assert_eq!(
            task().command_line("000070", &[]),
            "posescope run street --format street --queries street:night --query 000070 \
             --camera 500,500,320,240 --references retrieve:3 --index 'my index' --radius 12.5 --prior 80 --method fb,mi \
             --fusion avg,r-wavg --seed 9 --right 0.5m,2deg --accept 0.75 --explain 4 \
             --estimates 'other=my poses.txt' --gps gps.csv --degrade fog=0.25,gamma=0.5,invert --matches hloc --set fb.ratio=0.75 --break 'inliers < 10'"
        );
        assert!(
            task()
                .command_line("a", &[])
                .contains("--query 'my photos/a.jpg' --camera 500,500,320,240 "),
        );
        let by_hand = Task {
            by_hand: true,
            ..Task::of("street")
        };
        assert_eq!(
            by_hand.command_line("000070", &["000062".to_owned()]),
            "posescope run street --query 000070 --reference 000062 --radius 15 --seed 0"
        );
    }

    #[test]
    fn a_task_is_read_as_it_is_written() {
        let json = serde_json::to_string(&task()).expect("a form in JSON");
        let read: Task = serde_json::from_str(&json).expect("our own");
        assert_eq!(read, task());
    }

    #[test]
    fn words_are_quoted_where_a_shell_would_split_them() {
        assert_eq!(quoted("street:night"), "street:night");
        assert_eq!(quoted("my data/00"), "'my data/00'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
    }
}
