//! Measuring outcomes. The only place that sees ground truth.

mod result;
mod timing;

pub use result::{
    CostReport, Diagnosis, PoseReport, QueryResult, Reason, SCHEMA, Status, evaluate,
};
pub use timing::{StageTimes, StageTimings};
