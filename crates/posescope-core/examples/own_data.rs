//! Arrays in, pose and events out: `cargo run --release -p posescope-core --example own_data`.

mod walls;

use std::error::Error;

use posescope_core::event::{FeaturesClassified, PhaseSearched};
use posescope_core::features::FeatureState;
use posescope_core::geometry::PoseError;
use posescope_core::{
    Cloud, History, Method, Params, Photo, Pose, Problem, Query, ReferenceTuple, Trace,
    localize_traced,
};
use walls::CAMERA;

fn main() -> Result<(), Box<dyn Error>> {
    // Photos are grey values, row by row; the cloud is in the frame of the reference camera.
    let photo = |values| Photo::from_gray_values(CAMERA.width, CAMERA.height, values);
    let world_from_reference = Pose::translation(100.0, -2.0, 30.0);
    let reference = ReferenceTuple::new(
        "reference",
        photo(walls::photo(0.0))?,
        CAMERA,
        world_from_reference,
        walls::scan().collect::<Cloud>(),
    )?;
    let query = Query::new("query", photo(walls::photo(1.0))?, CAMERA)?;
    // The query is known to be within 3 m of the reference.
    let problem = Problem::new(query, reference, 3.0)?;

    let truth = world_from_reference * Pose::translation(0.0, 0.0, 1.0);
    let params = Params::default();
    for method in [Method::FB, Method::MI] {
        let mut history = History::default();
        let mut trace = Trace::to(&mut history);
        let outcome = localize_traced(&problem, method, &params, &mut trace)?;
        // A query without a pose says why.
        let pose = outcome.pose?;
        let error = PoseError::between(&truth, &pose);
        println!(
            "{}: {:.3} m and {:.2}° from the truth, {} events",
            method.name(),
            error.translation_m,
            error.rotation_deg,
            history.records().len()
        );

        // Every decision is among the events.
        if let Some(last) = history.last::<FeaturesClassified>() {
            let is_inlier = |state: &&FeatureState| matches!(state, FeatureState::Inlier { .. });
            let inliers = last.states.iter().filter(is_inlier).count();
            println!("    {inliers} of {} features agree on it", last.states.len());
        }
        for (_, PhaseSearched { surface, .. }) in history.all() {
            let tried = surface.scores.iter().flatten().count();
            println!("    {}: {tried} poses tried", surface.lattice.phase.name());
        }
        if error.translation_m > 0.3 {
            return Err("that is too far off".into());
        }
    }
    Ok(())
}

#[test]
fn it_runs() {
    main().unwrap_or_else(|error| panic!("{error}"));
}
