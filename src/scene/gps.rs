//! Rough positions of queries, to choose references if poses are unknown or must not be used: a table with a header
//! and one line per frame, separated by commas or white space.
//!
//! The columns are `name x y z`, in the scene's world frame \[m\], or `name latitude longitude` and optionally
//! `altitude`, in degrees and metres. The latter are converted to the world frame by the lines of frames with a known
//! pose.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Similarity3, Translation3, UnitQuaternion, Vector3};

use super::frame_names::FrameNames;
use super::lines::{FARTHEST, Line, NAMES, TextFile, is_near};
use super::{Scene, SceneError};

/// The radius of the earth at the equator \[m\], as in KITTI's devkit.
pub(super) const EARTH_RADIUS_M: f64 = 6_378_137.0;

/// A scene with rough positions for some frames.
struct Located {
    scene: Arc<dyn Scene>,
    positions: BTreeMap<usize, Point3<f64>>,
}

/// The scene of queries with the positions of a file. Latitudes and longitudes are converted to the world frame by
/// frames of either scene that have a known pose and are in the file.
///
/// # Errors
/// A file that cannot be read, is not such a table, names none of the queries, or cannot be converted.
pub fn located(
    queries: Arc<dyn Scene>,
    references: &dyn Scene,
    path: &Path,
) -> Result<Arc<dyn Scene>, SceneError> {
    let file = TextFile::named(path)?;
    let (is_geographic, rows) = read_rows(&file)?;
    let scenes = [queries.as_ref(), references];
    let world = is_geographic.then(|| Tie::fit(&file, &rows, scenes)).transpose()?;
    let names = FrameNames::new(queries.as_ref());
    let mut positions = BTreeMap::new();
    let mut strangers = Vec::new();
    for (row, frame) in rows.iter().zip(names.find_all(rows.iter().map(|row| row.name))) {
        let Some(frame) = frame else {
            strangers.push(row.name);
            continue;
        };
        let position = match &world {
            None => row.place.into(),
            Some(tie) => tie.of(row.place),
        };
        if positions.insert(frame, position).is_some() {
            let expected = format!(
                "one position per frame expected, frame {} has one already",
                queries.frames()[frame]
            );
            return Err(row.line.error(expected));
        }
    }
    if positions.is_empty() {
        let called = rows.first().map_or("", |row| row.name);
        return Err(file.error(names.none_found("positions of the queries", called)));
    }
    if world.is_none() {
        names.warn_of_strangers(&file.name(), "positions", &strangers, rows.len());
    }
    Ok(Arc::new(Located { scene: queries, positions }))
}

struct Row<'a> {
    line: Line<'a>,
    name: &'a str,
    /// x, y, z in the frame of the scene's poses \[m\], or latitude and longitude \[°\], and altitude \[m\].
    place: [f64; 3],
}

/// The rows, and whether they have latitudes and longitudes.
fn read_rows(file: &TextFile) -> Result<(bool, Vec<Row<'_>>), SceneError> {
    let mut lines = file.lines();
    let Some(first) = lines.next() else {
        return Err(file.error("positions expected, none found"));
    };
    let words = first.header().unwrap_or_default();
    let find = |called: &[&str]| words.iter().position(|word| called.contains(&word.as_str()));
    let name = find(NAMES);
    let world = [find(&["x"]), find(&["y"]), find(&["z"])];
    let latitude = find(&["latitude", "lat"]);
    let longitude = find(&["longitude", "lon", "lng"]);
    let altitude = find(&["altitude", "alt", "height"]);
    let (is_geographic, name, columns) = match (name, world, [latitude, longitude]) {
        (Some(name), [Some(_), Some(_), Some(_)], [None, None]) => (false, name, world),
        (Some(name), [None, None, None], [Some(_), Some(_)]) => {
            (true, name, [latitude, longitude, altitude])
        }
        _ => {
            return Err(first.error(
                "a header with the columns `name x y z`, or `name latitude longitude` \
                 and optionally `altitude`, expected",
            ));
        }
    };
    let mut rows = Vec::new();
    for line in lines {
        let found = line.fields();
        if found.len() != words.len() {
            let (count, found) = (words.len(), found.len());
            return Err(line.error(format!("{count} columns expected, {found} found")));
        }
        let mut place = [0.0; 3];
        for (number, column) in place.iter_mut().zip(columns) {
            if let Some(column) = column {
                *number = line.number(found[column])?;
            }
        }
        let [latitude, longitude, _] = place;
        if is_geographic && (latitude.abs() > 89.0 || longitude.abs() > 360.0) {
            return Err(line.error(format!(
                "a latitude and a longitude in degrees expected, {latitude:?} {longitude:?} found"
            )));
        }
        if !place.iter().all(is_near) {
            return Err(line
                .error(format!("a position within {FARTHEST:e} of 0 expected, {place:?} found")));
        }
        let name = found[name];
        rows.push(Row { line, name, place });
    }
    if rows.is_empty() {
        Err(file.error("one line per frame below the header expected, none found"))
    } else {
        Ok((is_geographic, rows))
    }
}

/// The conversion of latitudes, longitudes and altitudes to a world frame.
struct Tie {
    origin: [f64; 3],
    world_from_local: Similarity3<f64>,
}

impl Tie {
    fn of(&self, place: [f64; 3]) -> Point3<f64> {
        self.world_from_local * local(place, self.origin)
    }

    /// Fits the similarity between places and poses of the frames that have both.
    fn fit(file: &TextFile, rows: &[Row<'_>], scenes: [&dyn Scene; 2]) -> Result<Self, SceneError> {
        let names = rows.iter().map(|row| row.name);
        let found = scenes.map(|scene| (scene, FrameNames::new(scene).find_all(names.clone())));
        let pose = |row: usize| found.iter().find_map(|(scene, frames)| scene.pose(frames[row]?));
        let ties = rows.iter().enumerate();
        let ties: Vec<([f64; 3], Vector3<f64>)> =
            ties.filter_map(|(at, row)| Some((row.place, pose(at)?.translation.vector))).collect();
        let [(origin, _), _, _, ..] = ties[..] else {
            return Err(file.error(format!(
                "at least 3 frames with a known pose expected, to convert latitudes and longitudes to the \
                 scene, {} found; add such lines, or give x, y and z",
                ties.len()
            )));
        };
        let pairs: Vec<(Vector3<f64>, Vector3<f64>)> =
            ties.iter().map(|(place, world)| (local(*place, origin).coords, *world)).collect();
        let world_from_local = similarity(&pairs).ok_or_else(|| {
            file.error("frames with a known pose at different places expected, to convert latitudes and longitudes")
        })?;
        let squares = pairs.iter().map(|(from, to)| {
            let at = world_from_local * Point3::from(*from);
            (at.coords - to).norm_squared()
        });
        let rms = (squares.sum::<f64>() / pairs.len() as f64).sqrt();
        log::info!(
            "latitudes and longitudes converted by {} frames, residual {rms:.2} m (RMS), scale {:.4}",
            pairs.len(),
            world_from_local.scaling()
        );
        Ok(Self { origin, world_from_local })
    }
}

/// Metres east and north of an origin, and the altitude.
fn local([latitude, longitude, altitude]: [f64; 3], origin: [f64; 3]) -> Point3<f64> {
    let east = (longitude - origin[1]).to_radians() * origin[0].to_radians().cos();
    let north = (latitude - origin[0]).to_radians();
    Point3::new(EARTH_RADIUS_M * east, EARTH_RADIUS_M * north, altitude)
}

/// The least-squares similarity from the first to the second of each pair (Umeyama, PAMI 1991). `None` if all first or
/// all second points coincide.
fn similarity(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> Option<Similarity3<f64>> {
    let count = pairs.len() as f64;
    let from = pairs.iter().map(|(from, _)| from).sum::<Vector3<f64>>() / count;
    let to = pairs.iter().map(|(_, to)| to).sum::<Vector3<f64>>() / count;
    let mut covariance = Matrix3::zeros();
    let mut variance = 0.0;
    for (a, b) in pairs {
        covariance += (b - to) * (a - from).transpose() / count;
        variance += (a - from).norm_squared() / count;
    }
    let decomposition = covariance.svd(true, true);
    let (u, v_t) = (decomposition.u?, decomposition.v_t?);
    let sign = (u.determinant() * v_t.determinant()).signum();
    let signs = Vector3::new(1.0, 1.0, sign);
    let rotation = u * Matrix3::from_diagonal(&signs) * v_t;
    let scale = decomposition.singular_values.dot(&signs) / variance;
    if !(scale.is_finite() && scale > 0.0) {
        return None;
    }
    let rotation = UnitQuaternion::from_matrix(&rotation);
    let shift = Translation3::from(to - rotation * from * scale);
    Some(Similarity3::from_parts(shift, rotation, scale))
}

impl Scene for Located {
    posescope_core::inner_scene!(scene: name, frames, other_name, pixel_map, intrinsics, pose, time_s, has_cloud, photo, cloud, cloud_at, query, reference, fingerprint, lengths, cloud_facts, as_degraded);

    fn position(&self, frame: usize) -> Option<Point3<f64>> {
        let known = self.positions.get(&frame).copied();
        known.or_else(|| self.scene.position(frame))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_similarity_is_found_again_from_places_in_a_plane() {
        let truth = Similarity3::from_parts(
            Translation3::new(3.0, -20.0, 7.0),
            UnitQuaternion::from_euler_angles(0.3, -1.2, 2.0),
            0.5,
        );
        let places = [(0.0, 0.0), (30.0, 2.0), (60.0, 25.0), (55.0, 70.0)];
        let pairs: Vec<_> = places
            .map(|(x, y)| Point3::new(x, y, 0.0))
            .map(|place| (place.coords, (truth * place).coords))
            .into();
        let found = similarity(&pairs).expect("places are different");
        let at = Point3::new(40.0, 10.0, 0.0);
        assert!((found * at - truth * at).norm() < 1e-9);
        assert!((found.scaling() - 0.5).abs() < 1e-12);
        assert!(similarity(&[(Vector3::zeros(), Vector3::zeros()); 3]).is_none());
    }
}
