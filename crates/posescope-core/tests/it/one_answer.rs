//! An answer depends on the question alone: not on who asks, who listens, or what else was asked.

use posescope_core::camera::Intrinsics;
use posescope_core::cloud::Cloud;
use posescope_core::diagnosis::Evidence;
use posescope_core::estimator::Failure;
use posescope_core::event::{Event, KindSet};
use posescope_core::features::FeatureState;
use posescope_core::fusion::Fusion;
use posescope_core::geometry::Pose;
use posescope_core::image::Photo;
use posescope_core::localize::{
    LocalizeError, LocalizeObserver, Localizer, NoObserver, QueryResult, Request, is_one_drive,
    localize, localize_traced,
};
use posescope_core::method::Method;
use posescope_core::params::Params;
use posescope_core::scene::{Scene, SceneError};
use posescope_core::trace::{Cancelled, Record, Sink, Trace};

use crate::conformance::within;
use crate::two_walls::{cloud_of_the_walls, photo, problem, solvable};
use crate::walls_scene::Walls;

const FB2: Method = Method::named("fb2");
const NID: Method = Method::named("nid");

fn against(references: &[usize], fusions: &[&str]) -> Request {
    Request {
        radius_m: 3.0,
        references: references.to_vec().into(),
        fusions: fusions.iter().map(|name| name.parse::<Fusion>().expect("a fusion")).collect(),
        setting: None,
    }
}

fn answers(
    localizer: &Localizer<'_>,
    request: &Request,
    methods: &[Method],
    observer: &mut dyn LocalizeObserver,
) -> Vec<QueryResult> {
    let mut results = Vec::new();
    let keep = |result: QueryResult, _| {
        results.push(result);
        Ok::<(), LocalizeError>(())
    };
    let requests = std::slice::from_ref(request);
    localizer.localize(0, 1, requests, methods, observer, keep).expect("good data");
    results
}

/// An observer that wants every event.
struct Everything;

impl Sink for Everything {
    fn wanted(&self) -> KindSet {
        KindSet::ALL
    }
    fn accept(&mut self, _record: &Record) -> Result<(), Cancelled> {
        Ok(())
    }
}

impl LocalizeObserver for Everything {}

#[test]
fn the_library_refuses_what_the_command_line_refuses() {
    let mut params = Params::default();
    params.fb2.least_probability = 1.0;
    let alone = localize(&solvable(), FB2, &params);
    assert!(matches!(alone.pose, Err(Failure::LowConfidence { .. })), "{:?}", alone.pose);
    let mut everything = Everything;
    let watched = localize_traced(&solvable(), FB2, &params, &mut Trace::to(&mut everything));
    assert_eq!(watched.expect("nobody cancels"), alone);
}

#[test]
fn a_fused_result_depends_on_no_other_method() {
    let (scene, params) = (Walls::new(), Params::default());
    let request = against(&[0, 2], &["wavg"]);
    let of = |methods: &[Method], wanted: Method| {
        let localizer = Localizer::new(&scene, &scene, &params, 7);
        let mut results = answers(&localizer, &request, methods, &mut NoObserver);
        results.retain(|result| result.method == wanted);
        results.pop().expect("it was asked for")
    };
    for (wanted, other) in [(NID, FB2), (FB2, Method::MI), (FB2, NID), (Method::MI, Method::FB)] {
        for methods in [&[wanted][..], &[wanted, other], &[other, wanted]] {
            let found = of(methods, wanted);
            assert_eq!(found.pose, of(&[wanted], wanted).pose, "{wanted} of {methods:?}");
        }
    }
}

#[test]
fn the_states_of_features_add_up_to_the_counts() {
    for method in [Method::FB, FB2] {
        for assignment in
            ["fb.ratio=0.6", "fb2.max_trials=1", "fb2.guided=false", "fb2.depth_radius=0.2"]
        {
            let mut params = Params::default();
            params.assign(assignment).expect("a parameter");
            let mut evidence = Evidence::default();
            let outcome =
                localize_traced(&solvable(), method, &params, &mut Trace::to(&mut evidence))
                    .expect("nobody cancels");
            let counts = outcome.counts.expect("features were matched");
            let states = evidence.states.expect("they are told of failures too");
            let kept =
                |passed: fn(&FeatureState) -> bool| states.iter().filter(|s| passed(s)).count();
            let ratio = kept(|s| !matches!(s, FeatureState::RatioFailed { .. }));
            let not_unique = kept(|s| matches!(s, FeatureState::NotUnique { .. }));
            let no_depth = kept(|s| matches!(s, FeatureState::NoDepth { .. }));
            let inliers = kept(|s| matches!(s, FeatureState::Inlier { .. }));
            assert_eq!(states.len(), counts.query_keypoints, "{method} {assignment}");
            assert_eq!(ratio, counts.ratio_passed, "{method} {assignment}");
            assert_eq!(ratio - not_unique, counts.unique, "{method} {assignment}");
            assert_eq!(ratio - not_unique - no_depth, counts.with_depth, "{method} {assignment}");
            assert_eq!(inliers, counts.inliers, "{method} {assignment}");
        }
    }
}

#[test]
fn points_in_view_are_fewer_than_all_where_some_are_not() {
    /// Counts what the events of a projected cloud say.
    #[derive(Default)]
    struct Clouds(Vec<(usize, usize)>);
    impl Sink for Clouds {
        fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
            if let Event::ProjectedCloud(cloud) = &record.event {
                self.0.push((cloud.points, cloud.in_view));
            }
            Ok(())
        }
    }
    let mut cloud = cloud_of_the_walls();
    let behind: Vec<_> = cloud.points.iter().map(|point| -*point).collect();
    cloud.points.extend(behind);
    let problem = problem(photo(1.0, 5), photo(0.0, 5), cloud);
    for method in [Method::FB, FB2] {
        let mut clouds = Clouds::default();
        localize_traced(&problem, method, &Params::default(), &mut Trace::to(&mut clouds))
            .expect("nobody cancels");
        for (points, in_view) in &clouds.0 {
            assert!(in_view * 2 <= *points && *in_view > 0, "{method}: {in_view} of {points}");
        }
        assert!(!clouds.0.is_empty(), "{method}");
    }
}

#[test]
fn a_hybrid_falls_back_where_its_first_pose_is_refused_whoever_asks_and_listens() {
    let (scene, params) = (Walls::new(), Params::default());
    let request = against(&[0], &[]);
    let localizer = || Localizer::new(&scene, &scene, &params, 7).accepting_from(Some(1.0));
    let of = |methods: &[Method], observer: &mut dyn LocalizeObserver| {
        let mut results = answers(&localizer(), &request, methods, observer);
        results.pop().expect("HY comes last")
    };
    let alone = of(&[Method::HY], &mut NoObserver);
    assert!(alone.cost.is_some(), "MI was asked: {:?}", alone.reason);
    let parts = [Method::FB, Method::MI, Method::HY];
    for hybrid in [
        of(&parts, &mut NoObserver),
        of(&parts, &mut Everything),
        of(&[Method::HY], &mut Everything),
    ] {
        assert_eq!((hybrid.status, &hybrid.cost), (alone.status, &alone.cost));
        assert_eq!(hybrid.reason, alone.reason);
    }
}

#[test]
fn a_later_round_of_the_search_never_ends_higher() {
    for radius in [0.5, 0.7] {
        let problem = within(solvable(), radius);
        for method in [Method::PM, Method::MI, NID] {
            let mut before = f64::INFINITY;
            for rounds in 1..=4 {
                let mut params = Params::default();
                params.grid.rounds = rounds;
                params.grid.coarse_step_m = 0.5;
                params.grid.fine_range_m = 0.2;
                params.grid.fine_step_m = 0.1;
                let outcome = localize(&problem, method, &params);
                let best = outcome.cost.expect("it has a cost").best;
                assert!(best <= before, "{method} {radius} m, round {rounds}: {best} > {before}");
                before = best;
            }
        }
    }
}

/// The walls, with every frame moved.
struct Elsewhere(Walls);

impl Scene for Elsewhere {
    fn name(&self) -> &str {
        self.0.name()
    }
    fn frames(&self) -> &[String] {
        self.0.frames()
    }
    fn intrinsics(&self, frame: usize) -> Intrinsics {
        self.0.intrinsics(frame)
    }
    fn pose(&self, frame: usize) -> Option<Pose> {
        Some(Pose::translation(0.01, 0.0, 0.0) * self.0.pose(frame)?)
    }
    fn time_s(&self, frame: usize) -> Option<f64> {
        self.0.time_s(frame)
    }
    fn has_cloud(&self, frame: usize) -> bool {
        self.0.has_cloud(frame)
    }
    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        self.0.photo(frame)
    }
    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        self.0.cloud(frame)
    }
}

#[test]
fn two_drives_of_one_name_are_two() {
    let (walls, again, elsewhere) = (Walls::new(), Walls::new(), Elsewhere(Walls::new()));
    assert!(is_one_drive(&walls, &again), "one folder opened twice");
    assert!(!is_one_drive(&walls, &elsewhere));
    let params = Params::default();
    let localizer = Localizer::new(&walls, &elsewhere, &params, 7);
    let results = answers(&localizer, &against(&[0], &[]), &[Method::FB], &mut NoObserver);
    assert_eq!(results[0].query_scene.as_deref(), Some("walls"));
}
