//! Faults that are planted in a place.
//!
//! The table `docs/diagnosis/planted_faults.csv` says of each what verdict it should get. It was written
//! before the rules.

use std::sync::Arc;

use image::{Rgb, RgbImage};
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use posescope::camera::Intrinsics;
use posescope::cloud::Cloud;
use posescope::depth::ProjectedCloudIndex;
use posescope::fusion::Fusion;
use posescope::geometry::{Pose, yaw};
use posescope::localize::References;
use posescope::method::Method;
use posescope::params::Params;
use posescope::retrieval::{Criterion, Geometry, Ranked, RankedReference, ReferenceRanking};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::frames::Frame;
use crate::places::{Case, Place, nearest};

/// A kind of fault: its name in the table, and the place with it; `None` where the place does not
/// lend itself to it.
pub type Fault = (&'static str, fn(&Place<'_>) -> Option<Case>);

/// All kinds, in the order of the table.
pub const ALL: &[Fault] = &[
    ("none", |place| Some(place.case())),
    ("focal_length", |place| camera(place, 1.05, 0.0, 0.0)),
    ("another_camera", |place| camera(place, 0.8, 60.0, -20.0)),
    ("inverse_pose", |place| poses(place, Pose::inverse)),
    ("moved_truth", moved_truth),
    ("millimetres", |place| points(place, |point| point * 1000.0)),
    ("poses_in_millimetres", |place| poses(place, in_millimetres)),
    ("late_cloud", |place| points(place, |point| point + Vector3::new(0.0, 0.0, 0.6))),
    ("mirrored_cloud", |place| points(place, |point| Point3::new(-point.x, point.y, point.z))),
    ("cloud_of_another_frame", cloud_of_another_frame),
    ("sparse_cloud", sparse_cloud),
    ("cloud_behind", cloud_behind),
    ("bleeding_depths", bleeding_depths),
    ("textureless_query", |place| pixels(place, |_| Rgb([128; 3]))),
    ("few_keypoints", |place| params(place, |p| p.surf.threshold *= 60.0)),
    ("noise_query", noise_query),
    ("mirrored_query", |place| photo(place, image::imageops::flip_horizontal_in_place)),
    ("foreign_query", |place| photo(place, |own| *own = place.foreign_photo())),
    ("gamma", |place| pixels(place, |pixel| Rgb(pixel.0.map(darkened)))),
    ("night", night),
    ("occluder", occluder),
    ("moved_scenery", moved_scenery),
    ("strict_ratio", |place| params(place, |p| p.fb.ratio = 0.05)),
    ("few_trials", few_trials),
    ("narrow_window", narrow_window),
    ("refused", refused),
    ("yaw", |place| turned_query(place, 40.0)),
    ("looking_back", |place| turned_query(place, 180.0)),
    ("outside_disc", outside_disc),
    ("narrow_yaw", narrow_yaw),
    ("bend", bend),
    ("coarse_steps", |place| {
        params(place, |p| {
            (p.grid.coarse_step_m, p.grid.fine_range_m) = (5.0, 0.6);
        })
    }),
    ("raised_camera", raised_camera),
    ("low_coverage", low_coverage),
    ("bad_reference", bad_reference),
    ("duplicate_place", duplicate_place),
];

/// The query's camera with other focal lengths and another principal point.
fn camera(place: &Place<'_>, times: f64, right_px: f64, down_px: f64) -> Option<Case> {
    let mut case = place.case();
    let camera = &mut case.query.intrinsics;
    camera.fx *= times;
    camera.fy *= times;
    camera.cx += right_px;
    camera.cy += down_px;
    Some(case)
}

fn poses(place: &Place<'_>, change: impl Fn(&Pose) -> Pose) -> Option<Case> {
    let mut case = place.case();
    for frame in case.references.iter_mut().chain([&mut case.query]) {
        frame.pose = frame.pose.as_ref().map(&change);
    }
    Some(case)
}

fn in_millimetres(pose: &Pose) -> Pose {
    Pose::from_parts(Translation3::from(pose.translation.vector * 1000.0), pose.rotation)
}

fn moved_truth(place: &Place<'_>) -> Option<Case> {
    let mut case = place.case();
    let moved = case.query.pose? * Pose::translation(12.0, 0.0, 0.0);
    case.query.pose = Some(moved);
    Some(case)
}

fn cloud(
    place: &Place<'_>,
    change: impl FnOnce(&[Point3<f32>]) -> Vec<Point3<f32>>,
) -> Option<Case> {
    let mut case = place.case();
    let cloud = &mut case.references[0].cloud;
    *cloud = Cloud { points: change(&cloud.points) };
    Some(case)
}

fn points(place: &Place<'_>, change: impl Fn(&Point3<f32>) -> Point3<f32>) -> Option<Case> {
    cloud(place, |points| points.iter().map(change).collect())
}

fn cloud_of_another_frame(place: &Place<'_>) -> Option<Case> {
    let farther = place.farther_cloud()?;
    cloud(place, |_| farther.points)
}

fn in_view(camera: &Intrinsics, point: &Point3<f32>) -> bool {
    let pixel = camera.project(&point.cast());
    pixel.is_some_and(|pixel| camera.contains(&pixel))
}

fn sparse_cloud(place: &Place<'_>) -> Option<Case> {
    const LEFT: usize = 30;
    let camera = place.case().references[0].intrinsics;
    cloud(place, |points| {
        let seen = points.iter().filter(|point| in_view(&camera, point)).copied();
        let seen: Vec<_> = seen.collect();
        let stride = (seen.len() / LEFT).max(1);
        seen.into_iter().step_by(stride).take(LEFT).collect()
    })
}

fn cloud_behind(place: &Place<'_>) -> Option<Case> {
    cloud(place, |points| points.iter().filter(|point| point.z < 0.0).copied().collect())
}

fn bleeding_depths(place: &Place<'_>) -> Option<Case> {
    const BESIDE_PX: f64 = 40.0;
    let case = place.case();
    let (camera, index) = (case.references[0].intrinsics, &case.references[0].cloud);
    let index = ProjectedCloudIndex::new(index, &camera);
    let bled = |point: &Point3<f32>| {
        let pixel = camera.project(&point.cast()).filter(|pixel| camera.contains(pixel))?;
        let mut beside = pixel;
        beside.x += BESIDE_PX;
        let depths = index.read(&beside, 3.0).within?;
        Some(camera.unproject(&pixel, depths.nearest).cast::<f32>())
    };
    points(place, |point| bled(point).unwrap_or(*point))
}

fn photo(place: &Place<'_>, change: impl FnOnce(&mut RgbImage)) -> Option<Case> {
    let mut case = place.case();
    change(&mut case.query.photo);
    Some(case)
}

fn pixels(place: &Place<'_>, mut change: impl FnMut(&Rgb<u8>) -> Rgb<u8>) -> Option<Case> {
    photo(place, |photo| {
        photo.pixels_mut().for_each(|pixel| *pixel = change(pixel));
    })
}

fn darkened(value: u8) -> u8 {
    (255.0 * (f64::from(value) / 255.0).powf(3.3)).round() as u8
}

fn noise_query(place: &Place<'_>) -> Option<Case> {
    let mut rng = Pcg64::seed_from_u64(place.number as u64);
    pixels(place, |_| Rgb([rng.random(); 3]))
}

fn night(place: &Place<'_>) -> Option<Case> {
    let street = place.street()?;
    let night = &street.drives.night;
    let day = street.drives.day.world_from_camera(street.query);
    let mut case = place.case();
    case.query = Frame::of(night, nearest(night, &day));
    Some(case)
}

/// Copies some columns of another photo of the same size.
fn paste(photo: &mut RgbImage, other: &RgbImage, columns: std::ops::Range<u32>) {
    for y in 0..photo.height() {
        for x in columns.clone() {
            photo.put_pixel(x, y, *other.get_pixel(x, y));
        }
    }
}

fn occluder(place: &Place<'_>) -> Option<Case> {
    let street = place.street()?;
    let drive = &street.drives.elsewhere;
    let other = drive.image((street.query + 40) % drive.frame_count());
    photo(place, |photo| paste(photo, &other, 0..photo.width() / 2))
}

fn moved_scenery(place: &Place<'_>) -> Option<Case> {
    let street = place.street()?;
    let other = street.drives.day.image(street.frame_at(street.query, 6));
    photo(place, |photo| {
        paste(photo, &other, photo.width() * 35 / 100..photo.width());
    })
}

fn params(place: &Place<'_>, change: impl FnOnce(&mut Params)) -> Option<Case> {
    let mut case = place.case();
    change(&mut case.params);
    Some(case)
}

fn few_trials(place: &Place<'_>) -> Option<Case> {
    params(place, |params| {
        (params.fb.ratio, params.fb.unique) = (1.0, false);
        (params.fb.mlesac.min_trials, params.fb.mlesac.max_trials) = (1, 2);
    })
}

fn narrow_window(place: &Place<'_>) -> Option<Case> {
    photo(place, |photo| {
        let (width, height) = photo.dimensions();
        let (left, top) = (width * 35 / 100, height * 45 / 100);
        for (x, y, pixel) in photo.enumerate_pixels_mut() {
            if !(left..left + 150).contains(&x) || !(top..top + 100).contains(&y) {
                *pixel = Rgb([90; 3]);
            }
        }
    })
}

fn refused(place: &Place<'_>) -> Option<Case> {
    let mut case = place.case();
    // As strict a ratio as leaves four or five matches with a depth.
    for step in 1..30 {
        case.params.fb.ratio = 0.8 - 0.025 * f64::from(step);
        let results = case.results(&[Method::FB], false).ok()?;
        let counts = results.first()?.counts?;
        if counts.with_depth < 4 {
            return None;
        }
        if counts.with_depth <= 5 {
            return Some(case);
        }
    }
    None
}

/// The query seen from its true pose times another.
fn moved_query(place: &Place<'_>, moved: Pose) -> Option<Case> {
    let street = place.street()?;
    let day = &street.drives.day;
    let pose = day.world_from_camera(street.query) * moved;
    let mut case = place.case();
    case.query = Frame::seen_from(day, street.query, &pose);
    Some(case)
}

fn turned_query(place: &Place<'_>, left_deg: f64) -> Option<Case> {
    let turn = yaw(left_deg.to_radians());
    moved_query(place, Pose::from_parts(Translation3::identity(), turn))
}

fn raised_camera(place: &Place<'_>) -> Option<Case> {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -5_f64.to_radians());
    moved_query(place, Pose::from_parts(Translation3::new(0.0, -1.5, 0.0), down))
}

fn outside_disc(place: &Place<'_>) -> Option<Case> {
    let street = place.street()?;
    let mut case = place.case();
    case.references = vec![street.frame(street.frame_at(street.query, -15))];
    Some(case)
}

fn narrow_yaw(place: &Place<'_>) -> Option<Case> {
    let mut case = turned_query(place, 9.0)?;
    case.params.grid.yaw_range_deg = 4.0;
    Some(case)
}

/// The query is moved half a coarse step against the reference and turned.
fn bend(place: &Place<'_>) -> Option<Case> {
    let street = place.street()?;
    let day = &street.drives.day;
    let moved = Pose::from_parts(Translation3::new(1.5, 0.0, 4.5), yaw(-8_f64.to_radians()));
    let pose = day.world_from_camera(street.reference) * moved;
    let mut case = place.case();
    case.query = Frame::seen_from(day, street.reference, &pose);
    Some(case)
}

fn low_coverage(place: &Place<'_>) -> Option<Case> {
    let mut case = place.case();
    case.params.grid.coverage_floor = 0.0;
    case.radius_m = 25.0;
    Some(case)
}

fn bad_reference(place: &Place<'_>) -> Option<Case> {
    let street = place.street()?;
    let mut case = place.case();
    let [behind, mut bad] =
        [-4, 4].map(|metres| street.frame(street.frame_at(street.query, metres)));
    bad.pose = bad.pose.map(|pose| pose * Pose::translation(0.0, 0.0, 15.0));
    case.references.extend([behind, bad]);
    case.chosen = vec![0, 1, 2].into();
    case.fusion = Fusion::all().find(|fusion| fusion.name == "avg");
    Some(case)
}

fn duplicate_place(place: &Place<'_>) -> Option<Case> {
    let street = place.street()?;
    let mut case = place.case();
    let far = street.frame(street.frame_at(street.query, 150));
    case.references.insert(0, far);
    let ranked = case.references.iter().enumerate().map(|(frame, reference)| RankedReference {
        name: format!("reference {frame}"),
        world_from_camera: reference.pose,
        ranked: Ranked { frame, score: 0.9 - 0.1 * frame as f32, geometry: Geometry::Unchecked },
    });
    case.chosen = References {
        frames: vec![0],
        ranking: Some(Arc::new(ReferenceRanking {
            criterion: Criterion::Words,
            candidates: 2,
            chosen: 1,
            frames: ranked.collect(),
        })),
        within_m: None,
    };
    Some(case)
}
