//! A pair of scenes in `run.toml`: the queries with their cameras and times.

use serde::{Deserialize, Serialize};

use crate::camera::Intrinsics;
use crate::scene::Scene;

/// A scene of references and a scene of queries, which may be the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScenePair {
    /// Position of the references' scene among the scenes.
    pub scene_index: usize,
    /// Position of the queries' scene among the query scenes; without one, the references' scene has the queries.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub query_index: Option<usize>,
    /// The references' scene in results: its name, which no other scene of the run has.
    pub scene: String,
    /// The queries' scene in results.
    pub query_scene: String,
    /// The camera of the queries; that of the first query if they differ.
    pub camera: QueryCamera,
    /// The camera of each query, if they differ.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<QueryCamera>,
    /// The drawn frames; none is a reference if both scenes are the same.
    pub drawn: Vec<String>,
    /// The queries: all drawn frames, or the named ones of them.
    pub queries: Vec<String>,
    /// The times of the queries \[s\], if all are known.
    pub times_s: Vec<f64>,
    /// The references of each query, if each has its own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub references: Vec<Vec<String>>,
}

/// Intrinsics \[px\], with the centre of the top-left pixel at (0, 0).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct QueryCamera {
    /// Image width.
    pub width: u32,
    /// Image height.
    pub height: u32,
    /// Focal length, horizontally.
    pub fx: f64,
    /// Focal length, vertically.
    pub fy: f64,
    /// Principal point, horizontally.
    pub cx: f64,
    /// Principal point, vertically.
    pub cy: f64,
}

impl ScenePair {
    /// The pair with some of its queries only.
    #[must_use]
    pub fn only(&self, is_wanted: impl Fn(&str) -> bool) -> Self {
        let kept: Vec<usize> =
            (0..self.queries.len()).filter(|&at| is_wanted(&self.queries[at])).collect();
        fn those<T: Clone>(kept: &[usize], all: &[T]) -> Vec<T> {
            kept.iter().filter_map(|&at| all.get(at).cloned()).collect()
        }
        Self {
            camera: match kept.first().and_then(|&at| self.cameras.get(at)) {
                Some(first) => *first,
                None => self.camera,
            },
            cameras: those(&kept, &self.cameras),
            queries: those(&kept, &self.queries),
            times_s: those(&kept, &self.times_s),
            references: those(&kept, &self.references),
            ..self.clone()
        }
    }
}

/// Whether a query has a name; numbers match regardless of leading zeros.
pub fn is_called(query: &str, name: &str) -> bool {
    let number = |text: &str| text.parse::<u64>().ok();
    query == name || number(query).is_some() && number(query) == number(name)
}

/// The times of a scene's queries, if all are known.
pub(super) fn times_of(scene: &dyn Scene, queries: &[usize]) -> Vec<f64> {
    let times: Option<Vec<f64>> = queries.iter().map(|&frame| scene.time_s(frame)).collect();
    times.unwrap_or_default()
}

/// The camera of the first frame, and those of all frames if they differ.
pub(super) fn cameras_of(scene: &dyn Scene, frames: &[usize]) -> (QueryCamera, Vec<QueryCamera>) {
    let camera = |frame: usize| QueryCamera::from(scene.intrinsics(frame));
    let first = camera(frames.first().copied().unwrap_or(0));
    let cameras: Vec<QueryCamera> = frames.iter().map(|&frame| camera(frame)).collect();
    if cameras.iter().all(|camera| *camera == first) {
        (first, Vec::new())
    } else {
        (first, cameras)
    }
}

impl From<Intrinsics> for QueryCamera {
    fn from(camera: Intrinsics) -> Self {
        Self {
            width: camera.width,
            height: camera.height,
            fx: camera.fx,
            fy: camera.fy,
            cx: camera.cx,
            cy: camera.cy,
        }
    }
}
