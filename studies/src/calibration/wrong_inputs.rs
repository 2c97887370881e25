//! Inputs that are wrong, and what `posescope doctor` says of maps of such inputs.

use nalgebra::{Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use posescope::diagnosis::confidence::NEAR;
use posescope::doctor::{self, FramePair};
use posescope::geometry::Pose;
use posescope::scene::{Scene, SceneSize};

use crate::frames::{Frame, Frames};
use crate::numbers::{percentile, print_table};

/// A query and a reference, and what makes their inputs wrong.
type Mistake = (&'static str, fn(&mut Frame, &mut Frame) -> Option<()>);

/// All of them. Where the cloud follows the poses, it is stated in the axes of the world.
const ALL: &[Mistake] = &[
    ("cloud in the axes of a scanner", |_, reference| {
        cloud(reference, |point| Point3::new(point.z, -point.x, -point.y))
    }),
    ("cloud in the axes of OpenGL", |_, reference| {
        cloud(reference, |point| Point3::new(point.x, -point.y, -point.z))
    }),
    ("cloud in the world, stated as the camera's", |_, reference| {
        let pose = reference.pose?;
        cloud(reference, |point| pose * point)
    }),
    ("cloud mirrored", |_, reference| {
        cloud(reference, |point| Point3::new(-point.x, point.y, point.z))
    }),
    ("cloud turned by 5°", |_, reference| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 5_f64.to_radians());
        cloud(reference, |point| turn * point)
    }),
    ("query's camera of another", |query, _| camera(query)),
    ("cameras of another", |query, reference| camera(query).and(camera(reference))),
    ("world's cloud, poses inverse", |query, reference| world(query, reference, Pose::inverse)),
    ("world's cloud, poses in the axes of OpenGL", |query, reference| {
        world(query, reference, |pose| pose * half_turn())
    }),
    ("poses inverse", |query, reference| poses(query, reference, Pose::inverse)),
    ("poses in the axes of OpenGL", |query, reference| {
        poses(query, reference, |pose| pose * half_turn())
    }),
];

/// A pair of frames with each of the mistakes whose name has these words.
pub fn planted(query: &Frame, reference: &Frame, words: &str) -> Vec<(&'static str, Frame, Frame)> {
    let planted = |&(name, plant): &Mistake| {
        let (mut query, mut reference) = (query.clone(), reference.clone());
        plant(&mut query, &mut reference)?;
        Some((name, query, reference))
    };
    ALL.iter().filter(|(name, _)| name.contains(words)).filter_map(planted).collect()
}

/// Half a turn about the axis to the right.
fn half_turn() -> Pose {
    let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    Pose::from_parts(Translation3::identity(), turn.into())
}

fn cloud(frame: &mut Frame, change: impl Fn(Point3<f64>) -> Point3<f64>) -> Option<()> {
    for point in &mut frame.cloud.points {
        *point = change(point.cast()).cast();
    }
    Some(())
}

fn camera(frame: &mut Frame) -> Option<()> {
    let camera = &mut frame.intrinsics;
    let width = f64::from(camera.width);
    (camera.fx, camera.fy) = (0.8 * camera.fx, 0.8 * camera.fy);
    (camera.cx, camera.cy) = (camera.cx + 0.05 * width, camera.cy - 0.015 * width);
    Some(())
}

/// Changes the poses, and leaves the cloud where it is in the camera's frame.
fn poses(query: &mut Frame, reference: &mut Frame, change: impl Fn(&Pose) -> Pose) -> Option<()> {
    for frame in [query, reference] {
        frame.pose = Some(change(&frame.pose?));
    }
    Some(())
}

/// Changes the poses, and leaves the cloud where it is in the world.
fn world(query: &mut Frame, reference: &mut Frame, change: impl Fn(&Pose) -> Pose) -> Option<()> {
    let right = reference.pose?;
    poses(query, reference, change)?;
    let moved = reference.pose?.inverse() * right;
    cloud(reference, |point| moved * point)
}

/// Prints what is said of a map whose frames all have the same mistake, and of the map as it is.
pub fn examine(maps: &[(String, Vec<Frame>)]) {
    let said = |frames: Vec<Frame>| {
        let (found, _) = doctor::fit(&Frames::new("map", frames));
        found.map_or("nothing", |found| found.mistake.about()).to_owned()
    };
    let row = |name: &str, plant: &dyn Fn(&mut Frame)| {
        let of_maps = maps.iter().map(|(_, frames)| {
            let mut frames = frames.clone();
            frames.iter_mut().for_each(plant);
            said(frames)
        });
        [vec![name.to_owned()], of_maps.collect()].concat()
    };
    let mut rows = vec![row("no mistake", &|_| ())];
    for (name, plant) in ALL.iter().filter(|(name, _)| !name.starts_with("query's")) {
        // A frame of the map has the camera and the pose of a query, and the cloud of a reference.
        rows.push(row(name, &|frame| {
            let mut reference = frame.clone();
            if plant(frame, &mut reference).is_some() {
                frame.cloud = reference.cloud;
            }
        }));
    }
    let names: Vec<&str> = maps.iter().map(|(name, _)| name.as_str()).collect();
    print_table(&format!("a map's mistake,{}", names.join(",")), &rows);
}

/// Prints how closely pairs of frames of these maps fit each other.
pub fn compare_pairs(maps: &[(String, Vec<Frame>)], scenes: &[Box<dyn Scene>]) {
    let maps: Vec<(&str, Frames)> = maps
        .iter()
        .map(|(name, frames)| (name.as_str(), Frames::new("map", frames.clone())))
        .collect();
    let maps = maps.iter().map(|(name, map)| (*name, map as &dyn Scene));
    let row = |(name, map): (&str, &dyn Scene)| {
        let scale = SceneSize::of(map).scale;
        let (_, pairs) = doctor::fit(map);
        let near: Vec<_> =
            pairs.iter().filter(|pair| NEAR.at(scale).contains(&pair.error)).collect();
        let of = |value: &dyn Fn(&FramePair) -> f64| {
            let mut all: Vec<f64> = near.iter().map(|pair| value(pair)).collect();
            let quantiles = [0.5, 0.75, 1.0].map(|share| percentile(&mut all, share));
            quantiles.map(|one| format!("{one:.4}")).join(" ")
        };
        vec![
            name.to_owned(),
            scale.metre().to_string(),
            pairs.len().to_string(),
            near.len().to_string(),
            of(&|pair| pair.error.translation_m),
            of(&|pair| pair.error.translation_m / pair.within.translation_m),
            of(&|pair| pair.error.rotation_deg),
            of(&|pair| pair.error.rotation_deg / pair.within.rotation_deg),
        ]
    };
    let scenes = scenes.iter().map(|scene| (scene.name(), scene.as_ref()));
    let rows: Vec<_> = maps.chain(scenes).map(row).collect();
    print_table(
        "pairs of frames,scale,pairs,near,position [m],over noise,rotation [°],over noise",
        &rows,
    );
}
