//! What a recording promises: entities, timelines, equality, and to survive a killed run.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use posescope::cost;
use posescope::diagnosis::{Assessment, Evidence, Subject, Tolerance};
use posescope::estimator::{self, Direct};
use posescope::event::{Kind, KindSet, PhaseSearched, ReferencesRanked, Stage, ViewRendered};
use posescope::features::FeatureState;
use posescope::geometry::Pose;
use posescope::history::History;
use posescope::localize::{LocalizeObserver as _, QueryResult, StageTimes, evaluate, localize_by};
use posescope::method::Method;
use posescope::params::Params;
use posescope::proof::{ProofCase, ProofPicture};
use posescope::retrieval::{Criterion, Geometry, Ranked, RankedReference, ReferenceRanking};
use posescope::scale::Scale;
use posescope::sink::rerun::{Identity, Recorder, Targets, entities};
use posescope::trace::{Cancelled, Fanout, Sink as _, Trace};
use rerun::external::arrow::array::{ListArray, StringArray};
use rerun::external::re_log_encoding::DecoderApp;
use rerun::external::re_sdk_types::blueprint::archetypes::ViewBlueprint;
use rerun::log::{Chunk, LogMsg};

use crate::binary::{first_metre, has, posescope};
use crate::small_sequence::SmallSequence;
use crate::two_walls::solvable;

const STEP: &str = entities::STEP_TIMELINE;
const EVAL: &str = entities::EVAL_TIMELINE;
const LOCKSTEP: &str = entities::LOCKSTEP_TIMELINE;

fn identity() -> Identity {
    identity_of(&Params::default())
}

fn identity_of(params: &Params) -> Identity {
    Identity {
        scene: "two walls".to_owned(),
        query_scene: None,
        queries: vec!["query".to_owned()],
        references: vec!["reference".to_owned()],
        configuration: params.to_toml(),
        degraded: Default::default(),
        seed: 7,
    }
}

/// Runs methods on one query, as the command line does.
fn run(recorder: &mut Recorder, methods: &[Method], params: &Params) {
    let truth = solvable().reference().world_from_camera() * Pose::translation(0.0, 0.0, 1.0);
    run_against(&truth, recorder, &mut History::default(), methods, params);
}

/// Runs methods as [`run`] does, judges them against this pose, and returns the last result.
fn run_against(
    truth: &Pose,
    recorder: &mut Recorder,
    history: &mut History,
    methods: &[Method],
    params: &Params,
) -> Option<QueryResult> {
    let problem = solvable();
    recorder.begin_query(0, std::slice::from_ref(&problem), Some(truth));
    let results = methods.iter().map(|&method| {
        recorder.begin_method(0, method);
        let mut evidence = Evidence::default();
        let mut all = Fanout::new(vec![&mut *recorder, &mut evidence, &mut *history]);
        let outcome = estimator::entry(method)
            .make(params)
            .estimate(&problem, &mut Trace::to(&mut all))
            .expect("a recorder never cancels");
        let tolerance = Tolerance { translation_m: 0.4, rotation_deg: 5.0 };
        let subject = Subject::new(&problem, method, params, &outcome, &evidence);
        let subject = subject.against(Some(truth), tolerance);
        let mut result = evaluate("two walls", &subject, Assessment::of(&subject));
        result.unit = params.scale.unit();
        recorder.end_method(&result, &StageTimes::default());
        result
    });
    results.last()
}

fn open(path: &Path, methods: &[Method]) -> Recorder {
    let targets = Targets { save: Some(path.to_owned()), ..Targets::default() };
    Recorder::open(&targets, &identity(), methods).expect("a writable file")
}

fn recorded(
    folder: &tempfile::TempDir,
    name: &str,
    methods: &[Method],
    params: &Params,
) -> PathBuf {
    let path = folder.path().join(name);
    let mut recorder = open(&path, methods);
    run(&mut recorder, methods, params);
    recorder.close().expect("a whole recording");
    path
}

/// The chunks of the recording itself, without those of its layout.
pub fn chunks(path: &Path) -> Vec<Chunk> {
    let file = BufReader::new(File::open(path).expect("the recording"));
    DecoderApp::decode_lazy(file)
        .map(|message| message.expect("a readable message"))
        .filter_map(|message| match message {
            LogMsg::ArrowMsg(store, message) if store.is_recording() => {
                Some(Chunk::from_arrow_msg(&message).expect("a chunk"))
            }
            _ => None,
        })
        .collect()
}

/// All texts of a recording: log, report, names of layers.
fn texts(path: &Path) -> Vec<String> {
    let file = BufReader::new(File::open(path).expect("the recording"));
    let messages = DecoderApp::decode_lazy(file).map(|message| message.expect("readable"));
    let batches = messages.filter_map(|message| match message {
        LogMsg::ArrowMsg(store, message) if store.is_recording() => Some(message.batch.clone()),
        _ => None,
    });
    let columns = batches.flat_map(|batch| batch.columns().to_vec());
    let mut texts = Vec::new();
    for column in columns {
        let Some(list) = column.as_any().downcast_ref::<ListArray>() else { continue };
        let Some(rows) = list.values().as_any().downcast_ref::<StringArray>() else { continue };
        texts.extend(rows.iter().flatten().map(str::to_owned));
    }
    texts
}

/// The layout, as text.
fn layout(path: &Path) -> String {
    let file = BufReader::new(File::open(path).expect("the recording"));
    DecoderApp::decode_lazy(file)
        .map(|message| message.expect("a readable message"))
        .filter_map(|message| match message {
            LogMsg::ArrowMsg(store, message) if !store.is_recording() => {
                Some(format!("{:?}", message.batch))
            }
            _ => None,
        })
        .collect()
}

/// The timelines on which each entity has rows.
pub fn timelines(chunks: &[Chunk]) -> BTreeMap<String, BTreeSet<String>> {
    let mut all: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for chunk in chunks {
        let path = chunk.entity_path().to_string().trim_start_matches('/').to_owned();
        let names = chunk.timelines().keys().map(|name| name.as_str().to_owned());
        all.entry(path).or_default().extend(names);
    }
    all
}

fn assert_equal(left: &[Chunk], right: &[Chunk]) {
    let mut unmatched: Vec<&Chunk> = right.iter().collect();
    for chunk in left {
        let equal = unmatched.iter().position(|other| Chunk::ensure_similar(chunk, other).is_ok());
        match equal {
            Some(place) => drop(unmatched.swap_remove(place)),
            None => panic!("{} differs", chunk.entity_path()),
        }
    }
    assert!(unmatched.is_empty(), "{} chunks too many", unmatched.len());
}

/// The times of an entity's rows on a timeline, in order.
pub fn times(chunks: &[Chunk], entity: &str, timeline: &str) -> Vec<i64> {
    let of_entity = chunks
        .iter()
        .filter(|chunk| chunk.entity_path().to_string().trim_start_matches('/') == entity);
    let columns = of_entity.filter_map(|chunk| {
        let mut columns = chunk.timelines().iter();
        columns.find_map(|(name, column)| {
            (name.as_str() == timeline).then(|| column.times_raw().to_vec())
        })
    });
    let mut times: Vec<i64> = columns.flatten().collect();
    times.sort_unstable();
    times
}

#[test]
fn on_the_timeline_of_lock_step_every_method_begins_at_zero_and_a_hybrid_takes_as_long_as_its_parts()
 {
    let folder = tempfile::tempdir().expect("a folder");
    let path = recorded(&folder, "run.rrd", &Method::PAPER, &Params::default());
    let chunks = chunks(&path);
    let ends = ["fb", "pm", "mi", "hy"].map(|method| {
        let times = times(&chunks, &format!("stage/{method}"), LOCKSTEP);
        assert_eq!(times.first(), Some(&0), "{method}");
        *times.last().expect("stages")
    });
    let [fb, pm, mi, hy] = ends;
    assert!(fb > 20 && pm > 100 && mi > 100, "{ends:?}");
    // It takes what the feature-based method found, and says so.
    assert!(fb < hy && hy < fb + 20, "{ends:?}");
    // What all methods found is on no timeline on which they are still at work.
    assert_eq!(times(&chunks, "report", LOCKSTEP), [0; 0]);
}

/// The views of a layout: the class of each by its id.
fn view_classes(path: &Path) -> BTreeMap<String, String> {
    let file = BufReader::new(File::open(path).expect("the recording"));
    let mut classes = BTreeMap::new();
    for message in DecoderApp::decode_lazy(file) {
        let LogMsg::ArrowMsg(store, message) = message.expect("a readable message") else {
            continue;
        };
        if store.is_recording() {
            continue;
        }
        let chunk = Chunk::from_arrow_msg(&message).expect("a chunk");
        let component = ViewBlueprint::descriptor_class_identifier().component;
        for class in chunk.iter_slices::<String>(component) {
            let id = chunk.entity_path().to_string();
            let known = classes.insert(id.clone(), class[0].to_string());
            assert!(known.is_none_or(|known| known == class[0].to_string()), "{id}");
        }
    }
    classes
}

#[test]
fn a_view_of_one_id_is_of_one_class_in_every_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let params = Params::default();
    let all: Vec<BTreeMap<String, String>> = [
        ("fb.rrd", &[Method::FB][..], false),
        ("pm.rrd", &[Method::PM][..], false),
        ("all.rrd", &Method::PAPER[..], false),
        ("pages.rrd", &Method::PAPER[..], true),
    ]
    .into_iter()
    .map(|(name, methods, has_pages)| {
        let path = folder.path().join(name);
        let mut recorder = open(&path, methods);
        if has_pages {
            recorder = recorder.with_pages();
        }
        run(&mut recorder, methods, &params);
        recorder.close().expect("a whole recording");
        let classes = view_classes(&path);
        assert!(classes.len() > 5, "{name}: {classes:?}");
        classes
    })
    .collect();
    // A viewer keeps the layout of the recording before until it has read the next one.
    for one in &all {
        for other in &all {
            for (id, class) in one {
                assert!(other.get(id).is_none_or(|known| known == class), "{id}: {class}");
            }
        }
    }
}

#[test]
fn every_promised_entity_is_on_its_timelines() {
    let folder = tempfile::tempdir().expect("a folder");
    let chunks = chunks(&recorded(&folder, "run.rrd", &Method::PAPER, &Params::default()));
    let found = timelines(&chunks);
    let mut promised: Vec<(String, &str)> = [
        "world/cloud",
        "world/reference/0/camera",
        "world/reference/0/camera/image",
        "world/reference/0/camera/keypoints",
        "world/truth/camera",
        "world/correspondences/inlier",
        "world/correspondences/outlier",
        "query/image",
        "query/keypoints/detected",
        "fb/matches/0",
        "fb/funnel",
        "pm/residual",
        "pm/weights",
        "mi/joint_histogram",
        "mi/entropy",
        "report",
        "log",
    ]
    .map(|path| (path.to_owned(), STEP))
    .into();
    promised.extend(["fb/ransac/likelihood", "fb/ransac/inliers"].map(|p| (p.to_owned(), EVAL)));
    for state in FeatureState::NAMES {
        promised.push((format!("query/keypoints/{state}"), STEP));
        promised.push((format!("fb/matches/0/{state}"), STEP));
    }
    for method in Method::PAPER.map(Method::name) {
        promised.push((format!("world/estimate/{method}/camera"), STEP));
        promised.push((format!("stage/{method}"), STEP));
    }
    for method in ["pm", "mi"] {
        for part in ["cost", "cost/fine", "coverage", "coverage/fine", "path"] {
            promised.push((format!("world/search/{method}/{part}"), STEP));
        }
        promised.push((format!("search/{method}/yaw"), STEP));
        promised.push((format!("{method}/synthetic"), STEP));
        promised.push((format!("{method}/synthetic"), EVAL));
        promised.push((format!("{method}/cost"), EVAL));
        promised.push((format!("{method}/synthetic"), LOCKSTEP));
    }
    promised.extend(["query/image", "fb/matches/0", "stage/hy"].map(|p| (p.to_owned(), LOCKSTEP)));
    for (path, timeline) in promised {
        let Some(timelines) = found.get(&path) else {
            panic!("{path} is missing");
        };
        assert!(timelines.contains(timeline), "{path} is not on {timeline}: {timelines:?}");
        assert!(timelines.contains(entities::QUERY_TIMELINE), "{path} belongs to no query");
    }
}

#[test]
fn a_recording_of_something_wrong_opens_on_the_picture_that_proves_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut params = Params::default();
    let right = recorded(&folder, "right.rrd", &[Method::PM, Method::MI], &params);
    // So few pixels say so little that another place wins.
    for assignment in ["grid.coarse_step=3", "grid.fine_range=0.2"] {
        params.assign(assignment).expect("a parameter");
    }
    let wrong = recorded(&folder, "wrong.rrd", &[Method::PM, Method::MI], &params);
    let proof = entities::proof(Method::MI);
    assert!(timelines(&chunks(&wrong)).contains_key(&proof));
    assert!(!timelines(&chunks(&right)).contains_key(&proof));
    assert!(layout(&wrong).contains("Why MI is wrong"));
    assert!(!layout(&right).contains("Why MI is wrong"));
}

#[test]
fn a_proof_of_robust_is_made_from_all_that_it_ran_inside() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("robust.rrd");
    let robust: Method = "robust".parse().expect("is registered");
    let (params, problem, mut history) = (Params::default(), solvable(), History::default());
    // This pose is false, so the right estimate is judged wrong.
    let truth = problem.reference().world_from_camera() * Pose::translation(-2.0, 0.0, 3.0);
    let mut recorder = open(&path, &[robust]);
    let result = run_against(&truth, &mut recorder, &mut history, &[robust], &params);
    recorder.close().expect("a whole recording");
    let result = result.expect("one method");

    let is_proof = |chunk: &&Chunk| {
        chunk.entity_path().to_string().trim_start_matches('/') == entities::proof(robust)
    };
    let chunks = chunks(&path);
    let proof = chunks.iter().find(is_proof).expect("the pose is wrong");
    let blob = rerun::EncodedImage::descriptor_blob().component;
    let blob = proof.iter_slices::<&[u8]>(blob).next().expect("a picture");
    let shown = image::load_from_memory(&blob[0]).expect("a JPEG").into_rgb8();

    let records = history.records();
    let case = ProofCase {
        problem: &problem,
        records,
        result: &result,
        truth: Some(&truth),
        params: &params,
    };
    let drawn = ProofPicture::of(&case).expect("a proof").raster(1280, &result.headline());
    assert_eq!(shown.dimensions(), drawn.dimensions());
    let off = shown.iter().zip(drawn.iter()).map(|(a, b)| u64::from(a.abs_diff(*b)));
    let off = off.sum::<u64>() / drawn.len() as u64;
    assert!(off < 4, "pixels are {off} off");
}

#[test]
fn every_method_alone_has_its_pictures_in_the_layout() {
    let folder = tempfile::tempdir().expect("a folder");
    for method in estimator::methods() {
        let path = recorded(&folder, "alone.rrd", &[method], &Params::default());
        let (found, layout) = (timelines(&chunks(&path)), layout(&path));
        let has = |entity: &str| found.contains_key(entity);
        let is_laid_out = |entity: &str| layout.contains(&format!("\"{entity}\""));
        let shown = ["fb/matches/0", "fb/funnel"].map(str::to_owned).into_iter();
        let shown = shown.chain(estimator::methods().flat_map(|of| {
            let pictures = ["synthetic", "best"].map(|part| entities::direct(of, part));
            pictures.into_iter().chain([entities::yaw_curve(of)])
        }));
        let mut views = 0;
        for entity in shown {
            // A hybrid has room for the method that it did not need.
            let is_room = method == Method::HY && !has(&entity);
            assert!(is_room || is_laid_out(&entity) == has(&entity), "{method}: {entity}");
            views += usize::from(has(&entity));
        }
        assert!(views >= 2, "{method}: {views}");
        let result = format!("/{}/label", entities::estimate(method));
        let has_map = !estimator::direct_methods(&[method]).is_empty();
        assert!(layout.contains(&result) || !has_map, "{method}: the map shows no result");
    }
}

#[test]
fn where_lengths_have_no_unit_a_recording_names_no_metres() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.rrd");
    let metres_of = |is_metric: bool| -> Vec<String> {
        let params = Params::at_scale(Scale::of_depth(10.0, is_metric));
        let targets = Targets::file(&path);
        let methods = Method::PAPER;
        let recorder = Recorder::open(&targets, &identity_of(&params), &methods);
        let mut recorder = recorder.expect("a writable file");
        run(&mut recorder, &methods, &params);
        recorder.close().expect("a whole recording");
        texts(&path).iter().filter_map(|text| first_metre(text)).collect()
    };
    let metres = metres_of(true);
    assert!(metres.len() > 10, "{metres:#?}");
    let metres = metres_of(false);
    assert!(metres.is_empty(), "{metres:#?}");
}

#[test]
fn two_recordings_of_one_run_are_equal() {
    let folder = tempfile::tempdir().expect("a folder");
    let first = chunks(&recorded(&folder, "first.rrd", &Method::PAPER, &Params::default()));
    let second = chunks(&recorded(&folder, "second.rrd", &Method::PAPER, &Params::default()));
    assert_equal(&first, &second);
}

#[test]
fn the_hybrid_repeats_no_story_but_tells_all_of_it_when_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    // With hardly any match FB fails, so that the hybrid tells the story of MI too.
    let mut without_matches = Params::default();
    without_matches.fb.ratio = 0.1;
    let rows = |name: &str, methods: &[Method]| {
        let chunks = chunks(&recorded(&folder, name, methods, &without_matches));
        let count = |path: &str| {
            let of = chunks.iter().filter(|c| c.entity_path().to_string() == format!("/{path}"));
            of.map(Chunk::num_rows).sum::<usize>()
        };
        ["fb/matches/0", "mi/synthetic", "world/cloud"].map(count)
    };
    let parts = rows("parts.rrd", &[Method::FB, Method::MI]);
    assert!(parts.iter().all(|&count| count > 0), "{parts:?}");
    let both = [Method::FB, Method::MI, Method::HY];
    assert_eq!(rows("both.rrd", &both), parts);
    assert_eq!(rows("alone.rrd", &[Method::HY]), parts);
}

#[test]
fn a_second_query_begins_with_a_clean_slate_and_later_steps() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("two.rrd");
    let mut recorder = open(&path, &[Method::FB]);
    run(&mut recorder, &[Method::FB], &Params::default());
    run(&mut recorder, &[Method::FB], &Params::default());
    recorder.close().expect("a whole recording");
    let trials = |chunk: &&Chunk| chunk.entity_path().to_string() == "/fb/ransac/inliers";
    let chunks = chunks(&path);
    let evals: Vec<i64> = chunks
        .iter()
        .filter(trials)
        .flat_map(|chunk| chunk.timelines().values())
        .filter(|column| column.timeline().name().as_str() == EVAL)
        .flat_map(|column| column.times_raw().to_vec())
        .collect();
    let mut unique = evals.clone();
    unique.dedup();
    assert!(evals.is_sorted() && evals == unique, "no trial of the second run is one of the first");
    assert!(evals.len() > 100);
    let found = timelines(&chunks);
    assert!(entities::of_a_query().all(|root| found.contains_key(root)));
}

#[test]
fn a_process_that_is_killed_leaves_what_it_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("killed.rrd");
    let mut process = std::process::Command::new(assert_cmd::cargo::cargo_bin!("posescope"))
        .args(["run", "street", "--query", "70", "--reference", "62", "-q", "--save"])
        .arg(&path)
        .env("POSESCOPE_CACHE", crate::binary::CACHE)
        .spawn()
        .expect("the binary starts");
    // Long enough for the matches and some views, far from the end of some 4 MB.
    let size = || std::fs::metadata(&path).map_or(0, |file| file.len());
    while size() < 2_000_000 && process.try_wait().expect("a child").is_none() {
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    process.kill().expect("is still running");
    process.wait().expect("was killed");
    let found = timelines(&chunks(&path));
    for promised in ["fb/matches/0/inlier", "world/estimate/fb/camera", "pm/synthetic"] {
        assert!(found.contains_key(promised), "{promised} is missing");
    }
    assert!(!found.contains_key("world/estimate/hy/camera"), "it was not killed in the middle");
}

#[test]
fn a_whole_recording_wants_every_kind_and_a_repeating_hybrid_hardly_any() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut recorder = open(&folder.path().join("run.rrd"), &Method::PAPER);
    assert_eq!(recorder.wanted(), KindSet::ALL);
    run(&mut recorder, &Method::PAPER, &Params::default());
    assert!(!recorder.wanted().contains(Kind::ViewRendered));
    assert!(recorder.wanted().contains(Kind::BranchTaken));
}

#[test]
fn the_best_of_every_phase_and_one_in_ten_of_all_bests_are_shown() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = recorded(&folder, "run.rrd", &[Method::PM], &Params::default());
    let chunks = chunks(&path);
    let evals = |entity| BTreeSet::from_iter(times(&chunks, entity, EVAL));
    let [shown, bests]: [BTreeSet<i64>; 2] = ["pm/synthetic", "pm/best"].map(evals);
    assert!(shown.is_subset(&bests));
    assert!(3 * shown.len() < bests.len(), "{shown:?} of {bests:?}");
    assert!(shown.contains(&0) && shown.last() == bests.last());
    let ordered: Vec<i64> = bests.iter().copied().collect();
    for ten in ordered.windows(10) {
        assert!(ten.iter().any(|best| shown.contains(best)), "{ten:?}");
    }
    assert_eq!(shown, evals("pm/residual"));

    let mut history = History::default();
    estimator::entry(Method::PM)
        .make(&Params::default())
        .estimate(&solvable(), &mut Trace::to(&mut history))
        .expect("not cancelled");
    let mut phases = 0;
    for (at, _) in history.all::<PhaseSearched>() {
        let best = history.latest::<ViewRendered>(at).expect("a start");
        assert!(shown.contains(&(best.evaluation as i64)), "{best:?}");
        phases += 1;
    }
    assert!(phases >= 4, "{phases}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported_with_the_name_of_the_file() {
    let targets = Targets { save: Some(PathBuf::from("/dev/full")), ..Targets::default() };
    let Err(error) = Recorder::open(&targets, &identity(), &Method::PAPER) else {
        panic!("there is no room for even the header");
    };
    let line = error.to_string();
    has(&line, "/dev/full: No space left on device");
}

#[test]
fn a_fusion_is_recorded_with_weights_and_candidates() {
    let sequence = SmallSequence::write();
    let path = sequence.path().join("fused.rrd");
    posescope()
        .arg("run")
        .arg(sequence.folder())
        .args(["--query", "5", "--reference", "4", "--reference", "7"])
        .args(["--method", "mi,fb", "--fusion", "r-wavg", "--save"])
        .arg(&path)
        .assert()
        .code(0);
    let found = timelines(&chunks(&path));
    for entity in [
        entities::FUSION_TABLE.to_owned(),
        entities::fusion_weights(Method::FB),
        entities::fusion_weights(Method::MI),
        entities::fusion_candidates(Method::MI),
    ] {
        let timelines = found.get(&entity).unwrap_or_else(|| panic!("{entity}"));
        assert!(timelines.contains(STEP), "{entity}: {timelines:?}");
    }
}

/// Twelve frames, of which the third has no photo.
fn ranking_of_twelve() -> ReferencesRanked {
    let problem = solvable();
    let photo = problem.reference().photo();
    let reference = |frame: usize| RankedReference {
        name: format!("{frame:06}"),
        world_from_camera: Some(Pose::translation(0.0, 0.0, frame as f64)),
        ranked: Ranked { frame, score: 1.0 / (1 + frame) as f32, geometry: Geometry::Refused },
    };
    let ranking = ReferenceRanking {
        criterion: Criterion::Words,
        candidates: 40,
        chosen: 12,
        frames: (0..12).map(reference).collect(),
    };
    let photos =
        (0..ranking.pictured().len()).map(|rank| (rank != 2).then(|| Arc::clone(photo))).collect();
    ReferencesRanked { ranking: Arc::new(ranking), photos }
}

fn tell_ranking(recorder: &mut Recorder, event: &ReferencesRanked) {
    let told: Result<(), Cancelled> =
        Trace::to(recorder).stage(Stage::Retrieve, |trace| trace.emit(|| event.clone()));
    told.expect("a recorder never cancels");
}

#[test]
fn a_ranking_is_recorded_with_a_picture_of_the_best_and_wiped_for_the_next_query() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("ranked.rrd");
    let mut recorder = open(&path, &[Method::FB]);
    let problem = solvable();
    recorder.begin_query(0, std::slice::from_ref(&problem), None);
    tell_ranking(&mut recorder, &ranking_of_twelve());
    recorder.begin_query(1, std::slice::from_ref(&problem), None);
    recorder.close().expect("a whole recording");
    let chunks = chunks(&path);
    let found = timelines(&chunks);
    for rank in 0..12 {
        let is_shown = found.contains_key(&entities::rank(rank));
        assert_eq!(is_shown, rank < 10 && rank != 2, "rank {rank}");
        // Nothing was verified.
        assert!(!found.contains_key(&entities::rank_part(rank, "matches")));
    }
    for entity in [entities::RETRIEVAL_TABLE, entities::RETRIEVAL_PLACES] {
        assert!(found[entity].contains(STEP), "{entity}");
    }
    // The second query has no ranking, and shows none.
    assert!(found.contains_key("retrieval"));
    assert!(entities::of_a_query().any(|root| root == "retrieval"));
}

#[test]
fn a_ranking_has_a_place_in_the_layout_only_where_there_is_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let is_laid_out = |name: &str, ranking: Option<&ReferencesRanked>| {
        let path = folder.path().join(name);
        let mut recorder = open(&path, &[Method::FB]);
        recorder.begin_query(0, std::slice::from_ref(&solvable()), None);
        if let Some(ranking) = ranking {
            tell_ranking(&mut recorder, ranking);
        }
        recorder.begin_method(0, Method::FB);
        recorder.close().expect("a whole recording");
        let layout = layout(&path);
        assert!(layout.contains("fb/matches/0"), "there is a layout");
        let views =
            (0..12).filter(|&rank| layout.contains(&format!("\"{}\"", entities::rank(rank))));
        (layout.contains(entities::RETRIEVAL_TABLE), views.count())
    };
    assert_eq!(is_laid_out("without.rrd", None), (false, 0));
    assert_eq!(is_laid_out("with.rrd", Some(&ranking_of_twelve())), (true, 10));
}

#[test]
fn any_method_is_recorded_be_it_registered_or_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let nid: Method = "nid".parse().expect("is registered");
    let path = recorded(&folder, "nid.rrd", &[nid], &Params::default());
    let registered = timelines(&chunks(&path));
    assert!(registered.contains_key(&entities::direct(nid, "joint_histogram")));

    let (mine, path) = (Method::named("mine"), folder.path().join("mine.rrd"));
    let problem = solvable();
    let mut recorder = open(&path, &[mine]);
    recorder.begin_query(0, std::slice::from_ref(&problem), None);
    recorder.begin_method(0, mine);
    let cost = (cost::ALL[0].make)();
    let estimator = Direct::searching("mine", cost, &Params::default());
    localize_by(&estimator, &problem, &mut Trace::to(&mut recorder))
        .expect("a recorder never cancels")
        .pose
        .expect("the walls have texture");
    recorder.close().expect("a whole recording");
    let unregistered = timelines(&chunks(&path));
    assert!(unregistered.contains_key(&entities::direct(mine, "synthetic")));
}

#[test]
fn frames_of_two_scenes_are_told_apart_in_a_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("night.rrd");
    let two =
        Identity { scene: "snow".to_owned(), query_scene: Some("night".to_owned()), ..identity() };
    assert_eq!(two.recording_name(), "night query ← snow reference");
    assert_eq!(identity().recording_name(), "two walls query");
    let targets = Targets { save: Some(path.clone()), ..Targets::default() };
    let mut recorder = Recorder::open(&targets, &two, &[Method::FB]).expect("a writable file");
    run(&mut recorder, &[Method::FB], &Params::default());
    recorder.close().expect("a whole recording");
    let file = BufReader::new(File::open(&path).expect("the recording"));
    let told: String = DecoderApp::decode_lazy(file)
        .filter_map(|message| match message.expect("a readable message") {
            LogMsg::ArrowMsg(store, message) if store.is_recording() => {
                Some(format!("{:?}", message.batch))
            }
            _ => None,
        })
        .collect();
    for words in ["# Query night ", "Reference: snow ", "reference snow "] {
        assert!(told.contains(words), "{words}");
    }
}

#[test]
fn how_far_a_pose_may_be_off_is_an_ellipsoid_around_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("fb.rrd");
    let mut recorder = open(&path, &[Method::FB]);
    let truth = solvable().reference().world_from_camera() * Pose::translation(0.0, 0.0, 1.0);
    let (history, methods) = (&mut History::default(), [Method::FB]);
    let result = run_against(&truth, &mut recorder, history, &methods, &Params::default());
    recorder.close().expect("a whole recording");
    let known = result.and_then(|result| result.confidence?.covariance).expect("of a pose");

    let chunks = chunks(&path);
    let numbers = |entity: &str, component| -> [f32; 3] {
        let is_of =
            |chunk: &&Chunk| chunk.entity_path().to_string().trim_start_matches('/') == entity;
        let found = chunks.iter().filter(is_of).find_map(|chunk| {
            let found = chunk.iter_slices::<[f32; 3]>(component).next()?;
            found.first().copied()
        });
        found.expect(entity)
    };
    let (interval, camera) = (entities::interval(Method::FB), "world/estimate/fb/camera");
    let at = numbers(&interval, rerun::Ellipsoids3D::descriptor_centers().component);
    assert_eq!(at, numbers(camera, rerun::Transform3D::descriptor_translation().component));
    let half = numbers(&interval, rerun::Ellipsoids3D::descriptor_half_sizes().component);
    // Within 2.8 standard deviations, 95 % of the errors in space are.
    let square: f32 = half.iter().map(|half| half * half).sum();
    let expected = 7.815 * known.of_position().trace();
    assert!((f64::from(square) / expected - 1.0).abs() < 1e-3, "{half:?} {expected}");
}
