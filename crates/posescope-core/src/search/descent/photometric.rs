//! The photometric error, descended by Levenberg–Marquardt.

use std::convert::Infallible;

use basin::{
    DenseMatrix, Executor, HuberLoss, Jacobian, LevenbergMarquardt, PointState, Residual,
    RobustLeastSquares, State as _, StepOutcome,
};

use super::{Step, View};
use crate::stats::upper_median;

/// Median absolute deviation to standard deviation, for Gaussian noise.
const TO_DEVIATION: f64 = 1.4826;

/// Residuals beyond this many standard deviations count linearly (Huber; 95 % efficient).
const HUBER: f64 = 1.345;

/// The relative reduction that the model promises below which a level is done.
const MIN_REDUCTION: f64 = 1e-6;

/// The differences of the grey values of query and reference at each point.
///
/// One that is out of view costs what is usual at the start, wherever it is: it neither draws the camera
/// nor rewards looking away.
pub(super) struct Differences<'a> {
    view: &'a View<'a>,
    out_of_view: f64,
}

impl<'a> Differences<'a> {
    /// The differences of a view, with their robust standard deviation at the start.
    pub(super) fn new(view: &'a View<'a>) -> (Self, f64) {
        let mut sizes: Vec<f64> = view
            .seen(&[0.0; 6])
            .iter()
            .zip(&view.values)
            .filter_map(|(seen, value)| Some((seen.as_ref()?.0 - value).abs()))
            .collect();
        let median = upper_median(&mut sizes);
        // Of equal photos nothing differs; a grey value is what a photo resolves.
        let deviation = (TO_DEVIATION * median).max(1.0);
        let differences = Self { view, out_of_view: deviation };
        (differences, deviation)
    }
}

impl Residual for Differences<'_> {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    type Error = Infallible;

    fn residual(&self, x: &Vec<f64>) -> Result<Vec<f64>, Infallible> {
        let seen = self.view.seen(x);
        let pairs = seen.iter().zip(&self.view.values);
        let difference = |(seen, value): (&Option<(f64, _)>, &f64)| {
            seen.as_ref().map_or(self.out_of_view, |(own, _)| own - value)
        };
        Ok(pairs.map(difference).collect())
    }
}

impl Jacobian for Differences<'_> {
    type Jacobian = DenseMatrix;

    fn jacobian(&self, x: &Vec<f64>) -> Result<DenseMatrix, Infallible> {
        let seen = self.view.seen(x);
        let slopes: Vec<f64> =
            seen.iter().flat_map(|seen| seen.map_or([0.0; 6], |(_, slope)| slope)).collect();
        Ok(DenseMatrix::from_row_slice(seen.len(), 6, &slopes))
    }
}

/// Descends from the start of a view and passes every step to `tell`; the last is where it ends.
///
/// # Errors
/// Those of `tell`.
pub fn descend<E>(
    view: &View<'_>,
    max_steps: usize,
    mut tell: impl FnMut(Step) -> Result<(), E>,
) -> Result<(), E> {
    let (differences, deviation) = Differences::new(view);
    let objective = RobustLeastSquares::new(differences, HuberLoss).with_scale(HUBER * deviation);
    let solver = LevenbergMarquardt::<Vec<f64>, DenseMatrix>::new()
        .with_relative_model_reduction_tolerance(MIN_REDUCTION);
    let start = PointState::new(vec![0.0; 6]);
    let Ok(mut stepper) =
        Executor::new(objective, solver, start).max_iter(max_steps as u64).into_stepper();
    loop {
        let Ok(outcome) = stepper.step();
        let state = stepper.state();
        if state.param().iter().all(|x| x.is_finite()) {
            tell(Step {
                camera_from_reference: view.camera_after(state.param()),
                cost: state.cost(),
            })?;
        }
        if let StepOutcome::Stopped(_) = outcome {
            return Ok(());
        }
    }
}
