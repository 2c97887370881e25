//! The step of a run that decided what became of an answer.

use crate::diagnosis::DecidedAt;
use crate::event::Stage;
use crate::lesson::Moment;
use crate::localize::QueryResult;
use crate::method::Method;
use crate::session::Breakpoint;

/// The moment that shows why a result is what it is: the end of the stage that its primary verdict is
/// about, where there is one, else the end of the method.
pub(super) fn deciding(result: &QueryResult) -> Moment {
    let code = result.diagnosis.first().map(|finding| finding.code);
    let stage = code.and_then(|code| match code.rule().decided_at {
        DecidedAt::Stage(stage) => Some(stage),
        DecidedAt::End => None,
    });
    let of_a_method = |method: Method, stage: Stage| Moment::After {
        // Choosing and fusing belong to no method.
        method: (!Breakpoint::is_outside(stage.name())).then_some(method),
        stage: stage.name(),
    };
    match stage {
        Some(stage) => of_a_method(result.method, stage),
        None => Moment::After { method: None, stage: result.method.name() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::RULES;
    use crate::event::Stage;

    #[test]
    fn every_verdict_leads_to_a_stage_that_breakpoints_know() {
        for rule in RULES {
            if let DecidedAt::Stage(stage) = rule.decided_at {
                let name = stage.name();
                assert!(Breakpoint::stages().contains(&name), "{}: {name}", rule.code);
            }
        }
        assert!(Breakpoint::is_outside(Stage::Fuse.name()));
        assert!(!Breakpoint::is_outside(Stage::Match.name()));
    }
}
