//! Colouring the cloud by the reference photo.

use nalgebra::Point3;
use rayon::prelude::*;

use super::RenderParams;
use crate::camera::Intrinsics;
use crate::cloud::Cloud;
use crate::image::{GrayImage, cubic_interpolated};

/// A point of the cloud with the grey value that the reference photo gives it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColoredPoint {
    /// Position in the reference camera's frame \[m\].
    pub position: Point3<f32>,
    /// Grey value, 0 … 255.
    pub intensity: f32,
}

/// How many points of a cloud were coloured, and why the others were not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ColoringCounts {
    /// Points that have a grey value.
    pub colored: usize,
    /// Points behind the reference camera or outside its image.
    pub outside: usize,
    /// Points in the image, but behind a nearer surface.
    pub occluded: usize,
}

/// The points of a cloud that the reference photo shows.
#[derive(Clone, Debug, Default)]
pub struct ColoredCloud {
    /// The coloured points, in the order of the scan.
    pub points: Vec<ColoredPoint>,
    /// What became of the scan's points.
    pub counts: ColoringCounts,
}

/// Gives each point that the reference camera sees the photo's grey value at its projection, by
/// cubic convolution. The others get none, so they are not part of the result.
///
/// A scanner beside the camera also hits what the camera cannot see. Such a point would take the
/// colour of the surface before it; a small depth buffer leaves it out.
pub fn color_cloud(
    cloud: &Cloud,
    photo: &GrayImage,
    intrinsics: &Intrinsics,
    params: &RenderParams,
) -> ColoredCloud {
    let value = |u, v| cubic_interpolated(photo, u, v);
    VisibleCloud::new(cloud, intrinsics, params).colored_by(value)
}

/// The points of a cloud that a camera sees, and where in its image.
#[derive(Clone, Debug, Default)]
pub struct VisibleCloud {
    points: Vec<VisiblePoint>,
    counts: ColoringCounts,
}

impl VisibleCloud {
    /// What the camera sees of the cloud, which is in its frame.
    pub fn new(cloud: &Cloud, intrinsics: &Intrinsics, params: &RenderParams) -> Self {
        let in_view: Vec<VisiblePoint> = cloud
            .points
            .par_iter()
            .filter_map(|&position| VisiblePoint::new(position, intrinsics))
            .collect();
        let outside = cloud.len() - in_view.len();
        let projected = in_view.len();
        let points = if !params.visibility {
            in_view
        } else {
            let hidden_beyond = HorizonMap::new(&in_view, intrinsics, params);
            let is_seen = |point: &VisiblePoint| hidden_beyond.shows(point);
            in_view.into_par_iter().filter(is_seen).collect()
        };
        let counts =
            ColoringCounts { colored: points.len(), outside, occluded: projected - points.len() };
        Self { points, counts }
    }

    /// Memory that it takes \[bytes\].
    pub(crate) fn heap_bytes(&self) -> usize {
        size_of_val(self.points.as_slice())
    }

    /// The points alone \[m\], in the order of the scan.
    pub fn positions(&self) -> impl ExactSizeIterator<Item = Point3<f32>> + '_ {
        self.points.iter().map(|point| point.position)
    }

    /// The points with any value 0 … 255 at their projections \[px\].
    pub fn colored_by(&self, value: impl Fn(f32, f32) -> f32 + Sync) -> ColoredCloud {
        let colored = |point: &VisiblePoint| ColoredPoint {
            position: point.position,
            intensity: value(point.u, point.v),
        };
        ColoredCloud { points: self.points.par_iter().map(colored).collect(), counts: self.counts }
    }
}

/// A point that projects into the image.
#[derive(Clone, Copy, Debug)]
struct VisiblePoint {
    position: Point3<f32>,
    u: f32,
    v: f32,
}

impl VisiblePoint {
    fn new(position: Point3<f32>, intrinsics: &Intrinsics) -> Option<Self> {
        let pixel = intrinsics.project(&position.cast())?;
        intrinsics.contains(&pixel).then_some(Self {
            position,
            u: pixel.x as f32,
            v: pixel.y as f32,
        })
    }
}

/// Per pixel, the depth beyond which a point is hidden \[m\].
struct HorizonMap {
    width: usize,
    height: usize,
    hidden_beyond: Vec<f32>,
}

impl HorizonMap {
    fn new(points: &[VisiblePoint], intrinsics: &Intrinsics, params: &RenderParams) -> Self {
        let [width, height] = [intrinsics.width, intrinsics.height].map(|side| side as usize);
        let mut map = Self { width, height, hidden_beyond: Vec::new() };
        let mut hidden_beyond = vec![f32::INFINITY; width * height];
        let reach = params.visibility_window_px / 2;
        // Each thread has rows of its own, and goes through all points.
        let band = height.div_ceil(rayon::current_num_threads()).max(1);
        let bands = hidden_beyond.par_chunks_mut((band * width).max(1));
        bands.enumerate().for_each(|(index, cells)| {
            let first = index * band;
            let end = (first + band).min(height);
            for point in points {
                let horizon = point.position.z * (1.0 + params.visibility_margin as f32);
                let (x, y) = map.nearest_pixel(point);
                for row in y.saturating_sub(reach).max(first)..(y + reach + 1).min(end) {
                    let row = &mut cells[(row - first) * width..][..width];
                    for cell in &mut row[x.saturating_sub(reach)..(x + reach + 1).min(width)] {
                        *cell = cell.min(horizon);
                    }
                }
            }
        });
        map.hidden_beyond = hidden_beyond;
        map
    }

    fn shows(&self, point: &VisiblePoint) -> bool {
        let (x, y) = self.nearest_pixel(point);
        point.position.z <= self.hidden_beyond[y * self.width + x]
    }

    fn nearest_pixel(&self, point: &VisiblePoint) -> (usize, usize) {
        let x = (point.u.round().max(0.0) as usize).min(self.width - 1);
        let y = (point.v.round().max(0.0) as usize).min(self.height - 1);
        (x, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::small_camera;
    use ::image::Luma;

    fn photo() -> GrayImage {
        GrayImage::from_fn(9, 7, |x, y| Luma([(20 * x + y) as u8]))
    }

    #[test]
    fn a_point_takes_the_value_of_its_own_pixel() {
        let cloud = Cloud { points: vec![Point3::new(0.2, -0.1, 1.0)] };
        let colored = color_cloud(&cloud, &photo(), &small_camera(), &RenderParams::default());
        assert_eq!(colored.points[0].intensity, 122.0);
    }

    #[test]
    fn what_is_behind_beside_or_hidden_gets_no_colour_and_is_counted() {
        let cloud = Cloud {
            points: vec![
                Point3::new(0.0, 0.0, 2.0),
                Point3::new(0.0, 0.0, 5.0),
                Point3::new(0.0, 0.0, 2.1),
                Point3::new(0.0, 0.0, -2.0),
                Point3::new(9.0, 0.0, 2.0),
            ],
        };
        let mut params = RenderParams::default();
        let colored = color_cloud(&cloud, &photo(), &small_camera(), &params);
        let expected = ColoringCounts { colored: 2, outside: 2, occluded: 1 };
        assert_eq!(colored.counts, expected);

        params.visibility = false;
        let colored = color_cloud(&cloud, &photo(), &small_camera(), &params);
        assert_eq!(colored.counts.occluded, 0);
        assert_eq!(colored.points.len(), 3);
    }
}
