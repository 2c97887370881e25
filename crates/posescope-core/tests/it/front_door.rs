//! What a user of the library sees: its public names, threads of one's own, and an end at any time.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use std::{env, fs};

use posescope_core::event::KindSet;
use posescope_core::{
    Cancelled, Method, Params, Record, Sink, Trace, localize, localize_traced, methods, rayon,
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

/// Notes how many threads a run has.
#[derive(Default)]
struct Threads(BTreeSet<usize>);

impl Sink for Threads {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }

    fn accept(&mut self, _: &Record) -> Result<(), Cancelled> {
        self.0.insert(rayon::current_num_threads());
        Ok(())
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
                    let mut counts = Threads::default();
                    let mut trace = Trace::to(&mut counts);
                    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
                    let outcome = pool
                        .expect("a pool")
                        .install(|| localize_traced(problem, method, params, &mut trace));
                    assert_eq!(outcome.as_ref(), Ok(expected));
                    assert_eq!(counts.0, BTreeSet::from([threads]));
                });
            }
        });
    }
}

/// The processor time of this thread, which other programs do not lengthen; the clock's time where the
/// system does not say.
fn processor_time() -> Duration {
    static START: LazyLock<Instant> = LazyLock::new(Instant::now);
    let stat = fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = stat.and_then(|stat| stat.split_whitespace().next()?.parse().ok());
    nanoseconds.map_or_else(|| START.elapsed(), Duration::from_nanos)
}

/// Notes the longest time between two looks at the flag, which it keeps up.
struct Looks<'a> {
    flag: &'a AtomicBool,
    last: Duration,
    longest: Duration,
}

impl Sink for Looks<'_> {
    fn wanted(&self) -> KindSet {
        KindSet::NONE
    }

    fn accept(&mut self, _: &Record) -> Result<(), Cancelled> {
        Ok(())
    }

    fn attend(&mut self) -> Result<(), Cancelled> {
        self.flag.store(true, Ordering::Release);
        let now = processor_time();
        self.longest = self.longest.max(now - self.last);
        self.last = now;
        Ok(())
    }
}

#[test]
#[ignore = "measures processor time, which other programs on the same core lengthen"]
fn a_run_looks_at_the_flag_at_least_every_50_ms() {
    let problem = solvable();
    let params = Params::default();
    // All work is done by the thread whose time is taken.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    for method in methods() {
        let longest = pool.install(|| {
            let flag = AtomicBool::new(true);
            let last = processor_time();
            let mut looks = Looks { flag: &flag, last, longest: Duration::ZERO };
            let mut trace = Trace::watched(&mut looks, Some(&flag));
            localize_traced(&problem, method, &params, &mut trace).expect("nobody cancels");
            looks.longest.max(processor_time() - looks.last)
        });
        assert!(longest <= Duration::from_millis(50), "{method}: {longest:?}");
    }
}
