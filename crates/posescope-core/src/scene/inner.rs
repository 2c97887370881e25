//! A scene that changes another in some respects, and leaves the rest as it is.

/// In the `impl` of a [`Scene`](crate::scene::Scene) with another scene in one of its fields: the
/// methods that are the other's own.
///
/// ```
/// use posescope_core::{image::Photo, problem::Query, scene::{Scene, SceneError}};
///
/// /// A scene whose clouds nobody has.
/// struct Cloudless(Box<dyn Scene>);
///
/// impl Scene for Cloudless {
///     posescope_core::inner_scene!(0: name, frames, intrinsics, pose, position, time_s, photo);
///
///     fn has_cloud(&self, _frame: usize) -> bool {
///         false
///     }
///
///     fn cloud(&self, frame: usize) -> Result<posescope_core::cloud::Cloud, SceneError> {
///         Err(SceneError::NoPose {
///             scene: self.name().to_owned(),
///             frame: self.frames()[frame].clone(),
///         })
///     }
/// }
/// ```
#[macro_export]
macro_rules! inner_scene {
    (@ $scene:tt name) => {
        fn name(&self) -> &str {
            self.$scene.name()
        }
    };
    (@ $scene:tt frames) => {
        fn frames(&self) -> &[String] {
            self.$scene.frames()
        }
    };
    (@ $scene:tt intrinsics) => {
        fn intrinsics(&self, frame: usize) -> $crate::camera::Intrinsics {
            self.$scene.intrinsics(frame)
        }
    };
    (@ $scene:tt pose) => {
        fn pose(&self, frame: usize) -> Option<$crate::geometry::Pose> {
            self.$scene.pose(frame)
        }
    };
    (@ $scene:tt position) => {
        fn position(&self, frame: usize) -> Option<$crate::nalgebra::Point3<f64>> {
            self.$scene.position(frame)
        }
    };
    (@ $scene:tt time_s) => {
        fn time_s(&self, frame: usize) -> Option<f64> {
            self.$scene.time_s(frame)
        }
    };
    (@ $scene:tt has_cloud) => {
        fn has_cloud(&self, frame: usize) -> bool {
            self.$scene.has_cloud(frame)
        }
    };
    (@ $scene:tt photo) => {
        fn photo(&self, frame: usize) -> Result<$crate::image::Photo, $crate::scene::SceneError> {
            self.$scene.photo(frame)
        }
    };
    (@ $scene:tt cloud) => {
        fn cloud(&self, frame: usize) -> Result<$crate::cloud::Cloud, $crate::scene::SceneError> {
            self.$scene.cloud(frame)
        }
    };
    (@ $scene:tt query) => {
        fn query(
            &self,
            frame: usize,
        ) -> Result<std::sync::Arc<$crate::problem::Query>, $crate::scene::SceneError> {
            self.$scene.query(frame)
        }
    };
    (@ $scene:tt reference) => {
        fn reference(
            &self,
            frame: usize,
        ) -> Result<std::sync::Arc<$crate::problem::ReferenceTuple>, $crate::scene::SceneError> {
            self.$scene.reference(frame)
        }
    };
    (@ $scene:tt as_degraded) => {
        fn as_degraded(&self) -> Option<&$crate::scene::DegradedScene> {
            self.$scene.as_degraded()
        }
    };
    (@ $scene:tt fingerprint) => {
        fn fingerprint(&self) -> u64 {
            self.$scene.fingerprint()
        }
    };
    ($scene:tt: $($method:ident),+ $(,)?) => {
        $($crate::inner_scene!(@ $scene $method);)+
    };
}
