//! The argument of `--camera`, for loose photos.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::super::SceneError;
use super::super::colmap::{ModelCamera, camera_of_line};
use super::super::lens::{Distortion, pinhole};
use super::super::lines::{TextFile, excerpt, numbers};
use crate::camera::Intrinsics;

/// Four numbers, a line of COLMAP's `cameras.txt`, or a `cameras.txt`.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraArgument {
    /// `fx fy cx cy` \[px\], with pixel centres at integers.
    Pinhole([f64; 4]),
    /// `ID MODEL WIDTH HEIGHT PARAMETERS…`, with COLMAP's pixel coordinates.
    Line(String),
    /// A file of such lines.
    File(PathBuf),
}

impl CameraArgument {
    /// The camera of a photo of a size \[px\], with its distortion.
    pub(super) fn of_photo(
        &self,
        photo: &Path,
        (width, height): (u32, u32),
    ) -> Result<ModelCamera, SceneError> {
        let error = |expected: String| SceneError::expected(photo, expected);
        match self {
            Self::Pinhole(camera @ [_, _, cx, cy]) => {
                let is_inside =
                    (0.0..f64::from(width)).contains(cx) && (0.0..f64::from(height)).contains(cy);
                if !is_inside {
                    return Err(error(format!(
                        "a photo of {width}x{height} pixels found, but --camera has its centre at {cx},{cy}; \
                         give fx,fy,cx,cy for this size"
                    )));
                }
                Ok(ModelCamera {
                    intrinsics: pinhole(*camera, (width, height)).map_err(error)?,
                    distortion: Distortion::default(),
                })
            }
            Self::Line(line) => {
                let camera = line_camera(line).map_err(error)?;
                let Intrinsics { width: w, height: h, .. } = camera.intrinsics;
                if (w, h) != (width, height) {
                    return Err(error(format!(
                        "{w}x{h} pixels expected, as in --camera, {width}x{height} found"
                    )));
                }
                Ok(camera)
            }
            Self::File(path) => {
                let file = TextFile::read(path)?;
                let cameras = file
                    .lines()
                    .map(|line| camera_of_line(line).map(|(_, camera)| camera))
                    .collect::<Result<Vec<_>, _>>()?;
                let size = |camera: &ModelCamera| {
                    let Intrinsics { width, height, .. } = camera.intrinsics;
                    (width, height)
                };
                let fitting = cameras.iter().filter(|one| size(one) == (width, height));
                match fitting.collect::<Vec<_>>().as_slice() {
                    [camera, rest @ ..] if rest.iter().all(|other| other == camera) => Ok(**camera),
                    [] => Err(file.error(format!(
                        "a camera for the {width}x{height} pixels of {} expected, none of {} cameras fits",
                        photo.display(),
                        cameras.len()
                    ))),
                    several => Err(file.error(format!(
                        "one camera for {width}x{height} pixels expected, {} found; give one of the lines \
                         as --camera",
                        several.len()
                    ))),
                }
            }
        }
    }
}

fn line_camera(line: &str) -> Result<ModelCamera, String> {
    let text = TextFile::from_text("--camera", line);
    let mut lines = text.lines();
    let camera = lines.next().map(camera_of_line);
    match (camera, lines.next()) {
        (Some(Ok((_, camera))), None) => Ok(camera),
        (Some(Err(SceneError::Line { expected, .. })), None) => Err(expected),
        (Some(Err(error)), None) => Err(error.to_string()),
        _ => Err("one camera line of COLMAP expected".to_owned()),
    }
}

impl FromStr for CameraArgument {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let words = text.split_whitespace().collect::<Vec<_>>();
        let is_line = words.len() > 4
            && words[0].parse::<u32>().is_ok()
            && words[1].starts_with(|c: char| c.is_ascii_uppercase());
        if is_line {
            line_camera(text)?;
            return Ok(Self::Line(text.trim().to_owned()));
        }
        if Path::new(text).is_file() {
            return Ok(Self::File(text.into()));
        }
        let expected = "fx,fy,cx,cy [px], a camera line of COLMAP (`1 PINHOLE 640 480 500 500 320 240`) or \
                        its cameras.txt expected";
        match numbers::<4>(text) {
            Ok([fx, fy, ..]) if fx <= 0.0 || fy <= 0.0 => {
                Err(format!("positive focal lengths expected, {fx} and {fy} found"))
            }
            Ok(pinhole) => Ok(Self::Pinhole(pinhole)),
            Err(why) if text.contains(',') => Err(format!("{expected}; {why}")),
            Err(_) => Err(format!("{expected}; there is no file `{}`", excerpt(text))),
        }
    }
}

impl fmt::Display for CameraArgument {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pinhole([fx, fy, cx, cy]) => write!(f, "{fx},{fy},{cx},{cy}"),
            Self::Line(line) => f.write_str(line),
            Self::File(path) => path.display().fmt(f),
        }
    }
}

posescope_core::serde_as_text!(CameraArgument);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_is_read_in_each_form_and_written_again() {
        let numbers: CameraArgument = "500,510,319.5,239.5".parse().expect("four numbers");
        assert_eq!(numbers, CameraArgument::Pinhole([500.0, 510.0, 319.5, 239.5]));
        let line = "1 SIMPLE_RADIAL 640 480 500 320 240 0.01";
        let radial: CameraArgument = line.parse().expect("a line of COLMAP");
        for camera in [&numbers, &radial] {
            assert_eq!(camera.to_string().parse().as_ref(), Ok(camera));
        }
        // COLMAP's pixels have their centres at halves.
        let camera = radial.of_photo(Path::new("a.png"), (640, 480));
        let ModelCamera { intrinsics: taken, distortion } = camera.expect("its size");
        assert_eq!((taken.fx, taken.cx, taken.cy), (500.0, 319.5, 239.5));
        assert_eq!(distortion.k1, 0.01);
        for (wrong, word) in [
            ("500,500,319.5", "4 numbers expected, 3 found"),
            ("0,500,319.5,200", "positive focal lengths"),
            ("1 FOV 640 480 1 2 3 4 5", "`FOV` found"),
            ("no/cameras.txt", "no file `no/cameras.txt`"),
        ] {
            let said = wrong.parse::<CameraArgument>().expect_err("no camera");
            assert!(said.contains(word), "{said}");
        }
    }

    #[test]
    fn a_camera_for_photos_of_another_size_is_refused() {
        for camera in ["1500,1500,959.5,539.5", "1 SIMPLE_PINHOLE 1920 1080 1500 960 540"] {
            let camera: CameraArgument = camera.parse().expect("a camera");
            let error = camera.of_photo(Path::new("a.png"), (640, 480)).expect_err("too small");
            let said = error.to_string();
            assert!(said.contains("a.png") && said.contains("640x480"), "{said}");
        }
    }
}
