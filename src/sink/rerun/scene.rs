//! Records the world: clouds, cameras and photos.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use rerun::{Ellipsoids3D, LineStrips3D, Pinhole, Points3D, Quaternion, Transform3D};

use super::encode::{Encoded, jpeg};
use super::entities;
use super::stream::Stream;
use crate::camera::Intrinsics;
use crate::covariance::PoseCovariance;
use crate::geometry::Pose;
use crate::image::Photo;
use crate::method::Method;
use crate::palette::{self, Rgb};
use crate::picture;
use crate::problem::{Problem, ReferenceTuple};
use crate::render::ColoredCloud;

/// The drawn size of cameras \[m\].
const IMAGE_PLANE_M: f32 = 1.5;

/// The place drawn at (0, 0, 0), in world coordinates \[m\].
///
/// A viewer draws in single precision, in which map coordinates have steps of half a metre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin(pub(super) Vector3<f64>);

impl Origin {
    /// A position as it is drawn.
    pub(super) fn place(&self, world: &Vector3<f64>) -> [f32; 3] {
        (world - self.0).cast::<f32>().into()
    }

    /// A pose as it is drawn.
    pub(super) fn transform(&self, world_from_camera: &Pose) -> Transform3D {
        let rotation: [f32; 4] = world_from_camera.rotation.coords.cast::<f32>().into();
        Transform3D::from_translation_rotation(
            self.place(&world_from_camera.translation.vector),
            Quaternion::from_xyzw(rotation),
        )
    }
}

/// The context of a recorded event.
pub(super) struct EventContext<'a> {
    /// The position of the reference among those of the query.
    pub(super) reference: usize,
    /// The problem being solved.
    pub(super) problem: &'a Problem,
    /// The emitting estimator; inside a hybrid, the one that it runs.
    pub(super) method: Method,
    /// The estimator's hypotheses in earlier runs, after which the timeline `eval` continues.
    pub(super) evals: i64,
    /// Whether these photos are matched for the first time.
    pub(super) is_first_match: bool,
    /// The place drawn at (0, 0, 0).
    pub(super) origin: Origin,
}

/// Records the query's photo, and the references' cameras with their photos and names.
pub(super) fn log_photos(
    stream: &mut Stream,
    problems: &[Problem],
    label: impl Fn(&str) -> String,
    origin: Origin,
) {
    let Some(first) = problems.first() else {
        return;
    };
    let photos = problems.iter().map(|problem| problem.reference().photo());
    let photos: Vec<&Arc<Photo>> = std::iter::once(first.query().photo()).chain(photos).collect();
    let encoded = photos.par_iter().map(|photo| jpeg(&picture::photo(photo)));
    let mut encoded = encoded.collect::<Vec<_>>().into_iter();
    if let Some(photo) = encoded.next() {
        stream.log_image(entities::QUERY_IMAGE, photo);
    }
    for (index, (problem, photo)) in problems.iter().zip(encoded).enumerate() {
        let tuple = problem.reference();
        log_reference(stream, index, tuple, &label(tuple.name()), photo, origin);
    }
}

/// Records a reference's camera with its photo and name.
pub(super) fn log_reference(
    stream: &mut Stream,
    index: usize,
    tuple: &ReferenceTuple,
    label: &str,
    photo: Encoded,
    origin: Origin,
) {
    let owner = entities::reference(index);
    let camera = PlacedCamera {
        owner: &owner,
        world_from_camera: tuple.world_from_camera(),
        intrinsics: tuple.intrinsics(),
        color: palette::REFERENCE,
        label: format!("reference {label}"),
    };
    camera.log(stream, origin);
    stream.log_image(&entities::camera_image(&owner), photo);
}

/// A camera in the world, with colour and label.
pub(super) struct PlacedCamera<'a> {
    pub(super) owner: &'a str,
    pub(super) world_from_camera: &'a Pose,
    pub(super) intrinsics: &'a Intrinsics,
    pub(super) color: Rgb,
    pub(super) label: String,
}

impl PlacedCamera<'_> {
    pub(super) fn log(&self, stream: &mut Stream, origin: Origin) {
        let path = entities::camera(self.owner);
        stream.log(&path, &origin.transform(self.world_from_camera));
        stream.log(&path, &pinhole(self.intrinsics).with_color(super::color(self.color)));
        let centre = origin.place(&self.world_from_camera.translation.vector);
        let label = Points3D::new([centre])
            .with_colors([super::color(palette::light(self.color))])
            .with_radii([rerun::Radius::new_ui_points(5.0)])
            .with_labels([self.label.as_str()])
            .with_show_labels(true);
        stream.log(&format!("{}/label", self.owner), &label);
    }
}

/// Records the ellipsoid that holds 95 % of the errors of a position, if its pose is right.
pub(super) fn log_interval(
    stream: &mut Stream,
    path: &str,
    world_from_camera: &Pose,
    covariance: &PoseCovariance,
    origin: Origin,
) {
    let (turn, half) = covariance.ellipsoid();
    let turn: [f32; 4] = (world_from_camera.rotation * turn).coords.cast::<f32>().into();
    let half: [f32; 3] = half.cast::<f32>().into();
    let centre = origin.place(&world_from_camera.translation.vector);
    let ellipsoid = Ellipsoids3D::from_centers_and_half_sizes([centre], [half])
        .with_quaternions([Quaternion::from_xyzw(turn)])
        .with_colors([super::color(palette::ESTIMATE)]);
    stream.log(path, &ellipsoid);
}

/// Rerun's pixel (0, 0) is the corner of the image, ours the centre of its first pixel.
fn pinhole(camera: &Intrinsics) -> Pinhole {
    let focal_lengths = [camera.fx as f32, camera.fy as f32];
    Pinhole::from_focal_length_and_resolution(
        focal_lengths,
        [camera.width, camera.height].map(|side| side as f32),
    )
    .with_principal_point([camera.cx as f32 + 0.5, camera.cy as f32 + 0.5])
    .with_image_plane_distance(IMAGE_PLANE_M)
}

/// Records a cloud in the colours of the reference photo, or in its grey values.
pub(super) fn log_cloud(
    stream: &mut Stream,
    index: usize,
    tuple: &ReferenceTuple,
    cloud: &ColoredCloud,
    origin: Origin,
) {
    let world = |point: &Point3<f32>| {
        let world = tuple.world_from_camera() * point.cast::<f64>();
        origin.place(&world.coords)
    };
    let positions = cloud.points.iter().map(|point| world(&point.position));
    let colors = cloud.points.iter().map(|point| {
        let gray = point.intensity.round().clamp(0.0, 255.0) as u8;
        super::color(photo_color(tuple, &point.position).unwrap_or([gray; 3]))
    });
    let points = Points3D::new(positions)
        .with_colors(colors)
        .with_radii([rerun::Radius::new_ui_points(1.5)]);
    stream.log(&entities::cloud(index), &points);
}

fn photo_color(tuple: &ReferenceTuple, point: &Point3<f32>) -> Option<Rgb> {
    let photo = tuple.photo().color.as_ref()?;
    let pixel = tuple.intrinsics().project(&point.cast())?;
    let nearest = |value: f64| value.round().max(0.0) as u32;
    Some(photo.get_pixel_checked(nearest(pixel.x), nearest(pixel.y))?.0)
}

/// Records rays from a camera centre to points, all in the reference camera's frame.
pub(super) fn log_rays(
    stream: &mut Stream,
    path: &str,
    problem: &Problem,
    origin: Origin,
    centre: &Point3<f64>,
    points: &[Point3<f64>],
    color: Rgb,
) {
    let world_from_reference = problem.reference().world_from_camera();
    let place = |point: &Point3<f64>| origin.place(&(world_from_reference * point).coords);
    let start = place(centre);
    let rays = LineStrips3D::new(points.iter().map(|point| [start, place(point)]))
        .with_colors([super::color(color)])
        .with_radii([rerun::Radius::new_ui_points(0.5)]);
    stream.log(path, &rays);
}
