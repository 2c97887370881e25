use std::collections::BTreeMap;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Instant;

use posescope::diagnosis::{Evidence, Subject, confidence};
use posescope::estimator;
use posescope::geometry::PoseError;
use posescope::localize::{StageTimes, StageTimings};
use posescope::method::Method;
use posescope::params::Params;
use posescope::scene::Scene;
use posescope::scene::street::{Size, Street};
use posescope::trace::Trace;

use crate::Failure;
use crate::cases::{Case, Plan};
use crate::exported::{self, Answer};
use crate::numbers::{SUMMARY, at_places, mean, median, percent, print_table, summary};
use crate::truth;

/// How well do methods do, each with settings of its own, on the street and on other scenes?
///
/// Prints a row for each method and pair of conditions (the reference's → the query's), scene or distance of the
/// start: shares of the queries, medians over all of them, those without a pose counted as infinitely wrong, and RMSE
/// over those with one.
#[derive(clap::Args)]
pub struct Options {
    /// Measure on so many places of the street, one out of each of as many equal stretches of the route.
    #[arg(long)]
    street: Option<usize>,
    /// Measure on so many pairs of the street whose distances are spread evenly up to the radius.
    #[arg(long)]
    starts: Option<usize>,
    /// Measure on all pairs of frames of a scene.
    #[arg(long)]
    scene: Option<String>,
    /// Poses that are better than those of --scene: lines of a frame's name and a 3 × 4 matrix.
    #[arg(long)]
    truth: Option<PathBuf>,
    /// A method and its settings, as "mi6 mi6.yaws=1", or those of --config paper, as "fb paper"; repeatable.
    #[arg(long, default_values = ["fb", "pm", "mi", "hy"])]
    method: Vec<Asked>,
    /// Pairs of conditions: all, equal, other, the conditions of which all pairs are taken, as overcast,night, or pairs
    /// of the reference's and the query's, as overcast-night.
    #[arg(long, default_value = "equal", value_delimiter = ',')]
    cells: Vec<String>,
    /// Take photos of the street in half size.
    #[arg(long)]
    half: bool,
    #[command(flatten)]
    plan: Plan,
    /// Print each method's shares by the condition of reference and query too, and what MI's cost is at the truth.
    #[arg(long)]
    matrices: bool,
    /// Write each case with what the methods made of it into a folder of its own in this one, for
    /// studies/peers/queries.py. Nothing that one method computed serves the next then, so that times can be compared.
    #[arg(long)]
    export: Option<PathBuf>,
    /// Print the mean time of each stage too, with nothing computed before.
    #[arg(long)]
    stages: bool,
}

/// A method with its settings, as given.
#[derive(Clone)]
struct Asked {
    label: String,
    method: Method,
    params: Params,
}

impl FromStr for Asked {
    type Err = Failure;

    fn from_str(text: &str) -> Result<Self, Failure> {
        let mut words = text.split_whitespace();
        let method = words.next().ok_or("the name of a method expected")?.parse()?;
        let mut params = Params::default();
        words.try_for_each(|word| match word {
            "paper" => params.merge_toml(include_str!("../../assets/paper.toml")),
            assignment => params.assign(assignment),
        })?;
        Ok(Self { label: text.to_owned(), method, params })
    }
}

/// What a method made of a case.
struct Measured {
    rows: Vec<String>,
    method: usize,
    error: Option<PoseError>,
    seconds: f64,
    /// What each stage took; empty unless asked for.
    stages: StageTimes,
    /// Normalised mutual information of the true pose, the pose found, and shuffled pixels; tested of MI alone.
    information: Option<[f64; 3]>,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let plan = &options.plan;
    let measured = match (&options.scene, options.street, options.starts) {
        (Some(path), None, None) => {
            let scene: Arc<dyn Scene> = truth::open(path, options.truth.as_deref())?.into();
            at_places(scene.frames().len(), |at| measure(&plan.pairs(&scene, at)?, options))?
        }
        (None, street, starts) if street.is_some() != starts.is_some() => {
            let cells = cells(&options.cells)?;
            let size = if options.half { Size::Half } else { Size::Full };
            let mut scenes: BTreeMap<&String, Arc<dyn Scene>> = BTreeMap::new();
            for name in cells.iter().flatten() {
                scenes.insert(name, Arc::new(Street::new(name, size)?));
            }
            let scene = |name: &String| Arc::clone(&scenes[name]);
            let pairs: Vec<_> = cells.iter().map(|cell| cell.each_ref().map(scene)).collect();
            let places = street.or(starts).unwrap_or(0);
            at_places(places, |place| {
                let cases = match street {
                    Some(_) => plan.at_place(place, places, &pairs)?,
                    None => plan.of_start(place, places, 6, &pairs[0])?,
                };
                measure(&cases, options)
            })?
        }
        _ => return Err("one of --street N, --starts N and --scene PATH".into()),
    };
    let measured: Vec<Measured> = measured.into_iter().flatten().collect();
    print(&measured, options);
    if options.stages {
        print_stages(&measured, options);
    }
    if options.matrices {
        print_matrices(&measured, options)?;
    }
    Ok(())
}

/// Pairs of conditions, the reference's and the query's.
fn cells(words: &[String]) -> Result<Vec<[String; 2]>, Failure> {
    let conditions: Vec<String> = Street::conditions().map(str::to_owned).collect();
    let has_conditions = words.iter().all(|word| conditions.contains(word));
    let chosen = if has_conditions { words } else { &conditions };
    let pairs = chosen.iter().flat_map(|a| chosen.iter().map(|b| [a.clone(), b.clone()]));
    Ok(match words {
        [word] if word == "equal" => pairs.filter(|[a, b]| a == b).collect(),
        [word] if word == "other" => pairs.filter(|[a, b]| a != b).collect(),
        [word] if word == "all" => pairs.collect(),
        _ if has_conditions => pairs.collect(),
        words => {
            let pair = |word: &String| {
                let (a, b) =
                    word.split_once('-').ok_or(format!("{word} is no pair of conditions"))?;
                Ok([a.to_owned(), b.to_owned()])
            };
            words.iter().map(pair).collect::<Result<_, String>>()?
        }
    })
}

fn measure(cases: &[Case], options: &Options) -> Result<Vec<Measured>, Failure> {
    let mut measured = Vec::new();
    for case in cases {
        let before = measured.len();
        for (method, tested) in options.method.iter().enumerate() {
            let problem = match options.export {
                Some(_) => &exported::forgetful(&case.problem),
                None => &case.problem,
            };
            let started = Instant::now();
            let mut evidence = Evidence::default();
            let estimator = estimator::entry(tested.method).make(&tested.params);
            let outcome = estimator.estimate(problem, &mut Trace::to(&mut evidence))?;
            let subject = Subject::new(problem, tested.method, &tested.params, &outcome, &evidence);
            let outcome = confidence::accepted(&subject, None);
            let seconds = started.elapsed().as_secs_f64();
            let error = outcome.pose.as_ref().ok();
            let information = || {
                let at_truth = estimator.compare_at(problem, &case.truth)?.score.cost?;
                let found = outcome.cost?;
                let costs = [at_truth, found.best, found.shuffled.unwrap_or(1.0)];
                Some(costs.map(|cost| 1.0 - cost))
            };
            let is_wanted = options.matrices && tested.method == Method::MI;
            let mut stages = StageTimings::default();
            if options.stages {
                let problem = exported::forgetful(problem);
                estimator.estimate(&problem, &mut Trace::to(&mut stages))?;
            }
            measured.push(Measured {
                rows: case.rows.clone(),
                method,
                error: error.map(|pose| PoseError::between(&case.truth, pose)),
                seconds,
                stages: stages.into_times(),
                information: is_wanted.then(information).flatten(),
            });
        }
        if let Some(folder) = &options.export {
            let result = |one: &Measured| Answer {
                method: options.method[one.method].label.clone(),
                seconds: one.seconds,
                error: one.error,
            };
            exported::write(folder, case, measured[before..].iter().map(result))?;
        }
    }
    Ok(measured)
}

fn print(measured: &[Measured], options: &Options) {
    let mut groups: BTreeMap<(&str, usize), Vec<&Measured>> = BTreeMap::new();
    for one in measured {
        for row in &one.rows {
            groups.entry((row, one.method)).or_default().push(one);
        }
    }
    let rows = groups.iter().map(|((row, method), own)| {
        let names = vec![row.trim_start().to_owned(), options.method[*method].label.clone()];
        let errors: Vec<_> = own.iter().map(|one| one.error).collect();
        let time = format!("{:.2} s", mean(own.iter().map(|one| one.seconds)));
        [names, summary(&errors), vec![time]].concat()
    });
    print_table(&format!(",method,{SUMMARY},time"), &rows.collect::<Vec<_>>());
}

fn print_stages(measured: &[Measured], options: &Options) {
    for (method, tested) in options.method.iter().enumerate() {
        let own: Vec<_> = measured.iter().filter(|one| one.method == method).collect();
        let sum = StageTimes::sum(own.iter().map(|one| &one.stages));
        let rows = sum.iter().map(|(stage, time)| {
            let milliseconds = 1e3 * time.as_secs_f64() / own.len().max(1) as f64;
            vec![stage.to_owned(), format!("{milliseconds:.1} ms")]
        });
        print_table(&format!("{},time", tested.label), &rows.collect::<Vec<_>>());
    }
}

/// A table for each method, of the reference's condition (rows) by the query's (columns), and one that asks why MI
/// fails where it does: whether its search missed the truth's minimum, or the truth costs more than the pose found.
fn print_matrices(measured: &[Measured], options: &Options) -> Result<(), Failure> {
    let cells = cells(&options.cells)?;
    let is_in_any = |known: &&str| cells.iter().flatten().any(|name| name == known);
    let conditions: Vec<&str> = Street::conditions().filter(is_in_any).collect();
    let matrix = |method: usize, cell: &dyn Fn(&[&Measured]) -> String| {
        let rows = conditions.iter().map(|reference| {
            let cells = conditions.iter().map(|query| {
                let name = format!("{reference} → {query}");
                let is_here = |one: &&Measured| one.method == method && one.rows[0] == name;
                cell(&measured.iter().filter(is_here).collect::<Vec<_>>())
            });
            [format!("**{reference}**")].into_iter().chain(cells).collect()
        });
        let columns: String = conditions.iter().map(|name| format!(",{name}")).collect();
        print_table(&columns, &rows.collect::<Vec<_>>());
    };
    let off = |one: &&Measured| one.error.map_or(f64::INFINITY, |error| error.translation_m);
    for (method, tested) in options.method.iter().enumerate() {
        println!(
            "{}: poses within 10 m / 2 m / 1 m, and the median error of the poses found\n",
            tested.label
        );
        matrix(method, &|here| {
            let within =
                |limit| percent(here.iter().filter(|one| off(one) < limit).count(), here.len());
            let [ten, two, one] = [10.0, 2.0, 1.0].map(within);
            let found = median(here.iter().map(off).filter(|metres| metres.is_finite()));
            format!("{ten:.0} / {two:.0} / {one:.0} %, {found:.2} m")
        });
    }
    let Some(mi) = options.method.iter().position(|tested| tested.method == Method::MI) else {
        return Ok(());
    };
    println!(
        "Normalised mutual information at the true pose / at the pose found / of shuffled pixels (medians); of the \
         poses more than 2 m off, those that cost more than the truth + those that cost less\n"
    );
    matrix(mi, &|here| {
        let known = || here.iter().filter_map(|one| Some((off(one), one.information?)));
        let [truth, found, chance] =
            [0, 1, 2].map(|k| median(known().map(|(_, values)| values[k])));
        let far = || known().filter(|(metres, _)| *metres >= 2.0);
        let missed = far().filter(|(_, [truth, found, _])| truth > found).count();
        format!("{truth:.2} / {found:.2} / {chance:.2}; {missed} + {}", far().count() - missed)
    });
    Ok(())
}
