//! PM's cost and MI's of the same drawing.

use posescope::cost::{self, Evaluator, IntensityPair};
use posescope::geometry::Pose;
use posescope::render::{DepthCanvas, PointArrays, Values};

use super::pair::{PAIR, registered_cost, seen_by};

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
    let (Evaluator::SquaredDifferences(mut error), Evaluator::Counts { bins, mut cost }) =
        (photometric.evaluator(), information.evaluator())
    else {
        unreachable!("PM looks at differences, MI at a joint histogram");
    };
    let of_points: Vec<f32> = cloud.points.iter().map(|point| point.intensity).collect();
    let values = Values {
        query: &query,
        points: &of_points,
    };
    let points = PointArrays::new(cloud.points.iter().map(|point| point.position));
    let mut canvas = DepthCanvas::new(&PAIR.query.intrinsics, splat_px).expect("a usual photo");
    let keep = |query, synthetic| IntensityPair { query, synthetic };
    let (mut differences, mut bin_pairs, mut counts) = (Vec::new(), Vec::new(), Vec::new());
    work(&mut |poses| {
        let mut judged = Judged {
            covered: 0,
            sum: 0.0,
        };
        for pose in poses {
            let pairs = canvas.draw(&points, values, &pose.inverse(), keep);
            differences.clear();
            differences.extend(pairs.iter().map(IntensityPair::squared_difference));
            cost::put_into_bins(pairs, bins, &mut bin_pairs);
            cost::count_pairs(&bin_pairs, bins, &mut counts);
            judged.covered += pairs.len();
            judged.sum +=
                error(&differences).unwrap_or_default() + cost(&counts).unwrap_or_default();
        }
        judged
    })
}
