//! A run reports its ranking of references once, whatever the number of methods.

use std::sync::Arc;

use nalgebra::{Matrix2, Vector2};
use posescope_core::diagnosis::Code;
use posescope_core::event::{Event, ReferencesRanked, Stage};
use posescope_core::geometry::Pose;
use posescope_core::localize::{
    ChoiceError, Chooser, LocalizeError, LocalizeObserver, Localizer, NoObserver, QueryResult,
    Ranking, References, Request, Selection,
};
use posescope_core::method::Method;
use posescope_core::params::Params;
use posescope_core::problem::{Problem, Query};
use posescope_core::retrieval::{
    Affine, Criterion, Geometry, Ranked, RankedReference, ReferenceRanking, Verification,
};
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
    localized_with(&Params::default(), requests, observer)
}

fn localized_with(
    params: &Params,
    requests: &[Request],
    observer: &mut dyn LocalizeObserver,
) -> Vec<QueryResult> {
    let scene = Walls::new();
    let mut results = Vec::new();
    Localizer::new(&scene, &scene, params, 7)
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

/// Ranks frame 0 with 20 inliers before frame 2 with 8.
struct TwoFrames;

impl Ranking for TwoFrames {
    fn criterion(&self) -> Criterion {
        Criterion::Words
    }

    fn rank(
        &self,
        _: &Query,
        _: &[usize],
        _: usize,
        _: &mut dyn FnMut() -> Result<(), Cancelled>,
    ) -> Result<Vec<Ranked>, ChoiceError> {
        let with = |frame, inliers| {
            let reference_from_query =
                Affine { linear: Matrix2::identity(), translation: Vector2::zeros() };
            let found = Verification { inliers, reference_from_query, matches: Vec::new() };
            Ranked { frame, score: 0.5, geometry: Geometry::Verified(found) }
        };
        Ok(vec![with(0, 20), with(2, 8)])
    }
}

#[test]
fn frames_with_few_inliers_are_rejected_and_a_query_without_a_frame_says_so() {
    let scene = Walls::new();
    for (accept, expected) in [(0, &[0, 2][..]), (8, &[0, 2]), (9, &[0]), (21, &[])] {
        let mut params = Params::default();
        params.retrieval.accept = accept;
        let localizer = Localizer::new(&scene, &scene, &params, 7);
        let chooser = Chooser {
            localizer: &localizer,
            params: &params,
            selection: Selection::Retrieved(2),
            radius_m: 9.0,
            seed: 7,
            index: Some(&TwoFrames),
        };
        let references = chooser.choose(1, &|_| false, &mut NoObserver).expect("readable");
        assert_eq!(references.frames, expected, "{accept}");
        let ranking = references.ranking.as_ref().expect("ranked");
        assert_eq!((ranking.chosen, ranking.frames.len()), (expected.len(), 2));
        if expected.is_empty() {
            let request = Request { radius_m: 9.0, references, fusions: vec![], setting: None };
            let results = localized_with(&params, &[request], &mut NoObserver);
            let reason = results[0].reason.as_ref().expect("no pose");
            assert_eq!(
                reason.text,
                "No place recognised: the best of 2 ranked frames, 000000, has 20 inliers, at least 21 needed."
            );
            let verdict = &results[0].diagnosis[0];
            assert_eq!(verdict.code, Code::V1);
            let told = "Retrieval ranked the right place 1st, and accepted no frame.";
            assert!(verdict.text.starts_with(told), "{}", verdict.text);
        }
    }
}
