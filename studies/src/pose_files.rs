use std::collections::BTreeMap;

use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};
use posescope::diagnosis::{Code, Tolerance};
use posescope::foreign::Foreign;
use posescope::geometry::{Pose, PoseError};
use posescope::localize::{LocalizeError, Localizer, NoObserver, QueryResult, Request};
use posescope::measure::{Finding, Overview};
use posescope::method::Method;
use posescope::params::Params;
use posescope::scene::street::{Condition, Size, Traversal, WORLD_SEED};
use posescope::scene::{self, Scene, SceneSize};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde_json::Value;

use crate::Failure;
use crate::frames::{Frame, Frames};
use crate::numbers::{at_places, percent, print_table};

/// Are mistakes of a whole file of poses found, without the truth?
///
/// The poses of a simulated system (the true ones with noise, one in ten wild) get each mistake in turn. All files are
/// judged as `eval` judges them. Prints a row per mistake and set: what was planted and what was found.
#[derive(clap::Args)]
pub struct Options {
    /// The towns.
    #[arg(long, value_delimiter = ',')]
    towns: Vec<u64>,
    /// Scenes of which all frames are queries, in their order.
    #[arg(long)]
    scene: Vec<String>,
    /// Queries of a town, and the most of a scene.
    #[arg(long, default_value_t = 64)]
    queries: usize,
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// The queries of a set, in their order, each with its reference.
struct Set {
    name: String,
    pairs: Vec<(Frame, Frame)>,
    params: Params,
    radius_m: f64,
}

/// What is done to the poses of a file: a name, and what a finding must say.
struct Planted {
    name: &'static str,
    poses: Vec<Option<Pose>>,
    /// What was planted, in words.
    size: String,
    is_named: Box<dyn Fn(&Finding) -> bool + Sync>,
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let mut sets: Vec<Set> = options.towns.iter().map(|town| of_town(*town, options)).collect();
    for argument in &options.scene {
        let scene = scene::open(argument, None)?;
        sets.push(of_scene(scene.as_ref(), options.queries)?);
    }
    let mut rows = Vec::new();
    for (number, set) in sets.iter().enumerate() {
        rows.extend(judged(set, options.seed.wrapping_add(number as u64))?);
    }
    print_table("set,planted,size,right,found", &rows);
    let counted: Vec<&Vec<String>> = rows.iter().filter(|row| row[1] != "nothing").collect();
    let named = counted.iter().filter(|row| row[3] == "named").count();
    let among = counted.iter().filter(|row| row[3] == "second").count();
    println!(
        "\nNamed: {named} of {} ({:.0} %), second: {among}",
        counted.len(),
        percent(named, counted.len())
    );
    Ok(())
}

/// A part of a drive by day, at a speed that changes.
fn of_town(town: u64, options: &Options) -> Set {
    let drive = Traversal::new(WORLD_SEED + town, Condition::Overcast, Size::Full);
    let mut rng = Pcg64::seed_from_u64(options.seed.wrapping_mul(7919).wrapping_add(town));
    let frames = drive.frame_count();
    let mut at = rng.random_range(0..frames);
    let mut pairs = Vec::new();
    for query in 0..options.queries {
        at = (at + 2 + (2.0 * (query as f64 / 6.0).sin()).round().max(-1.0) as usize) % frames;
        let reference = (at + rng.random_range(3..8)) % frames;
        pairs.push((Frame::of(&drive, at), Frame::of(&drive, reference)));
    }
    Set { name: format!("town {town}"), pairs, params: Params::default(), radius_m: 12.0 }
}

/// The frames of a scene, each with the nearest other frame that looks the same way.
fn of_scene(scene: &dyn Scene, most: usize) -> Result<Set, Failure> {
    let scale = SceneSize::of(scene).scale;
    let frames: Vec<usize> =
        (0..scene.frames().len()).filter(|&frame| scene.pose(frame).is_some()).collect();
    let mut pairs = Vec::new();
    for &query in frames.iter().take(most) {
        let Some(pose) = scene.pose(query) else { continue };
        let apart = |frame: usize| {
            let error = PoseError::between(&pose, &scene.pose(frame)?);
            (error.rotation_deg <= 30.0).then_some(error.translation_m)
        };
        let others = frames.iter().filter(|frame| **frame != query && scene.has_cloud(**frame));
        let nearest = others
            .filter_map(|&frame| Some((frame, apart(frame)?)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((reference, _)) = nearest {
            pairs.push((Frame::read(scene, query)?, Frame::read(scene, reference)?));
        }
    }
    let params = Params::at_scale(scale);
    Ok(Set { name: scene.name().to_owned(), pairs, params, radius_m: scale.radius() })
}

/// A row for each file.
fn judged(set: &Set, seed: u64) -> Result<Vec<Vec<String>>, Failure> {
    let planted = planted(set, seed)?;
    let methods: Vec<Method> = (0..planted.len())
        .map(|number| Method::called(&format!("file{number}")))
        .collect::<Result<_, _>>()?;
    let query_name = |at: usize| format!("query {at}");
    let mut foreign = Foreign::default();
    for (file, method) in planted.iter().zip(&methods) {
        let poses = file.poses.iter().enumerate();
        let poses = poses.filter_map(|(at, pose)| Some((query_name(at), (*pose)?)));
        foreign = foreign.with_estimates(*method, poses.collect());
    }
    let queries = set.pairs.iter().map(|(query, _)| Frame { pose: None, ..query.clone() });
    let queries = Frames::new("query", queries.collect());
    let references = set.pairs.iter().map(|(_, reference)| reference.clone());
    let references = Frames::new("reference", references.collect());
    let localizer = Localizer::new(&references, &queries, &set.params, 0)
        .with_tolerance(Tolerance::default().at(set.params.scale))
        .with_foreign(foreign);
    let results = at_places(set.pairs.len(), |at| {
        let request = Request {
            radius_m: set.radius_m,
            references: vec![at].into(),
            fusions: Vec::new(),
            setting: None,
        };
        let mut results = Vec::new();
        localizer.localize(at, at, &[request], &methods, &mut NoObserver, |result, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        })?;
        Ok(results)
    })?;
    let mut by_method: BTreeMap<Method, Vec<QueryResult>> = BTreeMap::new();
    for result in results.into_iter().flatten() {
        by_method.entry(result.method).or_default().push(result);
    }
    let row = |(file, method): (Planted, Method)| {
        let rows: Vec<&QueryResult> = by_method[&method].iter().collect();
        let findings = Overview::of(&rows, &[]).findings;
        let said = findings.first();
        let right = match said {
            None if file.name == "nothing" => "silent",
            None => "not named",
            Some(found) if (file.is_named)(found) => "named",
            // The second explanation counts apart.
            Some(found) if (file.is_named)(&second(found)) => "second",
            Some(_) => "WRONG",
        };
        let text = said.map(|found| found.text.clone()).unwrap_or_default();
        vec![set.name.clone(), file.name.to_owned(), file.size, right.to_owned(), text]
    };
    Ok(planted.into_iter().zip(methods).map(row).collect())
}

/// The finding as if its second explanation were the first.
fn second(found: &Finding) -> Finding {
    let evidence = serde_json::json!({ "mistake": found.evidence["or"] });
    Finding { evidence, ..found.clone() }
}

/// Whether a number is within a tenth of another.
fn is_close(found: f64, planted: f64) -> bool {
    (found - planted).abs() <= 0.1 * planted.abs()
}

fn numbers(value: &Value) -> Vec3 {
    let part = |at: usize| value.get(at).and_then(Value::as_f64).unwrap_or(f64::NAN);
    Vector3::new(part(0), part(1), part(2))
}

type Vec3 = Vector3<f64>;

/// The files of a set: sixteen mistakes, and a good one.
fn planted(set: &Set, seed: u64) -> Result<Vec<Planted>, Failure> {
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_add(99));
    let metre = set.params.scale.metre();
    let mut some = |most: f64| -> Vec3 { Vector3::from_fn(|_, _| rng.random_range(-most..most)) };
    let mut poses = Vec::new();
    for (at, (query, _)) in set.pairs.iter().enumerate() {
        let truth = query.pose.ok_or("a query with a pose expected")?;
        let (metres, degrees) = if at % 10 == 7 { (6.0, 30.0_f64) } else { (0.08, 0.25) };
        let turn = UnitQuaternion::from_scaled_axis(some(degrees.to_radians()));
        poses.push(truth * Pose::from_parts((metre * some(metres)).into(), turn));
    }
    let of_each = |meant: &dyn Fn(&Pose) -> Pose| -> Vec<Option<Pose>> {
        poses.iter().map(|pose| Some(meant(pose))).collect()
    };
    let turned = |axis: Vec3, degrees: f64| {
        UnitQuaternion::from_scaled_axis(axis.normalize() * degrees.to_radians())
    };
    let reading = |name: &'static str| -> Box<dyn Fn(&Finding) -> bool + Sync> {
        // Of each pose alone, or of all that are compared.
        Box::new(move |found| {
            [&found.evidence["reading"], &found.evidence["mistake"]["reading"]]
                .contains(&&Value::from(name))
        })
    };
    let (half_x, quarter_x) = (turned(Vector3::x(), 180.0), turned(Vector3::x(), 90.0));
    let misread = |pose: &Pose| {
        let q = pose.rotation.into_inner().coords;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q.z, q.w, q.x, q.y));
        Pose::from_parts(pose.translation, rotation)
    };
    let scaled = |pose: &Pose, by: f64| {
        Pose::from_parts(Translation3::from(by * pose.translation.vector), pose.rotation)
    };
    let arm = metre * some(1.0).normalize() * (0.4 + some(0.5).x.abs() * 3.0);
    let turn = turned(some(1.0), 2.5 + some(0.5).x.abs() * 12.0);
    let both = Pose::from_parts((0.7 * arm).into(), turn);
    let lines = 1 + (some(0.5).x.abs() * 10.0) as i64;
    let late = 0.3 + some(0.5).x.abs() * 4.0;
    let drift = 0.01 + some(0.5).x.abs() * 0.04;
    let aside = some(1.0).normalize();
    let world = Pose::from_parts((metre * some(6.0)).into(), turned(some(1.0), 4.0));
    let at_place = |place: f64| -> Option<Pose> {
        let before = place.floor();
        let from = poses.get((before >= 0.0).then_some(before as usize)?)?;
        let to = poses.get(before as usize + 1)?;
        let share = place - before;
        let at = from.translation.vector.lerp(&to.translation.vector, share);
        let rotation = from.rotation.try_slerp(&to.rotation, share, 1e-12)?;
        Some(Pose::from_parts(at.into(), rotation))
    };
    let mut way = 0.0;
    let mut drifted = Vec::new();
    for (at, pose) in poses.iter().enumerate() {
        let truth = |at: usize| set.pairs[at].0.pose.map(|pose| pose.translation.vector);
        let step = at.checked_sub(1).and_then(|before| Some((truth(at)? - truth(before)?).norm()));
        way += step.unwrap_or(0.0);
        let off = Translation3::from(pose.translation.vector + drift * way * aside);
        drifted.push(Some(Pose::from_parts(off, pose.rotation)));
    }
    let camera = |key: &'static str, planted: Vec3| -> Box<dyn Fn(&Finding) -> bool + Sync> {
        Box::new(move |found| {
            let seen = numbers(&found.evidence["mistake"]["camera"][key]);
            (seen - planted).norm() <= 0.1 * planted.norm()
        })
    };
    let is_camera: fn(&Finding) -> bool = |found| found.evidence["mistake"]["camera"].is_object();
    let of_world = |scale: f64| -> Box<dyn Fn(&Finding) -> bool + Sync> {
        Box::new(move |found| {
            let world = &found.evidence["mistake"]["world"];
            let is = |key: &str, planted: f64| {
                world[key].as_f64().is_some_and(|seen| is_close(seen, planted))
            };
            is("scale", scale) && is("turn_deg", 4.0)
        })
    };
    let by_fb2 = |longer: f64, centre: f64| -> Result<Vec<Option<Pose>>, Failure> {
        at_places(set.pairs.len(), |at| with_camera(set, at, longer, centre))
    };
    let turn_deg = turn.scaled_axis().map(f64::to_degrees);
    let file = |name, size: String, poses, is_named| Planted { name, poses, size, is_named };
    let lines_back = (0..poses.len() as i64).map(|at| {
        let from = usize::try_from(at - lines).ok()?;
        poses.get(from).copied()
    });
    let is_lines: Box<dyn Fn(&Finding) -> bool + Sync> =
        Box::new(move |found| found.evidence["mistake"]["lines"] == lines);
    let is_late: Box<dyn Fn(&Finding) -> bool + Sync> = Box::new(move |found| {
        let seen = found.evidence["mistake"]["delay_queries"].as_f64();
        seen.is_some_and(|seen| is_close(seen, late))
    });
    let is_drift: Box<dyn Fn(&Finding) -> bool + Sync> = Box::new(move |found| {
        let seen = found.evidence["mistake"]["drift"]["share"].as_f64();
        seen.is_some_and(|seen| is_close(seen, drift))
    });
    let no_words = String::new;
    Ok(vec![
        file("nothing", no_words(), of_each(&|pose| *pose), Box::new(|_| false)),
        file(
            "inverted",
            no_words(),
            of_each(&|pose| pose.inverse()),
            reading("camera_from_world (inverted)"),
        ),
        file("w first", no_words(), of_each(&misread), reading("quaternions with w first")),
        file(
            "OpenGL",
            no_words(),
            of_each(&|pose| pose * half_x),
            reading("camera axes (x, -y, -z)"),
        ),
        file(
            "z up",
            no_words(),
            of_each(&|pose| quarter_x * pose),
            reading("world axes (x, z, -y)"),
        ),
        file(
            "millimetres",
            no_words(),
            of_each(&|pose| scaled(pose, 1000.0)),
            reading("millimetres"),
        ),
        file(
            "lever arm",
            format!("{:.2} m", arm.norm()),
            of_each(&|pose| pose * Translation3::from(arm)),
            camera("shift_m", arm),
        ),
        file(
            "turned camera",
            format!("{:.2}°", turn_deg.norm()),
            of_each(&|pose| pose * turn),
            camera("turn_deg", turn_deg),
        ),
        file(
            "body",
            format!("{:.2} m, {:.2}°", 0.7 * arm.norm(), turn_deg.norm()),
            of_each(&|pose| pose * both),
            camera("shift_m", 0.7 * arm),
        ),
        file("shifted names", format!("{lines}"), lines_back.collect(), is_lines),
        file(
            "late clock",
            format!("{late:.2}"),
            (0..poses.len()).map(|at| at_place(at as f64 - late)).collect(),
            is_late,
        ),
        file("drift", format!("{:.2} %", 100.0 * drift), drifted, is_drift),
        file("other world", "4°".to_owned(), of_each(&|pose| world * pose), of_world(1.0)),
        file(
            "similarity",
            "4°, 0.83".to_owned(),
            of_each(&|pose| scaled(&(world * pose), 0.83)),
            of_world(0.83),
        ),
        file(
            "copies",
            no_words(),
            set.pairs.iter().map(|(_, reference)| reference.pose).collect(),
            Box::new(|found| found.code == Code::E2),
        ),
        file("camera 10 % longer", no_words(), by_fb2(1.1, 1.0)?, Box::new(is_camera)),
        file("photos 20 % smaller", no_words(), by_fb2(1.25, 1.25)?, Box::new(is_camera)),
    ])
}

/// What fb2 finds for a query whose focal length and centre are multiplied.
fn with_camera(set: &Set, at: usize, longer: f64, centre: f64) -> Result<Option<Pose>, Failure> {
    let (query, reference) = &set.pairs[at];
    let mut intrinsics = query.intrinsics;
    intrinsics.fx *= longer;
    intrinsics.fy *= longer;
    intrinsics.cx *= centre;
    intrinsics.cy *= centre;
    let query = Frame { intrinsics, ..query.clone() }.named("query");
    let references = Frames::new("reference", vec![reference.clone()]);
    let localizer = Localizer::new(&references, &query, &set.params, 0);
    let request = Request {
        radius_m: set.radius_m,
        references: vec![0].into(),
        fusions: Vec::new(),
        setting: None,
    };
    let mut pose = None;
    localizer.localize(
        0,
        0,
        &[request],
        &[Method::named("fb2")],
        &mut NoObserver,
        |result, _| {
            pose = result.pose.and_then(|pose| pose.to_pose());
            Ok::<(), LocalizeError>(())
        },
    )?;
    Ok(pose)
}
