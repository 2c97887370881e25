//! A run reports its ranking of references once, whatever the number of methods.

use std::sync::Arc;

use posescope_core::event::{Event, ReferencesRanked, Stage};
use posescope_core::geometry::Pose;
use posescope_core::localize::{
    LocalizeError, LocalizeObserver, Localizer, QueryResult, References, Request,
};
use posescope_core::method::Method;
use posescope_core::params::Params;
use posescope_core::problem::Problem;
use posescope_core::retrieval::{Criterion, Geometry, Ranked, RankedReference, ReferenceRanking};
use posescope_core::trace::{Cancelled, Record, Sink};

use crate::walls_scene::{UNREADABLE, Walls};

/// Writes down what comes between the beginning of a query and that of its first method.
#[derive(Default)]
struct RecordingObserver {
    notes: Vec<String>,
    rankings: Vec<ReferencesRanked>,
}

impl Sink for RecordingObserver {
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        match &record.event {
            Event::StageStarted(event) if event.stage == Stage::Retrieve => {
                self.notes.push("retrieve".to_owned());
            }
            Event::StageEnded(event) if event.stage == Stage::Retrieve => {
                self.notes.push("retrieved".to_owned());
            }
            Event::ReferencesRanked(event) => {
                self.notes.push("ranking".to_owned());
                self.rankings.push(event.clone());
            }
            _ => {}
        }
        Ok(())
    }
}

impl LocalizeObserver for RecordingObserver {
    fn begin_query(&mut self, _: usize, _: &[Problem], _: Option<&Pose>) {
        self.notes.push("query".to_owned());
    }
    fn begin_method(&mut self, _: usize, method: Method) {
        self.notes.push(method.name().to_owned());
    }
}

fn localized(requests: &[Request], observer: &mut dyn LocalizeObserver) -> Vec<QueryResult> {
    let (scene, params) = (Walls::new(), Params::default());
    let mut results = Vec::new();
    Localizer::new(&scene, &scene, &params, 7)
        .localize(0, 1, requests, &[Method::FB], observer, |result, _| {
            results.push(result);
            Ok::<(), LocalizeError>(())
        })
        .expect("readable");
    results
}

#[test]
fn a_ranking_is_told_once_after_the_query_and_a_lost_photo_does_not_matter() {
    let frames = [0, UNREADABLE].map(|frame| RankedReference {
        name: format!("{frame:06}"),
        world_from_camera: None,
        ranked: Ranked { frame, score: 0.5, geometry: Geometry::Unchecked },
    });
    let ranking = Arc::new(ReferenceRanking {
        criterion: Criterion::Words,
        candidates: 2,
        chosen: 1,
        frames: frames.into(),
    });
    let request = |radius_m, ranking| Request {
        radius_m,
        references: References { frames: vec![0], ranking, within_m: None },
        fusions: Vec::new(),
        setting: None,
    };
    let asked = |ranking: Option<&Arc<ReferenceRanking>>| {
        [3.0, 4.0].map(|radius_m| request(radius_m, ranking.cloned()))
    };
    let mut observer = RecordingObserver::default();
    let results = localized(&asked(Some(&ranking)), &mut observer);
    let expected = ["query", "retrieve", "ranking", "retrieved", "fb", "fb"];
    assert_eq!(observer.notes, expected);
    let told = &observer.rankings[0];
    assert_eq!(told.ranking, ranking);
    let is_there: Vec<bool> = told.photos.iter().map(Option::is_some).collect();
    assert_eq!(is_there, [true, false]);

    let mut other = RecordingObserver::default();
    assert_eq!(localized(&asked(None), &mut other), results);
    assert_eq!(other.notes, ["query", "fb", "fb"]);
}
