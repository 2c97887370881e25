//! What may lead from the poses of a file to those that are right, with free numbers that are fitted.

use nalgebra::{Matrix3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3};

use super::{Answered, Nearness};
use crate::diagnosis::readings::Reading;
use crate::geometry::Pose;
use crate::stats::{median, upper_median};

/// The most lines by which names are shifted.
const MOST_LINES: i64 = 20;
/// The greatest delay, and its steps \[queries\].
const MOST_DELAY: f64 = 5.0;
const DELAY_STEP: f64 = 0.1;

/// A correction of all poses of a file.
pub(super) enum Model {
    /// None.
    AsGiven,
    /// Numbers with another meaning.
    Reading(Reading),
    /// Each name stands so many lines too late.
    Lines(i64),
    /// The right camera in the frame of the given one.
    Mounting(Pose),
    /// The map's world from theirs: all lengths are multiplied, then turned and shifted.
    World { scale: f64, pose: Pose },
    /// The given poses are those of so many queries earlier.
    Delay(f64),
    /// An error that changes slowly: its position \[m\] and turn at some queries.
    Drift(Vec<(usize, Vector3<f64>, UnitQuaternion<f64>)>),
}

/// A query with both poses.
#[derive(Clone, Copy)]
pub(super) struct Both {
    pub at: usize,
    pub given: Pose,
    pub own: Pose,
}

impl Model {
    /// The pose of a query as it would be.
    pub(super) fn corrected(&self, queries: &[Answered], at: usize) -> Option<Pose> {
        let given = |at: usize| queries.get(at)?.given;
        match self {
            Self::AsGiven => given(at),
            Self::Reading(reading) => Some(reading.of(&given(at)?)),
            Self::Lines(by) => given(usize::try_from(at as i64 + by).ok()?),
            Self::Mounting(given_from_right) => Some(given(at)? * given_from_right),
            Self::World { scale, pose } => {
                let theirs = given(at)?;
                let scaled = Translation3::from(theirs.translation.vector * *scale);
                Some(pose * Pose::from_parts(scaled, theirs.rotation))
            }
            Self::Delay(by) => {
                let place = at as f64 + by;
                let before = place.floor();
                let from = given((before >= 0.0).then_some(before as usize)?)?;
                let share = place - before;
                if share == 0.0 {
                    return Some(from);
                }
                let to = given(before as usize + 1)?;
                let translation = from.translation.vector.lerp(&to.translation.vector, share);
                let rotation = from.rotation.try_slerp(&to.rotation, share, 1e-12)?;
                Some(Pose::from_parts(translation.into(), rotation))
            }
            Self::Drift(knots) => {
                let pose = given(at)?;
                let before = knots.iter().rev().find(|knot| knot.0 < at)?;
                let after = knots.iter().find(|knot| knot.0 > at)?;
                let share = (at - before.0) as f64 / (after.0 - before.0) as f64;
                let shift = before.1.lerp(&after.1, share);
                let turn = before.2.try_slerp(&after.2, share, 1e-12)?;
                let position = Translation3::from(pose.translation.vector + shift);
                Some(Pose::from_parts(position, turn * pose.rotation))
            }
        }
    }

    /// The models with their numbers, fitted to some queries, by how much freedom they have.
    pub(super) fn fitted(
        queries: &[Answered],
        to: &[Both],
        nearness: &Nearness,
    ) -> Vec<(u32, Self)> {
        let mut all: Vec<(u32, Self)> =
            Reading::all().into_iter().map(|reading| (0, Self::Reading(reading))).collect();
        let lines = (-MOST_LINES..=MOST_LINES).filter(|by| *by != 0);
        all.extend(lines.map(|by| (1, Self::Lines(by))));
        if let Some(delay) = delay(queries, to, nearness) {
            all.push((2, delay));
        }
        all.extend(mounting(to));
        for has_scale in [false, true] {
            let world = world(to, has_scale, nearness);
            all.extend(world.map(|world| (if has_scale { 7 } else { 6 }, world)));
        }
        all.push((20, drift(to)));
        all
    }
}

/// The delay with the least median error.
fn delay(queries: &[Answered], to: &[Both], nearness: &Nearness) -> Option<Model> {
    let error = |by: f64| {
        let model = Model::Delay(by);
        let known = to
            .iter()
            .filter_map(|both| Some(nearness.of(&both.own, &model.corrected(queries, both.at)?)));
        let mut known: Vec<f64> = known.collect();
        // Beyond the ends of the drive there is nothing to compare with.
        if 2 * known.len() >= to.len() { upper_median(&mut known) } else { f64::INFINITY }
    };
    let best = |tried: Vec<f64>| {
        let tried = tried.into_iter().map(|by| (by, error(by)));
        tried.reduce(|best, next| if next.1 < best.1 { next } else { best })
    };
    let steps = (MOST_DELAY / DELAY_STEP) as i64;
    let (coarse, _) = best((-steps..=steps).map(|step| DELAY_STEP * step as f64).collect())?;
    let fine = (-10..=10).map(|step| coarse + 0.1 * DELAY_STEP * f64::from(step));
    let (by, error) = best(fine.collect())?;
    (error.is_finite() && by.abs() > 0.5 * DELAY_STEP).then_some(Model::Delay(by))
}

/// A shift of the camera, a turn of it, and both.
fn mounting(to: &[Both]) -> Vec<(u32, Model)> {
    let Some(both) = shift_and_turn(to) else { return Vec::new() };
    let model = |shift: Translation3<f64>, turn| Model::Mounting(Pose::from_parts(shift, turn));
    vec![
        (3, model(both.translation, UnitQuaternion::identity())),
        (3, model(Translation3::identity(), both.rotation)),
        (6, Model::Mounting(both)),
    ]
}

/// The middle of where the right cameras are in the frames of the given ones.
pub(super) fn shift_and_turn(to: &[Both]) -> Option<Pose> {
    let turned: Vec<Pose> = to.iter().map(|both| both.given.inverse() * both.own).collect();
    let shifts: Vec<Vector3<f64>> = turned.iter().map(|pose| pose.translation.vector).collect();
    let turns: Vec<UnitQuaternion<f64>> = turned.iter().map(|pose| pose.rotation).collect();
    let shift = middle_of(&shifts)?;
    Some(Pose::from_parts(shift.into(), middle_turn(&turns)?))
}

/// The least-squares motion, or similarity, from their world to the map's, with little weight for what is far off.
fn world(to: &[Both], has_scale: bool, nearness: &Nearness) -> Option<Model> {
    /// How often the motion is fitted anew.
    const ROUNDS: usize = 20;
    let turns = to.iter().map(|both| both.own.rotation * both.given.rotation.inverse());
    let mut turn = middle_turn(&turns.collect::<Vec<_>>())?;
    let mut scale = if has_scale { scale_of(to)? } else { 1.0 };
    let theirs: Vec<Vector3<f64>> = to.iter().map(|both| both.given.translation.vector).collect();
    let centre = middle_of(&theirs)?;
    let shifts = to.iter().map(|both| {
        both.own.translation.vector - turn * (scale * (both.given.translation.vector - centre))
    });
    let mut shift = middle_of(&shifts.collect::<Vec<_>>())?;
    for _ in 0..ROUNDS {
        let mut normal = SMatrix::<f64, 7, 7>::zeros();
        let mut right = SVector::<f64, 7>::zeros();
        for both in to {
            let arm = turn * (scale * (both.given.translation.vector - centre));
            let off = both.own.translation.vector - shift - arm;
            let turned = both.own.rotation * (turn * both.given.rotation).inverse();
            let turned = turned.scaled_axis();
            let squares =
                (off / nearness.metres).norm_squared() + (turned / nearness.radians).norm_squared();
            let weight = (1.0 + squares).powi(-2);
            let mut rows = SMatrix::<f64, 6, 7>::zeros();
            let of_turn = -arm.cross_matrix() / nearness.metres;
            rows.fixed_view_mut::<3, 3>(0, 0).copy_from(&of_turn);
            let of_shift = Matrix3::identity() / nearness.metres;
            rows.fixed_view_mut::<3, 3>(0, 3).copy_from(&of_shift);
            rows.fixed_view_mut::<3, 1>(0, 6).copy_from(&(arm / nearness.metres));
            rows.fixed_view_mut::<3, 3>(3, 0).copy_from(&(Matrix3::identity() / nearness.radians));
            let mut residual = SVector::<f64, 6>::zeros();
            residual.fixed_rows_mut::<3>(0).copy_from(&(off / nearness.metres));
            residual.fixed_rows_mut::<3>(3).copy_from(&(turned / nearness.radians));
            normal += weight * rows.transpose() * rows;
            right += weight * rows.transpose() * residual;
        }
        if !has_scale {
            normal.row_mut(6).fill(0.0);
            normal.column_mut(6).fill(0.0);
            normal[(6, 6)] = 1.0;
            right[6] = 0.0;
        }
        let step = normal.cholesky()?.solve(&right);
        turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned()) * turn;
        shift += step.fixed_rows::<3>(3);
        scale *= step[6].exp();
    }
    let is_sound = scale.is_finite() && shift.iter().all(|part| part.is_finite());
    // Their origin stands for their centre.
    let pose = Pose::from_parts((shift - turn * (scale * centre)).into(), turn);
    is_sound.then_some(Model::World { scale, pose })
}

/// How much longer ways are in the map than in their world.
fn scale_of(to: &[Both]) -> Option<f64> {
    let half = to.len() / 2;
    let ratios = to.iter().zip(&to[half..]).filter_map(|(one, other)| {
        let way = |from: &Pose, to: &Pose| (to.translation.vector - from.translation.vector).norm();
        let theirs = way(&one.given, &other.given);
        (theirs > 0.0).then(|| way(&one.own, &other.own) / theirs)
    });
    let scale = median(&mut ratios.collect::<Vec<_>>())?;
    (scale.is_finite() && scale > 0.0).then_some(scale)
}

/// The errors themselves.
fn drift(to: &[Both]) -> Model {
    let knots = to.iter().map(|both| {
        let shift = both.own.translation.vector - both.given.translation.vector;
        (both.at, shift, both.own.rotation * both.given.rotation.inverse())
    });
    Model::Drift(knots.collect())
}

/// The middle of vectors of which less than half may be far off.
fn middle_of(vectors: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let part = |at: usize| median(&mut vectors.iter().map(|one| one[at]).collect::<Vec<_>>());
    let middle = Vector3::new(part(0)?, part(1)?, part(2)?);
    let far = median(&mut vectors.iter().map(|one| (one - middle).norm()).collect::<Vec<_>>())?;
    let near: Vec<_> = vectors.iter().filter(|one| (*one - middle).norm() <= 2.0 * far).collect();
    Some(near.iter().copied().sum::<Vector3<f64>>() / near.len().max(1) as f64)
}

/// The middle of turns of which less than half may be far off.
fn middle_turn(turns: &[UnitQuaternion<f64>]) -> Option<UnitQuaternion<f64>> {
    /// The most that are taken for the middle.
    const TRIED: usize = 60;
    let far = |from: &UnitQuaternion<f64>| {
        upper_median(&mut turns.iter().map(|turn| turn.angle_to(from)).collect::<Vec<_>>())
    };
    let stride = turns.len().div_ceil(TRIED).max(1);
    let tried = turns.iter().step_by(stride).map(|turn| (turn, far(turn)));
    let (middle, far) = tried.reduce(|best, next| if next.1 < best.1 { next } else { best })?;
    let near = turns.iter().filter(|turn| turn.angle_to(middle) <= 2.0 * far);
    let offsets: Vec<Vector3<f64>> =
        near.map(|turn| (turn * middle.inverse()).scaled_axis()).collect();
    let mean = offsets.iter().sum::<Vector3<f64>>() / offsets.len().max(1) as f64;
    Some(UnitQuaternion::from_scaled_axis(mean) * middle)
}
