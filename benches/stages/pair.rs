//! The pair of frames that is measured on, and what the direct methods make of it.

use std::error::Error;
use std::sync::{Arc, LazyLock};

use posescope::cost::{self, Cost, Evaluator};
use posescope::geometry::Pose;
use posescope::grid::{GridParams, Lattice, Offset, Phase};
use posescope::image::FloatImage;
use posescope::params::Params;
use posescope::problem::Problem;
use posescope::render::{ColoredCloud, DepthCanvas, PointArrays, Values, color_cloud_by};
use posescope::scene;

/// Two frames of the street, 8 m apart, or those that the environment names.
pub static PAIR: LazyLock<Problem> = LazyLock::new(|| {
    let variable = |name: &str, default: &str| std::env::var(name).unwrap_or(default.to_owned());
    let scene = variable("POSESCOPE_SCENE", "street");
    let indices = variable("POSESCOPE_PAIR", "70,62");
    named_pair(&scene, &indices).unwrap_or_else(|error| {
        eprintln!("error: {error}");
        std::process::exit(2);
    })
});

fn named_pair(scene: &str, indices: &str) -> Result<Problem, Box<dyn Error>> {
    let expected = || {
        format!(
            "POSESCOPE_PAIR={indices}: the indices of a query and a reference expected, as 70,62"
        )
    };
    let (query, reference) = indices.split_once(',').ok_or_else(expected)?;
    let index = |text: &str| text.trim().parse::<usize>().map_err(|_| expected());
    let scene = scene::open(scene, None)?;
    let known = |index: usize| match scene.frames().len() {
        frames if index < frames => Ok(index),
        frames => Err(format!(
            "POSESCOPE_PAIR={indices}: {} has {frames} frames, 0 to {}",
            scene.name(),
            frames.saturating_sub(1)
        )),
    };
    Ok(Problem {
        query: scene.query(known(index(query)?)?)?,
        reference: scene.reference(known(index(reference)?)?)?,
        uncertainty_radius_m: 15.0,
        prior_m: None,
        seed: 0,
        matches: None,
    })
}

/// The cost of the method of this name, as it is by default.
pub fn registered_cost(name: &str) -> Box<dyn Cost> {
    let entry = cost::ALL.iter().find(|entry| entry.name == name);
    (entry.expect("is listed").params)().cost()
}

/// The query of the pair and the cloud of its reference, as a cost looks at them.
pub fn seen_by(cost: &dyn Cost) -> (Arc<FloatImage>, ColoredCloud) {
    let (query, reference) = (&PAIR.query, &PAIR.reference);
    let cloud = color_cloud_by(
        &reference.cloud,
        &reference.intrinsics,
        &Params::default().render,
        cost.reference_channel(&reference.photo.gray),
    );
    (Arc::new(cost.query_channel(&query.photo.gray)), cloud)
}

/// The cameras of the coarse search in a disc of 10 m.
pub fn poses_of_a_disc() -> Vec<Pose> {
    let centre = Offset::default();
    let lattice = Lattice::new(Phase::PositionCoarse, centre, 10.0, &GridParams::default());
    let hypotheses = lattice.expect("a small lattice");
    let hypotheses = hypotheses.hypotheses();
    hypotheses
        .map(|(_, offset)| offset.reference_from_camera())
        .collect()
}

/// The pixels that cameras cover, and the sum of their costs.
pub struct Judged {
    pub covered: usize,
    pub sum: f64,
}

/// Hands `work` what renders each of some cameras once and judges it by PM's cost and MI's, on one thread.
pub fn with_both_costs<R>(
    splat_px: usize,
    work: impl FnOnce(&mut dyn FnMut(&[Pose]) -> Judged) -> R,
) -> R {
    let [photometric, information] = ["pm", "mi"].map(registered_cost);
    let (query, cloud) = seen_by(information.as_ref());
    let (Evaluator::Pairs(mut error), Evaluator::Counts { bins, mut cost }) =
        (photometric.evaluator(), information.evaluator())
    else {
        unreachable!("PM looks at pairs, MI at their histogram");
    };
    let of_points: Vec<f32> = cloud.points.iter().map(|point| point.intensity).collect();
    let values = Values {
        query: &query,
        points: &of_points,
    };
    let points = PointArrays::new(&cloud.points);
    let mut canvas = DepthCanvas::new(&PAIR.query.intrinsics, splat_px).expect("a usual photo");
    let (mut bin_pairs, mut counts) = (Vec::new(), Vec::new());
    work(&mut |poses| {
        let mut judged = Judged {
            covered: 0,
            sum: 0.0,
        };
        for pose in poses {
            let pairs = canvas.draw(&points, values, &pose.inverse());
            cost::put_into_bins(pairs, bins, &mut bin_pairs);
            cost::count_pairs(&bin_pairs, bins, &mut counts);
            judged.covered += pairs.len();
            judged.sum += error(pairs).unwrap_or_default() + cost(&counts).unwrap_or_default();
        }
        judged
    })
}
