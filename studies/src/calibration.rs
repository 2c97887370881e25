//! How far poses can be believed.

mod fit;
mod judge;
mod trials;
mod wrong_inputs;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use posescope::diagnosis::confidence::{self, Fitted};
use posescope::method::Method;
use posescope::scene;

use crate::Failure;
use judge::judge;
pub use judge::{Scored, area_under_curve, calibration_error};
use trials::{Inputs, Sample};

/// The methods whose poses have a probability of their own.
const JUDGED: &str = "fb,pm,mi,fb2,mi6,robust";

/// Where posescope keeps what was fitted.
const FITTED: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../crates/posescope-core/src/diagnosis/confidence/fitted.json"
);

/// How far can a pose be believed, and how far may it be off?
///
/// Localises queries in generated towns, in every condition against references in the same and in others, and queries
/// that do not show their place. Says how well the probabilities and the intervals that posescope has now hold. With
/// --fit, fits new ones to the samples of other files.
#[derive(clap::Args)]
pub struct Options {
    #[arg(long, default_value_t = 40)]
    places: usize,
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// The towns.
    #[arg(long, value_delimiter = ',', default_values_t = [0])]
    towns: Vec<u64>,
    /// How far is searched [m]; places take turns.
    #[arg(long, value_delimiter = ',', default_values_t = [10.0, 15.0, 25.0, 5.0])]
    radii: Vec<f64>,
    /// The methods, of all that have a probability.
    #[arg(long, value_delimiter = ',', default_value = JUDGED)]
    methods: Vec<Method>,
    /// Keep the samples in this file.
    #[arg(long)]
    dump: Option<PathBuf>,
    /// Judge the samples of earlier runs.
    #[arg(long)]
    from: Vec<PathBuf>,
    /// Fit to the samples of these earlier runs, and judge that.
    #[arg(long)]
    fit: Vec<PathBuf>,
    /// Fit this alone, and keep the rest as posescope has it now.
    #[arg(long, requires = "fit")]
    only: Option<Only>,
    /// Keep what was fitted as posescope's own.
    #[arg(long, requires = "fit")]
    write: bool,
    /// Judge pairs of registered real photos below POSESCOPE_DATA.
    #[arg(long)]
    real: bool,
    /// Judge pairs of frames of these scenes, --places of each.
    #[arg(long)]
    scene: Vec<String>,
    /// Plant mistakes in the inputs, each alone.
    #[arg(long)]
    wrong_inputs: bool,
    /// Plant those alone whose name has these words.
    #[arg(long, requires = "wrong_inputs", default_value = "")]
    mistake: String,
    /// Only compare pairs of frames of each map, as posescope doctor does.
    #[arg(long)]
    frame_pairs: bool,
}

/// A part of what is fitted.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Only {
    /// How far poses may be off.
    Intervals,
    /// How likely poses are right, and what tells that a query does not show the place.
    Probabilities,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    if options.frame_pairs {
        let open = |argument: &String| scene::open(argument, None);
        let scenes = options.scene.iter().map(open).collect::<Result<Vec<_>, _>>()?;
        let maps = match scenes.as_slice() {
            [] => trials::maps(options.real, &options.towns, &[])?,
            _ => Vec::new(),
        };
        wrong_inputs::compare_pairs(&maps, &scenes);
        return Ok(());
    }
    let samples = match options.from.as_slice() {
        [] => collected(options)?,
        files => read(files)?,
    };
    if let Some(path) = &options.dump {
        let lines: Result<Vec<_>, _> = samples.iter().map(serde_json::to_string).collect();
        std::fs::write(path, lines?.join("\n"))?;
    }
    if options.wrong_inputs && options.mistake.is_empty() {
        wrong_inputs::examine(&trials::maps(options.real, &options.towns, &options.scene)?);
    }
    let (silent, samples): (Vec<Sample>, Vec<Sample>) =
        samples.into_iter().partition(Sample::is_silent);
    let now: BTreeMap<String, Fitted> = options
        .methods
        .iter()
        .filter_map(|method| Some((method.name().to_owned(), confidence::fitted(*method)?.clone())))
        .collect();
    let fits_samples = |name: &String, fitted: &Fitted| {
        samples.iter().filter(|s| s.method == *name).all(|s| s.names == fitted.signals)
    };
    if now.iter().all(|(name, fitted)| fits_samples(name, fitted)) {
        judge("As posescope has it now", &samples, &silent, &now);
    }
    if !options.fit.is_empty() {
        let mut own = read(&options.fit)?;
        own.retain(|sample| !sample.is_silent());
        let mut fitted = BTreeMap::new();
        for method in &options.methods {
            let name = method.name();
            let of_method: Vec<&Sample> = own.iter().filter(|s| s.method == name).collect();
            let Some(found) = fit::fitted(&of_method) else {
                continue;
            };
            let kept = now.get(name).map(|own| fit::with_signals(own, &found));
            let found = match (options.only, kept) {
                (Some(Only::Intervals), Some(kept)) => Fitted { near: kept.near, ..found },
                (Some(Only::Probabilities), Some(kept)) => Fitted {
                    deviations: kept.deviations,
                    tail: kept.tail,
                    seen: kept.seen,
                    ..found
                },
                _ => found,
            };
            fitted.insert(name.to_owned(), found);
        }
        judge("Fitted, on what it was fitted to", &own, &[], &fitted);
        judge("Fitted, on the others", &samples, &silent, &fitted);
        if options.write {
            std::fs::write(FITTED, text_of(&fitted)?)?;
        }
    }
    Ok(())
}

/// What was fitted, as a file that people can compare line by line.
fn text_of(fitted: &BTreeMap<String, Fitted>) -> Result<String, Failure> {
    let rounded = |number: f64| format!("{number:.4}").parse().unwrap_or(number);
    let short = |numbers: &[f64]| numbers.iter().map(|number| rounded(*number)).collect();
    let text = |one: &Fitted| {
        let short = Fitted {
            signals: one.signals.clone(),
            seen: one.seen.iter().map(|range| range.map(rounded)).collect(),
            near: short(&one.near),
            shown: short(&one.shown),
            shown_from: rounded(one.shown_from),
            deviations: one.deviations.each_ref().map(|weights| short(weights)),
            tail: rounded(one.tail),
        };
        serde_json::to_string(&short)
            .map(|text| text.replace("],\"", "],\n  \"").replace("],[", "],\n    ["))
    };
    let mut methods = Vec::new();
    for (name, one) in fitted {
        methods.push(format!("\"{name}\": {}", text(one)?));
    }
    Ok(format!("{{\n{}\n}}\n", methods.join(",\n")))
}

fn read(files: &[PathBuf]) -> Result<Vec<Sample>, Failure> {
    let samples = |path: &Path| -> Result<Vec<Sample>, Failure> {
        let text = std::fs::read_to_string(path)
            .map_err(|error| format!("{}: {error}", path.display()))?;
        Ok(text.lines().map(serde_json::from_str).collect::<Result<_, _>>()?)
    };
    let all: Result<Vec<_>, _> = files.iter().map(|path| samples(path)).collect();
    Ok(all?.concat())
}

fn collected(options: &Options) -> Result<Vec<Sample>, Failure> {
    let Options { places, seed, towns, radii, methods, .. } = options;
    let inputs = if options.wrong_inputs { Inputs::Wrong(&options.mistake) } else { Inputs::Sound };
    if options.real {
        return trials::of_real_streets(radii[0], inputs, methods);
    }
    if options.scene.is_empty() {
        return trials::of_towns(towns, *places, radii, *seed, inputs, methods);
    }
    let mut samples = Vec::new();
    for argument in &options.scene {
        let scene = scene::open(argument, None)?;
        samples.extend(trials::of_scene(scene.as_ref(), *places, *seed, inputs, methods)?);
    }
    Ok(samples)
}
