//! What a user of the library sees: its public names, threads of one's own, and an end at any time.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use std::{env, fs};

use posescope_core::event::KindSet;
use posescope_core::{
    Cancelled, Method, Params, Record, Sink, Trace, localize, localize_traced, rayon,
};

use crate::two_walls::solvable;

/// The public names, one a line, as the documentation lists them.
fn stored() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/public_names.txt")
}

/// Whether a text has a word between other characters.
fn names(text: &str, word: &str) -> bool {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_')).any(|other| other == word)
}

/// The names in rustdoc's `all.html`, each with its path.
fn listed(page: &str) -> BTreeSet<&str> {
    let items = page.split("<ul class=\"all-items\">").skip(1);
    let lists = items.filter_map(|rest| rest.split("</ul>").next());
    let links = lists.flat_map(|list| list.split("</a>"));
    links.filter_map(|link| Some(link.rsplit_once("\">")?.1)).collect()
}

#[test]
fn each_public_name_is_used() {
    let names_in_file = fs::read_to_string(stored()).expect("the list of names");
    let uses = include_str!("every_name.rs");
    let missing = |path: &&str| !names(uses, path.rsplit("::").next().expect("a name"));
    let missing: Vec<&str> = names_in_file.lines().filter(missing).collect();
    assert!(missing.is_empty(), "every_name.rs does not use {missing:?}");
}

/// Run by `.ci/run` after it has made the documentation.
#[test]
#[ignore = "needs the documentation: cargo doc --no-deps -p posescope-core"]
fn the_public_names_are_those_on_the_list() {
    let test = env::current_exe().expect("it runs");
    let target = test.ancestors().nth(3).expect("target/debug/deps/it");
    let page = target.join("doc/posescope_core/all.html");
    let page = fs::read_to_string(&page).unwrap_or_else(|e| panic!("{}: {e}", page.display()));
    let listed = listed(&page);
    assert!(listed.contains("localize") && listed.contains("cost::Cost"), "{listed:?}");
    let text: String = listed.iter().map(|name| format!("{name}\n")).collect();
    if env::var_os("UPDATE_DOCS").is_some() {
        fs::write(stored(), &text).expect("writable");
    }
    let stored = fs::read_to_string(stored()).expect("the list of names");
    let known: BTreeSet<&str> = stored.lines().collect();
    let added: Vec<_> = listed.difference(&known).collect();
    let removed: Vec<_> = known.difference(&listed).collect();
    assert!(
        added.is_empty() && removed.is_empty(),
        "new: {added:?}, gone: {removed:?}; UPDATE_DOCS=1 writes the list anew"
    );
}

/// Notes the threads that a run has, and stops it when asked to attend.
#[derive(Default)]
struct Watch {
    threads: BTreeSet<usize>,
}

impl Sink for Watch {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }

    fn accept(&mut self, _: &Record) -> Result<(), Cancelled> {
        self.threads.insert(rayon::current_num_threads());
        Ok(())
    }

    fn attend(&mut self) -> Result<(), Cancelled> {
        Err(Cancelled)
    }
}

#[test]
fn each_call_can_have_threads_of_its_own() {
    let problem = solvable();
    let params = Params::default();
    for method in [Method::FB, Method::MI] {
        let expected = localize(&problem, method, &params);
        thread::scope(|scope| {
            for threads in [1, 3] {
                let (problem, params, expected) = (&problem, &params, &expected);
                scope.spawn(move || {
                    let mut watch = Watch::default();
                    let mut trace = Trace::to(&mut watch);
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                    let outcome = pool
                        .expect("a pool")
                        .install(|| localize_traced(problem, method, params, &mut trace));
                    assert_eq!(outcome.as_ref(), Ok(expected));
                    assert_eq!(watch.threads, BTreeSet::from([threads]));
                });
            }
        });
    }
}

#[test]
fn a_run_ends_within_50_ms_of_being_asked_to() {
    let problem = solvable();
    let params = Params::default();
    let methods = ["fb", "pm", "mi", "hy", "nid", "fb2", "mi6", "robust"];
    for method in methods.map(|name| name.parse::<Method>().expect("registered")) {
        // How long it takes to stop when it is asked to after so many milliseconds; `None` where it was done before.
        let delay = |after_ms: u64| {
            let (stop, asked) = (AtomicBool::new(false), AtomicBool::new(false));
            let mut watch = Watch::default();
            let mut trace = Trace::watched(&mut watch, Some(&stop));
            let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
            thread::scope(|scope| {
                let clock = scope.spawn(|| {
                    thread::sleep(Duration::from_millis(after_ms));
                    let now = Instant::now();
                    asked.store(true, Ordering::Release);
                    stop.store(true, Ordering::Release);
                    now
                });
                let run = || localize_traced(&problem, method, &params, &mut trace);
                let stopped = pool.install(run);
                let ended = Instant::now();
                let was_asked = asked.load(Ordering::Acquire);
                let now = clock.join().expect("it sleeps");
                (was_asked && stopped == Err(Cancelled)).then(|| ended - now)
            })
        };
        for after_ms in [0, 3, 10, 30] {
            // Other tests use the processor too: the quickest of some tries says what the code does.
            let quickest = (0..5).filter_map(|_| delay(after_ms)).min();
            let limit = Duration::from_millis(50);
            assert!(quickest.is_none_or(|it| it <= limit), "{method}: {quickest:?}");
        }
    }
}
