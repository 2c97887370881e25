//! Other readings of a scene: the meaning of its numbers if a usual mistake was made.

use nalgebra::{Point3, Quaternion, Translation3, UnitQuaternion, Vector3};

use serde::{Deserialize, Serialize};

use super::correction::{Correction, Place};
use crate::camera::Intrinsics;
use crate::diagnosis::{OPENGL_AXES, VEHICLE_AXES, other_axes};
use crate::geometry::Pose;

/// The part of a scene that is not as stated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Subject {
    /// Focal length, centre or distortion.
    Camera,
    /// The poses of frames.
    Poses,
    /// The clouds, or which photos they belong to.
    Clouds,
    /// The unit of lengths.
    Units,
}

/// A usual mistake in writing or reading a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Mistake {
    /// Poses are camera from world, but are read as world from camera.
    InversePose,
    /// Poses use other axes of the camera: those of OpenGL, or of a vehicle.
    PoseAxes,
    /// Clouds use other axes: of a scanner (forward, left, up), of OpenGL (right, up, backwards), or right, forward, up.
    CloudAxes,
    /// The camera parameters belong to another camera.
    WrongCamera,
    /// Clouds or poses are in millimetres or centimetres, or poses in feet.
    Units,
    /// Quaternions are written scalar first and read scalar last, or vice versa.
    QuaternionOrder,
    /// Each cloud belongs to the frame before or after.
    CloudOfNeighbour,
    /// Angles are written in degrees and read as radians, or vice versa.
    Degrees,
    /// Poses and clouds belong to the other camera of a stereo pair.
    OtherStereoCamera,
    /// Clouds are mirrored, or photos are.
    MirroredCloud,
    /// Photos are upside down or lie on their side.
    TurnedPhotos,
    /// Each pose is that of the frame before or after.
    PoseOfNeighbour,
    /// Clouds are turned or shifted.
    MovedCloud,
    /// Poses are in reverse order.
    ReversedPoses,
    /// The photos were undistorted although they had no distortion.
    UndistortedTwice,
}

impl Mistake {
    /// The mistake in a phrase.
    pub fn about(self) -> &'static str {
        match self {
            Self::InversePose => {
                "the poses are inverted: world to camera instead of camera to world"
            }
            Self::PoseAxes => "the poses use other axes of the camera than right, down, forward",
            Self::CloudAxes => "the clouds use other axes than right, down, forward",
            Self::WrongCamera => "the camera parameters are those of another camera",
            Self::Units => "poses and clouds use different units of length",
            Self::QuaternionOrder => "the quaternions have the other order (w first or last)",
            Self::CloudOfNeighbour => "the clouds are one frame off",
            Self::Degrees => "the poses' angles are in degrees but read as radians, or vice versa",
            Self::OtherStereoCamera => {
                "poses and clouds belong to the other camera of a stereo pair"
            }
            Self::MirroredCloud => "the clouds are mirrored, or the photos are",
            Self::TurnedPhotos => "the photos are turned: upside down, or lying on their side",
            Self::PoseOfNeighbour => "the poses are one line off",
            Self::MovedCloud => "the clouds are turned or shifted against the photos",
            Self::ReversedPoses => "the poses are in reverse order",
            Self::UndistortedTwice => {
                "the photos are distorted: undistorted twice, or with the parameters of another lens"
            }
        }
    }
}

impl Mistake {
    /// The part of the scene with the mistake.
    pub fn subject(self) -> Subject {
        match self {
            Self::InversePose
            | Self::PoseAxes
            | Self::QuaternionOrder
            | Self::Degrees
            | Self::PoseOfNeighbour
            | Self::ReversedPoses => Subject::Poses,
            Self::CloudAxes
            | Self::CloudOfNeighbour
            | Self::OtherStereoCamera
            | Self::MirroredCloud
            | Self::MovedCloud => Subject::Clouds,
            Self::WrongCamera | Self::UndistortedTwice | Self::TurnedPhotos => Subject::Camera,
            Self::Units => Subject::Units,
        }
    }
}

/// The remedy for depth images of 1000 for one metre that are read as those of TUM.
pub(super) const READ_WITH_5000: &str = "multiply the coordinates of clouds by 5; if these are depth images that are \
                                         read with 5000 for one metre, 1000 is one metre";

/// A way to read a scene, as if a mistake had been made.
#[derive(Clone, Debug)]
pub(super) struct Reading {
    pub(super) mistake: Mistake,
    /// How to correct it.
    pub(super) remedy: String,
    /// The same as a line to write, where there is one.
    pub(super) correction: Option<Correction>,
    pub(super) change: Change,
}

impl Reading {
    pub(super) fn new(mistake: Mistake, remedy: &str, change: Change) -> Self {
        Self { mistake, remedy: remedy.to_owned(), correction: None, change }
    }

    fn written(self, place: Place, lines: &str) -> Self {
        Self {
            correction: Some(Correction {
                lines: lines.lines().map(str::to_owned).collect(),
                place,
            }),
            ..self
        }
    }

    /// With the value of a metre in depth images.
    pub(super) fn with_depth_per_metre(self, value: &str) -> Self {
        self.written(Place::DepthPerMetre, value)
    }

    /// With the line that a `scene.toml` takes for a unit.
    pub(super) fn with_unit(self, of: &str, unit: &str) -> Self {
        self.written(Place::Description, &format!("unit.{of} = {unit}"))
    }

    /// With the lines that a `scene.toml` takes for a camera.
    pub(super) fn with_camera(self, stated: &Intrinsics) -> Self {
        let (Intrinsics { fx, fy, cx, cy, .. }, _) = self.change.camera(stated);
        let lines = format!("fx = {fx:.2}\nfy = {fy:.2}\ncx = {cx:.2}\ncy = {cy:.2}");
        self.written(Place::Camera, &lines)
    }
}

/// The change to the stated numbers.
#[derive(Clone, Copy, Debug)]
pub(super) enum Change {
    /// None: the scene as stated.
    None,
    /// The pose of each frame.
    Pose(fn(&Pose) -> Pose),
    /// The pose of a frame, from the whole trajectory.
    Poses(fn(usize, &[Option<Pose>]) -> Option<Pose>),
    /// The axes of each pose's camera turned.
    Axes(UnitQuaternion<f64>),
    /// The same, of poses that are inverted.
    InvertedAxes(UnitQuaternion<f64>),
    /// The points of each cloud.
    Points(fn(&Point3<f64>) -> Point3<f64>),
    /// The cloud of the frame at this offset.
    Neighbour(isize),
    /// Poses and clouds shifted along the camera's x axis \[m\].
    Aside(f64),
    /// A scaled focal length and a shifted principal point \[px\].
    Camera { times: f64, right: f64, down: f64 },
    /// Photos so many times as large, and their cameras with them.
    Resized(f64),
    /// Photos upside down.
    UpsideDown,
    /// Photos that a quarter turn clockwise puts upright, or one counter-clockwise.
    OnTheirSide { clockwise: bool },
    /// An additional radial distortion k1.
    Lens(f64),
    /// Clouds so many times as large.
    Size(f64),
    /// Clouds moved in the camera's frame, and a scaled focal length.
    Calibration { camera_from_stated: Pose, times: f64 },
    /// Clouds turned \[°\] about the camera's y, x and z axes, then shifted \[m\] along x, y and z.
    Move([f64; 6]),
}

/// Turns [°] about the y, x and z axes, then shifts along x, y and z.
pub(super) fn pose_of_moves(&[yaw, pitch, roll, x, y, z]: &[f64; 6]) -> Pose {
    let turn = from_angles([yaw, pitch, roll].map(f64::to_radians));
    Pose::from_parts(Translation3::new(x, y, z), turn)
}

impl Change {
    /// Whether it changes where clouds are in their photos, grossly and without a free number.
    pub(super) fn is_of_views(&self) -> bool {
        matches!(
            self,
            Self::Points(_) | Self::Resized(_) | Self::UpsideDown | Self::OnTheirSide { .. }
        )
    }

    /// Whether it has numbers that are chosen such that they fit.
    pub(super) fn has_numbers(&self) -> bool {
        matches!(self, Self::Aside(_) | Self::Camera { .. } | Self::Lens(_) | Self::Move(_))
    }

    /// Whether it changes nothing but poses.
    pub(super) fn is_of_poses(&self) -> bool {
        matches!(
            self,
            Self::None | Self::Pose(_) | Self::Poses(_) | Self::Axes(_) | Self::InvertedAxes(_)
        )
    }

    pub(super) fn pose(&self, frame: usize, poses: &[Option<Pose>]) -> Option<Pose> {
        let stated = || poses.get(frame).copied().flatten();
        match *self {
            Self::Pose(read) => Some(read(&stated()?)),
            Self::Poses(read) => read(frame, poses),
            Self::Axes(turn) => Some(stated()? * turn),
            Self::InvertedAxes(turn) => Some(stated()?.inverse() * turn),
            Self::Aside(right_m) => Some(stated()? * Pose::translation(right_m, 0.0, 0.0)),
            Self::OnTheirSide { clockwise } => Some(stated()? * quarter(clockwise).inverse()),
            _ => stated(),
        }
    }

    pub(super) fn points(&self, points: &[Point3<f64>]) -> Vec<Point3<f64>> {
        let each = |read: &dyn Fn(&Point3<f64>) -> Point3<f64>| points.iter().map(read).collect();
        match *self {
            Self::Points(read) => each(&read),
            Self::Size(times) => each(&|point| point * times),
            Self::Aside(right_m) => each(&|point| point - Vector3::new(right_m, 0.0, 0.0)),
            Self::OnTheirSide { clockwise } => {
                let turn = quarter(clockwise);
                each(&|point| turn * point)
            }
            Self::Calibration { camera_from_stated, .. } => {
                each(&|point| camera_from_stated * point)
            }
            Self::Move(moves) => {
                let moved = pose_of_moves(&moves);
                each(&|point| moved * point)
            }
            _ => points.to_vec(),
        }
    }

    pub(super) fn cloud_of(&self, frame: usize) -> Option<usize> {
        match *self {
            Self::Neighbour(step) => frame.checked_add_signed(step),
            _ => Some(frame),
        }
    }

    /// The camera, and its additional radial distortion k1.
    pub(super) fn camera(&self, stated: &Intrinsics) -> (Intrinsics, f64) {
        match *self {
            Self::Camera { times, right, down } => {
                let camera = Intrinsics {
                    fx: stated.fx * times,
                    fy: stated.fy * times,
                    cx: stated.cx + right,
                    cy: stated.cy + down,
                    ..*stated
                };
                (camera, 0.0)
            }
            Self::Calibration { times, .. } => {
                (Intrinsics { fx: stated.fx * times, fy: stated.fy * times, ..*stated }, 0.0)
            }
            Self::Resized(times) => {
                let centre = |c: f64| (c + 0.5) * times - 0.5;
                let camera = Intrinsics {
                    fx: stated.fx * times,
                    fy: stated.fy * times,
                    cx: centre(stated.cx),
                    cy: centre(stated.cy),
                    ..*stated
                };
                (camera, 0.0)
            }
            Self::UpsideDown => {
                let (width, height) = (f64::from(stated.width), f64::from(stated.height));
                let camera = Intrinsics {
                    fx: -stated.fx,
                    fy: -stated.fy,
                    cx: width - 1.0 - stated.cx,
                    cy: height - 1.0 - stated.cy,
                    ..*stated
                };
                (camera, 0.0)
            }
            Self::OnTheirSide { clockwise } => {
                let Intrinsics { fx, fy, cx, cy, width, height } = *stated;
                // The upright photo is as wide as the one in the file is high.
                let camera = if clockwise {
                    Intrinsics {
                        fx: fy,
                        fy: fx,
                        cx: cy,
                        cy: f64::from(height) - 1.0 - cx,
                        ..*stated
                    }
                } else {
                    Intrinsics {
                        fx: fy,
                        fy: fx,
                        cx: f64::from(width) - 1.0 - cy,
                        cy: cx,
                        ..*stated
                    }
                };
                (camera, 0.0)
            }
            Self::Lens(k1) => (*stated, k1),
            _ => (*stated, 0.0),
        }
    }
}

/// From the camera of an upright photo to that of the photo in a file, which a quarter turn puts upright.
fn quarter(clockwise: bool) -> UnitQuaternion<f64> {
    let angle = if clockwise { -std::f64::consts::FRAC_PI_2 } else { std::f64::consts::FRAC_PI_2 };
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle)
}

/// A foot \[m\].
pub(super) const FOOT_M: f64 = 0.3048;

/// The readings that need no search.
pub(super) fn readings() -> Vec<Reading> {
    use Mistake as M;
    let reading = Reading::new;
    let header = |order: &str| format!("name x y z {order}");
    let [first, last] = ["qw qx qy qz", "qx qy qz qw"].map(header);
    let mut all = vec![
        reading(M::InversePose, "invert each pose", Change::Pose(|pose| pose.inverse()))
            .written(Place::Description, "pose = \"camera_from_world\""),
        reading(
            M::InversePose,
            "invert the rotation of each pose, and leave its position",
            Change::Pose(|pose| Pose::from_parts(pose.translation, pose.rotation.inverse())),
        ),
        reading(
            M::CloudAxes,
            "rotate the axes of each cloud from forward, left, up to right, down, forward",
            Change::Points(|p| Point3::new(-p.y, -p.z, p.x)),
        )
        .written(Place::Clouds, "camera_from_cloud = [0, -1, 0, 0,  0, 0, -1, 0,  1, 0, 0, 0]"),
        reading(
            M::CloudAxes,
            "rotate the axes of each cloud from right, up, backwards, those of OpenGL, to right, down, forward",
            Change::Points(|p| Point3::new(p.x, -p.y, -p.z)),
        )
        .written(Place::Clouds, "camera_from_cloud = [1, 0, 0, 0,  0, -1, 0, 0,  0, 0, -1, 0]"),
        reading(
            M::CloudAxes,
            "rotate the axes of each cloud from right, forward, up to right, down, forward",
            Change::Points(|p| Point3::new(p.x, -p.z, p.y)),
        )
        .written(Place::Clouds, "camera_from_cloud = [1, 0, 0, 0,  0, 0, -1, 0,  0, 1, 0, 0]"),
        reading(M::Units, "divide the coordinates of clouds by 1000", Change::Size(1e-3))
            .with_unit("clouds", "\"mm\""),
        reading(M::Units, "divide the coordinates of clouds by 100", Change::Size(1e-2))
            .with_unit("clouds", "\"cm\""),
        reading(M::Units, "divide the positions of poses by 1000", Change::Size(1e3))
            .with_unit("poses", "\"mm\""),
        reading(M::Units, "divide the positions of poses by 100", Change::Size(1e2))
            .with_unit("poses", "\"cm\""),
        reading(M::Units, "multiply the positions of poses by 0.3048", Change::Size(1.0 / FOOT_M))
            .with_unit("poses", "\"ft\""),
        reading(M::Units, READ_WITH_5000, Change::Size(5.0)).with_depth_per_metre("1000"),
        reading(
            M::WrongCamera,
            "halve the camera parameters, which are those of photos of twice the size",
            Change::Resized(0.5),
        ),
        reading(
            M::WrongCamera,
            "double the camera parameters, which are those of photos of half the size",
            Change::Resized(2.0),
        ),
        reading(
            M::QuaternionOrder,
            "read quaternions as w x y z",
            Change::Pose(|pose| with_rotation(pose, |[x, y, z, w]| [y, z, w, x])),
        )
        .written(Place::PosesHeader, &first),
        reading(
            M::QuaternionOrder,
            "read quaternions as x y z w",
            Change::Pose(|pose| with_rotation(pose, |[x, y, z, w]| [w, x, y, z])),
        )
        .written(Place::PosesHeader, &last),
        reading(
            M::QuaternionOrder,
            "read quaternions as w x y z, world to camera",
            Change::Pose(|pose| {
                with_rotation(&pose.inverse(), |[x, y, z, w]| [y, z, w, x]).inverse()
            }),
        ),
        reading(
            M::QuaternionOrder,
            "read quaternions as x y z w, world to camera",
            Change::Pose(|pose| {
                with_rotation(&pose.inverse(), |[x, y, z, w]| [w, x, y, z]).inverse()
            }),
        ),
        reading(M::CloudOfNeighbour, "use the cloud of the previous frame", Change::Neighbour(-1)),
        reading(M::CloudOfNeighbour, "use the cloud of the next frame", Change::Neighbour(1)),
        reading(
            M::PoseOfNeighbour,
            "give each frame the pose of the next line",
            Change::Poses(|frame, poses| poses.get(frame + 1).copied().flatten()),
        ),
        reading(
            M::PoseOfNeighbour,
            "give each frame the pose of the line before",
            Change::Poses(|frame, poses| poses.get(frame.checked_sub(1)?).copied().flatten()),
        ),
        reading(M::TurnedPhotos, "turn the photos by 180°", Change::UpsideDown)
            .written(Place::Description, "orientation = 180"),
        reading(
            M::TurnedPhotos,
            "turn the photos by 90° clockwise",
            Change::OnTheirSide { clockwise: true },
        )
        .written(Place::Description, "orientation = 90"),
        reading(
            M::TurnedPhotos,
            "turn the photos by 90° counter-clockwise",
            Change::OnTheirSide { clockwise: false },
        )
        .written(Place::Description, "orientation = 270"),
        reading(M::Degrees, "read the angles as degrees", Change::Poses(angles_in_degrees)),
        reading(M::Degrees, "read the angles as radians", Change::Pose(angles_in_radians)),
        reading(
            M::MirroredCloud,
            "negate the sideways axis of the clouds",
            Change::Points(|p| Point3::new(-p.x, p.y, p.z)),
        ),
        reading(
            M::MirroredCloud,
            "negate the vertical axis of the clouds",
            Change::Points(|p| Point3::new(p.x, -p.y, p.z)),
        ),
        reading(
            M::ReversedPoses,
            "reverse the order of the poses",
            Change::Poses(|frame, poses| {
                poses.get(poses.len().checked_sub(frame + 1)?).copied().flatten()
            }),
        ),
    ];
    for (axes, turn) in other_axes() {
        let of = match axes.as_str() {
            OPENGL_AXES => ", those of OpenGL",
            VEHICLE_AXES => ", those of a vehicle (forward, left, up)",
            _ => "",
        };
        let remedy = format!("read the poses with camera axes {axes}{of}");
        let line = match axes.as_str() {
            OPENGL_AXES => "axes = \"opengl\"".to_owned(),
            VEHICLE_AXES => "axes = \"vehicle\"".to_owned(),
            axes => format!("axes = \"{axes}\""),
        };
        all.push(
            reading(M::PoseAxes, &remedy, Change::Axes(turn)).written(Place::Description, &line),
        );
        let remedy = format!("invert each pose, then read it with camera axes {axes}{of}");
        let line = format!("pose = \"camera_from_world\"\n{line}");
        all.push(
            reading(M::PoseAxes, &remedy, Change::InvertedAxes(turn))
                .written(Place::Description, &line),
        );
    }
    all
}

/// The same position, with the quaternion's components reordered.
fn with_rotation(pose: &Pose, order: fn([f64; 4]) -> [f64; 4]) -> Pose {
    let q = pose.rotation.coords;
    let [x, y, z, w] = order([q.x, q.y, q.z, q.w]);
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    Pose::from_parts(pose.translation, rotation)
}

/// Yaw about the camera's y axis, pitch about x, roll about z, in the order usual for vehicles.
fn angles(rotation: &UnitQuaternion<f64>) -> [f64; 3] {
    let m = rotation.to_rotation_matrix();
    // R = Ry(yaw) Rx(pitch) Rz(roll).
    let pitch = (-m[(1, 2)]).clamp(-1.0, 1.0).asin();
    let yaw = m[(0, 2)].atan2(m[(2, 2)]);
    let roll = m[(1, 0)].atan2(m[(1, 1)]);
    [yaw, pitch, roll]
}

fn from_angles([yaw, pitch, roll]: [f64; 3]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), yaw)
        * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), pitch)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll)
}

/// Radians that were read as degrees: all angles are too small.
fn angles_in_radians(pose: &Pose) -> Pose {
    let turned = angles(&pose.rotation).map(f64::to_degrees);
    Pose::from_parts(pose.translation, from_angles(turned))
}

/// Degrees that were read as radians: all angles are too large, and whole turns are lost. They are restored
/// such that the camera looks along its route.
fn angles_in_degrees(frame: usize, poses: &[Option<Pose>]) -> Option<Pose> {
    use std::f64::consts::{PI, TAU};
    /// Lost turns to either side.
    const TURNS: i32 = 29;
    let stated = poses.get(frame).copied().flatten()?;
    let at = |frame: Option<usize>| {
        let pose = poses.get(frame?).copied().flatten()?;
        Some(pose.translation.vector)
    };
    let here = stated.translation.vector;
    // In a bend, the line through both neighbours is the tangent.
    let (next, last) = (at(frame.checked_add(1)), at(frame.checked_sub(1)));
    let way = match (next, last) {
        (None, None) => return None,
        (next, last) => next.unwrap_or(here) - last.unwrap_or(here),
    };
    let heading = way.x.atan2(way.z);
    let [yaw, pitch, roll] = angles(&stated.rotation);
    // Two triples of angles give the same rotation.
    let readings = [[yaw, pitch, roll], [yaw + PI, PI - pitch, roll + PI]];
    let off = |angles: &[f64; 3]| {
        let turn = (angles[0] - heading).rem_euclid(TAU);
        turn.min(TAU - turn) + angles[1].abs() + angles[2].abs()
    };
    let wrapped = |angle: f64| (angle + PI).rem_euclid(TAU) - PI;
    let read = readings
        .into_iter()
        .flat_map(|[yaw, pitch, roll]| {
            (-TURNS..=TURNS).map(move |turns| {
                [
                    (yaw + f64::from(turns) * TAU).to_radians(),
                    wrapped(pitch).to_radians(),
                    wrapped(roll).to_radians(),
                ]
            })
        })
        .min_by(|a, b| off(a).total_cmp(&off(b)))?;
    Some(Pose::from_parts(stated.translation, from_angles(read)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_that_were_taken_for_the_other_unit_are_found_again() {
        let true_poses: Vec<Pose> = (0..20)
            .map(|step| {
                let yaw = 0.1 * f64::from(step) - 0.7;
                let position = Translation3::new(10.0 * yaw.sin(), 0.0, 10.0 * yaw.cos());
                // It looks where it goes, a little down and to the side.
                let way = yaw + std::f64::consts::FRAC_PI_2;
                Pose::from_parts(position, from_angles([way + 0.01, 0.02, -0.01]))
            })
            .collect();
        let damaged = |by: f64| -> Vec<Option<Pose>> {
            let read = |pose: &Pose| {
                let angles = angles(&pose.rotation).map(|angle| angle * by);
                Pose::from_parts(pose.translation, from_angles(angles))
            };
            true_poses.iter().map(|pose| Some(read(pose))).collect()
        };
        let degrees = damaged(1_f64.to_degrees());
        let radians = damaged(1_f64.to_radians());
        // At the ends the way is that of one neighbour, which this bend makes ambiguous.
        let inside = true_poses.iter().enumerate().take(19).skip(1);
        for (frame, pose) in inside {
            let read = angles_in_degrees(frame, &degrees).expect("it moves");
            assert!(read.rotation.angle_to(&pose.rotation) < 1e-9, "{frame}");
            let read = angles_in_radians(&radians[frame].expect("known"));
            assert!(read.rotation.angle_to(&pose.rotation) < 1e-9, "{frame}");
        }
    }
}
