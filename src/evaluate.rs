//! Measuring outcomes. The only place that sees ground truth.

mod localize;
mod result;
mod select;
mod timing;

pub use localize::{Localizer, Request, Unwatched, Watch};
pub use result::{
    CostReport, Diagnosis, PoseReport, QueryResult, Reason, SCHEMA, Setting, Status, evaluate,
};
pub use select::{ByMatches, ChoiceError, Chooser, Ranking, Selection, draw, frames_within};
pub use timing::{StageTimes, StageTimings};
