//! The commands that README and docs show are commands.

mod commands;

use clap::Parser as _;

use super::args::Arguments;
use commands::{commands, documents, own_arguments};

#[test]
fn every_command_of_the_documentation_is_understood() {
    if !std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").exists() {
        println!("skipped: a package has no docs");
        return;
    }
    let mut seen = 0;
    for page in documents() {
        for words in commands(&page) {
            let Some(own) = own_arguments(&words) else {
                continue;
            };
            let all = ["posescope"].into_iter().chain(own.iter().map(String::as_str));
            if let Err(error) = Arguments::try_parse_from(all) {
                panic!("{}: {words:?}\n{error}", page.display());
            }
            seen += 1;
        }
    }
    assert!(seen > 15, "{seen} commands");
}

#[test]
#[cfg(feature = "app")]
fn options_before_a_scene_are_those_of_its_window() {
    let line = "posescope --quiet --threads 3 --compute cpu street --query 70";
    let parsed = Arguments::try_parse_from(line.split(' ')).expect("arguments");
    let Some(super::args::Command::Open(words)) = &parsed.command else {
        panic!("another command");
    };
    let opened = super::opened_by(words, &parsed.everywhere).expect("a scene");
    assert!(matches!(opened.command, Some(super::args::Command::View(_))));
    assert!(opened.everywhere.quiet);
    assert_eq!(opened.everywhere.threads.map(std::num::NonZeroUsize::get), Some(3));
    assert_eq!(opened.everywhere.compute, super::compute::Compute::Cpu);
    let plain = super::opened_by(words, &Arguments::parse_from(["posescope"]).everywhere);
    assert!(!plain.expect("a scene").everywhere.quiet);
}
