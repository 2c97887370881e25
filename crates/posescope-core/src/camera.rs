//! For posescope's own crates: may change in any version.
//!
//! The pinhole camera.

use nalgebra::{Point2, Point3, Unit, Vector3};

/// Intrinsics of a rectified pinhole camera.
///
/// Pixel (0, 0) is the *centre* of the top-left pixel, so the image covers −0.5 … width − 0.5.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Intrinsics {
    /// Focal length along x \[px\].
    pub fx: f64,
    /// Focal length along y \[px\].
    pub fy: f64,
    /// Principal point, x \[px\].
    pub cx: f64,
    /// Principal point, y \[px\].
    pub cy: f64,
    /// Image width \[px\].
    pub width: u32,
    /// Image height \[px\].
    pub height: u32,
}

impl Intrinsics {
    /// The pixel at which a point of the camera frame \[m\] is seen, or `None` where it is not in
    /// front of the camera. The pixel may lie outside the image.
    #[inline]
    pub fn project(&self, point: &Point3<f64>) -> Option<Point2<f64>> {
        (point.z > 0.0).then(|| {
            let inverse_depth = point.z.recip();
            Point2::new(
                self.fx * point.x * inverse_depth + self.cx,
                self.fy * point.y * inverse_depth + self.cy,
            )
        })
    }

    /// The point at depth `z` \[m\] behind a pixel, in the camera frame.
    #[inline]
    pub fn unproject(&self, pixel: &Point2<f64>, z: f64) -> Point3<f64> {
        Point3::new((pixel.x - self.cx) / self.fx * z, (pixel.y - self.cy) / self.fy * z, z)
    }

    /// The direction of unit length in which a pixel looks, in the camera frame.
    #[inline]
    pub fn bearing(&self, pixel: &Point2<f64>) -> Unit<Vector3<f64>> {
        Unit::new_normalize(self.unproject(pixel, 1.0).coords)
    }

    /// Whether a pixel position lies inside the image, borders included.
    #[inline]
    pub fn contains(&self, pixel: &Point2<f64>) -> bool {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        pixel.x >= -0.5 && pixel.y >= -0.5 && pixel.x < width - 0.5 && pixel.y < height - 0.5
    }

    /// Number of pixels.
    pub fn area(&self) -> f64 {
        f64::from(self.width) * f64::from(self.height)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const KITTI: Intrinsics = Intrinsics {
        fx: 718.856,
        fy: 718.856,
        cx: 607.1928,
        cy: 185.2157,
        width: 1241,
        height: 376,
    };

    #[test]
    fn the_image_reaches_half_a_pixel_beyond_the_outer_pixel_centres() {
        assert!(KITTI.contains(&Point2::new(-0.5, -0.5)));
        assert!(KITTI.contains(&Point2::new(1240.49, 375.49)));
        assert!(!KITTI.contains(&Point2::new(1240.5, 0.0)));
        assert!(!KITTI.contains(&Point2::new(0.0, f64::NAN)));
    }

    #[test]
    fn nothing_behind_the_camera_is_seen() {
        assert_eq!(KITTI.project(&Point3::new(0.0, 0.0, -1.0)), None);
        assert_eq!(KITTI.project(&Point3::new(0.0, 0.0, 0.0)), None);
        assert_eq!(KITTI.project(&Point3::new(0.0, 0.0, f64::NAN)), None);
    }

    proptest! {
        #[test]
        fn unproject_inverts_project(x in -30.0..30.0, y in -5.0..5.0, z in 0.5..100.0) {
            let point = Point3::new(x, y, z);
            let pixel = KITTI.project(&point).expect("in front");
            prop_assert!((KITTI.unproject(&pixel, z) - point).norm() < 1e-9);
            let bearing = KITTI.bearing(&pixel);
            prop_assert!((bearing.into_inner() * point.coords.norm() - point.coords).norm() < 1e-9);
        }
    }
}
