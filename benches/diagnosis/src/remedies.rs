//! Is something found that helps, and does it help again?
//!
//! `cargo run -p posescope-diagnosis --bin remedies -- --cases 60` looks for results of PM and MI, in all
//! conditions of the street, whose primary verdict is that the search failed, has the program explain them, and
//! counts those for which a remedy is listed. Each listed remedy is then tried again by the command line
//! that it says, and has to make the result right.
//!
//! Options: `--cases N` (60), `--seed N` (0), `--code CODE` (D3) of the primary verdict, `--method METHODS`
//! (pm,mi), `--explain N` (12) runs for each, `--program PATH` (target/debug/posescope), `--candidate ARGS`,
//! repeatable, to try something else where nothing helped.

use std::collections::BTreeMap;
use std::process::Command;

use posescope::diagnosis::Tolerance;
use posescope::localize::QueryResult;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope_diagnosis::places::Pairing;

/// What was asked for.
struct Options {
    cases: usize,
    seed: u64,
    code: String,
    methods: String,
    runs: usize,
    program: String,
    candidates: Vec<String>,
}

impl Options {
    fn parse(mut arguments: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut options = Self {
            cases: 60,
            seed: 0,
            code: "D3".to_owned(),
            methods: "pm,mi".to_owned(),
            runs: 12,
            program: "target/debug/posescope".to_owned(),
            candidates: Vec::new(),
        };
        while let Some(argument) = arguments.next() {
            let value = arguments
                .next()
                .ok_or(format!("{argument} needs a value"))?;
            let number = || {
                value
                    .parse::<usize>()
                    .map_err(|_| format!("{value} is no number"))
            };
            match argument.as_str() {
                "--cases" => options.cases = number()?,
                "--seed" => options.seed = number()? as u64,
                "--code" => options.code = value,
                "--method" => options.methods = value,
                "--explain" => options.runs = number()?,
                "--program" => options.program = value,
                "--candidate" => options.candidates.push(value),
                other => return Err(format!("unknown argument {other}")),
            }
        }
        Ok(options)
    }
}

/// What became of the wrong results.
#[derive(Default)]
struct Counted {
    wrong: usize,
    helped: usize,
    listed: usize,
    listed_again: usize,
    runs: usize,
    /// By what was done differently: how often it helped, and how often it was the first that did.
    by_remedy: BTreeMap<String, (usize, usize)>,
    /// By candidate, how often it helped where nothing else did.
    by_candidate: BTreeMap<String, usize>,
}

fn main() -> Result<(), String> {
    let options = Options::parse(std::env::args().skip(1))?;
    let drives = Condition::ALL.map(|c| Traversal::new(WORLD_SEED, c, Size::Full));
    let mut counted = Counted::default();
    for number in 0..40 * options.cases {
        if counted.wrong >= options.cases {
            break;
        }
        let asked = Asked::of(&Pairing::numbered(&drives, number, options.seed, false));
        let methods = ["--method".to_owned(), options.methods.clone()];
        for result in asked.results(&options.program, &methods)? {
            let primary = result.diagnosis.first();
            if primary.is_some_and(|primary| primary.code.name() == options.code) {
                explain(&asked, result.method.name(), &options, &mut counted)?;
            }
        }
    }
    report(&options, &counted);
    Ok(())
}

/// A query and a reference, as a command line says them.
struct Asked {
    scenes: [String; 2],
    query: String,
    reference: String,
}

impl Asked {
    fn of(pairing: &Pairing) -> Self {
        let scene = |condition: usize| format!("street:{}", Condition::ALL[condition].name());
        Self {
            scenes: [scene(pairing.references), scene(pairing.queries)],
            query: pairing.query.to_string(),
            reference: pairing.reference.to_string(),
        }
    }

    /// What the program answers with more arguments. A reference among them takes the place of the own.
    fn results(&self, program: &str, more: &[String]) -> Result<Vec<QueryResult>, String> {
        let [scene, queries] = &self.scenes;
        let mut command = Command::new(program);
        command.args(["run", scene, "--queries", queries, "--query", &self.query]);
        if !more.iter().any(|argument| argument == "--reference") {
            command.args(["--reference", &self.reference]);
        }
        command.args(more).args(["--quiet", "--json", "-"]);
        let output = command.output();
        let output = output.map_err(|error| format!("{program}: {error}"))?;
        let text = String::from_utf8_lossy(&output.stdout);
        text.lines()
            .map(|line| serde_json::from_str(line).map_err(|error| format!("{line}: {error}")))
            .collect()
    }
}

/// Has a wrong result explained, and tries again what is listed.
fn explain(
    asked: &Asked,
    method: &str,
    options: &Options,
    counted: &mut Counted,
) -> Result<(), String> {
    let own = ["--method".to_owned(), method.to_owned()];
    let explained = [
        &own[..],
        &["--explain".to_owned(), options.runs.to_string()],
    ];
    let results = asked.results(&options.program, &explained.concat())?;
    let explanation = results
        .into_iter()
        .find_map(|result| result.explanation)
        .ok_or("a wrong result has no explanation")?;
    counted.wrong += 1;
    counted.runs += explanation.runs;
    counted.helped += usize::from(!explanation.helped.is_empty());
    counted.listed += explanation.helped.len();
    let is_right_with = |args: &[String]| -> Result<bool, String> {
        let is_own_method = !args.iter().any(|argument| argument == "--method");
        let own = if is_own_method { &own[..] } else { &[] };
        let results = asked.results(&options.program, &[own, args].concat())?;
        let tolerance = Tolerance::default();
        let is_right = |result: &QueryResult| {
            let error = result.error.as_ref();
            error.is_some_and(|error| tolerance.contains(error))
        };
        Ok(results.iter().any(is_right))
    };
    for (at, helped) in explanation.helped.iter().enumerate() {
        counted.listed_again += usize::from(is_right_with(&helped.args)?);
        // Which frame another reference is says nothing of the remedy.
        let name = match helped.args.first().map(String::as_str) {
            Some("--reference") => "another reference".to_owned(),
            _ => helped.args.join(" "),
        };
        let times = counted.by_remedy.entry(name).or_default();
        times.0 += 1;
        times.1 += usize::from(at == 0);
    }
    if explanation.helped.is_empty() {
        for candidate in &options.candidates {
            let args: Vec<String> = candidate.split_whitespace().map(str::to_owned).collect();
            let times = counted.by_candidate.entry(candidate.clone()).or_default();
            *times += usize::from(is_right_with(&args)?);
        }
    }
    eprintln!(
        "{} of {}: {} against {}, {method}: {} remedies; so far {} of {} help again",
        counted.wrong,
        options.cases,
        asked.query,
        asked.reference,
        explanation.helped.len(),
        counted.listed_again,
        counted.listed
    );
    Ok(())
}

fn report(options: &Options, counted: &Counted) {
    let Counted {
        wrong,
        helped,
        listed,
        listed_again,
        runs,
        ..
    } = counted;
    println!(
        "{}: a remedy for {helped} of {wrong}; of {listed} listed, {listed_again} make the result right again; \
         {runs} runs\n",
        options.code
    );
    println!("| remedy | helped | first that did |\n|---|---|---|");
    for (remedy, (times, first)) in &counted.by_remedy {
        println!("| {remedy} | {times} | {first} |");
    }
    for (candidate, times) in &counted.by_candidate {
        println!("| {candidate}, where nothing helped | {times} | |");
    }
}
