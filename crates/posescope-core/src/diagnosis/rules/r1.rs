//! R1: the reference does not see the query's scene.

use nalgebra::Point3;

use super::*;
use crate::camera::Intrinsics;

/// Share of the reference's points that the query must show.
const MIN_OVERLAP: f64 = 0.05;

pub(super) const RULE: Rule = Rule {
    title: "the reference does not see the query's scene",
    advice: "use another reference",
    applies_to: Family::MATCHING,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Match),
    proof: Proof::CloudOnPhoto,
    remedies: |_| other_references().into(),
    ..Rule::new(Code::R1)
};

fn test(case: &Case<'_>) -> Option<Diagnosis> {
    case.matches()?;
    let query_from_reference = case.subject.reference_from_truth()?.inverse();
    let problem = case.subject.problem;
    let in_view = |camera: &Intrinsics, point: &Point3<f64>| {
        let pixel = camera.project(point);
        pixel.is_some_and(|pixel| camera.contains(&pixel))
    };
    let (mut seen, mut shared) = (0_usize, 0_usize);
    for point in problem.reference.cloud.points.iter().step_by(8) {
        let point = point.cast();
        if in_view(&problem.reference.intrinsics, &point) {
            seen += 1;
            let other = query_from_reference * point;
            shared += usize::from(in_view(&problem.query.intrinsics, &other));
        }
    }
    let overlap = shared as f64 / seen.max(1) as f64;
    (seen > 0 && overlap < MIN_OVERLAP).then(|| RULE.found(&Overlap { overlap }))
}

evidence!(Overlap { overlap: f64 } =>
    "The reference does not see what the query sees: {:.1} % of its cloud is in the query's true \
     view.",
    100.0 * overlap
);
