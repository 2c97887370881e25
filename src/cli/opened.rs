//! The scenes and queries of a command line, opened.

use std::path::Path;
use std::sync::Arc;

use posescope::localize::Selection;
use posescope::scene::{LoosePhotos, Scene, SceneError};
use posescope::session::{Task, TaskScenes};

use super::args::TaskArgs;
use super::failure::CliError;

/// A task with its scenes and the named queries.
pub struct OpenedTask {
    pub task: Task,
    pub scenes: TaskScenes,
    /// The named queries, as positions in their scene.
    pub queries: Vec<usize>,
}

/// Opens the scenes and queries of the arguments. A query that is a file and not a frame of its scene is a
/// loose photo; either all queries are frames or all are photos.
pub fn open(args: &TaskArgs, scene: &str, queries: &[String]) -> Result<OpenedTask, CliError> {
    let mut task = args.task(scene)?;
    let mut first: Option<Arc<dyn Scene>> = None;
    if args.camera.is_none() && queries.iter().any(|query| Path::new(query).is_file()) {
        // The name of a frame means the frame. A file with an extension is a photo even where a frame has its number.
        let named = task.query_scene().unwrap_or(scene);
        let opened = posescope::scene::open(named, task.protocol.format.as_deref())?;
        let is_loose = |query: &&String| {
            let path = Path::new(query.as_str());
            let is_photo = path.is_file() && path.extension().is_some();
            !opened.frames().contains(query) && (is_photo || opened.find(query).is_err())
        };
        let loose = queries.iter().filter(is_loose).count();
        if loose > 0 && loose < queries.len() {
            return Err(CliError::Usage(
                "some queries are frames, others are photo files; localise them in separate runs"
                    .to_owned(),
            ));
        }
        if loose > 0 {
            task.photos = Some(LoosePhotos::default());
        }
        first = task.query_scene().is_none().then(|| Arc::from(opened));
    }
    if args.camera.is_some() || task.photos.is_some() {
        if task.query_scene().is_some() {
            return Err(CliError::Usage(
                "--query names photo files; leave out --query-scene, which is for frames"
                    .to_owned(),
            ));
        }
        for query in queries {
            std::fs::metadata(query).map_err(CliError::io(query))?;
        }
        task.photos = Some(LoosePhotos {
            paths: queries.iter().map(Into::into).collect(),
            camera: args.camera.clone(),
        });
        if !args.protocol.has("references") && task.protocol.gps.is_none() {
            task.protocol.select(Selection::Matched(1));
        }
    }
    let scenes = task.open(&|argument| first.clone().filter(|_| argument == scene))?;
    let queries = match &task.photos {
        Some(photos) => (0..photos.paths.len()).collect(),
        None => queries
            .iter()
            .map(|name| scenes.queries.find(name))
            .collect::<Result<_, SceneError>>()?,
    };
    Ok(OpenedTask { task, scenes, queries })
}
