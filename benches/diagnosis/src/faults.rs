//! Faults that are planted in a place.
//!
//! The table `docs/diagnosis/planted_faults.csv` says of each what verdict it should get. It was written
//! before the rules.

use image::{Rgb, RgbImage};
use nalgebra::{Point3, Translation3, UnitQuaternion, Vector3};
use posescope::camera::Intrinsics;
use posescope::cloud::Cloud;
use posescope::depth::ProjectedCloudIndex;
use posescope::fusion::Fusion;
use posescope::geometry::{Pose, yaw};
use posescope::localize::References;
use posescope::method::Method;
use posescope::retrieval::{Criterion, Geometry, Ranked, RankedReference, ReferenceRanking};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

use crate::places::{Case, Place, frame_of};

/// A kind of fault: its name in the table, and the place with it; `None` where the place does not
/// lend itself to it.
pub type Fault = (&'static str, fn(&Place<'_>) -> Option<Case>);

/// All kinds, in the order of the table.
pub const ALL: &[Fault] = &[
    ("none", |place| Some(place.case())),
    ("focal_length", focal_length),
    ("another_camera", another_camera),
    ("inverse_pose", inverse_pose),
    ("moved_truth", moved_truth),
    ("millimetres", millimetres),
    ("poses_in_millimetres", poses_in_millimetres),
    ("late_cloud", late_cloud),
    ("mirrored_cloud", mirrored_cloud),
    ("cloud_of_another_frame", cloud_of_another_frame),
    ("sparse_cloud", sparse_cloud),
    ("cloud_behind", cloud_behind),
    ("bleeding_depths", bleeding_depths),
    ("textureless_query", textureless_query),
    ("few_keypoints", few_keypoints),
    ("noise_query", noise_query),
    ("mirrored_query", mirrored_query),
    ("foreign_query", foreign_query),
    ("gamma", gamma),
    ("night", night),
    ("occluder", occluder),
    ("moved_scenery", moved_scenery),
    ("strict_ratio", strict_ratio),
    ("few_trials", few_trials),
    ("narrow_window", narrow_window),
    ("refused", refused),
    ("yaw", |place| turned_query(place, 40.0)),
    ("looking_back", |place| turned_query(place, 180.0)),
    ("outside_disc", outside_disc),
    ("narrow_yaw", narrow_yaw),
    ("bend", bend),
    ("coarse_steps", coarse_steps),
    ("raised_camera", raised_camera),
    ("low_coverage", low_coverage),
    ("bad_reference", bad_reference),
    ("duplicate_place", duplicate_place),
];

fn with_query_camera(place: &Place<'_>, change: impl Fn(&mut Intrinsics)) -> Option<Case> {
    let mut case = place.case();
    change(&mut case.query.intrinsics);
    Some(case)
}

fn focal_length(place: &Place<'_>) -> Option<Case> {
    with_query_camera(place, |camera| {
        camera.fx *= 1.05;
        camera.fy *= 1.05;
    })
}

fn another_camera(place: &Place<'_>) -> Option<Case> {
    with_query_camera(place, |camera| {
        camera.fx *= 0.8;
        camera.fy *= 0.8;
        camera.cx += 60.0;
        camera.cy -= 20.0;
    })
}

fn with_poses(place: &Place<'_>, change: impl Fn(&Pose) -> Pose) -> Option<Case> {
    let mut case = place.case();
    case.query.pose = case.query.pose.as_ref().map(&change);
    for reference in &mut case.references {
        reference.pose = reference.pose.as_ref().map(&change);
    }
    Some(case)
}

fn inverse_pose(place: &Place<'_>) -> Option<Case> {
    with_poses(place, Pose::inverse)
}

fn poses_in_millimetres(place: &Place<'_>) -> Option<Case> {
    with_poses(place, |pose| {
        Pose::from_parts(
            Translation3::from(pose.translation.vector * 1000.0),
            pose.rotation,
        )
    })
}

fn moved_truth(place: &Place<'_>) -> Option<Case> {
    let mut case = place.case();
    case.query.pose = case
        .query
        .pose
        .map(|pose| pose * Pose::translation(12.0, 0.0, 0.0));
    Some(case)
}

fn with_cloud(
    place: &Place<'_>,
    change: impl FnOnce(&[Point3<f32>]) -> Vec<Point3<f32>>,
) -> Option<Case> {
    let mut case = place.case();
    let cloud = &mut case.references[0].cloud;
    *cloud = Cloud {
        points: change(&cloud.points),
    };
    Some(case)
}

fn with_points(place: &Place<'_>, change: impl Fn(&Point3<f32>) -> Point3<f32>) -> Option<Case> {
    with_cloud(place, |points| points.iter().map(change).collect())
}

fn millimetres(place: &Place<'_>) -> Option<Case> {
    with_points(place, |point| point * 1000.0)
}

fn late_cloud(place: &Place<'_>) -> Option<Case> {
    with_points(place, |point| point + Vector3::new(0.0, 0.0, 0.6))
}

fn mirrored_cloud(place: &Place<'_>) -> Option<Case> {
    with_points(place, |point| Point3::new(-point.x, point.y, point.z))
}

fn cloud_of_another_frame(place: &Place<'_>) -> Option<Case> {
    let farther = place.farther_cloud()?;
    with_cloud(place, |_| farther.points)
}

fn in_view(camera: &Intrinsics, point: &Point3<f32>) -> bool {
    let pixel = camera.project(&point.cast());
    pixel.is_some_and(|pixel| camera.contains(&pixel))
}

fn sparse_cloud(place: &Place<'_>) -> Option<Case> {
    const LEFT: usize = 30;
    let camera = place.case().references[0].intrinsics;
    with_cloud(place, |points| {
        let seen: Vec<_> = points
            .iter()
            .filter(|point| in_view(&camera, point))
            .collect();
        let stride = (seen.len() / LEFT).max(1);
        seen.into_iter()
            .step_by(stride)
            .take(LEFT)
            .copied()
            .collect()
    })
}

fn cloud_behind(place: &Place<'_>) -> Option<Case> {
    with_cloud(place, |points| {
        points
            .iter()
            .filter(|point| point.z < 0.0)
            .copied()
            .collect()
    })
}

fn bleeding_depths(place: &Place<'_>) -> Option<Case> {
    const BESIDE_PX: f64 = 40.0;
    let camera = place.case().references[0].intrinsics;
    with_cloud(place, |points| {
        let cloud = Cloud {
            points: points.to_vec(),
        };
        let index = ProjectedCloudIndex::new(&cloud, &camera);
        let bled = |point: &Point3<f32>| {
            let pixel = camera
                .project(&point.cast())
                .filter(|pixel| camera.contains(pixel))?;
            let mut beside = pixel;
            beside.x += BESIDE_PX;
            let depths = index.read(&beside, 3.0).within?;
            Some(camera.unproject(&pixel, depths.nearest).cast::<f32>())
        };
        points
            .iter()
            .map(|point| bled(point).unwrap_or(*point))
            .collect()
    })
}

fn with_photo(place: &Place<'_>, change: impl FnOnce(&mut RgbImage)) -> Option<Case> {
    let mut case = place.case();
    change(&mut case.query.photo);
    Some(case)
}

fn textureless_query(place: &Place<'_>) -> Option<Case> {
    with_photo(place, |photo| {
        photo.pixels_mut().for_each(|pixel| *pixel = Rgb([128; 3]))
    })
}

fn noise_query(place: &Place<'_>) -> Option<Case> {
    let mut rng = Pcg64::seed_from_u64(place.number as u64);
    with_photo(place, |photo| {
        photo
            .pixels_mut()
            .for_each(|pixel| *pixel = Rgb([rng.random(); 3]));
    })
}

fn mirrored_query(place: &Place<'_>) -> Option<Case> {
    with_photo(place, image::imageops::flip_horizontal_in_place)
}

fn foreign_query(place: &Place<'_>) -> Option<Case> {
    with_photo(place, |own| *own = place.foreign_photo())
}

fn gamma(place: &Place<'_>) -> Option<Case> {
    let darkened = |value: u8| (255.0 * (f64::from(value) / 255.0).powf(3.3)).round() as u8;
    with_photo(place, |photo| {
        photo
            .pixels_mut()
            .for_each(|pixel| pixel.0 = pixel.0.map(darkened));
    })
}

fn night(place: &Place<'_>) -> Option<Case> {
    let street = place.street()?;
    let night = &street.drives.night;
    let day = street.drives.day.world_from_camera(street.query);
    let distance = |frame: &usize| {
        (night.world_from_camera(*frame).translation.vector - day.translation.vector).norm()
    };
    let frame = (0..night.frame_count()).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let mut case = place.case();
    case.query = frame_of(night, frame, &night.world_from_camera(frame));
    Some(case)
}

/// Copies a rectangle of another photo of the same size.
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
    with_photo(place, |photo| paste(photo, &other, 0..photo.width() / 2))
}

fn moved_scenery(place: &Place<'_>) -> Option<Case> {
    let street = place.street()?;
    let other = street.drives.day.image(street.frame_at(street.query, 6));
    with_photo(place, |photo| {
        let width = photo.width();
        paste(photo, &other, width * 35 / 100..width);
    })
}

fn few_keypoints(place: &Place<'_>) -> Option<Case> {
    let mut case = place.case();
    case.params.surf.threshold *= 60.0;
    Some(case)
}

fn strict_ratio(place: &Place<'_>) -> Option<Case> {
    let mut case = place.case();
    case.params.fb.ratio = 0.05;
    Some(case)
}

fn few_trials(place: &Place<'_>) -> Option<Case> {
    let mut case = place.case();
    case.params.fb.ratio = 1.0;
    case.params.fb.unique = false;
    case.params.fb.mlesac.min_trials = 1;
    case.params.fb.mlesac.max_trials = 2;
    Some(case)
}

fn narrow_window(place: &Place<'_>) -> Option<Case> {
    with_photo(place, |photo| {
        let (width, height) = photo.dimensions();
        let (left, top) = (width * 35 / 100, height * 45 / 100);
        for (x, y, pixel) in photo.enumerate_pixels_mut() {
            let inside = (left..left + 150).contains(&x) && (top..top + 100).contains(&y);
            if !inside {
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
        let results = case.results(&[Method::FB], false);
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

fn turned_query(place: &Place<'_>, left_deg: f64) -> Option<Case> {
    let street = place.street()?;
    let pose = street.drives.day.world_from_camera(street.query);
    let turned = pose * Pose::from_parts(Translation3::identity(), yaw(left_deg.to_radians()));
    let mut case = place.case();
    case.query = street.frame_from(street.query, &turned);
    Some(case)
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
    let reference = street.drives.day.world_from_camera(street.reference);
    let moved = Pose::from_parts(Translation3::new(1.5, 0.0, 4.5), yaw(-8_f64.to_radians()));
    let mut case = place.case();
    case.query = street.frame_from(street.reference, &(reference * moved));
    Some(case)
}

fn coarse_steps(place: &Place<'_>) -> Option<Case> {
    let mut case = place.case();
    case.params.grid.coarse_step_m = 5.0;
    case.params.grid.fine_range_m = 0.6;
    Some(case)
}

fn raised_camera(place: &Place<'_>) -> Option<Case> {
    let street = place.street()?;
    let pose = street.drives.day.world_from_camera(street.query);
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -5_f64.to_radians());
    let raised = pose * Pose::from_parts(Translation3::new(0.0, -1.5, 0.0), down);
    let mut case = place.case();
    case.query = street.frame_from(street.query, &raised);
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
    let mut bad = street.frame(street.frame_at(street.query, 4));
    bad.pose = bad
        .pose
        .map(|pose| pose * Pose::translation(0.0, 0.0, 15.0));
    case.references
        .push(street.frame(street.frame_at(street.query, -4)));
    case.references.push(bad);
    case.chosen = vec![0, 1, 2].into();
    case.fusion = Fusion::all().find(|fusion| fusion.name == "avg");
    Some(case)
}

fn duplicate_place(place: &Place<'_>) -> Option<Case> {
    let street = place.street()?;
    let mut case = place.case();
    let far = street.frame(street.frame_at(street.query, 150));
    let right = case.references.remove(0);
    let poses = [far.pose, right.pose];
    case.references = vec![far, right];
    let ranked = poses
        .into_iter()
        .enumerate()
        .map(|(frame, pose)| RankedReference {
            name: format!("reference {frame}"),
            world_from_camera: pose,
            ranked: Ranked {
                frame,
                score: 0.9 - 0.1 * frame as f32,
                geometry: Geometry::Unchecked,
            },
        });
    case.chosen = References {
        frames: vec![0],
        ranking: Some(std::sync::Arc::new(ReferenceRanking {
            criterion: Criterion::Words,
            candidates: 2,
            chosen: 1,
            frames: ranked.collect(),
        })),
        within_m: None,
    };
    Some(case)
}
