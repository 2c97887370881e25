use super::*;
use crate::Street;
use crate::world::town_ray;
use nalgebra::Point3;

fn traversal(size: Size) -> Traversal {
    Traversal::new(7, Condition::Overcast, size)
}

/// Hashes of the image of half size and of the cloud of frame 40.
fn hashes(condition: Condition) -> [u64; 2] {
    let drive = Traversal::new(7, condition, Size::Half);
    let mut points = Vec::new();
    for point in drive.cloud(40) {
        let ScanPoint { position: p, reflectance } = point;
        for number in [p.x, p.y, p.z, reflectance] {
            points.extend(number.to_le_bytes());
        }
    }
    [xxhash_rust::xxh3::xxh3_64(drive.image(40).as_raw()), xxhash_rust::xxh3::xxh3_64(&points)]
}

/// They change with every change of the looks or the geometry, and with nothing else: not with the
/// platform, nor with the number of threads.
#[test]
fn the_bytes_depend_on_the_condition_and_not_on_the_number_of_threads() {
    const EXPECTED: [[u64; 2]; 5] = [
        [0x72CA_4A29_6461_BD46, 0xAC98_0B02_7F4F_8857],
        [0x2D1D_A59D_6B0C_C8DC, 0xBA3E_A54A_C6A8_018F],
        [0x28B1_FD16_C0A6_0298, 0x6E87_5FFC_2CC2_6CBE],
        [0xD8EC_626C_7776_C63F, 0x8418_9E5F_4503_597A],
        [0x9822_AC28_B416_4D2F, 0x5E53_BB76_BAB5_9496],
    ];
    for threads in [1, 4] {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("a pool of threads");
        let found = Condition::ALL.map(|condition| pool.install(|| hashes(condition)));
        assert_eq!(found, EXPECTED, "{threads} threads: {found:#018x?}");
    }
}

#[test]
fn conditions_are_called_as_they_are_opened() {
    for condition in Condition::ALL {
        let opened = Street::open(&format!("street:{}", condition.name()));
        assert!(opened.is_ok(), "{condition:?}");
    }
}

#[test]
fn traversals_share_houses_and_differ_in_cars_and_in_the_line_driven() {
    let [overcast, sun] = [Condition::Overcast, Condition::Sun]
        .map(|condition| Traversal::new(7, condition, Size::Half));
    assert_eq!(overcast.frame_count(), sun.frame_count());
    for (a, b) in overcast.poses.iter().zip(&sun.poses) {
        let offset = (a.translation.vector - b.translation.vector).norm();
        assert!(offset < 0.35, "{offset}");
        let turn = a.rotation.angle_to(&b.rotation).to_degrees();
        assert!(turn < 2.0, "{turn}");
    }
    // Far above cars and below roofs, one sees the same walls.
    let sky_hook = Point3::new(0.0, -3.5, 0.0);
    let wall = |drive: &Traversal, pose: &Pose| {
        let ray = town_ray(pose, &sky_hook, &nalgebra::Vector3::x());
        drive.town.look(&ray, 0.0).map(|sight| sight.distance)
    };
    let mut same = 0;
    for pose in overcast.poses.iter().step_by(10) {
        same += usize::from(wall(&overcast, pose) == wall(&sun, pose));
    }
    assert!(same > 50, "{same}");
}

#[test]
fn the_same_seed_makes_the_same_town_and_another_seed_another() {
    let image = traversal(Size::Half).image(10);
    assert_eq!(image, traversal(Size::Half).image(10));
    assert_ne!(image, Traversal::new(8, Condition::Overcast, Size::Half).image(10));
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
    for condition in Condition::ALL {
        let drive = Traversal::new(7, condition, Size::Full);
        for frame in [5, 130, 333] {
            let counts = agreement(&drive, frame);
            let visible = counts.agreeing + counts.wrong;
            assert!(visible > 8_000, "{condition:?} {counts:?}");
            assert!(counts.wrong * 50 <= visible, "{condition:?} {counts:?}");
            assert!(counts.hidden * 20 <= visible, "{condition:?} {counts:?}");
        }
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
                let ray = town_ray(pose, &Point3::new(0.0, 0.3, 0.0), &direction);
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
