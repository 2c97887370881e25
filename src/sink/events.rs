//! Events as data: one JSON object per line.

use std::io::{self, Write};

use serde::Serialize;

use crate::method::Method;
use crate::problem::Problem;
use crate::trace::Record;

/// The names of the frames' scenes.
#[derive(Clone, Debug, Default, Serialize)]
pub struct SceneNames {
    /// The scene of the references.
    #[serde(rename = "scene")]
    pub references: String,
    /// The scene of the query, if it is another one.
    #[serde(rename = "query_scene", skip_serializing_if = "Option::is_none")]
    pub query: Option<String>,
}

/// An event of a method on a problem.
#[derive(Serialize)]
struct Line<'a> {
    #[serde(flatten)]
    scenes: &'a SceneNames,
    query: &'a str,
    reference: &'a str,
    radius_m: f64,
    method: Method,
    #[serde(flatten)]
    record: &'a Record,
}

/// Writes an event of a method on a problem as one line.
///
/// # Errors
/// The errors of the writer.
pub fn write_event(
    mut to: impl Write,
    scenes: &SceneNames,
    problem: &Problem,
    method: Method,
    record: &Record,
) -> io::Result<()> {
    let line = Line {
        scenes,
        query: problem.query().name(),
        reference: problem.reference().name(),
        radius_m: problem.uncertainty_radius_m(),
        method,
        record,
    };
    serde_json::to_writer(&mut to, &line)?;
    to.write_all(b"\n")
}
