//! The commands that README and docs show.

use std::path::{Path, PathBuf};

use pulldown_cmark::{CodeBlockKind, Event, Parser, Tag, TagEnd};

/// README and everything in `docs`.
pub fn documents() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let docs = std::fs::read_dir(root.join("docs")).expect("the docs");
    let pages = docs.map(|entry| entry.expect("a page").path());
    let mut pages: Vec<PathBuf> = pages
        .filter(|path| path.extension().is_some_and(|ending| ending == "md"))
        .chain([root.join("README.md")])
        .collect();
    pages.sort();
    pages
}

/// The lines of a page's code blocks for a shell, those that go on joined, as words without comments.
pub fn commands(page: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(page).expect("a page");
    let mut blocks = String::new();
    let mut is_shell = false;
    for event in Parser::new(&text) {
        match event {
            Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(kind))) => {
                is_shell = &*kind == "sh";
            }
            Event::End(TagEnd::CodeBlock) => is_shell = false,
            Event::Text(words) if is_shell => blocks.push_str(&words),
            _ => {}
        }
    }
    let blocks = blocks.replace("\\\n", " ");
    let lines = blocks.lines().map(|line| shlex::Shlex::new(line).collect());
    lines.filter(|words: &Vec<String>| !words.is_empty()).collect()
}

/// The arguments of posescope, where a command is one of it.
pub fn own_arguments(words: &[String]) -> Option<&[String]> {
    let is = |at: usize, word: &str| words.get(at).is_some_and(|one| one == word);
    match words {
        [first, own @ ..] if first == "posescope" => Some(own),
        [_, _] if is(0, "cargo") && is(1, "run") => Some(&[]),
        [_, _, _, own @ ..] if is(0, "cargo") && is(1, "run") && is(2, "--") => Some(own),
        _ => None,
    }
}
