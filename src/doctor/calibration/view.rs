//! A photo, and how strong its edges are.

use image::imageops::{self, FilterType};
use image::{GrayImage, ImageBuffer, Luma};
use nalgebra::Point2;

use super::depth_edges::Across;
use crate::camera::Intrinsics;

/// A map of the strengths, 0 … 1. The image crate cuts off what is above 1.
type Map = ImageBuffer<Luma<f32>, Vec<f32>>;

/// How many maps there are, each of half the size of the one before.
pub(super) const LEVELS: usize = 3;
/// The widest map \[px\]. Wider photos are reduced first: finer edges are not those of depths.
const WIDEST: u32 = 700;
/// An edge that is so many times as strong as those around it counts as the strongest.
const STRONGEST: f32 = 6.0;

/// A photo's camera, and the strengths of its edges.
pub(super) struct View {
    pub(super) camera: Intrinsics,
    /// Edges across columns and across rows, as shares of the mean around them.
    maps: Vec<[Map; 2]>,
    /// The width and the height of the photo \[px\].
    size: [f64; 2],
    /// Pixels of the photo along a pixel of the first map.
    pub(super) reduced: f64,
}

impl View {
    pub(super) fn new(photo: &GrayImage, camera: Intrinsics) -> Self {
        let times = photo.width().div_ceil(WIDEST).max(1);
        let gray: Map = ImageBuffer::from_fn(photo.width(), photo.height(), |x, y| {
            Luma([f32::from(photo.get_pixel(x, y).0[0]) / 255.0])
        });
        let resized = |map: &Map, times: u32| {
            let (width, height) = ((map.width() / times).max(1), (map.height() / times).max(1));
            imageops::resize(map, width, height, FilterType::Triangle)
        };
        let mut maps = vec![strengths(&gray).map(|map| resized(&map, times))];
        while maps.len() < LEVELS {
            let halves = maps[maps.len() - 1].each_ref().map(|map| resized(map, 2));
            maps.push(halves);
        }
        let size = [f64::from(photo.width()), f64::from(photo.height())];
        Self { camera, maps, size, reduced: f64::from(times) }
    }

    /// How much stronger the edge at a pixel of the photo is than those around it, as a share: about 0 on average. The
    /// higher the level, the more blurred.
    pub(super) fn strength(&self, level: usize, across: Across, pixel: &Point2<f64>) -> f64 {
        let [columns, rows] = &self.maps[level];
        let map = match across {
            Across::Columns => columns,
            Across::Rows => rows,
        };
        let (width, height) = (map.width() as usize, map.height() as usize);
        // A map of half of an odd width has a little more than two pixels of the photo in each of its own.
        let x = (pixel.x + 0.5) * width as f64 / self.size[0] - 0.5;
        let y = (pixel.y + 0.5) * height as f64 / self.size[1] - 0.5;
        if !(x >= 0.0 && y >= 0.0 && x < width as f64 - 1.0 && y < height as f64 - 1.0) {
            return 0.0;
        }
        let (left, top) = (x as usize, y as usize);
        let (right, down) = ((x - left as f64) as f32, (y - top as f64) as f32);
        let (raw, at) = (map.as_raw(), top * width + left);
        let upper = raw[at] * (1.0 - right) + raw[at + 1] * right;
        let lower = raw[at + width] * (1.0 - right) + raw[at + width + 1] * right;
        f64::from(STRONGEST * (upper * (1.0 - down) + lower * down)) - 1.0
    }
}

/// The strengths of the edges across columns and across rows, as shares of [`STRONGEST`].
fn strengths(gray: &Map) -> [Map; 2] {
    /// The mean is taken over this share of the width.
    const AROUND: u32 = 12;
    /// A difference of grey values that counts as no edge.
    const NOISE: f32 = 2.0 / 255.0;
    const SMOOTHING_PX: f32 = 0.8;
    let smooth = imageops::blur(gray, SMOOTHING_PX);
    let (width, height) = gray.dimensions();
    let at = |x: u32, y: u32| smooth.get_pixel(x, y).0[0];
    let is_inside = |x: u32, y: u32| x > 0 && y > 0 && x + 1 < width && y + 1 < height;
    [(1, 0), (0, 1)].map(|(dx, dy)| {
        let edges: Map = ImageBuffer::from_fn(width, height, |x, y| {
            let difference = if is_inside(x, y) {
                (at(x + dx, y + dy) - at(x - dx, y - dy)).abs() / 2.0
            } else {
                0.0
            };
            Luma([difference])
        });
        let few = (width / AROUND).max(1);
        let (columns, rows) = (width.div_ceil(few), height.div_ceil(few));
        let around = imageops::resize(&edges, columns, rows, FilterType::Triangle);
        let around = imageops::resize(&around, width, height, FilterType::Triangle);
        ImageBuffer::from_fn(width, height, |x, y| {
            let (edge, mean) = (edges.get_pixel(x, y).0[0], around.get_pixel(x, y).0[0]);
            Luma([((edge + NOISE) / (mean + NOISE) / STRONGEST).min(1.0)])
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_is_where_it_is_in_a_photo_of_odd_size() {
        let (width, height) = (1241, 375);
        let camera = Intrinsics { fx: 700.0, fy: 700.0, cx: 620.0, cy: 187.0, width, height };
        for edge in [201, 620, 1101] {
            let photo =
                GrayImage::from_fn(width, height, |x, _| Luma([if x < edge { 40 } else { 200 }]));
            let view = View::new(&photo, camera);
            for level in 0..LEVELS {
                let strength =
                    |x: f64| view.strength(level, Across::Columns, &Point2::new(x, 187.0));
                let around =
                    (-400..=400).map(|step| f64::from(edge) - 0.5 + f64::from(step) / 20.0);
                let (sum, moment) = around.fold((0.0, 0.0), |(sum, moment), x| {
                    let strength = (strength(x) + 1.0).max(0.0);
                    (sum + strength, moment + strength * x)
                });
                let off = moment / sum - (f64::from(edge) - 0.5);
                let pixel = view.reduced * f64::from(1 << level);
                assert!(off.abs() < 0.1 * pixel, "{edge}, level {level}: {off}");
            }
        }
    }
}
