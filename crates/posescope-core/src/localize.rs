//! For posescope's own crates: may change in any version.
//!
//! Localising queries: choosing references, estimating, fusing, and measuring the outcome against the
//! ground truth, which no problem and no estimator sees.

mod choose;
mod explanation;
mod judged;
mod localizer;
mod observer;
mod result;
mod select;
mod single;
mod timing;
mod words;

pub use choose::Chooser;
pub use explanation::{Explanation, Helped};
pub use localizer::{LocalizeError, Localizer, Request, is_one_drive};
pub use observer::{LocalizeObserver, NoObserver};
pub use result::{
    Agreement, CostAtPose, CostReport, PoseReport, QueryResult, Reason, SCHEMA, Setting, Status,
    evaluate,
};
pub use select::{
    ByMatches, ChoiceError, Ranking, References, Selection, draw, frames_within, report_ranking,
};
pub use single::{localize, localize_by, localize_traced, words_of};
pub use timing::{StageTimes, StageTimings};
