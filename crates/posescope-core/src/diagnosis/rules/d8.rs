//! D8: the minimum lies where the grid ends.

use super::*;

pub(super) const RULE: Rule = Rule {
    title: "the search ended at its edge",
    advice: "raise --radius",
    applies_to: &[Family::Grid],
    needs_truth: false,
    test: Test::Method(test),
    decided_at: DecidedAt::Stage(Stage::Search(Phase::PositionCoarse)),
    proof: Proof::CostMap(MapOverlay::Rim),
    remedies: d1::remedies,
    ..Rule::new(Code::D8)
};

/// With the truth, where the minimum's basin goes on outside; without, of a pose that is more likely wrong
/// than right.
fn test(case: &Case<'_>) -> Option<Diagnosis> {
    match case.subject.truth {
        Some(_) => {
            let search = case.search?;
            let rivals = search.rivals()?;
            let rim = on_rim(case)?;
            (!rivals.is_changed && search.goes_on_outside()).then_some(rim)
        }
        None => on_rim(case).filter(|_| case.subject.is_low()),
    }
}

fn on_rim(case: &Case<'_>) -> Option<Diagnosis> {
    case.subject.outcome.cost?;
    let offset = case.subject.evidence.minimum?.offset;
    let (grid, radius_m) = (&case.subject.params.grid, case.subject.problem.uncertainty_radius_m);
    grid.is_on_rim(&offset, radius_m).then(|| {
        let distance_m = offset.right_m.hypot(offset.forward_m);
        RULE.found(&Rim {
            distance_m,
            radius_m,
            yaw_deg: offset.yaw_rad.to_degrees().abs(),
            yaw_range_deg: grid.yaw_range_deg,
            is_position: distance_m > radius_m - 0.5 * grid.coarse_step_m,
        })
    })
}

#[derive(Serialize)]
struct Rim {
    distance_m: f64,
    radius_m: f64,
    yaw_deg: f64,
    yaw_range_deg: f64,
    is_position: bool,
}

impl fmt::Display for Rim {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_position {
            write!(
                f,
                "The search ended at its edge: {} from the reference, where its coarse grid ends at {}.",
                metres(self.distance_m),
                metres(self.radius_m)
            )?;
        } else {
            write!(
                f,
                "The search ended at its edge: a yaw of {:.1}°, where its coarse grid ends at ±{:.1}°.",
                self.yaw_deg, self.yaw_range_deg
            )?;
        }
        f.write_str(" The minimum may lie outside.")
    }
}
