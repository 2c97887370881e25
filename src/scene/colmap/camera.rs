//! COLMAP's camera models.

use super::super::lens::{Distortion, pinhole};
use crate::camera::Intrinsics;

/// A camera of a model, with its distortion. Pixel centres are at integers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct ModelCamera {
    pub intrinsics: Intrinsics,
    pub distortion: Distortion,
}

/// The models with their number of parameters. The index is the model's number in binary files.
const MODELS: [(&str, usize); 18] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
    ("SIMPLE_DIVISION", 4),
    ("DIVISION", 5),
    ("SIMPLE_FISHEYE", 3),
    ("FISHEYE", 4),
    ("EUCM", 6),
    (PANORAMA, 2),
];

/// The model of panoramas, of which no pinhole camera sees all.
const PANORAMA: &str = "EQUIRECTANGULAR";

/// The name of a model and its number of parameters.
pub(super) fn model_of_number(number: u32) -> Result<(&'static str, usize), String> {
    let model = usize::try_from(number).ok().and_then(|n| MODELS.get(n));
    model.copied().ok_or_else(|| format!("{} expected, model number {number} found", known()))
}

fn known() -> String {
    let names = MODELS.iter().map(|(name, _)| *name).filter(|name| *name != PANORAMA);
    format!("one of {}", names.collect::<Vec<_>>().join(", "))
}

impl ModelCamera {
    /// The camera of a model from its parameters, in COLMAP's order.
    pub fn new(
        model: &str,
        (width, height): (u64, u64),
        parameters: &[f64],
    ) -> Result<Self, String> {
        if model == PANORAMA {
            return Err(format!("a camera expected, {PANORAMA} found: cut panoramas into views"));
        }
        let (_, count) = MODELS.iter().find(|(name, _)| *name == model).ok_or_else(|| {
            format!("{} expected, `{model}` found; `colmap image_undistorter` converts it", known())
        })?;
        if parameters.len() != *count {
            return Err(format!(
                "{count} parameters of {model} expected, {} found",
                parameters.len()
            ));
        }
        if !parameters.iter().all(|parameter| parameter.is_finite()) {
            return Err(format!("finite parameters expected, {parameters:?} found"));
        }
        // Models have one focal length or two before the centre.
        let has_one = model.starts_with("SIMPLE_") || model.starts_with("RADIAL");
        let ([fx, fy, cx, cy], coefficients) = match *parameters {
            [f, cx, cy, ref rest @ ..] if has_one => ([f, f, cx, cy], rest),
            [fx, fy, cx, cy, ref rest @ ..] => ([fx, fy, cx, cy], rest),
            _ => return Err(format!("parameters of {model} expected")),
        };
        let size = |pixels: u64| u32::try_from(pixels).ok().filter(|pixels| *pixels > 0);
        let (Some(width), Some(height)) = (size(width), size(height)) else {
            return Err(format!("an image size expected, {width}x{height} found"));
        };
        Ok(Self {
            intrinsics: pinhole([fx, fy, cx - 0.5, cy - 0.5], (width, height))?,
            distortion: distortion(model, coefficients)
                .ok_or_else(|| format!("parameters of {model} expected"))?,
        })
    }
}

/// The distortion of a model from its coefficients.
fn distortion(model: &str, coefficients: &[f64]) -> Option<Distortion> {
    let brown = |k1, k2, p1, p2| Distortion::brown([k1, k2, 0.0, 0.0, 0.0, 0.0], [p1, p2]);
    Some(match (model, coefficients) {
        ("SIMPLE_PINHOLE" | "PINHOLE", []) => Distortion::None,
        ("SIMPLE_RADIAL", &[k]) => brown(k, 0.0, 0.0, 0.0),
        ("RADIAL", &[k1, k2]) => brown(k1, k2, 0.0, 0.0),
        ("OPENCV", &[k1, k2, p1, p2]) => brown(k1, k2, p1, p2),
        ("FULL_OPENCV", &[k1, k2, p1, p2, k3, k4, k5, k6]) => {
            Distortion::brown([k1, k2, k3, k4, k5, k6], [p1, p2])
        }
        ("OPENCV_FISHEYE", &[k1, k2, k3, k4]) => Distortion::fisheye([k1, k2, k3, k4]),
        ("SIMPLE_FISHEYE" | "FISHEYE", []) => Distortion::fisheye([0.0; 4]),
        ("SIMPLE_RADIAL_FISHEYE", &[k]) => Distortion::fisheye([k, 0.0, 0.0, 0.0]),
        ("RADIAL_FISHEYE", &[k1, k2]) => Distortion::fisheye([k1, k2, 0.0, 0.0]),
        ("THIN_PRISM_FISHEYE", &[k1, k2, p1, p2, k3, k4, sx, sy]) => Distortion::Fisheye {
            k: [k1, k2, k3, k4, 0.0, 0.0],
            p: [p1, p2],
            s: [sx, 0.0, sy, 0.0],
            after: false,
        },
        ("RAD_TAN_THIN_PRISM_FISHEYE", &[k0, k1, k2, k3, k4, k5, p0, p1, s0, s1, s2, s3]) => {
            Distortion::Fisheye {
                k: [k0, k1, k2, k3, k4, k5],
                // The first is of x².
                p: [p1, p0],
                s: [s0, s1, s2, s3],
                after: true,
            }
        }
        ("FOV", &[omega]) => Distortion::FieldOfView { omega },
        ("SIMPLE_DIVISION" | "DIVISION", &[k]) => Distortion::Division { k },
        ("EUCM", &[alpha, beta]) => Distortion::Unified { alpha, beta },
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;

    /// Where COLMAP 4.2 shows the directions (0.3, −0.2) and (−0.7, 0.5) in photos of 640 × 480 pixels, with pixel
    /// centres at integers.
    #[allow(clippy::type_complexity, reason = "a table of numbers")]
    const SHOWN: [(&str, &[f64], [f64; 2], [f64; 2]); 17] = [
        (
            "SIMPLE_PINHOLE",
            &[500.0, 320.5, 240.5],
            [470.000000000, 140.000000000],
            [-30.000000000, 490.000000000],
        ),
        (
            "PINHOLE",
            &[500.0, 510.0, 320.5, 240.5],
            [470.000000000, 138.000000000],
            [-30.000000000, 495.000000000],
        ),
        (
            "SIMPLE_RADIAL",
            &[500.0, 320.5, 240.5, -0.1],
            [468.050000000, 141.300000000],
            [-4.100000000, 471.500000000],
        ),
        (
            "RADIAL",
            &[500.0, 320.5, 240.5, -0.1, 0.02],
            [468.100700000, 141.266200000],
            [-7.933200000, 474.238000000],
        ),
        (
            "OPENCV",
            &[500.0, 510.0, 320.5, 240.5, -0.1, 0.02, 0.001, -0.002],
            [467.730700000, 139.521024000],
            [-10.003200000, 480.269160000],
        ),
        (
            "OPENCV_FISHEYE",
            &[500.0, 510.0, 320.5, 240.5, -0.02, 0.003, -0.001, 0.0005],
            [463.625396215, 142.334730574],
            [33.684324969, 448.601420380],
        ),
        (
            "FULL_OPENCV",
            &[500.0, 510.0, 320.5, 240.5, -0.1, 0.02, 0.001, -0.002, 0.003, 0.01, -0.02, 0.004],
            [467.588052748, 139.618024131],
            [-11.064006843, 481.042033557],
        ),
        (
            "FOV",
            &[500.0, 510.0, 320.5, 240.5, 0.9],
            [474.942377154, 134.639183535],
            [6.528806300, 468.386155410],
        ),
        (
            "SIMPLE_RADIAL_FISHEYE",
            &[500.0, 320.5, 240.5, -0.02],
            [463.619435412, 144.253709725],
            [33.877399693, 444.373285933],
        ),
        (
            "RADIAL_FISHEYE",
            &[500.0, 320.5, 240.5, -0.02, 0.003],
            [463.625628623, 144.249580918],
            [33.656547130, 444.531037764],
        ),
        (
            "THIN_PRISM_FISHEYE",
            &[
                500.0, 510.0, 320.5, 240.5, -0.02, 0.003, 0.001, -0.002, -0.001, 0.0005, 0.003,
                -0.004,
            ],
            [463.464196340, 142.301845799],
            [33.029611742, 448.490119131],
        ),
        (
            "RAD_TAN_THIN_PRISM_FISHEYE",
            &[
                500.0, 510.0, 320.5, 240.5, -0.02, 0.003, -0.001, 0.0005, 0.0002, -0.0001, 0.001,
                -0.002, 0.003, -0.004, 0.005, -0.006,
            ],
            [464.027887847, 142.342695395],
            [34.979216737, 448.029508705],
        ),
        (
            "SIMPLE_DIVISION",
            &[500.0, 320.5, 240.5, -0.1],
            [468.099109981, 141.267260013],
            [-7.344494468, 473.817496048],
        ),
        (
            "DIVISION",
            &[500.0, 510.0, 320.5, 240.5, -0.1],
            [468.099109981, 139.292605213],
            [-7.344494468, 478.493845969],
        ),
        (
            "SIMPLE_FISHEYE",
            &[500.0, 320.5, 240.5],
            [463.964225351, 144.023849766],
            [30.959975481, 446.457160371],
        ),
        (
            "FISHEYE",
            &[500.0, 510.0, 320.5, 240.5],
            [463.964225351, 142.104326762],
            [30.959975481, 450.586303578],
        ),
        (
            "EUCM",
            &[500.0, 510.0, 320.5, 240.5, 0.6, 1.1],
            [464.027597735, 142.061233540],
            [30.291018491, 451.073686528],
        ),
    ];

    #[test]
    fn each_model_shows_directions_where_colmap_does() {
        for (model, parameters, first, second) in SHOWN {
            let camera = ModelCamera::new(model, (640, 480), parameters).expect("good parameters");
            let Intrinsics { fx, fy, cx, cy, .. } = camera.intrinsics;
            for (direction, shown) in [([0.3, -0.2], first), ([-0.7, 0.5], second)] {
                let direction = Point2::from(direction);
                let seen = camera.distortion.distorted(direction);
                let pixel = Point2::new(fx * seen.x + cx, fy * seen.y + cy);
                assert!((pixel - Point2::from(shown)).norm() < 1e-6, "{model}: {pixel}");
                let back = camera.distortion.direction(seen).expect("in front of the camera");
                assert!((back - direction).norm() < 1e-8, "{model}: {back}");
            }
            let number = MODELS.iter().position(|(name, _)| *name == model).expect("is known");
            assert_eq!(model_of_number(number as u32), Ok((model, parameters.len())));
        }
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        let new = |model, size, parameters: &[f64]| ModelCamera::new(model, size, parameters);
        for (camera, word) in [
            (new("PERSPECTIVE", (6, 4), &[1.0; 5]), "`PERSPECTIVE` found"),
            (new("EQUIRECTANGULAR", (6, 4), &[6.0, 4.0]), "cut panoramas into views"),
            (new("PINHOLE", (6, 4), &[1.0; 3]), "4 parameters"),
            (new("PINHOLE", (0, 4), &[1.0; 4]), "0x4"),
            (new("PINHOLE", (6, 1 << 40), &[1.0; 4]), "an image size"),
            (new("PINHOLE", (6, 4), &[-1.0; 4]), "positive"),
            (new("PINHOLE", (6, 4), &[f64::NAN; 4]), "finite"),
        ] {
            let error = camera.expect_err("is none");
            assert!(error.contains(word), "{error}");
        }
        assert!(model_of_number(18).is_err());
    }
}
