//! Folders that others sent: nothing outside of the output folder changes or is shown, and no file takes the machine.

use std::fs;
use std::io::Write as _;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use image::{GrayImage, Luma};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use tempfile::TempDir;

use crate::binary::{Said, has, run_in, text, write};
use crate::scene_toml;
use crate::small_sequence::SmallSequence;

/// What is in a file outside of every folder.
const SECRET: &str = "1 2 3\nTOPSECRET=hunter2\n";

/// Makes a pipe that nobody writes to.
pub fn pipe(path: &Path) {
    mknodat(CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("a pipe");
}

/// Runs the binary, and ends it where it waits for a pipe.
pub fn run(folder: &Path, line: &str) -> Said {
    let mut command = Command::new(env!("CARGO_BIN_EXE_posescope"));
    command.env("POSESCOPE_CACHE", crate::binary::CACHE).current_dir(folder);
    command.args(shlex::split(line).expect("words"));
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("it starts");
    let since = Instant::now();
    while child.try_wait().expect("ours").is_none() {
        if since.elapsed() > Duration::from_secs(120) {
            child.kill().ok();
            panic!("{line} does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Said::of(&child.wait_with_output().expect("it ended"))
}

#[test]
fn what_is_no_file_is_not_waited_for() {
    let sequence = SmallSequence::write();
    let path = |name: &str| sequence.path().join(name);
    // Files that may be missing are missing where they are pipes.
    for (name, command, words) in [
        ("sequences/42/image_0/000004.png", "doctor sequences/42", "a pipe found"),
        ("sequences/42/calib.txt", "doctor sequences/42", "sequences/42"),
        ("poses/42.txt", "doctor sequences/42", "no pose file"),
    ] {
        let kept = path("kept");
        fs::rename(path(name), &kept).expect("is there");
        pipe(&path(name));
        let said = run(sequence.path(), command);
        assert!(matches!(said.code, Some(0 | 3)), "{name}: {}", said.err);
        has(&(said.err + &said.out), words);
        fs::remove_file(path(name)).expect("ours");
        symlink("/dev/zero", path(name)).expect("writable");
        let said = run(sequence.path(), command);
        assert!(matches!(said.code, Some(0 | 3)), "{name}: {}", said.err);
        fs::remove_file(path(name)).expect("ours");
        fs::rename(&kept, path(name)).expect("ours");
    }
    let asked = "run sequences/42 --query 5 --reference 4 --method fb";
    for option in ["--gps", "--matches", "--config", "--estimates other="] {
        let pipe_path = path("a-pipe");
        if !pipe_path.exists() {
            pipe(&pipe_path);
        }
        let given = format!("{option} a-pipe").replace("= ", "=");
        let said = run(sequence.path(), &format!("{asked} {given}"));
        assert!(matches!(said.code, Some(2 | 3)), "{given}: {}", said.err);
    }
}

/// Runs the binary with a pipe that has this text.
fn run_with_pipe(folder: &Path, line: &str, text: &str) -> Said {
    let mut command = Command::new(env!("CARGO_BIN_EXE_posescope"));
    command.env("POSESCOPE_CACHE", crate::binary::CACHE).current_dir(folder);
    command.args(shlex::split(line).expect("words"));
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("it starts");
    // It ends without reading where it refuses the pipe.
    child.stdin.take().expect("a pipe").write_all(text.as_bytes()).ok();
    Said::of(&child.wait_with_output().expect("it ended"))
}

#[test]
fn an_option_reads_a_pipe_that_the_shell_opened_and_no_file_names_one() {
    let sequence = SmallSequence::write();
    let piped = |line: &str, text: &str| run_with_pipe(sequence.path(), line, text);
    let asked = "run sequences/42 --query 5 --reference 4";
    let poses = "name x y z qx qy qz qw\n000004 0 0 4 0 0 0 1\n000005 0 0 5 0 0 0 1\n";
    for path in ["/dev/stdin", "/dev/fd/0"] {
        let line = format!("{asked} --method other --estimates other={path}");
        has(&piped(&line, poses).ok().out, "other");
    }
    let gps = "--reference nearest:1 --gps /dev/stdin";
    let line = format!("run sequences/42 --query 5 --method fb {gps}");
    piped(&line, "name x y z\n000005 0 0 5\n").ok();
    // It is read once for several photos.
    for name in ["a.png", "b.png"] {
        fs::copy(sequence.image("000005"), sequence.path().join(name)).expect("writable");
    }
    let line = "run sequences/42 --query a.png --query b.png --method fb --camera /dev/stdin";
    piped(line, "1 PINHOLE 160 64 100 100 80.5 32.5\n").ok();
    // A run that shall be repeated has files.
    let line = "eval sequences/42 --method other --reference nearest:1 -q --out run";
    let line = format!("{line} --estimates other=/dev/stdin");
    piped(&line, poses).fails_in_one_line(3, "/dev/stdin: a file expected, a pipe found");
    assert!(!sequence.path().join("run").exists());
    // A run that names a pipe does not read it.
    let line = "eval sequences/42 --method fb --reference nearest:1 -q --out run";
    run(sequence.path(), line).ok();
    let with_gps = "[protocol]\ngps = \"/dev/stdin\"\n";
    let described = sequence.text("run/run.toml").replacen("[protocol]\n", with_gps, 1);
    write(sequence.path().join("run/run.toml"), described);
    piped("results run --as html --out x.html", "name x y z\n000005 0 0 5\n").ok();
    has(&sequence.text("x.html"), "/dev/stdin: a file expected, a pipe found");
}

#[test]
fn what_no_scene_has_is_refused_where_it_enters() {
    let root = TempDir::new().expect("a folder");
    scene_toml::write(root.path());
    let sound = text(root.path().join("scene.toml"));
    let long = format!("name = \"{}\"\nimages", "n".repeat(5000));
    for (part, other, words) in [
        ("images", long.as_str(), "names of at most 4096 bytes expected"),
        ("images", "unit = 1e300\nimages", "scene.toml:1: a unit of length expected"),
        ("images", "unit.clouds = 1e-300\nimages", "scene.toml:1: a unit of length expected"),
        ("cx = 79.5", "cx = 1e300", "a centre that suits 160 px expected ~ 1e300"),
        ("cy = 31.5", "cy = -1e9", "a centre that suits 64 px expected ~ -1000000000"),
    ] {
        write(root.path().join("scene.toml"), sound.replacen(part, other, 1));
        let said = run_in(root.path(), "doctor .").fails(3, words);
        assert!(said.out.len() + said.err.len() < 1000, "{}", said.err);
    }
    write(root.path().join("scene.toml"), sound);
    write(root.path().join("gps.txt"), "name x y z\nimg1 1e308 0 0\n");
    let line = "run . --query img1 --reference nearest:1 --method fb --gps gps.txt";
    run_in(root.path(), line).fails_in_one_line(3, "gps.txt:2: a position within 1e12 of 0");
}

/// A scene that `write` changes so that one of its files is a link to a secret.
fn shows_no_secret(name: &str, command: &str, write_scene: impl FnOnce(&Path, &Path)) {
    let root = TempDir::new().expect("a folder");
    let (scene, secret) = (root.path().join("scene"), root.path().join("secret.env"));
    fs::create_dir(&scene).expect("writable");
    write(&secret, SECRET);
    scene_toml::write(&scene);
    write_scene(&scene, &secret);
    let said = run_in(root.path(), command);
    let all = said.out.clone() + &said.err;
    assert!(!all.contains("hunter2"), "{name}: {all}");
    assert_eq!(said.code, Some(3), "{name}: {all}");
    has(&all, "inside the scene's folder expected");
}

#[test]
fn no_link_shows_a_file_outside_of_a_scene() {
    let replaced = |name: &'static str| {
        move |scene: &Path, secret: &Path| {
            fs::remove_file(scene.join(name)).expect("is there");
            symlink(secret, scene.join(name)).expect("writable");
        }
    };
    for name in ["map.xyz", "poses.txt"] {
        shows_no_secret(name, "doctor scene", replaced(name));
    }
    shows_no_secret("a link to a folder", "doctor scene", |scene, secret| {
        symlink(secret.parent().expect("a folder"), scene.join("deep")).expect("writable");
        let described = text(scene.join("scene.toml")).replace("map.xyz", "deep/secret.env");
        write(scene.join("scene.toml"), described);
    });
    let command = "run scene --query img1 --reference img0 --method fb";
    shows_no_secret("a photo", command, |scene, secret| {
        fs::copy(scene.join("photos/img1.png"), secret).expect("writable");
        replaced("photos/img1.png")(scene, secret);
    });
    // Links inside of a scene are followed.
    let root = TempDir::new().expect("a folder");
    scene_toml::write(root.path());
    fs::rename(root.path().join("map.xyz"), root.path().join("other.xyz")).expect("ours");
    symlink("other.xyz", root.path().join("map.xyz")).expect("writable");
    fs::rename(root.path().join("photos/img1.png"), root.path().join("one.png")).expect("ours");
    symlink("../one.png", root.path().join("photos/img1.png")).expect("writable");
    run_in(root.path(), "run . --query img1 --reference img0 --method fb").ok();
    // So are those to photos anywhere, by the real file's name.
    let elsewhere = TempDir::new().expect("a folder");
    let photo = elsewhere.path().join("one.png");
    fs::rename(root.path().join("one.png"), &photo).expect("ours");
    fs::remove_file(root.path().join("photos/img1.png")).expect("is there");
    symlink(&photo, root.path().join("photos/img1.png")).expect("writable");
    run_in(root.path(), "run . --query img1 --reference img0 --method fb").ok();
    // So is a folder of a data set that lies on another disk.
    let sequence = SmallSequence::write();
    fs::rename(sequence.folder().join("velodyne"), sequence.path().join("disk")).expect("ours");
    symlink("../../disk", sequence.folder().join("velodyne")).expect("writable");
    sequence.run("run sequences/42 --query 5 --reference 4 --method fb").ok();
    let secret = sequence.path().join("sequences/secret.env");
    write(&secret, SECRET);
    fs::create_dir(sequence.path().join("out")).expect("writable");
    fs::rename(&secret, sequence.path().join("out/secret.env")).expect("ours");
    fs::remove_file(sequence.folder().join("times.txt")).ok();
    symlink("../../out/secret.env", sequence.folder().join("times.txt")).expect("writable");
    let said = sequence.run("doctor sequences/42").fails(3, "inside the scene's folder expected");
    assert!(!said.err.contains("hunter2"), "{}", said.err);
}

#[test]
fn a_small_file_of_a_huge_photo_is_refused_by_its_size() {
    let root = TempDir::new().expect("a folder");
    scene_toml::write(root.path());
    let huge = GrayImage::from_pixel(13_000, 6_000, Luma([0]));
    for frame in 0..3 {
        huge.save(root.path().join(format!("photos/img{frame}.png"))).expect("writable");
    }
    let said = run_in(root.path(), "doctor .");
    said.fails_in_one_line(3, "at most 67108864 pixels expected, 13000x6000 found");
}

#[test]
fn a_scan_that_no_laser_makes_is_refused_by_its_size() {
    let sequence = SmallSequence::write();
    let scan = fs::File::create(sequence.scan("000004")).expect("writable");
    // It has no content, and takes no room on the disk.
    scan.set_len((256 << 20) + 16).expect("room");
    let said = sequence.run("run sequences/42 --query 5 --reference 4 --method fb");
    said.fails_in_one_line(3, "000004.bin: a file of at most 268435456 bytes expected");
}

#[test]
fn times_of_points_that_switch_without_end_do_not_overflow_the_stack() {
    let root = TempDir::new().expect("a folder");
    scene_toml::write(root.path());
    scene_toml::with(root.path(), "map.xyz", "map.laz");
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/laz");
    fs::copy(fixtures.join("switching-times.laz"), root.path().join("map.laz")).expect("writable");
    let said = run_in(root.path(), "run . --query img1 --reference img0 --method fb");
    said.fails_in_one_line(3, "map.laz ~ times of points expected, the file is damaged");
}

#[test]
fn a_long_word_of_a_file_is_not_shown_whole() {
    let root = TempDir::new().expect("a folder");
    scene_toml::write(root.path());
    let described = text(root.path().join("scene.toml"));
    write(root.path().join("scene.toml"), format!("{described}\n[{}]\n", "x".repeat(100_000)));
    let said = run_in(root.path(), "doctor .").fails_in_one_line(3, "unknown field `xxx");
    assert!(said.err.len() < 1000, "{}", said.err.len());
}
