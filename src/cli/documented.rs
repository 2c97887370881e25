//! The commands that README and docs show are commands.

use std::path::{Path, PathBuf};

use clap::Parser as _;
use pulldown_cmark::{CodeBlockKind, Event, Parser, Tag, TagEnd};

use super::args::Arguments;

/// README and everything in `docs`.
fn documents() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let docs = std::fs::read_dir(root.join("docs")).expect("the docs");
    let pages = docs.map(|entry| entry.expect("a page").path());
    pages
        .filter(|path| path.extension().is_some_and(|ending| ending == "md"))
        .chain([root.join("README.md")])
        .collect()
}

/// The lines of a page's code blocks for a shell, those that go on joined.
fn commands(text: &str) -> Vec<String> {
    let mut blocks = String::new();
    let mut is_shell = false;
    for event in Parser::new(text) {
        match event {
            Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(kind))) => {
                is_shell = &*kind == "sh";
            }
            Event::End(TagEnd::CodeBlock) => is_shell = false,
            Event::Text(words) if is_shell => blocks.push_str(&words),
            _ => {}
        }
    }
    blocks
        .replace("\\\n", " ")
        .lines()
        .map(str::to_owned)
        .collect()
}

#[test]
fn every_command_of_the_documentation_is_understood() {
    let mut seen = 0;
    for path in documents() {
        let text = std::fs::read_to_string(&path).expect("a page");
        for line in commands(&text) {
            let words: Vec<String> = shlex::Shlex::new(&line).collect();
            let words = match words
                .iter()
                .map(String::as_str)
                .collect::<Vec<_>>()
                .as_slice()
            {
                ["cargo", "run", "--", own @ ..] => {
                    own.iter().map(|word| word.to_string()).collect()
                }
                ["posescope", own @ ..] => own.iter().map(|word| word.to_string()).collect(),
                _ => continue,
            };
            let words: Vec<String> = words;
            let all = std::iter::once("posescope".to_owned()).chain(words);
            if let Err(error) = Arguments::try_parse_from(all) {
                panic!("{}: {line}\n{error}", path.display());
            }
            seen += 1;
        }
    }
    assert!(seen > 15, "{seen} commands");
}
