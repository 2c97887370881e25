//! The argument of `--camera`, for loose photos.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::super::SceneError;
use super::super::colmap::{CAMERA_COLUMNS, ModelCamera, camera_of_line};
use posescope_core::files;
use posescope_core::scene::{stem, without_extension};

use super::super::frame_names::agree;
use super::super::lens::{Distortion, pinhole};
use super::super::lines::{Line, TextFile, excerpt, parsed_numbers};
use crate::camera::Intrinsics;

/// Numbers, a line of COLMAP's `cameras.txt`, a `cameras.txt`, or hloc's list of queries with intrinsics.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraArgument {
    /// `fx fy cx cy` \[px\], with pixel centres at integers, and OpenCV's coefficients `k1 k2 p1 p2 k3 k4 k5 k6`.
    Numbers {
        /// `fx fy cx cy`.
        camera: [f64; 4],
        /// None, four, five or eight.
        coefficients: Vec<f64>,
    },
    /// `ID MODEL WIDTH HEIGHT PARAMETERS…`, with COLMAP's pixel coordinates.
    Line(String),
    /// A file of such lines, or of lines that begin with the name of a photo.
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
            Self::Numbers { camera: camera @ [_, _, cx, cy], coefficients } => {
                let is_inside =
                    (0.0..f64::from(width)).contains(cx) && (0.0..f64::from(height)).contains(cy);
                if !is_inside {
                    return Err(error(format!(
                        "a photo of {width}x{height} pixels found, but --camera has its centre at {cx},{cy}; \
                         give fx,fy,cx,cy for this size"
                    )));
                }
                let mut all = [0.0; 8];
                all[..coefficients.len()].copy_from_slice(coefficients);
                let [k1, k2, p1, p2, k3, k4, k5, k6] = all;
                Ok(ModelCamera {
                    intrinsics: pinhole(*camera, (width, height)).map_err(error)?,
                    distortion: Distortion::brown([k1, k2, k3, k4, k5, k6], [p1, p2]),
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
                let file = TextFile::named(path)?;
                file.expect_order(CAMERA_COLUMNS)?;
                let is_id = |line: Line<'_>| {
                    let key = line.text.split_whitespace().next();
                    key.is_some_and(|word| word.parse::<u32>().is_ok())
                };
                if !file.lines().all(is_id) {
                    return of_list(&file, photo, (width, height));
                }
                let cameras = file
                    .lines()
                    .map(|line| camera_of_line(line)?.1)
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

/// The camera of a photo in hloc's list of queries, `NAME MODEL WIDTH HEIGHT PARAMETERS…`. A line is that of the photo
/// if its name is the end of the photo's path, or has the same file name as long as only one line does.
fn of_list(
    file: &TextFile,
    photo: &Path,
    (width, height): (u32, u32),
) -> Result<ModelCamera, SceneError> {
    let wanted = photo.display().to_string().replace('\\', "/");
    let wanted = without_extension(wanted.trim_start_matches("./"));
    let lines = file.lines().map(|line| Ok((line, camera_of_line(line)?)));
    let lines = lines.collect::<Result<Vec<_>, SceneError>>()?;
    let fits = |name: &str| {
        stem(name) == stem(wanted)
            && (agree(wanted, without_extension(name)) || !wanted.contains('/'))
    };
    let mut fitting = lines.into_iter().filter(|(_, (name, _))| fits(name));
    let (Some((line, (_, camera))), None) = (fitting.next(), fitting.next()) else {
        return Err(file.error(format!(
            "one line with the name and the camera of {} expected, none or several found",
            photo.display()
        )));
    };
    let camera = camera?;
    let Intrinsics { width: w, height: h, .. } = camera.intrinsics;
    if (w, h) != (width, height) {
        return Err(line.error(format!(
            "{width}x{height} pixels expected, as {} has, {w}x{h} found",
            photo.display()
        )));
    }
    Ok(camera)
}

fn line_camera(line: &str) -> Result<ModelCamera, String> {
    let text = TextFile::from_text("--camera", line);
    let mut lines = text.lines();
    let camera = lines.next().map(|line| camera_of_line(line)?.1);
    match (camera, lines.next()) {
        (Some(Ok(camera)), None) => Ok(camera),
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
        let path = Path::new(text);
        if path.is_file() || files::is_argument_pipe(path) {
            return Ok(Self::File(text.into()));
        }
        let expected = "fx,fy,cx,cy [px], these with OpenCV's k1,k2,p1,p2 (also k3, or k3,k4,k5,k6), a camera \
                        line of COLMAP (`1 PINHOLE 640 480 500 500 320 240`), its cameras.txt or hloc's list of \
                        queries with intrinsics expected";
        match parsed_numbers(text) {
            Ok(numbers) => match numbers[..] {
                [fx, fy, ..] if fx <= 0.0 || fy <= 0.0 => {
                    Err(format!("positive focal lengths expected, {fx} and {fy} found"))
                }
                // Coefficients are fractions, so whole ones are halves of numbers with decimal commas.
                [_, _, _, _, ref rest @ ..]
                    if !text.contains(['.', 'e', 'E']) && rest.iter().any(|k| *k != 0.0) =>
                {
                    Err("numbers with decimal points expected, whole coefficients found".to_owned())
                }
                [fx, fy, cx, cy, ref rest @ ..] if [0, 4, 5, 8].contains(&rest.len()) => {
                    Ok(Self::Numbers { camera: [fx, fy, cx, cy], coefficients: rest.to_vec() })
                }
                _ => Err(format!("{expected}; {} numbers found", numbers.len())),
            },
            Err(why) if text.contains(',') => Err(format!("{expected}; {why}")),
            Err(_) => Err(format!("{expected}; there is no file `{}`", excerpt(text))),
        }
    }
}

impl fmt::Display for CameraArgument {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Numbers { camera, coefficients } => {
                let numbers = camera.iter().chain(coefficients).map(f64::to_string);
                f.write_str(&numbers.collect::<Vec<_>>().join(","))
            }
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
        let camera = [500.0, 510.0, 319.5, 239.5];
        assert_eq!(numbers, CameraArgument::Numbers { camera, coefficients: Vec::new() });
        let distorted: CameraArgument =
            "500,510,319.5,239.5,0.1,0.2,0.3,0.4,0.5".parse().expect("nine numbers");
        let camera = distorted.of_photo(Path::new("a.png"), (640, 480)).expect("its size");
        let brown = Distortion::brown([0.1, 0.2, 0.5, 0.0, 0.0, 0.0], [0.3, 0.4]);
        assert_eq!(camera.distortion, brown);
        let line = "1 SIMPLE_RADIAL 640 480 500 320 240 0.01";
        let radial: CameraArgument = line.parse().expect("a line of COLMAP");
        for camera in [&numbers, &distorted, &radial] {
            assert_eq!(camera.to_string().parse().as_ref(), Ok(camera));
        }
        // COLMAP's pixels have their centres at halves.
        let camera = radial.of_photo(Path::new("a.png"), (640, 480));
        let ModelCamera { intrinsics: taken, distortion } = camera.expect("its size");
        assert_eq!((taken.fx, taken.cx, taken.cy), (500.0, 319.5, 239.5));
        assert_eq!(distortion, Distortion::brown([0.01, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 2]));
        for (wrong, word) in [
            ("500,500,319.5", "; 3 numbers found"),
            ("500,500,319.5,239.5,0.1", "; 5 numbers found"),
            ("0,500,319.5,200", "positive focal lengths"),
            ("1 PERSPECTIVE 640 480 1 2 3 4 5", "`PERSPECTIVE` found"),
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

    #[test]
    fn a_list_of_queries_gives_each_photo_its_own_camera() {
        let folder = tempfile::TempDir::new().expect("a folder");
        let path = folder.path().join("queries_with_intrinsics.txt");
        let text = "night/b.jpg PINHOLE 640 480 500 500 320 240\n\
                    day/b.jpg SIMPLE_RADIAL 640 480 600 320 240 0.01\nday/c.jpg PINHOLE 64 48 60 60 32 24\n";
        std::fs::write(&path, text).expect("writable");
        let list: CameraArgument = path.display().to_string().parse().expect("a file");
        let focal = |photo: &str| {
            let camera = list.of_photo(Path::new(photo), (640, 480));
            camera.map(|camera| camera.intrinsics.fx).map_err(|error| error.to_string())
        };
        assert_eq!(focal("/data/query/day/b.jpg"), Ok(600.0));
        assert_eq!(focal("night/b.jpg"), Ok(500.0));
        for (photo, words) in [
            ("b.jpg", "none or several"),
            ("dusk/b.jpg", "none or several"),
            ("day/d.jpg", "none or several"),
            ("day/c.jpg", "queries_with_intrinsics.txt:3: 640x480 pixels expected"),
        ] {
            assert!(focal(photo).is_err_and(|error| error.contains(words)), "{photo}");
        }
    }
}
