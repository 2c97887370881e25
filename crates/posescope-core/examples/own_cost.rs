//! A cost of one's own, searched as the direct methods search theirs:
//! `cargo run --release -p posescope-core --example own_cost`.

mod walls;

use std::error::Error;

use posescope_core::cost::{IntensityPair, QueryChannel, Statistic};
use posescope_core::geometry::PoseError;
use posescope_core::{
    Cloud, Cost, Direct, Params, Photo, Pose, Problem, Query, ReferenceTuple, Trace, localize_by,
};
use walls::CAMERA;

/// 1 − the normalised cross-correlation of query and synthetic view: brightness and contrast of
/// either do not matter.
struct CrossCorrelation;

impl Cost for CrossCorrelation {
    /// It looks at the query slightly smoothed, and at the reference as it is.
    fn query_channel(&self) -> QueryChannel<'_> {
        QueryChannel::smoothed(1.0)
    }

    /// It looks at each pair.
    fn statistic(&self) -> Statistic<'_> {
        Statistic::of_pairs(distance)
    }
}

fn distance(pairs: &[IntensityPair]) -> Option<f64> {
    let count = pairs.len() as f64;
    let mean = |value: fn(&IntensityPair) -> f32| {
        pairs.iter().map(|pair| f64::from(value(pair))).sum::<f64>() / count
    };
    let (query, synthetic) = (mean(|pair| pair.query), mean(|pair| pair.synthetic));
    let (mut both, mut of_query, mut of_synthetic) = (0.0, 0.0, 0.0);
    for pair in pairs {
        let q = f64::from(pair.query) - query;
        let s = f64::from(pair.synthetic) - synthetic;
        both += q * s;
        of_query += q * q;
        of_synthetic += s * s;
    }
    let scale = (of_query * of_synthetic).sqrt();
    // No pair, or an image without contrast, decides nothing: that is no cost, not a high one.
    (scale > 0.0).then(|| 1.0 - both / scale)
}

fn main() -> Result<(), Box<dyn Error>> {
    let photo = |values| Photo::from_gray_values(CAMERA.width, CAMERA.height, values);
    let cloud: Cloud = walls::scan().collect();
    let start = Pose::identity();
    let reference =
        ReferenceTuple::new("reference", photo(walls::photo(0.0))?, CAMERA, start, cloud)?;
    // As if taken at dusk: darker, and with less contrast.
    let dusk = walls::photo(1.0).iter().map(|value| 20 + value / 4).collect();
    let query = Query::new("query", photo(dusk)?, CAMERA)?;
    let problem = Problem::new(query, reference, 3.0)?;

    let estimator = Direct::searching("ncc", Box::new(CrossCorrelation), &Params::default());
    let outcome = localize_by(&estimator, &problem, &mut Trace::off())?;
    let truth = Pose::translation(0.0, 0.0, 1.0);
    let error = PoseError::between(&truth, &outcome.pose?);
    println!("{:.3} m and {:.2}° from the truth", error.translation_m, error.rotation_deg);
    if let Some(cost) = outcome.cost {
        println!(
            "cost {:.4} after {} poses; {:?} with shuffled pixels",
            cost.best, cost.evaluations, cost.shuffled
        );
    }
    if error.translation_m > 0.3 {
        return Err("that is too far off".into());
    }
    Ok(())
}

#[test]
fn it_runs() {
    main().unwrap_or_else(|error| panic!("{error}"));
}
