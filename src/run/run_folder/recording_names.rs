//! The names of the recordings of failures.

use std::collections::{HashMap, HashSet};

use posescope_core::files::file_name;

use crate::localize::QueryResult;
use crate::method::Method;
use crate::run::{RunFile, ScenePair};

/// The names of the recordings of a run's failures: `QUERY-METHOD`, preceded by the scenes if the run has several pairs.
/// Each query has a name of its own, also beside another that differs from it only by characters that file names do not
/// have.
pub struct RecordingNames(HashMap<[String; 3], String>);

impl RecordingNames {
    /// Those of all queries of a run.
    pub fn of(run: &RunFile) -> Self {
        let several_pairs = run.pairs.len() > 1;
        let methods = &run.protocol.methods;
        let queries = run.plan().map(|item| {
            let ScenePair { scene, query_scene, .. } = item.pair;
            let scenes = several_pairs.then(|| format!("{scene}-{query_scene}-"));
            let name = scenes.unwrap_or_default() + item.query;
            ([scene, query_scene, item.query].map(str::to_owned), name)
        });
        let (exact, changed): (Vec<_>, Vec<_>) =
            queries.partition(|(_, name)| file_name(name) == *name);
        let mut used: HashSet<String> = HashSet::new();
        let mut named = |(key, name): ([String; 3], String)| {
            let plain = file_name(&name);
            let numbered = (2..).map(|number| format!("{plain}-{number}"));
            let free = [plain.clone()].into_iter().chain(numbered).find(|name| {
                // Some file systems do not tell `A` from `a`.
                let name = name.to_lowercase();
                let files: Vec<String> =
                    methods.iter().map(|method| format!("{name}-{method}")).collect();
                let is_free = !files.iter().any(|file| used.contains(file));
                if is_free {
                    used.extend(files);
                }
                is_free
            });
            (key, free.unwrap_or(plain))
        };
        let exact: Vec<_> = exact.into_iter().map(&mut named).collect();
        let changed: Vec<_> = changed.into_iter().map(named).collect();
        Self(exact.into_iter().chain(changed).collect())
    }

    /// The file of a failure in the folder [`FAILURES`](super::FAILURES); `None` for a query that is not of the run.
    pub fn file(&self, scenes: [&str; 2], query: &str, method: Method) -> Option<String> {
        let [scene, query_scene] = scenes;
        let name = self.0.get(&[scene, query_scene, query].map(str::to_owned))?;
        Some(format!("{name}-{method}.rrd"))
    }

    /// The file of a failed result.
    pub fn of_result(&self, result: &QueryResult) -> Option<String> {
        let query_scene = result.query_scene.as_ref().unwrap_or(&result.scene);
        self.file([&result.scene, query_scene], &result.query, result.method)
    }
}
