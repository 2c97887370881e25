//! Two runs in one recording, on the same timelines.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;
use rerun::{Points3D, Scalars, SeriesLines, TextDocument, ViewCoordinates};

use super::entities;
use super::layout::{BlueprintNode, BlueprintView};
use super::scene::Origin;
use super::stream::Stream;
use super::{Identity, RecordError, Targets};
use crate::localize::QueryResult;
use crate::method::Method;
use crate::palette::{self, Rgb};

/// The runs' names in the recording, and their colours.
const RUNS: [(&str, Rgb); 2] = [("a", palette::REFERENCE), ("b", palette::ESTIMATE)];

/// Records the poses and errors of two runs, each by its name, query by query: `world/a` and `world/b`,
/// `error/METHOD/a` and `error/METHOD/b` on the timeline `query`. A query without a pose leaves a gap.
///
/// # Errors
/// [`RecordError`].
pub fn record_comparison(
    targets: &Targets,
    names: [String; 2],
    runs: &[Vec<QueryResult>; 2],
    report: &str,
) -> Result<(), RecordError> {
    let Some(first) = runs.iter().flatten().next() else {
        return Ok(());
    };
    let identity = Identity {
        scene: first.scene.clone(),
        query_scene: first.query_scene.clone(),
        queries: names.into(),
        ..Identity::default()
    };
    let mut stream = Stream::open(targets, &identity)?;
    stream.log_static(entities::WORLD, &ViewCoordinates::RDF());
    let place = first.pose.as_ref().map(|pose| pose.position_m);
    let origin = Origin(Vector3::from(place.unwrap_or_default()));
    let mut queries = BTreeMap::new();
    for ((run, color), results) in RUNS.into_iter().zip(runs) {
        for result in results {
            let next = queries.len();
            stream.set_query(*queries.entry(key(result)).or_insert(next));
            log(&mut stream, origin, result, run, color);
        }
    }
    stream.log_static(entities::REPORT, &TextDocument::from_markdown(report));
    let methods = runs.iter().flatten().map(|result| result.method);
    stream.send_layout(&root(&methods.collect()));
    stream.close()
}

/// Queries of different settings follow each other.
fn key(result: &QueryResult) -> String {
    format!(
        "{:?}/{:?}/{}/{:?}/{}",
        result.setting, result.fusion, result.scene, result.query_scene, result.query
    )
}

fn log(stream: &mut Stream, origin: Origin, result: &QueryResult, run: &str, color: Rgb) {
    let owner = format!("{}/{run}/{}", entities::WORLD, result.method);
    match &result.pose {
        Some(pose) => {
            let place = origin.place(&Vector3::from(pose.position_m));
            let point = Points3D::new([place])
                .with_colors([super::color(color)])
                .with_radii([rerun::Radius::new_ui_points(5.0)])
                .with_labels([format!("{} {}", result.query, result.method)])
                .with_show_labels(false);
            stream.log(&owner, &point);
        }
        None => stream.log(&owner, &rerun::Clear::flat()),
    }
    let path = format!("error/{}/{run}", result.method);
    match &result.error {
        Some(error) => stream.log(&path, &Scalars::single(error.translation_m)),
        None => stream.log(&path, &rerun::Clear::flat()),
    }
    stream.log_static(
        &path,
        &SeriesLines::new().with_names([run]).with_colors([super::color(color)]),
    );
}

fn root(methods: &BTreeSet<Method>) -> BlueprintNode {
    let errors = methods.iter().map(|method| {
        let name = format!("{}: translation error (m)", method.label());
        let view = BlueprintView::new("TimeSeries", name, format!("error/{method}"));
        (1.0, view.into())
    });
    let poses = BlueprintView::new("3D", "Poses", entities::WORLD);
    let changes = BlueprintView::new("TextDocument", "Changes", entities::REPORT);
    let left = BlueprintNode::column(vec![(1.0, poses.into()), (1.0, changes.into())]);
    let right = BlueprintNode::column(errors.collect());
    BlueprintNode::row("runs", vec![(2.0, left), (3.0, right)])
}
