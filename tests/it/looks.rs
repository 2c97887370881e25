//! What every view looks like: pictures of each at several moments of one run, in both themes.
//!
//! After a change that is meant, `UPDATE_SNAPSHOTS=1 cargo test looks` writes them anew.

use egui_kittest::kittest::{NodeT as _, Queryable as _};
use posescope::app::{Command, views};
use posescope::method::Method;
use posescope::session::{RunMode, State};

use crate::painted::{Painted, painted};
use crate::window::{settle, setup, wait};

#[test]
fn every_view_looks_as_it_did() {
    let Some(mut painted) = painted(setup(), [760.0, 520.0]) else {
        return;
    };
    settle(&mut painted.window);
    let mut unlike = Vec::new();
    let mut shoot = |painted: &mut Painted, moment: &str, of: &[&str]| {
        let is_wanted = |entry: &&views::Entry| of.is_empty() || of.contains(&entry.name);
        for entry in views::ALL.iter().filter(is_wanted) {
            let window = &mut painted.window;
            window.state_mut().send(Command::Maximize(Some(entry.name)));
            // What is in sight asks for its thumbnails.
            window.run_steps(2);
            wait(window, |app| {
                !app.desk().is_probing() && !app.desk().queries.is_painting()
            });
            window.run_steps(4);
            if let Some(trouble) = window.query_by_label_contains("Nothing is drawn") {
                panic!("{:?}", trouble.accesskit_node().value());
            }
            let compared = painted.compare(&format!("{}-{moment}", entry.name));
            unlike.extend(compared.err());
        }
    };
    shoot(&mut painted, "waiting", &[]);
    painted.window.state_mut().send(Command::Run);
    wait(&mut painted.window, |app| {
        *app.desk().state() == State::Finished
    });
    painted
        .window
        .state_mut()
        .send(Command::SelectMethod(Method::FB));
    shoot(&mut painted, "features", &[]);
    painted
        .window
        .state_mut()
        .send(Command::SelectMethod(Method::MI));
    shoot(&mut painted, "search", &[]);
    painted.window.state_mut().send(Command::SwitchTheme);
    shoot(&mut painted, "light", &[]);
    painted
        .window
        .state_mut()
        .send(Command::SetReferences(vec![0, 2]));
    let all = posescope::fusion::Fusion::all().collect();
    painted.window.state_mut().send(Command::SetFusions(all));
    painted.window.run_steps(2);
    wait(&mut painted.window, |app| {
        *app.desk().state() == State::Finished
    });
    painted.window.state_mut().send(Command::Last);
    shoot(
        &mut painted,
        "fused",
        &["references", "fusion", "report", "space"],
    );
    assert!(unlike.is_empty(), "{}", unlike.join("\n"));
}

/// Without a run there is something to say too.
#[test]
fn every_view_bears_a_run_that_never_began() {
    let mut broken = setup();
    broken.chosen = vec![1].into();
    broken.mode = RunMode::Running;
    let mut window = crate::window::window(broken);
    settle(&mut window);
    for entry in views::ALL {
        window.state_mut().send(Command::Maximize(Some(entry.name)));
        window.run_steps(3);
    }
    assert!(window.state().desk().run().is_empty());
}
