use super::*;
use nalgebra::Point3;

fn traversal(size: Size) -> Traversal {
    Traversal::new(7, Condition::Overcast, size)
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let drive = traversal(Size::Half);
    let alone = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool of one thread");
    assert_eq!(alone.install(|| drive.image(40)), drive.image(40));
    assert_eq!(alone.install(|| drive.cloud(40)), drive.cloud(40));
}

#[test]
fn the_same_seed_makes_the_same_town_and_another_seed_another() {
    let image = traversal(Size::Half).image(10);
    assert_eq!(image, traversal(Size::Half).image(10));
    assert_ne!(
        image,
        Traversal::new(8, Condition::Overcast, Size::Half).image(10)
    );
}

#[test]
fn a_pixel_of_half_size_looks_where_four_of_full_size_look() {
    let (full, half) = (Size::Full.intrinsics(), Size::Half.intrinsics());
    let point = Point3::new(1.0, 0.5, 7.0);
    let p = full.project(&point).expect("in front");
    let q = half.project(&point).expect("in front");
    assert!(((p.x + 0.5) / 2.0 - 0.5 - q.x).abs() < 1e-9);
    assert!(((p.y + 0.5) / 2.0 - 0.5 - q.y).abs() < 1e-9);
}

/// How the points of a scan that fall into the image compare to the surfaces seen there.
#[derive(Debug, Default)]
struct Agreement {
    agreeing: usize,
    hidden: usize,
    wrong: usize,
}

fn agreement(drive: &Traversal, frame: usize) -> Agreement {
    let camera = drive.intrinsics();
    let mut counts = Agreement::default();
    for point in drive.cloud(frame) {
        let position: Point3<f64> = point.position.cast();
        let Some(pixel) = camera.project(&position).filter(|p| camera.contains(p)) else {
            continue;
        };
        match drive.depth(frame, pixel) {
            Some(depth) if (depth - position.z).abs() <= 0.1 => counts.agreeing += 1,
            Some(depth) if depth < position.z => counts.hidden += 1,
            _ => counts.wrong += 1,
        }
    }
    counts
}

#[test]
fn scans_and_images_show_the_same_surfaces() {
    let drive = traversal(Size::Full);
    for frame in [5, 130, 333] {
        let counts = agreement(&drive, frame);
        let visible = counts.agreeing + counts.wrong;
        assert!(visible > 8_000, "{counts:?}");
        assert!(counts.wrong * 50 <= visible, "{counts:?}");
        assert!(counts.hidden * 20 <= visible, "{counts:?}");
    }
}

#[test]
fn scans_surround_the_car_within_the_range_of_the_scanner() {
    let cloud = traversal(Size::Half).cloud(77);
    assert!((80_000..130_000).contains(&cloud.len()), "{}", cloud.len());
    let behind = cloud.iter().filter(|p| p.position.z < 0.0).count();
    assert!(behind * 3 > cloud.len());
    for point in &cloud {
        let range = (point.position.cast::<f64>() - lidar::SCANNER).norm();
        assert!((2.6..121.0).contains(&range), "{range}");
        assert!((0.0..=1.0).contains(&point.reflectance));
    }
}

#[test]
fn nothing_is_in_the_way_of_the_car() {
    for seed in [1, 7] {
        let drive = Traversal::new(seed, Condition::Overcast, Size::Half);
        for pose in drive.poses.iter().step_by(3) {
            for k in 0..24 {
                let (sin, cos) = (f64::from(k) * 15.0_f64.to_radians()).sin_cos();
                let direction = nalgebra::Vector3::new(sin, 0.0, cos);
                let ray = render::town_ray(pose, &Point3::new(0.0, 0.3, 0.0), &direction);
                let sight = drive.town.look(&ray, 0.0);
                assert!(sight.is_none_or(|s| s.distance > 1.2), "{sight:?}");
            }
        }
    }
}

#[test]
fn the_camera_is_above_the_road() {
    let drive = traversal(Size::Full);
    let camera = drive.intrinsics();
    for frame in (0..drive.frame_count()).step_by(50) {
        let pixel = Point2::new(camera.cx, 370.0);
        let depth = drive.depth(frame, pixel).expect("the road");
        let road = drive.world_from_camera(frame) * camera.unproject(&pixel, depth);
        assert!((road.y - camera_path::CAMERA_HEIGHT).abs() < 1e-6);
    }
}
