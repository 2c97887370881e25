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
