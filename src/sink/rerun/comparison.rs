//! Two runs in one recording, on the same timelines.

use std::collections::BTreeMap;
use std::path::Path;

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
use crate::run::{FolderError, read_results};

/// The runs' names in the recording, and their colours.
const RUNS: [(&str, Rgb); 2] = [("a", palette::REFERENCE), ("b", palette::ESTIMATE)];

/// Why there is no recording of two runs.
#[derive(Debug, thiserror::Error)]
pub enum ComparisonError {
    /// A run cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The recording cannot be written.
    #[error(transparent)]
    Record(#[from] RecordError),
}

/// Records the poses and errors of both runs, query by query: `world/a` and `world/b`, `error/METHOD/a`
/// and `error/METHOD/b` on the timeline `query`. A query without a pose leaves a gap.
///
/// # Errors
/// [`ComparisonError`].
pub fn record_comparison(
    targets: &Targets,
    before: &Path,
    after: &Path,
    report: &str,
) -> Result<(), ComparisonError> {
    let mut queries: BTreeMap<String, usize> = BTreeMap::new();
    let mut stream: Option<(Stream, Origin)> = None;
    let mut methods: Vec<Method> = Vec::new();
    for ((run, color), folder) in RUNS.into_iter().zip([before, after]) {
        for result in read_results::<QueryResult>(folder)? {
            let result = result?;
            let next = queries.len();
            let query = *queries.entry(key(&result)).or_insert(next);
            if !methods.contains(&result.method) {
                methods.push(result.method);
            }
            let (stream, origin) = match &mut stream {
                Some(open) => open,
                None => stream.insert(open(targets, &result, before, after)?),
            };
            stream.set_query(query);
            log(stream, *origin, &result, run, color);
        }
    }
    let Some((mut stream, _)) = stream else {
        return Ok(());
    };
    stream.log_static(entities::REPORT, &TextDocument::from_markdown(report));
    let root = root(&methods);
    stream.send_layout(&root);
    Ok(stream.close()?)
}

/// Queries of different settings follow each other.
fn key(result: &QueryResult) -> String {
    format!(
        "{:?}/{:?}/{}/{:?}/{}",
        result.setting, result.fusion, result.scene, result.query_scene, result.query
    )
}

fn open(
    targets: &Targets,
    first: &QueryResult,
    before: &Path,
    after: &Path,
) -> Result<(Stream, Origin), RecordError> {
    let name = |path: &Path| {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let identity = Identity {
        scene: first.scene.clone(),
        query_scene: first.query_scene.clone(),
        queries: vec![name(before), name(after)],
        ..Identity::default()
    };
    let mut stream = Stream::open(targets, &identity)?;
    stream.log_static(entities::WORLD, &ViewCoordinates::RDF());
    let place = first.pose.as_ref().map(|pose| pose.position_m);
    Ok((stream, Origin(Vector3::from(place.unwrap_or_default()))))
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
        &SeriesLines::new()
            .with_names([run])
            .with_colors([super::color(color)]),
    );
}

fn root(methods: &[Method]) -> BlueprintNode {
    let errors = methods.iter().map(|method| {
        let name = format!("{}: translation error (m)", method.name().to_uppercase());
        (
            1.0,
            BlueprintView::new("TimeSeries", name, format!("error/{method}")).into(),
        )
    });
    let left = BlueprintNode::Column(vec![
        (
            1.0,
            BlueprintView::new("3D", "Poses", entities::WORLD).into(),
        ),
        (
            1.0,
            BlueprintView::new("TextDocument", "Changes", entities::REPORT).into(),
        ),
    ]);
    BlueprintNode::Row {
        name: "runs".to_owned(),
        children: vec![(2.0, left), (3.0, BlueprintNode::Column(errors.collect()))],
    }
}
