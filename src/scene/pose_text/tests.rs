use super::*;

/// Camera 1 looks forward from (4, 5, 6), camera 2 is turned by 180° about y at (7, 8, 9).
const CENTERS: [[f64; 3]; 2] = [[4.0, 5.0, 6.0], [7.0, 8.0, 9.0]];

fn frames() -> Vec<String> {
    ["front door 0001", "front door 0002"].map(str::to_owned).to_vec()
}

fn read_as<T>(text: &str, take: impl FnOnce(PoseFile<'_>) -> T) -> Result<T, String> {
    let file = TextFile::from_text("poses.txt", text);
    let frames = frames();
    let read = PoseFile::read(&file, &FrameNames::of("scene", &frames));
    read.map(take).map_err(|error| error.to_string())
}

/// The poses of a file by what they belong to, as `key x y z angle`.
fn said(text: &str) -> Result<Vec<String>, String> {
    let pose = |pose: &Pose| {
        // Without signs of zeros.
        let [x, y, z] = [0, 1, 2].map(|at| pose.translation.vector[at].round() + 0.0);
        let angle = pose.rotation.angle().to_degrees().round();
        format!("{x} {y} {z} {angle}")
    };
    read_as(text, |read| match read.poses {
        PoseText::Timed(TimedPoses { samples, unit }) => {
            let unit = unit.map_or("", TimeUnit::symbol);
            samples.iter().map(|(time, at)| format!("{time}{unit}: {}", pose(at))).collect()
        }
        PoseText::Lines(lines) => (0..lines.count())
            .map(|at| format!("{at}: {}", lines.get(at).map_or("lost".to_owned(), |at| pose(&at))))
            .collect(),
        PoseText::Named(named) => named
            .iter()
            .map(|one| format!("{}: {}", one.name, pose(&one.world_from_camera)))
            .collect(),
    })
}

/// What [`said`] says of both cameras.
fn both(keys: [&str; 2]) -> Result<Vec<String>, String> {
    let angles = [0, 180];
    let lines = keys.iter().zip(CENTERS).zip(angles);
    Ok(lines.map(|((key, [x, y, z]), angle)| format!("{key}: {x} {y} {z} {angle}")).collect())
}

/// `x y z` and `w x y z` of both cameras in the world.
fn forward() -> [(String, String); 2] {
    let at = |[x, y, z]: [f64; 3]| format!("{x} {y} {z}");
    [(at(CENTERS[0]), "1 0 0 0".to_owned()), (at(CENTERS[1]), "0 0 1 0".to_owned())]
}

/// `qw qx qy qz x y z` from the world to both cameras.
const INVERSE: [&str; 2] = ["1 0 0 0 -4 -5 -6", "0 0 1 0 7 -8 9"];

/// The rows of both matrices.
const MATRICES: [&str; 2] = ["1 0 0 4 0 1 0 5 0 0 1 6", "-1 0 0 7 0 1 0 8 0 0 -1 9"];

const NAMED: [&str; 2] = ["front door 0001.JPG", "front door 0002.JPG"];

/// A line for each camera.
fn lines(line: impl Fn(usize) -> String) -> String {
    (0..2).map(|at| line(at) + "\n").collect()
}

#[test]
fn each_format_is_told_by_its_lines() {
    let by_name = both(NAMED);
    let [one, two] = [0, 1].map(|at| {
        let [x, y, z] = CENTERS[at];
        let quaternion = ["0 0 0 1", "0 1 0 0"][at];
        format!("{}.5 {x} {y} {z} {quaternion}\n", at + 1)
    });
    assert_eq!(said(&(one + &two)), both(["1.5", "2.5"]));
    for text in [
        lines(|at| format!("{} {}", NAMED[at], INVERSE[at])),
        lines(|at| format!("{} {} 0.5 1.2 612", NAMED[at], INVERSE[at])),
        lines(|at| format!("{} {} 585.5 0.98", NAMED[at], INVERSE[at])),
        // With features, without them, and without the empty lines.
        lines(|at| format!("{at} {} 1 {}\n1.5 2.5 -1 3.5 4.5 7", INVERSE[at], NAMED[at])),
        lines(|at| format!("{at} {} 1 {}\n", INVERSE[at], NAMED[at])),
        lines(|at| format!("{at} {} 1 {}", INVERSE[at], NAMED[at])),
        lines(|at| format!("{} {}", NAMED[at], MATRICES[at])),
        lines(|at| format!("{} {} 0 0 0 1", NAMED[at], MATRICES[at])),
        lines(|at| format!("{},{}", NAMED[at], MATRICES[at].replace(' ', ","))),
    ] {
        assert_eq!(said(&text), by_name, "{text}");
    }
    for text in [
        lines(|at| MATRICES[at].to_owned()),
        lines(|at| format!("{} 0 0 0 1", MATRICES[at])),
        lines(|at| format!("{at} {}", MATRICES[at])),
        lines(|at| format!("{at} {} 0 0 0 1", MATRICES[at])),
    ] {
        assert_eq!(said(&text), both(["0", "1"]), "{text}");
    }
}

#[test]
fn the_second_line_of_an_image_is_told_by_its_content() {
    // Twelve numbers are features, and twelve words with a name are an image.
    let text = format!(
        "1 {} 1 {}\n1 2 -1 1 2 -1 1 2 5 1 2 -1\n2 {} 1 {}\n",
        INVERSE[0], NAMED[0], INVERSE[1], NAMED[1]
    );
    assert_eq!(said(&text), both(NAMED));
}

#[test]
fn a_header_decides_order_unit_and_direction() {
    let forward = forward();
    let euroc = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], \
                 q_RS_z [], v_RS_R_x [m s^-1]\n";
    let rows = |separator: &str| {
        lines(|at| {
            let row = format!("{}000 {} {} 0.5", at + 1, forward[at].0, forward[at].1);
            row.replace(' ', separator)
        })
    };
    assert_eq!(said(&format!("{euroc}{}", rows(","))), both(["1000", "2000"]));
    let with_unit = euroc.replace("#timestamp,", "#timestamp [ns],");
    assert_eq!(said(&format!("{with_unit}{}", rows(","))), both(["1000ns", "2000ns"]));
    // A comment about something else is none.
    let commented = format!("# by a tool, version 1\n{euroc}# done\n{}", rows(","));
    assert_eq!(said(&commented), both(["1000", "2000"]));
    let kapture = "# kapture format: 1.1\n# timestamp, device_id, qw, qx, qy, qz, tx, ty, tz\n";
    let rows = lines(|at| format!("{}000, cam0, {}", at + 1, INVERSE[at].replace(' ', ", ")));
    assert_eq!(said(&format!("{kapture}{rows}")), both(["1000", "2000"]));
    let rtabmap = lines(|at| {
        let [w, x, y, z] = [["1", "0", "0", "0"], ["0", "0", "1", "0"]][at];
        format!("{}000 {} {x} {y} {z} {w} {}", at + 1, forward[at].0, at + 1)
    });
    let text = format!("#timestamp x y z qx qy qz qw id\n{rtabmap}");
    assert_eq!(said(&text), both(["1000", "2000"]));
}

#[test]
fn a_header_names_the_columns() {
    let text = "image,qw,qx,qy,qz,x,y,z\nDSC_1.JPG,1,0,0,0,4,5,6\nDSC_2.JPG,0,0,1,0,7,8,9\n";
    assert_eq!(said(text), both(["DSC_1.JPG", "DSC_2.JPG"]));
    let timed = "x y z qx qy qz qw timestamp\n4 5 6 0 0 0 1 12.5\n7 8 9 0 1 0 0 13\n";
    assert_eq!(said(timed), both(["12.5", "13"]));
    for (wrong, words) in [
        ("name,x,y,z\na,1,2,3\n", "`x y z qx qy qz qw`, expected"),
        ("name,x,y,z,qx,qy,qz,qw\na,1,2,3\n", "poses.txt:2: 8 columns expected, 4 found"),
    ] {
        let error = said(wrong).expect_err("wrong");
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_comment_that_contradicts_its_format_is_refused() {
    let line = "a.jpg 0 1 0 0 4 5 6\n";
    let hloc = format!("# name qw qx qy qz tx ty tz\n{line}");
    assert!(said(&hloc).is_ok(), "{:?}", said(&hloc));
    for (text, words) in [
        (
            format!("# name qx qy qz qw tx ty tz\n{line}"),
            "poses.txt:1: the columns in the order qw qx",
        ),
        (
            format!("# name tx ty tz qw qx qy qz\n{line}"),
            "poses.txt:1: the columns in the order qw qx",
        ),
        ("# time x [mm] y [mm] z [mm] qx qy qz qw\n".to_owned(), "poses expected"),
        (
            "time,x [mm],y,z,qx,qy,qz,qw\n1,4,5,6,0,0,0,1\n".to_owned(),
            "positions in metres expected, `x [mm]`",
        ),
        (
            "#time,x [mm],y,z,qx,qy,qz,qw\n1,4,5,6,0,0,0,1\n".to_owned(),
            "positions in metres expected, `x [mm]`",
        ),
        (
            "IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n1 1 0 0 0 4 5 6 1 a.jpg\n"
                .to_owned(),
            "`#` expected before the header of COLMAP",
        ),
    ] {
        let error = said(&text).expect_err(words);
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn the_table_of_a_trajectory_decides_the_order_of_its_columns() {
    let read = |text: &str| {
        let poses = by_time(&TextFile::from_text("groundtruth.txt", text));
        let poses = poses.map_err(|error| error.to_string());
        poses.map(|poses| poses.iter().map(|(time, at)| (*time, at.rotation.j)).collect::<Vec<_>>())
    };
    let usual = "# timestamp tx ty tz qx qy qz qw\n1.5 4 5 6 0 1 0 0\n";
    let other = "# timestamp tx ty tz qw qx qy qz\n1.5 4 5 6 0 0 1 0\n";
    let line = "timestamp[ms],tx,ty,tz,qw,qx,qy,qz\n1500,4,5,6,0,0,1,0\n";
    for text in [usual, other, line, "1.5 4 5 6 0 1 0 0\n"] {
        assert_eq!(read(text), Ok(vec![(1.5, 1.0)]), "{text}");
    }
    let named = read("name x y z qx qy qz qw\na 4 5 6 0 1 0 0\n");
    assert!(named.is_err_and(|error| error.contains("poses by time expected")));
}

#[test]
fn a_lost_camera_costs_its_own_pose_alone() {
    let text = "1 4 5 6 0 0 0 1\n2 nan nan nan nan nan nan nan\n3 7 8 9 0 1 0 0\n";
    assert_eq!(said(text), both(["1", "3"]));
    let lost = format!("{}\n{}\n{}\n", MATRICES[0], "nan ".repeat(12), MATRICES[1]);
    let lines = said(&lost).expect("two poses");
    assert_eq!(lines, ["0: 4 5 6 0", "1: lost", "2: 7 8 9 180"]);
    let table = "name x y z qx qy qz qw\na 4 5 6 0 0 0 1\nb 1 2 nan 0 0 0 1\nc 7 8 9 0 1 0 0\n";
    assert_eq!(said(table), both(["a", "c"]));
    // An empty cell is none, too.
    let table = "name,x,y,z,qx,qy,qz,qw\na,4,5,6,0,0,0,1\nb,,,,,,,\nc,7,8,9,0,1,0,0\n";
    assert_eq!(said(table), both(["a", "c"]));
    let all = said("1 nan 0 0 0 0 0 1\n").expect_err("no pose");
    assert!(all.contains("no line has them"), "{all}");
}

#[test]
fn where_no_format_fits_each_is_named_with_its_first_line() {
    let error = said("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 9 1\n").expect_err("no quaternion");
    assert!(error.starts_with("poses.txt:2: "), "{error}");
    for words in [
        "TUM (time x y z qx qy qz qw): a quaternion of length 1 expected",
        "hloc (name qw qx qy qz x y z): line 1: a quaternion of length 1 expected",
        "KITTI (12 or 16 numbers of a matrix): line 1: 12 or 16 numbers of a matrix expected, 8 found",
        "ACE0 (name qw qx qy qz x y z focal confidence): line 1: 10 words expected, 8 found",
    ] {
        assert!(error.contains(words), "{error}");
    }
    assert_eq!(error.lines().count(), 1);
}

#[test]
fn the_names_of_the_frames_decide_between_two_formats_that_fit() {
    let frames = ["000005", "000006"].map(str::to_owned);
    let is_named = |text: &str| {
        let file = TextFile::from_text("poses.txt", text);
        let read = PoseFile::read(&file, &FrameNames::of("scene", &frames));
        matches!(read.expect("a pose").poses, PoseText::Named(_))
    };
    assert!(is_named("5 1 0 0 0 0 0 1\n"));
    assert!(!is_named("5.5 1 0 0 0 0 0 1\n"));
}

#[test]
fn lines_are_in_the_order_of_the_frames_or_by_the_number_of_a_name() {
    let text: String = (0..3).map(|z| format!("1 0 0 0 0 1 0 0 0 0 1 {z}\n")).collect();
    let poses = by_line(&TextFile::from_text("poses.txt", &text)).expect("three poses");
    assert_eq!(poses.line_of_frame(0, 3, "img2"), Some(0));
    assert_eq!(poses.line_of_frame(0, 2, "img2"), Some(2));
    assert_eq!(poses.line_of_frame(0, 2, "img7"), None);
    assert_eq!(poses.line_of_frame(0, 2, "img"), None);
    let numbered = |numbers: [u64; 2]| {
        let text = lines(|at| format!("{} {}", numbers[at], MATRICES[at]));
        read_as(&text, |read| match read.poses {
            PoseText::Lines(lines) => {
                [("img7", 0), ("img1", 1)].map(|(name, at)| lines.line_of_frame(at, 2, name))
            }
            _ => panic!("lines with numbers"),
        })
    };
    assert_eq!(numbered([1, 7]), Ok([Some(1), Some(0)]));
    // As many as frames, from 0: in the order of the frames.
    assert_eq!(numbered([1, 0]), Ok([Some(1), Some(0)]));
    assert_eq!(numbered([7, 8]), Ok([Some(0), None]));
    assert!(numbered([7, 7]).is_err_and(|error| error.contains("7 has one already")));
}

/// How tables change on their way through spreadsheets and scripts: each gives the same poses or an error.
#[test]
fn no_change_of_a_table_changes_its_poses_in_silence() {
    let whole = [
        "name x y z qx qy qz qw\na.jpg 4.5 5.5 6.5 0.0 0.6 0.0 0.8\nb.jpg 7.5 8.5 9.5 0.8 0.0 0.0 0.6\n",
        "1.5 4.5 5.5 6.5 0.0 0.6 0.0 0.8\n2.5 7.5 8.5 9.5 0.8 0.0 0.0 0.6\n",
        "a.jpg 0.8 0.0 0.6 0.0 4.5 5.5 6.5\nb.jpg 0.6 0.8 0.0 0.0 7.5 8.5 9.5\n",
        "1.0 0.0 0.0 4.5 0.0 1.0 0.0 5.5 0.0 0.0 1.0 6.5\n0.0 0.0 1.0 7.5 0.0 1.0 0.0 8.5 -1.0 0.0 0.0 9.5\n",
        "1 0.8 0.0 0.6 0.0 4.5 5.5 6.5 1 a.jpg\n\n2 0.6 0.8 0.0 0.0 7.5 8.5 9.5 1 b.jpg\n\n",
        "a.jpg 0.8 0.0 0.6 0.0 4.5 5.5 6.5 0.5 1.2 61\nb.jpg 0.6 0.8 0.0 0.0 7.5 8.5 9.5 0.4 1.1 62\n",
    ];
    let decimal_comma = |text: &str| {
        let names = ["a.jpg", "b.jpg"];
        let hidden = text.replace(names[0], "A").replace(names[1], "B").replace('.', ",");
        hidden.replace('A', names[0]).replace('B', names[1])
    };
    type Change<'a> = &'a dyn Fn(&str) -> String;
    let changes: [(&str, Change<'_>); 9] = [
        ("commas", &|text| text.replace(' ', ",")),
        ("commas with blanks", &|text| text.replace(' ', ", ")),
        ("semicolons", &|text| text.replace(' ', ";")),
        ("tabs", &|text| text.replace(' ', "\t")),
        ("decimal commas", &|text| decimal_comma(text)),
        ("decimal commas with semicolons", &|text| decimal_comma(text).replace(' ', ";")),
        ("decimal commas and commas", &|text| decimal_comma(text).replace(' ', ",")),
        ("no header", &|text| {
            let has_header = text.starts_with("name");
            if has_header {
                text.split_once('\n').unwrap_or_default().1.to_owned()
            } else {
                text.to_owned()
            }
        }),
        ("the columns the other way round", &|text| {
            let turned = |line: &str| line.split(' ').rev().collect::<Vec<_>>().join(" ") + "\n";
            text.lines().map(turned).collect()
        }),
    ];
    for text in whole {
        let sound = said(text);
        assert!(sound.is_ok(), "{text}: {sound:?}");
        for (what, change) in changes {
            let changed = change(text);
            let found = said(&changed);
            assert!(found.is_err() || found == sound, "{what}: {changed}: {found:?}");
        }
    }
}

#[test]
fn a_kapture_trajectory_finds_the_photos_beside_it() {
    let folder = tempfile::TempDir::new().expect("a folder");
    let path = folder.path().join("trajectories.txt");
    let rows = lines(|at| format!("{at}, cam0, {}", INVERSE[at].replace(' ', ", ")));
    let header = "# timestamp, device_id, qw, qx, qy, qz, tx, ty, tz\n";
    std::fs::write(&path, format!("{header}{rows}")).expect("writable");
    let records = lines(|at| format!("{at}, cam0, {}", NAMED[at]));
    let header = "# timestamp, device_id, image_path\n";
    std::fs::write(folder.path().join("records_camera.txt"), format!("{header}{records}"))
        .expect("writable");
    let file = TextFile::read(&path).expect("readable");
    let frames = frames();
    let read = PoseFile::read(&file, &FrameNames::of("scene", &frames)).expect("two poses");
    let PoseText::Named(named) = read.poses else { panic!("no names") };
    let names: Vec<&str> = named.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(names, NAMED);
    assert_eq!(named[1].world_from_camera.translation.vector.as_slice(), CENTERS[1]);
}
