//! Uses each public name as a user of the library would, so that none can change unnoticed.
//! `front_door` holds that none is missing here.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::fs;
use std::sync::Arc;

use posescope_core::cost::{
    CostOfPairs, Entropies, Explanation, ExplanationKind, InformationDistance, IntensityPair,
    JointHistogram, Key, MutualInformation, Pair, Photometric, PhotometricWeights, Power,
    Statistic, key,
};
use posescope_core::event::{
    BranchTaken, CandidatesJudged, CloudColored, ColoredCloud, ColoredPoint, ColoringCounts,
    Comparison, ConsensusJudged, DebugEvent, DepthReading, DepthsLifted, DepthsWithin,
    DescentStepped, Event, FeaturesClassified, FeaturesDetected, Freedoms, HypothesisTried,
    JudgedPose, Kind, KindSet, LiftedMatch, MatchesDecided, MatchesGuided, MinimumAssessed, Moment,
    PhaseSearched, PoseRefined, PoseScored, ProjectedCloud, ReferencesFused, ReferencesRanked,
    Refined, Side, SplattedPixel, Stage, StageEnded, StageStarted, Start, StartsRefined,
    SyntheticView, ViewRendered,
};
use posescope_core::features::{
    Descriptor, FeatureState, Features, FoundMatches, Keypoint, Match, MatchVerdict, Neighbours,
    PairMatches, SiftDescriptor, SiftFeatures, SiftParams, SurfParams, best_matches,
    nearest_neighbours, nearest_neighbours_interruptible, sift, sift_interruptible, surf,
    surf_interruptible,
};
use posescope_core::fusion::{Share, ShareOutcome, Support, average_pose};
use posescope_core::geometry::{NotRigid, PoseError, matrix_from_pose, pose_from_matrix, yaw};
use posescope_core::grid::{
    GridParams, Lattice, LatticeTooLarge, MAX_CELLS, Offset, Phase, Score, Scored, ScoredLattice,
    SurfaceParams, least_covered, scan,
};
use posescope_core::image::{
    FloatImage, GrayImage, RgbImage, cubic_interpolated, gaussian_smoothed,
};
use posescope_core::nalgebra::{Matrix3x4, Point2, Point3};
use posescope_core::params::{
    About, Channels, DepthRule, DescentParams, Described, Domain, FeatureParams, GuidedParams,
    HybridParams, JudgeParams, MultiStartParams, ParamError, RenderParams, RobustParams, Value,
};
use posescope_core::retrieval::{
    Affine, BuildError, BuildProgress, BuildRequest, BuildStep, BuildSummary, Clustering,
    Criterion, Description, Geometry, Index, IndexError, IndexParams, Ranked, RankedReference,
    RecordCounts, ReferenceRanking, Retrieval, RetrievalParams, Verification, VerifiedMatch, build,
};
use posescope_core::robust::{
    Acceptance, AcceptanceRule, Consensus, Counted, Hypothesis, LikelihoodScore, MlesacError,
    MlesacParams, NEEDED, SAMPLE, Trial, effective_area_px, inliers_beyond_chance, mlesac,
};
use posescope_core::solver::{
    Correspondence, Loss, LossShape, MAX_SOLUTIONS, Refinement, Termination, p3p, refine,
};
use posescope_core::{
    Cancelled, Cloud, Cost, CostSummary, Direct, Estimator, Failure, FeatureCounts, History,
    InputError, Intrinsics, Method, Outcome, Params, Photo, Pose, Problem, Query, Record,
    ReferenceTuple, Sink, Trace, localize, localize_by, localize_traced, methods,
};

use crate::two_walls::{self, solvable};

/// A few words on each event.
fn words(event: &Event) -> String {
    match event {
        Event::StageStarted(StageStarted { stage }) => format!("{} {stage:?}", stage.name()),
        Event::StageEnded(StageEnded { stage: Stage::Estimator(method), .. }) => method.label(),
        Event::StageEnded(ended) => format!("{} {}", ended.succeeded, ended.reused),
        Event::FeaturesDetected(FeaturesDetected { side: Side::Query, features }) => {
            format!("{}", features.keypoints.len())
        }
        Event::MatchesDecided(decided @ MatchesDecided { decisions }) => {
            let first: Option<&Match> = decisions.iter().flatten().next();
            let is_candidate = first.is_some_and(|it| it.verdict == MatchVerdict::Candidate);
            format!("{} {is_candidate}", decided.candidates())
        }
        Event::ProjectedCloud(ProjectedCloud { points, in_view }) => format!("{points} {in_view}"),
        Event::DepthsLifted(DepthsLifted { matches })
        | Event::MatchesGuided(MatchesGuided { matches }) => {
            let first: Option<&LiftedMatch> = matches.first();
            format!("{:?}", first.map(|lifted| lifted.point))
        }
        Event::HypothesisTried(HypothesisTried { trial }) => {
            let Trial { sample, hypothesis, .. } = trial;
            let sample: &[usize; SAMPLE] = sample;
            let score: Option<LikelihoodScore> = hypothesis.map(|Hypothesis { score, .. }| score);
            format!("{sample:?} {score:?}")
        }
        Event::PoseRefined(PoseRefined { inliers, .. }) => format!("{inliers}"),
        Event::ConsensusJudged(ConsensusJudged { acceptance, counted, .. }) => {
            let Acceptance { needed, .. } = acceptance;
            format!("{needed:?} {}", *counted == Counted::Places)
        }
        Event::FeaturesClassified(FeaturesClassified { states }) => {
            states.iter().map(FeatureState::name).collect()
        }
        Event::CloudColored(CloudColored { cloud }) => {
            let ColoredCloud { points, counts } = cloud.as_ref();
            let brightest = |most: f32, point: &ColoredPoint| most.max(point.intensity);
            let ColoringCounts { colored, .. } = counts;
            format!("{colored} {}", points.iter().fold(0.0, brightest))
        }
        Event::PoseScored(PoseScored { phase: Phase::PositionCoarse, score, .. }) => {
            let Score { cost, covered } = score;
            format!("{cost:?} {covered}")
        }
        Event::PhaseSearched(PhaseSearched { surface, best }) => {
            let ScoredLattice { lattice, scores, .. } = surface.as_ref();
            format!("{} {} {best:?}", lattice.cells(), scores.len())
        }
        Event::ViewRendered(ViewRendered { moment: Moment::End, comparison, .. }) => {
            let Comparison { view, pairs, explanation, .. } = comparison.as_ref();
            let SyntheticView { width, pixels, .. } = view;
            let depth = pixels.first().map(|SplattedPixel { depth, .. }| depth);
            format!("{width} {} {depth:?} {}", pairs.len(), explained(explanation.as_ref()))
        }
        Event::MinimumAssessed(MinimumAssessed { best, .. }) => format!("{best}"),
        Event::BranchTaken(BranchTaken { why, .. }) => why.clone(),
        Event::ReferencesFused(ReferencesFused { shares, .. }) => {
            shares.iter().map(share).collect()
        }
        Event::ReferencesRanked(ReferencesRanked { ranking, .. }) => ranked(ranking),
        Event::StartsRefined(StartsRefined { freedoms: Freedoms::Six, refinements }) => {
            refinements.iter().map(refined).collect()
        }
        Event::CandidatesJudged(CandidatesJudged { candidates, .. }) => {
            candidates.iter().map(|JudgedPose { refined: it, .. }| refined(it)).collect()
        }
        Event::DescentStepped(DescentStepped { level, .. }) => format!("{level}"),
        other => format!("{:?}", other.kind()),
    }
}

fn explained(explanation: Option<&Explanation>) -> String {
    match explanation {
        Some(Explanation::Weights(PhotometricWeights { power: Power::One, threshold, .. })) => {
            format!("{threshold}")
        }
        Some(Explanation::JointHistogram(JointHistogram { entropies, .. })) => {
            format!("{:.3}", entropies.mutual_information())
        }
        _ => String::new(),
    }
}

fn share(Share { outcome, support, .. }: &Share) -> String {
    let inliers = support.as_ref().map(Support::amount);
    format!("{} {inliers:?}", *outcome == ShareOutcome::Kept)
}

fn refined(Refined { start: Start { cost, .. }, pose, .. }: &Refined) -> String {
    format!("{cost} {pose}")
}

fn ranked(ReferenceRanking { criterion, frames, .. }: &ReferenceRanking) -> String {
    let name = |RankedReference { name, ranked: Ranked { score, .. }, .. }: &RankedReference| {
        format!("{name} {score}")
    };
    format!("{}{}", *criterion == Criterion::Words, frames.iter().map(name).collect::<String>())
}

/// Counts the events of one kind.
struct Counter {
    wanted: KindSet,
    count: usize,
}

impl Sink for Counter {
    fn wanted(&self) -> KindSet {
        self.wanted
    }

    fn accept(&mut self, _: &Record) -> Result<(), Cancelled> {
        self.count += 1;
        Ok(())
    }
}

/// Whether an event is of a type.
fn is<E: DebugEvent>(event: &Event) -> bool {
    E::from_event(event).is_some()
}

#[test]
fn a_query_is_localised_and_watched() {
    let photo = |ahead_m| Photo::from_gray(two_walls::photo(ahead_m, 5));
    let camera: Intrinsics = two_walls::CAMERA;
    let wrong: Result<Query, InputError> =
        Query::new("small", Photo::from_color(RgbImage::new(1, 1)), camera);
    assert!(matches!(wrong, Err(InputError::PhotoSize { .. })));
    let cloud: Cloud = two_walls::cloud_of_the_walls();
    let reference = ReferenceTuple::new("day", photo(0.0), camera, Pose::identity(), cloud);
    let query = Query::new("night", photo(1.0), camera).expect("fits");
    let problem = Problem::new(query, reference.expect("fits"), 3.0).expect("a radius");
    let params = Params::default();
    assert!(methods().any(|method| method.name() == "robust"));
    for method in [Method::FB, Method::PM, Method::MI] {
        let mut history = History::default();
        let traced = localize_traced(&problem, method, &params, &mut Trace::to(&mut history));
        let outcome: Outcome = localize(&problem, method, &params);
        assert_eq!(traced.as_ref(), Ok(&outcome));
        let Outcome { pose, counts, cost, .. } = &outcome;
        let pose = pose.as_ref().expect("textured");
        let truth = Pose::translation(0.0, 0.0, 1.0);
        let PoseError { translation_m, .. } = PoseError::between(&truth, pose);
        assert!(translation_m < 0.3, "{method}: {translation_m}");
        let inliers = counts.map(|FeatureCounts { inliers, .. }| inliers);
        let best = cost.map(|CostSummary { best, .. }| best);
        assert_ne!(inliers.is_some(), best.is_some());
        assert!(history.events().map(words).any(|words| words.contains(&method.label())));
        assert!(history.events().any(is::<StageStarted>));
    }
    let mut counter = Counter { wanted: KindSet::of(&[Kind::PoseScored]), count: 0 };
    let mut trace = Trace::to(&mut counter);
    let black = Photo::from_gray(GrayImage::new(camera.width, camera.height));
    let black = Problem::new(
        Query::new("black", black, camera).expect("fits"),
        Arc::clone(problem.reference()),
        3.0,
    );
    let outcome = localize_traced(&black.expect("a radius"), Method::MI, &params, &mut trace);
    let failure: Failure = outcome.expect("nobody cancels").pose.expect_err("black");
    assert!(matches!(failure, Failure::NothingComparable { .. }), "{failure}");
    assert!(counter.count > 100);
}

#[test]
fn a_cost_states_what_decides_it() {
    /// The mean of the query's values.
    struct Brightness;
    impl Cost for Brightness {
        fn query_channel(&self, photo: &GrayImage) -> FloatImage {
            gaussian_smoothed(photo, 1.0)
        }
        fn query_channel_key(&self) -> Key {
            key("smoothed")
        }
        fn statistic(&self) -> Statistic<'_> {
            let cost: CostOfPairs<'_> = Arc::new(|pairs| {
                let first: Option<&Pair<f32>> = pairs.first();
                first.map(|pair| f64::from(pair.query))
            });
            Statistic::Pairs(cost)
        }
    }
    let costs: [(Box<dyn Cost>, Option<ExplanationKind>); 4] = [
        (Box::new(Brightness), None),
        (Box::new(Photometric::default()), Some(ExplanationKind::Weights)),
        (Box::new(MutualInformation::default()), Some(ExplanationKind::JointHistogram)),
        (Box::new(InformationDistance::default()), Some(ExplanationKind::JointHistogram)),
    ];
    let pairs = [IntensityPair { query: 9.0, synthetic: 200.0 }];
    for (cost, expected) in costs {
        assert_eq!(cost.statistic().explains(), expected);
        assert!(cost.statistic().cost(&pairs).is_none_or(f64::is_finite));
        let estimator = Direct::searching("mine", cost, &Params::default());
        let outcome = localize_by(&estimator, &solvable(), &mut Trace::off());
        assert!(outcome.is_ok());
    }
    let one: Entropies = JointHistogram::of(&pairs, 4).entropies;
    assert_eq!(one.mutual_information(), 0.0);

    /// It believes that the query is where the reference is.
    struct Stays;
    impl Estimator for Stays {
        fn estimate(&self, problem: &Problem, _: &mut Trace<'_>) -> Result<Outcome, Cancelled> {
            Ok(Outcome::of(Ok(*problem.reference().world_from_camera())))
        }
    }
    let stays = localize_by(&Stays, &solvable(), &mut Trace::off()).expect("nobody cancels");
    assert_eq!(stays.pose, Ok(*solvable().reference().world_from_camera()));
}

#[test]
fn parameters_are_set_by_name_or_field() {
    let mut params = Params::default();
    params.set("grid.rounds", "2").expect("in range");
    let unknown = params.set("grid.round", "2");
    assert!(matches!(unknown, Err(ParamError::Unknown { .. })));
    let Described { about: About { unit, .. }, value, domain, .. } = &params.list()[0];
    assert!(
        unit.is_empty() && matches!(value, Value::Number(_)) && matches!(domain, Domain::Number(_))
    );
    let (surf, grid): (&SurfParams, &GridParams) = (&params.surf, &params.grid);
    let (fb, fb2): (&FeatureParams, &GuidedParams) = (&params.fb, &params.fb2);
    let hy: &HybridParams = &params.hy;
    assert!(!hy.per_reference);
    let (mi6, robust): (&MultiStartParams, &RobustParams) = (&params.mi6, &params.robust);
    let (judge, render): (&JudgeParams, &RenderParams) = (&params.judge, &params.render);
    let (descent, surface): (&DescentParams, &SurfaceParams) = (&params.descent, &params.surface);
    let (retrieval, index): (&RetrievalParams, &IndexParams) = (&params.retrieval, &params.index);
    assert_eq!((grid.rounds, fb.depth), (2, DepthRule::Nearest));
    assert_eq!(fb.accept, AcceptanceRule::default());
    assert_eq!(judge.channels, Channels::Contrast);
    println!(
        "{surf:?} {fb2:?} {mi6:?} {robust:?} {render:?} {descent:?} {surface:?} {retrieval:?} {index:?}"
    );
}

#[test]
fn features_are_found_and_matched() {
    let [query, reference] = [1.0, 0.0].map(|ahead_m| two_walls::photo(ahead_m, 5));
    let go_on = || Ok::<_, Infallible>(());
    let found: [Features; 2] =
        [&query, &reference].map(|photo| surf(photo, &SurfParams::default()));
    let same = surf_interruptible(&query, &SurfParams::default(), go_on);
    assert_eq!(same.as_ref(), Ok(&found[0]));
    let [of_query, of_reference]: [&[Descriptor]; 2] =
        found.each_ref().map(|it| it.descriptors.as_slice());
    let Ok(matches) = best_matches(of_query, of_reference, 0.8, go_on);
    let neighbours: Vec<Option<Neighbours>> = nearest_neighbours(of_query, of_reference);
    assert_eq!(nearest_neighbours_interruptible(of_query, of_reference, go_on), Ok(neighbours));
    assert!(matches.iter().flatten().count() > 20);

    let Keypoint { x, y, .. } = found[0].keypoints[0];
    assert!(cubic_interpolated(&query, x, y) > 0.0);
    let given = FoundMatches::new(&[[x, y]], &[[x, y]], &[Some(0)]);
    let problem = solvable().with_matches(Some(Arc::new(PairMatches::Found(given))));
    assert!(localize(&problem, Method::FB, &Params::default()).pose.is_err());

    let found: SiftFeatures = sift(&query, &SiftParams::default());
    let first: Option<&SiftDescriptor> = found.descriptors.first();
    assert!(first.is_some());
    assert_eq!(sift_interruptible(&query, &SiftParams::default(), go_on).as_ref(), Ok(&found));
    let DepthReading { within, .. } = DepthReading { distance_px: 1.0, within: None };
    assert!(within.is_none_or(|within: DepthsWithin| within.least > 0.0));
}

#[test]
fn a_pose_is_solved_for_refined_and_accepted() {
    let camera = two_walls::CAMERA;
    let truth = Pose::translation(0.2, -0.1, 0.4);
    let seen = |i: u32| {
        let [x, y] = [f64::from(i % 5) - 2.0, f64::from(i / 5) - 2.0];
        let point = Point3::new(x, 0.4 * y, 8.0 + 0.1 * x * y);
        Correspondence { pixel: camera.project(&(truth * point)).expect("in front"), point }
    };
    let all: Vec<Correspondence> = (0..25).map(seen).collect();
    let three: [Correspondence; 3] = [all[0], all[7], all[24]];
    let solutions = p3p(&three.map(|it| camera.bearing(&it.pixel)), &three.map(|it| it.point));
    assert!((1..=MAX_SOLUTIONS).contains(&solutions.len()));

    let params = MlesacParams::default();
    let go_on = |_: Option<&Trial>| Ok::<_, Infallible>(());
    let few = mlesac(&all[..2], &camera, &params, 0, go_on);
    assert!(matches!(few, Err(MlesacError::TooFewCorrespondences { needed: NEEDED, .. })));
    let consensus: Consensus = mlesac(&all, &camera, &params, 0, go_on).expect("all agree");
    let pixels: Vec<_> = all.iter().map(|it| it.pixel).collect();
    let area_px = effective_area_px(&pixels, camera.area());
    let beyond: Acceptance = inliers_beyond_chance(25, 25, 3.0, area_px);
    assert!(AcceptanceRule::default().accepts(&beyond) && consensus.inliers.len() == 25);

    let loss: Loss = LossShape::Huber.at(1.0);
    let Refinement { pose, termination, .. } = refine(&all, &camera, &Pose::identity(), loss);
    assert!((pose.translation.vector - truth.translation.vector).norm() < 1e-6);
    assert_ne!(termination, Termination::Unusable);
}

#[test]
fn a_lattice_is_scanned_and_poses_are_averaged() {
    let grid = GridParams::default();
    let lattice = Lattice::new(Phase::PositionCoarse, Offset::default(), 3.0, &grid);
    let lattice: Result<Lattice, LatticeTooLarge> = lattice;
    let lattice = lattice.expect("small");
    assert!(lattice.cells() < MAX_CELLS);
    let score = |pose: &Pose| Score { cost: Some(pose.translation.vector.norm()), covered: 9 };
    let score_all = |poses: &[Pose]| poses.iter().map(score).collect();
    let mut lowest = None;
    let surface = scan(lattice, least_covered(0.5, 10), 64, score_all, |some: &[Scored]| {
        lowest = some.iter().rev().find(|one| one.is_best).map(|one| one.offset).or(lowest);
        Ok::<_, Infallible>(())
    });
    let Ok(surface) = surface;
    assert_eq!(surface.minimum().and_then(|cell| surface.lattice.offset(cell)), lowest);

    let turned = |angle| Pose::from_parts(Point3::origin().coords.into(), yaw(angle));
    let mean = average_pose(&[(1.0, &turned(0.2)), (1.0, &turned(-0.2))]).expect("two");
    assert!(mean.rotation.angle() < 1e-12);
    assert_eq!(pose_from_matrix(&matrix_from_pose(&mean)).as_ref(), Ok(&mean));
    let refused: Result<Pose, NotRigid> = pose_from_matrix(&Matrix3x4::zeros());
    assert!(refused.is_err());
}

#[test]
fn an_index_ranks_the_frame_that_looks_alike() {
    let photos = [5, 6].map(|seed| two_walls::photo(0.0, seed));
    let features = photos.map(|photo| surf(&photo, &SurfParams::default()));
    let request = BuildRequest {
        scene: "walls".to_owned(),
        fingerprint: 1,
        frames: vec![0, 1],
        clustering: Clustering { words: 20, iterations: 5, trees: 2, checks: 32, seed: 0 },
        sample: 100,
        recipe: BTreeMap::new(),
    };
    let folder = std::env::temp_dir().join(format!("posescope-words-{}", std::process::id()));
    let path = folder.join("index");
    let mut steps = Vec::new();
    let of_frame = |frame: usize| Ok::<_, Cancelled>(features[frame].clone());
    let built = build(&path, &request, of_frame, |BuildProgress { step, .. }| steps.push(step));
    let built: Result<BuildSummary, BuildError<Cancelled>> = built;
    assert_eq!(built.expect("a folder for it").frames, 2);
    assert!(steps.contains(&BuildStep::Words));
    let opened: Result<Index, IndexError> = Index::open(&path, 32);
    let index = opened.expect("just built");
    let Description { counts: RecordCounts { documents, .. }, .. } = index.description();
    assert_eq!(*documents, 2);
    let Retrieval { ranked, .. } = index.query(&features[1], &RetrievalParams::default(), |_| true);
    assert_eq!(ranked[0].frame, 1);
    let Geometry::Verified(Verification { reference_from_query, matches, .. }) =
        &ranked[0].geometry
    else {
        panic!("the same photo lies alike");
    };
    let affine: &Affine = reference_from_query;
    let VerifiedMatch { query_pixel, reference_pixel, .. } = &matches[0];
    let moved: Point2<f64> = affine.apply(query_pixel);
    assert!((moved - reference_pixel).norm() < 1.0);
    fs::remove_dir_all(&folder).expect("it was made above");
}
