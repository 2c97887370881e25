use std::collections::BTreeMap;
use std::path::PathBuf;

use posescope::diagnosis::Grade;
use posescope::localize::QueryResult;
use posescope::scene;
use posescope::survey::{Prediction, Tried};

use crate::Failure;
use crate::calibration::{Scored, area_under_curve, calibration_error};
use crate::numbers::{percent, print_table};

/// Does the map of a survey say where photos will not be localised?
///
/// Takes the photos near a reference of a survey that was made with many: some of them are the survey, the others are set
/// aside and compared with what the map says of them.
#[derive(clap::Args)]
pub struct Options {
    /// The results of the survey, each `FOLDER/near/results.jsonl`.
    #[arg(required = true)]
    results: Vec<PathBuf>,
    /// The scene that was surveyed.
    #[arg(long, default_value = "street")]
    scene: String,
    #[arg(long, default_value_t = 25.0)]
    radius: f64,
    /// Of so many photos one is of the survey.
    #[arg(long, default_value_t = 3)]
    every: usize,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let scene = scene::open(&options.scene, None)?;
    let pose = |frame: &str| scene.pose(scene.find(frame).ok()?);
    let mut by_method: BTreeMap<String, Vec<(usize, Tried)>> = BTreeMap::new();
    for path in &options.results {
        for line in std::fs::read_to_string(path)?.lines() {
            let result: QueryResult = serde_json::from_str(line)?;
            let reference = result.references.first().and_then(|reference| pose(reference));
            let Some((query, reference)) = pose(&result.query).zip(reference) else { continue };
            let tried = Tried { query, reference, is_right: result.grade == Grade::Right };
            let frame = scene.find(&result.query)?;
            by_method.entry(result.method.name().to_owned()).or_default().push((frame, tried));
        }
    }
    let mut rows = Vec::new();
    for (method, mut tried) in by_method {
        tried.sort_by_key(|(frame, _)| *frame);
        let part = |is_own: bool| -> Vec<Tried> {
            let all = tried.iter().enumerate();
            let own = all.filter(|(at, _)| (at % options.every == 0) == is_own);
            own.map(|(_, (_, one))| *one).collect()
        };
        let (surveyed, aside) = (part(true), part(false));
        let map = Prediction::of(&surveyed, options.radius);
        let mut scored: Vec<Scored> = aside
            .iter()
            .map(|one| (map.chance(&one.query, &one.reference), one.is_right))
            .collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        let failed = aside.iter().filter(|one| !one.is_right).count();
        rows.push(vec![
            method,
            surveyed.len().to_string(),
            aside.len().to_string(),
            format!("{:.0} %", percent(failed, aside.len())),
            area_under_curve(&scored).map_or("–".to_owned(), |area| format!("{area:.3}")),
            format!("{:.3}", calibration_error(&scored)),
        ]);
    }
    print_table("method,surveyed,set aside,of these failed,AUC,calibration error", &rows);
    Ok(())
}
