//! Cloud files as other programs write them: lists, other elements, padding, stray points.

use std::fs;

use tempfile::TempDir;

use crate::damage::open;
use crate::scene_toml::{ORIGIN, expect_the_wall, las, points, with, write};

/// The wall in a file is what frame 0 has in view.
#[track_caller]
fn is_the_wall(name: &str, content: impl AsRef<[u8]>) {
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    fs::write(folder.path().join(name), content).expect("writable");
    with(folder.path(), "map.xyz", name);
    expect_the_wall(open(folder.path()).as_ref(), 1e-3);
}

fn rows(row: impl Fn(usize, [f64; 3]) -> String) -> String {
    points().into_iter().enumerate().map(|(at, point)| row(at, point)).collect()
}

#[test]
fn lists_and_other_elements_of_ply_are_skipped() {
    let count = points().len();
    let vertex = format!(
        "element vertex {count}\nproperty list uchar uint views\nproperty double x\nproperty double y\n\
         property list uchar float weights\nproperty double z\n"
    );
    let camera = "element camera 2\nproperty float view\nproperty list int double poses\n";
    let faces = "element face 1\nproperty list uchar int vertex_indices\n";
    for byte_order in ["binary_little_endian", "binary_big_endian"] {
        let is_little = byte_order == "binary_little_endian";
        let mut bytes =
            format!("ply\nformat {byte_order} 1.0\n{camera}{vertex}{faces}end_header\n")
                .into_bytes();
        let number = |bytes: &mut Vec<u8>, le: &[u8]| {
            let mut number = le.to_vec();
            if !is_little {
                number.reverse();
            }
            bytes.extend(number);
        };
        for length in [0_i32, 3] {
            number(&mut bytes, &1.5_f32.to_le_bytes());
            number(&mut bytes, &length.to_le_bytes());
            (0..length).for_each(|at| number(&mut bytes, &f64::from(at).to_le_bytes()));
        }
        for (at, [x, y, z]) in points().into_iter().enumerate() {
            let length = at % 4;
            bytes.push(length as u8);
            (0..length).for_each(|view| number(&mut bytes, &(view as u32).to_le_bytes()));
            number(&mut bytes, &x.to_le_bytes());
            number(&mut bytes, &y.to_le_bytes());
            bytes.push(2);
            (0..2).for_each(|_| number(&mut bytes, &0.5_f32.to_le_bytes()));
            number(&mut bytes, &z.to_le_bytes());
        }
        bytes.push(0);
        is_the_wall("a.ply", bytes);
    }
    let text = rows(|at, [x, y, z]| match at % 2 {
        0 => format!("2 7 8 {x} {y} 0 {z}\n"),
        _ => format!("0 {x} {y} 1 0.5 {z}\n"),
    });
    let header = format!("ply\nformat ascii 1.0\n{camera}{vertex}{faces}end_header\n");
    is_the_wall("a.ply", format!("{header}0.5 0\n0.5 2 1 2\n{text}3 0 1 2\n"));
}

#[test]
fn no_numbers_in_a_text_ply_cost_their_point_alone() {
    let count = points().len();
    let header = |count: usize| {
        format!(
            "ply\nformat ascii 1.0\nobj_info by a viewer\nelement vertex {count}\nproperty double x\n\
             property double y\nproperty double z\nproperty float distance\nend_header\n"
        )
    };
    let of = |none: &str| {
        let all = rows(|_, [x, y, z]| format!("{x} {y} {z} {none} \n"));
        header(count + 2) + &format!("{none} {none} {none} 1\n") + &all + &format!("1 {none} 2 1\n")
    };
    for none in ["nan", "-nan(ind)", "NaN", "-inf"] {
        is_the_wall("a.ply", of(none));
        is_the_wall("a.ply", of(none).replace('\n', "\r\n"));
    }
}

#[test]
fn padding_of_pcd_takes_as_many_bytes_as_the_file_says() {
    let count = points().len();
    // A count of 0 is no field in files of some programs and one of 1 in those of others.
    for (stated, bytes_for_zero) in [(0, 0), (0, 1), (1, 1)] {
        for data in ["ascii", "binary"] {
            let mut bytes = format!(
                "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS _ x y _ z ring _\n\
                 SIZE 1 8 8 1 8 2 4\nTYPE U F F U F U F\nCOUNT {stated} 1 1 3 1 1 {stated}\nWIDTH {count}\n\
                 HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA {data}\n"
            )
            .into_bytes();
            for [x, y, z] in points() {
                if data == "ascii" {
                    let zero = "0 ".repeat(bytes_for_zero);
                    bytes.extend(format!("{zero}{x} {y} 0 0 0 {z} 5 {zero}\n").bytes());
                    continue;
                }
                bytes.extend(vec![0; bytes_for_zero]);
                bytes.extend(x.to_le_bytes());
                bytes.extend(y.to_le_bytes());
                bytes.extend([0; 3]);
                bytes.extend(z.to_le_bytes());
                bytes.extend(5_u16.to_le_bytes());
                bytes.extend(vec![0; 4 * bytes_for_zero]);
            }
            is_the_wall("a.pcd", &bytes);
            if stated == 0 {
                let text = String::from_utf8_lossy(&bytes);
                let is_text = data == "ascii";
                if is_text {
                    is_the_wall("a.pcd", text.replace("VERSION 0.7\n", ""));
                }
            }
        }
    }
}

#[test]
fn stray_points_at_the_origin_change_no_point_of_a_map() {
    let zeros = [[0.0; 3]; 5];
    for count in [1, 5] {
        let before = &zeros[..count];
        let folder = TempDir::new().expect("a folder");
        write(folder.path());
        las(&folder.path().join("a.las"), before);
        with(folder.path(), "map.xyz", "a.las");
        expect_the_wall(open(folder.path()).as_ref(), 1e-3);
        let all: Vec<[f64; 3]> = [before, &points()].concat();
        let header = |kind: &str| match kind {
            "ply" => format!(
                "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\n\
                 property double y\nproperty double z\nend_header\n",
                all.len()
            ),
            _ => format!(
                "VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {0}\nHEIGHT 1\n\
                 VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n",
                all.len()
            ),
        };
        let bytes = || all.iter().flatten().flat_map(|value| value.to_le_bytes());
        for kind in ["ply", "pcd"] {
            let content = header(kind).into_bytes().into_iter().chain(bytes());
            is_the_wall(&format!("a.{kind}"), content.collect::<Vec<u8>>());
        }
        let text = "0 0 0\n".repeat(count) + &rows(|_, [x, y, z]| format!("{x} {y} {z}\n"));
        is_the_wall("a.xyz", text);
    }
    // One in the middle of a local map is a point like others.
    let folder = TempDir::new().expect("a folder");
    write(folder.path());
    let [x, y, z] = ORIGIN;
    let local =
        rows(|_, point| format!("{} {} {}\n", point[0] - x, point[1] - y, point[2] - z - 10.0));
    fs::write(folder.path().join("a.xyz"), local).expect("writable");
    fs::write(folder.path().join("poses.txt"), "1 0 0 0 0 1 0 0 0 0 1 -10\n".repeat(3))
        .expect("writable");
    with(folder.path(), "map.xyz", "a.xyz");
    let scene = open(folder.path());
    scene.cloud(0).expect("readable");
    assert_eq!(scene.cloud_facts().map.map(|map| map.points), Some(points().len()));
}
