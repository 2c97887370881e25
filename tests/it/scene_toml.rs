//! Scenes that a `scene.toml` describes, with clouds of every format.

use std::fs;
use std::path::Path;

use las::point::Format;
use las::{Builder, Point as LasPoint, Writer as LasWriter};
use nalgebra::{Point2, Point3};
use posescope::geometry::Pose;
use posescope::scene::Scene;
use tempfile::TempDir;

use crate::binary::{arg, has, run_in};
use crate::damage;
use crate::damage::open;
use crate::small_sequence::wall;

/// Where the map's frame begins: coordinates as surveyors have them.
pub const ORIGIN: [f64; 3] = [500_123.0, 5_400_456.0, 310.0];

const SIMPLE: &str = "\
images = \"photos/*.png\"
poses = \"poses.txt\"
cloud = \"map.xyz\"

[camera]
fx = 100.0
fy = 100.0
cx = 79.5
cy = 31.5
";

/// Three photos a metre apart, at sea level of the map.
pub fn write(folder: &Path) {
    fs::create_dir_all(folder.join("photos")).expect("writable");
    let mut poses = String::new();
    for frame in 0..3 {
        let path = folder.join(format!("photos/img{frame}.png"));
        wall(160, 64).save(path).expect("writable");
        let [x, y, z] = ORIGIN;
        poses += &format!("1 0 0 {x} 0 1 0 {y} 0 0 1 {}\n", z + f64::from(frame));
    }
    fs::write(folder.join("poses.txt"), poses).expect("writable");
    fs::write(folder.join("scene.toml"), SIMPLE).expect("writable");
    let line = |[x, y, z]: [f64; 3]| format!("{x} {y} {z} 255 0\n");
    let map: String = points().into_iter().map(line).collect();
    fs::write(folder.join("map.xyz"), "x y z r g\n".to_owned() + &map).expect("writable");
}

/// A wall 10 m ahead of the first photo, in the frame of the map, on a grid of half a metre.
pub fn points() -> Vec<[f64; 3]> {
    let rows = (-6..=6).flat_map(|row| (-16..=16).map(move |column| (column, row)));
    rows.map(|(column, row)| {
        let [x, y, z] = ORIGIN;
        [x + 0.5 * f64::from(column), y + 0.5 * f64::from(row), z + 10.0]
    })
    .collect()
}

/// The points of the wall that frame 0 has in view are where its camera sees them.
pub fn expect_the_wall(scene: &dyn Scene, tolerance_m: f32) {
    let cloud = scene.cloud(0).unwrap_or_else(|error| panic!("{error}"));
    let camera = scene.intrinsics(0);
    let mut expected: Vec<Point3<f32>> = points()
        .iter()
        .map(|point| (Point3::from(*point) - nalgebra::Vector3::from(ORIGIN)).cast())
        .filter(|point: &Point3<f32>| {
            let pixel: Point2<f64> = camera.project(&point.cast()).expect("is ahead");
            camera.contains(&pixel)
        })
        .collect();
    assert_eq!(cloud.len(), expected.len());
    for point in &cloud.points {
        let nearest = expected.iter().position(|other| (other - point).norm() <= tolerance_m);
        expected.swap_remove(nearest.unwrap_or_else(|| panic!("{point} is not of the wall")));
    }
}

pub fn with(folder: &Path, from: &str, to: &str) {
    assert!(SIMPLE.contains(from), "{from}");
    let text = SIMPLE.replacen(from, to, 1);
    fs::write(folder.join("scene.toml"), text).expect("writable");
}

#[test]
fn a_few_lines_describe_a_scene() {
    let folder = TempDir::new().expect("a folder");
    let yard = folder.path().join("yard");
    write(&yard);
    for argument in [yard.clone(), yard.join("scene.toml")] {
        let scene = open(&argument);
        assert_eq!(scene.name(), "toml/yard");
        assert_eq!(scene.frames(), ["img0", "img1", "img2"]);
        let pose = scene.pose(2).expect("is known");
        assert_eq!(pose.translation.vector.z, ORIGIN[2] + 2.0);
        expect_the_wall(scene.as_ref(), 1e-6);
    }
    with(&yard, "images =", "name = \"my yard\"\nimages =");
    assert_eq!(open(&yard).name(), "my yard");
}

#[test]
fn poses_may_be_by_time_and_the_other_way_round() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    for (frame, time) in [(0, "10.05"), (1, "10.10"), (2, "10.5")] {
        let photo = |name: &str| folder.path().join(format!("photos/{name}.png"));
        fs::rename(photo(&format!("img{frame}")), photo(time)).expect("just written");
    }
    let poses = "# time x y z qx qy qz qw\n10.0 1 2 3 0 0 0 1\n10.1 2 2 3 0 0 0 1\n";
    fs::write(folder.path().join("poses.txt"), poses).expect("writable");
    let scene = open(folder.path());
    let expected = Pose::translation(1.5, 2.0, 3.0);
    let pose = scene.pose(0).expect("is known");
    assert!((pose.translation.vector - expected.translation.vector).norm() < 1e-9);
    assert_eq!(scene.time_s(1), Some(10.1));
    assert!(scene.pose(2).is_none());

    with(folder.path(), "[camera]", "pose = \"camera_from_world\"\n[camera]");
    let pose = open(folder.path()).pose(1).expect("is known");
    assert_eq!(pose, Pose::translation(-2.0, -2.0, -3.0));
}

#[test]
fn poses_may_be_by_the_names_of_photos_below_a_header() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let poses = "image,x,y,z,qx,qy,qz,qw\nimg2.png,1,2,3,0,0,0,1\nimg0.png,4,5,6,0,0,0,1\n";
    fs::write(folder.path().join("poses.txt"), poses).expect("writable");
    let scene = open(folder.path());
    let poses = [0, 1, 2].map(|frame| scene.pose(frame));
    let expected =
        [Some(Pose::translation(4.0, 5.0, 6.0)), None, Some(Pose::translation(1.0, 2.0, 3.0))];
    assert_eq!(poses, expected);
}

#[test]
fn poses_by_number_are_found_where_photos_are_missing() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    fs::remove_file(folder.path().join("photos/img1.png")).expect("just written");
    let pose = open(folder.path()).pose(1).expect("is known");
    assert_eq!(pose.translation.vector.z, ORIGIN[2] + 2.0);
}

/// The wall as text and in both byte orders, behind a comment and with a colour.
fn ply(format: &str) -> Vec<u8> {
    let points = points();
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment a wall\nelement vertex {}\nproperty double x\n\
         property double y\nproperty double z\nproperty uchar red\nelement face 0\n\
         property list uchar int vertex_indices\nend_header\n",
        points.len()
    )
    .into_bytes();
    for point in points {
        match format {
            "ascii" => bytes.extend(format!("{} {} {} 7\n", point[0], point[1], point[2]).bytes()),
            "binary_little_endian" => {
                bytes.extend(point.iter().flat_map(|value| value.to_le_bytes()));
                bytes.push(7);
            }
            _ => {
                bytes.extend(point.iter().flat_map(|value| value.to_be_bytes()));
                bytes.push(7);
            }
        }
    }
    bytes
}

/// The wall as PCD, with a point that did not return and a field that nobody asks for.
fn pcd(data: &str) -> Vec<u8> {
    let mut points = points();
    points.push([f64::NAN; 3]);
    let mut bytes = format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity\nSIZE 8 8 8 4\nTYPE F F F F\n\
         COUNT 1 1 1 1\nWIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA {data}\n",
        points.len()
    )
    .into_bytes();
    match data {
        "ascii" => {
            for [x, y, z] in points {
                bytes.extend(format!("{x} {y} {z} 0.5\n").bytes());
            }
        }
        "binary" => {
            for point in points {
                bytes.extend(point.iter().flat_map(|value| value.to_le_bytes()));
                bytes.extend(0.5_f32.to_le_bytes());
            }
        }
        _ => {
            let mut columns = Vec::new();
            for axis in 0..3 {
                columns.extend(points.iter().flat_map(|point| point[axis].to_le_bytes()));
            }
            columns.extend(points.iter().flat_map(|_| 0.5_f32.to_le_bytes()));
            // Literal runs alone are a valid stream of the compression.
            let mut stream = Vec::new();
            for run in columns.chunks(32) {
                stream.push(run.len() as u8 - 1);
                stream.extend(run);
            }
            bytes.extend((stream.len() as u32).to_le_bytes());
            bytes.extend((columns.len() as u32).to_le_bytes());
            bytes.extend(stream);
        }
    }
    bytes
}

pub fn las(path: &Path, before: &[[f64; 3]]) {
    let mut builder = Builder::from((1, 4));
    let is_layered = path.file_stem().is_some_and(|stem| stem == "layered");
    builder.point_format = Format::new(if is_layered { 7 } else { 0 }).expect("a format");
    builder.point_format.is_compressed = path.extension().is_some_and(|end| end == "laz");
    for (axis, offset) in ORIGIN.into_iter().enumerate() {
        // Whole numbers of 32 bits reach no further.
        let scale = if before.is_empty() { 0.001 } else { 0.01 };
        let transform = las::Transform { scale, offset };
        match axis {
            0 => builder.transforms.x = transform,
            1 => builder.transforms.y = transform,
            _ => builder.transforms.z = transform,
        }
    }
    let header = builder.into_header().expect("a header");
    let mut writer = LasWriter::from_path(path, header).expect("writable");
    for [x, y, z] in [before, &points()].concat() {
        let point = LasPoint {
            x,
            y,
            z,
            gps_time: is_layered.then_some(1.0),
            color: is_layered.then(las::Color::default),
            ..LasPoint::default()
        };
        writer.write_point(point).expect("writable");
    }
    writer.close().expect("writable");
}

type TextLine = fn(usize, [f64; 3]) -> String;

/// The wall as text: the name of a file, what precedes its points, and a point.
const TEXTS: [(&str, &str, TextLine); 4] = [
    ("header.csv", "ring,x,y,z\n", |at, [x, y, z]| format!("{},{x:.1},{y:.1},{z:.1}\n", at % 7)),
    ("scan.pts", "COUNT\n", |_, [x, y, z]| format!("{x:.1} {y:.1} {z:.1} 0 1 2 3\n")),
    (
        "scan.ptx",
        "1\nCOUNT\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n500000 0 0 1\n",
        |_, [x, y, z]| format!("{:.1} {y:.1} {z:.1} 0.5\n", x - 500_000.0),
    ),
    (
        "lists.ply",
        "ply\nformat ascii 1.0\nelement vertex COUNT\nproperty double x\nproperty double y\n\
      property double z\nproperty list uchar uint views\nend_header\n",
        |at, [x, y, z]| format!("{x:.1} {y:.1} {z:.1} {}\n", ["0", "1 5", "2 5 6"][at % 3]),
    ),
];

/// All clouds that can be read, in a folder.
pub fn write_clouds(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let name = format!("{format}.ply");
        fs::write(folder.join(&name), ply(format)).expect("writable");
        names.push(name);
    }
    for data in ["ascii", "binary", "binary_compressed"] {
        let name = format!("{data}.pcd");
        fs::write(folder.join(&name), pcd(data)).expect("writable");
        names.push(name);
    }
    for (name, before, line) in TEXTS {
        let points = points();
        let rows = points.iter().enumerate().map(|(at, [x, y, z])| line(at, [*x, *y, *z]));
        let before = before.replace("COUNT", &points.len().to_string());
        fs::write(folder.join(name), before + &rows.collect::<String>()).expect("writable");
        names.push(name.to_owned());
    }
    for name in ["map.las", "map.laz", "layered.laz"] {
        las(&folder.join(name), &[]);
        names.push(name.to_owned());
    }
    e57(&folder.join("map.e57"));
    names.push("map.e57".to_owned());
    names
}

fn e57(path: &Path) {
    use e57::{E57Writer, Record, RecordValue};
    let mut writer = E57Writer::from_file(path, "wall").expect("writable");
    let xyz = vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
    let mut scan = writer.add_pointcloud("scan", xyz).expect("a scan");
    for point in points() {
        scan.add_point(point.map(RecordValue::Double).to_vec()).expect("a point");
    }
    scan.finalize().expect("written");
    writer.finalize().expect("written");
}

#[test]
fn clouds_of_all_formats_are_the_same_wall() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    for name in write_clouds(folder.path()) {
        println!("{name}");
        with(folder.path(), "map.xyz", &name);
        expect_the_wall(open(folder.path()).as_ref(), 1e-3);
    }
}

#[test]
fn every_frame_may_have_a_cloud_of_its_own() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let scans = folder.path().join("scans");
    fs::create_dir_all(&scans).expect("writable");
    fs::write(scans.join("img0.xyz"), "0, 0, 9\n1, 2, 3\n").expect("writable");
    fs::write(scans.join("img2.xyz"), "//X Y Z\n5;6;7\n").expect("writable");
    let described = |more: &str| {
        with(folder.path(), "cloud = \"map.xyz\"\n", "");
        let path = folder.path().join("scene.toml");
        let text = fs::read_to_string(&path).expect("just written");
        let clouds = format!("{text}\n[clouds]\nfiles = \"scans/*.xyz\"\n{more}");
        fs::write(path, clouds).expect("writable");
        open(folder.path())
    };
    let scene = described("");
    assert!(scene.has_cloud(0) && !scene.has_cloud(1) && scene.has_cloud(2));
    let points = scene.cloud(0).expect("is there").points;
    assert_eq!(points, [Point3::new(0.0, 0.0, 9.0), Point3::new(1.0, 2.0, 3.0)]);
    let error = scene.cloud(1).expect_err("has none").to_string();
    has(&error, "2 frames have one: img0 … img2");

    // From a scanner with x forward, y left, z up, half a metre above the camera.
    let scene = described("camera_from_cloud = [0,-1,0,0, 0,0,-1,-0.5, 1,0,0,0]\n");
    let points = scene.cloud(2).expect("is there").points;
    assert_eq!(points, [Point3::new(-6.0, -7.5, 5.0)]);

    let [x, y, z] = ORIGIN;
    let map = format!("{} {y} {}\n", x + 1.5, z + 8.0);
    fs::write(scans.join("img2.xyz"), map).expect("writable");
    let points = described("frame = \"world\"\n").cloud(2).expect("is there").points;
    assert_eq!(points, [Point3::new(1.5, 0.0, 6.0)]);
}

#[test]
fn distortion_is_taken_out() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    with(folder.path(), "cy = 31.5", "cy = 31.5\nk1 = 0.1");
    let scene = open(folder.path());
    assert!(scene.intrinsics(0).fx > 105.0);
    let photo = scene.photo(0).expect("readable");
    assert_eq!(photo.dimensions(), (160, 64));
    assert_ne!(photo.gray, wall(160, 64));
    let of = |coefficients: &str| {
        with(folder.path(), "cy = 31.5", &format!("cy = 31.5\n{coefficients}"));
        open(folder.path()).photo(0).expect("readable").gray.clone()
    };
    // Further coefficients change the photo if they are not zero, and so does the model.
    let zeros =
        "k1 = 0.1\nk2 = 0\np1 = 0\np2 = 0\nk3 = 0\nk4 = 0\nk5 = 0\nk6 = 0\nmodel = \"opencv\"";
    assert_eq!(of(zeros), photo.gray);
    assert_ne!(of("k1 = 0.1\nk3 = 0.2"), photo.gray);
    assert_ne!(of("k1 = 0.1\nmodel = \"fisheye\""), photo.gray);
    assert_ne!(of("model = \"fisheye\""), wall(160, 64));
}

#[test]
fn poses_of_other_programs_are_read_and_say_their_direction() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let stated = open(folder.path());
    let [x, y, z] = ORIGIN;
    let rows: String = (0..3)
        .map(|frame| {
            format!("photos/img{frame}.png 1 0 0 0 {} {} {}\n", -x, -y, -z - f64::from(frame))
        })
        .collect();
    fs::write(folder.path().join("poses.txt"), rows).expect("writable");
    for line in ["pose = \"camera_from_world\"\n", ""] {
        with(folder.path(), "[camera]", &format!("{line}[camera]"));
        let scene = open(folder.path());
        assert_eq!([0, 1, 2].map(|at| scene.pose(at)), [0, 1, 2].map(|at| stated.pose(at)));
    }
    with(folder.path(), "[camera]", "pose = \"world_from_camera\"\n[camera]");
    let error = posescope::scene::open(arg(folder.path()), None).err().expect("a contradiction");
    has(&error.to_string(), "scene.toml:5 ~ `camera_from_world` or no `pose`");
}

#[test]
fn what_is_wrong_with_a_description_is_named_with_its_line() {
    let written = |folder: &Path| {
        write(folder);
        arg(folder).to_owned()
    };
    damage::expect(
        written,
        r#"
        scene.toml | images = -> image = | scene.toml:1 ~ `image`
        scene.toml | fy = 100.0\n ->  | scene.toml:5 ~ `fy`
        scene.toml | fx = 100.0 -> fx = -1 | scene.toml:5 ~ positive focal lengths
        scene.toml | fx = 100.0 -> fx = "wide" | scene.toml:6
        scene.toml | photos/*.png -> photos/*.jpg | scene.toml:1 ~ no file matches
        scene.toml | photos/*.png -> ../*.png | scene.toml:1 ~ scene's folder
        scene.toml | map.xyz -> /etc/passwd | scene.toml:3 ~ scene's folder
        scene.toml | map.xyz -> none.laz | scene.toml:3 ~ none.laz
        scene.toml | cy = 31.5 -> cy = 31.5\nk1 = -9 | scene.toml:5 ~ a distortion that can be removed
        scene.toml | [camera] -> clouds = { files = "*.xyz" }\n[camera] | scene.toml:3 ~ both found
        poses.txt | text  | poses.txt ~ none found
        poses.txt | text 1 2 3\n | poses.txt:1 ~ 8 numbers expected, 3 found ~ 12 or 16 numbers
        poses.txt | text 1 0 0 0 0 1 0 0 0 0 1 0\n | poses.txt ~ one line per image expected (3) ~ `img1`
        poses.txt | text 5.0 0 0 0 0 0 0 1\n | poses.txt ~ img0 ~ between 5 and 5
        poses.txt | text name x y z qx qy qz qw\na 0 0 0 0 0 0 1\n | names like `img0` expected ~ names like `a`
        map.xyz | text 1 2 3\n1 2 x\n | map.xyz:2 ~ `x`
        map.xyz | text heading\n | map.xyz ~ none found
        map.xyz | text \x00\x00\x00 | map.xyz ~ PLY, PCD
        map.xyz | text ASTM-E57\x01\x00 | map.xyz ~ E57
        map.xyz | text LASF | map.xyz ~ LAS
        "#,
    );
}

#[test]
fn a_damaged_cloud_is_named_and_a_length_in_it_is_not_believed() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let header = |vertices: &str, properties: &str| {
        format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\n{properties}end_header\n"
        )
    };
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let huge_pcd = |data: &str| {
        String::from_utf8_lossy(&pcd("ascii"))
            .replace("POINTS 430", "POINTS 4000000000000000000")
            .replace("DATA ascii", &format!("DATA {data}"))
    };
    assert!(huge_pcd("ascii").contains("4000000000000000000"));
    let list = header("1", &format!("property list uint float more\n{xyz}"));
    let list = list + &"\u{7f}".repeat(4);
    let far_too_many = "4000000000000000000 points";
    for (name, content, words) in [
        ("a.ply", header("4000000000", xyz), "4000000000 points"),
        ("b.ply", header("1", "property float x\n"), "`y`"),
        ("c.ply", list, "a list of 2139062143 numbers expected"),
        ("d.ply", "ply\nformat ascii 1.0\n".to_owned(), "d.ply"),
        ("a.pcd", huge_pcd("ascii"), far_too_many),
        ("b.pcd", huge_pcd("binary"), far_too_many),
        ("c.pcd", huge_pcd("binary_compressed"), "announced"),
    ] {
        fs::write(folder.path().join(name), content).expect("writable");
        with(folder.path(), "map.xyz", name);
        let error = open(folder.path()).cloud(0).expect_err(name).to_string();
        damage::expect_words(&error, &format!("{name} ~ {words}"));
    }
}

#[test]
fn the_length_of_a_compressed_layer_is_not_believed() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let path = folder.path().join("layered.laz");
    las(&path, &[]);
    let mut bytes = fs::read(&path).expect("just written");
    let points = u32::from_le_bytes([96, 97, 98, 99].map(|at: usize| bytes[at])) as usize;
    // Where the table of chunks is, the first point, how many there are, the length of the first layer.
    let length = points + 8 + 36 + 4;
    bytes[length..length + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    fs::write(&path, bytes).expect("writable");
    with(folder.path(), "map.xyz", "layered.laz");
    let error = open(folder.path()).cloud(0).expect_err("is too long");
    has(&error.to_string(), "a chunk of points");
}

/// The decoder adds the sizes of a point's parts. It panics where they are too large for the sum, which is the file's
/// mistake and no bug of ours.
#[test]
fn a_cloud_at_which_the_decoder_panics_is_named_in_one_line() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let path = folder.path().join("layered.laz");
    las(&path, &[]);
    let mut bytes = fs::read(&path).expect("just written");
    let points = u32::from_le_bytes([96, 97, 98, 99].map(|at: usize| bytes[at])) as usize;
    // Type, size and version of both parts are the last before the points.
    let size = points - 12 + 2;
    bytes[size..size + 2].copy_from_slice(&u16::MAX.to_le_bytes());
    fs::write(&path, bytes).expect("writable");
    with(folder.path(), "map.xyz", "layered.laz");
    let said = run_in(folder.path(), "run . --query img1 --reference img0");
    let said = said.fails_in_one_line(3, "layered.laz");
    assert!(!said.err.contains("internal error"), "{}", said.err);
}

/// The same photos and map, told in other conventions.
#[test]
fn axes_units_and_turned_photos_are_read_as_the_description_says() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let described = |lines: &str, camera: [f64; 2]| {
        let [cx, cy] = camera;
        let text = SIMPLE.replace("cx = 79.5\ncy = 31.5", &format!("cx = {cx}\ncy = {cy}"));
        fs::write(folder.path().join("scene.toml"), lines.to_owned() + &text).expect("writable");
        posescope::scene::open(arg(folder.path()), None)
    };
    let plain = described("", [79.5, 31.5]).expect("as stated");
    let [cloud, photo] =
        [plain.cloud(1), plain.cloud(2)].map(|cloud| cloud.expect("in view").points);
    assert_ne!(cloud, photo);
    let stated = plain.pose(1).expect("posed");
    let turned = described("axes = \"x -y -z\"\n", [79.5, 31.5]).expect("the axes of OpenGL");
    let expected = Pose::from_parts(
        stated.translation,
        nalgebra::UnitQuaternion::from_axis_angle(
            &nalgebra::Vector3::x_axis(),
            std::f64::consts::PI,
        ),
    );
    assert!(
        (turned.pose(1).expect("posed").to_homogeneous() - expected.to_homogeneous()).norm() < 1e-9
    );
    let named = described("axes = \"opengl\"\n", [79.5, 31.5]).expect("the same");
    assert_eq!(named.pose(1), turned.pose(1));

    // The same scene in centimetres: with both units stated, each camera sees the same points in metres.
    let [poses, map] = ["poses.txt", "map.xyz"].map(|name| folder.path().join(name));
    let metres = [&poses, &map].map(|path| fs::read_to_string(path).expect("written"));
    let in_cm = |text: &str, columns: &[usize]| -> String {
        let line = |line: &str| {
            let words = line.split(' ').enumerate().map(|(at, word)| match word.parse::<f64>() {
                Ok(number) if columns.contains(&at) => (100.0 * number).to_string(),
                _ => word.to_owned(),
            });
            words.collect::<Vec<_>>().join(" ") + "\n"
        };
        text.lines().map(line).collect()
    };
    fs::write(&poses, in_cm(&metres[0], &[3, 7, 11])).expect("writable");
    for (lines, is_map_in_cm) in [
        ("unit = \"cm\"\n", true),
        ("unit = 0.01\n", true),
        ("unit.poses = \"cm\"\n", false),
        ("unit.poses = 0.01\nunit.clouds = \"cm\"\n", true),
    ] {
        let text = if is_map_in_cm { in_cm(&metres[1], &[0, 1, 2]) } else { metres[1].clone() };
        fs::write(&map, text).expect("writable");
        let scene = described(lines, [79.5, 31.5]).expect("in metres");
        let read = scene.cloud(1).expect("in view").points;
        assert_eq!(read.len(), cloud.len(), "{lines}");
        let off = read.iter().zip(&cloud).map(|(one, other)| (one - other).norm());
        assert!(off.fold(0.0, f32::max) < 1e-3, "{lines}");
        let moved = scene.pose(2).expect("posed").translation.vector
            - scene.pose(1).expect("posed").translation.vector;
        assert!((moved.norm() - 1.0).abs() < 1e-6, "{lines}");
    }
    fs::write(&poses, &metres[0]).expect("writable");
    fs::write(&map, &metres[1]).expect("writable");

    // Photos that lie on their side or stand on their head, and those of a mirror.
    let upright = plain.photo(0).expect("readable").gray;
    type Turn = fn(&image::GrayImage) -> image::GrayImage;
    let turns: [(&str, Turn); 4] = [
        ("90", image::imageops::rotate90),
        ("180", image::imageops::rotate180),
        ("270", image::imageops::rotate270),
        ("\"mirrored\"", image::imageops::flip_horizontal),
    ];
    for (value, turn) in turns {
        let turned = turn(&upright);
        let centre = if turned.width() == 160 { [79.5, 31.5] } else { [31.5, 79.5] };
        let scene = described(&format!("orientation = {value}\n"), centre).expect("turned");
        assert_eq!(scene.photo(0).expect("readable").gray, turned, "{value}");
        assert_eq!(scene.intrinsics(0).width, turned.width(), "{value}");
    }

    for (lines, words) in [
        ("axes = \"x y -z\"\n", "scene.toml:1: \"opengl\", \"vehicle\""),
        ("unit = \"inch\"\n", "`inch` found"),
        ("unit = -1\n", "-1 found"),
        ("unit = true\n", "a unit of length"),
        ("orientation = 45\n", "`45` found"),
        ("depth_per_metre = 1000\n", "scene.toml:1: "),
    ] {
        let why = described(lines, [79.5, 31.5]).err().unwrap_or_else(|| panic!("{lines} refused"));
        has(&why.to_string(), words);
    }
}

#[test]
fn depth_images_are_clouds_where_the_value_of_a_metre_is_stated() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    fs::create_dir_all(folder.path().join("depth")).expect("writable");
    for frame in 0..3 {
        let depth = image::ImageBuffer::from_pixel(160, 64, image::Luma([4000_u16]));
        depth.save(folder.path().join(format!("depth/img{frame}.png"))).expect("writable");
    }
    let described = |lines: &str, more: &str| {
        let text = SIMPLE.replace("cloud = \"map.xyz\"\n", lines);
        let text = format!("{text}{more}\n[clouds]\nfiles = \"depth/*.png\"\n");
        fs::write(folder.path().join("scene.toml"), text).expect("writable");
        posescope::scene::open(arg(folder.path()), None)
    };
    for (lines, depth_m) in [("depth_per_metre = 1000\n", 4.0), ("depth_per_metre = 5000.0\n", 0.8)]
    {
        let cloud = described(lines, "").expect("readable").cloud(1).expect("a depth image");
        assert!(cloud.points.iter().all(|point| (point.z - depth_m).abs() < 1e-6));
        let right = cloud.points.iter().map(|point| point.x).fold(0.0, f32::max);
        assert!((right - depth_m * 0.79).abs() < 0.02 * depth_m, "{right}");
    }
    for (lines, more, words) in [
        ("", "", "`depth_per_metre = 1000`"),
        ("depth_per_metre = 0\n", "", "scene.toml:3: the value of a metre"),
        ("depth_per_metre = 1000\n", "k1 = 0.1\n", "pixel by pixel"),
        ("depth_per_metre = 1000\norientation = 180\n", "", "pixel by pixel"),
    ] {
        let why = described(lines, more).err().unwrap_or_else(|| panic!("{lines}{more} refused"));
        has(&why.to_string(), words);
    }
}

/// A better place of the scanner, or of the cameras in a map, as a description.
#[test]
fn a_description_is_recalibrated_in_its_own_form() {
    let turn = nalgebra::UnitQuaternion::from_euler_angles(0.01, -0.02, 0.005);
    let change = Pose::from_parts(nalgebra::Translation3::new(0.1, -0.05, 0.2), turn);
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    fs::create_dir_all(folder.path().join("scans")).expect("writable");
    for frame in 0..3 {
        let scan = folder.path().join(format!("scans/img{frame}.xyz"));
        fs::write(scan, "1 2 10\n-3 0.5 20\n0 0 5\n").expect("writable");
    }
    let scans = SIMPLE.replace("cloud = \"map.xyz\"\n", "") + "[clouds]\nfiles = \"scans/*.xyz\"\n";
    let stated = "camera_from_cloud = [0,-1,0,0, 0,0,-1,-0.5, 1,0,0,0]\n";
    let body = "body_from_camera = [0,-1,0,0.1, 0,0,-1,0, 1,0,0,0]\n";
    for (text, of_clouds) in [
        (scans.clone(), true),
        (scans + stated, true),
        (SIMPLE.to_owned(), false),
        (body.to_owned() + SIMPLE, false),
    ] {
        fs::write(folder.path().join("scene.toml"), &text).expect("writable");
        let argument = arg(folder.path());
        let before = open(folder.path());
        let better =
            posescope::scene::recalibrated(argument, None, &change).expect("in its own form");
        assert_eq!(better.path, folder.path().join("scene.toml"));
        fs::write(&better.path, better.text).expect("writable");
        let after = open(folder.path());
        if of_clouds {
            let [one, other] =
                [&before, &after].map(|scene| scene.cloud(1).expect("a scan").points);
            for (one, other) in one.iter().zip(&other) {
                assert!((change * one.cast::<f64>() - other.cast::<f64>()).norm() < 1e-5);
            }
        } else {
            // The map stays, so the camera moves.
            let [one, other] = [&before, &after].map(|scene| scene.pose(1).expect("posed"));
            let off = (one * change.inverse()).to_homogeneous() - other.to_homogeneous();
            assert!(off.norm() < 1e-6, "{off}");
        }
    }
    fs::write(folder.path().join("scene.toml"), "axes = \"opengl\"\n".to_owned() + SIMPLE)
        .expect("writable");
    let why = posescope::scene::recalibrated(arg(folder.path()), None, &change).err();
    has(&why.expect("two places for a turn").to_string(), "scene.toml:1: `body_from_camera`");
    let why = posescope::scene::recalibrated("street", None, &change).err();
    has(&why.expect("it has no file").to_string(), "KITTI");
}
