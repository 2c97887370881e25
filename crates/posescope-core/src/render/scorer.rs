//! Scoring many hypotheses of the direct methods at once.

mod on_device;

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use rayon::prelude::*;

use super::device::device_in_use;
use super::worker::{Prepared, Worker};
use super::{ColoredPoint, Rasterizer, Score, SplattedPixel, SyntheticView};
use crate::camera::Intrinsics;
use crate::cost::{Cost, Explanation, IntensityPair};
use crate::geometry::Pose;
use crate::image::FloatImage;
use on_device::OnDevice;

/// A synthetic view beside the query, and what the cost makes of the two.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The view.
    pub view: SyntheticView,
    /// Query and view at each covered pixel, in the order of the view's pixels.
    pub pairs: Vec<IntensityPair>,
    /// Cost and support.
    pub score: Score,
    /// What the cost was made of; `None` where there is no cost.
    pub explanation: Option<Explanation>,
}

/// Hypotheses that are scored between two checkpoints, at most: enough to keep eight threads busy.
pub const MOST_AT_A_TIME: usize = 256;

/// Hypotheses that a thread scores between two checkpoints. Of a street photo of 1241 × 376 px one
/// takes some 50 µs, so that whoever wants to stop waits a few milliseconds.
const PER_THREAD: usize = 64;

/// Hypotheses that a thread takes at once. At the end of a batch the others wait for the last job: with 4 of
/// 32 hypotheses for up to an eighth of the time, with 2 of 64 for a thirty-second.
const PER_JOB: usize = 2;

/// Renders the coloured cloud for a hypothesis and compares it with the query.
pub struct Scorer<'a> {
    points: &'a [ColoredPoint],
    query: Arc<FloatImage>,
    intrinsics: Intrinsics,
    splat_px: usize,
    cost: &'a dyn Cost,
    prepared: OnceLock<Arc<Prepared>>,
    /// What scores many hypotheses instead of the threads.
    on_device: OnDevice,
    /// Those that no thread works with at present.
    idle: Mutex<Vec<Worker<'a>>>,
}

impl<'a> Scorer<'a> {
    /// A scorer for one query. `query` is smoothed as the cost wants it and has the size that
    /// `intrinsics` says.
    pub fn new(
        points: &'a [ColoredPoint],
        query: Arc<FloatImage>,
        intrinsics: &Intrinsics,
        splat_px: usize,
        cost: &'a dyn Cost,
    ) -> Self {
        Self {
            points,
            query,
            intrinsics: *intrinsics,
            splat_px,
            cost,
            prepared: OnceLock::new(),
            on_device: OnDevice::new(device_in_use()),
            idle: Mutex::default(),
        }
    }

    /// The same query as another camera of the same size would have taken it.
    #[must_use]
    pub fn seen_by(&self, intrinsics: &Intrinsics) -> Self {
        Self {
            points: self.points,
            query: Arc::clone(&self.query),
            intrinsics: *intrinsics,
            splat_px: self.splat_px,
            cost: self.cost,
            prepared: self.prepared.clone(),
            on_device: self.on_device.unused(),
            idle: Mutex::default(),
        }
    }

    /// How many cameras to score at a time: few enough that a run can be stopped soon, enough for all
    /// threads of the current pool. At most [`MOST_AT_A_TIME`].
    pub fn at_a_time(&self) -> usize {
        (PER_THREAD * rayon::current_num_threads()).min(MOST_AT_A_TIME)
    }

    /// The scores of many cameras `reference_from_camera`, in their order, on the device where there is
    /// one, or else on all threads.
    pub fn score(&self, reference_from_camera: &[Pose]) -> Vec<Score> {
        let scored = self.score_on_device(reference_from_camera);
        scored.unwrap_or_else(|| self.score_on_threads(reference_from_camera))
    }

    /// The scores of many cameras `reference_from_camera`, in their order, on all threads.
    pub(crate) fn score_on_threads(&self, reference_from_camera: &[Pose]) -> Vec<Score> {
        let prepared = self.prepared();
        let score = |worker: &mut Option<Worker<'_>>, pose: &Pose| match worker {
            Some(worker) => worker.score(prepared, &self.query, &pose.inverse()),
            None => self.compare(pose).score,
        };
        reference_from_camera
            .par_chunks(PER_JOB)
            .flat_map_iter(|poses| {
                self.with_worker(prepared, |worker| {
                    poses.iter().map(|pose| score(worker, pose)).collect::<Vec<Score>>()
                })
            })
            .collect()
    }

    /// The scores of one pose as cameras of the same size have them that are built otherwise, in their
    /// order, on all threads.
    pub fn score_seen_by(
        &self,
        cameras: &[Intrinsics],
        reference_from_camera: &Pose,
    ) -> Vec<Score> {
        let prepared = self.prepared();
        let camera_from_points = reference_from_camera.inverse();
        let score = |camera: &Intrinsics| {
            self.with_worker(prepared, |worker| match worker {
                Some(worker) => {
                    worker.look_through(camera);
                    let score = worker.score(prepared, &self.query, &camera_from_points);
                    worker.look_through(&self.intrinsics);
                    score
                }
                None => self.seen_by(camera).compare(reference_from_camera).score,
            })
        };
        cameras.par_iter().map(score).collect()
    }

    fn prepared(&self) -> &Prepared {
        self.prepared.get_or_init(|| Arc::new(Prepared::new(self.points, &self.query, self.cost)))
    }

    /// Work for an idle worker, or a new one; `None` where the plain way is the only one.
    fn with_worker<R>(
        &self,
        prepared: &Prepared,
        work: impl FnOnce(&mut Option<Worker<'a>>) -> R,
    ) -> R {
        let idle = self.idle().pop();
        let mut worker =
            idle.or_else(|| Worker::new(self.cost, prepared, &self.intrinsics, self.splat_px));
        let done = work(&mut worker);
        self.idle().extend(worker);
        done
    }

    fn idle(&self) -> MutexGuard<'_, Vec<Worker<'a>>> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The synthetic view of one camera beside the query.
    pub fn compare(&self, reference_from_camera: &Pose) -> Comparison {
        let view = self.rasterizer().view(self.points, &reference_from_camera.inverse());
        let pairs: Vec<IntensityPair> = self.pair_up(&view.pixels).collect();
        Comparison {
            score: Score { cost: self.cost.evaluate(&pairs), covered: pairs.len() as u32 },
            explanation: self.cost.explain(&pairs),
            view,
            pairs,
        }
    }

    /// Query and view of one camera at each covered pixel, as [`Self::compare`] pairs them up.
    pub fn pairs(&self, reference_from_camera: &Pose) -> Vec<IntensityPair> {
        let mut rasterizer = self.rasterizer();
        let view = rasterizer.view(self.points, &reference_from_camera.inverse());
        self.pair_up(&view.pixels).collect()
    }

    fn rasterizer(&self) -> Rasterizer {
        Rasterizer::new(&self.intrinsics, self.splat_px)
    }

    fn pair_up<'p>(
        &self,
        pixels: &'p [SplattedPixel],
    ) -> impl Iterator<Item = IntensityPair> + use<'_, 'p, 'a> {
        let query: &[f32] = &self.query;
        pixels.iter().map(move |pixel| IntensityPair {
            query: query[pixel.index as usize],
            synthetic: pixel.intensity,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost;
    use crate::render::small_camera;
    use nalgebra::Point3;

    #[test]
    fn a_pose_costs_what_another_camera_sees_and_the_own_one_looks_on_after_it() {
        let point = |i: u16| ColoredPoint {
            position: Point3::new(
                f32::from(i % 9) / 4.0 - 1.0,
                f32::from(i % 7) / 4.0 - 0.75,
                2.0 + f32::from(i % 3),
            ),
            intensity: f32::from(i * 37 % 256),
        };
        let points: Vec<ColoredPoint> = (0..200).map(point).collect();
        let values = |x: u32, y: u32| image::Luma([(x * 29 + y * 31) as f32 % 256.0]);
        let query = Arc::new(FloatImage::from_fn(9, 7, values));
        let cameras = [0.8, 1.0, 1.3].map(|times| Intrinsics {
            fx: 10.0 * times,
            fy: 10.0 * times,
            cx: 4.0 + times,
            ..small_camera()
        });
        let pose = Pose::translation(0.1, 0.0, 0.3);
        for entry in cost::ALL {
            let cost = (entry.params)().cost();
            let query = Arc::clone(&query);
            let scorer = Scorer::new(&points, query, &small_camera(), 1, cost.as_ref());
            let before = scorer.score(&[pose]);
            let expected = cameras.map(|camera| scorer.seen_by(&camera).compare(&pose).score);
            assert_eq!(scorer.score_seen_by(&cameras, &pose), expected, "{}", entry.name);
            assert_eq!(scorer.score(&[pose]), before, "{}", entry.name);
            let compared = scorer.compare(&pose);
            assert_eq!(scorer.pairs(&pose).len(), compared.pairs.len());
        }
    }
}
