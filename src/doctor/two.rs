//! Two mistakes at once, of which neither shows alone: one of the poses, and one of clouds, cameras or units.
//!
//! The features of two photos and the clouds give the motion between them, whatever the poses are. So each reading of
//! clouds and cameras gives motions, and each reading of the poses explains more or less of them. A factor of all lengths
//! is the ratio of both.

use super::reading::Reading;
use super::sample::{AS_STATED, Sample};
use super::trial::{FITTING_MOTIONS, UNITS};

/// A reading of clouds or cameras, one of poses, and a factor of lengths, by numbers of the readings.
#[derive(Clone, Copy, Debug)]
struct Both {
    view: Option<usize>,
    pose: Option<usize>,
    /// By what the poses' lengths are multiplied.
    times: f64,
    /// The share of features that they explain.
    explained: f64,
}

impl Both {
    fn is_single(&self) -> bool {
        let parts = [self.view.is_some(), self.pose.is_some(), self.times != 1.0];
        parts.into_iter().filter(|part| *part).count() <= 1
    }
}

impl Sample<'_> {
    /// The first of two mistakes that together explain the features, where no single one does: the one that is not of the
    /// poses.
    pub(super) fn first_of_two(&self, usual: &[Reading]) -> Option<Reading> {
        /// How many times what a single reading explains, and what is explained as stated.
        const MORE: f64 = 1.3;
        const TIMES: f64 = 3.0;
        /// Lengths of poses and of motions differ by less, as the logarithm of their ratio.
        const SAME: f64 = 0.2;
        let stated = self.explained(&AS_STATED, 1.0);
        // The poses decide which part of a map is in view.
        if self.has_map || stated >= FITTING_MOTIONS {
            return None;
        }
        let views = usual.iter().enumerate().filter(|(_, one)| one.change.is_of_views());
        let views = views.map(|(at, _)| Some(at));
        let poses = usual.iter().enumerate().filter(|(_, one)| one.change.is_of_poses());
        let poses: Vec<Option<usize>> =
            std::iter::once(None).chain(poses.map(|(at, _)| Some(at))).collect();
        let (mut best, mut best_single): (Option<Both>, f64) = (None, stated);
        for view in std::iter::once(None).chain(views) {
            let changed = view.map(|at| self.clone().read_as(&usual[at].change));
            let sample = changed.as_ref().unwrap_or(self);
            for &pose in &poses {
                let change = pose.map_or(AS_STATED, |at| usual[at].change);
                let scale = sample.scale_of(&change);
                let is_of_size = scale.is_none_or(|(measured, error)| {
                    measured.ln().abs() <= f64::max(SAME, 3.0 * error)
                });
                let as_stated = is_of_size.then_some(1.0);
                let unit = scale.and_then(|(measured, error)| unit_near(measured, error));
                for times in as_stated.into_iter().chain(unit) {
                    let explained = sample.explained(&change, times);
                    let both = Both { view, pose, times, explained };
                    if both.is_single() {
                        best_single = best_single.max(explained);
                    } else if best.is_none_or(|known| explained > known.explained) {
                        best = Some(both);
                    }
                }
            }
        }
        let best = best?;
        log::debug!("two mistakes: {best:?}, one: {best_single:.2}, as stated {stated:.2}");
        let is_clear = best.explained >= FITTING_MOTIONS
            && best.explained >= MORE * best_single
            && best.explained >= TIMES * stated;
        // Three mistakes are too many to be told apart.
        if !is_clear || best.view.is_some() && best.times != 1.0 {
            return None;
        }
        match best.view {
            Some(at) => Some(usual[at].clone()),
            None => Some(self.of_scale(best.times, Some(best.times))),
        }
    }
}

/// The factor of a unit by which stated lengths are to be multiplied.
fn unit_near(measured: f64, error: f64) -> Option<f64> {
    /// The factor of a unit is met as closely, as a share.
    const OF_UNIT: f64 = 0.05;
    UNITS.into_iter().find(|unit| (measured / unit).ln().abs() < OF_UNIT.max(2.0 * error))
}
