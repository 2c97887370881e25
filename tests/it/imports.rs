//! Imports point downwards: nobody comes back to a file by following what it imports.
//!
//! A module and the modules inside it are one place and may import each other. What a file passes on
//! with `pub use` counts as an import of the file that defines it, and tests may import what they
//! like.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The folders with the sources of the packages.
const PACKAGES: [&str; 4] =
    ["src", "crates/posescope-core/src", "crates/posescope-gpu/src", "crates/posescope-street/src"];

/// A module by its path below the crate; empty for `lib.rs`.
type Module = Vec<String>;

/// The sources of a package by module.
type Sources = BTreeMap<Module, String>;

/// Which modules each module imports.
type Graph = BTreeMap<Module, BTreeSet<Module>>;

/// A path in a source file, as it is written there.
#[derive(Debug, PartialEq)]
struct Import {
    path: Vec<String>,
    /// The name that it gets, if it is passed on with `pub use`.
    passed_on_as: Option<String>,
}

#[test]
fn no_file_is_in_a_circle_of_imports() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = BTreeSet::new();
    for package in PACKAGES {
        let mut sources = Sources::new();
        read(&root.join(package), &Vec::new(), &mut sources);
        assert!(sources.len() > 5, "{package} has moved");
        for circle in circles(&graph(&sources)) {
            let files: Vec<String> = circle.iter().map(|module| module.join("::")).collect();
            found.insert((package.to_owned(), files));
        }
    }
    assert!(found.is_empty(), "these files import each other: {found:#?}");
}

#[test]
fn the_estimators_and_the_street_depend_on_nothing_above_them() {
    let above = |package: &str| -> Vec<String> {
        let path = format!("{}/crates/{package}/Cargo.toml", env!("CARGO_MANIFEST_DIR"));
        let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
        let manifest: toml::Table = text.parse().expect("a manifest");
        let is_above = |name: &String| {
            ["rerun", "egui", "eframe", "wgpu", "posescope"]
                .iter()
                .any(|above| name.starts_with(above))
        };
        let sections = ["dependencies", "dev-dependencies", "build-dependencies"];
        sections
            .iter()
            .filter_map(|section| manifest.get(*section)?.as_table())
            .flat_map(|section| section.keys().cloned())
            .filter(is_above)
            .collect()
    };
    assert_eq!(above("posescope-core"), [""; 0]);
    assert_eq!(above("posescope-street"), ["posescope-core"]);
    let of_the_card = ["posescope-core", "wgpu", "posescope-street"];
    assert_eq!(above("posescope-gpu"), of_the_card);
}

#[test]
fn a_circle_is_found_whatever_way_it_goes_round() {
    // By `use`, by a path in the code, and past one that passes a name on; a module with what is inside it,
    // but not past one outside, nor between two inside. Nobody imports from the crate's root what is made
    // there out of the rest.
    for (files, expected) in [
        (
            "a: use crate::{b::B, c};
             b: fn f() { super::c::g(); }
             c: fn f() -> impl A + use<'a> { g(); super::d::D } #[cfg(test)] mod tests { use crate::a::A; }
             d: ",
            "",
        ),
        (
            "crate: mod a; pub use self::c::C as Other;
             a: use super::b::{self, B as D};
             b: /* use crate::d::D; */ fn f() -> crate::Other { \"use crate::d::D;\" }
             c: use super::a::A;
             d: use crate::{a, b, c};",
            "a b c",
        ),
        (
            "a: use part::Part; use other::Other;
             a::part: use super::A;
             a::other: use super::A;",
            "",
        ),
        (
            "a: use part::Part;
             a::part: use crate::b::B;
             b: use crate::a::A;",
            "a a::part b",
        ),
        (
            "a: mod part; mod other;
             a::part: use super::other::Other;
             a::other: use super::part::Part;",
            "a::other a::part",
        ),
        (
            "a: mod part; fn f() { part::g() }
             a::part: use crate::b::B;
             b: use crate::a::A;",
            "a a::part b",
        ),
        (
            "a: mod b; mod c; use b::B;
             a::b: use super::{A, c::C};
             a::c: mod d; fn f() { d::g() }
             a::c::d: use crate::a::b::B;",
            "a::b a::c a::c::d",
        ),
        ("crate: use a::A; pub struct B;\na: use crate::B;", "crate a"),
    ] {
        let module = |path: &str| -> Module {
            let parts = path.split("::").filter(|part| *part != "crate");
            parts.map(str::to_owned).collect()
        };
        let file = |line: &str| {
            let (path, source) = line.trim_start().split_once(": ").expect("a source");
            (module(path), source.to_owned())
        };
        let circles = circles(&graph(&files.lines().map(file).collect()));
        let expected: Vec<Module> = expected.split_whitespace().map(module).collect();
        assert_eq!(circles.concat(), expected, "{files}");
    }
}

/// Adds the files of a folder, but for those that hold nothing but tests.
fn read(folder: &Path, module: &Module, sources: &mut Sources) {
    let entries = fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    for path in entries.flatten().map(|entry| entry.path()) {
        let stem = path.file_stem().and_then(|stem| stem.to_str());
        let Some(stem) = stem.filter(|stem| *stem != "tests") else {
            continue;
        };
        let inside = |name: &str| [module.as_slice(), &[name.to_owned()]].concat();
        if path.is_dir() {
            read(&path, &inside(stem), sources);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let source = fs::read_to_string(&path).expect("readable");
            let of_file = if stem == "lib" { module.clone() } else { inside(stem) };
            sources.insert(of_file, source);
        }
    }
}

/// Who imports whom.
fn graph(sources: &Sources) -> Graph {
    let imports: BTreeMap<&Module, Vec<Import>> =
        sources.iter().map(|(module, source)| (module, imports(&tokens(source)))).collect();
    // What is passed on, by the module that does so and the name; none if from another package.
    let mut passed_on: BTreeMap<Module, Option<Module>> = BTreeMap::new();
    for (module, imports) in &imports {
        for import in imports {
            if let Some(name) = &import.passed_on_as {
                let from = absolute(module, &import.path, sources);
                passed_on.insert([module.as_slice(), std::slice::from_ref(name)].concat(), from);
            }
        }
    }
    let mut graph = Graph::new();
    for (module, imports) in imports {
        let imported = graph.entry(module.clone()).or_default();
        for import in imports {
            let target = absolute(module, &import.path, sources)
                .and_then(|path| file_of(path, &passed_on, sources))
                .filter(|target| target != module);
            if let Some(target) = target
                // To pass on what is inside is no use of it.
                && !(import.passed_on_as.is_some() && target.starts_with(module))
            {
                imported.insert(target);
            }
        }
    }
    graph
}

/// A path from the root of the crate; `None` if it leads to another one.
fn absolute(module: &Module, path: &[String], sources: &Sources) -> Option<Module> {
    let ups = path.iter().take_while(|part| *part == "super").count();
    match path.first().map(String::as_str)? {
        "crate" => Some(path[1..].to_vec()),
        "self" => Some([module.as_slice(), &path[1..]].concat()),
        "super" => {
            let parent = &module[..module.len().saturating_sub(ups)];
            Some([parent, &path[ups..]].concat())
        }
        first => {
            let inside = [module.as_slice(), &[first.to_owned()]].concat();
            let is_inside = sources.contains_key(&inside);
            is_inside.then(|| [module.as_slice(), path].concat())
        }
    }
}

/// The file that defines what a path names.
fn file_of(
    mut path: Module,
    passed_on: &BTreeMap<Module, Option<Module>>,
    sources: &Sources,
) -> Option<Module> {
    // A name is passed on a few times at most.
    for _ in 0..10 {
        let origin = (1..=path.len())
            .filter(|&end| !sources.contains_key(&path[..end]))
            .find_map(|end| Some((end, passed_on.get(&path[..end])?)));
        let Some((end, origin)) = origin else { break };
        let moved = [origin.as_ref()?.as_slice(), &path[end..]].concat();
        if moved == path {
            break;
        }
        path = moved;
    }
    let mut ends = (0..=path.len()).rev();
    let end = ends.find(|&end| sources.contains_key(&path[..end]))?;
    Some(path[..end].to_vec())
}

/// The circles of a graph, each sorted, but for those that only lead from a module to what is inside it
/// and back.
fn circles(graph: &Graph) -> Vec<Vec<Module>> {
    let mut circles = Vec::new();
    for component in components(graph) {
        let is_home = |home: &&Module| component.iter().all(|module| module.starts_with(home));
        // The root of the crate is no home: everybody is inside it.
        match component.iter().find(is_home).filter(|home| !home.is_empty()) {
            Some(home) => {
                let inside = |module: &&Module| *module != home && component.contains(*module);
                let imported = |by: &Module| graph[by].iter().filter(inside).cloned().collect();
                let inner = component.iter().filter(inside);
                let inner: Graph = inner.map(|module| (module.clone(), imported(module))).collect();
                circles.extend(self::circles(&inner));
            }
            None => circles.push(component),
        }
    }
    circles
}

/// The sets of two and more modules in which each can be reached from each.
fn components(graph: &Graph) -> Vec<Vec<Module>> {
    let reached: BTreeMap<&Module, BTreeSet<&Module>> = graph
        .keys()
        .map(|from| {
            let mut reached = BTreeSet::new();
            let mut open: Vec<&Module> = graph[from].iter().collect();
            while let Some(module) = open.pop() {
                if reached.insert(module) {
                    open.extend(graph.get(module).into_iter().flatten());
                }
            }
            (from, reached)
        })
        .collect();
    let mut components: Vec<Vec<Module>> = graph
        .keys()
        .map(|from| {
            let back = |to: &&&Module| reached.get(**to).is_some_and(|far| far.contains(from));
            reached[from].iter().filter(back).map(|m| (*m).clone()).collect()
        })
        .filter(|component: &Vec<Module>| component.len() > 1)
        .collect();
    components.sort();
    components.dedup();
    components
}

/// Every `use`, and every path in the code that begins with `crate`, `super`, `self` or a module that
/// is declared there.
fn imports(tokens: &[String]) -> Vec<Import> {
    let declared = tokens.windows(3).filter(|w| w[0] == "mod" && w[2] == ";");
    let modules: BTreeSet<&str> = declared.map(|w| w[1].as_str()).collect();
    let mut imports = Vec::new();
    let mut at = 0;
    while let Some(token) = tokens.get(at) {
        let before = |back: usize| at.checked_sub(back).map(|at| tokens[at].as_str());
        let is_next = |ahead: usize, wanted: &str| {
            tokens.get(at + ahead).is_some_and(|token| token == wanted)
        };
        match token.as_str() {
            // `impl Trait + use<'a>` imports nothing.
            "use" if !is_next(1, "<") => {
                let is_public = matches!(before(1), Some("pub" | ")"));
                at += 1;
                tree(tokens, &mut at, &[], is_public, &mut imports);
            }
            // Until here, `mod tests { … }` is the last thing in a file.
            "mod" if is_next(1, "tests") && is_next(2, "{") => break,
            word if is_next(1, "::")
                && (["crate", "super", "self"].contains(&word) || modules.contains(word))
                && !matches!(before(1), Some("in" | "::")) =>
            {
                let mut path = vec![token.clone()];
                at += 1;
                while tokens.get(at).is_some_and(|token| token == "::") {
                    path.extend(tokens.get(at + 1).cloned());
                    at += 2;
                }
                imports.push(Import { path, passed_on_as: None });
            }
            _ => at += 1,
        }
    }
    imports
}

/// One branch of what follows `use`; stands behind it at the end.
fn tree(
    tokens: &[String],
    at: &mut usize,
    prefix: &[String],
    is_public: bool,
    imports: &mut Vec<Import>,
) {
    let mut path = prefix.to_vec();
    while let Some(token) = tokens.get(*at) {
        *at += 1;
        match token.as_str() {
            "::" => {}
            "{" => {
                while tokens.get(*at).is_some_and(|token| token != "}") {
                    tree(tokens, at, &path, is_public, imports);
                    if tokens.get(*at).is_some_and(|token| token == ",") {
                        *at += 1;
                    }
                }
                *at += 1;
                return;
            }
            "self" if !path.is_empty() => {}
            "*" => {}
            "as" => {}
            "," | "}" | ";" => {
                *at -= 1;
                break;
            }
            name => path.push(name.to_owned()),
        }
    }
    // `a as b`: the name stands where the path goes on.
    let is_renamed = *at >= 2 && tokens[*at - 2] == "as";
    let name = path.last().cloned();
    if is_renamed {
        path.pop();
    }
    imports.push(Import { path, passed_on_as: name.filter(|_| is_public) });
}

/// Words, `::` and single characters, without comments, texts and lifetimes.
fn tokens(source: &str) -> Vec<String> {
    let text: Vec<char> = source.chars().collect();
    let starts = |at: usize, with: &str| {
        let mut rest = text[at..].iter();
        with.chars().all(|wanted| rest.next() == Some(&wanted))
    };
    let mut tokens = Vec::new();
    let mut at = 0;
    while at < text.len() {
        let from = at;
        let c = text[at];
        let is_word = |c: &char| c.is_alphanumeric() || *c == '_';
        if starts(at, "//") {
            at += text[at..].iter().take_while(|c| **c != '\n').count();
        } else if starts(at, "/*") {
            at += 2;
            while at < text.len() && !starts(at, "*/") {
                at += 1;
            }
            at += 2;
        } else if let Some(hashes) = raw_text(&text[at..]) {
            let end = format!("\"{}", "#".repeat(hashes));
            at += hashes + 2;
            while at < text.len() && !starts(at, &end) {
                at += 1;
            }
            at += hashes + 1;
        } else if c == '"' {
            at += 1;
            while at < text.len() && text[at] != '"' {
                at += if text[at] == '\\' { 2 } else { 1 };
            }
            at += 1;
        } else if c == '\'' {
            // A character, unless it is a lifetime.
            at += match (text.get(at + 1), text.get(at + 2)) {
                (Some('\\'), _) => {
                    3 + text[at + 3..].iter().take_while(|c| **c != '\'').count() + 1
                }
                (Some(_), Some('\'')) => 3,
                _ => 1 + text[at + 1..].iter().take_while(|c| is_word(c)).count(),
            };
        } else if is_word(&c) {
            at += text[at..].iter().take_while(|c| is_word(c)).count();
            tokens.push(text[from..at].iter().collect());
        } else {
            at += if starts(at, "::") { 2 } else { 1 };
            if !c.is_whitespace() {
                tokens.push(text[from..at].iter().collect());
            }
        }
    }
    tokens
}

/// The number of `#` of a raw text that begins here.
fn raw_text(text: &[char]) -> Option<usize> {
    let rest = text.strip_prefix(&['r'])?;
    let hashes = rest.iter().take_while(|c| **c == '#').count();
    (rest.get(hashes) == Some(&'"')).then_some(hashes)
}
