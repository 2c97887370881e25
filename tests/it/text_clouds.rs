//! Clouds as text: the same points in every way of writing them, or an error; never other points.

use std::fs;
use std::path::Path;

use nalgebra::Point3;
use posescope::scene;
use tempfile::TempDir;

use crate::binary::{arg, has};
use crate::damage;
use crate::small_sequence::wall;

/// Points with whole numbers, signs and zeros after the decimal sign.
fn points() -> Vec<[f64; 3]> {
    let point = |at: i32| {
        let along = f64::from(at);
        [-2.2042 + 0.1307 * along, -0.378 + 0.0511 * (along % 7.0), 1.8543 + 0.25 * (along % 5.0)]
    };
    (0..40).map(point).collect()
}

/// A scene with one photo, whose cloud is a file in its camera's frame.
fn write(folder: &Path, name: &str) {
    fs::create_dir_all(folder.join("photos")).expect("writable");
    wall(160, 64).save(folder.join("photos/a.png")).expect("writable");
    fs::create_dir_all(folder.join("scans")).expect("writable");
    let ending = name.rsplit_once('.').map_or("txt", |(_, ending)| ending);
    let text = format!(
        "images = \"photos/*.png\"\n[camera]\nfx = 100\nfy = 100\ncx = 79.5\ncy = 31.5\n\
         [clouds]\nfiles = \"scans/*.{ending}\"\n"
    );
    fs::write(folder.join("scene.toml"), text).expect("writable");
}

/// What is read of a file with this content.
fn read(name: &str, content: impl AsRef<[u8]>) -> Result<Vec<Point3<f32>>, String> {
    let folder = TempDir::new().expect("a folder");
    write(folder.path(), name);
    fs::write(folder.path().join("scans").join(name), content).expect("writable");
    let scene = scene::open(arg(folder.path()), None).map_err(|error| error.to_string())?;
    let cloud = scene.cloud(0).map_err(|error| error.to_string())?;
    Ok(cloud.points)
}

fn expected(points: &[[f64; 3]]) -> Vec<Point3<f32>> {
    points.iter().map(|point| Point3::from(*point).cast()).collect()
}

#[track_caller]
fn is_read(content: impl AsRef<[u8]>) {
    is_read_of("a.txt", content, &points());
}

#[track_caller]
fn is_read_of(name: &str, content: impl AsRef<[u8]>, points: &[[f64; 3]]) {
    let found = read(name, content).unwrap_or_else(|error| panic!("{error}"));
    let expected = expected(points);
    assert_eq!(found.len(), expected.len());
    let apart = found.iter().zip(&expected).map(|(a, b)| (a - b).norm());
    assert!(apart.fold(0.0, f32::max) < 1e-5, "{found:?}");
}

#[track_caller]
fn is_refused(content: impl AsRef<[u8]>, words: &str) {
    let error = read("a.txt", content).expect_err(words);
    damage::expect_words(&error, words);
}

/// Columns of a table; the coordinates have four decimals.
fn table(columns: &[Column], separator: &str, decimal: char) -> String {
    let row = |(at, point): (usize, [f64; 3])| {
        let words: Vec<String> =
            columns.iter().map(|column| column.word(at, point, decimal)).collect();
        words.join(separator) + "\n"
    };
    points().into_iter().enumerate().map(row).collect()
}

#[derive(Clone, Copy)]
enum Column {
    Axis(usize),
    Whole,
    Time,
}

impl Column {
    fn word(self, at: usize, point: [f64; 3], decimal: char) -> String {
        let text = match self {
            Self::Axis(axis) => format!("{:.4}", point[axis]),
            Self::Whole => format!("{}", (37 * at) % 256),
            Self::Time => format!("{:.6}", 1_609_459_200.0 + 1e-3 * at as f64),
        };
        text.replace('.', &decimal.to_string())
    }
}

const XYZ: [Column; 3] = [Column::Axis(0), Column::Axis(1), Column::Axis(2)];

fn with(before: &[Column], after: &[Column]) -> Vec<Column> {
    [before, &XYZ, after].concat()
}

#[test]
fn usual_ways_of_writing_points_are_read() {
    let xyz = |separator, decimal| table(&XYZ, separator, decimal);
    let colored = with(&[], &[Column::Whole, Column::Whole, Column::Whole]);
    for separator in [" ", "\t", ",", ";", ", ", "; ", "   "] {
        is_read(xyz(separator, '.'));
        is_read(table(&colored, separator, '.'));
    }
    for separator in [" ", "\t", ";", "; "] {
        is_read(xyz(separator, ','));
        is_read(table(&colored, separator, ','));
    }
    is_read(xyz(" ", '.').replace('\n', " \r\n"));
    is_read(xyz(" ", '.').replace("\n", "\n\n"));
    is_read(format!("\u{feff}{}", xyz(" ", '.')));
    is_read(format!("Room 12, scanned by us\n40\n{}", xyz(" ", '.')));
    is_read(format!("//X Y Z Intensity\n40\n{}", table(&with(&[], &[Column::Whole]), " ", '.')));
    is_read([b"# 21 \xb0C\n", xyz(",", '.').as_bytes()].concat());
    is_read(xyz(" ", '.').replace('\n', " tree\n"));
    let quoted: String = xyz("\",\"", '.').lines().map(|line| format!("\"{line}\"\n")).collect();
    is_read(quoted);
}

#[test]
fn a_header_decides_the_columns() {
    let intensity = with(&[Column::Whole], &[]);
    let timed = with(&[Column::Time], &[Column::Whole]);
    let three = with(&[Column::Whole; 3], &[]);
    for (header, columns) in [
        ("intensity,x,y,z", &intensity),
        ("timestamp,X,Y,Z,ring", &timed),
        ("\"Intensity\",\"Laser_id\",\"Azimuth\",\"Points:0\",\"Points:1\",\"Points:2\"", &three),
        ("I,Laser,Azimuth,Points_m_XYZ:0,Points_m_XYZ:1,Points_m_XYZ:2", &three),
        ("#intensity,x,y,z", &intensity),
        ("//Intensity,X,Y,Z", &intensity),
        ("# time, x [m], y [m], z [m], ring", &timed),
        ("intensity x y z", &intensity),
    ] {
        let table = table(columns, ",", '.');
        is_read(format!("{header}\n{table}"));
        is_read(format!("{header}\n40\n{table}"));
    }
    let backwards = [Column::Axis(2), Column::Whole, Column::Axis(1), Column::Axis(0)];
    is_read(format!("z i y x\n{}", table(&backwards, " ", '.')));
    is_read(format!("z;i;y;x\n{}", table(&backwards, ";", ',')));
    is_refused(
        format!("intensity,x,y,z\n{}", table(&timed, ",", '.')),
        "a.txt:1 ~ a header of 5 columns expected ~ 4 found",
    );
    is_refused(
        format!("time,easting,northing,up\n{}", table(&intensity, ",", '.')),
        "a.txt:1 ~ a header with x, y and z expected",
    );
    is_refused(
        format!("x (mm),y (mm),z (mm)\n{}", table(&XYZ, ",", '.')),
        "a.txt:1 ~ coordinates in metres expected, `x (mm)` found",
    );
    is_refused(format!("x,y,z,x\n{}", table(&intensity, ",", '.')), "a.txt:1 ~ two found");
    let shifted = table(&intensity, ",", '.').replace("\n37,", "\n3,7,");
    is_refused(format!("intensity,x,y,z\n{shifted}"), "a.txt:3: 4 columns expected ~ 5 found");
}

#[test]
fn what_can_be_read_in_two_ways_is_refused() {
    let colored = with(&[], &[Column::Whole]);
    is_refused(table(&XYZ, ",", ','), "decimal points expected");
    is_refused(table(&XYZ, ", ", ','), "a.txt: lines `x y z` expected");
    is_refused(table(&colored, ",", ','), "decimal points expected");
    is_refused(
        "1,854 2,204 3,378\n4,123 5,234 6,345\n",
        "`1,854` may have a decimal comma or thousands",
    );
    is_refused(
        "691,234.5 5,334,567.1 512.0\n691,235.5 5,334,568.1 512.1\n",
        "lines `x y z` expected",
    );
    for (mixed, word) in [
        ("1 2 3\n4,5,6\n7 8 9\n", "4,5,6"),
        ("1 2 3\n4,5,6\n4,5,6\n", "4,5,6"),
        ("1,5 2,5 3,5\n1.5 2.5 3.5\n", "1.5"),
        ("1.5 2.5 3.5\n1,5 2,5 3,5\n", "1,5"),
    ] {
        is_refused(
            mixed,
            &format!("a.txt:2: a number expected, `{word}` found; write all numbers"),
        );
    }
    is_refused("1,2,3\n4 5 6\n", "a.txt:2: a number expected, `4 5 6` found");
    is_refused("1,2,3\n1,,3\n", "a.txt:2: a number expected, an empty column found");
    is_refused("1 2 3\r4 5 6\r", "carriage returns found");
    is_refused("\u{1}\u{2}", "lines `x y z` expected");
    let utf16: Vec<u8> = "\u{feff}1 2 3\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    is_refused(utf16, "UTF-16 found");
    let numbered = |(at, line): (usize, &str)| format!("{} {line}\n", at + 1);
    let numbered: String = table(&XYZ, " ", '.').lines().enumerate().map(numbered).collect();
    is_refused(&numbered, "a count of the lines found; name the columns in a header");
    is_read(format!("id x y z\n{numbered}"));
}

#[test]
fn no_change_of_signs_header_or_order_gives_another_cloud() {
    let expected = expected(&points());
    let mut read_right = 0;
    let more = [Column::Whole, Column::Time];
    for separator in [" ", "\t", ",", ";", ", ", "; "] {
        for decimal in ['.', ','] {
            for header in ["", "#", "//", "plain"] {
                for place in 0..4 {
                    // Columns before the coordinates need a header.
                    let (before, after) = more.split_at(place.min(2));
                    let columns = match place {
                        3 => vec![Column::Axis(1), Column::Axis(2), Column::Whole, Column::Axis(0)],
                        _ => with(before, after),
                    };
                    if header.is_empty() && place > 0 {
                        continue;
                    }
                    let name = |column: &Column| match column {
                        Column::Axis(axis) => ["x", "y", "z"][*axis],
                        Column::Whole => "ring",
                        Column::Time => "time",
                    };
                    let names: Vec<&str> = columns.iter().map(name).collect();
                    for names_by in [" ", separator] {
                        let start = match header {
                            "" => String::new(),
                            "plain" => names.join(names_by) + "\n",
                            sign => format!("{sign}{}\n", names.join(names_by)),
                        };
                        let content = start + &table(&columns, separator, decimal);
                        if let Ok(found) = read("a.txt", &content) {
                            read_right += 1;
                            let apart = found.iter().zip(&expected).map(|(a, b)| (a - b).norm());
                            let is_same = found.len() == 40 && apart.fold(0.0, f32::max) < 1e-5;
                            assert!(is_same, "{content}");
                        }
                    }
                }
            }
        }
    }
    // All but commas as separators of numbers with decimal commas.
    assert_eq!(read_right, 260);
}

#[test]
fn beams_without_return_are_left_out() {
    let table = table(&XYZ, " ", '.');
    for nothing in [
        "0 0 0\n",
        "0.000 0.000 -0.000\n",
        "nan nan nan\n",
        "-nan(ind) -nan(ind) -nan(ind)\n",
        "1.#QNAN 1.#QNAN 1.#QNAN\n",
        "inf -inf 1.0\n",
    ] {
        let first: String = nothing.repeat(5) + &table;
        is_read(&first);
        is_read(table.replace("\n", &format!("\n{nothing}")));
    }
}

#[test]
fn scans_of_pts_are_as_long_as_they_say() {
    let colored = with(&[], &[Column::Whole, Column::Whole, Column::Whole, Column::Whole]);
    let rows = table(&colored, " ", '.');
    let at = rows.match_indices('\n').nth(9).expect("40 rows").0 + 1;
    let (first, second) = rows.split_at(at);
    is_read_of("a.pts", format!("40\n{rows}"), &points());
    is_read_of("a.pts", format!("10\n{first}30\n{second}"), &points());
    for (content, words) in [
        (format!("50\n{rows}"), "a.txt:1: 50 points expected below their number, 40 found"),
        (format!("10\n{first}31\n{second}"), "a.txt:12: 31 points expected"),
        (format!("11\n{first}30\n{second}"), "a.txt:1: 11 points expected ~ 10 found"),
        (format!("{first}30\n{second}"), "a.txt:11: a line `x y z` expected"),
    ] {
        is_refused(content, words);
    }
}

/// Scans of a PTX file: a beam without return after each point.
fn ptx(columns: usize, rows: usize, points: &[[f64; 3]], matrix: &str) -> String {
    let mut text = format!("{columns}\n{rows}\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n{matrix}");
    for [x, y, z] in points {
        text += &format!("{x:.4} {y:.4} {z:.4} 0.5 1 2 3\n0 0 0 0.5 0 0 0\n");
    }
    text
}

#[test]
fn scans_of_ptx_are_moved_to_the_world() {
    const UPRIGHT: &str = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
    // Turned by 90° about z, then moved by 5 along x. The points are rows.
    const TURNED: &str = "0 1 0 0\n-1 0 0 0\n0 0 1 0\n5 0 0 1\n";
    let all = points();
    let (first, second) = all.split_at(10);
    is_read_of("a.ptx", ptx(2, 40, &all, UPRIGHT), &all);
    let moved: Vec<[f64; 3]> = second.iter().map(|[x, y, z]| [5.0 - y, *x, *z]).collect();
    let both = ptx(4, 5, first, UPRIGHT) + &ptx(1, 60, second, TURNED);
    is_read_of("a.ptx", &both, &[first, &moved].concat());
    is_read_of("a.ptx", format!("\n{both}"), &[first, &moved].concat());
    let transposed = "0 -1 0 5\n1 0 0 0\n0 0 1 0\n0 0 0 1\n";
    is_refused(ptx(2, 40, &all, transposed), "the position as its last row");
    is_refused(ptx(3, 40, &all, UPRIGHT), "120 points of a scan expected, 80 found");
    is_refused(both.replace("\n1\n60\n", "\n1\nsixty\n"), "`sixty` found");
}

#[test]
fn survey_coordinates_are_as_fine_as_their_file() {
    let folder = TempDir::new().expect("a folder");
    write(folder.path(), "a.txt");
    let toml = folder.path().join("scene.toml");
    let text = fs::read_to_string(&toml).expect("just written");
    let world = format!("poses = \"poses.txt\"\n{text}frame = \"world\"\n");
    fs::write(toml, world).expect("writable");
    fs::write(folder.path().join("poses.txt"), "1 0 0 691234 0 1 0 5334567 0 0 1 512\n")
        .expect("writable");
    let survey = |[x, y, z]: [f64; 3]| {
        format!("{:.4} {:.4} {:.4}\n", x + 691_234.0, y + 5_334_567.0, z + 512.0)
    };
    let map: String = points().into_iter().map(survey).collect();
    for zeros in [0, 1, 5] {
        fs::write(folder.path().join("scans/a.txt"), "0 0 0\n".repeat(zeros) + &map)
            .expect("writable");
        let scene = damage::open(folder.path());
        let found = scene.cloud(0).expect("readable").points;
        let expected = expected(&points());
        assert_eq!(found.len(), expected.len());
        let apart = found.iter().zip(&expected).map(|(a, b)| (a - b).norm());
        assert!(apart.fold(0.0, f32::max) < 1e-3);
        assert_eq!(scene.cloud_facts().coarse_step_m, None);
    }
    let coarse = |[x, y, z]: [f64; 3]| {
        let single = |coordinate: f64| f64::from(coordinate as f32);
        format!("{} {} {}\n", single(x + 691_234.0), single(y + 5_334_567.0), single(z + 512.0))
    };
    let map: String = points().into_iter().map(coarse).collect();
    fs::write(folder.path().join("scans/a.txt"), map).expect("writable");
    let scene = damage::open(folder.path());
    scene.cloud(0).expect("readable");
    assert_eq!(scene.cloud_facts().coarse_step_m, Some(0.5));
    let said = crate::binary::run_in(folder.path(), "doctor .");
    has(&said.err, "steps of 0.5 m");
}
