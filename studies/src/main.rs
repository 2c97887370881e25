//! The studies behind the published numbers: `cargo run -p posescope-studies -- STUDY`.

mod answered;
mod believed;
mod calibration;
mod cases;
mod examined;
mod exported;
mod extrinsics;
mod faults;
mod frames;
mod fusions;
mod growth;
mod index;
mod map_size;
mod methods;
mod numbers;
mod opinions;
mod peers;
mod places;
mod places_found;
mod planted;
/// The scenes with mistakes that the tests examine, too.
#[path = "../../tests/it/planted.rs"]
mod planted_scene;
mod pose_files;
mod real_pairs;
mod remedies;
mod same_results;
mod scene_statistics;
mod signals;
mod survey_map;
mod truth;

use std::process::ExitCode;

use clap::Parser;

/// What stops a study.
type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Makes the published numbers again. `studies/README.md` has them, each with its command.
#[derive(Parser)]
enum Study {
    Methods(methods::Options),
    Fusions(fusions::Options),
    Planted(planted::Options),
    Answered(answered::Options),
    Believed(believed::Options),
    Calibration(calibration::Options),
    Extrinsics(extrinsics::Options),
    Examined(examined::Options),
    Scenes(scene_statistics::Options),
    MapSize(map_size::Options),
    Places(places_found::Options),
    Index(index::Options),
    Opinions(opinions::Options),
    PoseFiles(pose_files::Options),
    Growth(growth::Options),
    Peers(peers::Options),
    Remedies(remedies::Options),
    SameResults(same_results::Options),
    SurveyMap(survey_map::Options),
}

fn main() -> ExitCode {
    let done = match Study::parse() {
        Study::Methods(options) => methods::run(&options),
        Study::Fusions(options) => fusions::run(&options),
        Study::Planted(options) => planted::run(&options),
        Study::Answered(options) => answered::run(&options),
        Study::Believed(options) => believed::run(&options),
        Study::Calibration(options) => calibration::run(&options),
        Study::Extrinsics(options) => extrinsics::run(&options),
        Study::Examined(options) => examined::run(&options),
        Study::Scenes(options) => scene_statistics::run(&options),
        Study::MapSize(options) => map_size::run(&options),
        Study::Places(options) => places_found::run(&options),
        Study::Index(options) => index::run(&options),
        Study::Opinions(options) => opinions::run(&options),
        Study::PoseFiles(options) => pose_files::run(&options),
        Study::Growth(options) => growth::run(&options),
        Study::Peers(options) => peers::run(&options),
        Study::Remedies(options) => remedies::run(&options),
        Study::SurveyMap(options) => survey_map::run(&options),
        Study::SameResults(options) => match same_results::run(&options) {
            Ok(0) => Ok(()),
            Ok(_) => return ExitCode::FAILURE,
            Err(error) => Err(error),
        },
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(3)
        }
    }
}
