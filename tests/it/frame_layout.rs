//! Where the parts of the window are: at every size nothing overlaps or wraps, and the canvas has the room.

use egui::Rect;
use egui::accesskit::Role;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use posescope::app::{App, Setup};
use posescope::estimator;
use posescope::method::Method;
use posescope::session::{Part, RunMode};

use crate::walls_scene::GREY;
use crate::window::{app, finish, send, setup, setup_at, wait};

/// Sizes of the window \[points\], and the least share of it that the canvas has.
const SIZES: [([f32; 2], f32); 4] = [
    ([1000.0, 640.0], 0.45),
    ([1280.0, 720.0], 0.40),
    ([1600.0, 1000.0], 0.45),
    ([2560.0, 1440.0], 0.45),
];

/// The labels of the toolbar, from the left.
const TOOLBAR: [&str; 13] = [
    "Menu",
    "\u{25c0}",
    "References: ",
    "\u{25b6} Run",
    "Stage",
    "Step",
    "Break",
    "Truth",
    "Compare",
    "Inspect",
    "Lecture",
    "Batch",
    "Search",
];

fn window(size: [f32; 2], setup: Setup) -> Harness<'static, App> {
    let setup = Setup { mode: RunMode::Running, ..setup };
    let mut window =
        Harness::builder().with_size(size).build_eframe(|creation| App::new(creation, setup));
    finish(&mut window);
    wait(&mut window, |app| !app.app_state().is_working_out());
    window.run_steps(3);
    window
}

fn rect(window: &Harness<'_, App>, label: &str) -> Rect {
    let mut found = window.query_all_by_label_contains(label);
    found.next().unwrap_or_else(|| panic!("{label}")).rect()
}

#[test]
fn the_canvas_has_the_room_and_the_toolbar_is_one_line_at_every_size() {
    let mut window = window(SIZES[0].0, setup_at(GREY));
    for (size, share) in SIZES {
        window.set_size(size.into());
        window.run_steps(3);
        wait(&mut window, |app| !app.app_state().is_working_out());
        window.run_steps(3);
        let canvas = window.state().canvas();
        let area = |rect: Rect| rect.width() * rect.height();
        let own = area(canvas) / (size[0] * size[1]);
        assert!(own >= share, "{size:?}: the canvas has {own:.3} of the window");
        // The proof fills the canvas in one direction, but for its margins and titles.
        let pictures = window.query_all_by_role(Role::Image).map(|node| node.rect());
        let inside = pictures.filter(|rect| canvas.contains_rect(*rect));
        let filled = inside.fold(Rect::NOTHING, |all, rect| all.union(rect)).size() / canvas.size();
        assert!(filled.max_elem() > 0.9, "{size:?}: the pictures fill {filled:?} of {canvas:?}");
        let buttons = TOOLBAR.map(|label| (label, rect(&window, label)));
        for ((left, a), (right, b)) in buttons.iter().zip(&buttons[1..]) {
            assert!(
                a.right() <= b.left() + 0.5,
                "{size:?}: {left} {a:?} and {right} {b:?} overlap"
            );
            assert!(b.bottom() <= 42.0 && b.right() <= size[0], "{size:?}: {right} {b:?}");
        }
        assert!(app(&window).options.shows_why);
    }
}

#[test]
fn all_methods_and_three_references_have_their_places() {
    let methods: Vec<Method> = estimator::methods().collect();
    let mut setup = setup();
    setup.task.protocol.methods.clone_from(&methods);
    setup.chosen = vec![0, 2].into();
    let mut window = window(SIZES[0].0, setup);
    for (size, _) in SIZES {
        window.set_size(size.into());
        window.run_steps(3);
        let whole = Rect::from_min_size(egui::Pos2::ZERO, size.into());
        let mut cells: Vec<Rect> = Vec::new();
        for method in &methods {
            let label = method.name().to_uppercase();
            let label = format!("{label}: ");
            let mut found = window.query_all_by_label_contains(&label);
            let cell = found.next().unwrap_or_else(|| panic!("{label} at {size:?}"));
            cells.push(cell.rect());
        }
        for pair in cells.windows(2) {
            assert!(pair[0].right() <= pair[1].left() + 0.5, "{size:?}: {pair:?}");
        }
        assert!(cells.iter().all(|cell| whole.contains_rect(*cell)), "{size:?}: {cells:?}");
        // Every reference can be reached.
        let last = Part::Reference(Method::FB, 1);
        send(&mut window, |app| app.app_state_mut().show_outcome(last));
        let state = app(&window);
        let here = state.run().span_at(state.cursor()).map(|span| span.part);
        assert_eq!(here, Some(last));
    }
}
