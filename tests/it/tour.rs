//! The moving picture of the README: from a batch of results over the cause of a failure to its remedy.

use std::borrow::Cow;
use std::sync::Arc;

use egui_kittest::Harness;
use posescope::app::{App, Setup};
use posescope::diagnosis::Grade;
use posescope::method::Method;
use posescope::scene::{self, Scene};
use posescope::session::{Job, RunMode};

use crate::painted::{PaintedWindow, painted};
use crate::window::{app, finish, run_until_idle, send, setup, wait};

/// Size of the pictures \[px\].
const SIZE: [f32; 2] = [1280.0, 720.0];

/// Waits until everything that is shown is there.
fn settle(window: &mut Harness<'_, App>) {
    window.run_steps(3);
    wait(window, |app| !app.app_state().is_working_out());
    window.run_steps(4);
}

#[test]
#[ignore = "takes half a minute; with UPDATE_DOCS=1 it writes docs/tour.gif anew"]
fn the_tour_leads_from_a_failure_to_a_right_pose() {
    let open = |name: &str| -> Arc<dyn Scene> { scene::open(name, None).expect("built in").into() };
    let (references, queries) = (open("street:snow"), open("street:night"));
    let frames = [120, 212, 232, 361, 450, 600];
    let mut setup = Setup { offered: frames.to_vec(), mode: RunMode::Running, ..setup() };
    let chosen = Vec::new().into();
    setup.job = Job { query: 120, chosen, references, queries, ..setup.job };
    setup.task.scene = "street:snow".to_owned();
    setup.task.protocol.query_scene = vec!["street:night".to_owned()];
    setup.task.protocol.radii_m = vec![15.0];
    setup.task.protocol.select("nearest:1".parse().expect("a choice"));
    setup.task.protocol.explain = 12;
    let Some(PaintedWindow { mut window, .. }) = painted(setup, SIZE) else {
        return;
    };
    run_until_idle(&mut window);
    let mut pictures = Vec::new();
    let mut take = |window: &mut Harness<'_, App>, seconds: f32| {
        settle(window);
        pictures.push((window.render().expect("a picture"), seconds));
    };
    send(&mut window, |app| app.act("Run all queries, or stop"));
    wait(&mut window, |app| app.app_state().results.len() == frames.len());
    wait(&mut window, |app| app.app_state().queries.progress().is_none());
    send(&mut window, |app| app.arrange(posescope::app::Arrangement::Batch));
    take(&mut window, 2.5);
    let result = app(&window).results[&450]
        .iter()
        .position(|result| result.method == Method::MI)
        .expect("MI ran");
    send(&mut window, |app| app.app_state_mut().open_result(450, result));
    finish(&mut window);
    take(&mut window, 2.0);
    send(&mut window, |app| app.open_selected());
    take(&mut window, 3.5);
    let explained = app(&window).run().results().find(|result| result.method == Method::MI);
    let explanation = explained.and_then(|result| result.explanation.clone()).expect("explained");
    let best = explanation.best().expect("something helped").args.clone();
    send(&mut window, |app| app.app_state_mut().try_again(&best));
    finish(&mut window);
    // What helps may be another method.
    let mended: Method = match &best[..] {
        [option, name] if option == "--method" => name.parse().expect("a method"),
        _ => Method::MI,
    };
    send(&mut window, |app| app.app_state_mut().select_method(mended));
    take(&mut window, 3.5);
    let mut results = app(&window).run().results();
    let result = results.find(|result| result.method == mended);
    assert_eq!(result.expect("it ran").grade, Grade::Right);
    if std::env::var_os("UPDATE_DOCS").is_none() {
        return;
    }

    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/tour.gif");
    let file = std::fs::File::create(path).expect("writable");
    let (width, height) = pictures[0].0.dimensions();
    let (width, height) = (width as u16, height as u16);
    let mut gif = gif::Encoder::new(file, width, height, &[]).expect("a file");
    gif.set_repeat(gif::Repeat::Infinite).expect("a file");
    for (picture, seconds) in pictures {
        let mut pixels = picture.into_raw();
        let mut frame = gif::Frame::from_rgba_speed(width, height, &mut pixels, 10);
        frame.delay = (100.0 * seconds) as u16;
        frame.buffer = Cow::Owned(frame.buffer.into_owned());
        gif.write_frame(&frame).expect("a file");
    }
}
