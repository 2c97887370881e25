//! For posescope's own crates: may change in any version.
//!
//! Depth of image positions from the projected cloud (paper, appendix A, "2D-3D correspondences").

use kiddo::{ImmutableKdTree, SquaredEuclidean};
use nalgebra::{Point2, Point3};

use crate::camera::Intrinsics;
use crate::cloud::Cloud;

/// The cloud projected into its own camera, searchable by pixel.
pub struct ProjectedCloudIndex {
    tree: Option<ImmutableKdTree<f64, 2>>,
    depths: Vec<f64>,
}

/// What the projected cloud says about one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthReading {
    /// Distance to the nearest projected point \[px\]; infinite for an empty cloud.
    pub distance_px: f64,
    /// Depths of the points within the radius \[m\], if there are any.
    pub within: Option<DepthsWithin>,
}

/// Depths of the projected points within a radius \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthsWithin {
    /// Depth of the nearest projection; of two at the same pixel distance, the nearer surface.
    pub nearest: f64,
    /// The least depth within the radius \[m\].
    pub least: f64,
    /// The greatest depth within the radius \[m\].
    pub greatest: f64,
}

impl DepthsWithin {
    /// Spread of the depths as a share of the nearest projection's depth.
    pub fn relative_spread(&self) -> f64 {
        (self.greatest - self.least) / self.nearest
    }
}

impl ProjectedCloudIndex {
    /// Projects the points that the camera has in view.
    pub fn new(cloud: &Cloud, intrinsics: &Intrinsics) -> Self {
        let (pixels, depths): (Vec<[f64; 2]>, Vec<f64>) = cloud
            .points
            .iter()
            .filter_map(|point| {
                let pixel = intrinsics.project(&point.cast())?;
                let in_view = intrinsics.contains(&pixel);
                in_view.then_some(([pixel.x, pixel.y], f64::from(point.z)))
            })
            .unzip();
        let tree = (!pixels.is_empty()).then(|| {
            ImmutableKdTree::new_from_slice(&pixels).expect("fewer points than an index can number")
        });
        Self { tree, depths }
    }

    /// Memory that it takes \[bytes\]. The tree holds each pixel position and its number, in leaves that are
    /// not all full.
    pub(crate) fn heap_bytes(&self) -> usize {
        self.depths.len() * (size_of::<f64>() + 2 * size_of::<[f64; 2]>())
    }

    /// Number of points in view.
    pub fn len(&self) -> usize {
        self.depths.len()
    }

    /// Whether no point is in view.
    pub fn is_empty(&self) -> bool {
        self.depths.is_empty()
    }

    /// The depths around a pixel, within `radius_px`.
    pub fn read(&self, pixel: &Point2<f64>, radius_px: f64) -> DepthReading {
        let Some(tree) = &self.tree else {
            return DepthReading { distance_px: f64::INFINITY, within: None };
        };
        let at = [pixel.x, pixel.y];
        let within =
            tree.query(&at).within::<SquaredEuclidean<f64>>(radius_px * radius_px).execute();
        let nearest = within
            .iter()
            .map(|found| (found.distance, self.depths[found.item as usize]))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let Some((squared_distance, depth)) = nearest else {
            let beyond = tree.query(&at).nearest_one::<SquaredEuclidean<f64>>().execute();
            return DepthReading { distance_px: beyond.distance.sqrt(), within: None };
        };
        let depths = within.iter().map(|found| self.depths[found.item as usize]);
        DepthReading {
            distance_px: squared_distance.sqrt(),
            within: Some(DepthsWithin {
                nearest: depth,
                least: depths.clone().fold(f64::INFINITY, f64::min),
                greatest: depths.fold(f64::NEG_INFINITY, f64::max),
            }),
        }
    }
}

/// The 3-D point of one match, if its reference keypoint has a depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LiftedMatch {
    /// Index of the query keypoint.
    pub query: usize,
    /// Index of the reference keypoint.
    pub reference: usize,
    /// Distance from the reference keypoint to the nearest projected point \[px\].
    pub lidar_distance_px: f64,
    /// Least and greatest depth of the projected points within the radius \[m\].
    pub depth_range_m: Option<(f64, f64)>,
    /// The point in the reference camera's frame \[m\]; `None` where no depth was near enough, or
    /// the guard against depth edges refused it.
    pub point: Option<Point3<f64>>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    const CAMERA: Intrinsics =
        Intrinsics { fx: 100.0, fy: 100.0, cx: 50.0, cy: 40.0, width: 101, height: 81 };

    fn cloud_at(pixels: &[(f64, f64, f64)]) -> Cloud {
        let points = pixels
            .iter()
            .map(|&(x, y, z)| CAMERA.unproject(&Point2::new(x, y), z).cast())
            .collect();
        Cloud { points }
    }

    #[test]
    fn the_nearest_projection_decides_and_the_others_tell_the_spread() {
        let cloud = cloud_at(&[(20.0, 20.0, 10.0), (22.0, 20.0, 30.0), (60.0, 60.0, 5.0)]);
        let index = ProjectedCloudIndex::new(&cloud, &CAMERA);
        let reading = index.read(&Point2::new(20.5, 20.0), 3.0);
        assert!((reading.distance_px - 0.5).abs() < 1e-4);
        let depths = reading.within.expect("two within 3 px");
        assert!((depths.nearest - 10.0).abs() < 1e-5);
        assert!((depths.relative_spread() - 2.0).abs() < 1e-4);
    }

    #[test]
    fn beyond_the_radius_there_is_a_distance_but_no_depth() {
        let index = ProjectedCloudIndex::new(&cloud_at(&[(20.0, 20.0, 10.0)]), &CAMERA);
        let reading = index.read(&Point2::new(24.0, 23.0), 3.0);
        assert!((reading.distance_px - 5.0).abs() < 1e-4);
        assert_eq!(reading.within, None);
    }

    #[test]
    fn many_points_on_one_pixel_are_no_trouble_and_the_nearest_surface_wins() {
        let mut pixels = vec![(30.0, 30.0, 8.0); 500];
        pixels.push((30.0, 30.0, 4.0));
        let index = ProjectedCloudIndex::new(&cloud_at(&pixels), &CAMERA);
        let reading = index.read(&Point2::new(30.0, 30.0), 3.0);
        let depths = reading.within.expect("all of them");
        assert!((depths.greatest - 8.0).abs() < 1e-5);
        assert!((depths.least - 4.0).abs() < 1e-5);
    }

    #[test]
    fn an_empty_view_has_no_depth_anywhere() {
        let behind = Cloud { points: vec![Point3::new(0.0, 0.0, -3.0)] };
        let index = ProjectedCloudIndex::new(&behind, &CAMERA);
        assert!(index.is_empty());
        let reading = index.read(&Point2::new(3.0, 3.0), 3.0);
        assert_eq!(reading.distance_px, f64::INFINITY);
    }

    proptest! {
        #[test]
        fn reads_what_an_exhaustive_search_reads(
            pixels in prop::collection::vec((0.0_f64..100.0, 0.0_f64..80.0, 1.0_f64..50.0), 1..80),
            x in 0.0_f64..100.0, y in 0.0_f64..80.0,
        ) {
            let index = ProjectedCloudIndex::new(&cloud_at(&pixels), &CAMERA);
            let reading = index.read(&Point2::new(x, y), 6.0);
            let least = pixels.iter().map(|p| (p.0 - x).hypot(p.1 - y)).fold(f64::INFINITY, f64::min);
            prop_assert!((reading.distance_px - least).abs() < 1e-3);
            prop_assert_eq!(reading.within.is_some(), reading.distance_px <= 6.0);
        }
    }
}
