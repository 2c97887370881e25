//! Rough positions of queries, for the choice of their references where nobody knows the truth or where
//! it is not to be used: a table with a line of column names and a line per frame, between commas or
//! white space.
//!
//! Either `name x y z`, in the world of the scene \[m\], or `name latitude longitude`, perhaps with
//! `altitude`, in degrees and metres. The latter are tied to the world by those lines that name frames
//! with a known pose.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use nalgebra::{Matrix3, Point3, Similarity3, Translation3, UnitQuaternion, Vector3};

use super::frame_names::FrameNames;
use super::lines::{Line, TextFile, excerpt_of};
use super::{Scene, SceneError};

/// The mean radius of the earth \[m\]. The fit takes up what is left of it.
const EARTH_RADIUS_M: f64 = 6_371_000.0;
/// Frames with a pose that tie latitudes and longitudes to a world.
const FEWEST_TIES: usize = 3;

/// A scene, some of whose frames are sought elsewhere than at their pose.
struct Located {
    scene: Arc<dyn Scene>,
    positions: BTreeMap<usize, Point3<f64>>,
}

/// The scene of queries with the positions of a file. Latitudes and longitudes are tied to the world by
/// the frames with a known pose that the file names too, of the queries' scene or that of the references.
///
/// # Errors
/// A file that cannot be read, is no such table, names none of the queries, or cannot be tied to the
/// world.
pub fn located(
    queries: Arc<dyn Scene>,
    references: &dyn Scene,
    path: &Path,
) -> Result<Arc<dyn Scene>, SceneError> {
    let file = TextFile::read(path)?;
    let rows = Row::read_all(&file)?;
    let world = match rows.first().map(|row| row.place) {
        Some(Place::Geographic { .. }) => Some(tie(&file, &rows, &[queries.as_ref(), references])?),
        _ => None,
    };
    let names = FrameNames::new(queries.as_ref());
    let mut positions = BTreeMap::new();
    for row in &rows {
        let Some(frame) = names.find(row.name) else {
            continue;
        };
        let position = match (row.place, &world) {
            (Place::World(position), _) => position,
            (Place::Geographic { .. }, Some(world)) => world.of(row.place),
            (Place::Geographic { .. }, None) => continue,
        };
        if positions.insert(frame, position).is_some() {
            let name = &queries.frames()[frame];
            return Err(row
                .line
                .error(format!("frame {name} has a position already")));
        }
    }
    if positions.is_empty() {
        return Err(file.error(format!(
            "positions of the queries of {} expected, which are called such as `{}`; here they are called \
             such as `{}`",
            queries.name(),
            queries.frames().first().map_or("", String::as_str),
            excerpt_of(rows.first().map_or("", |row| row.name), 60)
        )));
    }
    Ok(Arc::new(Located {
        scene: queries,
        positions,
    }))
}

/// A line of the table.
struct Row<'a> {
    line: Line<'a>,
    name: &'a str,
    place: Place,
}

/// Where something is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// In the frame of the scene's poses \[m\].
    World(Point3<f64>),
    /// \[°\] and \[m\].
    Geographic {
        latitude: f64,
        longitude: f64,
        altitude: f64,
    },
}

/// Where the columns are.
enum Columns {
    World([usize; 4]),
    Geographic([usize; 3], Option<usize>),
}

impl Columns {
    fn read(line: Line<'_>) -> Result<(Self, usize), SceneError> {
        let words: Vec<String> = line.words().map(str::to_lowercase).collect();
        let find = |called: &[&str]| {
            let is_one = |word: &String| called.contains(&word.as_str());
            words.iter().position(is_one)
        };
        let name = find(&["name", "frame", "image", "file", "filename"]);
        let world = [find(&["x"]), find(&["y"]), find(&["z"])];
        let geographic = [
            find(&["latitude", "lat"]),
            find(&["longitude", "lon", "lng"]),
        ];
        let altitude = find(&["altitude", "alt", "height"]);
        let columns = match (name, world, geographic) {
            (Some(name), [Some(x), Some(y), Some(z)], [None, None]) => Self::World([name, x, y, z]),
            (Some(name), [None, None, None], [Some(latitude), Some(longitude)]) => {
                Self::Geographic([name, latitude, longitude], altitude)
            }
            _ => {
                return Err(line.error(
                    "a first line with the columns `name x y z` or `name latitude longitude` \
                     (and perhaps `altitude`) expected",
                ));
            }
        };
        Ok((columns, words.len()))
    }
}

impl<'a> Row<'a> {
    fn read_all(file: &'a TextFile) -> Result<Vec<Self>, SceneError> {
        let mut lines = file.lines();
        let Some(first) = lines.next() else {
            return Err(file.error("positions expected, none found"));
        };
        let (columns, count) = Columns::read(first)?;
        let rows = lines.map(|line| Self::read(line, &columns, count));
        let rows = rows.collect::<Result<Vec<_>, _>>()?;
        match rows.is_empty() {
            true => Err(file.error("a line per frame below the names of columns expected")),
            false => Ok(rows),
        }
    }

    fn read(line: Line<'a>, columns: &Columns, count: usize) -> Result<Self, SceneError> {
        let words: Vec<&str> = line.words().collect();
        if words.len() != count {
            let found = words.len();
            return Err(line.error(format!("{count} columns expected, {found} found")));
        }
        let number = |at: usize| line.number(words[at]);
        let (name, place) = match *columns {
            Columns::World([name, x, y, z]) => {
                let position = Point3::new(number(x)?, number(y)?, number(z)?);
                (name, Place::World(position))
            }
            Columns::Geographic([name, latitude, longitude], altitude) => {
                let (latitude, longitude) = (number(latitude)?, number(longitude)?);
                if latitude.abs() > 89.0 || longitude.abs() > 360.0 {
                    return Err(line.error(format!(
                        "a latitude and a longitude in degrees expected, {latitude} {longitude} found"
                    )));
                }
                let altitude = altitude.map(number).transpose()?.unwrap_or(0.0);
                let place = Place::Geographic {
                    latitude,
                    longitude,
                    altitude,
                };
                (name, place)
            }
        };
        Ok(Self {
            line,
            name: words[name],
            place,
        })
    }
}

/// What takes latitudes and longitudes to a world.
struct Tie {
    latitude: f64,
    longitude: f64,
    world_from_local: Similarity3<f64>,
}

impl Tie {
    fn of(&self, place: Place) -> Point3<f64> {
        self.world_from_local * local(place, self.latitude, self.longitude)
    }
}

/// East, north, up of a point \[m\].
fn local(place: Place, latitude0: f64, longitude0: f64) -> Point3<f64> {
    match place {
        Place::World(position) => position,
        Place::Geographic {
            latitude,
            longitude,
            altitude,
        } => {
            let east = (longitude - longitude0).to_radians() * latitude0.to_radians().cos();
            let north = (latitude - latitude0).to_radians();
            Point3::new(EARTH_RADIUS_M * east, EARTH_RADIUS_M * north, altitude)
        }
    }
}

/// Fits the similarity that takes places to the poses of the frames that have both.
fn tie(file: &TextFile, rows: &[Row<'_>], scenes: &[&dyn Scene]) -> Result<Tie, SceneError> {
    let names: Vec<_> = scenes
        .iter()
        .map(|scene| (FrameNames::new(*scene), scene))
        .collect();
    let pose = |row: &Row<'_>| {
        let mut poses = names
            .iter()
            .filter_map(|(names, scene)| scene.pose(names.find(row.name)?));
        poses.next().map(|pose| pose.translation.vector)
    };
    let ties: Vec<(Place, Vector3<f64>)> = rows
        .iter()
        .filter_map(|row| Some((row.place, pose(row)?)))
        .collect();
    if ties.len() < FEWEST_TIES {
        return Err(file.error(format!(
            "{FEWEST_TIES} frames with a known pose or more expected, which tie latitudes and longitudes to \
             the scene, {} found; or give x, y and z",
            ties.len()
        )));
    }
    let Some(&(
        Place::Geographic {
            latitude,
            longitude,
            ..
        },
        _,
    )) = ties.first()
    else {
        return Err(file.error("latitudes and longitudes expected"));
    };
    let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = ties
        .iter()
        .map(|(place, world)| (local(*place, latitude, longitude).coords, *world))
        .collect();
    let world_from_local = similarity(&pairs).ok_or_else(|| {
        file.error("frames with a known pose at different places expected, which tie the file to the scene")
    })?;
    let squares = pairs.iter().map(|(from, to)| {
        let at = world_from_local * Point3::from(*from);
        (at.coords - to).norm_squared()
    });
    let rms = (squares.sum::<f64>() / pairs.len() as f64).sqrt();
    log::info!(
        "{} frames tie latitudes and longitudes to the scene, within {rms:.2} m (RMS) at a scale of {:.4}",
        pairs.len(),
        world_from_local.scaling()
    );
    Ok(Tie {
        latitude,
        longitude,
        world_from_local,
    })
}

/// The similarity that takes the first of each pair nearest to the second, by least squares (Umeyama,
/// PAMI 1991); none where all firsts or all seconds are in one place.
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
    let shift = to - rotation * from * scale;
    Some(Similarity3::from_parts(
        Translation3::from(shift),
        rotation,
        scale,
    ))
}

impl Scene for Located {
    posescope_core::inner_scene!(scene: name, frames, intrinsics, pose, time_s, has_cloud, photo, cloud, query, reference, fingerprint, as_degraded);

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
