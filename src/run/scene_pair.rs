//! A pair of scenes as a run names it: whose frames are queries, with which cameras and when.

use serde::{Deserialize, Serialize};

use crate::camera::Intrinsics;
use crate::scene::Scene;

/// A scene of references with one of queries, perhaps the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScenePair {
    /// Position of the references' scene among the scenes.
    pub scene_index: usize,
    /// The name of the references' scene.
    pub scene: String,
    /// The name of the queries' scene.
    pub query_scene: String,
    /// The camera of the queries; the first one's where they have several.
    pub camera: QueryCamera,
    /// The camera of each query, where they have several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<QueryCamera>,
    /// Frames that were drawn as queries; where the scenes are the same, none is a reference.
    pub drawn: Vec<String>,
    /// The queries: all that were drawn, or those of them that were named.
    pub queries: Vec<String>,
    /// When they were taken \[s\], where that is known of all.
    pub times_s: Vec<f64>,
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
    /// The pair with those of its queries that are wanted.
    #[must_use]
    pub fn only(&self, is_wanted: impl Fn(&str) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.queries.len())
            .filter(|&at| is_wanted(&self.queries[at]))
            .collect();
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
            ..self.clone()
        }
    }
}

/// Whether a query goes by a name; numbers match whatever their leading zeros.
pub fn is_called(query: &str, name: &str) -> bool {
    let number = |text: &str| text.parse::<u64>().ok();
    query == name || number(query).is_some() && number(query) == number(name)
}

/// When the queries of a scene were taken, if that is known of all.
pub(super) fn times_of(scene: &dyn Scene, queries: &[usize]) -> Vec<f64> {
    let times: Option<Vec<f64>> = queries.iter().map(|&frame| scene.time_s(frame)).collect();
    times.unwrap_or_default()
}

/// The camera of the first of some frames, and that of each where they have several.
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
    fn from(intrinsics: Intrinsics) -> Self {
        let Intrinsics {
            fx,
            fy,
            cx,
            cy,
            width,
            height,
        } = intrinsics;
        Self {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
        }
    }
}
