use super::*;
use crate::diagnosis::RULES;
use crate::event::ReferencesRanked;
use crate::history::History;
use crate::localize::{LocalizeError, LocalizeObserver, Localizer, Request};
use crate::retrieval::{Criterion, Geometry, Ranked, RankedReference, ReferenceRanking};
use crate::scene;
use crate::trace::{Cancelled, Sink};

/// Keeps what a proof is made from.
#[derive(Default)]
struct Kept {
    history: History,
    problems: Vec<Problem>,
    truth: Option<Pose>,
}

impl Kept {
    fn case<'a>(&'a self, result: &'a QueryResult, params: &'a Params) -> ProofCase<'a> {
        ProofCase {
            problem: &self.problems[0],
            records: self.history.records(),
            result,
            truth: self.truth.as_ref(),
            params,
        }
    }
}

impl Sink for Kept {
    fn accept(&mut self, record: &Record) -> Result<(), Cancelled> {
        self.history.accept(record)
    }
}

impl LocalizeObserver for Kept {
    fn begin_query(&mut self, _index: usize, problems: &[Problem], truth: Option<&Pose>) {
        self.problems = problems.to_vec();
        self.truth = truth.copied();
    }
}

/// A query of a scene against a frame of another, by one method.
fn localized(
    scenes: [&str; 2],
    frames: [&str; 2],
    radius_m: f64,
    method: Method,
) -> (Kept, QueryResult) {
    let [references, queries] =
        scenes.map(|name| scene::open(name, None).expect("a built-in scene"));
    let [reference, query] = [(&references, frames[0]), (&queries, frames[1])]
        .map(|(scene, name)| scene.find(name).expect("a frame"));
    let params = Params::default();
    let localizer = Localizer::new(references.as_ref(), queries.as_ref(), &params, 0);
    let request = Request {
        radius_m,
        references: vec![reference].into(),
        fusions: Vec::new(),
        setting: None,
    };
    let (mut kept, mut found) = (Kept::default(), None);
    localizer
        .explaining(0)
        .localize(0, query, &[request], &[method], &mut kept, |result, _| {
            found = Some(result);
            Ok::<(), LocalizeError>(())
        })
        .expect("nobody stops it");
    (kept, found.expect("a result"))
}

/// Neighbours on the street.
fn neighbours(method: Method) -> (Kept, QueryResult) {
    localized(["street"; 2], ["000001", "000000"], 5.0, method)
}

/// Saves the picture as a PNG in the folder that `POSESCOPE_PAINT` names.
fn paint(name: &str, picture: &ProofPicture) {
    if let Some(folder) = std::env::var_os("POSESCOPE_PAINT") {
        let path = std::path::Path::new(&folder).join(format!("{name}.png"));
        let painted = picture.raster(960, "").save(path);
        painted.expect("a folder to write to");
    }
}

/// The map ranks the cell that the verdict ranks, and marks truth and result where they are.
#[test]
fn the_map_of_a_search_that_missed_agrees_with_its_sentence() {
    let scenes = ["street:snow", "street:night"];
    let (kept, result) = localized(scenes, ["000450"; 2], 15.0, Method::MI);
    let primary = &result.diagnosis[0];
    assert_eq!(primary.code.name(), "D3");
    let rank = primary.evidence["rank"].as_u64().expect("a rank");
    let params = Params::default();
    let case = kept.case(&result, &params);
    let picture = ProofPicture::of(&case).expect("a map");
    paint("missed", &picture);
    let map = picture.large;
    let says = format!("the right cell is number {rank} of ");
    assert!(map.title.contains(&says), "{}", map.title);
    let at = |wanted: fn(Thing) -> bool| {
        let mark = map.marks.iter().find(|mark| wanted(mark.thing));
        mark.expect("a mark").at
    };
    let truth = at(|thing| thing == Thing::Truth);
    let found = at(|thing| matches!(thing, Thing::Result(_)));
    let apart = f64::from((truth[0] - found[0]).hypot(truth[1] - found[1]));
    let step_m = params.grid.coarse_step_m;
    let error_m = result.error.expect("the truth is known").translation_m;
    assert!((apart * step_m - error_m).abs() < 0.5, "{apart} cells, {error_m} m");
}

/// Every kind of proof that a method's run has something to show for.
fn pictures(kept: &Kept, result: &QueryResult) -> Vec<(&'static str, ProofPicture)> {
    let params = Params::default();
    let drawn = RULES.iter().filter_map(|rule| {
        let mut result = result.clone();
        result.diagnosis = vec![crate::diagnosis::Diagnosis {
            code: rule.code,
            text: String::new(),
            evidence: Default::default(),
        }];
        let case = kept.case(&result, &params);
        Some((rule.code.name(), ProofPicture::of(&case)?))
    });
    drawn.collect()
}

/// Recordings, reports and the window keep [`KINDS`] alone.
#[test]
fn every_proof_is_drawn_from_the_events_that_are_kept_as_from_all() {
    for name in ["fb", "mi", "fb2", "robust"] {
        let (mut kept, result) = neighbours(name.parse().expect("a method"));
        let titles = |kept: &Kept| {
            let drawn = pictures(kept, &result).into_iter();
            let titles = drawn.map(|(code, picture)| {
                (code, picture.panels().map(|panel| panel.title.clone()).collect::<Vec<_>>())
            });
            titles.collect::<Vec<_>>()
        };
        let from_all = titles(&kept);
        let records = kept.history.records().iter().cloned();
        let is_stage =
            |record: &Record| [Kind::StageStarted, Kind::StageEnded].contains(&record.event.kind());
        let mut few = History::default();
        records
            .filter(|record| is_stage(record) || KINDS.contains(record.event.kind()))
            .for_each(|record| few.push(record));
        kept.history = few;
        assert_eq!(titles(&kept), from_all, "{name}");
    }
}

/// Where nothing was matched, both photos show what was found in them.
#[test]
fn keypoints_without_matches_have_a_picture() {
    let (kept, mut result) = neighbours(Method::FB);
    let records = kept.history.records().iter().cloned();
    let is_detected = |record: &Record| record.event.kind() == Kind::FeaturesDetected;
    let detected: Vec<Record> = records.filter(is_detected).collect();
    result.diagnosis = vec![crate::diagnosis::Diagnosis {
        code: crate::diagnosis::Code::R2,
        text: String::new(),
        evidence: Default::default(),
    }];
    let case = ProofCase {
        problem: &kept.problems[0],
        records: &detected,
        result: &result,
        truth: kept.truth.as_ref(),
        params: &Params::default(),
    };
    let large = ProofPicture::of(&case).expect("a picture").large;
    let counts = result.counts.expect("features were used");
    let (query, reference) = (counts.query_keypoints, counts.reference_keypoints);
    let title = format!("Query above reference: {query} and {reference} keypoints");
    assert_eq!(large.title, title);
    assert_eq!(large.marks.len(), query + reference);
}

/// A picture for every verdict that a method can get, none of whose panels leaves the picture or lies on another.
#[test]
fn every_verdict_has_a_picture_without_overlap() {
    for (method, least) in [(Method::FB, 15), (Method::MI, 13)] {
        let (kept, result) = neighbours(method);
        let drawn = pictures(&kept, &result);
        assert!(drawn.len() >= least, "{method}: {}", drawn.len());
        for (code, picture) in drawn {
            let width = 960.0;
            let (places, height) = picture.on_page(width);
            assert_eq!(places.len(), picture.panels().count());
            for (at, one) in places.iter().enumerate() {
                let ends = [one.left + one.width, one.top + one.height];
                assert!(one.left >= 0.0 && one.top >= 0.0, "{method} {code}: {one:?}");
                assert!(
                    ends[0] <= width + 0.5 && ends[1] <= height + 0.5,
                    "{method} {code}: {one:?} in {height}"
                );
                assert!(one.width >= 60.0 && one.height >= 30.0, "{method} {code}: {one:?}");
                for other in &places[..at] {
                    let is_apart = ends[0] <= other.left
                        || other.left + other.width <= one.left
                        || ends[1] <= other.top
                        || other.top + other.height <= one.top;
                    assert!(is_apart, "{method} {code}: {one:?} on {other:?}");
                }
            }
            paint(&format!("{method}-{code}"), &picture);
        }
    }
}

/// A map of cells without a strip below it, as of `robust`, fills the whole width best, and leaves nothing for the photos.
#[test]
fn photos_beside_a_map_of_cells_are_seen() {
    let mut large = Panel::plain("costs", 21, 21);
    (large.has_cells, large.is_plain) = (true, false);
    let photo = || Panel::new("photo", RgbImage::new(1241, 376));
    let picture = ProofPicture { large, below: None, beside: (0..4).map(|_| photo()).collect() };
    let (places, height) = picture.on_page(1280.0);
    assert!(height < 960.0, "{height}");
    for photo in &places[1..] {
        assert!(photo.width > 400.0, "{photo:?}");
    }
}

/// The same bytes each time: reports are compared by them.
#[test]
fn a_proof_is_painted_the_same_twice() {
    let (kept, result) = neighbours(Method::MI);
    let first = pictures(&kept, &result);
    let again = pictures(&kept, &result);
    assert_eq!(first[0].1.raster(640, "why"), again[0].1.raster(640, "why"));
}

/// The scale moves away from a mark, and back to its usual corner where every corner has one.
#[test]
fn the_scale_covers_no_mark() {
    let panel = Place { left: 10.0, top: 20.0, width: 400.0, height: 300.0 };
    let corner =
        |marks: &[[f32; 2]]| layout::free_corner(&panel, [150.0, 24.0], marks.iter().copied());
    let (lower_left, lower_right) = ([14.0, 292.0], [256.0, 292.0]);
    assert_eq!(corner(&[[200.0, 100.0]]), lower_left);
    assert_eq!(corner(&[[20.0, 290.0]]), lower_right);
    let everywhere = [20.0, 400.0].map(|x| [[x, 30.0], [x, 310.0]]);
    assert_eq!(corner(everywhere.as_flattened()), lower_left);
}

/// A label that fits at neither side of its mark stands above or below it, and not on another label.
#[test]
fn a_label_covers_neither_its_mark_nor_another_label() {
    let panel = Place { left: 0.0, top: 0.0, width: 100.0, height: 200.0 };
    let mut taken = Vec::new();
    let mut place = |at, width| layout::label_place(at, [width, 16.0], &panel, &mut taken);
    let beside = place([20.0, 50.0], 40.0);
    assert_eq!([beside.left, beside.top], [30.0, 42.0]);
    let left = place([80.0, 20.0], 40.0);
    assert_eq!([left.left, left.top], [30.0, 12.0]);
    let wide = place([50.0, 80.0], 90.0);
    assert_eq!(wide.left, 0.0);
    assert!(wide.top >= 80.0 + MARK || wide.top + 16.0 <= 80.0 - MARK, "{wide:?}");
    let second = place([20.0, 50.0], 40.0);
    assert!(second.top >= 58.0 || second.top + 16.0 <= 42.0, "{second:?}");
}

#[test]
fn distances_below_a_curve_are_round() {
    assert_eq!(maps::ticks(17.2), [0.0, 5.0, 10.0, 15.0]);
    assert_eq!(maps::ticks(0.29), [0.0, 0.05, 0.1, 0.15, 0.2, 0.25]);
    assert_eq!(maps::ticks(f64::MIN_POSITIVE), [0.0]);
}

/// Matches without a depth differ from false ones, and the title counts both.
#[test]
fn the_picture_of_depths_counts_its_marks() {
    let (kept, result) = neighbours(Method::FB);
    let drawn = pictures(&kept, &result);
    let (_, picture) = drawn.iter().find(|(code, _)| *code == "R4").expect("a picture");
    let count = |color: Rgb| {
        let marks = picture.large.marks.iter();
        marks.filter(|mark| mark.thing == Thing::Dot(color)).count()
    };
    let (without, wrong) = (count([0xFF; 3]), count(palette::ESTIMATE));
    assert!(without > 0 && wrong > 0);
    let says = format!("Matches: {wrong} false (orange), {without} without a depth (white)");
    assert!(picture.large.title.ends_with(&says), "{}", picture.large.title);
}

/// A camera that is turned further than the search turns: the title says both angles.
#[test]
fn a_heading_outside_the_search_is_in_the_title() {
    let (mut kept, result) = neighbours(Method::MI);
    let title = |kept: &Kept| {
        let drawn = pictures(kept, &result);
        let map = drawn.into_iter().find(|(code, _)| *code == "D4");
        map.expect("a map").1.large.title
    };
    let range_deg = Params::default().grid.yaw_range_deg;
    let turned = format!("±{range_deg}° (white); truth turned by ");
    let within = title(&kept);
    assert_eq!(within, format!("Searched: 5 m (orange), ±{range_deg}° (white)"));
    let turn = crate::geometry::yaw(90_f64.to_radians());
    kept.truth = kept.truth.map(|truth| truth * turn);
    let outside = title(&kept);
    assert!(outside.contains(&turned), "{outside}");
}

/// A reference that looks elsewhere: of what its photo shows, nothing is in the query, whatever else the scan holds.
#[test]
fn a_scan_behind_the_reference_camera_is_not_drawn_into_the_query() {
    let scenes = ["street:snow", "street:night"];
    let (kept, result) = localized(scenes, ["000122", "000138"], 15.0, Method::FB);
    let primary = &result.diagnosis[0];
    assert_eq!(primary.code.name(), "R1");
    assert!(primary.text.contains("0.0 % of its cloud"), "{}", primary.text);
    let params = Params::default();
    let picture = ProofPicture::of(&kept.case(&result, &params)).expect("a picture");
    assert!(picture.large.title.ends_with(" points"), "{}", picture.large.title);
    let [truth] = picture.beside.as_slice() else {
        panic!("{} panels", picture.beside.len());
    };
    assert!(truth.title.ends_with(": 0 points"), "{}", truth.title);
}

/// A suspect camera: the photo shows the cloud as it was stated and as another camera would have it.
#[test]
fn a_suspect_camera_is_drawn_beside_the_better_one() {
    let (kept, mut result) = neighbours(Method::FB);
    let stated = *kept.problems[0].query().intrinsics();
    let other = crate::camera::Intrinsics { fx: 0.8 * stated.fx, fy: 0.8 * stated.fy, ..stated };
    result.diagnosis = vec![crate::diagnosis::Diagnosis {
        code: crate::diagnosis::Code::X1,
        text: String::new(),
        evidence: serde_json::json!({ "camera": other }),
    }];
    let params = Params::default();
    let case = kept.case(&result, &params);
    let picture = ProofPicture::of(&case).expect("a picture");
    let [better] = picture.beside.as_slice() else {
        panic!("{} panels", picture.beside.len());
    };
    let says = |panel: &Panel, camera: &crate::camera::Intrinsics| {
        let words = format!(": {:.0} px, centre ({:.0}, ", camera.fx, camera.cx);
        assert!(panel.title.contains(&words), "{}", panel.title);
    };
    says(&picture.large, &stated);
    says(better, &other);
    assert_ne!(picture.large.picture, better.picture);
    // Two equal photos below each other: the small one is not larger.
    let places = picture.places(900.0, 560.0);
    assert!(places[0].width >= places[2].width, "{places:?}");
}

/// A square map takes the height, and the small panels have two columns where one would make them narrow.
#[test]
fn a_square_panel_is_as_high_as_the_area_and_the_others_share_the_rest() {
    let photo = crate::image::Photo::from_gray(image::GrayImage::new(1241, 376));
    let picture = ProofPicture {
        large: Panel::plain("map", 560, 560),
        below: Some(Panel::plain("way", 640, 160)),
        beside: (0..4).map(|_| Panel::photo("view", &photo)).collect(),
    };
    let places = picture.places(900.0, 440.0);
    let [large, way, small @ ..] = places.as_slice() else { panic!("{places:?}") };
    assert!(large.height > 0.9 * 440.0, "{large:?}");
    assert!(way.left > large.left + large.width, "{way:?}");
    assert!(small[0].left + small[0].width < small[2].left, "{small:?}");
    assert!(small.iter().all(|place| place.width > 200.0), "{small:?}");
}

/// A verdict on one of several references is proved by that one.
#[test]
fn the_reference_that_a_verdict_names_is_shown() {
    let (first, mut result) = neighbours(Method::FB);
    let (second, _) = localized(["street"; 2], ["000002", "000000"], 5.0, Method::FB);
    let problems = [first.problems[0].clone(), second.problems[0].clone()];
    let mut shown = |evidence: serde_json::Value| {
        result.diagnosis = vec![crate::diagnosis::Diagnosis {
            code: crate::diagnosis::Code::F1,
            text: String::new(),
            evidence,
        }];
        super::problem_of(&result, &problems).map(|problem| problem.reference().name().to_owned())
    };
    assert_eq!(shown(serde_json::json!({ "reference": "000002" })).as_deref(), Some("000002"));
    assert_eq!(shown(serde_json::json!({ "reference": "other" })).as_deref(), Some("000001"));
    assert_eq!(shown(serde_json::json!({})).as_deref(), Some("000001"));
}

/// The truth at the reference: one label for both.
#[test]
fn reference_and_truth_at_one_place_share_a_label() {
    let (kept, result) = localized(["street"; 2], ["000001"; 2], 5.0, Method::MI);
    for (code, picture) in pictures(&kept, &result) {
        let panels = picture
            .panels()
            .filter(|panel| panel.marks.iter().any(|mark| mark.thing == Thing::Reference));
        for panel in panels {
            let labels: Vec<&str> = panel.marks.iter().map(|mark| mark.label.as_str()).collect();
            assert!(!labels.contains(&"reference"), "{code}: {labels:?}");
            assert!(
                labels.iter().any(|label| label.ends_with("at the reference")),
                "{code}: {labels:?}"
            );
        }
    }
}

/// The map has the prior around the truth, and the ranked frames where they are.
#[test]
fn the_map_of_a_ranking_is_true_to_scale_and_needs_a_prior() {
    let (mut kept, mut result) = neighbours(Method::FB);
    result.diagnosis = vec![crate::diagnosis::Diagnosis {
        code: crate::diagnosis::Code::V1,
        text: String::new(),
        evidence: Default::default(),
    }];
    let truth = kept.truth.expect("the street has poses");
    let ranked = |frame: usize, ahead_m: f64| RankedReference {
        name: frame.to_string(),
        world_from_camera: Some(truth * Pose::translation(0.0, 0.0, ahead_m)),
        ranked: Ranked { frame, score: 0.5, geometry: Geometry::Unchecked },
    };
    let ranking = ReferenceRanking {
        criterion: Criterion::Words,
        candidates: 9,
        chosen: 1,
        frames: vec![ranked(7, 30.0), ranked(8, -10.0)],
    };
    let event = ReferencesRanked { ranking: ranking.into(), photos: vec![None; 2].into() };
    let told = |kept: &Kept| {
        let mut record = kept.history.records()[0].clone();
        record.event = event.clone().into();
        let records = [record];
        let params = Params::default();
        let case = ProofCase { records: &records, ..kept.case(&result, &params) };
        ProofPicture::of(&case).expect("a ranking").beside
    };
    assert!(told(&kept).is_empty(), "without a prior nothing is narrowed down");

    kept.problems[0] = kept.problems[0].clone().with_prior(Some(40.0)).expect("a prior");
    let beside = told(&kept);
    let map = &beside[0];
    let at = |label: &str| {
        let mark = map.marks.iter().find(|mark| mark.label == label);
        mark.unwrap_or_else(|| panic!("no {label}")).at
    };
    let apart = |a: [f32; 2], b: [f32; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let px_per_m = apart(at("1."), at("truth")) / 30.0;
    assert!((apart(at("2."), at("truth")) / px_per_m - 10.0).abs() < 0.01);
    let circles = map.lines.iter().filter(|line| line.points.len() == 97);
    let radii: Vec<f32> =
        circles.map(|circle| apart(circle.points[0], circle.points[48]) / 2.0 / px_per_m).collect();
    assert!((radii[0] - 40.0).abs() < 0.01 && (radii[1] - 5.0).abs() < 0.01, "{radii:?}");
}
