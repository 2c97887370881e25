//! The results of a run folder, as the window knows them.

use std::collections::HashMap;
use std::path::Path;

use super::selection::Results;
use crate::localize::QueryResult;
use crate::run::{FolderError, ScenePair, read_results};
use crate::scene::Scene;

/// The results of a run that are about a pair of its scenes, by the frames of the queries, and how many are
/// about others.
///
/// # Errors
/// Results that cannot be read.
pub fn results_of_run(
    folder: &Path,
    pair: &ScenePair,
    queries: &dyn Scene,
) -> Result<(Results, usize), FolderError> {
    let frames = queries.frames().iter().enumerate();
    let frames: HashMap<&str, usize> = frames.map(|(at, name)| (name.as_str(), at)).collect();
    let mut results = Results::new();
    let mut elsewhere = 0;
    for result in read_results::<QueryResult>(folder)? {
        let result = result?;
        let of_queries = result.query_scene.as_ref().unwrap_or(&result.scene);
        let is_of_pair = result.scene == pair.scene && *of_queries == pair.query_scene;
        match frames.get(result.query.as_str()).filter(|_| is_of_pair) {
            Some(&frame) => results.entry(frame).or_default().push(result),
            None => elsewhere += 1,
        }
    }
    Ok((results, elsewhere))
}
