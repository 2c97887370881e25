use nalgebra::{Translation3, UnitQuaternion, Vector3};
use posescope::camera::Intrinsics;
use posescope::cloud::Cloud;
use posescope::doctor::{Calibration, calibration};
use posescope::geometry::Pose;
use posescope::scene::{self, Scene, SceneError};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::Failure;
use crate::numbers::{mean, percent, percentile, print_table};

/// How well does `doctor --calibration` find a camera that is not where the scene says?
///
/// Prints a row per scene: what it says of the scene as it is; how far its answers for planted turns, shifts, focal
/// lengths and delays are from the stated calibration and from its answer for the whole scene as it is; and how often
/// parts of the scene as it is are called consistent.
#[derive(clap::Args)]
pub struct Options {
    #[arg(required = true)]
    scenes: Vec<String>,
    /// Planted turns and shifts of each scene.
    #[arg(long, default_value_t = 20)]
    draws: usize,
    /// Frames of a part; parts begin at random frames.
    #[arg(long, default_value_t = 20)]
    frames: usize,
    /// A part has every frame of so many.
    #[arg(long, default_value_t = 1)]
    step: usize,
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Plant turns and shifts alone.
    #[arg(long)]
    poses_only: bool,
}

/// Frames of a scene with another calibration than stated.
#[derive(Clone, Copy)]
struct Misplaced<'a> {
    scene: &'a dyn Scene,
    at: &'a [usize],
    names: &'a [String],
    /// Where the camera is, in the frame that is stated.
    change: Pose,
    focal_length: f64,
    /// How much later the photos are \[s\].
    delay_s: f64,
}

impl Scene for Misplaced<'_> {
    fn name(&self) -> &str {
        self.scene.name()
    }

    fn frames(&self) -> &[String] {
        self.names
    }

    fn intrinsics(&self, frame: usize) -> Intrinsics {
        let camera = self.scene.intrinsics(self.at[frame]);
        Intrinsics {
            fx: camera.fx * self.focal_length,
            fy: camera.fy * self.focal_length,
            ..camera
        }
    }

    fn pose(&self, frame: usize) -> Option<Pose> {
        self.scene.pose(self.at[frame])
    }

    fn time_s(&self, frame: usize) -> Option<f64> {
        self.scene.time_s(self.at[frame])
    }

    fn has_cloud(&self, frame: usize) -> bool {
        self.scene.has_cloud(self.at[frame])
    }

    fn photo(&self, frame: usize) -> Result<posescope::image::Photo, SceneError> {
        self.scene.photo(self.at[frame])
    }

    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        let at = self.at[frame];
        let cloud = self.scene.cloud(at)?;
        let earlier = self.earlier(at).unwrap_or_else(Pose::identity);
        let change = (self.change * earlier).cast::<f32>();
        Ok(Cloud { points: cloud.points.iter().map(|point| change * point).collect() })
    }
}

impl Misplaced<'_> {
    /// `camera_then_from_camera`: of the camera when the cloud is taken, the delay before the photo.
    fn earlier(&self, at: usize) -> Option<Pose> {
        let next = (at + 1).min(self.scene.frames().len() - 1);
        let before = next - 1;
        let passed_s = self.scene.time_s(next)? - self.scene.time_s(before)?;
        let moved = self.scene.pose(before)?.inverse() * self.scene.pose(next)?;
        let share = self.delay_s / passed_s;
        Some(Pose::from_parts(
            Translation3::from(moved.translation.vector * share),
            UnitQuaternion::from_scaled_axis(moved.rotation.scaled_axis() * share),
        ))
    }
}

/// Turn \[°\] and shift \[m\] of a pose.
fn size(pose: &Pose) -> [f64; 2] {
    [pose.rotation.angle().to_degrees(), pose.translation.vector.norm()]
}

/// Median, 90 % and 95 %.
fn quantiles(numbers: &[f64], decimals: usize) -> String {
    let mut numbers = numbers.to_vec();
    let mut of = |share: f64| format!("{:.decimals$}", percentile(&mut numbers, share));
    format!("{} / {} / {}", of(0.5), of(0.9), of(0.95))
}

pub fn run(options: &Options) -> Result<(), Failure> {
    let (mut rows, mut freedoms) = (Vec::new(), Vec::new());
    for argument in &options.scenes {
        let scene = scene::open(argument, None)?;
        let (row, of_freedoms) = row(scene.as_ref(), options)?;
        rows.push(row);
        freedoms.push(of_freedoms);
    }
    print_table(
        ",turn from stated [°],shift from stated [m],turn from own [°],shift from own [m],in the interval,\
         consistent parts,focal length [%],delay [ms]",
        &rows,
    );
    println!(
        "Error of each freedom, mean ± standard deviation, and the mean half of its interval:\n"
    );
    print_table(
        ",about x [°],about y [°],about z [°],along x [m],along y [m],along z [m]",
        &freedoms,
    );
    Ok(())
}

/// The row of a scene, and its row of freedoms.
fn row(scene: &dyn Scene, options: &Options) -> Result<(Vec<String>, Vec<String>), Failure> {
    let count = scene.frames().len();
    let part = options.frames.min(count.div_ceil(options.step));
    let names = |at: &[usize]| at.iter().map(|&at| scene.frames()[at].clone()).collect::<Vec<_>>();
    let all: Vec<usize> = (0..count).collect();
    let mut random = Pcg64::seed_from_u64(options.seed);
    let as_it_is = Misplaced {
        scene,
        at: &all,
        names: scene.frames(),
        change: Pose::identity(),
        focal_length: 1.0,
        delay_s: 0.0,
    };
    let own = calibration(&as_it_is, &|_| ())?.camera_from_stated();
    let (mut turns, mut shifts, mut own_turns, mut own_shifts) = (vec![], vec![], vec![], vec![]);
    let (mut inside, mut judged) = (0, 0);
    let mut each: [Vec<[f64; 2]>; 6] = Default::default();
    let (mut consistent, mut focal_lengths, mut delays) = (0, vec![], vec![]);
    for _ in 0..options.draws {
        let start = random.random_range(0..=count - 1 - (part - 1) * options.step);
        let at: Vec<usize> = (0..part).map(|frame| start + frame * options.step).collect();
        let as_it_is = Misplaced { at: &at, names: &names(&at), ..as_it_is };
        let mut along = || Vector3::from_fn(|_, _| random.random_range(-1.0..1.0_f64)).normalize();
        let (axis, way) = (along(), along());
        let turn = axis * random.random_range(0.1..3.0_f64).to_radians();
        let shift = way * random.random_range(0.02..0.3_f64);
        let change =
            Pose::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn));
        let found = calibration(&Misplaced { change, ..as_it_is }, &|_| ())?;
        let rest = found.camera_from_stated() * change;
        let [turn_deg, shift_m] = size(&rest);
        turns.push(turn_deg);
        shifts.push(shift_m);
        let [turn_deg, shift_m] = size(&(rest * own.inverse()));
        own_turns.push(turn_deg);
        own_shifts.push(shift_m);
        let halves = found.turn.iter().chain(&found.shift).map(|one| one.half_width());
        let (turned, shifted) = (rest.rotation.scaled_axis(), rest.translation.vector);
        for (at, (off, half)) in turned.iter().chain(&shifted).zip(halves).enumerate() {
            inside += usize::from(off.abs() <= half);
            judged += 1;
            let unit = if at < 3 { 1.0_f64.to_degrees() } else { 1.0 };
            each[at].push([unit * off, unit * half]);
        }
        if options.poses_only {
            continue;
        }
        let sound: Calibration = calibration(&as_it_is, &|_| ())?;
        consistent += usize::from(!sound.is_off());
        let sign = if random.random_bool(0.5) { 1.0 } else { -1.0 };
        let by = sign * random.random_range(0.02..0.08);
        let wrong = Misplaced { focal_length: 1.0 + by, ..as_it_is };
        let found = calibration(&wrong, &|_| ())?.focal_length.value;
        focal_lengths.push(100.0 * ((1.0 + found) * (1.0 + by) - 1.0).abs());
        let delay_s = sign * random.random_range(0.02..0.1);
        if let Some(delay) = calibration(&Misplaced { delay_s, ..as_it_is }, &|_| ())?.delay {
            delays.push(1000.0 * (delay.value - delay_s).abs());
        }
    }
    let freedom = |of: &Vec<[f64; 2]>| {
        let (errors, halves): (Vec<f64>, Vec<f64>) =
            of.iter().map(|[off, half]| (*off, *half)).unzip();
        let bias = mean(errors.iter().copied());
        let spread = mean(errors.iter().map(|error| (error - bias).powi(2))).sqrt();
        format!("{bias:.3} ± {spread:.3}, {:.3}", mean(halves))
    };
    let freedoms =
        std::iter::once(scene.name().to_owned()).chain(each.iter().map(freedom)).collect();
    let row = vec![
        scene.name().to_owned(),
        quantiles(&turns, 2),
        quantiles(&shifts, 3),
        quantiles(&own_turns, 2),
        quantiles(&own_shifts, 3),
        format!("{:.0} %", percent(inside, judged)),
        format!("{consistent} of {}", options.draws),
        quantiles(&focal_lengths, 2),
        quantiles(&delays, 1),
    ];
    Ok((row, freedoms))
}
