//! Successive halving: many starts are refined side by side, and the worse half ends early.
//!
//! This is successive halving. After a few long steps, most starts are seen to lead to a high minimum, or to the minimum
//! of a better start. Each time the step is halved, the search drops the half with the higher MAP costs.

use super::{Level, MultiStart};
use crate::geometry::Pose;
use crate::render::Objective;
use crate::search::{PatternSearch, Refined, Start};

impl MultiStart {
    /// Refines the walks, of which at least `fewest` are refined to the end where so many lead to places of their
    /// own. The lowest MAP cost comes first.
    ///
    /// # Errors
    /// What the checkpoint says, which is asked before each round.
    pub(super) fn halved<E>(
        &self,
        level: &Level<impl Objective>,
        mut walks: Vec<Refined>,
        plan: &PatternSearch,
        fewest: usize,
        map_cost: impl Fn(&Pose, f64) -> f64,
        mut checkpoint: impl FnMut() -> Result<(), E>,
    ) -> Result<Vec<Refined>, E> {
        let (mut ended, mut step_m) = (Vec::new(), plan.first_m);
        while step_m >= plan.last_m {
            let here: Vec<Start> =
                walks.iter().map(|&Refined { pose, cost, .. }| Start { pose, cost }).collect();
            let plan = PatternSearch { first_m: step_m, last_m: step_m, ..*plan };
            let moved = level.refined(&here, &plan, &mut checkpoint)?;
            for (walk, moved) in walks.iter_mut().zip(moved) {
                (walk.pose, walk.cost) = (moved.pose, moved.cost);
                walk.evaluations += moved.evaluations;
            }
            sort_by_map_cost(&mut walks, &map_cost);
            let most = fewest.max(walks.len().div_ceil(2));
            let (kept, others) = self.partition(walks, most);
            walks = kept;
            ended.extend(others);
            step_m *= 0.5;
        }
        walks.extend(ended);
        sort_by_map_cost(&mut walks, &map_cost);
        Ok(walks)
    }

    /// The first so many that are at places of their own, and all others.
    pub(super) fn partition(
        &self,
        sorted: Vec<Refined>,
        most: usize,
    ) -> (Vec<Refined>, Vec<Refined>) {
        let (mut kept, mut others) = (Vec::<Refined>::new(), Vec::new());
        for one in sorted {
            let is_new = kept.iter().all(|known| self.is_apart(&known.pose, &one.pose));
            if is_new && kept.len() < most {
                kept.push(one);
            } else {
                others.push(one);
            }
        }
        (kept, others)
    }
}

pub(super) fn sort_by_map_cost(refined: &mut [Refined], map_cost: impl Fn(&Pose, f64) -> f64) {
    refined.sort_by(|a, b| map_cost(&a.pose, a.cost).total_cmp(&map_cost(&b.pose, b.cost)));
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;
    use crate::params::Params;
    use crate::render::Score;
    use crate::search::Freedoms;

    /// Two bowls, at the origin and, not as deep, 4 m to the right.
    struct Bowls;

    impl Objective for Bowls {
        fn score(&self, reference_from_camera: &[Pose]) -> Vec<Score> {
            let cost = |pose: &Pose| {
                let bowl = |x: f64, foot: f64| {
                    let at = pose.translation.vector - nalgebra::Vector3::x() * x;
                    foot + 0.1 * at.norm_squared() + pose.rotation.angle().powi(2)
                };
                bowl(0.0, 0.1).min(bowl(4.0, 0.2))
            };
            let score = |pose| Score { cost: Some(cost(pose)), covered: 100 };
            reference_from_camera.iter().map(score).collect()
        }

        fn batch(&self, hypotheses: usize) -> usize {
            hypotheses
        }

        fn shuffled(&self, _: &Pose, _: u64) -> Option<f64> {
            None
        }
    }

    fn refined(starts: &[f64], fewest: usize) -> (Vec<Refined>, Vec<Refined>) {
        let six = MultiStart::new(&Params::default());
        let level = six.level(Bowls);
        let poses: Vec<Pose> = starts.iter().map(|&x| Pose::translation(x, 0.0, 0.0)).collect();
        let starts = level.starts(&poses);
        let plan = PatternSearch {
            freedoms: Freedoms::Six,
            first_m: 0.5,
            last_m: 0.004,
            rad_per_m: 0.05,
            in_place: false,
        };
        let never = || Ok::<_, Infallible>(());
        let Ok(mut all) = level.refined(&starts, &plan, never);
        let map_cost = |_: &Pose, cost: f64| cost;
        sort_by_map_cost(&mut all, map_cost);
        let walks = starts.iter().map(Refined::unmoved).collect();
        let Ok(halved) = six.halved(&level, walks, &plan, fewest, map_cost, never);
        (halved, all)
    }

    #[test]
    fn what_goes_on_to_the_end_ends_where_it_does_alone() {
        let (halved, all) = refined(&[0.9], 1);
        assert_eq!(halved, all);
        let (halved, all) = refined(&[0.9, 4.7], 2);
        assert_eq!(halved, all);
    }

    #[test]
    fn the_best_is_found_with_less_work_and_nothing_is_lost() {
        let starts = [-1.3, 0.9, 1.1, 3.1, 3.4, 4.7, 5.2];
        let (halved, all) = refined(&starts, 2);
        assert_eq!((halved[0].pose, halved[0].cost), (all[0].pose, all[0].cost));
        assert_eq!(halved.len(), starts.len());
        let work = |refined: &[Refined]| refined.iter().map(|one| one.evaluations).sum::<u64>();
        assert!(3 * work(&halved) < 2 * work(&all), "{} of {}", work(&halved), work(&all));
        let other = halved.iter().find(|one| (one.pose.translation.x - 4.0).abs() < 0.01);
        assert!(other.is_some(), "{halved:?}");
    }
}
