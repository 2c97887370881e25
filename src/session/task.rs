//! The task of `run`, `view` and the window: everything but the query.

use std::fmt::Display;
use std::sync::Arc;

use serde::{Deserialize, Serialize, Serializer};

use super::breakpoint::Breakpoint;
use crate::params::Params;
use crate::run::Protocol;
use crate::scene::{self, LoosePhotos, Scene, SceneError};

/// The scene of the references, and how a query is localised. The command line is parsed to it, the window and its
/// sessions keep it, and [`Self::command_line`] writes it as a command line again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Task {
    /// The scene of the references, as given on the command line.
    pub scene: String,
    /// How a query is localised.
    pub protocol: Protocol,
    /// Parameters of the estimators.
    #[serde(serialize_with = "write_params", deserialize_with = "posescope_core::text::parsed")]
    pub params: Params,
    /// Where the run stops.
    pub breakpoints: Vec<Breakpoint>,
    /// Loose photos, which are the queries then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photos: Option<LoosePhotos>,
}

/// The opened scenes of a task; often both are the same.
#[derive(Clone)]
pub struct TaskScenes {
    /// The scene of the references.
    pub references: Arc<dyn Scene>,
    /// The scene of the queries.
    pub queries: Arc<dyn Scene>,
}

/// Writes all parameters as a configuration file.
fn write_params<S: Serializer>(params: &Params, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&params.to_toml())
}

impl Task {
    /// The default task on a scene.
    pub fn of(scene: impl Into<String>) -> Self {
        Self {
            scene: scene.into(),
            protocol: Protocol::default(),
            params: Params::default(),
            breakpoints: Vec::new(),
            photos: None,
        }
    }

    /// The scene of the queries, if it is another one, as given on the command line.
    pub fn query_scene(&self) -> Option<&str> {
        self.protocol.query_scene.first().map(String::as_str)
    }

    /// The uncertainty radius \[m\].
    pub fn radius_m(&self) -> f64 {
        self.protocol.radius_m()
    }

    /// Opens the scenes. `opened` returns a scene that is open already.
    ///
    /// # Errors
    /// A scene, a photo or a file of positions that cannot be read.
    pub fn open(
        &self,
        opened: &dyn Fn(&str) -> Option<Arc<dyn Scene>>,
    ) -> Result<TaskScenes, SceneError> {
        let open = |argument: &str| match opened(argument) {
            Some(scene) => Ok(scene),
            None => scene::open(argument, self.protocol.format.as_deref()).map(Arc::from),
        };
        let references = open(&self.scene)?;
        let queries = match (&self.photos, self.query_scene()) {
            (Some(photos), _) => photos.open(Some(references.as_ref()))?,
            (None, Some(argument)) => open(argument)?,
            (None, None) => Arc::clone(&references),
        };
        Ok(TaskScenes {
            queries: self.protocol.prepared_queries(queries, references.as_ref())?,
            references,
        })
    }

    /// How far from a query's known position references are chosen \[m\].
    pub fn reach_m(&self) -> f64 {
        self.protocol.reach_m(self.radius_m())
    }

    /// The arguments of `posescope` that localise a query in the same way: `run`, the scene, the options.
    /// With `references`, against these frames; without, against those chosen by the protocol.
    pub fn arguments(&self, query: &str, references: &[String]) -> Vec<String> {
        let mut protocol = self.protocol.clone();
        if !references.is_empty() {
            protocol.name_references(references);
        }
        let photos = self.photos.as_ref();
        let query = match photos.and_then(|photos| photos.path_of(query)) {
            Some(path) => path.display().to_string(),
            None => query.to_owned(),
        };
        let mut options = vec![("query".to_owned(), query)];
        let mut option = |name: &str, value: &dyn Display| {
            options.push((name.to_owned(), value.to_string()));
        };
        if let Some(camera) = photos.and_then(|photos| photos.camera.as_ref()) {
            option("camera", camera);
        }
        let mut given = protocol.options();
        // Without these options, a scene of another size or a photo gets defaults of its own.
        let mut spelt = Vec::new();
        if !self.scene.starts_with("street") {
            let radii: Vec<String> = protocol.radii_m.iter().map(f64::to_string).collect();
            spelt.extend([("radius", radii.join(",")), ("right", protocol.right.to_string())]);
        }
        if photos.is_some() && protocol.gps.is_none() && !protocol.is_by_hand() {
            spelt.push(("reference", protocol.selection().to_string()));
        }
        for (name, value) in spelt {
            if !given.iter().any(|(known, _)| known == name) {
                given.push((name.to_owned(), value));
            }
        }
        given.sort_by(|(a, _), (b, _)| a.cmp(b));
        for (name, value) in given {
            option(&name, &value);
        }
        for change in self.params.changes() {
            option("set", &change);
        }
        for breakpoint in &self.breakpoints {
            option("break", breakpoint);
        }
        let options = options.into_iter().flat_map(|(name, value)| [format!("--{name}"), value]);
        ["run".to_owned(), self.scene.clone()].into_iter().chain(options).collect()
    }

    /// The command line of [`Self::arguments`], for a POSIX shell.
    pub fn command_line(&self, query: &str, references: &[String]) -> String {
        command_line(&self.arguments(query, references))
    }
}

/// The command line with these arguments, for a POSIX shell.
pub fn command_line(arguments: &[String]) -> String {
    let words: Vec<String> = arguments.iter().map(|word| quoted(word)).collect();
    format!("posescope {}", words.join(" "))
}

/// A word, quoted for a POSIX shell if necessary.
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
    use crate::method::Method;

    /// With nothing as it is by default.
    fn task() -> Task {
        let mut params = Params::default();
        params.assign("fb.ratio=0.75").expect("a good value");
        Task {
            protocol: Protocol {
                query_scene: vec!["street:night".to_owned()],
                gps: Some("gps.csv".into()),
                limit: Some("10%".parse().expect("a limit")),
                degrade: "fog=0.25,gamma=0.5,invert".parse().expect("a degradation"),
                references: vec!["retrieve:3".parse().expect("a choice")],
                radii_m: vec![12.5],
                prior_m: Some(80.0),
                index: vec!["my index".into()],
                estimates: vec!["other=my poses.txt".parse().expect("a file")],
                methods: vec![Method::FB, Method::MI, Method::named("other")],
                fusions: ["avg", "r-wavg"].map(|name| name.parse().expect("a fusion")).to_vec(),
                matches: Some("hloc".into()),
                preset: Some("single".parse().expect("a preset")),
                seed: 9,
                right: "0.5m,2deg".parse().expect("a tolerance"),
                failure_radius_m: Some(20.0),
                min_confidence: Some(0.75),
                survey: Some("my survey".parse().expect("a folder")),
                explain: 4,
                format: Some("street".to_owned()),
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
            "posescope run street --query 000070 --camera 500,500,320,240 \
             --degrade fog=0.25,gamma=0.5,invert --estimates 'other=my poses.txt' --explain 4 \
             --failure-radius 20 --format street --fusion avg,r-wavg --gps gps.csv --index 'my index' --limit '10%' \
             --matches hloc --method fb,mi,other --min-confidence 0.75 --preset single --prior 80 \
             --query-scene street:night --radius 12.5 --reference retrieve:3 --right 0.5m,2deg --seed 9 \
             --survey 'my survey' --set fb.ratio=0.75 --break 'inliers < 10'"
        );
        assert!(
            task()
                .command_line("a", &[])
                .contains("--query 'my photos/a.jpg' --camera 500,500,320,240 "),
        );
        assert_eq!(
            Task::of("street").command_line("000070", &["000062".to_owned()]),
            "posescope run street --query 000070 --reference 000062"
        );
        // A room has a smaller radius by default, and a photo other references.
        let photos = LoosePhotos { paths: vec!["a.jpg".into()], ..LoosePhotos::default() };
        let of_room = Task { photos: Some(photos), ..Task::of("room") };
        assert_eq!(
            of_room.command_line("a", &[]),
            "posescope run room --query a.jpg --radius 15 --reference random:1 --right 1m,5deg"
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
