//! The events of an estimator from which verdicts are drawn.

use std::sync::Arc;

use crate::depth::LiftedMatch;
use crate::event::{
    ConsensusJudged, Event, JudgedPose, Kind, KindSet, MinimumAssessed, PoseRefined, Side,
};
use crate::features::{FeatureState, Features, Match};
use crate::grid::{Phase, ScoredLattice};
use crate::search::{Freedoms, Refined};
use crate::trace::{Cancelled, Record, Sink};

/// The events of one method on one problem that verdicts are drawn from. Their payloads are shared, so
/// that keeping them is cheap.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// Features of the query photo.
    pub query: Option<Arc<Features>>,
    /// Features of the reference photo.
    pub reference: Option<Arc<Features>>,
    /// What matching decided, by query keypoint.
    pub decisions: Option<Arc<[Option<Match>]>>,
    /// Depths of the unique matches.
    pub lifted: Option<Arc<[LiftedMatch]>>,
    /// The last match of each feature, where features were matched again.
    pub rematched: Option<Arc<[LiftedMatch]>>,
    /// The consensus, refined.
    pub refined: Option<PoseRefined>,
    /// Whether it was accepted.
    pub judged: Option<ConsensusJudged>,
    /// Where every query feature ended.
    pub states: Option<Arc<[FeatureState]>>,
    /// The lattices of the search, in order.
    pub surfaces: Vec<Arc<ScoredLattice>>,
    /// The minimum that the search ended in.
    pub minimum: Option<MinimumAssessed>,
    /// Where the best starts of a search in six freedoms ended, the least cost first.
    pub settled: Option<Arc<[Refined]>>,
    /// The poses of several methods under one cost, the answer first.
    pub candidates: Option<Arc<[JudgedPose]>>,
}

impl Evidence {
    /// The first scored lattice of a phase.
    pub fn surface(&self, phase: Phase) -> Option<&ScoredLattice> {
        let found = self.surfaces.iter().find(|surface| surface.lattice.phase == phase);
        found.map(AsRef::as_ref)
    }

    /// The evidence of a hybrid that fell back from this method to a second.
    #[must_use]
    pub fn followed_by(&self, second: &Self) -> Self {
        Self {
            surfaces: second.surfaces.clone(),
            minimum: second.minimum,
            settled: second.settled.clone(),
            candidates: second.candidates.clone(),
            ..self.clone()
        }
    }
}

/// The events that are kept, and where: what the sink wants is what it keeps.
macro_rules! kept {
    ($evidence:ident: $($event:ident($payload:ident) => $keep:expr),+ $(,)?) => {
        impl Sink for Evidence {
            fn wanted(&self) -> KindSet {
                KindSet::of(&[$(Kind::$event),+])
            }

            fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
                let $evidence = self;
                match &record.event {
                    $(Event::$event($payload) => $keep,)+
                    _ => {}
                }
                Ok(())
            }
        }
    };
}

kept!(evidence:
    FeaturesDetected(detected) => {
        let features = Some(Arc::clone(&detected.features));
        match detected.side {
            Side::Query => evidence.query = features,
            Side::Reference => evidence.reference = features,
        }
    },
    MatchesDecided(matches) => evidence.decisions = Some(Arc::clone(&matches.decisions)),
    DepthsLifted(depths) => evidence.lifted = Some(Arc::clone(&depths.matches)),
    MatchesGuided(guided) => evidence.rematched = Some(Arc::clone(&guided.matches)),
    PoseRefined(refined) => evidence.refined = Some(refined.clone()),
    ConsensusJudged(judged) => evidence.judged = Some(judged.clone()),
    FeaturesClassified(classified) => evidence.states = Some(Arc::clone(&classified.states)),
    PhaseSearched(searched) => evidence.surfaces.push(Arc::clone(&searched.surface)),
    MinimumAssessed(minimum) => evidence.minimum = Some(*minimum),
    StartsRefined(starts) => {
        if starts.freedoms == Freedoms::Six {
            evidence.settled = Some(Arc::clone(&starts.refinements));
        }
    },
    CandidatesJudged(judged) => evidence.candidates = Some(Arc::clone(&judged.candidates)),
);
