//! From a start to the minimum near it: pattern search (Hooke, Jeeves, *Direct Search*, JACM 8(2), 1961), with a step to
//! where parabolas through the costs beside a pose have their minima.

use nalgebra::{Translation3, UnitQuaternion, Vector3};

use crate::geometry::Pose;
use crate::render::MAX_AT_A_TIME;

/// In which directions a pose may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize)]
pub enum Freedoms {
    /// Right, forward, yaw: what the coarse lattice has.
    Plane,
    /// All six.
    Six,
}

impl Freedoms {
    /// The axes, of [`moved`].
    fn axes(self) -> &'static [usize] {
        match self {
            Self::Plane => &[0, 2, 4],
            Self::Six => &[0, 1, 2, 3, 4, 5],
        }
    }

    /// How many there are.
    pub fn count(self) -> usize {
        self.axes().len()
    }
}

/// How far the steps of a pattern search go, and where they end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatternSearch {
    /// The directions.
    pub freedoms: Freedoms,
    /// The first step \[m\].
    pub first_m: f64,
    /// A step below this is the last \[m\].
    pub last_m: f64,
    /// Radians that count as a metre.
    pub rad_per_m: f64,
    /// Whether a step aside turns the camera, so that what is a metre's turn away stays in place.
    pub in_place: bool,
}

impl PatternSearch {
    fn moved(&self, pose: &Pose, by: &[f64; 6]) -> Pose {
        if self.in_place { moved_in_place(pose, by, self.rad_per_m) } else { moved(pose, by) }
    }
}

/// Where a refinement starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// `reference_from_camera`.
    pub pose: Pose,
    /// Its cost.
    pub cost: f64,
}

/// Where a refinement ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refined {
    /// Where it started.
    pub start: Start,
    /// `reference_from_camera` of the least cost found.
    pub pose: Pose,
    /// The least cost.
    pub cost: f64,
    /// Poses that were scored on the way.
    pub evaluations: u64,
}

impl Refined {
    /// A refinement that has not begun.
    pub fn unmoved(&start: &Start) -> Self {
        Self { start, pose: start.pose, cost: start.cost, evaluations: 0 }
    }
}

/// Rounds after which a refinement ends, whatever its step: each either moves or shrinks.
const MAX_ROUNDS: usize = 60;

/// The pose moved along its own axes: right, down, forward \[m\], then turned about them \[rad\].
pub fn moved(pose: &Pose, by: &[f64; 6]) -> Pose {
    let [x, y, z, about_x, about_y, about_z] = *by;
    pose * Pose::from_parts(
        Translation3::new(x, y, z),
        UnitQuaternion::from_scaled_axis(Vector3::new(about_x, about_y, about_z)),
    )
}

/// As [`moved`], but what is a metre's turn away stays in place: a step to the right turns to the left, and a step down
/// turns up. The cost of each axis then depends less on the others.
pub fn moved_in_place(pose: &Pose, by: &[f64; 6], rad_per_m: f64) -> Pose {
    let [x, y, z, about_x, about_y, about_z] = *by;
    moved(pose, &[x, y, z, about_x + y * rad_per_m, about_y - x * rad_per_m, about_z])
}

/// A refinement at work.
struct Walk {
    refined: Refined,
    step_m: f64,
}

/// Refines all starts side by side: each looks one step to both sides of every axis, and where the
/// parabolas through those costs have their minima; it goes to the best of what it saw, and halves its
/// step where nothing was better or the parabolas' minima are near.
///
/// `costs` gives the costs of some poses, at most [`MAX_AT_A_TIME`] at a time, in their order; `None`
/// for one that has no say.
///
/// # Errors
/// Those of `costs`.
pub fn pattern_search<E>(
    starts: &[Start],
    plan: &PatternSearch,
    mut costs_of: impl FnMut(&[Pose]) -> Result<Vec<Option<f64>>, E>,
) -> Result<Vec<Refined>, E> {
    let mut walks: Vec<Walk> = starts
        .iter()
        .map(|start| Walk { refined: Refined::unmoved(start), step_m: plan.first_m })
        .collect();
    let mut scored = |poses: &[Pose]| -> Result<Vec<Option<f64>>, E> {
        let mut costs = Vec::with_capacity(poses.len());
        for some in poses.chunks(MAX_AT_A_TIME) {
            costs.extend(costs_of(some)?);
        }
        Ok(costs)
    };
    let axes = plan.freedoms.axes();
    for _ in 0..MAX_ROUNDS {
        let mut active: Vec<&mut Walk> =
            walks.iter_mut().filter(|walk| walk.step_m >= plan.last_m).collect();
        if active.is_empty() {
            break;
        }
        let probes: Vec<Pose> = active
            .iter()
            .flat_map(|walk| {
                axes.iter().flat_map(|&axis| {
                    [-1.0, 1.0].map(|side| {
                        let mut by = [0.0; 6];
                        by[axis] = side * step_along(axis, walk.step_m, plan);
                        plan.moved(&walk.refined.pose, &by)
                    })
                })
            })
            .collect();
        let costs = scored(&probes)?;
        let vertices: Vec<[f64; 6]> = active
            .iter()
            .zip(costs.chunks(2 * axes.len()))
            .map(|(walk, costs)| vertex(walk, costs, plan))
            .collect();
        let combined: Vec<Pose> = active
            .iter()
            .zip(&vertices)
            .map(|(walk, by)| plan.moved(&walk.refined.pose, by))
            .collect();
        let at_vertices = scored(&combined)?;
        let per_walk = probes.chunks(2 * axes.len()).zip(costs.chunks(2 * axes.len()));
        let per_walk = per_walk.zip(combined.iter().zip(&at_vertices).zip(&vertices));
        for (walk, ((probes, costs), ((combined, at_vertex), by))) in
            active.iter_mut().zip(per_walk)
        {
            walk.refined.evaluations += probes.len() as u64 + 1;
            let before = walk.refined.cost;
            let seen = std::iter::once((combined, at_vertex)).chain(probes.iter().zip(costs));
            for (pose, cost) in seen {
                if let Some(cost) = *cost
                    && cost < walk.refined.cost
                {
                    (walk.refined.pose, walk.refined.cost) = (*pose, cost);
                }
            }
            let is_near = axes
                .iter()
                .all(|&axis| by[axis].abs() <= 0.5 * step_along(axis, walk.step_m, plan));
            if walk.refined.cost >= before || is_near {
                walk.step_m *= 0.5;
            }
        }
    }
    Ok(walks.into_iter().map(|walk| walk.refined).collect())
}

fn step_along(axis: usize, step_m: f64, plan: &PatternSearch) -> f64 {
    match axis {
        0..3 => step_m,
        _ => step_m * plan.rad_per_m,
    }
}

/// The way to where the parabola along each axis is least, at most one step.
fn vertex(walk: &Walk, costs: &[Option<f64>], plan: &PatternSearch) -> [f64; 6] {
    let here = walk.refined.cost;
    let mut by = [0.0; 6];
    for (&axis, sides) in plan.freedoms.axes().iter().zip(costs.chunks(2)) {
        let (Some(before), Some(behind)) = (sides[0], sides[1]) else {
            continue;
        };
        let curvature = before - 2.0 * here + behind;
        let steps = if curvature > 0.0 {
            (0.5 * (before - behind) / curvature).clamp(-1.0, 1.0)
        } else if before < behind {
            -1.0
        } else {
            1.0
        };
        by[axis] = steps * step_along(axis, walk.step_m, plan);
    }
    by
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PoseError;
    use nalgebra::Point3;
    use std::convert::Infallible;

    /// A valley around a pose, long where forward and pitch go together.
    fn valley(truth: &Pose, pose: &Pose) -> f64 {
        let between = truth.inverse() * pose;
        let t = between.translation.vector;
        let r = 10.0 * between.rotation.scaled_axis();
        let along = t.z + 0.9 * r.x;
        t.x.powi(2)
            + 2.0 * t.y.powi(2)
            + 0.3 * along.powi(2)
            + 0.1 * t.z.powi(2)
            + r.y.powi(2)
            + r.z.powi(2)
    }

    fn plan(freedoms: Freedoms) -> PatternSearch {
        PatternSearch { freedoms, first_m: 0.5, last_m: 1e-4, rad_per_m: 0.1, in_place: false }
    }

    fn refined(truth: &Pose, start: Pose, plan: &PatternSearch) -> Refined {
        let cost = valley(truth, &start);
        let costs = |poses: &[Pose]| {
            assert!(poses.len() <= MAX_AT_A_TIME);
            let costs = poses.iter().map(|pose| Some(valley(truth, pose)));
            Ok::<_, Infallible>(costs.collect())
        };
        let Ok(refined) = pattern_search(&[Start { pose: start, cost }], plan, costs);
        refined[0]
    }

    #[test]
    fn six_freedoms_reach_the_foot_of_a_valley() {
        let truth = moved(&Pose::identity(), &[3.0, -0.4, 7.0, 0.03, -0.1, 0.02]);
        let start = moved(&truth, &[0.6, 0.2, -0.9, 0.02, 0.05, -0.03]);
        let found = refined(&truth, start, &plan(Freedoms::Six));
        let error = PoseError::between(&truth, &found.pose);
        assert!(error.translation_m < 0.01 && error.rotation_deg < 0.05, "{error}");
        assert!(found.cost < valley(&truth, &start) && found.evaluations > 0);
    }

    #[test]
    fn a_step_in_place_keeps_what_is_a_metres_turn_away_in_its_direction() {
        let (pose, rad_per_m) = (Pose::translation(1.0, 2.0, 3.0), 0.05);
        let seen = pose * Point3::new(0.0, 0.0, 1.0 / rad_per_m);
        let off = |by: [f64; 6], rad_per_m: f64| {
            let ahead = moved_in_place(&pose, &by, rad_per_m).inverse() * seen;
            ahead.x.hypot(ahead.y)
        };
        for by in [[0.2, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, -0.2, 0.0, 0.0, 0.0, 0.0]] {
            assert!(off(by, rad_per_m) < 1e-3, "{by:?}: {}", off(by, rad_per_m));
            assert!(off(by, 0.0) > 0.19);
        }
    }

    #[test]
    fn in_the_plane_height_roll_and_pitch_stay() {
        let truth = moved(&Pose::identity(), &[0.0, -0.4, 0.0, 0.03, 0.0, 0.02]);
        let found = refined(&truth, Pose::translation(0.5, 0.0, 0.8), &plan(Freedoms::Plane));
        assert!(found.pose.translation.y.abs() < 1e-9);
        let axis = found.pose.rotation.scaled_axis();
        assert!(axis.x.abs() < 1e-9 && axis.z.abs() < 1e-9);
        // The valley is rolled and pitched about a point 0.4 m above the plane, which moves its foot aside
        // by about that much of a turn.
        let aside = found.pose.translation.x.abs();
        assert!(aside < 0.02, "{aside}");
    }

    #[test]
    fn where_nothing_has_a_cost_a_start_stays_and_ends() {
        let start = Start { pose: Pose::identity(), cost: 0.7 };
        let nothing = |poses: &[Pose]| Ok::<_, Infallible>(vec![None; poses.len()]);
        let Ok(refined) = pattern_search(&[start], &plan(Freedoms::Six), nothing);
        assert_eq!((refined[0].pose, refined[0].cost), (start.pose, 0.7));
    }
}
