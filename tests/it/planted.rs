//! A scene with one of the usual mistakes in it.

use std::ops::Range;

use nalgebra::{Matrix3, Point3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use posescope::camera::Intrinsics;
use posescope::cloud::Cloud;
use posescope::doctor::Mistake;
use posescope::geometry::Pose;
use posescope::image::{GrayImage, Photo};
use posescope::scene::{Scene, SceneError};

/// What is planted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    Nothing,
    InversePose,
    InverseRotation,
    PoseAxes,
    OpenGlAxes,
    PoseOneLineOff,
    CloudAxes,
    OpenGlClouds,
    UprightClouds,
    FiveTimesTheDepth,
    UpsideDown,
    OnTheirSide,
    WrongCamera,
    ResizedPhotos,
    ThreeQuarterPhotos,
    FootPoses,
    MillimetrePoses,
    MillimetreClouds,
    CentimetreClouds,
    QuaternionOrder,
    HalfPixel,
    CloudOneFrameOff,
    DepthsOfNoise,
    DegreesForRadians,
    RadiansForDegrees,
    LeftForRight,
    MirroredCloud,
    TurnedCloud,
    LoweredCloud,
    ReversedPoses,
    UndistortedTwice,
}

/// What each fault is to be called; half a pixel is less than clouds and photos agree by.
pub const FAULTS: [(Fault, Option<Mistake>); 29] = [
    (Fault::Nothing, None),
    (Fault::InversePose, Some(Mistake::InversePose)),
    (Fault::InverseRotation, Some(Mistake::InversePose)),
    (Fault::PoseAxes, Some(Mistake::PoseAxes)),
    (Fault::OpenGlAxes, Some(Mistake::PoseAxes)),
    (Fault::CloudAxes, Some(Mistake::CloudAxes)),
    (Fault::OpenGlClouds, Some(Mistake::CloudAxes)),
    (Fault::UprightClouds, Some(Mistake::CloudAxes)),
    (Fault::FiveTimesTheDepth, Some(Mistake::Units)),
    (Fault::UpsideDown, Some(Mistake::TurnedPhotos)),
    (Fault::OnTheirSide, Some(Mistake::TurnedPhotos)),
    (Fault::WrongCamera, Some(Mistake::WrongCamera)),
    (Fault::ResizedPhotos, Some(Mistake::WrongCamera)),
    (Fault::ThreeQuarterPhotos, Some(Mistake::WrongCamera)),
    (Fault::FootPoses, Some(Mistake::Units)),
    (Fault::MillimetrePoses, Some(Mistake::Units)),
    (Fault::MillimetreClouds, Some(Mistake::Units)),
    (Fault::CentimetreClouds, Some(Mistake::Units)),
    (Fault::QuaternionOrder, Some(Mistake::QuaternionOrder)),
    (Fault::HalfPixel, None),
    (Fault::CloudOneFrameOff, Some(Mistake::CloudOfNeighbour)),
    (Fault::DegreesForRadians, Some(Mistake::Degrees)),
    (Fault::RadiansForDegrees, Some(Mistake::Degrees)),
    (Fault::LeftForRight, Some(Mistake::OtherStereoCamera)),
    (Fault::MirroredCloud, Some(Mistake::MirroredCloud)),
    (Fault::TurnedCloud, Some(Mistake::MovedCloud)),
    (Fault::LoweredCloud, Some(Mistake::MovedCloud)),
    (Fault::ReversedPoses, Some(Mistake::ReversedPoses)),
    (Fault::UndistortedTwice, Some(Mistake::UndistortedTwice)),
];

/// Some frames of a scene, with a mistake in what it says of them.
pub struct Planted<'a> {
    scene: &'a dyn Scene,
    fault: Fault,
    /// The frames of the scene.
    at: Vec<usize>,
    names: Vec<String>,
}

impl<'a> Planted<'a> {
    /// Every `step`th frame alone.
    pub fn every(scene: &'a dyn Scene, fault: Fault, frames: Range<usize>, step: usize) -> Self {
        let at: Vec<usize> = frames.step_by(step).collect();
        let names = at.iter().map(|&frame| scene.frames()[frame].clone()).collect();
        Self { scene, fault, at, names }
    }

    /// The pose without the mistake.
    pub fn true_pose(&self, frame: usize) -> Option<Pose> {
        self.scene.pose(self.at[frame])
    }
}

/// The pose with its position so many times as far from the origin.
fn larger(pose: &Pose, times: f64) -> Pose {
    Pose::from_parts(Translation3::from(pose.translation.vector * times), pose.rotation)
}

/// From x right, y down, z forward to x forward, y left, z up.
fn flu_from_rdf() -> Pose {
    let turn = Matrix3::new(0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0);
    let turn = Rotation3::from_matrix_unchecked(turn);
    Pose::from_parts(Translation3::identity(), UnitQuaternion::from_rotation_matrix(&turn))
}

/// The other camera of the pair is so far to the right \[m\].
const BASELINE_M: f64 = 0.54;

/// The pose whose yaw, pitch and roll are those of another, times a factor.
fn with_angles_times(pose: &Pose, factor: f64) -> Pose {
    let m = pose.rotation.to_rotation_matrix();
    let pitch = (-m[(1, 2)]).asin();
    let (yaw, roll) = (m[(0, 2)].atan2(m[(2, 2)]), m[(1, 0)].atan2(m[(1, 1)]));
    let rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw * factor)
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), pitch * factor)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll * factor);
    Pose::from_parts(pose.translation, rotation)
}

/// The photo as it would be if the distortion of another lens were taken out of it.
fn bent(photo: &GrayImage, camera: &Intrinsics, k1: f64) -> GrayImage {
    let (width, height) = photo.dimensions();
    GrayImage::from_fn(width, height, |x, y| {
        let (u, v) =
            ((f64::from(x) - camera.cx) / camera.fx, (f64::from(y) - camera.cy) / camera.fy);
        let times = 1.0 + k1 * (u * u + v * v);
        let from_x = (camera.fx * u * times + camera.cx).round();
        let from_y = (camera.fy * v * times + camera.cy).round();
        let is_inside = from_x >= 0.0
            && from_y >= 0.0
            && from_x < f64::from(width)
            && from_y < f64::from(height);
        if is_inside { *photo.get_pixel(from_x as u32, from_y as u32) } else { image::Luma([0]) }
    })
}

impl Scene for Planted<'_> {
    fn name(&self) -> &str {
        self.scene.name()
    }

    fn frames(&self) -> &[String] {
        &self.names
    }

    fn intrinsics(&self, frame: usize) -> Intrinsics {
        let camera = self.scene.intrinsics(self.at[frame]);
        match self.fault {
            Fault::WrongCamera => Intrinsics {
                fx: camera.fx * 1.17,
                fy: camera.fy * 1.17,
                cx: camera.cx + 18.0,
                ..camera
            },
            Fault::ResizedPhotos => Intrinsics {
                fx: camera.fx * 2.0,
                fy: camera.fy * 2.0,
                cx: camera.cx * 2.0 + 0.5,
                cy: camera.cy * 2.0 + 0.5,
                ..camera
            },
            Fault::ThreeQuarterPhotos => {
                let of_larger = |c: f64| (c + 0.5) / 0.75 - 0.5;
                Intrinsics {
                    fx: camera.fx / 0.75,
                    fy: camera.fy / 0.75,
                    cx: of_larger(camera.cx),
                    cy: of_larger(camera.cy),
                    ..camera
                }
            }
            Fault::OnTheirSide => {
                Intrinsics { width: camera.height, height: camera.width, ..camera }
            }
            Fault::HalfPixel => Intrinsics { cx: camera.cx + 0.5, cy: camera.cy + 0.5, ..camera },
            _ => camera,
        }
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        let pose = self.true_pose(frame)?;
        Some(match self.fault {
            Fault::InversePose => pose.inverse(),
            Fault::PoseAxes => pose * flu_from_rdf().inverse(),
            Fault::OpenGlAxes => {
                pose * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
            }
            Fault::PoseOneLineOff => self.true_pose(frame.saturating_sub(1))?,
            Fault::InverseRotation => Pose::from_parts(pose.translation, pose.rotation.inverse()),
            Fault::FootPoses => larger(&pose, 1.0 / 0.3048),
            Fault::MillimetrePoses => larger(&pose, 1000.0),
            Fault::QuaternionOrder => {
                let q = pose.rotation.coords;
                let read = Quaternion::new(q.z, q.w, q.x, q.y);
                Pose::from_parts(pose.translation, UnitQuaternion::from_quaternion(read))
            }
            Fault::DegreesForRadians => with_angles_times(&pose, 1_f64.to_degrees()),
            Fault::RadiansForDegrees => with_angles_times(&pose, 1_f64.to_radians()),
            Fault::LeftForRight => pose * Pose::translation(-BASELINE_M, 0.0, 0.0),
            Fault::ReversedPoses => self.true_pose(self.names.len() - 1 - frame)?,
            _ => pose,
        })
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        self.scene.time_s(self.at[frame])
    }

    fn has_cloud(&self, frame: usize) -> bool {
        self.scene.has_cloud(self.at[frame])
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        let photo = self.scene.photo(self.at[frame])?;
        Ok(match self.fault {
            Fault::UpsideDown => Photo::from_gray(image::imageops::rotate180(&photo.gray)),
            Fault::OnTheirSide => Photo::from_gray(image::imageops::rotate270(&photo.gray)),
            Fault::UndistortedTwice => {
                let camera = self.scene.intrinsics(self.at[frame]);
                Photo::from_gray(bent(&photo.gray, &camera, -0.25))
            }
            _ => photo,
        })
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        let of = match self.fault {
            Fault::CloudOneFrameOff => self.at[(frame + 1).min(self.at.len() - 1)],
            _ => self.at[frame],
        };
        let cloud = self.scene.cloud(of)?;
        let moved = |change: &dyn Fn(&Point3<f32>) -> Point3<f32>| Cloud {
            points: cloud.points.iter().map(change).collect(),
        };
        Ok(match self.fault {
            Fault::CloudAxes => moved(&|p| Point3::new(p.z, -p.x, -p.y)),
            Fault::OpenGlClouds => moved(&|p| Point3::new(p.x, -p.y, -p.z)),
            Fault::UprightClouds => moved(&|p| Point3::new(p.x, p.z, -p.y)),
            Fault::MillimetreClouds => moved(&|p| p * 1000.0),
            Fault::DepthsOfNoise => {
                let noise = |p: &Point3<f32>| 0.2 + 5.0 * (p.x * 91.7 + p.y * 37.3).sin().abs();
                moved(&|p| p * noise(p))
            }
            Fault::FiveTimesTheDepth => moved(&|p| p * 5.0),
            Fault::CentimetreClouds => moved(&|p| p * 100.0),
            Fault::LeftForRight => moved(&|p| Point3::new(p.x + BASELINE_M as f32, p.y, p.z)),
            Fault::MirroredCloud => moved(&|p| Point3::new(-p.x, p.y, p.z)),
            Fault::TurnedCloud => {
                let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), 4_f32.to_radians());
                moved(&|p| turn * p)
            }
            Fault::LoweredCloud => moved(&|p| Point3::new(p.x, p.y + 1.0, p.z)),
            _ => cloud,
        })
    }
}
