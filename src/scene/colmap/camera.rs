//! COLMAP's camera models.

use super::super::lens::{Distortion, pinhole};
use crate::camera::Intrinsics;

/// A camera of a model, with its distortion. Pixel centres are at integers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct ModelCamera {
    pub intrinsics: Intrinsics,
    pub distortion: Distortion,
}

/// The supported models with their number of parameters. The index is the model's number in binary files.
const MODELS: [(&str, usize); 5] =
    [("SIMPLE_PINHOLE", 3), ("PINHOLE", 4), ("SIMPLE_RADIAL", 4), ("RADIAL", 5), ("OPENCV", 8)];

/// The name of a model and its number of parameters.
pub(super) fn model_of_number(number: u32) -> Result<(&'static str, usize), String> {
    let model = usize::try_from(number).ok().and_then(|n| MODELS.get(n));
    model.copied().ok_or_else(|| format!("{} expected, model number {number} found", known()))
}

fn known() -> String {
    format!("one of {}", MODELS.map(|(name, _)| name).join(", "))
}

impl ModelCamera {
    /// The camera of a model from its parameters, in COLMAP's order.
    pub fn new(
        model: &str,
        (width, height): (u64, u64),
        parameters: &[f64],
    ) -> Result<Self, String> {
        let (_, count) = MODELS.iter().find(|(name, _)| *name == model).ok_or_else(|| {
            format!("{} expected, `{model}` found; `colmap image_undistorter` converts it", known())
        })?;
        if parameters.len() != *count {
            return Err(format!(
                "{count} parameters of {model} expected, {} found",
                parameters.len()
            ));
        }
        let (fx, fy, cx, cy, distortion): (f64, f64, f64, f64, [f64; 4]) = match *parameters {
            [f, cx, cy] => (f, f, cx, cy, [0.0; 4]),
            [f, cx, cy, k] if model == "SIMPLE_RADIAL" => (f, f, cx, cy, [k, 0.0, 0.0, 0.0]),
            [fx, fy, cx, cy] => (fx, fy, cx, cy, [0.0; 4]),
            [f, cx, cy, k1, k2] => (f, f, cx, cy, [k1, k2, 0.0, 0.0]),
            [fx, fy, cx, cy, k1, k2, p1, p2] => (fx, fy, cx, cy, [k1, k2, p1, p2]),
            _ => return Err(format!("parameters of {model} expected")),
        };
        if !parameters.iter().all(|parameter| parameter.is_finite()) {
            return Err(format!("finite parameters expected, {parameters:?} found"));
        }
        let size = |pixels: u64| u32::try_from(pixels).ok().filter(|pixels| *pixels > 0);
        let (Some(width), Some(height)) = (size(width), size(height)) else {
            return Err(format!("an image size expected, {width}x{height} found"));
        };
        let [k1, k2, p1, p2] = distortion;
        Ok(Self {
            intrinsics: pinhole([fx, fy, cx - 0.5, cy - 0.5], (width, height))?,
            distortion: Distortion { k1, k2, p1, p2 },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_models_order_their_parameters_as_colmap_does() {
        let parameters = [10.0, 20.0, 30.0, 40.0, 0.1, 0.2, 0.3, 0.4];
        for (model, focal, center, distortion) in [
            ("SIMPLE_PINHOLE", (10.0, 10.0), (20.0, 30.0), [0.0; 4]),
            ("PINHOLE", (10.0, 20.0), (30.0, 40.0), [0.0; 4]),
            ("SIMPLE_RADIAL", (10.0, 10.0), (20.0, 30.0), [40.0, 0.0, 0.0, 0.0]),
            ("RADIAL", (10.0, 10.0), (20.0, 30.0), [40.0, 0.1, 0.0, 0.0]),
            ("OPENCV", (10.0, 20.0), (30.0, 40.0), [0.1, 0.2, 0.3, 0.4]),
        ] {
            let number = MODELS.iter().position(|(name, _)| *name == model);
            let number = number.expect("is one of them") as u32;
            let (name, count) = model_of_number(number).expect("is one of them");
            assert_eq!(name, model);
            let camera = ModelCamera::new(model, (64, 48), &parameters[..count]);
            let camera = camera.expect("good parameters");
            let Intrinsics { fx, fy, cx, cy, .. } = camera.intrinsics;
            assert_eq!((fx, fy), focal);
            assert_eq!((cx + 0.5, cy + 0.5), center);
            let Distortion { k1, k2, p1, p2 } = camera.distortion;
            assert_eq!([k1, k2, p1, p2], distortion);
        }
    }

    #[test]
    fn what_is_no_camera_is_refused() {
        let new = |model, size, parameters: &[f64]| ModelCamera::new(model, size, parameters);
        for (camera, word) in [
            (new("FOV", (6, 4), &[1.0; 5]), "`FOV` found"),
            (new("PINHOLE", (6, 4), &[1.0; 3]), "4 parameters"),
            (new("PINHOLE", (0, 4), &[1.0; 4]), "0x4"),
            (new("PINHOLE", (6, 1 << 40), &[1.0; 4]), "an image size"),
            (new("PINHOLE", (6, 4), &[-1.0; 4]), "positive"),
            (new("PINHOLE", (6, 4), &[f64::NAN; 4]), "finite"),
        ] {
            let error = camera.expect_err("is none");
            assert!(error.contains(word), "{error}");
        }
        assert!(model_of_number(5).is_err());
    }
}
