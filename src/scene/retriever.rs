//! Retrieval in a scene: from photos to an index, and from a photo to the frames that resemble it.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};

use xxhash_rust::xxh3::xxh3_64;

use super::{Scene, SceneError};
use crate::features::{SurfParams, remembered, surf};
use crate::localize::{ChoiceError, Ranking};
use crate::params::Params;
use crate::problem::Query;
use crate::retrieval::{
    BuildError, BuildProgress, BuildRequest, BuildSummary, Criterion, Index, IndexError, Ranked,
    Retrieval, RetrievalParams, build,
};
use crate::trace::Cancelled;
use posescope_core::files::user_cache_folder;

/// The extension of the files.
const EXTENSION: &str = "posescope-index";

/// What is asked of an index beside the parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndexOptions {
    /// Number of visual words.
    pub words: usize,
    /// Every Nth frame is indexed, from 1.
    pub every: usize,
    /// Seed of every random choice.
    pub seed: u64,
}

/// Why there is no index to ask.
#[derive(Debug, thiserror::Error)]
pub enum NoIndex {
    /// There is no cache directory, and no file was named.
    #[error(
        "there is no cache directory for the retrieval index; name a file with --out of \
         `posescope index`, and with --index"
    )]
    NoFolder,
    /// The file is not there or cannot be used.
    #[error("{source}; `{command}` builds it")]
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
    /// Where the index of a scene is unless the user says otherwise: in the user's cache directory,
    /// by the scene's name and the folder that the argument names. `None` where there is no such
    /// directory or it is turned off.
    pub fn default_path(scene: &dyn Scene, argument: &str) -> Option<PathBuf> {
        let mut name = scene.name().replace(|c: char| !c.is_alphanumeric(), "-");
        if let Ok(folder) = Path::new(argument).canonicalize() {
            let hash = xxh3_64(folder.as_os_str().as_encoded_bytes());
            name.push_str(&format!("-{hash:016x}"));
        }
        let folder = user_cache_folder("index")?;
        Some(folder.join(name).with_extension(EXTENSION))
    }

    /// What the index of a scene is to hold.
    pub fn request(scene: &dyn Scene, options: &IndexOptions, params: &Params) -> BuildRequest {
        Self::request_without(scene, options, &BTreeSet::new(), params)
    }

    /// As [`Self::request`], without some frames: neither are they found, nor have their features a part
    /// in the words or in how much a word says. Where queries are of the scene itself, an index with
    /// their own photos knows more of them than one of another drive could.
    pub fn request_without(
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
        BuildRequest {
            scene: scene.name().to_owned(),
            fingerprint: scene.fingerprint(),
            frames: (0..scene.frames().len())
                .step_by(every.max(1))
                .filter(|frame| !without.contains(frame))
                .collect(),
            words,
            seed,
            sample: params.retrieval.sample,
            iterations: params.retrieval.iterations,
            trees: params.retrieval.trees,
            checks: params.retrieval.checks,
            recipe,
        }
    }

    /// Builds an index of the scene's photos.
    ///
    /// # Errors
    /// The errors of [`build`]; that of a frame when its photo cannot be read.
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
    /// [`IndexError`] when there is none, it is damaged, or it is of other frames or features than
    /// the scene and the parameters have now.
    pub fn open(path: &Path, scene: &dyn Scene, params: &Params) -> Result<Self, IndexError> {
        let index = Index::open(path, params.retrieval.checks)?;
        // The vocabulary may be of any kind, but features of another kind have other words.
        let features = recipe(params, &["features"]);
        index.check(scene.name(), scene.fingerprint(), &features)?;
        Ok(Self {
            index,
            surf: params.surf,
            params: params.retrieval,
        })
    }

    /// Opens the index of the scene that `argument` names: the given file, or that of
    /// [`Self::default_path`].
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
        let path = path
            .or_else(|| Self::default_path(scene, argument))
            .ok_or(NoIndex::NoFolder)?;
        Self::open(&path, scene, params).map_err(|source| {
            let output = given.map_or(String::new(), |path| format!(" --out {}", path.display()));
            NoIndex::Unusable {
                source,
                command: format!("posescope index {argument}{output}"),
            }
        })
    }

    /// The frames that resemble the query, of those that are allowed.
    pub fn retrieve(&self, query: &Query, allowed: impl Fn(usize) -> bool) -> Retrieval {
        // All of them, as FB asks for them: they are found once.
        let features = remembered(&query.photo.gray, &query.memo, &self.surf);
        let indexed = self.params.surf(&self.surf).max_keypoints;
        let features = features.value.strongest(indexed);
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
