//! The scenes and queries of a command line, opened.

use std::path::Path;
use std::sync::Arc;

use posescope::camera::Intrinsics;
use posescope::localize::Selection;
use posescope::params::Params;
use posescope::run::{MapFit, Protocol, SurveyFile, fit_of_map, survey_of};
use posescope::scene::{LoosePhotos, Scene, SceneError, SceneSize};
use posescope::session::{Task, TaskScenes};

use super::args::TaskArgs;
use super::failure::CliError;

/// What follows from the size of a scene, in one line; nothing for a scene of the paper's scale.
pub fn size_line(size: &SceneSize, protocol: &Protocol, params: &Params) -> Option<String> {
    let unit = if size.scale.is_metric() { " m" } else { "" };
    let depth = size.depth_m.filter(|_| *size != SceneSize::PAPER)?;
    let grid = &params.grid;
    Some(format!(
        "What the cameras see is {depth:.1}{unit} away: search radius {}{unit}, steps {}{unit} and {}{unit}, right \
         within {}{unit} and {}°; --radius, --set and --right change this",
        protocol.radius_m(),
        grid.coarse_step_m,
        grid.fine_step_m,
        protocol.right.translation_m,
        protocol.right.rotation_deg,
    ))
}

/// Why a search with these settings cannot work in a scene of this size, with the settings that fit.
pub fn misfit(
    size: &SceneSize,
    protocol: &Protocol,
    params: &Params,
    camera: &Intrinsics,
) -> Option<String> {
    /// A coarse step moves what the camera sees by no more than this share of the photo. In the paper's scenes it is
    /// 5 %; basins of the costs are a few times as wide.
    const MAX_SHIFT: f64 = 0.15;
    let depth = size.depth_m?;
    let (fitting, grid) = (params.defaults(), &params.grid);
    let shift = camera.fx * grid.coarse_step_m / depth / f64::from(camera.width);
    if shift > MAX_SHIFT {
        let most = MAX_SHIFT * depth * f64::from(camera.width) / camera.fx;
        return Some(format!(
            "a coarse step of {} moves what the camera sees by {:.0} % of the photo, too far for the search; \
             --set grid.coarse_step={} fits",
            grid.coarse_step_m,
            100.0 * shift,
            fitting.grid.coarse_step_m.min(rounded_down(most))
        ));
    }
    let (radius_m, fitting_m) = (protocol.radius_m(), size.radius_m());
    let reach_m = size.extent_m? + depth;
    if radius_m > reach_m.max(fitting_m) {
        return Some(format!(
            "a radius of {radius_m} reaches beyond the whole map; --radius {fitting_m} fits"
        ));
    }
    let turn_deg = size.turn_deg?;
    (turn_deg > grid.yaw_range_deg).then(|| {
        format!(
            "neighbouring frames are turned by {turn_deg:.0}°, and pm and mi search headings within {}°; \
             --set grid.yaw_range={:.0} fits",
            grid.yaw_range_deg,
            (1.5 * turn_deg).min(180.0).ceil()
        )
    })
}

/// A number with two digits that is not larger.
fn rounded_down(number: f64) -> f64 {
    let digit = 10_f64.powf(number.log10().floor() - 1.0);
    let rounded = (number / digit).floor() * digit;
    // As people write it: the product has digits of its rounding.
    format!("{rounded:.*}", (-digit.log10()).max(0.0) as usize).parse().unwrap_or(rounded)
}

/// A task with its scenes and the named queries.
pub struct OpenedTask {
    pub task: Task,
    pub scenes: TaskScenes,
    /// The named queries, as positions in their scene.
    pub queries: Vec<usize>,
    /// The size of the references' scene.
    pub size: SceneSize,
    /// The survey that confidence follows.
    pub survey: Option<SurveyFile>,
}

/// Opens the scenes and queries of the arguments. A query that is a file and not a frame of its scene is a
/// loose photo; either all queries are frames or all are photos. Whether a map is examined
/// that was not before, which takes seconds, `examines_map` says.
pub fn open(
    args: &TaskArgs,
    scene: &str,
    queries: &[String],
    examines_map: &dyn Fn() -> bool,
) -> Result<OpenedTask, CliError> {
    let mut task = args.task(scene, &SceneSize::PAPER)?;
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
    let size = SceneSize::of(scenes.references.as_ref());
    if size != SceneSize::PAPER {
        let Task { protocol, params, .. } = args.task(scene, &size)?;
        task.protocol = Protocol { references: task.protocol.references, ..protocol };
        task.params = params;
    }
    let survey = survey_of(task.protocol.survey.as_ref(), scenes.references.as_ref(), scene)?;
    if let Some(file) = &survey {
        task.params.survey = file.survey.clone();
    }
    let MapFit { mistake, frame_pairs } =
        fit_of_map(scenes.references.as_ref(), scene, examines_map);
    task.params.mistake_of_map = mistake;
    task.params.frame_pairs = frame_pairs;
    let queries = match &task.photos {
        Some(photos) => (0..photos.paths.len()).collect(),
        None => queries
            .iter()
            .map(|name| scenes.queries.find(name))
            .collect::<Result<_, SceneError>>()?,
    };
    Ok(OpenedTask { task, scenes, queries, size, survey })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_that_does_not_suit_the_scene_is_named_with_one_that_does() {
        let camera =
            Intrinsics { fx: 585.0, fy: 585.0, cx: 320.0, cy: 240.0, width: 640, height: 480 };
        let size = |turn_deg: f64| SceneSize {
            depth_m: Some(12.0),
            spacing_m: Some(1.0),
            turn_deg: Some(turn_deg),
            extent_m: Some(30.0),
            ..SceneSize::PAPER
        };
        let misfit = |radius_m: f64, step: &str, turn_deg: f64| {
            let protocol = Protocol { radii_m: vec![radius_m], ..Protocol::default() };
            let mut params = Params::default();
            params.assign(&format!("grid.coarse_step={step}")).expect("a good value");
            misfit(&size(turn_deg), &protocol, &params, &camera)
        };
        let has = |said: Option<String>, words: &str| {
            let said = said.expect("does not suit");
            assert!(said.contains(words), "{said}");
        };
        assert_eq!(misfit(15.0, "1", 3.0), None);
        assert_eq!(misfit(40.0, "1", 3.0), None);
        has(misfit(15.0, "3", 3.0), "--set grid.coarse_step=1 fits");
        has(misfit(43.0, "1", 3.0), "--radius 15 fits");
        has(misfit(15.0, "1", 12.0), "--set grid.yaw_range=18 fits");
    }

    #[test]
    fn a_value_that_is_offered_fits() {
        /// The number after these words.
        fn offered(said: &str, words: &str) -> Option<f64> {
            let rest = said.split_once(words)?.1;
            rest.split(' ').next()?.parse().ok()
        }
        let mut steps = 0;
        for depth in [0.02, 0.37, 1.8, 4.2, 12.0, 61.0] {
            for focal in [120.0, 585.0, 5850.0] {
                for (radius_m, turn_deg) in [(15.0, 3.0), (900.0, 40.0)] {
                    let camera = Intrinsics {
                        fx: focal,
                        fy: focal,
                        cx: 320.0,
                        cy: 240.0,
                        width: 640,
                        height: 480,
                    };
                    let size = SceneSize {
                        depth_m: Some(depth),
                        spacing_m: Some(1.0),
                        turn_deg: Some(turn_deg),
                        extent_m: Some(30.0),
                        ..SceneSize::PAPER
                    };
                    let mut protocol = Protocol { radii_m: vec![radius_m], ..Protocol::default() };
                    let mut params = Params::default();
                    // Each option is named once at most.
                    for _ in 0..3 {
                        let Some(said) = misfit(&size, &protocol, &params, &camera) else { break };
                        if let Some(step) = offered(&said, "grid.coarse_step=") {
                            assert!(step < params.grid.coarse_step_m, "{said}");
                            params.assign(&format!("grid.coarse_step={step}")).expect("in range");
                            steps += 1;
                        } else if let Some(range) = offered(&said, "grid.yaw_range=") {
                            params.assign(&format!("grid.yaw_range={range}")).expect("in range");
                        } else {
                            protocol.radii_m = vec![offered(&said, "--radius ").expect(&said)];
                        }
                    }
                    assert_eq!(misfit(&size, &protocol, &params, &camera), None);
                }
            }
        }
        assert!(steps > 10, "{steps}");
    }
}
