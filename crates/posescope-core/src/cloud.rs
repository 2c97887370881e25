//! For posescope's own crates: may change in any version.
//!
//! LiDAR clouds.

use nalgebra::Point3;

/// A LiDAR scan in the frame of the camera it is registered with.
#[derive(Clone, Debug, Default)]
pub struct Cloud {
    /// Positions in the camera frame \[m\].
    ///
    /// `f32` is exact enough because the frame's origin is the camera, never the map's.
    pub points: Vec<Point3<f32>>,
}

/// From x right, y down, z forward of the camera that the cloud is registered with \[m\].
impl FromIterator<[f32; 3]> for Cloud {
    fn from_iter<I: IntoIterator<Item = [f32; 3]>>(points: I) -> Self {
        Self { points: points.into_iter().map(Point3::from).collect() }
    }
}

impl Cloud {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no point at all.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }
}
