//! `eval --rerun-failed`: the queries that failed in a run, with other settings.

use std::collections::BTreeSet;
use std::path::Path;

use posescope::localize::QueryResult;
use posescope::measure::read_rows;
use posescope::run::{RunFile, ScenePair, Scenes, inputs, is_called, read_run};

use super::{PlannedRun, written};
use crate::cli::args::EvalArgs;
use crate::cli::failure::CliError;

/// The run again, over its failed queries, with the changes of the arguments.
pub fn plan(args: &EvalArgs, before: &Path) -> Result<PlannedRun, CliError> {
    let run = read_run(before)?;
    let failed = failed(&read_rows(before)?);
    let params = run
        .params()
        .map_err(|source| CliError::Config { path: before.join("run.toml"), source })?;
    let params = args.config.over(params)?;
    let protocol = args.protocol.over(run.protocol.clone())?;
    let format = protocol.format.as_deref();
    let scenes = Scenes::open(&run.scenes, &protocol.query_scene, format)?;
    let is_named =
        |query: &str| args.query.is_empty() || args.query.iter().any(|name| is_called(query, name));
    let pairs = run.pairs.iter().map(|pair| {
        let is_failed = |query: &str| failed.contains(&key(&pair.scene, &pair.query_scene, query));
        pair.only(|query: &str| is_failed(query) && is_named(query))
    });
    let pairs: Vec<ScenePair> = pairs.filter(|pair| !pair.queries.is_empty()).collect();
    Ok(PlannedRun {
        run: RunFile {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            inputs: inputs(&protocol)?,
            protocol,
            shard: args.shard,
            pairs,
            params: written(&params),
            ..run
        },
        scenes,
        params,
    })
}

/// Whether the run has a result that is wrong or has no pose.
pub fn has_failed(before: &Path) -> Result<bool, CliError> {
    Ok(read_rows(before)?.iter().any(|row| row.grade.is_failure()))
}

/// Queries with a result that is wrong or has no pose.
fn failed(rows: &[QueryResult]) -> BTreeSet<[String; 3]> {
    rows.iter()
        .filter(|row| row.grade.is_failure())
        .map(|row| {
            let queries = row.query_scene.as_ref().unwrap_or(&row.scene);
            key(&row.scene, queries, &row.query)
        })
        .collect()
}

fn key(scene: &str, query_scene: &str, query: &str) -> [String; 3] {
    [scene, query_scene, query].map(str::to_owned)
}
