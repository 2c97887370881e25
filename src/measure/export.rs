//! Exports the poses of a run in formats of other programs.
//!
//! A run contains poses `world_from_camera` with x right, y down, z forward. Queries without a pose are left out.
//! A format that cannot leave them out is refused: poses are never invented.

use std::path::Path;

use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use crate::covariance::PoseCovariance;
use crate::geometry::Pose;
use crate::localize::QueryResult;
use crate::method::Method;
use crate::run::{FolderError, QueryCamera, RunFile, RunItem, read_results};

/// A format to export to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// TUM RGB-D and evo: `time x y z qx qy qz qw`, camera to world.
    Tum,
    /// KITTI odometry: twelve numbers of `[R|t]`, camera to world; a line for each frame.
    Kitti,
    /// A COLMAP text model without points: world to camera.
    Colmap,
    /// visuallocalization.net: `name qw qx qy qz x y z`, world to camera.
    Vloc,
    /// ROS: a YAML document of a `geometry_msgs/PoseWithCovarianceStamped` for each pose, camera to world.
    Ros,
}

/// Why a run cannot be exported in a format.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The run cannot be read.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A query has several matching results.
    #[error(
        "query {query} has several results; choose one, for example with --where 'method = {}'; results differ in \
         the fields method, fusion, radius, references and scene",
        methods.first().map_or("fb", |method| method.name())
    )]
    Ambiguous {
        /// The query.
        query: String,
        /// The methods of the run.
        methods: Vec<Method>,
    },
    /// No result is left to export.
    #[error("no result of the run meets the condition; change --where")]
    Nothing,
    /// The format cannot hold a missing pose.
    #[error(
        "kitti has one line per frame and cannot leave out a pose: {0}; use --as vloc or colmap"
    )]
    Gap(String),
    /// The format cannot hold a name.
    #[error(
        "vloc has names without white space, commas and # in front, `{0}` is another; use --as colmap"
    )]
    Name(String),
    /// The format needs times, and the scene has none.
    #[error("{1} needs times, and the frames of {0} have none; use --as vloc or colmap")]
    NoTime(String, &'static str),
    /// The format needs covariances, and a pose has none.
    #[error(
        "ros needs a covariance, and the pose of query {0} has none; use --as tum, vloc or colmap"
    )]
    NoCovariance(String),
}

/// Chooses the results to export.
type Choice<'a> = &'a dyn Fn(&QueryResult) -> bool;

/// A file of an export: its name, if there are several, and its content.
pub type ExportedFile = (&'static str, String);

/// The files of an export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Export {
    /// One file, or those of a folder.
    pub files: Vec<ExportedFile>,
    /// Queries left out because they have no pose.
    pub excluded: usize,
}

/// A query with its result.
struct Localized<'a> {
    item: RunItem<'a>,
    pose: Option<Pose>,
    covariance: Option<PoseCovariance>,
}

impl Localized<'_> {
    /// When the photo was taken \[s\].
    fn time_s(&self, format: &'static str) -> Result<f64, ExportError> {
        let scene = &self.item.pair.query_scene;
        self.item.time_s.ok_or_else(|| ExportError::NoTime(scene.clone(), format))
    }
}

/// Exports the results of a run that `takes` chooses, at most one per query.
///
/// # Errors
/// [`ExportError`].
pub fn export(
    folder: &Path,
    run: &RunFile,
    format: Format,
    takes: Choice<'_>,
) -> Result<Export, ExportError> {
    let localized = localized(folder, run, takes)?;
    if localized.is_empty() {
        return Err(ExportError::Nothing);
    }
    let excluded = localized.iter().filter(|one| one.pose.is_none()).count();
    let files = match format {
        Format::Tum => vec![("", tum(&localized)?)],
        Format::Kitti => vec![("", kitti(&localized)?)],
        Format::Vloc => vec![("", vloc(&localized)?)],
        Format::Colmap => colmap(&localized),
        Format::Ros => vec![("", ros(&localized)?)],
    };
    Ok(Export { files, excluded })
}

/// One result per query, in the order of the run.
fn localized<'a>(
    folder: &Path,
    run: &'a RunFile,
    takes: Choice<'_>,
) -> Result<Vec<Localized<'a>>, ExportError> {
    let per_item = run.results_per_item();
    let mut all = Vec::new();
    let mut results = read_results(folder, run)?.into_iter();
    for item in run.items() {
        let mut chosen: Option<QueryResult> = None;
        for result in results.by_ref().take(per_item) {
            if !takes(&result) {
                continue;
            }
            if chosen.is_some() {
                return Err(ExportError::Ambiguous {
                    query: item.query.to_owned(),
                    methods: run.protocol.methods.clone(),
                });
            }
            chosen = Some(result);
        }
        if let Some(result) = chosen {
            let pose = result.pose.as_ref().map(|report| {
                let [x, y, z, w] = report.quaternion_xyzw;
                Pose::from_parts(
                    Translation3::from(report.position_m),
                    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
                )
            });
            let covariance = result.confidence.and_then(|confidence| confidence.covariance);
            all.push(Localized { item, pose, covariance });
        }
    }
    Ok(all)
}

fn tum(localized: &[Localized<'_>]) -> Result<String, ExportError> {
    let mut text = "# time x y z qx qy qz qw\n".to_owned();
    for one in localized {
        let Some(pose) = one.pose else { continue };
        let time = one.time_s("tum")?;
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        text += &format!("{time} {} {} {} {} {} {} {}\n", t.x, t.y, t.z, q.x, q.y, q.z, q.w);
    }
    Ok(text)
}

fn kitti(localized: &[Localized<'_>]) -> Result<String, ExportError> {
    let mut text = String::new();
    for (line, Localized { item, pose, .. }) in localized.iter().enumerate() {
        if item.query.parse() != Ok(line) {
            return Err(ExportError::Gap(format!("frame {line} is not a query")));
        }
        let Some(pose) = pose else {
            return Err(ExportError::Gap(format!("query {} has no pose", item.query)));
        };
        let matrix = crate::geometry::matrix_from_pose(pose);
        let rows = (0..3).flat_map(|row| (0..4).map(move |column| (row, column)));
        let numbers: Vec<String> = rows.map(|place| matrix[place].to_string()).collect();
        text += &format!("{}\n", numbers.join(" "));
    }
    Ok(text)
}

/// `qw qx qy qz x y z` of world to camera.
fn camera_from_world(pose: &Pose) -> String {
    let pose = pose.inverse();
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    format!("{} {} {} {} {} {} {}", q.w, q.x, q.y, q.z, t.x, t.y, t.z)
}

fn vloc(localized: &[Localized<'_>]) -> Result<String, ExportError> {
    let mut text = String::new();
    for Localized { item, pose, .. } in localized {
        let Some(pose) = pose else { continue };
        // A name is the first word of a line.
        let is_word = |c: char| !c.is_whitespace() && c != ',';
        if item.query.starts_with('#') || !item.query.chars().all(is_word) {
            return Err(ExportError::Name(item.query.to_owned()));
        }
        text += &format!("{} {}\n", item.query, camera_from_world(pose));
    }
    Ok(text)
}

/// As `ros2 topic echo` prints messages. Frame `map` has the axes of the scene.
fn ros(localized: &[Localized<'_>]) -> Result<String, ExportError> {
    let mut text = String::new();
    for one in localized {
        let Some(pose) = one.pose else { continue };
        let query = one.item.query;
        let covariance =
            one.covariance.ok_or_else(|| ExportError::NoCovariance(query.to_owned()))?;
        let time_s = one.time_s("ros")?;
        // Nanoseconds count up from whole seconds, also before zero.
        let second = time_s.floor();
        let nanosecond = ((time_s - second) * 1e9).round().min(999_999_999.0);
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        let in_world = covariance.in_world_axes(&pose).transpose();
        let numbers: Vec<String> = in_world.iter().map(ToString::to_string).collect();
        text += &format!(
            "header:\n  stamp:\n    sec: {}\n    nanosec: {}\n  frame_id: map\npose:\n  pose:\n    position:\n      \
             x: {}\n      y: {}\n      z: {}\n    orientation:\n      x: {}\n      y: {}\n      z: {}\n      w: {}\n  \
             covariance: [{}]\n---\n",
            second as i64,
            nanosecond as u32,
            t.x,
            t.y,
            t.z,
            q.x,
            q.y,
            q.z,
            q.w,
            numbers.join(", ")
        );
    }
    Ok(text)
}

fn colmap(localized: &[Localized<'_>]) -> Vec<ExportedFile> {
    let mut cameras: Vec<QueryCamera> = Vec::new();
    let mut images = "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then its points\n".to_owned();
    for (index, one) in localized.iter().enumerate() {
        let camera = one.item.camera;
        let known = cameras.iter().position(|known| *known == camera);
        let camera = known.unwrap_or_else(|| {
            cameras.push(camera);
            cameras.len() - 1
        });
        let Some(pose) = &one.pose else { continue };
        images += &format!(
            "{} {} {} {}\n\n",
            index + 1,
            camera_from_world(pose),
            camera + 1,
            one.item.query
        );
    }
    let mut text = "# CAMERA_ID MODEL WIDTH HEIGHT FX FY CX CY\n".to_owned();
    for (index, camera) in cameras.iter().enumerate() {
        // The centre of COLMAP's first pixel is (0.5, 0.5).
        text += &format!(
            "{} PINHOLE {} {} {} {} {} {}\n",
            index + 1,
            camera.width,
            camera.height,
            camera.fx,
            camera.fy,
            camera.cx + 0.5,
            camera.cy + 0.5
        );
    }
    vec![
        ("cameras.txt", text),
        ("images.txt", images),
        ("points3D.txt", "# no points\n".to_owned()),
    ]
}
