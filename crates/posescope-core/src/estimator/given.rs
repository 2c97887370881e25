//! A pose that another system found: nothing is estimated, and the rest is as for any method.

use std::sync::Arc;

use super::{Estimator, Failure, Outcome};
use crate::event::Stage;
use crate::foreign::Estimates;
use crate::method::Method;
use crate::problem::Problem;
use crate::trace::{Cancelled, Trace};

/// The estimator that looks the pose of its query up.
pub struct Given {
    method: Method,
    estimates: Arc<Estimates>,
}

impl Given {
    /// The poses that go by the name of a method.
    pub fn new(method: Method, estimates: Arc<Estimates>) -> Self {
        Self { method, estimates }
    }

    /// The pose of a query, or that there is none.
    pub(crate) fn answer(&self, query: &str) -> Outcome {
        let pose = self.estimates.get(query).copied();
        Outcome::of(pose.ok_or_else(|| Failure::NotAnswered {
            answers: self.method.name().to_owned(),
            missing: format!("pose of {query}"),
        }))
    }
}

impl Estimator for Given {
    fn estimate(&self, problem: &Problem, trace: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
        trace.stage(Stage::Estimator(self.method), |_| Ok(self.answer(&problem.query.name)))
    }
}
