//! `posescope doctor --calibration`: how far camera and scanner are from where the scene says.

use std::path::Path;

use posescope::doctor::{CALIBRATION_STEPS, Calibration, Estimate, NotJudged, calibration};
use posescope::geometry::matrix_from_pose;
use posescope::scene::{Scene, recalibrated};
use posescope::table::{Table, wrapped};

use crate::cli::args::DoctorArgs;
use crate::cli::failure::CliError;
use crate::cli::output;
use crate::cli::terminal::Terminal;

/// Prints how far the calibration is off, and returns why it is unusable.
pub fn judge(
    args: &DoctorArgs,
    scene: &dyn Scene,
    terminal: &Terminal,
) -> Result<Option<String>, CliError> {
    let bar = terminal.bar(CALIBRATION_STEPS.len() as u64);
    let found = calibration(scene, &|step| {
        bar.set_position(step as u64);
        bar.set_message(CALIBRATION_STEPS[step]);
    });
    bar.finish_and_clear();
    if !terminal.is_quiet {
        output::print(&in_words(scene, &found, terminal.width()).trim_end())?;
    }
    let Ok(found) = found else { return Ok(None) };
    if let Some(path) = &args.picture {
        let written = found.picture.save_with_format(path, image::ImageFormat::Png);
        written.map_err(CliError::image(path))?;
    }
    if let Some(path) = &args.out {
        write_better(args, &found, path, terminal)?;
    }
    Ok(found.is_off().then(|| format!("{}: {}", scene.name(), answer(&found))))
}

/// What a calibration came to, in lines of at most this many characters.
pub fn in_words(
    scene: &dyn Scene,
    found: &Result<Calibration, NotJudged>,
    width: Option<usize>,
) -> String {
    let name = scene.name();
    match found {
        Ok(found) => {
            let first = (0..scene.frames().len()).find_map(|at| Some((at, scene.pose(at)?)));
            let has_map = first.is_some_and(|(at, pose)| scene.cloud_at(at, &pose).is_some());
            report(name, found, &answer(found), has_map, width)
        }
        Err(why) => {
            let text = format!("{name}: the calibration cannot be judged: {why}");
            wrapped(&text, width.unwrap_or(usize::MAX), "  ")
        }
    }
}

/// Writes the scene's calibration file as it should be.
fn write_better(
    args: &DoctorArgs,
    found: &Calibration,
    path: &Path,
    terminal: &Terminal,
) -> Result<(), CliError> {
    if !found.is_off() {
        terminal.say(|| {
            "--out: nothing is written, since the stated calibration is consistent".to_owned()
        });
        return Ok(());
    }
    let change = found.camera_from_stated();
    let better = recalibrated(&args.scenes[0], args.format.as_deref(), &change)?;
    std::fs::write(path, better.text).map_err(CliError::io(path))?;
    terminal.say(|| format!("{}: in place of {}", path.display(), better.path.display()));
    Ok(())
}

const DELAY: &str = "delay, if nothing else is off";

/// A freedom: its name, its unit, what a unit is in radians, metres, seconds or shares, and its decimals.
type Row<'a> = (&'a str, &'a str, f64, usize, Estimate);

fn rows(found: &Calibration) -> Vec<Row<'static>> {
    let degree = 1.0_f64.to_radians();
    let [x, y, z] = found.turn;
    let [right, down, forward] = found.shift;
    let mut rows = vec![
        ("turn about x (up or down)", "°", degree, 2, x),
        ("turn about y (left or right)", "°", degree, 2, y),
        ("turn about z (roll)", "°", degree, 2, z),
        ("shift along x (right)", " m", 1.0, 3, right),
        ("shift along y (down)", " m", 1.0, 3, down),
        ("shift along z (forward)", " m", 1.0, 3, forward),
        ("focal length", " %", 0.01, 2, found.focal_length),
    ];
    rows.extend(found.delay.map(|delay| (DELAY, " ms", 0.001, 0, delay)));
    rows
}

fn words(&(_, unit, one, decimals, estimate): &Row<'_>) -> (String, String) {
    let number = |value: f64| format!("{:+.*}{unit}", decimals, value / one);
    let half = format!("± {:.*}{unit}", decimals, estimate.half_width() / one);
    (number(estimate.value), half)
}

/// What the calibration came to, in a sentence.
fn answer(found: &Calibration) -> String {
    let rows = rows(found);
    let (of_pose, others) = rows.split_at(6);
    let off: Vec<String> = of_pose
        .iter()
        .chain(others.iter().take(1))
        .filter(|row| row.4.is_off())
        .map(|row| {
            let (value, half) = words(row);
            format!("{} by {value} {half}", row.0)
        })
        .collect();
    let delay = others.get(1).filter(|row| row.4.is_off()).map(words);
    if found.is_disputed {
        return "undecided: depth edges alone would lie better elsewhere, but with these values the photos' features and \
                the grey values of points fit worse than as stated; several values may explain the edges alike"
            .to_owned();
    }
    match (off.is_empty(), delay) {
        (true, None) => {
            let most =
                |rows: &[Row<'_>]| rows.iter().map(|row| row.4.half_width()).fold(0.0, f64::max);
            format!(
                "consistent with the stated calibration, within {:.1}° and {:.0} cm",
                most(&of_pose[..3]).to_degrees(),
                100.0 * most(&of_pose[3..])
            )
        }
        (false, Some((delay, half))) if found.may_be_delay => format!(
            "the calibration is off: {}; or the photos are {delay} {half} later than the clouds, which explains them \
             nearly as well: at an even speed a delay and a shift look alike",
            off.join(", ")
        ),
        (true, Some((delay, half))) => {
            format!("the photos are {delay} {half} later than the clouds")
        }
        (false, _) => format!("the calibration is off: {}", off.join(", ")),
    }
}

fn report(
    name: &str,
    found: &Calibration,
    answer: &str,
    has_map: bool,
    width: Option<usize>,
) -> String {
    let mut table = Table::new(
        "",
        "",
        ["what the clouds need to fit the photos", "found", "90 % interval", ""],
    );
    let of_pose_is_off = found.turn.iter().chain(&found.shift).any(Estimate::is_off);
    let of_pose_is_off = of_pose_is_off || found.focal_length.is_off();
    for row in &rows(found) {
        let (value, half) = words(row);
        // A delay alone is pulled away from 0 by whatever else is off.
        let is_alone = row.0 != DELAY || found.may_be_delay || !of_pose_is_off;
        let off = if row.4.is_off() && is_alone { "off" } else { "" };
        table.push([row.0.to_owned(), value, half, off.to_owned()]);
    }
    let more = if found.is_narrowed_by_frames {
        format!("About {} more frames would halve most intervals.", 3 * found.frames)
    } else {
        "More frames would hardly narrow the intervals: edges cannot be located better.".to_owned()
    };
    let width = width.unwrap_or(usize::MAX);
    let lines = |text: &str| wrapped(text, width, "  ");
    let correction = if found.is_off() {
        let rows = matrix_from_pose(&found.camera_from_stated()).transpose();
        let numbers: Vec<String> = rows.iter().map(|number| format!("{number:.6}")).collect();
        let what = if has_map {
            "To move the cameras against the map, multiply the stated body_from_camera of scene.toml (the identity, where \
             there is none) from the right by the inverse of"
        } else {
            "Multiply the stated camera_from_cloud from the left by"
        };
        lines(&format!(
            "{what} this [R|t], row by row: {}. --out FILE writes the scene's own file with it.",
            numbers.join(" ")
        ))
    } else {
        String::new()
    };
    lines(&format!("{name}: {} frames, {} depth edges", found.frames, found.edges))
        + "\n"
        + &table.to_text(Some(width))
        + "\n"
        + &lines(&format!("Answer: {answer}."))
        + &correction
        + &lines(&more)
}
