//! What poses cost, many at once.

use std::borrow::Cow;
use std::sync::Arc;

use nalgebra::Point3;

use super::chance::corrected_distance;
use super::channels::{channel_images, linear};
use super::params::JudgeParams;
use crate::camera::Intrinsics;
use crate::cost::{Pair, byte_bin, count_pairs, shuffled};
use crate::geometry::Pose;
use crate::image::{FloatImage, GrayImage};
use crate::problem::Problem;
use crate::render::{
    ColoredPoint, Objective, PointArrays, Pool, Rasterizer, RenderParams, Score, ShownPoints,
    SplattedPixel, Values, ZBuffer, at_a_time,
};

/// The bins of at most three channels at one place.
type Bins = [u8; 3];

/// Scores query poses against one reference by the mean cost of the channels that the parameters name.
pub struct Judge {
    reference: Arc<ShownPoints<Bins>>,
    query: Arc<Vec<Bins>>,
    intrinsics: Intrinsics,
    splat_px: usize,
    params: JudgeParams,
    pool: Pool<(ZBuffer<Pair<Bins>>, Vec<u32>)>,
}

impl Judge {
    /// The judge of a problem. With `shrink` above 1 both photos are that many times smaller before
    /// anything else is done: what it says then is coarse, cheap, and smooth over longer ways.
    pub fn new(
        problem: &Problem,
        render: &RenderParams,
        params: &JudgeParams,
        shrink: u32,
    ) -> Self {
        let (query, reference) = (&problem.query, &problem.reference);
        let bytes = |bins: &Vec<Bins>| size_of_val(bins.as_slice());
        let query_made = || query_bins(&query.photo.gray, params, shrink);
        let reference_made = || reference_points(problem, render, params, shrink);
        let (bins, points) = rayon::join(
            || query.memo.recall((params, shrink), bytes, query_made),
            || {
                let key = (params, render, shrink);
                reference.memo.recall(key, ShownPoints::heap_bytes, reference_made)
            },
        );
        Self {
            reference: points.value,
            query: bins.value,
            intrinsics: shrunk_camera(&query.intrinsics, shrink),
            splat_px: render.splat_px,
            params: params.clone(),
            pool: Pool::default(),
        }
    }

    /// The same judge, if another camera took the query. It must have been made with this `shrink`.
    #[must_use]
    pub fn seen_by(self, camera: &Intrinsics, shrink: u32) -> Self {
        Self { intrinsics: shrunk_camera(camera, shrink), ..self }
    }

    /// The mean cost of the channels over the pairs. A channel that is constant tells nothing, which costs 1;
    /// where all are, there is no cost.
    ///
    /// Of many poses that cover few pixels, some look informed by chance. So what they say counts less, by the fourth
    /// root of the pixels that are covered for each point. Costs of splats of different size cannot be compared:
    /// where a point covers several pixels, there may be more pixels than points.
    fn cost_of(&self, pairs: &[Pair<Bins>], counts: &mut Vec<u32>) -> Option<f64> {
        let JudgeParams { bins, channels, corrected, .. } = self.params;
        let (mut sum, mut is_any) = (0.0, false);
        for place in 0..channels.count() {
            let bins_of = |&Pair { query, synthetic }: &Pair<Bins>| Pair {
                query: query[place],
                synthetic: synthetic[place],
            };
            count_pairs(pairs, bins_of, bins, counts);
            let cost = corrected_distance(counts, bins, corrected);
            is_any |= cost.is_some();
            sum += cost.unwrap_or(1.0);
        }
        let pixels_per_point = pairs.len() as f64 / self.reference.values.len() as f64;
        let informed = 1.0 - sum / channels.count() as f64;
        is_any.then(|| 1.0 - informed * pixels_per_point.sqrt().sqrt())
    }
}

impl Objective for Judge {
    /// The scores of many cameras `reference_from_camera`, in their order, on all threads. `None` for
    /// the cost where no pixel is covered or all channels are constant, and for images of more than 16
    /// million pixels, which cannot be drawn.
    fn score(&self, reference_from_camera: &[Pose]) -> Vec<Score> {
        if !ZBuffer::<u8>::can_draw(&self.intrinsics, self.splat_px) {
            return vec![Score { cost: None, covered: 0 }; reference_from_camera.len()];
        }
        let positions = &self.reference.positions;
        let values = Values { query: &self.query, points: &self.reference.values };
        let pair = |query, synthetic| Pair { query, synthetic };
        let worker = || (ZBuffer::new(&self.intrinsics, self.splat_px), Vec::new());
        self.pool.score(reference_from_camera, worker, |(canvas, counts), pose| {
            let pairs = canvas.draw(positions, values, &pose.inverse(), pair);
            Score { cost: self.cost_of(pairs, counts), covered: pairs.len() as u32 }
        })
    }

    fn batch(&self, _hypotheses: usize) -> usize {
        at_a_time()
    }

    fn shuffled(&self, reference_from_camera: &Pose, seed: u64) -> Option<f64> {
        // What is dealt to whom depends on the order of the pixels. Each point shows its own number.
        let numbered = self.reference.positions.iter().zip(0_u32..);
        let points: Vec<ColoredPoint> = numbered
            .map(|(position, number)| ColoredPoint { position, intensity: number as f32 })
            .collect();
        let mut rasterizer = Rasterizer::new(&self.intrinsics, self.splat_px);
        let pixels = rasterizer.splat(&points, &reference_from_camera.inverse());
        let pair = |pixel: &SplattedPixel| Pair {
            query: self.query[pixel.index as usize],
            synthetic: self.reference.values[pixel.intensity as usize],
        };
        let pairs: Vec<Pair<Bins>> = pixels.iter().map(pair).collect();
        self.cost_of(&shuffled(&pairs, seed), &mut Vec::new())
    }
}

/// The bins of the channels; those that are not compared stay 0.
fn binned(channels: &[FloatImage], bins: usize, value: impl Fn(&FloatImage) -> f32) -> Bins {
    let mut binned = Bins::default();
    for (bin, channel) in binned.iter_mut().zip(channels) {
        *bin = byte_bin(value(channel), bins);
    }
    binned
}

fn query_bins(photo: &GrayImage, params: &JudgeParams, shrink: u32) -> Vec<Bins> {
    let channels = channel_images(&shrunk(photo, shrink), params);
    let pixels = 0..channels[0].as_raw().len();
    pixels.map(|at| binned(&channels, params.bins, |channel| channel.as_raw()[at])).collect()
}

fn reference_points(
    problem: &Problem,
    render: &RenderParams,
    params: &JudgeParams,
    shrink: u32,
) -> ShownPoints<Bins> {
    let reference = &problem.reference;
    let channels = channel_images(&shrunk(&reference.photo.gray, shrink), params);
    let camera = shrunk_camera(&reference.intrinsics, shrink);
    // A view that is smaller is covered by fewer points.
    let visible = reference.visible_cloud(render);
    let points: Vec<Point3<f32>> = visible.positions().step_by(shrink as usize).collect();
    let bins = points.iter().map(|point| {
        let pixel = camera.project(&point.cast()).unwrap_or_default();
        let (x, y) = (pixel.x as f32, pixel.y as f32);
        binned(&channels, params.bins, |channel| linear(channel, x, y))
    });
    ShownPoints { values: bins.collect(), positions: PointArrays::new(points.iter().copied()) }
}

/// The photo with squares of `shrink` × `shrink` pixels as its pixels.
fn shrunk(photo: &GrayImage, shrink: u32) -> Cow<'_, GrayImage> {
    if shrink <= 1 {
        return Cow::Borrowed(photo);
    }
    let [columns, rows] = [photo.width(), photo.height()].map(|side| (side / shrink).max(1));
    let (side, width) = (shrink as usize, photo.width().max(1) as usize);
    let mut means = GrayImage::new(columns, rows);
    let rows = means.chunks_mut(columns as usize);
    for (row, lines) in rows.zip(photo.as_raw().chunks(side * width)) {
        let mut sums = vec![0_u32; columns as usize];
        for line in lines.chunks(width) {
            for (sum, square) in sums.iter_mut().zip(line.chunks(side)) {
                *sum += square.iter().map(|&grey| u32::from(grey)).sum::<u32>();
            }
        }
        let count = (side.min(width) * lines.len() / width).max(1) as u32;
        for (mean, sum) in row.iter_mut().zip(&sums) {
            *mean = ((sum + count / 2) / count) as u8;
        }
    }
    Cow::Owned(means)
}

/// The camera of the photo that [`shrunk`] makes.
fn shrunk_camera(camera: &Intrinsics, shrink: u32) -> Intrinsics {
    if shrink <= 1 {
        return *camera;
    }
    let by = f64::from(shrink);
    let centre = |c: f64| (c + 0.5) / by - 0.5;
    Intrinsics {
        fx: camera.fx / by,
        fy: camera.fy / by,
        cx: centre(camera.cx),
        cy: centre(camera.cy),
        width: (camera.width / shrink).max(1),
        height: (camera.height / shrink).max(1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smaller_photo_has_the_means_of_squares() {
        let photo = |width: u32, height: u32| {
            GrayImage::from_fn(width, height, |x, y| image::Luma([(7 * x + 31 * y) as u8]))
        };
        let mean = |of: &GrayImage, left: u32, top: u32, side: u32| {
            let (right, bottom) = ((left + side).min(of.width()), (top + side).min(of.height()));
            let square = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y)));
            let greys: Vec<u32> = square.map(|(x, y)| u32::from(of.get_pixel(x, y).0[0])).collect();
            let count = greys.len() as u32;
            ((greys.iter().sum::<u32>() + count / 2) / count) as u8
        };
        // Lines and columns that are left over do not count; a photo that is smaller than a square is one.
        for (width, height, shrink, size) in
            [(13, 9, 4, (3, 2)), (8, 8, 2, (4, 4)), (3, 2, 4, (1, 1))]
        {
            let photo = photo(width, height);
            let small = shrunk(&photo, shrink);
            assert_eq!(small.dimensions(), size);
            for (x, y, pixel) in small.enumerate_pixels() {
                assert_eq!(pixel.0[0], mean(&photo, shrink * x, shrink * y, shrink), "{x} {y}");
            }
        }
        assert_eq!(*shrunk(&photo(5, 4), 1), photo(5, 4));
    }

    #[test]
    fn what_few_pixels_say_counts_less() {
        let judge_of = |points: usize| Judge {
            reference: Arc::new(ShownPoints {
                positions: PointArrays::new(std::iter::empty()),
                values: vec![Bins::default(); points],
            }),
            query: Arc::default(),
            intrinsics: Intrinsics { fx: 1.0, fy: 1.0, cx: 0.0, cy: 0.0, width: 1, height: 1 },
            splat_px: 1,
            params: JudgeParams { corrected: false, ..JudgeParams::default() },
            pool: Pool::default(),
        };
        // Half of the query's information is in the view.
        let pairs: Vec<Pair<Bins>> =
            (0..4_u8).map(|at| Pair { query: [at, 0, 0], synthetic: [at / 2, 0, 0] }).collect();
        let cost = |points| judge_of(points).cost_of(&pairs, &mut Vec::new()).expect("textured");
        assert!((cost(4) - 0.5).abs() < 1e-12);
        assert!((cost(64) - 0.75).abs() < 1e-12, "a sixteenth of the points counts half");
    }
}
