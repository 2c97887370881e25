//! Scoring many hypotheses of the direct methods at once.

mod on_device;

use std::sync::{Arc, OnceLock};

use super::device::device_in_use;
use super::pool::{Pool, ShownPoints, at_a_time};
use super::{
    ColoredCloud, Objective, PointArrays, Rasterizer, Score, SplattedPixel, SyntheticView, Values,
    ZBuffer,
};
use crate::camera::Intrinsics;
use crate::cost::{
    BinPair, Cost, Entropies, Explanation, IntensityPair, LesserHalfFinder, MAX_BYTE_BINS, Power,
    Statistic, byte_bin, count_pairs, shuffled,
};
use crate::geometry::Pose;
use crate::image::FloatImage;
use on_device::OnDevice;

/// A synthetic view beside the query, and what the cost makes of the two.
#[derive(Clone, Debug)]
#[non_exhaustive]
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

/// Renders the coloured cloud for a hypothesis and compares it with the query.
pub struct Scorer<'a> {
    cloud: Arc<ColoredCloud>,
    query: Arc<FloatImage>,
    intrinsics: Intrinsics,
    splat_px: usize,
    statistic: Statistic<'a>,
    threads: OnceLock<Threads>,
    rasterizers: Pool<Rasterizer>,
    /// What scores many hypotheses instead of the threads.
    on_device: OnDevice,
}

/// What all hypotheses have in common on the threads, as the statistic wants it.
enum Threads {
    /// The statistic may depend on the order of the pairs, or the image or the joint histogram is too large.
    Plain,
    LesserHalf {
        points: ShownPoints<f32>,
        pool: Pool<(ZBuffer<f32>, LesserHalfFinder)>,
    },
    Histogram {
        bins: usize,
        cost: fn(&Entropies) -> Option<f64>,
        query: Vec<u8>,
        points: ShownPoints<u8>,
        pool: Pool<(ZBuffer<BinPair>, Vec<u32>)>,
    },
}

impl<'a> Scorer<'a> {
    /// A scorer for one query. `query` is smoothed as the cost wants it and has the size that
    /// `intrinsics` says.
    pub fn new(
        cloud: impl Into<Arc<ColoredCloud>>,
        query: Arc<FloatImage>,
        intrinsics: &Intrinsics,
        splat_px: usize,
        cost: &'a dyn Cost,
    ) -> Self {
        Self {
            cloud: cloud.into(),
            query,
            intrinsics: *intrinsics,
            splat_px,
            statistic: cost.statistic(),
            threads: OnceLock::new(),
            rasterizers: Pool::default(),
            on_device: OnDevice::new(device_in_use()),
        }
    }

    /// What decides the cost.
    pub fn statistic(&self) -> &Statistic<'a> {
        &self.statistic
    }

    /// The scores of many cameras `reference_from_camera`, in their order, on the device where there is
    /// one, or else on all threads.
    pub fn score(&self, reference_from_camera: &[Pose]) -> Vec<Score> {
        let scored = self.score_on_device(reference_from_camera);
        scored.unwrap_or_else(|| self.score_on_threads(reference_from_camera))
    }

    /// The scores of many cameras `reference_from_camera`, in their order, on all threads.
    pub(crate) fn score_on_threads(&self, reference_from_camera: &[Pose]) -> Vec<Score> {
        let (poses, query) = (reference_from_camera, self.query.as_raw().as_slice());
        let score = |cost, covered: usize| Score { cost, covered: covered as u32 };
        match self.threads() {
            Threads::Plain => self.rasterizers.score(
                poses,
                || self.rasterizer(),
                |rasterizer, pose| {
                    let pixels = rasterizer.splat(&self.cloud.points, &pose.inverse());
                    self.score_of(&self.pair_up(pixels))
                },
            ),
            Threads::LesserHalf { points, pool } => {
                let values = Values { query, points: &points.values };
                let error =
                    |query, synthetic| IntensityPair { query, synthetic }.squared_difference();
                let worker = || (self.canvas(), LesserHalfFinder::default());
                pool.score(poses, worker, |(canvas, halves), pose| {
                    let errors = canvas.draw(&points.positions, values, &pose.inverse(), error);
                    score(halves.mean(errors), errors.len())
                })
            }
            Threads::Histogram { bins, cost, query, points, pool } => {
                let values = Values { query, points: &points.values };
                let pair = |query, synthetic| BinPair { query, synthetic };
                let worker = || (self.canvas(), Vec::new());
                pool.score(poses, worker, |(canvas, counts), pose| {
                    let pairs = canvas.draw(&points.positions, values, &pose.inverse(), pair);
                    count_pairs(pairs, |pair| *pair, *bins, counts);
                    score(cost(&Entropies::of(counts, *bins)), pairs.len())
                })
            }
        }
    }

    fn threads(&self) -> &Threads {
        self.threads.get_or_init(|| {
            let positions = || PointArrays::new(self.cloud.points.iter().map(|p| p.position));
            let values = self.cloud.points.iter().map(|point| point.intensity);
            let is_large = !ZBuffer::<u8>::can_draw(&self.intrinsics, self.splat_px);
            match self.statistic {
                _ if is_large => Threads::Plain,
                Statistic::LesserHalf { power: Power::One } => Threads::LesserHalf {
                    points: ShownPoints { positions: positions(), values: values.collect() },
                    pool: Pool::default(),
                },
                Statistic::Histogram { bins: bins @ 1..=MAX_BYTE_BINS, cost } => {
                    let bin = |value: f32| byte_bin(value, bins);
                    let values = values.map(bin).collect();
                    Threads::Histogram {
                        bins,
                        cost,
                        query: self.query.iter().copied().map(bin).collect(),
                        points: ShownPoints { positions: positions(), values },
                        pool: Pool::default(),
                    }
                }
                _ => Threads::Plain,
            }
        })
    }

    fn canvas<K: Copy + Default>(&self) -> ZBuffer<K> {
        ZBuffer::new(&self.intrinsics, self.splat_px)
    }

    /// The synthetic view of one camera beside the query.
    pub fn compare(&self, reference_from_camera: &Pose) -> Comparison {
        let camera_from_points = reference_from_camera.inverse();
        let view = self.rasterizers.with(
            || self.rasterizer(),
            |rasterizer| rasterizer.view(&self.cloud.points, &camera_from_points),
        );
        let pairs = self.pair_up(&view.pixels);
        Comparison {
            score: self.score_of(&pairs),
            explanation: self.statistic.explain(&pairs),
            view,
            pairs,
        }
    }

    /// Query and view of one camera at each covered pixel, as [`Self::compare`] pairs them up.
    pub fn pairs(&self, reference_from_camera: &Pose) -> Vec<IntensityPair> {
        let camera_from_points = reference_from_camera.inverse();
        self.rasterizers.with(
            || self.rasterizer(),
            |rasterizer| self.pair_up(rasterizer.splat(&self.cloud.points, &camera_from_points)),
        )
    }

    fn score_of(&self, pairs: &[IntensityPair]) -> Score {
        Score { cost: self.statistic.cost(pairs), covered: pairs.len() as u32 }
    }

    fn rasterizer(&self) -> Rasterizer {
        Rasterizer::new(&self.intrinsics, self.splat_px)
    }

    fn pair_up(&self, pixels: &[SplattedPixel]) -> Vec<IntensityPair> {
        let query: &[f32] = &self.query;
        let pair = |pixel: &SplattedPixel| IntensityPair {
            query: query[pixel.index as usize],
            synthetic: pixel.intensity,
        };
        pixels.iter().map(pair).collect()
    }
}

impl Objective for Scorer<'_> {
    fn score(&self, reference_from_camera: &[Pose]) -> Vec<Score> {
        Scorer::score(self, reference_from_camera)
    }

    /// A device takes more than the threads.
    fn batch(&self, hypotheses: usize) -> usize {
        let device = self.on_device.device.as_ref();
        device.and_then(|device| device.batch(hypotheses)).unwrap_or_else(at_a_time)
    }

    fn shuffled(&self, reference_from_camera: &Pose, seed: u64) -> Option<f64> {
        self.statistic.cost(&shuffled(&self.pairs(reference_from_camera), seed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost;
    use crate::render::{ColoredPoint, small_camera};
    use nalgebra::Point3;

    #[test]
    fn a_pose_costs_the_same_scored_and_compared() {
        let point = |i: u16| ColoredPoint {
            position: Point3::new(
                f32::from(i % 9) / 4.0 - 1.0,
                f32::from(i % 7) / 4.0 - 0.75,
                2.0 + f32::from(i % 3),
            ),
            intensity: f32::from(i * 37 % 256),
        };
        let points = (0..200).map(point).collect();
        let cloud = Arc::new(ColoredCloud { points, ..ColoredCloud::default() });
        let values = |x: u32, y: u32| image::Luma([(x * 29 + y * 31) as f32 % 256.0]);
        let query = Arc::new(FloatImage::from_fn(9, 7, values));
        let pose = Pose::translation(0.1, 0.0, 0.3);
        for entry in cost::ALL {
            let cost = (entry.make)();
            let (cloud, query) = (Arc::clone(&cloud), Arc::clone(&query));
            let scorer = Scorer::new(cloud, query, &small_camera(), 1, cost.as_ref());
            let compared = scorer.compare(&pose);
            assert_eq!(scorer.score(&[pose]), [compared.score], "{}", entry.name);
            assert_eq!(scorer.pairs(&pose).len(), compared.pairs.len());
        }
    }
}
