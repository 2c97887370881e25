//! The step of a run that decided what became of an answer.

use crate::code::Code;
use crate::event::Stage;
use crate::grid::Phase;
use crate::lesson::Moment;
use crate::localize::QueryResult;
use crate::method::Method;
use crate::session::Breakpoint;

/// The moment that shows why a result is what it is: the end of the stage that its primary verdict is
/// about, where there is one, else the end of the method.
pub(super) fn deciding(result: &QueryResult) -> Moment {
    let code = result.diagnosis.first().map(|finding| finding.code);
    let stage = code.and_then(|code| match code {
        Code::R2 => Some(Stage::Detect),
        Code::R1 | Code::R3 => Some(Stage::Match),
        Code::R4 => Some(Stage::DepthLift),
        // Which features are inliers is told when all is decided.
        Code::R5 | Code::R6 | Code::R7 | Code::R8 | Code::R9 => None,
        Code::D1 | Code::D2 | Code::D3 | Code::D4 | Code::D8 => {
            Some(Stage::Search(Phase::PositionCoarse))
        }
        Code::D5 | Code::D6 => Some(Stage::Assess),
        Code::F1 => Some(Stage::Fuse),
        Code::V1 => Some(Stage::Retrieve),
        _ => None,
    });
    let of_a_method = |method: Method, stage: Stage| Moment::After {
        // Choosing and fusing belong to no method.
        method: (!Breakpoint::is_outside(stage.name())).then_some(method),
        stage: stage.name(),
    };
    match stage {
        Some(stage) => of_a_method(result.method, stage),
        None => Moment::After {
            method: None,
            stage: result.method.name(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_leads_to_a_stage_that_breakpoints_know() {
        for stage in [
            Stage::Detect,
            Stage::Match,
            Stage::DepthLift,
            Stage::Consensus,
            Stage::Accept,
            Stage::Search(Phase::PositionCoarse),
            Stage::Assess,
            Stage::Fuse,
            Stage::Retrieve,
        ] {
            let name = stage.name();
            assert!(Breakpoint::stages().contains(&name), "{name}");
        }
        assert!(Breakpoint::is_outside(Stage::Fuse.name()));
        assert!(!Breakpoint::is_outside(Stage::Match.name()));
    }
}
