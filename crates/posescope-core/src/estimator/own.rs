//! What estimators have in common that are neither a registered cost with a search nor a hybrid.

use std::sync::Arc;

use super::{Estimator, Failure, Halt};
use crate::cost;
use crate::event::{CloudColored, Moment, Stage, ViewRendered};
use crate::geometry::Pose;
use crate::grid::Offset;
use crate::params::Params;
use crate::problem::Problem;
use crate::render::{Comparison, Score};
use crate::trace::Trace;

use super::direct::Direct;

/// An estimator that makes itself.
#[derive(Clone, Copy, Debug)]
pub struct Own {
    /// The estimator with these parameters.
    pub make: fn(&Params) -> Box<dyn Estimator>,
    /// The registered cost by which its views of the query are explained, if it draws any.
    pub shows: Option<&'static str>,
    /// Whether it matches features and tells so.
    pub has_features: bool,
    /// The least probability of being within 1 m with which its pose is accepted, if it asks for one.
    pub least_probability: fn(&Params) -> Option<f64>,
}

impl Own {
    /// The registered cost by which its views are explained.
    pub fn cost(&self) -> Option<&'static cost::Entry> {
        let name = self.shows?;
        cost::ALL.iter().find(|entry| entry.name == name)
    }
}

/// The views that an estimator shows whose cost is the judge's: the grey values, explained by the joint
/// histogram of MI.
pub(super) struct View {
    direct: Direct,
}

impl View {
    pub(super) fn new(params: &Params) -> Self {
        let entry = cost::ALL.iter().find(|entry| entry.name == "mi");
        let entry = entry.expect("the paper's cost is registered");
        Self { direct: Direct::new(entry, params) }
    }

    /// Tells of the coloured cloud.
    pub(super) fn color(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<(), Halt> {
        trace.stage(Stage::Color, |trace| {
            let colored = self.direct.colored(problem);
            trace.note_reuse(colored.reused);
            let cloud = colored.value;
            trace.emit(|| CloudColored { cloud: Arc::clone(&cloud) })?;
            if cloud.points.is_empty() {
                let points = problem.reference.cloud.len();
                return Err(Halt::from(Failure::NothingInView { points }));
            }
            Ok(())
        })
    }

    /// The view at a pose beside the query, with the score that the judge gave it.
    pub(super) fn compare(&self, problem: &Problem, pose: &Pose, score: Score) -> Comparison {
        let cloud = self.direct.colored(problem).value;
        Comparison { score, ..self.direct.scorer(problem, &cloud).compare(pose) }
    }

    pub(super) fn render(
        &self,
        problem: &Problem,
        moment: Moment,
        evaluation: u64,
        pose: &Pose,
        score: Score,
    ) -> ViewRendered {
        ViewRendered {
            moment,
            evaluation,
            offset: Offset::of(pose),
            comparison: Arc::new(self.compare(problem, pose, score)),
        }
    }
}
