//! Text files of scenes, cameras, matches and positions on their way through spreadsheets and scripts: in every way of
//! writing them they say the same, or they are refused; they never say something else.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::Point2;
use posescope::features::PairMatches;
use posescope::foreign::MatchSource as _;
use posescope::scene::{self, CameraArgument, LoosePhotos, MatchFolder, Scene};
use tempfile::TempDir;

use crate::binary::{arg, text, write};
use crate::damage;
use crate::scene_formats::samples;
use crate::small_sequence::{HEIGHT, SmallSequence, WIDTH, wall};

/// What a scene says: cameras, poses, times, and some clouds.
fn said_by(scene: &dyn Scene) -> Result<String, String> {
    let mut said = format!("{:?}\n", scene.frames());
    let mut clouds = 0;
    for frame in 0..scene.frames().len() {
        let camera = scene.intrinsics(frame);
        let corner = scene.pixel_map(frame).map(|map| map.to_file(Point2::new(1.0, 2.0)));
        let (pose, time, place) = (scene.pose(frame), scene.time_s(frame), scene.position(frame));
        let _ = writeln!(said, "{camera:?} {corner:?} {pose:?} {time:?} {place:?}");
        if scene.has_cloud(frame) && pose.is_some() && clouds < 2 {
            clouds += 1;
            let cloud = scene.cloud(frame).map_err(|error| error.to_string())?;
            let _ = writeln!(said, "{:?}", cloud.points);
        }
    }
    Ok(said)
}

fn opened(argument: &str) -> Result<String, String> {
    let scene = scene::open(argument, None).map_err(|error| error.to_string())?;
    said_by(scene.as_ref())
}

/// A number with a decimal point.
fn is_decimal(word: &str) -> bool {
    word.contains('.') && word.parse::<f64>().is_ok()
}

fn is_comment(line: &str) -> bool {
    line.trim_start().starts_with('#')
}

fn words(line: &str) -> Vec<&str> {
    line.split([',', ';', ' ', '\t']).filter(|word| !word.is_empty()).collect()
}

/// The names of the columns in a line, if it names some.
fn names(line: &str) -> Option<Vec<&str>> {
    let named = line.trim_start_matches(['#', ' ']).split("[]").next().unwrap_or_default();
    let names = words(named);
    (!line.ends_with(':')
        && names.len() > 1
        && names.iter().all(|name| name.starts_with(|c: char| c.is_ascii_alphabetic())))
    .then_some(names)
}

/// Ways of writing a table, each with what it does.
fn changes(text: &str) -> Vec<(String, String)> {
    let mut changes = Vec::new();
    let mut add = |what: &str, changed: String| {
        if changed != text {
            changes.push((what.to_owned(), changed));
        }
    };
    let of_data = |change: &dyn Fn(&str) -> String| -> String {
        let line = |line: &str| if is_comment(line) { line.to_owned() } else { change(line) };
        text.lines().map(|one| line(one) + "\n").collect()
    };
    let comma = |word: &str| {
        if is_decimal(word) { word.replace('.', ",") } else { word.to_owned() }
    };
    for separator in [" ", "\t", ",", ", ", ";", "; "] {
        add("separator", of_data(&|line| words(line).join(separator)));
        let of_commas =
            |line: &str| words(line).into_iter().map(comma).collect::<Vec<_>>().join(separator);
        add("separator and decimal commas", of_data(&of_commas));
    }
    let header = text.lines().position(|line| names(line).is_some());
    let without = |is_left_out: &dyn Fn(usize, &str) -> bool| -> String {
        let kept = text.lines().enumerate().filter(|(at, line)| !is_left_out(*at, line));
        kept.map(|(_, line)| line.to_owned() + "\n").collect()
    };
    add("no comments", without(&|_, line| is_comment(line)));
    add("no header", without(&|at, _| Some(at) == header));
    let bare = |line: &str| line.trim_start_matches(['#', ' ']).to_owned() + "\n";
    add("comments as lines", text.lines().map(bare).collect());
    let Some(header) = header else { return changes };
    let count = text.lines().nth(header).and_then(names).map_or(0, |names| names.len());
    // The last column may be a list.
    let with_more = text.contains("[]");
    let moved = |order: &[usize]| -> String {
        let line = |(at, line): (usize, &str)| {
            let found = if at == header { names(line).unwrap_or_default() } else { words(line) };
            let is_row = found.len() == count || with_more && found.len() > count;
            if at != header && (is_comment(line) || !is_row) {
                return line.to_owned() + "\n";
            }
            let separator = if line.contains(',') { "," } else { " " };
            let head = order.iter().map(|&from| found[from]);
            let all: Vec<&str> = head.chain(found[count..].iter().copied()).collect();
            format!("{}{}\n", if is_comment(line) { "# " } else { "" }, all.join(separator))
        };
        text.lines().enumerate().map(line).collect()
    };
    add("reversed", moved(&(0..count).rev().collect::<Vec<_>>()));
    for at in 0..count {
        let mut order: Vec<usize> = (0..count).collect();
        order.swap(at, (at + 1) % count);
        add(&format!("columns {at} and the next exchanged"), moved(&order));
    }
    changes
}

/// Changes of values in TOML or JSON.
fn changes_of_values(text: &str) -> Vec<(String, String)> {
    let characters: Vec<char> = text.chars().collect();
    let is_digit =
        |at: Option<usize>| at.and_then(|at| characters.get(at)).is_some_and(char::is_ascii_digit);
    let decimal = |(at, c): (usize, &char)| match c {
        '.' if is_digit(at.checked_sub(1)) && is_digit(Some(at + 1)) => ',',
        other => *other,
    };
    let commas: String = characters.iter().enumerate().map(decimal).collect();
    let changes = [
        ("decimal commas", commas.clone()),
        ("semicolons", text.replace(',', ";")),
        ("blanks", text.replace(',', " ")),
        ("decimal commas and semicolons", commas.replace(", ", "; ")),
    ];
    let named = changes.into_iter().map(|(what, changed)| (what.to_owned(), changed));
    named.filter(|(_, changed)| changed != text).collect()
}

/// All changes of a file give what it says, or an error.
#[track_caller]
fn expect_no_other(file: &Path, read: impl Fn() -> Result<String, String>) {
    let sound = text(file);
    let said = read().unwrap_or_else(|error| panic!("{error}"));
    let changes = match file.extension().and_then(|ending| ending.to_str()) {
        Some("toml" | "json") => changes_of_values(&sound),
        _ => changes(&sound),
    };
    for (what, changed) in changes {
        write(file, &changed);
        if let Ok(found) = read() {
            let is_same = found == said;
            assert!(is_same, "{}: {what}:\n{changed}\nsays\n{found:.999}", file.display());
        }
    }
    write(file, sound);
}

/// Whole numbers as numbers with decimals, as files of matrices have them.
fn with_decimals(text: &str) -> String {
    let word = |word: &str| match word.parse::<i64>() {
        Ok(number) => format!("{number}.0"),
        Err(_) => word.to_owned(),
    };
    let line = |line: &str| words(line).into_iter().map(word).collect::<Vec<_>>().join(" ") + "\n";
    text.lines().map(line).collect()
}

/// The text files below a folder; of several in a folder that differ in their numbers alone, the first.
fn text_files(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder)
        .expect("readable")
        .map(|entry| entry.expect("readable").path())
        .collect();
    entries.sort();
    let mut known = Vec::new();
    for path in entries {
        let name = path.file_name().and_then(|name| name.to_str()).expect("a plain name");
        let kind = name.replace(|c: char| c.is_ascii_digit(), "");
        let endings = [".txt", ".csv", ".toml", ".json", ".timestamps"];
        if path.is_dir() {
            text_files(&path, found);
        } else if endings.iter().any(|ending| name.ends_with(ending)) && !known.contains(&kind) {
            known.push(kind);
            found.push(path);
        }
    }
}

#[test]
fn no_change_of_a_text_file_gives_another_scene() {
    let mut tried = Vec::new();
    for (format, sample) in samples().filter(|(format, _)| *format != "street") {
        if format == "7scenes" {
            write(
                sample.root.join("camera-intrinsics.txt"),
                "585.5 0 320.25\n0 586.5 240.75\n0 0 1\n",
            );
        }
        if format == "tum" {
            write(
                sample.root.join("calibration.txt"),
                "# fx fy cx cy\n525.5 526.5 319.25 239.75\n",
            );
            let rows = (0..20).map(|step| {
                let time = 99.995 + 0.01 * f64::from(step);
                format!("{time:.4} 0.25 0.5 1.75 0.1 0.3 0.5 0.80622577\n")
            });
            let truth = rows.collect::<String>();
            write(
                sample.root.join("groundtruth.txt"),
                format!("# truth\n# timestamp tx ty tz qx qy qz qw\n{truth}"),
            );
        }
        let mut files = Vec::new();
        text_files(&sample.root, &mut files);
        for file in files {
            let name = file.file_name().and_then(|name| name.to_str()).expect("a plain name");
            let is_of_numbers = ["calib", "poses", "42.txt", "frame-", "camera-"]
                .iter()
                .any(|start| name.starts_with(start));
            if is_of_numbers && format != "tum" {
                write(&file, with_decimals(&text(&file)));
            }
            if name == "vo.csv" {
                let rows = text(&file);
                let row = |line: &str| {
                    let times: Vec<&str> = line.split(',').take(2).collect();
                    times.join(",") + ",0.5,0.01,0.02,0.001,0.002,0.003\n"
                };
                let (header, rows) = rows.split_once('\n').expect("a header");
                write(&file, format!("{header}\n{}", rows.lines().map(row).collect::<String>()));
            }
            expect_no_other(&file, || opened(&sample.argument));
            tried.push(format!("{format}: {name}"));
        }
    }
    println!("{tried:#?}");
    assert!(tried.len() > 25, "{tried:?}");
}

/// A model with the comments that COLMAP writes.
fn write_model(folder: &Path) {
    fs::create_dir_all(folder.join("images")).expect("writable");
    for name in ["a.png", "b.png"] {
        wall(WIDTH, HEIGHT).save(folder.join("images").join(name)).expect("writable");
    }
    write(
        folder.join("cameras.txt"),
        "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n\
         # Number of cameras: 2\n1 PINHOLE 160 64 100.5 101.5 80.25 32.75\n\
         2 OPENCV 160 64 100.5 101.5 80.25 32.75 0.01 0.02 0.001 0.002\n",
    );
    write(
        folder.join("images.txt"),
        "# Image list with two lines of data per image:\n\
         #   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)\n\
         1 0.80622577 0.1 0.3 0.5 1.25 2.5 3.75 2 a.png\n1.5 2.5 5 3.5 4.5 6 5.5 6.5 -1\n\
         2 0.80622577 0.3 0.1 0.5 1.5 2.25 3.5 1 b.png\n1 2 5 3 4 6 5 6 -1\n",
    );
    write(
        folder.join("points3D.txt"),
        "# 3D point list with one line of data per point:\n\
         #   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n\
         5 0.25 0.5 6.75 1 2 3 0.5 1 0 2 0\n6 -0.25 1.5 7.75 4 5 6 0.25 1 1 2 1\n",
    );
}

#[test]
fn no_change_of_a_model_gives_another_scene() {
    let folder = TempDir::new().expect("a folder");
    write_model(folder.path());
    for file in ["cameras.txt", "images.txt", "points3D.txt"] {
        expect_no_other(&folder.path().join(file), || opened(arg(folder.path())));
    }
}

#[test]
fn no_change_of_a_camera_gives_another_camera() {
    let folder = TempDir::new().expect("a folder");
    let photo = folder.path().join("a.png");
    wall(WIDTH, HEIGHT).save(&photo).expect("writable");
    let opened = |camera: CameraArgument| {
        let photos = LoosePhotos { paths: vec![photo.clone()], camera: Some(camera) };
        let scene = photos.open(None).map_err(|error| error.to_string())?;
        said_by(scene.as_ref())
    };
    let path = folder.path().join("cameras.txt");
    for text in [
        "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n1 OPENCV 160 64 100.5 101.5 80.25 32.75 0.01 0.02 0.001 0.002\n",
        "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n2 PINHOLE 160 64 100 101.5 80 32\n1 PINHOLE 64 48 9 8 7 6\n",
        "# NAME, MODEL, WIDTH, HEIGHT, PARAMS[]\na.png SIMPLE_RADIAL 160 64 100.5 80.25 32.75 0.01\n\
         b.png PINHOLE 160 64 90.5 91.5 80.25 32.75\n",
    ] {
        write(&path, text);
        expect_no_other(&path, || opened(CameraArgument::File(path.clone())));
    }
    for numbers in [
        "100.5 101.5 79.5 31.5",
        "100.5 101.5 79.5 31.5 0.1 0.01 0.001 0.002",
        "100 101 80 32 0.1 0.01 0 0",
        "100 101 80 32 0.1 0 0 0",
        "100 101 80 32 0.1 0.01 0.001 0.002 0.003",
        "100 101 80 32 0 0 0 0 0 0 0 0",
    ] {
        let read = |text: &str| opened(text.trim().parse::<CameraArgument>()?);
        let sound = read(numbers).unwrap_or_else(|error| panic!("{error}"));
        for (what, changed) in changes(numbers) {
            let found = read(&changed);
            assert!(found.is_err() || found.as_ref() == Ok(&sound), "{what}: {changed}: {found:?}");
        }
        assert_eq!(read(&numbers.replace(' ', ",")).as_ref(), Ok(&sound));
    }
}

#[test]
fn no_change_of_rough_positions_gives_others() {
    let sequence = SmallSequence::write();
    let scene: Arc<dyn Scene> = damage::open(sequence.folder()).into();
    let path = sequence.path().join("gps.csv");
    let read = || {
        let located = scene::located(Arc::clone(&scene), scene.as_ref(), &path);
        said_by(located.map_err(|error| error.to_string())?.as_ref())
    };
    for text in [
        "name x y z\n000004 0.5 1.25 4.75\n000005 0.25 1.5 5.125\n",
        "name,x,y,z\n000004,5,1,4.5\n000005,2,1,5.5\n",
        "name lat lon\n4 48.125 11.5\n5 48.25 11.625\n7 48.5 11.75\n",
        "name,latitude,longitude,altitude\n4,48.125,11.5,300\n5,48.25,11.625,301\n7,48.5,11.75,302.5\n",
    ] {
        write(&path, text);
        expect_no_other(&path, read);
    }
}

#[test]
fn no_change_of_matches_gives_others() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("000070_000062_matches.txt");
    let read = || {
        let source = MatchFolder::open(folder.path()).map_err(|error| error.to_string())?;
        let found = source.matches("000070", "000062").map_err(|error| error.to_string())?;
        let Some(PairMatches::Found(found)) = found else { return Err("none".to_owned()) };
        let pairs = found.decisions.iter().flatten().map(|one| {
            let a = found.query.keypoints[one.query];
            let b = found.reference.keypoints[one.reference];
            format!("{} {} {} {}\n", a.x, a.y, b.x, b.y)
        });
        Ok(pairs.collect())
    };
    for text in [
        "3.5 4.25 9.5 10.25\n13.5 14.25 19.5 20.25\n",
        "3.5 4.25 9.5 10.25 0.5\n13.5 14.25 19.5 20.25 0.75\n",
        "3.5 4 9 10\n13 14 19.5 20\n",
        "3 4 9 10.5\n13 14 19 20.5\n",
        "3 4 9 10 0.5\n13 14 19 20 0.75\n",
    ] {
        write(&path, text);
        expect_no_other(&path, read);
    }
}
