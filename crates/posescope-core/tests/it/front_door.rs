//! What a user of the library sees: its public names, threads of one's own, and what is refused.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::thread;
use std::{env, fs};

use posescope_core::diagnosis::Code;
use posescope_core::event::KindSet;
use posescope_core::{
    Cancelled, Method, Params, Record, Sink, Trace, localize, localize_traced, methods, rayon,
};

use crate::two_walls::solvable;

/// The public names, one a line, as the documentation lists them.
fn stored() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/it/public_names.txt")
}

/// The names in rustdoc's `all.html`, each with its path.
fn listed(page: &str) -> BTreeSet<&str> {
    let items = page.split("<ul class=\"all-items\">").skip(1);
    let lists = items.filter_map(|rest| rest.split("</ul>").next());
    let links = lists.flat_map(|list| list.split("</a>"));
    links.filter_map(|link| Some(link.rsplit_once("\">")?.1)).collect()
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

#[test]
fn a_hidden_module_says_first_that_it_may_change() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let lib = fs::read_to_string(source.join("lib.rs")).expect("readable");
    let hidden = lib.split("#[doc(hidden)]\npub mod ").skip(1);
    let names: Vec<&str> = hidden.filter_map(|rest| rest.split(';').next()).collect();
    assert!(names.contains(&"camera"), "{names:?}");
    for name in names {
        let module = fs::read_to_string(source.join(format!("{name}.rs"))).expect("readable");
        let first = module.lines().next();
        assert_eq!(
            first,
            Some("//! For posescope's own crates: may change in any version."),
            "{name}"
        );
    }
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

#[test]
fn what_is_asked_for_wrongly_is_no_bug() {
    let (problem, mut params) = (solvable(), Params::default());
    let refused = |method, params: &Params| {
        let failure = localize(&problem, method, params).pose.expect_err("refused");
        assert_eq!(Code::of(&failure).name(), "E6");
        failure.to_string()
    };
    let words = "There is no method `robst` (did you mean `robust`?).";
    assert_eq!(refused(Method::named("robst"), &params), words);
    assert_eq!(refused(Method::named("xyz"), &params), "There is no method `xyz`.");
    params.grid.rounds = 0;
    let words = "A parameter is not possible: `grid.rounds` takes 1 … 10, not `0`.";
    for method in methods() {
        assert_eq!(refused(method, &params), words);
    }
    params.grid.rounds = 10;
    assert!(localize(&problem, Method::FB, &params).pose.is_ok());
}
