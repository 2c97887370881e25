//! A moment of a run, named by a stage or a breakpoint.

use std::fmt;
use std::str::FromStr;

use crate::event::Event;
use crate::method::Method;
use crate::session::{Breakpoint, Breakpoints, Run};
use crate::trace::Record;

/// A moment of a run: `start`, `end`, `after fb.match`, or a breakpoint, which is the start of a stage
/// (`mi.position_coarse`) or where a number crosses a bound (`trial >= 5`).
#[derive(Clone, Debug, PartialEq)]
pub enum Moment {
    /// The start of the run.
    Start,
    /// The end of the run.
    End,
    /// The end of a stage.
    After {
        /// The estimator of the stage; `None` means any.
        method: Option<Method>,
        /// The stage's name.
        stage: &'static str,
    },
    /// The moment of a breakpoint.
    At(Breakpoint),
}

/// A text that is not a moment.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{text}`: `start`, `end`, `after STAGE` or a breakpoint expected; {why}")]
pub struct MomentError {
    text: String,
    why: String,
}

impl FromStr for Moment {
    type Err = MomentError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let refused =
            |why: &dyn fmt::Display| MomentError { text: text.to_owned(), why: why.to_string() };
        match text {
            "start" => return Ok(Self::Start),
            "end" => return Ok(Self::End),
            _ => {}
        }
        let Some(stage) = text.strip_prefix("after ") else {
            return text.parse().map(Self::At).map_err(|why| refused(&why));
        };
        // The parser of breakpoints knows the stages.
        let breakpoint: Breakpoint = stage.parse().map_err(|why| refused(&why))?;
        let Some(stage) = breakpoint.stage() else {
            return Err(refused(&"`after` needs a stage, not a comparison"));
        };
        Ok(Self::After { method: breakpoint.method(), stage })
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Start => f.write_str("start"),
            Self::End => f.write_str("end"),
            Self::After { method: Some(method), stage } => write!(f, "after {method}.{stage}"),
            Self::After { stage, .. } => write!(f, "after {stage}"),
            Self::At(breakpoint) => breakpoint.fmt(f),
        }
    }
}

posescope_core::serde_as_text!(Moment);

impl Moment {
    /// The record of this moment, if the run has reached it. `None` for [`Self::End`], which is no record.
    pub fn find(&self, run: &Run) -> Option<usize> {
        let mut watch = Watch::new(self.clone());
        run.records().iter().position(|record| watch.is_reached(record))
    }
}

/// Waits for a moment, record by record.
#[derive(Clone, Debug)]
pub struct Watch {
    moment: Moment,
    breakpoints: Breakpoints,
}

impl Watch {
    /// Waits for a moment, starting at the first record of a run.
    pub fn new(moment: Moment) -> Self {
        let breakpoint = match &moment {
            Moment::At(breakpoint) => Some(breakpoint.clone()),
            _ => None,
        };
        Self { breakpoints: Breakpoints::new(breakpoint), moment }
    }

    /// Whether this record is the moment. Must be called with every record.
    pub fn is_reached(&mut self, record: &Record) -> bool {
        match &self.moment {
            Moment::Start => true,
            Moment::End => false,
            Moment::At(_) => self.breakpoints.reached(record).is_some(),
            Moment::After { method, stage } => {
                let is_of = |method| record.methods.contains(&method);
                matches!(&record.event, Event::StageEnded(ended) if ended.stage.name() == *stage)
                    && method.is_none_or(is_of)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_read_as_they_are_written() {
        for text in ["start", "end", "after fb.match", "after mi", "trial >= 5", "mi.color"] {
            let moment: Moment = text.parse().expect(text);
            assert_eq!(moment.to_string(), text);
        }
    }

    #[test]
    fn what_is_no_moment_is_refused_with_what_there_is() {
        for text in ["", "after", "after nonsense", "after trial > 3", "noon"] {
            let why = text.parse::<Moment>().expect_err(text).to_string();
            assert!(why.contains("expected"), "{why}");
        }
    }
}
