//! What a thread needs to score one hypothesis after another.

use std::sync::Arc;

use super::{Canvas, ColoredPoint, DepthCanvas, PointArrays, Score, Values};
use crate::camera::Intrinsics;
use crate::cost::{
    BinPair, Cost, CostOf, Evaluator, IntensityPair, MOST_BYTE_BINS, byte_bin, count_pairs,
};
use crate::geometry::Pose;

/// What all hypotheses have in common.
pub(super) struct Prepared {
    positions: PointArrays,
    shown: Shown,
}

/// What is compared, as the cost wants it.
enum Shown {
    /// The points' values; the query's are there already.
    Values(Arc<Vec<f32>>),
    /// The bins of both.
    Bins { query: Arc<Vec<u8>>, points: Arc<Vec<u8>> },
}

impl Prepared {
    pub fn new(points: &[ColoredPoint], query: &[f32], cost: &dyn Cost) -> Self {
        let intensities = points.iter().map(|point| point.intensity);
        let shown = match cost.evaluator() {
            Evaluator::Counts { bins, .. } if bins <= MOST_BYTE_BINS => {
                let bin = |value: f32| byte_bin(value, bins);
                Shown::Bins {
                    query: Arc::new(query.iter().copied().map(bin).collect()),
                    points: Arc::new(intensities.map(bin).collect()),
                }
            }
            Evaluator::Counts { .. } | Evaluator::Pairs(_) | Evaluator::SquaredDifferences(_) => {
                Shown::Values(Arc::new(intensities.collect()))
            }
        };
        Self { positions: PointArrays::new(points.iter().map(|point| point.position)), shown }
    }
}

/// A canvas, and the cost of what is drawn on it.
pub(super) enum Worker<'a> {
    /// A cost that may depend on the order of the pairs.
    Ordered {
        canvas: Canvas<f32>,
        points: Arc<Vec<f32>>,
        cost: CostOf<'a, IntensityPair>,
    },
    SquaredDifferences {
        canvas: DepthCanvas<f32>,
        points: Arc<Vec<f32>>,
        cost: CostOf<'a, f32>,
    },
    Counts {
        canvas: DepthCanvas<BinPair>,
        query: Arc<Vec<u8>>,
        points: Arc<Vec<u8>>,
        bins: usize,
        counts: Vec<u32>,
        cost: CostOf<'a, u32>,
    },
}

impl<'a> Worker<'a> {
    /// A worker for a cost; `None` where the image or the joint histogram is larger than it can handle,
    /// so that the plain way is the only one.
    pub fn new(
        cost: &'a dyn Cost,
        prepared: &Prepared,
        intrinsics: &Intrinsics,
        splat_px: usize,
    ) -> Option<Self> {
        match (cost.evaluator(), &prepared.shown) {
            (Evaluator::SquaredDifferences(cost), Shown::Values(points)) => {
                Some(Self::SquaredDifferences {
                    canvas: DepthCanvas::new(intrinsics, splat_px)?,
                    points: Arc::clone(points),
                    cost,
                })
            }
            (Evaluator::Pairs(cost), Shown::Values(points)) => Some(Self::Ordered {
                canvas: Canvas::new(intrinsics, splat_px)?,
                points: Arc::clone(points),
                cost,
            }),
            (Evaluator::Counts { bins, cost }, Shown::Bins { query, points }) => {
                Some(Self::Counts {
                    canvas: DepthCanvas::new(intrinsics, splat_px)?,
                    query: Arc::clone(query),
                    points: Arc::clone(points),
                    bins,
                    counts: Vec::new(),
                    cost,
                })
            }
            _ => None,
        }
    }

    /// From now on, what another camera of the same size sees.
    pub fn look_through(&mut self, intrinsics: &Intrinsics) {
        match self {
            Self::Ordered { canvas, .. } => canvas.look_through(intrinsics),
            Self::SquaredDifferences { canvas, .. } => canvas.look_through(intrinsics),
            Self::Counts { canvas, .. } => canvas.look_through(intrinsics),
        }
    }

    /// The score of a camera at `camera_from_points`. `query` is what the cost sees of the query.
    pub fn score(
        &mut self,
        prepared: &Prepared,
        query: &[f32],
        camera_from_points: &Pose,
    ) -> Score {
        let (cost, covered) = match self {
            Self::Ordered { canvas, points, cost } => {
                let values = Values { query, points };
                let pairs = canvas.draw(&prepared.positions, values, camera_from_points);
                (cost(pairs), pairs.len())
            }
            Self::SquaredDifferences { canvas, points, cost } => {
                let values = Values { query, points };
                let differences = canvas.draw(
                    &prepared.positions,
                    values,
                    camera_from_points,
                    |query, synthetic| IntensityPair { query, synthetic }.squared_difference(),
                );
                (cost(differences), differences.len())
            }
            Self::Counts { canvas, query, points, bins, counts, cost } => {
                let values = Values { query, points };
                let pairs = canvas.draw(
                    &prepared.positions,
                    values,
                    camera_from_points,
                    |query, synthetic| BinPair { query, synthetic },
                );
                count_pairs(pairs, *bins, counts);
                (cost(counts), pairs.len())
            }
        };
        Score { cost, covered: covered as u32 }
    }
}
