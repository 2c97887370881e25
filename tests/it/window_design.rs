//! What the window promises of its looks, in every view, layout and theme: nothing is cut off, everything can
//! be read, and nothing untrue is said of what is not there.

use egui::epaint::ClippedShape;
use egui::{Color32, Key, Modifiers, Pos2, Rect, Shape, TextureId};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT as _, Queryable as _};
use posescope::app::{App, Setup, Tab, ViewName, views};
use posescope::method::Method;
use posescope::params::Params;
use posescope::scale::Scale;
use posescope::session::RunMode;

use crate::binary::first_metre;
use crate::window::{finish, is_said, press};
use crate::window::{results, run_until_idle, setup, wait};

/// The smallest window that the views are made for \[points\].
const SMALL: [f32; 2] = [1280.0, 800.0];

/// A window of a size whose run is over, with so many pixels to a point.
fn finished(size: [f32; 2], pixels_per_point: f32) -> Harness<'static, App> {
    finished_of(setup(), size, pixels_per_point)
}

fn finished_of(setup: Setup, size: [f32; 2], pixels_per_point: f32) -> Harness<'static, App> {
    let setup = Setup { mode: RunMode::Running, ..setup };
    let mut window = Harness::builder()
        .with_size(size)
        .with_pixels_per_point(pixels_per_point)
        .build_eframe(|creation| App::new(creation, setup));
    finish(&mut window);
    window.state_mut().app_state_mut().select_method(Method::MI);
    settle(&mut window);
    window
}

fn settle(window: &mut Harness<'_, App>) {
    window.run_steps(3);
    wait(window, |app| !app.app_state().is_working_out());
    window.run_steps(3);
}

/// A text that was drawn, with all that is known of where.
struct Drawn {
    words: String,
    rect: Rect,
    clip: Rect,
    /// Whether a number is among what an ellipsis stands for.
    loses_number: bool,
    /// The ground that its middle is on, where it is one colour.
    ground: Option<Color32>,
    /// Its colours.
    colors: Vec<Color32>,
}

/// All texts of a frame that are in sight, in the order in which they were drawn.
fn texts(shapes: &[ClippedShape]) -> Vec<Drawn> {
    let mut grounds: Vec<(Rect, Option<Color32>)> = Vec::new();
    let mut drawn = Vec::new();
    for ClippedShape { clip_rect, shape, .. } in shapes {
        take(shape, *clip_rect, &mut grounds, &mut drawn);
    }
    drawn
}

fn take(
    shape: &Shape,
    clip: Rect,
    grounds: &mut Vec<(Rect, Option<Color32>)>,
    drawn: &mut Vec<Drawn>,
) {
    match shape {
        Shape::Vec(shapes) => {
            for shape in shapes {
                take(shape, clip, grounds, drawn);
            }
        }
        Shape::Rect(rect) => {
            let is_picture = rect.brush.is_some();
            let color = (!is_picture).then_some(rect.fill);
            let is_there = is_picture || rect.fill != Color32::TRANSPARENT;
            if is_there && rect.blur_width == 0.0 {
                grounds.push((rect.rect.intersect(clip), color));
            }
        }
        Shape::Mesh(mesh) if mesh.texture_id != TextureId::default() => {
            grounds.push((mesh.calc_bounds().intersect(clip), None));
        }
        // What else is filled is a mark, whose own words are chosen for it.
        Shape::Mesh(mesh) => grounds.push((mesh.calc_bounds().intersect(clip), None)),
        Shape::Circle(circle) if circle.fill != Color32::TRANSPARENT => {
            grounds.push((shape.visual_bounding_rect().intersect(clip), None));
        }
        Shape::Path(path) if path.closed && path.fill != Color32::TRANSPARENT => {
            grounds.push((shape.visual_bounding_rect().intersect(clip), None));
        }
        Shape::Text(text) => {
            let rect = text.visual_bounding_rect();
            if !rect.is_positive() || !rect.intersects(clip) {
                return;
            }
            let sections = text.galley.job.sections.iter();
            let own = sections.map(|section| match section.format.color {
                Color32::PLACEHOLDER => text.fallback_color,
                color => color,
            });
            let colors = match text.override_text_color {
                Some(color) => vec![color],
                None => own.collect(),
            };
            drawn.push(Drawn {
                words: text.galley.text().to_owned(),
                rect,
                clip,
                loses_number: text.galley.elided && hides_number(&text.galley),
                ground: ground_at(grounds, first_row(text).intersect(clip).center()),
                colors: colors
                    .into_iter()
                    .map(|color| color.gamma_multiply(text.opacity_factor))
                    .collect(),
            });
        }
        _ => {}
    }
}

/// Whether a digit comes after the last letter that is drawn before an ellipsis.
fn hides_number(galley: &egui::Galley) -> bool {
    let drawn: usize = galley.rows.iter().map(|row| row.glyphs.len()).sum();
    let hidden = galley.text().chars().skip(drawn.saturating_sub(1));
    hidden.into_iter().any(|letter| letter.is_ascii_digit())
}

/// Where the first row of a text is: a paragraph may go around other things.
fn first_row(text: &egui::epaint::TextShape) -> Rect {
    let rows = text.galley.rows.iter();
    let mut written = rows.filter(|row| !row.glyphs.is_empty());
    let row = written.next().map(egui::epaint::text::PlacedRow::rect_without_leading_space);
    row.map_or(text.visual_bounding_rect(), |row| row.translate(text.pos.to_vec2()))
}

/// The colour that was there at a place, as the rectangles that were drawn make it.
fn ground_at(grounds: &[(Rect, Option<Color32>)], at: Pos2) -> Option<Color32> {
    let mut ground = None;
    for (_, color) in grounds.iter().filter(|(rect, _)| rect.contains(at)) {
        ground = match (ground, color) {
            (_, None) => None,
            (_, Some(color)) if color.is_opaque() => Some(*color),
            (Some(below), Some(color)) => Some(Color32::blend(below, *color)),
            (None, Some(_)) => None,
        };
    }
    ground
}

/// The contrast of two opaque colours (WCAG 2.2).
fn contrast(a: Color32, b: Color32) -> f64 {
    let luminance = |color: Color32| {
        let linear = |channel: u8| {
            let share = f64::from(channel) / 255.0;
            if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(color.r()) + 0.7152 * linear(color.g()) + 0.0722 * linear(color.b())
    };
    let (a, b) = (luminance(a) + 0.05, luminance(b) + 0.05);
    a.max(b) / a.min(b)
}

/// Where something stands that cannot be used at present: it is pale on purpose.
fn disabled(window: &Harness<'_, App>) -> Vec<Rect> {
    let nodes = window.root().children_recursive();
    let disabled = nodes.filter(|node| node.accesskit_node().is_disabled());
    disabled.map(|node| node.rect().expand(2.0)).collect()
}

/// Goes through every view alone, and through the three layouts, and tells each by its name.
fn everywhere(window: &mut Harness<'_, App>, mut see: impl FnMut(&Harness<'_, App>, &str)) {
    for key in [Key::F2, Key::F3, Key::F4] {
        press(window, Modifiers::NONE, key);
        settle(window);
        see(window, key.name());
    }
    press(window, Modifiers::NONE, Key::F2);
    for entry in views::ALL {
        window.state_mut().app_state_mut().show_alone(Some(entry.name));
        settle(window);
        see(window, entry.name.word());
    }
    window.state_mut().app_state_mut().show_alone(None);
    settle(window);
}

#[test]
fn every_word_can_be_read_on_its_ground_in_both_themes() {
    const MIN: f64 = 4.5;
    let mut window = finished(SMALL, 1.0);
    let mut unreadable = std::collections::BTreeSet::new();
    let mut judged = 0;
    for theme in [egui::Theme::Dark, egui::Theme::Light] {
        window.ctx.set_theme(theme);
        everywhere(&mut window, |window, place| {
            let pale = disabled(window);
            for text in texts(&window.output().shapes) {
                let Some(ground) = text.ground else { continue };
                if pale.iter().any(|rect| rect.contains(text.rect.center())) {
                    continue;
                }
                judged += 1;
                // Numbers of an axis fade in as one zooms.
                let is_tick = text.words.parse::<f64>().is_ok();
                for color in text.colors {
                    if is_tick && !color.is_opaque() {
                        continue;
                    }
                    let seen = Color32::blend(ground, color);
                    let contrast = contrast(seen, ground);
                    if contrast < MIN && !text.words.trim().is_empty() {
                        let words: String = text.words.chars().take(40).collect();
                        unreadable.insert(format!(
                            "{theme:?} {place}: {contrast:.1} {color:?} on {ground:?}: {words}"
                        ));
                    }
                }
            }
        });
    }
    assert!(judged > 2000, "{judged}");
    let unreadable: Vec<String> = unreadable.into_iter().collect();
    assert!(unreadable.is_empty(), "{}", unreadable.join("\n"));
}

/// Views that are wider than their room on purpose, and are moved sideways.
const SIDEWAYS: [&str; 3] = ["batch", "lockstep", "F4"];

#[test]
fn no_word_is_cut_off_at_any_scale() {
    let mut cut = std::collections::BTreeSet::new();
    for (size, scale) in [(SMALL, 1.0), ([1500.0, 950.0], 1.5), ([1500.0, 950.0], 2.0)] {
        let mut window = finished(size, scale);
        assert_eq!(window.ctx.pixels_per_point(), scale);
        everywhere(&mut window, |window, place| {
            for text in texts(&window.output().shapes) {
                let visible = text.rect.intersect(text.clip);
                let missing = text.rect.width() - visible.width();
                let is_cut = missing > 3.0 && !SIDEWAYS.contains(&place);
                if is_cut || text.loses_number {
                    let words: String = text.words.chars().take(60).collect();
                    cut.insert(format!("{size:?} at {scale}, {place}: {missing:.0} of {words}"));
                }
            }
        });
    }
    let cut: Vec<String> = cut.into_iter().collect();
    assert!(cut.is_empty(), "{}", cut.join("\n"));
}

#[test]
fn all_buttons_of_the_bars_are_in_the_window() {
    for (size, scale) in [(SMALL, 1.0), ([1500.0, 950.0], 1.5), ([1500.0, 950.0], 2.0)] {
        let window = finished(size, scale);
        let whole = Rect::from_min_size(Pos2::ZERO, size.into()).expand(0.5);
        for label in [
            "Menu", "▶ Run", "Stage", "Step", "Break", "Truth", "Compare", "Inspect", "Batch",
            "Search", "?",
        ] {
            let rect = window.get_by_label(label).rect();
            assert!(whole.contains_rect(rect), "{label} at {rect:?} of {size:?}");
        }
    }
}

#[test]
fn a_long_line_of_the_log_is_broken_and_none_is_cut() {
    let mut window = finished([820.0, 520.0], 1.0);
    window.state_mut().app_state_mut().show_alone(Some(ViewName::Log));
    settle(&mut window);
    let shapes = &window.output().shapes;
    let log: Vec<Drawn> = texts(shapes);
    assert!(log.len() > 10);
    for text in log {
        assert!(text.rect.right() <= text.clip.right() + 1.0, "{}", text.words);
    }
}

#[test]
fn the_decision_at_the_cursor_stays_in_sight_when_the_window_shrinks() {
    let mut window = finished([820.0, 950.0], 1.0);
    window.state_mut().app_state_mut().show_alone(Some(ViewName::Log));
    settle(&mut window);
    let found = results(&window);
    let found = found.iter().find(|result| result.method == Method::MI);
    let best = found.and_then(|found| found.cost.as_ref()).expect("a cost");
    let decision = format!("result: cost {:.4}", best.best);
    let row = |window: &Harness<'_, App>| -> Option<Rect> {
        let mut rows = window.root().children_recursive();
        let said = |words: Option<String>| words.is_some_and(|words| words.contains(&decision));
        let row = rows.find(|row| said(row.accesskit_node().value()))?;
        let whole = window.ctx.content_rect();
        Some(row.rect()).filter(|rect| whole.contains_rect(*rect))
    };
    assert!(row(&window).is_some());
    window.set_size([820.0, 420.0].into());
    settle(&mut window);
    assert!(row(&window).is_some());
}

/// What is said where there is nothing to show names what would be there, and what to do.
#[test]
fn empty_views_say_what_to_do() {
    let mut waiting = crate::window::window(setup());
    run_until_idle(&mut waiting);
    for (view, words) in [
        (ViewName::Surface, "Nothing is searched yet"),
        (ViewName::Batch, "No query was run yet: Run all"),
        (ViewName::Charts, "No results match. Run all queries"),
        (ViewName::Fusion, "reference"),
    ] {
        waiting.state_mut().app_state_mut().show_alone(Some(view));
        waiting.run_steps(3);
        assert!(is_said(&waiting, words), "{view:?}");
        // Nothing has failed before anything ran.
        assert!(!is_said(&waiting, "failed:"), "{view:?}");
    }
}

#[test]
fn where_lengths_have_no_unit_no_view_names_metres() {
    let metric = setup();
    let mut model = setup();
    let paper = Scale::PAPER;
    model.job.task.params = Params::at_scale(Scale::of_depth(10.0 * paper.metre(), false));
    let metres_of = |setup: Setup| {
        let mut window = finished_of(setup, SMALL, 1.0);
        let mut found = std::collections::BTreeSet::new();
        for (tab, _) in Tab::ALL {
            window.state_mut().app_state_mut().show_tab(tab);
            everywhere(&mut window, |window, place| {
                let texts = texts(&window.output().shapes);
                let metres = texts.iter().filter_map(|text| first_metre(&text.words));
                found.extend(metres.map(|metre| format!("{place}: {metre}")));
            });
        }
        found
    };
    let metres = metres_of(metric);
    assert!(metres.len() > 20, "{metres:#?}");
    let metres = metres_of(model);
    assert!(metres.is_empty(), "{metres:#?}");
}
