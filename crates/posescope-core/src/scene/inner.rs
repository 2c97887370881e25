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
#[doc(hidden)]
#[macro_export]
macro_rules! inner_scene {
    (@ $scene:tt name) => {
        $crate::inner_scene!(@ $scene name() -> &str);
    };
    (@ $scene:tt frames) => {
        $crate::inner_scene!(@ $scene frames() -> &[String]);
    };
    (@ $scene:tt other_name) => {
        $crate::inner_scene!(@ $scene other_name(frame: usize) -> Option<&str>);
    };
    (@ $scene:tt intrinsics) => {
        $crate::inner_scene!(@ $scene intrinsics(frame: usize) -> $crate::camera::Intrinsics);
    };
    (@ $scene:tt pixel_map) => {
        $crate::inner_scene!(@ $scene pixel_map(frame: usize) -> Option<std::sync::Arc<dyn $crate::scene::PixelMap>>);
    };
    (@ $scene:tt pose) => {
        $crate::inner_scene!(@ $scene pose(frame: usize) -> Option<$crate::geometry::Pose>);
    };
    (@ $scene:tt position) => {
        $crate::inner_scene!(@ $scene position(frame: usize) -> Option<$crate::nalgebra::Point3<f64>>);
    };
    (@ $scene:tt time_s) => {
        $crate::inner_scene!(@ $scene time_s(frame: usize) -> Option<f64>);
    };
    (@ $scene:tt has_cloud) => {
        $crate::inner_scene!(@ $scene has_cloud(frame: usize) -> bool);
    };
    (@ $scene:tt photo) => {
        $crate::inner_scene!(@ $scene photo(frame: usize) -> Result<$crate::image::Photo, $crate::scene::SceneError>);
    };
    (@ $scene:tt cloud) => {
        $crate::inner_scene!(@ $scene cloud(frame: usize) -> Result<$crate::cloud::Cloud, $crate::scene::SceneError>);
    };
    (@ $scene:tt cloud_at) => {
        $crate::inner_scene!(@ $scene cloud_at(frame: usize, world_from_camera: &$crate::geometry::Pose) -> Option<$crate::cloud::Cloud>);
    };
    (@ $scene:tt query) => {
        $crate::inner_scene!(@ $scene query(frame: usize) -> Result<std::sync::Arc<$crate::problem::Query>, $crate::scene::SceneError>);
    };
    (@ $scene:tt reference) => {
        $crate::inner_scene!(@ $scene reference(frame: usize) -> Result<std::sync::Arc<$crate::problem::ReferenceTuple>, $crate::scene::SceneError>);
    };
    (@ $scene:tt lengths) => {
        $crate::inner_scene!(@ $scene lengths() -> $crate::scene::Lengths);
    };
    (@ $scene:tt cloud_facts) => {
        $crate::inner_scene!(@ $scene cloud_facts() -> $crate::scene::CloudFacts);
    };
    (@ $scene:tt as_degraded) => {
        $crate::inner_scene!(@ $scene as_degraded() -> Option<&$crate::scene::DegradedScene>);
    };
    (@ $scene:tt fingerprint) => {
        $crate::inner_scene!(@ $scene fingerprint() -> u64);
    };
    (@ $scene:tt $method:ident($($argument:ident: $type:ty),*) -> $out:ty) => {
        fn $method(&self $(, $argument: $type)*) -> $out {
            self.$scene.$method($($argument),*)
        }
    };
    ($scene:tt: $($method:ident),+ $(,)?) => {
        $($crate::inner_scene!(@ $scene $method);)+
    };
}
