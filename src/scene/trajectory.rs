//! Poses by time.

use nalgebra::{Translation3, UnitQuaternion};

use crate::geometry::Pose;

/// The greatest time difference of measurements of the same moment \[s\], as in the benchmark's association tool.
pub(super) const SAME_MOMENT_S: f64 = 0.02;
/// The most candidates per time, more than any camera takes in a moment. It limits the work for a file with the same
/// time in all lines.
const MAX_CANDIDATES: usize = 64;
/// The longest interval for interpolation \[s\]. Motion capture has a pose every 10 ms, a tracked camera every 33 ms.
const INTERPOLATED_S: f64 = 0.1;

#[derive(Clone, Debug, Default)]
pub(super) struct Trajectory {
    samples: Vec<(f64, Pose)>,
    /// The longest interval for interpolation.
    interpolated: f64,
    /// The greatest time difference at which a pose still holds.
    same_moment: f64,
}

impl Trajectory {
    /// Poses by time \[s\], in any order.
    pub fn in_seconds(samples: Vec<(f64, Pose)>) -> Self {
        Self::new(samples, INTERPOLATED_S, SAME_MOMENT_S)
    }

    /// Poses by time, in any order and any unit. The first of several poses at the same time is used.
    pub fn new(mut samples: Vec<(f64, Pose)>, interpolated: f64, same_moment: f64) -> Self {
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        samples.dedup_by_key(|(time, _)| *time);
        Self { samples, interpolated, same_moment }
    }

    /// The pose at a time: interpolated between two close samples, otherwise that of the same moment, if any.
    pub fn at(&self, time: f64) -> Option<Pose> {
        let after = self.samples.partition_point(|(other, _)| *other < time);
        let next = self.samples.get(after);
        let previous = after.checked_sub(1).and_then(|i| self.samples.get(i));
        if let (Some(previous), Some(next)) = (previous, next)
            && next.0 > time
            && next.0 - previous.0 <= self.interpolated
        {
            let share = (time - previous.0) / (next.0 - previous.0);
            return Some(between(&previous.1, &next.1, share));
        }
        let nearest = [previous, next]
            .into_iter()
            .flatten()
            .map(|(other, pose)| ((other - time).abs(), pose))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        (nearest.0 <= self.same_moment).then_some(*nearest.1)
    }

    pub fn samples(&self) -> &[(f64, Pose)] {
        &self.samples
    }

    /// The trajectory of a part that is fixed to the moving body.
    pub fn of_part(mut self, body_from_part: &Pose) -> Self {
        for (_, pose) in &mut self.samples {
            *pose *= body_from_part;
        }
        self
    }

    /// The first and the last time; `None` without samples.
    pub fn range(&self) -> Option<(f64, f64)> {
        Some((self.samples.first()?.0, self.samples.last()?.0))
    }
}

/// Interpolates between two poses.
fn between(from: &Pose, to: &Pose, share: f64) -> Pose {
    let position = from.translation.vector.lerp(&to.translation.vector, share);
    // Opposite rotations have no shortest path; either will do.
    let rotation: UnitQuaternion<f64> =
        from.rotation.try_slerp(&to.rotation, share, 1e-9).unwrap_or(from.rotation);
    Pose::from_parts(Translation3::from(position), rotation)
}

/// Associates `times` with `others`: the position in `others` for each time. The closest pairs come first, none
/// are more than [`SAME_MOMENT_S`] apart, and each time is used at most once. Both lists are in ascending order.
pub(super) fn associated(times: &[f64], others: &[f64]) -> Vec<Option<usize>> {
    let mut pairs = Vec::new();
    for (index, time) in times.iter().enumerate() {
        let first = others.partition_point(|other| *other < time - SAME_MOMENT_S);
        let near = others[first..].iter().enumerate();
        let near =
            near.take_while(|(_, other)| **other <= time + SAME_MOMENT_S).take(MAX_CANDIDATES);
        pairs.extend(near.map(|(other, at)| ((at - time).abs(), index, first + other)));
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut found = vec![None; times.len()];
    let mut taken = vec![false; others.len()];
    for (_, index, other) in pairs {
        if found[index].is_none() && !taken[other] {
            found[index] = Some(other);
            taken[other] = true;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trajectory(times: &[f64]) -> Trajectory {
        let sample = |&time: &f64| {
            let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, time);
            (time, Pose::from_parts(Translation3::new(10.0 * time, 0.0, 1.0), turn))
        };
        Trajectory::in_seconds(times.iter().map(sample).collect())
    }

    #[test]
    fn a_pose_between_two_is_interpolated_and_one_far_from_all_is_unknown() {
        let trajectory = trajectory(&[0.0, 0.04, 1.0, 1.5]);
        let at = |time| trajectory.at(time);
        for time in [0.0, 0.01, 0.03, 0.04] {
            let pose = at(time).expect("is between");
            assert!((pose.translation.vector.x - 10.0 * time).abs() < 1e-12);
            assert!((pose.rotation.angle() - time).abs() < 1e-12);
        }
        // Within 20 ms of a single sample, its own; farther away, none.
        assert_eq!(at(1.019), at(1.0));
        assert_eq!(at(-0.019), at(0.0));
        assert!(at(1.03).is_none() && at(0.5).is_none() && at(1.6).is_none());
    }

    #[test]
    fn a_pose_at_the_time_of_a_sample_is_the_sample() {
        let trajectory = trajectory(&[0.0, 0.03, 0.06]);
        for (time, pose) in trajectory.samples() {
            assert_eq!(trajectory.at(*time), Some(*pose));
        }
    }

    #[test]
    fn no_sample_knows_no_pose() {
        assert!(trajectory(&[]).at(0.0).is_none());
        assert!(trajectory(&[]).range().is_none());
    }

    #[test]
    fn each_time_is_paired_once_and_with_the_closest() {
        // The second is closer to 0.095 than the first is, which then takes what is left.
        let found = associated(&[0.085, 0.1, 0.2, 0.5], &[0.07, 0.095, 0.21]);
        assert_eq!(found, [Some(0), Some(1), Some(2), None]);
        let found = associated(&[0.1, 0.101], &[0.1]);
        assert_eq!(found, [Some(0), None]);
    }

    #[test]
    fn times_a_fiftieth_apart_are_no_longer_the_same() {
        assert_eq!(associated(&[1.0], &[1.021]), [None]);
        assert_eq!(associated(&[1.0], &[0.981]), [Some(0)]);
    }
}
