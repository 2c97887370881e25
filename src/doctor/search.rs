//! Readings with a free number, each with the number that fits best.

use super::reading::{Change, Mistake, Reading};
use super::sample::{Agreement, Sample, partners};
use crate::camera::Intrinsics;

/// Smaller shifts of a camera are ignored \[m\].
const MIN_ASIDE_M: f64 = 0.12;
/// Smaller shifts of pixels are ignored \[px\].
const MIN_PX: f64 = 8.0;
/// What another step of a search must gain.
const STEP_GAIN: f64 = 0.04;

/// Poses and clouds of a camera beside this one.
pub(super) fn aside_reading(right_m: f64) -> Reading {
    let remedy = format!("shift poses and clouds by {right_m:.2} m along the camera's x axis");
    Reading::new(Mistake::OtherStereoCamera, &remedy, Change::Aside(right_m))
}

/// Another focal length and another centre.
pub(super) fn camera_reading(stated: &Intrinsics, change: Change) -> Reading {
    let (fits, _) = change.camera(stated);
    let remedy = format!(
        "use a focal length of {:.0} px instead of {:.0} and a centre at ({:.0}, {:.0}) instead of ({:.0}, {:.0}), \
         which fit the photos better",
        fits.fx, stated.fx, fits.cx, fits.cy, stated.cx, stated.cy
    );
    Reading::new(Mistake::WrongCamera, &remedy, change)
}

/// The remedy for clouds that are turned [°] about y, x and z and shifted along x, y and z. It names the moves that `is_told`
/// selects; `None` if that selects none.
pub(super) fn moves_in_words(moves: &[f64; 6], is_told: impl Fn(usize) -> bool) -> Option<String> {
    const NAMES: [&str; 6] = ["about y", "about x", "about z", "along x", "along y", "along z"];
    let words = (0..6).filter(|axis| is_told(*axis)).map(|axis| match axis {
        0..=2 => format!("turn the clouds by {:.1}° {}", moves[axis], NAMES[axis]),
        _ => format!("shift the clouds by {:.2} {}", moves[axis], NAMES[axis]),
    });
    let words: Vec<String> = words.collect();
    (!words.is_empty()).then(|| words.join(" and "))
}

impl Sample<'_> {
    /// The readings with a free number, each with the number that fits best.
    pub(super) fn searched(&self, choosing: &[usize]) -> Vec<Reading> {
        let mut found = Vec::new();
        let aside: Vec<f64> = (-20..=20).map(|step| 0.05 * f64::from(step)).collect();
        if let Some(right_m) = self.best_of(choosing, &aside, &|right_m| Change::Aside(right_m))
            && right_m.abs() > MIN_ASIDE_M
        {
            found.push(aside_reading(right_m));
        }
        found.extend(self.best_camera(choosing));
        found.extend(self.best_move(choosing));
        let bends: Vec<f64> = (-16..=16).map(|step| 0.03 * f64::from(step)).collect();
        if let Some(k1) = self.best_of(choosing, &bends, &Change::Lens)
            && self.bends_by_px(k1) > MIN_PX
        {
            let remedy = format!("add {k1:.2} to the distortion k1, which fits the photos better");
            found.push(Reading::new(Mistake::UndistortedTwice, &remedy, Change::Lens(k1)));
        }
        found
    }

    /// The value that fits best.
    fn best_of(
        &self,
        choosing: &[usize],
        values: &[f64],
        change: &dyn Fn(f64) -> Change,
    ) -> Option<f64> {
        let scored = values.iter().map(|&value| {
            let mean = Agreement::mean(&self.scores(choosing, &change(value)));
            (value, mean.worth())
        });
        let best = scored.max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(best.0)
    }

    /// Fits focal length and principal point alternately.
    fn best_camera(&self, choosing: &[usize]) -> Option<Reading> {
        let first = self.sights.values().next()?.camera;
        let step = f64::from(first.width) / 120.0;
        let shifts: Vec<f64> = (-6..=6).map(|k| step * f64::from(k)).collect();
        let scales: Vec<f64> = (-14..=14).map(|k| (0.025 * f64::from(k)).exp()).collect();
        let (mut times, mut right, mut down) = (1.0, 0.0, 0.0);
        for _ in 0..2 {
            let camera = |times, right, down| Change::Camera { times, right, down };
            times = self.best_of(choosing, &scales, &|times| camera(times, right, down))?;
            right = self.best_of(choosing, &shifts, &|right| camera(times, right, down))?;
            down = self.best_of(choosing, &shifts, &|down| camera(times, right, down))?;
        }
        let moved_px =
            f64::hypot(right, down).max((times - 1.0_f64).abs() * f64::from(first.width) / 2.0);
        (moved_px > MIN_PX).then(|| {
            self.with_camera(camera_reading(&first, Change::Camera { times, right, down }))
        })
    }

    /// The camera of photos of another size, by its centre: it is near the middle of the photos that it belongs to. `None`
    /// where it is near the middle of these, or where both axes do not agree.
    pub(super) fn camera_of_other_size(&self) -> Option<Reading> {
        /// Centres are off the middle by less, as a share.
        const OFF: f64 = 0.1;
        let camera = self.sights.values().next()?.camera;
        let times = |side: u32, centre: f64| f64::from(side) / (2.0 * centre + 1.0);
        let [across, down] = [times(camera.width, camera.cx), times(camera.height, camera.cy)];
        let times = (across * down).sqrt();
        let is_of_other_size = (across / down).ln().abs() < OFF && times.ln().abs() > 1.5 * OFF;
        is_of_other_size.then(|| {
            let remedy = format!(
                "multiply the camera parameters by about {times:.2}: their centre is the middle of photos of {:.0}x{:.0}",
                f64::from(camera.width) / times,
                f64::from(camera.height) / times
            );
            self.with_camera(Reading::new(Mistake::WrongCamera, &remedy, Change::Resized(times)))
        })
    }

    /// With the camera's numbers, if the photos are as their files are: those of a lens are not known here.
    pub(super) fn with_camera(&self, reading: Reading) -> Reading {
        match self.sights.iter().next() {
            Some((&frame, sight)) if self.scene.pixel_map(frame).is_none() => {
                reading.with_camera(&sight.camera)
            }
            _ => reading,
        }
    }

    /// Turns or shifts the clouds along one axis, and along a second one if that helps too.
    fn best_move(&self, choosing: &[usize]) -> Option<Reading> {
        const STEPS: i32 = 4;
        const TURN_DEG: f64 = 2.0;
        /// A step of a shift as a share of the depth.
        const SHIFT: f64 = 0.05;
        /// Fine steps are this share of a step.
        const FINE: f64 = 0.2;
        const AXES: usize = 2;
        let camera = self.sights.values().next()?.camera;
        let depth_m = self.median_depth_m()?;
        let step = |axis: usize| if axis < 3 { TURN_DEG } else { SHIFT * depth_m };
        let mut moved = [0.0; 6];
        let mut worth_before =
            Agreement::mean(&self.scores(choosing, &Change::Move(moved))).worth();
        for _ in 0..AXES {
            let along = |moved: &[f64; 6], axis: usize, by: f64| {
                let mut changed = *moved;
                changed[axis] += by * step(axis);
                let score = Agreement::mean(&self.scores(choosing, &Change::Move(changed)));
                (changed, score.worth())
            };
            let steps = (-STEPS..=STEPS).filter(|by| *by != 0).map(f64::from);
            let coarse = (0..6).flat_map(|axis| steps.clone().map(move |by| (axis, by)));
            let tried = coarse.map(|(axis, by)| (axis, along(&moved, axis, by)));
            let (axis, (best, _)) = tried.max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
            let fine = (-STEPS..=STEPS).map(|by| along(&best, axis, FINE * f64::from(by)));
            let (best, worth) = fine.max_by(|a, b| a.1.total_cmp(&b.1))?;
            if worth < worth_before + STEP_GAIN {
                break;
            }
            (moved, worth_before) = (best, worth);
        }
        let px_of = |axis: usize| match axis {
            2 => moved[2].to_radians() * f64::from(camera.width) / 2.0,
            0 | 1 => moved[axis].to_radians() * camera.fx,
            _ => moved[axis] / depth_m * camera.fx,
        };
        let words = moves_in_words(&moved, |axis| px_of(axis).abs() > MIN_PX)?;
        Some(Reading::new(Mistake::MovedCloud, &words, Change::Move(moved)))
    }

    /// Whether the stated lengths are such as a wrong unit would leave. At one place all photos agree, so a unit that
    /// draws cameras together would always seem to fit.
    pub(super) fn may_be(&self, change: &Change) -> bool {
        let Change::Size(times) = *change else { return true };
        let Some(depth_m) = self.median_depth_m() else { return true };
        let steps = self.anchors.iter().flat_map(|&anchor| {
            let here = self.poses.get(anchor).copied().flatten();
            let there = partners(anchor, self.poses.len());
            there.filter_map(move |partner| {
                Some((self.poses[partner]?.translation.vector - here?.translation.vector).norm())
            })
        });
        let mut steps: Vec<f64> = steps.collect();
        steps.sort_by(f64::total_cmp);
        let step_m = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
        if times < 1.0 { self.has_far_clouds() } else { step_m > depth_m }
    }

    /// Whether the clouds are farther than any scan reaches.
    pub(super) fn has_far_clouds(&self) -> bool {
        const FAR_M: f64 = 300.0;
        self.median_depth_m().is_some_and(|depth_m| depth_m > FAR_M)
    }

    /// The median depth of the points of the compared clouds.
    fn median_depth_m(&self) -> Option<f64> {
        let points = self.clouds.values().flatten();
        let mut depths: Vec<f64> = points.map(|point| point.z).filter(|z| *z > 0.0).collect();
        depths.sort_by(f64::total_cmp);
        depths.get(depths.len() / 2).copied()
    }

    /// How far a distortion moves pixels at the left and right edge.
    fn bends_by_px(&self, k1: f64) -> f64 {
        let Some(sight) = self.sights.values().next() else {
            return 0.0;
        };
        let half = f64::from(sight.camera.width) / 2.0;
        let x = half / sight.camera.fx;
        (k1 * x * x).abs() * half
    }
}
