//! `posescope doctor`: whether a scene is usable, and which of the usual mistakes it contains.

pub mod calibration;

use posescope::doctor::{Agreement, Correction, Examination, Fit, Place, Remark, examine};
use posescope::measure::paper_scene;
use posescope::run::{OutputError, refuse_to_replace};
use posescope::scene::{self, Scene, SceneFormat};
use posescope::sink::rerun::{Targets, record_checkup};
use posescope::table::wrapped;

use super::args::DoctorArgs;
use super::failure::CliError;
use super::output;
use super::terminal::Terminal;

/// Examines every scene. The error is that of the first unusable scene.
pub fn doctor(args: &DoctorArgs, terminal: &Terminal) -> Result<(), CliError> {
    let files = args.picture.iter().chain(&args.save).chain(&args.out);
    if args.scenes.len() > 1 && files.count() > 0 {
        return Err(CliError::Usage(
            "--picture, --save and --out take one scene; name one only".to_owned(),
        ));
    }
    let mut broken = None;
    for (index, argument) in args.scenes.iter().enumerate() {
        if index > 0 && !terminal.is_quiet {
            output::print(&"")?;
        }
        let verdict = examine_scene(args, argument, terminal)?;
        broken = broken.or(verdict);
    }
    broken.map_or(Ok(()), |verdict| Err(CliError::Unusable(verdict)))
}

/// Prints the findings on a scene, and returns why it is unusable.
fn examine_scene(
    args: &DoctorArgs,
    argument: &str,
    terminal: &Terminal,
) -> Result<Option<String>, CliError> {
    let scene = scene::open(argument, args.format.as_deref())?;
    for (option, path, extension) in
        [("--picture", &args.picture, "png"), ("--save", &args.save, "rrd")]
    {
        if let Some(path) = path {
            refuse_to_replace(option, path, &[extension], [argument])?;
        }
    }
    if let Some(path) = args.out.as_ref().filter(|path| path.exists()) {
        let why = "is never replaced";
        return Err(OutputError::Replaces { option: "--out", path: path.clone(), why }.into());
    }
    if args.calibration {
        return calibration::judge(args, scene.as_ref(), terminal);
    }
    let found = examine(scene.as_ref());
    if let (Some(path), Some(picture)) = (&args.picture, &found.picture) {
        let written = picture.save_with_format(path, image::ImageFormat::Png);
        written.map_err(CliError::image(path))?;
    }
    if let Some(path) = &args.save {
        let frames = found.compared.iter().map(|&frame| scene.reference(frame));
        let frames = frames.collect::<Result<Vec<_>, _>>()?;
        record_checkup(&Targets::file(path), scene.name(), &frames)?;
    }
    if !terminal.is_quiet {
        let format = scene::format_of(argument, args.format.as_deref());
        let text = report(scene.as_ref(), format, &found, terminal.width());
        output::print(&text.trim_end())?;
    }
    Ok(found.is_broken().then(|| verdict(scene.as_ref(), &found)))
}

/// Why a scene is unusable, in one line.
fn verdict(scene: &dyn Scene, found: &Examination) -> String {
    let name = scene.name();
    if let Some(finding) = &found.finding {
        return format!("{name}: {}; {}", finding.mistake.about(), finding.remedy);
    }
    let broken = found.remarks.iter().find_map(|remark| match remark {
        Remark::Broken(why) => Some(why.as_str()),
        Remark::Odd(_) => None,
    });
    let misfit = (found.fit == Some(Fit::Unexplained)).then_some(UNEXPLAINED);
    format!("{name}: {}", broken.or(misfit).unwrap_or("the scene is unusable"))
}

/// The findings in words, a line each, in lines of at most this many characters.
pub fn report(
    scene: &dyn Scene,
    format: Option<&SceneFormat>,
    found: &Examination,
    width: Option<usize>,
) -> String {
    let mut text = String::new();
    let there = &found.inventory;
    let mut line = |what: &str, words: &str| {
        const LABEL: &str = "           ";
        let words = format!("{LABEL}{}", scene.lengths().unit().words(words));
        let lines = wrapped(&words, width.unwrap_or(usize::MAX), LABEL);
        text += &format!("{what:<11}{}", &lines[LABEL.len()..]);
    };
    line("scene", scene.name());
    let words = format!(
        "{}, {} with a pose, {} with a cloud, {} with a time",
        there.frames, there.with_pose, there.with_cloud, there.with_time
    );
    line("frames", &words);
    for camera in there.cameras.iter().take(3) {
        line("camera", camera);
    }
    if there.cameras.len() > 3 {
        line("", &format!("and {} more", there.cameras.len() - 3));
    }
    if let Some([least, median, greatest]) = there.steps_m {
        let words = format!(
            "{:.1} m, steps of {least:.2} to {greatest:.2} m, median {median:.2} m",
            there.way_m
        );
        line("way", &words);
    }
    if let Some([images, tag, length_km, spacing_m]) = paper_scene(scene.name()) {
        let words = format!("{tag}, {images} images, {length_km} km, {spacing_m} m between images");
        line("paper", &words);
    }
    for (frame, points, depth) in &there.clouds {
        let depth = depth.map_or("no point in view".to_owned(), |depth| {
            format!("median depth in view {depth:.1} m")
        });
        line("cloud", &format!("{frame}: {points} points, {depth}"));
    }
    if let Some(agreement) = &found.agreement {
        line("agreement", &numbers(agreement));
    }
    for remark in &found.remarks {
        match remark {
            Remark::Broken(why) => line("broken", why),
            Remark::Odd(why) => line("odd", why),
        }
    }
    let mut next = found.finding.as_ref();
    while let Some(finding) = next {
        line("mistake", finding.mistake.about());
        line("remedy", &finding.remedy);
        if let Some(correction) = &finding.correction
            && let Some(words) = written(correction, format)
        {
            line("write", &words);
        }
        for (mistake, remedy) in &finding.or {
            line("or", &format!("{}: {remedy}", mistake.about()));
        }
        line("after", &numbers(&finding.otherwise));
        next = finding.then.as_deref();
    }
    match (&found.finding, found.fit) {
        _ if let Some(step) = found.coarse_step_m => {
            line("answer", &format!("cannot be judged: the clouds have steps of {step} m"));
        }
        (_, None) => line("answer", "not checked: no frame has a photo, a pose and a cloud"),
        (None, Some(Fit::Unexplained)) => line("answer", &format!("does not fit: {UNEXPLAINED}")),
        (Some(_), Some(Fit::Unexplained)) => {
            line(
                "answer",
                "does not fit as stated, and what is named above does not explain all of it",
            );
        }
        (Some(_), Some(Fit::Fits)) => {
            line("answer", "does not fit as stated, and fits if corrected as above");
        }
        (Some(_), Some(Fit::NoSharedView)) => line("answer", "does not fit as stated"),
        (None, Some(Fit::Fits)) => {
            line(
                "answer",
                "fits: no usual mistake explains the photos better; small errors are not seen",
            );
        }
        (None, Some(Fit::NoSharedView)) => {
            line(
                "answer",
                "cannot be judged: no two compared photos share a view; take frames that are closer",
            );
        }
    }
    text
}

/// What to write where, if a scene of this format takes it.
fn written(correction: &Correction, format: Option<&SceneFormat>) -> Option<String> {
    let Correction { lines, place } = correction;
    let quoted: Vec<String> = lines.iter().map(|line| format!("`{line}`")).collect();
    let quoted = quoted.join(", ");
    match (format?.name, place) {
        ("toml", Place::DepthPerMetre) => {
            Some(format!("`depth_per_metre = {}` {}", lines.join(" "), Place::Description.about()))
        }
        ("toml", _) | ("tum" | "7scenes", Place::DepthPerMetre) => {
            Some(format!("{quoted} {}", place.about()))
        }
        _ => None,
    }
}

const UNEXPLAINED: &str =
    "clouds, cameras and poses do not fit the photos, and no usual mistake explains it";

fn numbers(agreement: &Agreement) -> String {
    let number = |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{value:.2}"));
    let share = |value: Option<f64>| {
        value.map_or("–".to_owned(), |value| format!("{:.0} %", 100.0 * value))
    };
    format!(
        "the poses explain {} of shared features, grey values correlate by {}, depth edges {} (log ratio)",
        share(agreement.motions),
        number(agreement.carried.map(f64::tanh)),
        number(agreement.edges)
    )
}
