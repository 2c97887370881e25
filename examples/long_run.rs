//! A run folder of many results, out of one of few: what the window is measured with.
//!
//! ```sh
//! posescope eval street --limit 40 --out runs/few
//! cargo run --release --no-default-features --example long_run -- runs/few runs/many 10000
//! posescope view runs/many
//! ```
//!
//! The results of the first run are repeated over all frames of their scene, as many as are asked for. Only
//! their queries' names differ; nothing is localised.

use std::error::Error;
use std::fs;
use std::io::{BufWriter, Write as _};
use std::path::Path;

use posescope::run::{read_run, result_lines};
use posescope::scene;
use serde_json::Value;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [from, to, count] = words.as_slice() else {
        return Err("RUN, the folder to write and a number of results expected".into());
    };
    let (from, to, count) = (Path::new(from), Path::new(to), count.parse::<usize>()?);
    let run = read_run(from)?;
    let scene = scene::open(&run.scenes[0], run.format.as_deref())?;
    let results: Vec<Value> = result_lines(from)?
        .map(|line| Ok(serde_json::from_str(&line?)?))
        .collect::<Result<_, Box<dyn Error>>>()?;
    // Results of one query stay together.
    let mut groups: Vec<Vec<Value>> = Vec::new();
    for result in results {
        match groups.last_mut() {
            Some(group) if group[0]["query"] == result["query"] => group.push(result),
            _ => groups.push(vec![result]),
        }
    }
    if groups.is_empty() {
        return Err(format!("{}: no results", from.display()).into());
    }
    fs::create_dir_all(to)?;
    fs::copy(from.join("run.toml"), to.join("run.toml"))?;
    let mut file = BufWriter::new(fs::File::create(to.join("results.jsonl"))?);
    let frames = scene.frames().iter().cycle();
    let repeated = groups.iter().cycle().zip(frames);
    let mut written = 0;
    for (group, frame) in repeated {
        for result in group.iter().take(count - written) {
            let mut result = result.clone();
            result["query"] = Value::from(frame.as_str());
            writeln!(file, "{result}")?;
            written += 1;
        }
        if written == count {
            break;
        }
    }
    file.flush()?;
    println!(
        "{written} results of {} frames in {}",
        scene.frames().len(),
        to.display()
    );
    Ok(())
}
