//! Retrieval in a scene: builds an index of its photos, and ranks frames by similarity to a photo.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};

use xxhash_rust::xxh3::xxh3_64;

use super::{Scene, SceneError};
use crate::features::{SurfParams, surf};
use crate::localize::{ChoiceError, Ranking};
use crate::params::Params;
use crate::problem::Query;
use crate::retrieval::{
    BuildError, BuildProgress, BuildRequest, BuildSummary, Clustering, Criterion, Index,
    IndexError, Ranked, Retrieval, RetrievalParams, build,
};
use crate::trace::Cancelled;
use posescope_street::user_cache_folder;

/// The extension of the files.
const EXTENSION: &str = "posescope-index";

/// A file about a scene in this folder of the user's cache, named after the scene and the folder of the argument. `None`
/// if there is no cache or it is turned off.
pub fn cache_file(
    folder: &str,
    extension: &str,
    scene: &dyn Scene,
    argument: &str,
) -> Option<PathBuf> {
    let mut name = scene.name().replace(|c: char| !c.is_alphanumeric(), "-");
    if let Ok(folder) = Path::new(argument).canonicalize() {
        let hash = xxh3_64(folder.as_os_str().as_encoded_bytes());
        name.push_str(&format!("-{hash:016x}"));
    }
    Some(user_cache_folder(folder)?.join(name).with_extension(extension))
}

/// The options of an index besides the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndexOptions {
    /// Number of visual words.
    pub words: usize,
    /// Every Nth frame is indexed, from 1.
    pub every: usize,
    /// Seed of every random choice.
    pub seed: u64,
}

/// Why there is no usable index.
#[derive(Debug, thiserror::Error)]
pub enum NoIndex {
    /// There is no cache directory, and no file was named.
    #[error(
        "there is no cache directory for the retrieval index; write it with \
         `posescope index … --out FILE` and use it with --index FILE"
    )]
    NoFolder,
    /// The file is missing or cannot be used.
    #[error("{source}; build it with `{command}`")]
    Unusable {
        /// What is wrong with it.
        source: IndexError,
        /// The command that builds it.
        command: String,
    },
}

/// A scene's index.
pub struct Retriever {
    index: Index,
    surf: SurfParams,
    params: RetrievalParams,
}

impl Retriever {
    /// The default file of a scene's index: in the user's cache directory, named after the scene and the folder of the
    /// argument. `None` if there is no such directory or it is turned off.
    pub fn default_path(scene: &dyn Scene, argument: &str) -> Option<PathBuf> {
        cache_file("index", EXTENSION, scene, argument)
    }

    /// The request for an index of a scene `without` some frames: they are not found, and do not contribute to the
    /// vocabulary and the word weights. Use this for queries from the scene itself, which would otherwise find their
    /// own photos.
    pub fn request(
        scene: &dyn Scene,
        options: &IndexOptions,
        without: &BTreeSet<usize>,
        params: &Params,
    ) -> BuildRequest {
        let IndexOptions { words, every, seed } = *options;
        let mut recipe = recipe(params, &RetrievalParams::BUILDING);
        let numbers = [("words", words), ("every", every)];
        recipe.extend(numbers.map(|(key, value)| (key.to_owned(), value.to_string())));
        recipe.insert("seed".to_owned(), seed.to_string());
        if !without.is_empty() {
            let names = without.iter().map(|&frame| scene.frames()[frame].as_str());
            let names = names.collect::<Vec<_>>().join("\n");
            let content = format!("{} {:016x}", without.len(), xxh3_64(names.as_bytes()));
            recipe.insert("without".to_owned(), content);
        }
        let RetrievalParams { sample, iterations, trees, checks, .. } = params.retrieval;
        BuildRequest {
            scene: scene.name().to_owned(),
            fingerprint: scene.fingerprint(),
            frames: (0..scene.frames().len())
                .step_by(every.max(1))
                .filter(|frame| !without.contains(frame))
                .collect(),
            clustering: Clustering { words, iterations, trees, checks, seed },
            sample,
            recipe,
        }
    }

    /// Builds an index of the scene's photos.
    ///
    /// # Errors
    /// The errors of [`build`], or that of an unreadable photo.
    pub fn build(
        scene: &dyn Scene,
        path: &Path,
        request: &BuildRequest,
        params: &Params,
        progress: impl FnMut(BuildProgress),
    ) -> Result<BuildSummary, BuildError<SceneError>> {
        let features = params.retrieval.surf(&params.surf);
        let features_of = |frame| Ok(surf(&scene.photo(frame)?.gray, &features));
        build(path, request, features_of, progress)
    }

    /// Opens the index of a scene.
    ///
    /// # Errors
    /// [`IndexError`] if it is missing, damaged, or built from other frames or features.
    pub fn open(path: &Path, scene: &dyn Scene, params: &Params) -> Result<Self, IndexError> {
        let index = Index::open(path, params.retrieval.checks)?;
        // Any vocabulary will do, but the features must be the same.
        let features = recipe(params, &["features"]);
        index.check(scene.name(), scene.fingerprint(), &features)?;
        Ok(Self { index, surf: params.surf, params: params.retrieval })
    }

    /// Opens the index of the scene `argument`: the given file, or that of [`Self::default_path`].
    ///
    /// # Errors
    /// [`NoIndex`], with the command that builds one.
    pub fn find(
        given: Option<&Path>,
        scene: &dyn Scene,
        argument: &str,
        params: &Params,
    ) -> Result<Self, NoIndex> {
        let path = given.map(Path::to_owned);
        let path = path.or_else(|| Self::default_path(scene, argument)).ok_or(NoIndex::NoFolder)?;
        Self::open(&path, scene, params).map_err(|source| {
            let output = given.map_or(String::new(), |path| format!(" --out {}", path.display()));
            NoIndex::Unusable { source, command: format!("posescope index {argument}{output}") }
        })
    }

    /// Whether it was opened with these parameters.
    pub(crate) fn is_for(&self, params: &Params) -> bool {
        self.surf == params.surf && self.params == params.retrieval
    }

    /// Ranks the allowed frames by similarity to the query.
    pub fn retrieve(&self, query: &Query, allowed: impl Fn(usize) -> bool) -> Retrieval {
        // The same features as for FB, so they are cached.
        let features = query.features(&self.surf);
        let indexed = self.params.surf(&self.surf).max_keypoints;
        let features = features.strongest(indexed);
        self.index.query(&features, &self.params, allowed)
    }
}

/// The parameters of the features, and some of retrieval.
fn recipe(params: &Params, retrieval: &[&str]) -> BTreeMap<String, String> {
    let is_part = |key: &str| match key.split_once('.') {
        Some(("surf", _)) => true,
        Some(("retrieval", name)) => retrieval.contains(&name),
        _ => false,
    };
    let rows = params.list().into_iter().filter(|row| is_part(&row.key));
    rows.map(|row| (row.key, row.value.to_string())).collect()
}

impl Ranking for Retriever {
    fn criterion(&self) -> Criterion {
        Criterion::Words
    }

    fn rank(
        &self,
        query: &Query,
        candidates: &[usize],
        count: usize,
        checkpoint: &mut dyn FnMut() -> Result<(), Cancelled>,
    ) -> Result<Vec<Ranked>, ChoiceError> {
        checkpoint()?;
        let candidates: HashSet<usize> = candidates.iter().copied().collect();
        let retrieval = self.retrieve(query, |frame| candidates.contains(&frame));
        let mut ranked = retrieval.ranked;
        ranked.truncate(count);
        Ok(ranked)
    }
}
