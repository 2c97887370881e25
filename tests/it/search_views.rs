//! The views of the search: cost surface, histogram, RANSAC.

use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use posescope::app::{App, ViewName};
use posescope::cost::Explanation;
use posescope::event::{
    ConsensusJudged, DebugEvent, FeaturesClassified, HypothesisTried, PoseScored, ViewRendered,
};
use posescope::grid::{DenseSurface, Offset, Phase};
use posescope::method::Method;
use posescope::session::{RunMode, Span};

use crate::binary::has;
use crate::window::{app, finished, run_until_idle, send, setup, wait};

/// The small world after all of its run, with a view in front.
fn after(view: ViewName) -> Harness<'static, App> {
    let mut window = finished(setup());
    send(&mut window, |app| app.app_state_mut().show_alone(Some(view)));
    window
}

fn span(window: &Harness<'_, App>, method: Method) -> Span {
    let spans = app(window).run().spans();
    let span = spans.iter().find(|span| span.part.method() == Some(method));
    span.expect("the method ran").clone()
}

/// The events of a type that a method told, with their positions.
fn told<E: DebugEvent + Clone>(window: &Harness<'_, App>, method: Method) -> Vec<(usize, E)> {
    let records = span(window, method).records;
    let all = app(window).run().records();
    records.filter_map(|at| Some((at, E::from_event(&all[at].event)?.clone()))).collect()
}

fn move_to(window: &mut Harness<'_, App>, cursor: usize) {
    window.state_mut().app_state_mut().move_cursor(cursor);
    // Obeyed in this frame, drawn in it or the next.
    window.run_steps(2);
}

/// To the last record of a method.
fn move_to_end(window: &mut Harness<'_, App>, method: Method) {
    let end = span(window, method).records.end;
    move_to(window, end - 1);
}

/// All texts that contain a part.
fn texts(window: &Harness<'_, App>, part: &str) -> Vec<String> {
    let nodes = window.query_all_by_label_contains(part);
    nodes
        .filter_map(|node| {
            let node = node.accesskit_node();
            node.label().or_else(|| node.value())
        })
        .collect()
}

/// The one text that begins with these words.
fn text(window: &Harness<'_, App>, begin: &str) -> String {
    let mut found = texts(window, begin);
    found.retain(|text| text.starts_with(begin));
    assert!(!found.is_empty(), "nothing begins with `{begin}`");
    found.swap_remove(0)
}

fn hover(window: &mut Harness<'_, App>, map: &str, right: f32, down: f32) -> Option<String> {
    let rect = window.get_by_label_contains(map).rect();
    window.hover_at(rect.min + rect.size() * egui::vec2(right, down));
    window.run_steps(2);
    let mut found = texts(window, ", coverage ");
    found.retain(|text| text.starts_with("cost "));
    found.pop()
}

/// Clicks the button whose words begin so.
fn click(window: &Harness<'_, App>, begin: &str) {
    let mut buttons = window.query_all_by_role(egui::accesskit::Role::Button);
    let is_meant = |label: Option<String>| label.is_some_and(|label| label.starts_with(begin));
    let button = buttons.find(|button| is_meant(button.accesskit_node().label()));
    button.expect("a button").click();
}

/// What the view says about a position.
fn words(scored: &PoseScored) -> String {
    let cost = scored.score.cost.expect("textured walls");
    // The sum is no negative zero.
    let [right, forward] =
        [scored.offset.right_m, scored.offset.forward_m].map(|m| (10.0 * m).round() / 10.0 + 0.0);
    let coverage = scored.coverage;
    format!("cost {cost:.4}, coverage {coverage:.2} at ({right:.1}, {forward:.1}) m")
}

#[test]
fn hovering_a_cell_tells_its_recorded_cost_and_sends_its_pose() {
    let mut window = after(ViewName::Surface);
    move_to_end(&mut window, Method::MI);
    let scored = told::<PoseScored>(&window, Method::MI);
    let mut seen = Vec::new();
    for (switch, map) in [("", "Cost map"), ("Coverage", "Coverage map"), ("Coverage", "Cost map")]
    {
        if !switch.is_empty() {
            click(&window, switch);
            window.run_steps(2);
        }
        for (right, down) in [(0.5, 0.5), (0.25, 0.5), (0.5, 0.3), (0.52, 0.34), (0.7, 0.6)] {
            let readout = hover(&mut window, map, right, down).expect("a cell");
            let (_, event) = scored
                .iter()
                .find(|(_, event)| !event.phase.is_yaw() && readout.starts_with(&words(event)))
                .unwrap_or_else(|| panic!("`{readout}` was not recorded"));
            let state = app(&window);
            let problem = &state.run().loaded.as_ref().expect("loaded").problems[0];
            let pose = problem.world_from_query(&event.offset.reference_from_camera());
            let hovered = state.hovered.expect("the pointer is over a cell");
            assert!((hovered.inverse() * pose).translation.vector.norm() < 1e-9);
            seen.push(readout);
        }
    }
    seen.sort();
    seen.dedup();
    assert!(seen.len() >= 4, "{seen:?}");
}

#[test]
fn a_map_that_is_left_by_the_pointer_or_by_a_key_shows_no_pose() {
    let mut window = after(ViewName::Surface);
    move_to_end(&mut window, Method::MI);
    let pointed_at = |window: &mut Harness<'static, App>| {
        hover(window, "Cost map", 0.5, 0.5).expect("a cell");
        // The pose stays as long as the pointer does.
        window.run_steps(3);
        assert!(app(window).hovered.is_some());
    };
    pointed_at(&mut window);
    window.hover_at(egui::pos2(5.0, 5.0));
    window.run_steps(3);
    assert_eq!(app(&window).hovered, None);
    pointed_at(&mut window);
    send(&mut window, |app| app.app_state_mut().show_alone(Some(ViewName::Space)));
    window.run_steps(2);
    assert_eq!(app(&window).hovered, None);
}

#[test]
fn a_click_takes_the_camera_to_the_cell() {
    let mut window = after(ViewName::Surface);
    move_to_end(&mut window, Method::PM);
    hover(&mut window, "Cost map", 0.25, 0.5).expect("a cell");
    let hovered = app(&window).hovered;
    let rect = window.get_by_label_contains("Cost map").rect();
    let at = rect.min + rect.size() * egui::vec2(0.25, 0.5);
    window.drag_at(at);
    window.run_steps(1);
    window.drop_at(at);
    window.run_steps(2);
    assert!(hovered.is_some());
    assert_eq!(app(&window).camera, hovered);
}

#[test]
fn the_maps_fill_as_the_cursor_goes_and_a_cell_of_half_a_search_is_as_recorded() {
    let mut window = after(ViewName::Surface);
    let scored = told::<PoseScored>(&window, Method::MI);
    for &(at, ref event) in scored.iter().filter(|(_, event)| !event.phase.is_yaw()).step_by(11) {
        move_to(&mut window, at);
        let before = |other: &&(usize, PoseScored)| other.0 <= at && other.1.phase == event.phase;
        let tried = scored.iter().filter(before).count();
        let name = text(&window, "Cost map");
        let phase = event.phase.name();
        assert!(name.contains(&format!("{phase}, {tried} of ")), "{name} at {at}");
    }
    // The first rows are those behind the reference, at the foot of the map.
    let middle = scored.iter().filter(|(_, e)| e.phase == Phase::PositionCoarse);
    let (at, _) = *middle.clone().nth(15).expect("29 positions");
    move_to(&mut window, at);
    let readout = hover(&mut window, "Cost map", 0.5, 0.75).expect("a cell that was tried");
    assert!(middle.clone().any(|(_, event)| readout.starts_with(&words(event))), "{readout}");
    let untried = hover(&mut window, "Cost map", 0.5, 0.1);
    assert_eq!(untried, None);
    text(&window, "not tried yet at (0.0, 3.0) m");
}

#[test]
fn the_nmi_that_is_shown_is_one_less_the_recorded_cost() {
    let mut window = after(ViewName::Histogram);
    for (at, view) in told::<ViewRendered>(&window, Method::MI) {
        move_to(&mut window, at);
        let cost = view.comparison.score.cost.expect("textured walls");
        let shown = text(&window, "NMI = ");
        assert!(shown.ends_with(&format!(" = {:.4}", 1.0 - cost)), "{shown}, not 1 - {cost}");
        let Some(Explanation::JointHistogram(histogram)) = &view.comparison.explanation else {
            panic!("MI explains itself by a histogram");
        };
        let bits = histogram.entropies.query / 2_f64.ln();
        let entropies = text(&window, "H(Q) = ");
        assert!(entropies.starts_with(&format!("H(Q) = {bits:.3} bit, ")), "{entropies}");
    }
}

#[test]
fn a_bin_under_the_pointer_tells_its_pairs() {
    let mut window = after(ViewName::Histogram);
    let views = told::<ViewRendered>(&window, Method::MI);
    let (at, view) = views.last().expect("the result");
    move_to(&mut window, *at);
    let Some(Explanation::JointHistogram(histogram)) = &view.comparison.explanation else {
        panic!("MI explains itself by a histogram");
    };
    let rect = window.get_by_label_contains("Joint histogram of").rect();
    window.hover_at(rect.min + rect.size() * egui::vec2(0.4, 0.6));
    window.run_steps(2);
    let found = texts(&window, " pairs (");
    let (count, rest) = found[0].split_once(' ').expect("a count");
    let numbers: Vec<usize> = rest
        .split(|c: char| !c.is_ascii_digit())
        .filter_map(|number| number.parse().ok())
        .collect();
    // "… pairs (1.23 %): query 96 to 111, synthetic 80 to 95"
    let [.., query, _, synthetic, _] = numbers[..] else {
        panic!("two ranges in `{rest}`");
    };
    let bin = query / 16 * 16 + synthetic / 16;
    assert_eq!(count, histogram.counts[bin].to_string());
}

#[test]
fn the_residuals_of_pm_say_what_was_ignored() {
    let mut window = after(ViewName::Histogram);
    move_to_end(&mut window, Method::PM);
    let views = told::<ViewRendered>(&window, Method::PM);
    let view = &views.last().expect("the result").1;
    let Some(Explanation::Weights(weights)) = &view.comparison.explanation else {
        panic!("PM explains itself by weights");
    };
    let counted = weights.counted.iter().filter(|counted| **counted).count();
    text(&window, &format!("{counted} pixels count"));
    text(&window, &format!("{} are ignored", weights.counted.len() - counted));
    let median = weights.threshold.sqrt();
    text(&window, &format!("The median difference is {median:.2}"));
}

#[test]
fn ransac_counts_the_trials_and_a_click_goes_to_one() {
    let mut window = after(ViewName::Ransac);
    let trials = told::<HypothesisTried>(&window, Method::FB);
    for (made, (at, tried)) in trials.iter().enumerate().step_by(trials.len() / 5 + 1) {
        move_to(&mut window, *at);
        let head = text(&window, &format!("{} trials made", made + 1));
        assert!(head.ends_with(&format!("{} needed", tried.trial.trials_needed)), "{head}");
        text(&window, &format!("Trial {made}"));
    }
    move_to(&mut window, trials[trials.len() - 1].0);
    window.run_steps(2);
    window.get_by_label_contains("inliers by trial").click();
    window.run_steps(3);
    let cursor = app(&window).cursor();
    let place = trials.iter().position(|(at, _)| *at == cursor);
    let place = place.expect("the cursor is at a trial");
    let middle = trials.len() / 2;
    assert!(place.abs_diff(middle) < trials.len() / 3, "trial {place}, not about {middle}");
}

#[test]
fn what_robust_takes_of_fb_and_fb2_is_shown_as_theirs() {
    let mut setup = setup();
    let robust = Method::named("robust");
    setup.job.task.protocol.methods = vec![robust];
    let mut window = finished(setup);
    let ends: Vec<(usize, FeaturesClassified)> = told(&window, robust);
    let trials: Vec<usize> =
        told::<HypothesisTried>(&window, robust).into_iter().map(|(at, _)| at).collect();
    assert_eq!(ends.len(), 2, "of FB and fb2");
    let mut begin = 0;
    for (end, classified) in &ends {
        let own: Vec<usize> =
            trials.iter().copied().filter(|at| (begin..*end).contains(at)).collect();
        send(&mut window, |app| app.app_state_mut().show_alone(Some(ViewName::Ransac)));
        for (made, at) in own.iter().enumerate().step_by(own.len() / 3 + 1) {
            move_to(&mut window, *at);
            text(&window, &format!("{} trials made", made + 1));
            text(&window, &format!("inside {}", robust.label()));
        }
        send(&mut window, |app| app.app_state_mut().show_alone(Some(ViewName::Images)));
        move_to(&mut window, *end);
        let inliers = classified.states.iter().filter(|state| state.name() == "inlier").count();
        window.get_by_label(&format!("inlier: {inliers}, shown"));
        begin = *end;
    }
    // At the end those of fb2 stay.
    let (_, classified) = &ends[1];
    move_to_end(&mut window, robust);
    let inliers = classified.states.iter().filter(|state| state.name() == "inlier").count();
    window.get_by_label(&format!("inlier: {inliers}, shown"));
}

#[test]
fn the_acceptance_test_is_told_in_words() {
    let mut window = after(ViewName::Ransac);
    let (at, judged) = told::<ConsensusJudged>(&window, Method::FB)[0].clone();
    assert!(judged.accepted);
    move_to(&mut window, at);
    text(&window, "Accepted");
    let needed = judged.acceptance.needed.expect("enough correspondences");
    text(&window, &format!("{} places of inliers ≥ {needed} needed", judged.acceptance.inliers));
    text(&window, &format!("{:.2} m from the reference ≤ 3.30 m", judged.distance_m));
}

#[test]
fn every_moment_of_a_run_can_be_drawn() {
    let mut window = after(ViewName::Surface);
    let records = app(&window).run().len();
    // Each view says what is missing, or names what it draws.
    let views: [(ViewName, &[&str]); 3] = [
        (ViewName::Surface, &["Nothing is searched yet", "Cost map"]),
        (ViewName::Histogram, &["No synthetic view yet", "Joint histogram of", "Residuals of"]),
        (ViewName::Ransac, &["No hypothesis yet", "inliers by trial"]),
    ];
    for (view, said) in views {
        send(&mut window, |app| app.app_state_mut().show_alone(Some(view)));
        for cursor in (0..records).step_by(9).chain([records - 1]) {
            move_to(&mut window, cursor);
            let count: usize = said.iter().map(|part| texts(&window, part).len()).sum();
            assert_eq!(count, 1, "{view:?} at {cursor}");
        }
        window.check_accessibility();
    }
}

#[test]
fn the_costs_from_the_result_to_the_truth_end_in_those_of_both() {
    let mut setup = setup();
    // A grid that misses the truth.
    for assignment in ["grid.coarse_step=3", "grid.fine_range=0.2"] {
        setup.task.params.assign(assignment).expect("a parameter");
    }
    let mut window = finished(setup);
    move_to_end(&mut window, Method::MI);
    send(&mut window, |app| app.app_state_mut().show_alone(Some(ViewName::Surface)));
    wait(&mut window, |app| {
        app.app_state().scoring.along(Method::MI).is_some() && !app.app_state().scoring.is_tracing()
    });
    window.run_steps(2);
    let state = app(&window);
    let along = state.scoring.along(Method::MI).expect("traced");
    let result = span(&window, Method::MI).result.expect("a result");
    let reported = result.cost.as_ref().expect("a cost");
    let at = |share: f64| {
        let found = along.scores.iter().find(|(place, _)| *place == share);
        found.expect("both ends are tried").1.expect("tried").cost.expect("covered")
    };
    assert_eq!(at(0.0), reported.best);
    assert_eq!(at(1.0), reported.truth.expect("known"));
    // In between every cost is that of a pose between the two.
    for (share, score) in along.scores.iter().step_by(7) {
        let pose = along.line.pose(*share);
        let loaded = state.run().loaded.as_deref().expect("loaded");
        let params = &state.setup.task.params;
        let estimator = posescope::estimator::entry(Method::MI).make(params);
        let compared = estimator.compare_at(&loaded.problems[0], &pose);
        assert_eq!(compared.map(|one| one.score), *score);
    }
    let words = text(&window, "Cost from the result to the truth: Cost ");
    assert!(words.contains(&format!("{:.4} at the result", reported.best)), "{words}");
    let truth = format!("{:.4} at the truth", reported.truth.expect("known"));
    assert!(words.contains(&truth), "{words}");
    let error = result.error.expect("known").translation_m;
    assert!(words.contains(&format!("{error:.2} m away")), "{words}");

    // Pointing at the middle of the picture looks at a pose between both.
    let plot = window.get_by_label_contains("Cost from the result to the truth").rect();
    window.hover_at(plot.center());
    window.run_steps(3);
    let hovered = app(&window).hovered.expect("a pose");
    let way = hovered.translation.vector - along_from(&window);
    let length = app(&window).scoring.along(Method::MI).expect("traced").line.length_m();
    assert!(way.norm() < 1.3 * length, "{way} of {length}");
    // A truth that is hidden has no line.
    send(&mut window, |app| app.act("Ground truth"));
    assert!(texts(&window, "Cost from the result").is_empty());
}

/// The dense map of MI with steps that a test has time for, filled.
fn filled_densely() -> Harness<'static, App> {
    let mut setup = setup();
    for assignment in ["surface.step=0.25", "surface.yaw_step=2.5"] {
        setup.task.params.assign(assignment).expect("a parameter");
    }
    let mut window = finished(setup);
    move_to_end(&mut window, Method::MI);
    window.state_mut().app_state_mut().show_alone(Some(ViewName::Surface));
    window.key_press(egui::Key::F);
    window.run_steps(2);
    wait(&mut window, |app| {
        app.app_state().scoring.dense_map(Method::MI).is_some()
            && !app.app_state().scoring.is_filling()
    });
    window.run_steps(2);
    window
}

/// What is known of the dense map of MI.
fn dense(window: &Harness<'_, App>) -> DenseSurface {
    let map = app(window).scoring.dense_map(Method::MI);
    map.expect("asked for").surface.as_ref().expect("small").clone()
}

#[test]
fn the_dense_map_is_the_cheapest_heading_of_each_position_and_takes_the_camera_there() {
    let mut window = filled_densely();
    let state = app(&window);
    let problem = state.run().loaded.as_ref().expect("loaded").problems[0].clone();
    let params = state.setup.task.params.clone();
    let filled = dense(&window);
    // Every quarter of a metre within 3 m, every 2.5° within 10°.
    let positions =
        (-12..=12_i32).flat_map(|right| (-12..=12_i32).map(move |ahead| (right, ahead)));
    let inside = positions.filter(|(right, ahead)| right * right + ahead * ahead <= 144);
    assert_eq!(filled.hypotheses(), 9 * inside.count());
    assert!(filled.is_complete());
    let words = text(&window, "Cost map: dense, ");
    let all = filled.hypotheses();
    assert!(words.ends_with(&format!("{all} of {all} tried")), "{words}");

    // What it says of a place is what the estimator says there.
    let estimator = posescope::estimator::entry(Method::MI).make(&params);
    let score = |offset: &Offset| {
        let pose = problem.world_from_query(&offset.reference_from_camera());
        estimator.compare_at(&problem, &pose).map(|seen| seen.score)
    };
    let (cells, least_covered) = (filled.cheapest().scores.len(), filled.cheapest().least_covered);
    let mut turned = 0;
    for (offset, best) in (0..cells).step_by(7).filter_map(|cell| filled.at(cell)) {
        assert_eq!(score(&offset), Some(best), "{offset:?}");
        turned += usize::from(offset.yaw_rad != 0.0);
        for heading in -4..=4_i32 {
            let yaw_rad = (2.5 * f64::from(heading)).to_radians();
            let other = score(&Offset { yaw_rad, ..offset }).expect("compared");
            let cost = best.eligible_cost(least_covered);
            let is_cheaper = other.eligible_cost(least_covered).is_some_and(|other| {
                // Angles that are worked out otherwise differ in the last bit.
                cost.is_none_or(|cost| other < cost - 1e-6)
            });
            assert!(!is_cheaper, "{offset:?}: {other:?}");
        }
    }
    assert!(turned > 3, "nowhere is another heading cheaper");
    let (least, best) = filled.minimum().expect("textured walls");
    let words = text(&window, "Lowest of all: cost ");
    assert!(words.contains(&format!("{:.4}", best.cost.expect("covered"))), "{words}");
    has(&words, " from the truth");

    // A click on its mark in the legend takes the camera there, heading and all.
    click(&window, "lowest of all ");
    window.run_steps(2);
    let camera = app(&window).camera.expect("taken");
    let found = Offset::of(&problem.reference_from_query(&camera));
    let off = [
        found.right_m - least.right_m,
        found.forward_m - least.forward_m,
        found.yaw_rad - least.yaw_rad,
    ];
    assert!(off.iter().all(|off| off.abs() < 1e-9), "{off:?}");
    // Pointing at a place looks from there in its cheapest heading.
    let mut headings = Vec::new();
    for (right, down) in [(0.3, 0.5), (0.4, 0.3), (0.6, 0.6), (0.7, 0.4), (0.5, 0.5)] {
        let readout = hover(&mut window, "Cost map", right, down).expect("a cell");
        let hovered = app(&window).hovered.expect("a pose");
        let there = Offset::of(&problem.reference_from_query(&hovered));
        let near = |(offset, _): &(Offset, _)| {
            (offset.right_m - there.right_m).hypot(offset.forward_m - there.forward_m) < 1e-6
        };
        let known = (0..cells).filter_map(|cell| filled.at(cell)).find(near);
        let (offset, _) = known.expect("a cell of the map");
        assert!((offset.yaw_rad - there.yaw_rad).abs() < 1e-9, "{readout}");
        let degrees = offset.yaw_rad.to_degrees();
        let side = match degrees {
            left if left > 1e-6 => format!("{left:.1}° left"),
            right if right < -1e-6 => format!("{:.1}° right", -right),
            _ => "straight ahead".to_owned(),
        };
        assert!(readout.contains(&side.replace(".0°", "°")), "{readout}: {side}");
        headings.push(degrees);
    }
    assert!(headings.iter().any(|degrees| degrees.abs() > 1.0), "{headings:?}");

    // Without it the search's own map is back, and the filled one is kept.
    window.key_press(egui::Key::F);
    window.run_steps(3);
    assert!(text(&window, "Cost map").contains("position, coarse"));
    window.key_press(egui::Key::F);
    window.run_steps(3);
    assert!(!app(&window).scoring.is_filling());
    assert!(text(&window, "Cost map").contains(&format!("{all} of {all}")));
}

#[test]
fn a_dense_map_that_nobody_looks_at_stands_still_and_is_gone_on_with() {
    let mut setup = setup();
    setup.task.params.assign("grid.yaw_range=3").expect("a parameter");
    let mut window = finished(setup);
    window.state_mut().app_state_mut().show_alone(Some(ViewName::Surface));
    move_to_end(&mut window, Method::MI);
    // Many more hypotheses than can be scored between two frames.
    window.key_press(egui::Key::F);
    let has_begun = |app: &App| {
        let map = app.app_state().scoring.dense_map(Method::MI);
        map.is_some_and(|map| map.surface.as_ref().expect("small").tried() > 0)
    };
    wait(&mut window, has_begun);
    window.state_mut().app_state_mut().show_alone(Some(ViewName::Log));
    window.run_steps(4);
    assert!(!app(&window).scoring.is_filling());
    std::thread::sleep(std::time::Duration::from_millis(50));
    window.run_steps(2);
    let stood = dense(&window);
    std::thread::sleep(std::time::Duration::from_millis(50));
    window.run_steps(2);
    assert_eq!(dense(&window).tried(), stood.tried());
    assert!(!stood.is_complete());
    window.state_mut().app_state_mut().show_alone(Some(ViewName::Surface));
    let is_done = |app: &App| {
        let map = app.app_state().scoring.dense_map(Method::MI);
        map.is_some_and(|map| map.surface.as_ref().expect("small").is_complete())
    };
    wait(&mut window, is_done);
    let whole = dense(&window);
    // What was scored twice or not at all would show in one that is filled in one go.
    let state = app(&window);
    let params = &state.setup.task.params;
    let problem = &state.run().loaded.as_ref().expect("loaded").problems[0];
    let mut grid = params.grid.clone();
    grid.coarse_step_m = 0.1;
    grid.yaw_step_deg = 0.5;
    let least_covered = whole.cheapest().least_covered;
    let mut at_once = DenseSurface::new(3.0, &grid, least_covered).expect("small");
    let estimator = posescope::estimator::entry(Method::MI).make(params);
    let scorer = estimator.scorer(problem).expect("it has a cost");
    while !at_once.is_complete() {
        at_once.score_next(&scorer);
    }
    assert_eq!(whole.tried(), at_once.tried());
    for cell in 0..whole.cheapest().scores.len() {
        assert_eq!(whole.at(cell), at_once.at(cell));
    }

    // Other parameters make it another map.
    window.state_mut().app_state_mut().set_param("grid.yaw_range", "1");
    wait(&mut window, |app| {
        let map = app.app_state().scoring.dense_map(Method::MI);
        map.is_none_or(|map| {
            map.surface.as_ref().expect("small").hypotheses() != whole.hypotheses()
        })
    });
}

fn along_from(window: &Harness<'_, App>) -> nalgebra::Vector3<f64> {
    let along = app(window).scoring.along(Method::MI);
    along.expect("traced").line.from.translation.vector
}

/// The pixels of a colour in a part of a picture.
fn pixels_of(picture: &image::RgbaImage, color: egui::Color32) -> usize {
    let [r, g, b, _] = color.to_array();
    let alike = |pixel: &&image::Rgba<u8>| {
        let off = |a: u8, b: u8| a.abs_diff(b) <= 6;
        off(pixel.0[0], r) && off(pixel.0[1], g) && off(pixel.0[2], b)
    };
    picture.pixels().filter(alike).count()
}

#[test]
fn the_truth_is_seen_whatever_else_is_there() {
    let setup = posescope::app::Setup { mode: RunMode::Running, ..setup() };
    let Some(crate::painted::PaintedWindow { mut window, .. }) =
        crate::painted::painted(setup, [760.0, 520.0])
    else {
        return;
    };
    run_until_idle(&mut window);
    window.state_mut().app_state_mut().select_method(Method::MI);
    send(&mut window, |app| app.app_state_mut().show_alone(Some(ViewName::Surface)));
    // The colour of the truth, which recordings have too.
    let [r, g, b] = posescope::palette::TRUTH;
    let truth = egui::Color32::from_rgb(r, g, b);
    let map = |window: &mut Harness<'_, App>| {
        let rect = window.get_by_label_contains("Cost map").rect();
        let picture = window.render().expect("painted");
        let [x, y, width, height] =
            [rect.left(), rect.top(), rect.width(), rect.height()].map(|side| side as u32);
        image::imageops::crop_imm(&picture, x, y, width, height).to_image()
    };
    let alone = pixels_of(&map(&mut window), truth);
    assert!(alone > 20, "{alone}");
    // The camera goes to the truth, where its own mark lies on that place too.
    send(&mut window, |app| app.app_state_mut().jump_camera(posescope::app::NamedPose::Truth));
    wait(&mut window, |app| !app.app_state().is_probing());
    window.run_steps(3);
    let beneath = pixels_of(&map(&mut window), truth);
    assert!(5 * beneath > 4 * alone, "{beneath} of {alone}");
}
