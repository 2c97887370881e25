//! E57 (ASTM E2807): scans of laser scanners, each moved by its own pose.

use std::io::BufReader;
use std::path::Path;

use e57::{E57Reader, PointCloud, RecordDataType, RecordName, RecordValue};
use nalgebra::{Isometry3, Point3, Quaternion, UnitQuaternion, Vector3};
use posescope_core::files;

use super::decoding::decoded;
use super::{Collector, MapCloud};

/// Reads the points of all scans, in the frame of the file.
pub(super) fn read(path: &Path, _size: u64) -> Result<MapCloud, String> {
    decoded(|| points(path))
}

fn points(path: &Path) -> Result<MapCloud, String> {
    let text = |error: e57::Error| error.to_string();
    let file = files::open(path).map_err(|error| error.to_string())?;
    let mut reader = E57Reader::new(BufReader::new(file)).map_err(text)?;
    let mut cloud = Collector::default();
    for scan in reader.pointclouds() {
        expect_room(&scan)?;
        let layout = Layout::of(&scan)?;
        let file_from_scan = pose(&scan);
        // The crate's reader of whole points ends where a packet has none.
        for values in reader.pointcloud_raw(&scan).map_err(text)? {
            match layout.point(&values.map_err(text)?).map_err(text)? {
                Some(point) => cloud.add((file_from_scan * point).into())?,
                None => cloud.add_no_return(),
            }
        }
    }
    Ok(cloud.finish())
}

/// The pose of a scan; without one it is in the frame of the file.
fn pose(scan: &PointCloud) -> Isometry3<f64> {
    scan.transform.as_ref().map_or_else(Isometry3::identity, |found| {
        let (turn, shift) = (&found.rotation, &found.translation);
        Isometry3::from_parts(
            Vector3::new(shift.x, shift.y, shift.z).into(),
            UnitQuaternion::from_quaternion(Quaternion::new(turn.w, turn.x, turn.y, turn.z)),
        )
    })
}

/// Where the coordinates of a point are among its values, each with its type.
struct Layout<'a> {
    is_spherical: bool,
    coordinates: [(usize, &'a RecordDataType); 3],
    /// The number that is 0 for a point, and another one for a direction or nothing.
    state: Option<(usize, &'a RecordDataType)>,
}

impl<'a> Layout<'a> {
    fn of(scan: &'a PointCloud) -> Result<Self, String> {
        use RecordName as R;
        let find = |name: R| {
            let mut records = scan.prototype.iter().enumerate();
            records.find(|(_, one)| one.name == name).map(|(at, one)| (at, &one.data_type))
        };
        let all = |names: [R; 3]| {
            let [a, b, c] = names.map(find);
            Some([a?, b?, c?])
        };
        if let Some(coordinates) = all([R::CartesianX, R::CartesianY, R::CartesianZ]) {
            let state = find(R::CartesianInvalidState);
            return Ok(Self { is_spherical: false, coordinates, state });
        }
        let names = [R::SphericalRange, R::SphericalAzimuth, R::SphericalElevation];
        let coordinates =
            all(names).ok_or("coordinates x, y, z or range, azimuth, elevation expected")?;
        Ok(Self { is_spherical: true, coordinates, state: find(R::SphericalInvalidState) })
    }

    /// The point, in the frame of its scan; `None` for a beam without return.
    fn point(&self, values: &[RecordValue]) -> Result<Option<Point3<f64>>, e57::Error> {
        if let Some((at, of)) = self.state
            && values[at].to_i64(of)? != 0
        {
            return Ok(None);
        }
        let [a, b, c] = self.coordinates.map(|(at, of)| values[at].to_f64(of));
        let (a, b, c) = (a?, b?, c?);
        Ok(Some(if self.is_spherical {
            let (azimuth, elevation) = (b.sin_cos(), c.sin_cos());
            Point3::new(a * elevation.1 * azimuth.1, a * elevation.1 * azimuth.0, a * elevation.0)
        } else {
            Point3::new(a, b, c)
        }))
    }
}

/// Refuses a scan whose points take no room in the file, so that no size of it limits their number.
fn expect_room(scan: &PointCloud) -> Result<(), String> {
    let takes_room = scan.prototype.iter().any(|record| match record.data_type {
        RecordDataType::Single { .. } | RecordDataType::Double { .. } => true,
        RecordDataType::ScaledInteger { min, max, .. } | RecordDataType::Integer { min, max } => {
            min < max
        }
    });
    if takes_room || scan.records == 0 {
        return Ok(());
    }
    Err(format!("points with coordinates expected, {} without any found", scan.records))
}

#[cfg(test)]
mod tests {
    use std::fs::OpenOptions;

    use e57::{E57Writer, Record, Transform, Translation};
    use tempfile::TempDir;

    use super::super::{Note, read};
    use super::*;

    /// Writes one scan per transform, with the points and whether each is valid.
    fn write(path: &Path, points: &[([f64; 3], i64)], transforms: &[Option<Transform>]) {
        let mut writer = E57Writer::from_file(path, "file").expect("writable");
        for (at, transform) in transforms.iter().enumerate() {
            let state = Record {
                name: e57::RecordName::CartesianInvalidState,
                data_type: RecordDataType::Integer { min: 0, max: 2 },
            };
            let prototype = vec![
                Record::CARTESIAN_X_F64,
                Record::CARTESIAN_Y_F64,
                Record::CARTESIAN_Z_F64,
                state,
            ];
            let mut scan = writer.add_pointcloud(&format!("scan {at}"), prototype).expect("a scan");
            scan.set_transform(transform.clone());
            for (point, state) in points {
                let mut values = point.map(RecordValue::Double).to_vec();
                values.push(RecordValue::Integer(*state));
                scan.add_point(values).expect("a point");
            }
            scan.finalize().expect("written");
        }
        writer.finalize().expect("written");
    }

    #[test]
    fn scans_are_moved_by_their_poses_and_beams_without_return_are_left_out() {
        let folder = TempDir::new().expect("a folder");
        let path = folder.path().join("a.e57");
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let turned = Transform {
            rotation: e57::Quaternion { w: half, x: 0.0, y: 0.0, z: half },
            translation: Translation { x: 691_000.0, y: 5_336_000.0, z: 500.0 },
        };
        let points = [([1.0, 2.0, 3.0], 0), ([4.0, 5.0, 6.0], 1), ([7.0, 8.0, 9.5], 2)];
        write(&path, &points, &[Some(turned.clone()), Some(turned)]);
        let cloud = read(&path).expect("readable");
        let expected = Point3::new(691_000.0 - 2.0, 5_336_000.0 + 1.0, 503.0);
        let found: Vec<Point3<f64>> = cloud.positions().collect();
        assert_eq!(found.len(), 2);
        assert!(found.iter().all(|point| (point - expected).norm() < 1e-3), "{found:?}");
        assert_eq!(cloud.notes, [Note::NoReturn(4)]);
        // Ten metres at 90° and 30° above, in spherical coordinates.
        let mut writer = E57Writer::from_file(&path, "file").expect("writable");
        let double = |name: RecordName| Record {
            name,
            data_type: RecordDataType::Double { min: None, max: None },
        };
        use RecordName as R;
        let prototype = [R::SphericalRange, R::SphericalAzimuth, R::SphericalElevation].map(double);
        let mut scan = writer.add_pointcloud("scan", prototype.to_vec()).expect("a scan");
        let angles = [10.0, std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_6];
        scan.add_point(angles.map(RecordValue::Double).to_vec()).expect("a point");
        scan.finalize().expect("written");
        writer.finalize().expect("written");
        let cloud = read(&path).expect("readable");
        let found = cloud.positions().next().expect("one point");
        assert!((found - Point3::new(0.0, 75.0_f64.sqrt(), 5.0)).norm() < 1e-5, "{found}");
        let alone = [(points[0].0, 0)];
        write(&path, &alone, &[None]);
        let cloud = read(&path).expect("readable");
        assert_eq!(cloud.positions().collect::<Vec<_>>(), [Point3::new(1.0, 2.0, 3.0)]);
    }

    #[test]
    fn damage_is_an_error() {
        let folder = TempDir::new().expect("a folder");
        let path = folder.path().join("a.e57");
        write(&path, &[([1.0, 2.0, 3.0], 0)], &[None]);
        let size = path.metadata().expect("there").len();
        OpenOptions::new().write(true).open(&path).expect("there").set_len(size / 2).expect("cut");
        assert!(read(&path).is_err());
        write(&path, &[], &[None]);
        let error = read(&path).expect_err("no point").to_string();
        assert!(error.contains("at least one point expected, none found"), "{error}");
    }
}
