//! The views of the photos and of the synthetic views.

use std::sync::Arc;

use egui::{Pos2, Rect, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use posescope::app::{App, ViewName};
use posescope::event::{
    DebugEvent, DepthsLifted, FeaturesClassified, FeaturesDetected, MatchesDecided,
    MinimumAssessed, Side, ViewRendered,
};
use posescope::features::FeatureState;
use posescope::features::Features;
use posescope::method::Method;

use crate::two_walls::CAMERA;
use crate::window::{app, finished, run_until_idle, send, setup, wait, window};

/// The small world after its run, at the end of a method, with a view in front.
fn at_end(method: Method, view: ViewName) -> Harness<'static, App> {
    let mut window = finished(setup());
    send(&mut window, |app| app.app_state_mut().select_method(method));
    send(&mut window, |app| app.app_state_mut().show_alone(Some(view)));
    window
}

fn latest<E: DebugEvent + Clone + 'static>(window: &Harness<'_, App>) -> E {
    let state = app(window);
    let event: Option<&E> = state.run().latest(state.cursor());
    event.expect("it was told").clone()
}

fn query_features(window: &Harness<'_, App>) -> Arc<Features> {
    let state = app(window);
    let mut events = state.run().all_until::<FeaturesDetected>(state.cursor());
    let event = events.find(|(_, event)| event.side == Side::Query);
    Arc::clone(&event.expect("detected").1.features)
}

/// The place of a pixel in a photo that is shown whole.
fn on_screen(photo: Rect, x: f32, y: f32) -> Pos2 {
    let scale = photo.width() / CAMERA.width as f32;
    photo.min + scale * Vec2::new(x + 0.5, y + 0.5)
}

fn click(window: &mut Harness<'_, App>, pos: Pos2) {
    window.hover_at(pos);
    window.step();
    for pressed in [true, false] {
        window.event(egui::Event::PointerButton {
            pos,
            button: egui::PointerButton::Primary,
            pressed,
            modifiers: egui::Modifiers::NONE,
        });
        window.step();
    }
    window.step();
}

/// An inlier that stands alone in the query, and its place on the screen.
fn lonely_inlier(window: &Harness<'_, App>) -> (usize, Pos2) {
    let states = latest::<FeaturesClassified>(window).states;
    let features = query_features(window);
    let area = window.get_by_label("query photo 000001").rect();
    let place = |i: usize| on_screen(area, features.keypoints[i].x, features.keypoints[i].y);
    let is_inlier = |i: &usize| matches!(states[*i], FeatureState::Inlier { .. });
    let is_lonely = |i: &usize| {
        (0..states.len()).all(|other| other == *i || place(other).distance(place(*i)) > 8.0)
    };
    let mut all = (0..states.len()).filter(is_inlier);
    let found = all.find(is_lonely).expect("an inlier that stands alone");
    (found, place(found))
}

#[test]
fn before_detection_there_are_just_the_photos() {
    let mut window = window(setup());
    run_until_idle(&mut window);
    send(&mut window, |app| app.app_state_mut().show_view(ViewName::Images));
    window.get_by_label("No features yet: FB finds them first");
    window.get_by_label("query photo 000001");
    window.get_by_label("reference photo 000000");
    assert!(window.query_by_label_contains("inlier: ").is_none());
}

#[test]
fn the_funnel_counts_every_feature_and_hides_the_states_that_are_clicked() {
    let mut window = at_end(Method::FB, ViewName::Images);
    let states = latest::<FeaturesClassified>(&window).states;
    let count = |name: &str| states.iter().filter(|state| state.name() == name).count();
    for name in FeatureState::NAMES {
        let words = name.replace('_', " ");
        window.get_by_label_contains(&format!("{words}: {}, ", count(name)));
    }
    assert!(window.query_by_label_contains("undecided: ").is_none());

    let (_, place) = lonely_inlier(&window);
    let inliers = count("inlier");
    window.get_by_label(&format!("inlier: {inliers}, shown")).click();
    window.run_steps(2);
    window.get_by_label(&format!("inlier: {inliers}, hidden"));
    click(&mut window, place);
    let selected = app(&window).options.selected_feature;
    let is_inlier = |i: usize| matches!(states[i], FeatureState::Inlier { .. });
    assert!(!selected.is_some_and(is_inlier), "it is hidden");

    let outliers = count("outlier");
    let label = format!("outlier: {outliers}, shown");
    window.get_by_label(&label).click_secondary();
    window.run_steps(2);
    window.get_by_label(&label);
    window.get_by_label(&format!("no depth: {}, hidden", count("no_depth")));
}

#[test]
fn the_matches_of_fb2_are_shown_where_nothing_else_ran() {
    let mut setup = setup();
    setup.job.task.protocol.methods = vec![Method::named("fb2")];
    let mut window = finished(setup);
    send(&mut window, |app| app.app_state_mut().show_alone(Some(ViewName::Images)));
    let states = latest::<FeaturesClassified>(&window).states;
    let inliers = states.iter().filter(|state| state.name() == "inlier").count();
    assert!(inliers > 0);
    window.get_by_label(&format!("inlier: {inliers}, shown"));
    send(&mut window, |app| app.app_state_mut().show_alone(Some(ViewName::Ransac)));
    window.get_by_label_contains("inliers by trial");
    assert!(window.query_by_label_contains("inside").is_none());
}

#[test]
fn a_clicked_match_shows_the_numbers_that_were_told_about_it() {
    let mut window = at_end(Method::FB, ViewName::Images);
    let (feature, place) = lonely_inlier(&window);
    click(&mut window, place);
    assert_eq!(app(&window).options.selected_feature, Some(feature));
    window.get_by_label(&format!("Feature {feature}: inlier"));

    let decisions = latest::<MatchesDecided>(&window).decisions;
    let found = decisions[feature].expect("a match");
    let lifted = latest::<DepthsLifted>(&window).matches;
    let lifted = lifted.iter().find(|l| l.query == feature).expect("lifted");
    let (least, greatest) = lifted.depth_range_m.expect("a depth");
    let states = latest::<FeaturesClassified>(&window).states;
    let FeatureState::Inlier { residual_px } = states[feature] else {
        panic!("an inlier");
    };
    for number in [
        format!("{:.3}", found.ratio),
        format!("{:.3}", found.distance),
        format!("{:.2} px", lifted.lidar_distance_px),
        format!("{least:.2} … {greatest:.2} m"),
        format!("{:.2} m", lifted.point.expect("a point").z),
        format!("{residual_px:.2} px"),
    ] {
        let mut said = window.query_all_by_label(&number);
        assert!(said.next().is_some(), "{number}");
    }
    window.get_by_label("query patch");
    window.get_by_label("reference patch");

    window.get_by_label("Close feature").click();
    window.run_steps(2);
    assert_eq!(app(&window).options.selected_feature, None);
}

#[test]
fn a_match_is_compared_with_the_truth_while_the_truth_is_shown() {
    let mut window = at_end(Method::FB, ViewName::Images);
    let (feature, _) = lonely_inlier(&window);
    send(&mut window, |app| {
        app.app_state_mut().options.selected_feature = Some(feature);
    });
    window.get_by_label("true match");
    window.get_by_label("Off the epipolar line");
    send(&mut window, |app| app.act("Ground truth"));
    assert!(window.query_by_label("true match").is_none());
    assert!(window.query_by_label("Off the epipolar line").is_none());
}

#[test]
fn both_photos_zoom_together_and_a_double_click_shows_them_whole() {
    let mut window = at_end(Method::FB, ViewName::Images);
    let (feature, whole) = lonely_inlier(&window);
    let area = window.get_by_label("query photo 000001").rect();
    window.hover_at(area.center());
    window.step();
    window.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: Vec2::new(0.0, 120.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: egui::Modifiers::NONE,
    });
    for _ in 0..20 {
        window.step();
    }
    // The match is elsewhere on the screen, so a click at its old place does not select it.
    click(&mut window, whole);
    assert_ne!(app(&window).options.selected_feature, Some(feature));
    send(&mut window, |app| {
        app.app_state_mut().options.selected_feature = None;
    });
    // Each step of the test takes a quarter of a second; these clicks are one second apart, the one before is earlier.
    window.ctx.options_mut(|options| options.input_options.max_double_click_delay = 1.3);
    click(&mut window, area.center());
    click(&mut window, area.center());
    send(&mut window, |app| {
        app.app_state_mut().options.selected_feature = None;
    });
    click(&mut window, whole);
    assert_eq!(app(&window).options.selected_feature, Some(feature));
}

#[test]
fn the_synthetic_view_shows_the_recorded_cost_and_place() {
    let mut window = at_end(Method::MI, ViewName::Synthetic);
    for method in [Method::MI, Method::PM] {
        send(&mut window, |app| app.app_state_mut().select_method(method));
        let event = latest::<ViewRendered>(&window);
        let cost = event.comparison.score.cost.expect("a cost");
        assert!(event.offset.right_m.abs() < 0.005 && event.offset.yaw_rad == 0.0);
        let (ahead, covered) = (event.offset.forward_m, event.comparison.score.covered);
        let caption = format!("{}, result: cost {cost:.4}, {covered} px covered", method.label());
        let caption = window.get_by_label_contains(&caption);
        let words = caption.accesskit_node().value().expect("a label");
        let place = format!("0.00 m right, {ahead:.2} m ahead, turned 0.00° left");
        assert!(words.ends_with(&place), "{words}");
        let assessed = latest::<MinimumAssessed>(&window);
        window.get_by_label(&format!("shuffled {:.4}", assessed.shuffled.expect("a cost")));
        window.get_by_label(&format!("best {:.4}", assessed.best));
        let results = app(&window).run().results();
        let mut costs = results.filter(|result| result.method == method);
        let cost = costs.find_map(|result| result.cost.clone()).expect("it has a cost");
        window.get_by_label(&format!("truth {:.4}", cost.truth.expect("known")));
    }
}

#[test]
fn a_pose_of_ones_own_has_the_costs_of_both_methods() {
    let mut window = at_end(Method::MI, ViewName::Synthetic);
    let truth = app(&window).run().loaded.as_ref().expect("loaded").truth;
    send(&mut window, |app| {
        app.app_state_mut().camera = truth;
    });
    wait(&mut window, |app| app.app_state().scoring.probe().is_some());
    window.step();
    window.get_by_label_contains("MI, trial camera: cost ");
    let probe = app(&window).scoring.probe().expect("an answer").clone();
    for (_, comparison) in &probe.comparisons {
        let cost = comparison.score.cost.expect("a cost");
        window.get_by_label(&format!("present {cost:.4}"));
    }
    window.get_by_label("PM cost from shuffled pixels to the least");
    window.get_by_label("MI cost from shuffled pixels to the least");
}

#[test]
fn the_pictures_of_the_synthetic_view_are_chosen_by_name_and_blink_with_the_query() {
    let mut window = at_end(Method::MI, ViewName::Synthetic);
    let common = ["query", "view", "blend", "residual"];
    for (method, own) in [(Method::MI, "shares"), (Method::PM, "weights")] {
        send(&mut window, |app| app.app_state_mut().select_method(method));
        for name in common.into_iter().chain([own]) {
            window.get_by_label(&format!("Show {name}")).click();
            window.run_steps(2);
            window.get_by_label(&format!("{} picture: {name}", method.label()));
        }
    }
    send(&mut window, |app| app.act("Blink between query and synthetic view"));
    let mut seen = [0, 0];
    for _ in 0..200 {
        window.step();
        for (count, name) in seen.iter_mut().zip(["query", "weights"]) {
            let label = format!("PM picture: {name}");
            *count += usize::from(window.query_by_label(&label).is_some());
        }
    }
    assert!(seen[0] > 0 && seen[1] > 0, "{seen:?}");
}

#[test]
fn both_views_draw_at_every_moment_of_a_run() {
    let mut window = at_end(Method::FB, ViewName::Images);
    send(&mut window, |app| {
        app.app_state_mut().options.selected_feature = Some(0);
    });
    let len = app(&window).run().len();
    // Every moment of FB's story, and some of the long searches.
    let mut cursor = 0;
    while cursor < len {
        for view in [ViewName::Images, ViewName::Synthetic] {
            window.state_mut().app_state_mut().show_alone(Some(view));
            send(&mut window, |app| app.app_state_mut().move_cursor(cursor));
        }
        cursor += if cursor < 12 { 1 } else { 1 + len / 97 };
    }
}

#[test]
fn the_synthetic_view_is_whole_in_a_narrow_window() {
    let mut window = at_end(Method::MI, ViewName::Synthetic);
    for width in [500.0, 700.0, 1100.0] {
        window.set_size(Vec2::new(width, 600.0));
        window.run_steps(4);
        let picture = window.get_by_label_contains("MI picture:").rect();
        assert!(picture.right() <= width, "{picture:?} of {width}");
        // Where there is room for it, a legend says what the picture is.
        let legend = window.query_by_label_contains("over the darkened query");
        assert_eq!(legend.is_some(), width > 600.0, "{width}");
    }
}
