//! `eval --failed`: the queries that failed in a run, once more and otherwise.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use posescope::localize::QueryResult;
use posescope::measure::read_rows;
use posescope::params::Params;
use posescope::run::{RunFile, ScenePair, Scenes, inputs, is_called, read_run};
use posescope::scene::{self, Scene};

use super::Asked;
use crate::cli::args::EvalArgs;
use crate::cli::failure::CliError;

/// What the run asked, of the queries on which a method failed, with what the arguments change.
pub fn asked(args: &EvalArgs, before: &Path) -> Result<Asked, CliError> {
    let run = read_run(before)?;
    let failed = failed(&read_rows(before)?);
    let mut params = Params::default();
    let given = params.merge_toml(&run.params.to_string());
    given.map_err(|source| CliError::Config {
        path: before.join("run.toml"),
        source,
    })?;
    let params = args.protocol.config.over(params)?;
    let format = args.protocol.format.clone().or_else(|| run.format.clone());
    let open_all = |arguments: &[String]| -> Result<Vec<Arc<dyn Scene>>, CliError> {
        let scenes = arguments
            .iter()
            .map(|argument| scene::open(argument, format.as_deref()).map(Arc::from));
        Ok(scenes.collect::<Result<_, _>>()?)
    };
    let scenes = Scenes {
        references: open_all(&run.scenes)?,
        queries: open_all(&run.queries)?,
    };
    let protocol = args.protocol.over(run.protocol.clone())?;
    let pairs: Vec<ScenePair> = run
        .pairs
        .iter()
        .map(|pair| {
            let is_wanted = |query: &str| {
                let is_failed = failed.contains(&key(&pair.scene, &pair.query_scene, query));
                let is_named =
                    args.only.is_empty() || args.only.iter().any(|name| is_called(query, name));
                is_failed && is_named
            };
            pair.only(is_wanted)
        })
        .filter(|pair| !pair.queries.is_empty())
        .collect();
    let table = params.to_toml().parse();
    Ok(Asked {
        run: RunFile {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            format,
            inputs: inputs(&protocol)?,
            protocol,
            failure_radius_m: args.failure_radius.unwrap_or(run.failure_radius_m),
            radii_m: match args.radius.as_slice() {
                [] => run.radii_m.clone(),
                wanted => wanted.to_vec(),
            },
            shard: args.shard,
            pairs,
            params: table.unwrap_or_else(|error| unreachable!("we wrote it ourselves: {error}")),
            ..run
        },
        scenes,
        params,
    })
}

/// Whether a query of the run is wrong or has no pose.
pub fn has_failed(before: &Path) -> Result<bool, CliError> {
    Ok(!failed(&read_rows(before)?).is_empty())
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
