use super::*;
use image::{Luma, Rgb};
use nalgebra::Point3;

const CAMERA: Intrinsics =
    Intrinsics { fx: 200.0, fy: 210.0, cx: 158.0, cy: 121.5, width: 320, height: 240 };

fn distortion(k1: f64, k2: f64, p1: f64, p2: f64) -> Distortion {
    Distortion::brown([k1, k2, 0.0, 0.0, 0.0, 0.0], [p1, p2])
}

/// A photo with distortion of a plane at depth 1 whose grey value is a smooth function.
fn taken(lens: &Lens, value: impl Fn(Point2<f64>) -> f64) -> GrayImage {
    GrayImage::from_fn(CAMERA.width, CAMERA.height, |x, y| {
        let seen = CAMERA.unproject(&Point2::new(f64::from(x), f64::from(y)), 1.0).xy();
        // The direction that is seen there, by fixed-point iteration.
        let mut at = seen;
        for _ in 0..50 {
            at += seen - lens.distortion.distorted(at);
        }
        Luma([value(at).round() as u8])
    })
}

#[test]
fn an_undistorted_photo_is_what_the_pinhole_sees() {
    let value = |at: Point2<f64>| 128.0 + 60.0 * (9.0 * at.x).sin() + 50.0 * (7.0 * at.y).cos();
    for coefficients in [distortion(-0.2, 0.03, 0.0, 0.0), distortion(0.15, 0.02, 0.001, -0.002)] {
        let lens = Lens::new(CAMERA, coefficients).expect("can be undistorted");
        let photo = lens.developed(Photo::from_gray(taken(&lens, value)));
        let pinhole = lens.pinhole;
        for (x, y, gray) in photo.gray.enumerate_pixels() {
            let at = pinhole.unproject(&Point2::new(f64::from(x), f64::from(y)), 1.0);
            let expected = value(at.xy());
            let found = f64::from(gray.0[0]);
            assert!((found - expected).abs() < 3.0, "{x} {y}: {found} {expected}");
        }
    }
}

#[test]
fn a_pincushion_is_magnified_until_nothing_is_blank_and_a_barrel_is_not() {
    let barrel = Lens::new(CAMERA, distortion(-0.1, 0.0, 0.0, 0.0)).expect("sound");
    assert_eq!(barrel.pinhole, CAMERA);
    let cushion = Lens::new(CAMERA, distortion(0.1, 0.0, 0.0, 0.0)).expect("sound");
    assert!(cushion.pinhole.fx > 1.02 * CAMERA.fx);
    let corner = cushion.source_pixel(Point2::new(319.0, 239.0));
    assert!(CAMERA.contains(&corner), "{corner}");
    let ratio = cushion.pinhole.fy / cushion.pinhole.fx;
    assert!((ratio - CAMERA.fy / CAMERA.fx).abs() < 1e-12);
    // A point of the world is seen in the middle of what was magnified about the centre.
    let ahead = cushion.pinhole.project(&Point3::new(0.0, 0.0, 5.0));
    assert_eq!(ahead, Some(Point2::new(CAMERA.cx, CAMERA.cy)));
}

#[test]
fn a_lens_that_folds_its_image_is_refused() {
    let folding = Lens::new(CAMERA, distortion(-30.0, 0.0, 0.0, 0.0));
    assert!(folding.is_err());
    assert!(Lens::new(CAMERA, distortion(f64::NAN, 0.0, 0.0, 0.0)).is_err());
}

#[test]
fn colours_stay_together() {
    let lens = Lens::new(CAMERA, Distortion::None).expect("a pinhole");
    let color = RgbImage::from_fn(320, 240, |x, y| Rgb([x as u8, y as u8, 77]));
    let photo = lens.developed(Photo::from_color(color.clone()));
    assert_eq!(photo.color, Some(color));
}

/// One of each model.
fn models() -> Vec<Distortion> {
    let k = [-0.02, 0.003, -0.001, 0.0005, 0.0002, -0.0001];
    let p = [0.001, -0.002];
    vec![
        distortion(-0.1, 0.02, 0.001, -0.002),
        Distortion::brown([-0.1, 0.02, 0.003, 0.01, -0.02, 0.004], p),
        Distortion::fisheye([0.0; 4]),
        Distortion::fisheye([-0.02, 0.003, -0.001, 0.0005]),
        Distortion::Fisheye { k, p, s: [0.003, 0.0, -0.004, 0.0], after: false },
        Distortion::Fisheye { k, p, s: [0.003, -0.004, 0.005, -0.006], after: true },
        Distortion::FieldOfView { omega: 0.9 },
        Distortion::Division { k: -0.1 },
        Distortion::Unified { alpha: 0.6, beta: 1.1 },
    ]
}

#[test]
fn every_pixel_of_every_model_comes_back_from_the_file() {
    for model in models() {
        let lens = Lens::new(CAMERA, model).unwrap_or_else(|why| panic!("{why}"));
        for x in [0.0, 40.0, 158.0, 250.5, 319.0] {
            for y in [0.0, 60.25, 121.5, 239.0] {
                let pixel = Point2::new(x, y);
                let in_file = lens.to_file(pixel);
                assert!(CAMERA.contains(&in_file), "{model}: {pixel} {in_file}");
                let back = lens.to_photo(in_file).unwrap_or_else(|| panic!("{model}: {pixel}"));
                assert!((back - pixel).norm() < 1e-6, "{model}: {pixel} {back}");
            }
        }
    }
}

#[test]
fn what_is_beside_or_behind_the_camera_is_in_no_photo() {
    // The border of this fisheye's photo is at 109° to the axis.
    let wide = Intrinsics { fx: 84.0, fy: 84.0, cx: 159.5, cy: 119.5, width: 320, height: 240 };
    let lens = Lens::new(wide, Distortion::fisheye([0.0; 4])).expect("sound");
    assert_eq!(lens.pinhole, wide);
    assert!(lens.to_photo(Point2::new(0.0, 119.5)).is_none());
    let inside = lens.to_photo(Point2::new(159.5 + 84.0, 119.5)).expect("57° to the axis");
    assert!((inside.x - (159.5 + 84.0 * 1.0_f64.tan())).abs() < 1e-6, "{inside}");
}

#[test]
fn a_fisheye_photo_becomes_what_the_pinhole_sees() {
    let value = |at: Point2<f64>| 128.0 + 60.0 * (4.0 * at.x).sin() + 50.0 * (3.0 * at.y).cos();
    for model in [Distortion::fisheye([-0.02, 0.003, -0.001, 0.0005]), models()[5]] {
        let lens = Lens::new(CAMERA, model).expect("sound");
        let photo = GrayImage::from_fn(CAMERA.width, CAMERA.height, |x, y| {
            let pixel = lens.to_photo(Point2::new(f64::from(x), f64::from(y)));
            let seen = pixel.map(|pixel| lens.pinhole.unproject(&pixel, 1.0).xy());
            Luma([seen.map_or(0, |at| value(at).round() as u8)])
        });
        let developed = lens.developed(Photo::from_gray(photo));
        for (x, y, gray) in developed.gray.enumerate_pixels() {
            let at = lens.pinhole.unproject(&Point2::new(f64::from(x), f64::from(y)), 1.0);
            let (expected, found) = (value(at.xy()), f64::from(gray.0[0]));
            assert!((found - expected).abs() < 3.0, "{x} {y}: {found} {expected}");
        }
    }
}

#[test]
fn no_coefficient_gives_pixels_that_are_no_numbers() {
    for coefficient in [f64::NAN, f64::INFINITY, 1e300, -1e300, 1e9, -1e9] {
        for model in [
            distortion(coefficient, 0.0, 0.0, 0.0),
            Distortion::brown([0.0, 0.0, 0.0, coefficient, 0.0, 0.0], [0.0; 2]),
            Distortion::fisheye([coefficient, 0.0, 0.0, 0.0]),
            Distortion::FieldOfView { omega: coefficient },
            Distortion::Division { k: coefficient },
            Distortion::Unified { alpha: coefficient, beta: 1.0 },
        ] {
            if let Ok(lens) = Lens::new(CAMERA, model) {
                for pixel in [Point2::new(0.0, 0.0), Point2::new(319.0, 239.0)] {
                    assert!(CAMERA.contains(&lens.to_file(pixel)), "{model}");
                }
            }
        }
    }
}
