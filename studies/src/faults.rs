//! Faults that are planted in a place.
//!
//! The table `docs/diagnosis/planted_faults.csv` says of each what verdict it should get. But for `rolled_truth`
//! it was written before the rules.

use std::sync::Arc;

use image::{Rgb, RgbImage, imageops};
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

/// A kind of fault: its name in the table, and what plants it in the case of a place; `None` where the place does not
/// lend itself to it.
pub type Fault = (&'static str, fn(&Place<'_>, &mut Case) -> Option<()>);

/// All kinds, in the order of the table.
pub const ALL: &[Fault] = &[
    ("none", |_, _| Some(())),
    ("focal_length", |_, case| camera(case, 1.05, 0.0, 0.0)),
    ("another_camera", |_, case| camera(case, 0.8, 60.0, -20.0)),
    ("inverse_pose", |_, case| poses(case, Pose::inverse)),
    ("moved_truth", moved_truth),
    ("rolled_truth", |_, case| {
        let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 12_f64.to_radians());
        case.query.pose = Some(case.query.pose? * roll);
        Some(())
    }),
    ("millimetres", |_, case| points(case, |point| point * 1000.0)),
    ("poses_in_millimetres", |_, case| {
        poses(case, |pose| {
            let place = Translation3::from(pose.translation.vector * 1000.0);
            Pose::from_parts(place, pose.rotation)
        })
    }),
    ("late_cloud", |_, case| points(case, |point| point + Vector3::new(0.0, 0.0, 0.6))),
    ("mirrored_cloud", |_, case| points(case, |point| Point3::new(-point.x, point.y, point.z))),
    ("cloud_of_another_frame", |place, case| {
        let farther = place.farther_cloud()?;
        cloud(case, |_| farther.points)
    }),
    ("sparse_cloud", sparse_cloud),
    ("cloud_behind", |_, case| {
        cloud(case, |points| points.iter().filter(|point| point.z < 0.0).copied().collect())
    }),
    ("bleeding_depths", bleeding_depths),
    ("textureless_query", |_, case| pixels(case, |_| Rgb([128; 3]))),
    ("few_keypoints", |_, case| params(case, |p| p.surf.threshold *= 60.0)),
    ("noise_query", |place, case| {
        let mut rng = Pcg64::seed_from_u64(place.number as u64);
        pixels(case, |_| Rgb([rng.random(); 3]))
    }),
    ("mirrored_query", |_, case| photo(case, imageops::flip_horizontal_in_place)),
    ("foreign_query", |place, case| photo(case, |own| *own = place.foreign_photo())),
    ("gamma", |_, case| {
        let darkened = |value| (255.0 * (f64::from(value) / 255.0).powf(3.3)).round() as u8;
        pixels(case, |pixel| Rgb(pixel.0.map(darkened)))
    }),
    ("night", night),
    ("occluder", occluder),
    ("moved_scenery", |place, case| {
        let street = place.street()?;
        let other = street.drives.day.image(street.frame_at(street.query, 6));
        photo(case, |photo| paste(photo, &other, photo.width() * 35 / 100..photo.width()))
    }),
    ("strict_ratio", |_, case| params(case, |p| p.fb.ratio = 0.1)),
    ("few_trials", |_, case| {
        params(case, |params| {
            (params.fb.ratio, params.fb.unique) = (1.0, false);
            (params.fb.mlesac.min_trials, params.fb.mlesac.max_trials) = (1, 2);
        })
    }),
    ("narrow_window", narrow_window),
    ("refused", refused),
    ("yaw", |place, case| turned_query(place, case, 40.0)),
    ("looking_back", |place, case| turned_query(place, case, 180.0)),
    ("outside_disc", |place, case| {
        let street = place.street()?;
        case.references = vec![street.frame(street.frame_at(street.query, -15))];
        Some(())
    }),
    ("narrow_yaw", |place, case| {
        turned_query(place, case, 9.0)?;
        params(case, |p| p.grid.yaw_range_deg = 4.0)
    }),
    ("bend", bend),
    ("coarse_steps", |_, case| {
        params(case, |p| {
            (p.grid.coarse_step_m, p.grid.fine_range_m) = (5.0, 0.6);
        })
    }),
    ("raised_camera", raised_camera),
    ("low_coverage", |_, case| {
        case.request.radius_m = 25.0;
        params(case, |params| params.grid.coverage_floor = 0.0)
    }),
    ("bad_reference", bad_reference),
    ("duplicate_place", duplicate_place),
];

/// The query's camera with other focal lengths and another principal point.
fn camera(case: &mut Case, times: f64, right_px: f64, down_px: f64) -> Option<()> {
    let camera = &mut case.query.intrinsics;
    camera.fx *= times;
    camera.fy *= times;
    camera.cx += right_px;
    camera.cy += down_px;
    Some(())
}

fn poses(case: &mut Case, change: impl Fn(&Pose) -> Pose) -> Option<()> {
    for frame in case.references.iter_mut().chain([&mut case.query]) {
        frame.pose = frame.pose.as_ref().map(&change);
    }
    Some(())
}

fn moved_truth(_: &Place<'_>, case: &mut Case) -> Option<()> {
    let moved = case.query.pose? * Pose::translation(12.0, 0.0, 0.0);
    case.query.pose = Some(moved);
    Some(())
}

fn cloud(case: &mut Case, change: impl FnOnce(&[Point3<f32>]) -> Vec<Point3<f32>>) -> Option<()> {
    let cloud = &mut case.references[0].cloud;
    *cloud = Cloud { points: change(&cloud.points) };
    Some(())
}

fn points(case: &mut Case, change: impl Fn(&Point3<f32>) -> Point3<f32>) -> Option<()> {
    cloud(case, |points| points.iter().map(change).collect())
}

fn in_view(camera: &Intrinsics, point: &Point3<f32>) -> bool {
    let pixel = camera.project(&point.cast());
    pixel.is_some_and(|pixel| camera.contains(&pixel))
}

fn sparse_cloud(_: &Place<'_>, case: &mut Case) -> Option<()> {
    const LEFT: usize = 30;
    let camera = case.references[0].intrinsics;
    cloud(case, |points| {
        let seen = points.iter().filter(|point| in_view(&camera, point)).copied();
        let seen: Vec<_> = seen.collect();
        let stride = (seen.len() / LEFT).max(1);
        seen.into_iter().step_by(stride).take(LEFT).collect()
    })
}

fn bleeding_depths(_: &Place<'_>, case: &mut Case) -> Option<()> {
    const BESIDE_PX: f64 = 40.0;
    let (camera, index) = (case.references[0].intrinsics, &case.references[0].cloud);
    let index = ProjectedCloudIndex::new(index, &camera);
    let bled = |point: &Point3<f32>| {
        let pixel = camera.project(&point.cast()).filter(|pixel| camera.contains(pixel))?;
        let mut beside = pixel;
        beside.x += BESIDE_PX;
        let depths = index.read(&beside, 3.0).within?;
        Some(camera.unproject(&pixel, depths.nearest).cast::<f32>())
    };
    points(case, |point| bled(point).unwrap_or(*point))
}

fn photo(case: &mut Case, change: impl FnOnce(&mut RgbImage)) -> Option<()> {
    change(&mut case.query.photo);
    Some(())
}

fn pixels(case: &mut Case, mut change: impl FnMut(&Rgb<u8>) -> Rgb<u8>) -> Option<()> {
    photo(case, |photo| {
        photo.pixels_mut().for_each(|pixel| *pixel = change(pixel));
    })
}

fn night(place: &Place<'_>, case: &mut Case) -> Option<()> {
    let street = place.street()?;
    let night = &street.drives.night;
    let day = street.drives.day.world_from_camera(street.query);
    case.query = Frame::of(night, nearest(night, &day));
    Some(())
}

/// Copies some columns of another photo of the same size.
fn paste(photo: &mut RgbImage, other: &RgbImage, columns: std::ops::Range<u32>) {
    let (left, width) = (columns.start, columns.end - columns.start);
    let part = imageops::crop_imm(other, left, 0, width, photo.height());
    imageops::replace(photo, &*part, left.into(), 0);
}

fn occluder(place: &Place<'_>, case: &mut Case) -> Option<()> {
    let street = place.street()?;
    let drive = &street.drives.elsewhere;
    let other = drive.image((street.query + 40) % drive.frame_count());
    photo(case, |photo| paste(photo, &other, 0..photo.width() / 2))
}

fn params(case: &mut Case, change: impl FnOnce(&mut Params)) -> Option<()> {
    change(&mut case.params);
    Some(())
}

fn narrow_window(_: &Place<'_>, case: &mut Case) -> Option<()> {
    photo(case, |photo| {
        let (width, height) = photo.dimensions();
        let (left, top) = (width * 35 / 100, height * 45 / 100);
        let window = imageops::crop_imm(photo, left, top, 150, 100).to_image();
        photo.fill(90);
        imageops::replace(photo, &window, left.into(), top.into());
    })
}

fn refused(_: &Place<'_>, case: &mut Case) -> Option<()> {
    // As strict a ratio as leaves four or five matches with a depth.
    for step in 1..30 {
        case.params.fb.ratio = 0.8 - 0.025 * f64::from(step);
        let results = case.results(&[Method::FB], false).ok()?;
        let counts = results.first()?.counts?;
        if counts.with_depth < 4 {
            return None;
        }
        if counts.with_depth <= 5 {
            return Some(());
        }
    }
    None
}

/// The query seen from the pose of a frame of the drive times another.
fn moved_query(place: &Place<'_>, case: &mut Case, from: usize, moved: Pose) -> Option<()> {
    let day = &place.street()?.drives.day;
    let pose = day.world_from_camera(from) * moved;
    case.query = Frame::seen_from(day, from, &pose);
    Some(())
}

fn turned_query(place: &Place<'_>, case: &mut Case, left_deg: f64) -> Option<()> {
    let turned = Pose::from_parts(Translation3::identity(), yaw(left_deg.to_radians()));
    moved_query(place, case, place.street()?.query, turned)
}

fn raised_camera(place: &Place<'_>, case: &mut Case) -> Option<()> {
    let down = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), -5_f64.to_radians());
    let raised = Pose::from_parts(Translation3::new(0.0, -1.5, 0.0), down);
    moved_query(place, case, place.street()?.query, raised)
}

/// The query is moved half a coarse step against the reference and turned.
fn bend(place: &Place<'_>, case: &mut Case) -> Option<()> {
    let moved = Pose::from_parts(Translation3::new(1.5, 0.0, 4.5), yaw(-8_f64.to_radians()));
    moved_query(place, case, place.street()?.reference, moved)
}

fn bad_reference(place: &Place<'_>, case: &mut Case) -> Option<()> {
    let street = place.street()?;
    let [behind, mut bad] =
        [-4, 4].map(|metres| street.frame(street.frame_at(street.query, metres)));
    bad.pose = bad.pose.map(|pose| pose * Pose::translation(0.0, 0.0, 15.0));
    case.references.extend([behind, bad]);
    case.request.references = vec![0, 1, 2].into();
    case.request.fusions = Fusion::all().filter(|fusion| fusion.name == "avg").collect();
    Some(())
}

fn duplicate_place(place: &Place<'_>, case: &mut Case) -> Option<()> {
    let street = place.street()?;
    let far = street.frame(street.frame_at(street.query, 150));
    case.references.insert(0, far);
    let ranked = case.references.iter().enumerate().map(|(frame, reference)| RankedReference {
        name: format!("reference {frame}"),
        world_from_camera: reference.pose,
        ranked: Ranked { frame, score: 0.9 - 0.1 * frame as f32, geometry: Geometry::Unchecked },
    });
    case.request.references = References {
        frames: vec![0],
        ranking: Some(Arc::new(ReferenceRanking {
            criterion: Criterion::Words,
            candidates: 2,
            chosen: 1,
            frames: ranked.collect(),
        })),
        within_m: None,
    };
    Some(())
}
