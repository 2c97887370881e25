//! A scorer whose hypotheses a device takes.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use rayon::prelude::*;

use super::Scorer;
use crate::geometry::Pose;
use crate::render::projection::Projection;
use crate::render::{Device, Loaded, Score, Workload};

/// One hypothesis of this many of a batch is scored on the threads too.
const CHECKED_ONE_IN: usize = 256;
/// Hypotheses of a batch that are scored on the threads too, at least.
const MIN_CHECKED: usize = 4;

/// What a scorer has of a device.
pub(super) struct OnDevice {
    pub device: Option<Arc<dyn Device>>,
    loaded: OnceLock<Option<Box<dyn Loaded>>>,
    /// Whether it gave any score.
    is_used: AtomicBool,
}

impl OnDevice {
    /// Nothing is there yet.
    pub fn new(device: Option<Arc<dyn Device>>) -> Self {
        Self { device, loaded: OnceLock::new(), is_used: AtomicBool::new(false) }
    }
}

impl Scorer<'_> {
    /// The same on this device, or on threads alone.
    #[must_use]
    pub fn on(mut self, device: Option<Arc<dyn Device>>) -> Self {
        self.on_device = OnDevice::new(device);
        self
    }

    /// Whether any score was a device's.
    pub(crate) fn is_from_device(&self) -> bool {
        self.on_device.is_used.load(Ordering::Relaxed)
    }

    /// The device's scores are not those of the threads.
    pub(crate) fn distrust_device(&self) {
        if let Some(device) = &self.on_device.device {
            device.distrust();
        }
    }

    /// The scores of many cameras on the device; `None` where the threads are to score them.
    pub(super) fn score_on_device(&self, reference_from_camera: &[Pose]) -> Option<Vec<Score>> {
        let OnDevice { device, loaded, .. } = &self.on_device;
        let device = device.as_ref()?;
        device.batch(reference_from_camera.len())?;
        let statistic = &self.statistic;
        if !statistic.is_counted() {
            return None;
        }
        let reach = self.splat_px / 2;
        let load = || {
            device.load(&Workload {
                points: &self.cloud.points,
                query: &self.query,
                width: self.intrinsics.width,
                height: self.intrinsics.height,
                reach: reach as u32,
                statistic,
            })
        };
        let loaded = loaded.get_or_init(load).as_ref()?;
        let rows =
            |pose: &Pose| Projection::new(&self.intrinsics, reach as i32, &pose.inverse()).rows;
        let projections: Vec<_> = reference_from_camera.iter().map(rows).collect();
        let tallies = loaded.tally(&projections)?;
        let scored = tallies.par_iter().map(|tally| Some(tally.as_ref()?.score(statistic)));
        let scored: Vec<Option<Score>> = scored.collect();

        let (places, again) = self.checked(reference_from_camera, &scored);
        let agrees =
            |(&place, again): (&usize, &Score)| scored[place].is_none_or(|score| score == *again);
        if !places.iter().zip(&again).all(agrees) {
            device.distrust();
            return None;
        }
        self.on_device.is_used.store(true, Ordering::Relaxed);
        let mut scores: Vec<Score> = scored
            .into_iter()
            .map(|score| score.unwrap_or(Score { cost: None, covered: 0 }))
            .collect();
        for (place, again) in places.into_iter().zip(again) {
            scores[place] = again;
        }
        Some(scores)
    }

    /// The threads' scores of some of a batch: of all that the device could not decide, of its least, and of
    /// some in between.
    fn checked(&self, poses: &[Pose], scored: &[Option<Score>]) -> (Vec<usize>, Vec<Score>) {
        let count = (poses.len() / CHECKED_ONE_IN).max(MIN_CHECKED);
        let step = (poses.len() / count).max(1);
        let undecided = (0..poses.len()).filter(|&place| scored[place].is_none());
        let cost = |place: &usize| Some((scored[*place]?.cost?, *place));
        let least = (0..poses.len())
            .filter_map(|place| cost(&place))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, place)| place);
        let mut places: Vec<usize> =
            undecided.chain((0..poses.len()).step_by(step)).chain(least).collect();
        places.sort_unstable();
        places.dedup();
        let again: Vec<Pose> = places.iter().map(|&place| poses[place]).collect();
        let again = self.score_on_threads(&again);
        (places, again)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::cost::{self, JointHistogram, Statistic};
    use crate::image::FloatImage;
    use crate::method::Method;
    use crate::render::{
        ColoredCloud, ColoredPoint, ProjectionRows, Rasterizer, Tally, small_camera,
    };

    /// A device that draws plainly, and perhaps tells a lie.
    #[derive(Debug, Default)]
    struct Plain {
        lies: bool,
        is_distrusted: Arc<AtomicBool>,
    }

    struct PlainlyLoaded {
        points: Vec<ColoredPoint>,
        query: Vec<f32>,
        bins: usize,
        lies: bool,
    }

    impl Device for Plain {
        fn batch(&self, hypotheses: usize) -> Option<usize> {
            let is_used = hypotheses > 2 && !self.is_distrusted.load(Ordering::Relaxed);
            is_used.then_some(64)
        }

        fn load(&self, workload: &Workload<'_>) -> Option<Box<dyn Loaded>> {
            let &Statistic::Histogram { bins, .. } = workload.statistic else {
                return None;
            };
            Some(Box::new(PlainlyLoaded {
                points: workload.points.to_vec(),
                query: workload.query.to_vec(),
                bins,
                lies: self.lies,
            }))
        }

        fn distrust(&self) {
            self.is_distrusted.store(true, Ordering::Relaxed);
        }

        fn left_out(&self, _method: Method, _why: &str) {}
    }

    impl Loaded for PlainlyLoaded {
        fn tally(&self, projections: &[ProjectionRows]) -> Option<Vec<Option<Tally>>> {
            // Of a camera that is only moved the rows tell where it is.
            let camera = small_camera();
            let tally = |(place, rows): (usize, &ProjectionRows)| {
                let along = rows[2][3];
                let across = (rows[0][3] - camera.cx as f32 * along) / camera.fx as f32;
                let pose = Pose::translation(f64::from(across), 0.0, f64::from(along));
                let mut rasterizer = Rasterizer::new(&camera, 1);
                let pairs: Vec<_> = rasterizer
                    .splat(&self.points, &pose)
                    .iter()
                    .map(|pixel| cost::IntensityPair {
                        query: self.query[pixel.index as usize],
                        synthetic: pixel.intensity,
                    })
                    .collect();
                let mut counts = JointHistogram::of(&pairs, self.bins).counts;
                if self.lies && place % 2 == 0 {
                    counts[0] += 1;
                }
                // What it cannot decide is left to the threads.
                (place % 3 != 1).then_some(Tally::Counts(counts))
            };
            Some(projections.iter().enumerate().map(tally).collect())
        }
    }

    fn points() -> Vec<ColoredPoint> {
        let point = |i: u16| ColoredPoint {
            position: Point3::new(
                f32::from(i % 9) / 4.0 - 1.0,
                f32::from(i % 7) / 4.0 - 0.75,
                2.0 + f32::from(i % 3),
            ),
            intensity: f32::from(i * 37 % 256),
        };
        (0..200).map(point).collect()
    }

    #[test]
    fn a_device_gives_the_scores_of_the_threads_and_one_that_lies_is_not_asked_again() {
        let cloud = Arc::new(ColoredCloud { points: points(), ..ColoredCloud::default() });
        let values = |x: u32, y: u32| image::Luma([(x * 29 + y * 31) as f32 % 256.0]);
        let query = Arc::new(FloatImage::from_fn(9, 7, values));
        let entry = cost::ALL.iter().find(|entry| entry.name == "mi");
        let cost = (entry.expect("it is registered").make)();
        let scorer = |device: Option<Arc<dyn Device>>| {
            let (cloud, query) = (Arc::clone(&cloud), Arc::clone(&query));
            Scorer::new(cloud, query, &small_camera(), 1, cost.as_ref()).on(device)
        };
        let poses: Vec<Pose> = (0..40)
            .map(|i| Pose::translation(f64::from(i % 8) / 4.0 - 1.0, 0.0, f64::from(i / 8) / 4.0))
            .collect();
        let on_threads = scorer(None).score(&poses);
        assert!(on_threads.iter().all(|score| score.cost.is_some()));
        for lies in [false, true] {
            let is_distrusted = Arc::new(AtomicBool::new(false));
            let scorer =
                scorer(Some(Arc::new(Plain { lies, is_distrusted: Arc::clone(&is_distrusted) })));
            assert_eq!(scorer.score(&poses), on_threads);
            assert_eq!(is_distrusted.load(Ordering::Relaxed), lies);
            assert_eq!(scorer.is_from_device(), !lies);
        }
    }
}
