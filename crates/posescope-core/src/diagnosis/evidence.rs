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

impl Sink for Evidence {
    fn wanted(&self) -> KindSet {
        KindSet::of(&[
            Kind::FeaturesDetected,
            Kind::MatchesDecided,
            Kind::DepthsLifted,
            Kind::MatchesGuided,
            Kind::PoseRefined,
            Kind::ConsensusJudged,
            Kind::FeaturesClassified,
            Kind::PhaseSearched,
            Kind::MinimumAssessed,
            Kind::StartsRefined,
            Kind::CandidatesJudged,
        ])
    }

    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        match &record.event {
            Event::FeaturesDetected(detected) => {
                let features = Some(Arc::clone(&detected.features));
                match detected.side {
                    Side::Query => self.query = features,
                    Side::Reference => self.reference = features,
                }
            }
            Event::MatchesDecided(matches) => {
                self.decisions = Some(Arc::clone(&matches.decisions));
            }
            Event::DepthsLifted(depths) => self.lifted = Some(Arc::clone(&depths.matches)),
            Event::MatchesGuided(guided) => self.rematched = Some(Arc::clone(&guided.matches)),
            Event::PoseRefined(refined) => self.refined = Some(refined.clone()),
            Event::ConsensusJudged(judged) => self.judged = Some(judged.clone()),
            Event::FeaturesClassified(classified) => {
                self.states = Some(Arc::clone(&classified.states));
            }
            Event::PhaseSearched(searched) => self.surfaces.push(Arc::clone(&searched.surface)),
            Event::MinimumAssessed(minimum) => self.minimum = Some(*minimum),
            Event::StartsRefined(starts) if starts.freedoms == Freedoms::Six => {
                self.settled = Some(Arc::clone(&starts.refinements));
            }
            Event::CandidatesJudged(judged) => {
                self.candidates = Some(Arc::clone(&judged.candidates));
            }
            _ => {}
        }
        Ok(())
    }
}
