//! README and docs: what they link to is there.

use std::path::{Path, PathBuf};

use posescope::diagnosis::{Family, RULES};
use posescope::estimator;
use posescope::params::Params;
use pulldown_cmark::{Event, Parser, Tag, TagEnd};

fn documents() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    for folder in [root.to_owned(), root.join("docs")] {
        for entry in std::fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.extension().is_some_and(|ending| ending == "md") {
                found.push(path);
            }
        }
    }
    found
}

/// The names that headings of a page are linked by.
fn anchors(text: &str) -> Vec<String> {
    let mut anchors = Vec::new();
    let mut heading: Option<String> = None;
    for event in Parser::new(text) {
        match event {
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::Text(words) | Event::Code(words) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&words);
                }
            }
            Event::End(TagEnd::Heading(_)) => {
                let words = heading.take().unwrap_or_default().to_lowercase();
                let kept = words.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
                anchors.push(kept.map(|c| if c == ' ' { '-' } else { c }).collect());
            }
            _ => {}
        }
    }
    anchors
}

#[test]
fn every_link_within_the_project_leads_somewhere() {
    let mut seen = 0;
    for path in documents() {
        let text = std::fs::read_to_string(&path).expect("a page");
        for event in Parser::new(&text) {
            let Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) = event
            else {
                continue;
            };
            if dest_url.contains("://") {
                continue;
            }
            let (file, anchor) = match dest_url.split_once('#') {
                Some((file, anchor)) => (file, Some(anchor)),
                None => (&*dest_url, None),
            };
            let target = if file.is_empty() { path.clone() } else { path.with_file_name(file) };
            assert!(target.exists(), "{}: {dest_url}", path.display());
            if let Some(anchor) = anchor {
                let text = std::fs::read_to_string(&target).expect("a page");
                let known = anchors(&text);
                let is_known = known.iter().any(|known| known == anchor);
                assert!(is_known, "{}: {dest_url} among {known:?}", path.display());
            }
            seen += 1;
        }
    }
    assert!(seen > 30, "{seen} links");
}

#[test]
fn the_book_has_every_page() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let summary = std::fs::read_to_string(docs.join("SUMMARY.md")).expect("the contents");
    for path in documents().iter().filter(|path| path.starts_with(&docs)) {
        let name = path.file_name().expect("a name").to_string_lossy();
        let is_listed = name == "SUMMARY.md" || summary.contains(&format!("({name})"));
        assert!(is_listed, "{name} is not in the book");
    }
}

/// The table of verdicts as docs/diagnosis.md has it.
fn table_of_verdicts() -> String {
    let mut table = "\n| code | it means | applies to | needs the truth | what to do |\n\
                     |---|---|---|---|---|\n"
        .to_owned();
    for rule in RULES {
        let families: Vec<&str> = rule.applies_to.iter().map(|family| family.words()).collect();
        let applies_to = match families.len() {
            0 => "–".to_owned(),
            all if all == Family::ALL.len() => "all".to_owned(),
            _ => families.join(", "),
        };
        let conclusive = if rule.is_conclusive { " (*conclusive*)" } else { "" };
        let truth = if rule.needs_truth { "yes" } else { "no" };
        table += &format!(
            "| **{}** | {}{conclusive} | {applies_to} | {truth} | {} |\n",
            rule.code, rule.title, rule.advice
        );
    }
    table
}

#[test]
fn verdicts_in_the_docs_are_those_of_the_rules() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/diagnosis.md");
    let page = std::fs::read_to_string(&path).expect("the page");
    let begin = page.find("<!-- verdicts").expect("where the table begins");
    let begin = begin + page[begin..].find("-->").expect("its end") + "-->\n".len();
    let end = page.find("<!-- /verdicts -->").expect("where the table ends");
    let table = table_of_verdicts() + "\n";
    if std::env::var_os("UPDATE_DOCS").is_some() {
        let page = format!("{}{table}{}", &page[..begin], &page[end..]);
        std::fs::write(&path, page).expect("writable");
        return;
    }
    assert_eq!(
        &page[begin..end],
        table,
        "UPDATE_DOCS=1 cargo test verdicts_in_the_docs writes the table"
    );
}

/// Whether a method, or the retrieval, reads a parameter.
fn reads(method: &str, key: &str) -> bool {
    if method == "retrieval" {
        let groups = ["surf.", "fb.", "retrieval.", "index."];
        return groups.iter().any(|group| key.starts_with(group));
    }
    let entry = estimator::entry(method.parse().expect("a method"));
    // Tables of a cost have its descent too.
    let mut descent = Params::default();
    let _ = descent.set(&format!("{method}.search"), "descent");
    [Params::default(), descent].iter().any(|params| entry.reads(params, key))
}

/// A number that changes with the defaults that these methods read.
fn print_of(methods: &[&str]) -> String {
    let is_read = |key: &str| methods.iter().any(|method| reads(method, key));
    let rows = Params::default().list().into_iter().filter(|row| is_read(&row.key));
    let text: String = rows.map(|row| format!("{} = {}\n", row.key, row.value)).collect();
    format!("{:08x}", xxhash_rust::xxh3::xxh3_64(text.as_bytes()) >> 32)
}

#[test]
fn tables_were_made_with_the_defaults_of_today() {
    /// Before a table: the methods that it is about, and [`print_of`] them when it was made.
    const MARK: &str = "<!-- defaults of ";
    let studies = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies/README.md");
    let mut seen = 0;
    for path in documents().into_iter().chain([studies]) {
        let text = std::fs::read_to_string(&path).expect("a page");
        let marks = text.lines().enumerate().filter_map(|(at, line)| {
            Some((at + 1, line.strip_prefix(MARK)?.strip_suffix(" -->")?.split_once(": ")?))
        });
        for (line, (methods, print)) in marks {
            let now = print_of(&methods.split(", ").collect::<Vec<_>>());
            assert!(
                print == now,
                "{}:{line}: defaults of {methods} have changed since this table was made; make it \
                 again or say what has changed, then write {now}",
                path.display()
            );
            seen += 1;
        }
    }
    assert!(seen > 3, "{seen} tables");
}

#[test]
fn a_print_changes_with_what_its_method_reads() {
    let prints: Vec<_> = estimator::methods().map(|method| print_of(&[method.name()])).collect();
    for (at, print) in prints.iter().enumerate() {
        assert!(!prints[..at].contains(print), "two methods read the same");
    }
}
