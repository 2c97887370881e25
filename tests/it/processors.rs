//! Results have the same bytes on any processor: those that an emulator plays, and the one that is here.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use assert_cmd::cargo::cargo_bin;

use crate::binary::{CACHE, Said};
use crate::real_pair::authors_pair;

/// One that has nothing beyond SSE4.2, and one with AVX2 and FMA but no AVX-512.
const PROCESSORS: [&str; 2] = ["Nehalem", "Haswell"];

/// The emulator, or why there is none.
fn emulator() -> Option<PathBuf> {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&paths)
        .map(|folder| folder.join("qemu-x86_64"))
        .find(|path| path.is_file());
    match found {
        Some(path) if cfg!(target_arch = "x86_64") => Some(path),
        _ => {
            println!("skipped: no qemu-x86_64 (Debian's qemu-user)");
            None
        }
    }
}

/// The results of an evaluation, on an emulated processor or on this one.
fn results(asked: &str, processor: Option<(&Path, &str)>, folder: &Path) -> Vec<u8> {
    let binary = cargo_bin("posescope");
    let mut command = match processor {
        Some((emulator, processor)) => {
            let mut command = Command::new(emulator);
            command.args(["-cpu", processor]).arg(binary);
            command
        }
        None => Command::new(binary),
    };
    let out = processor.map_or("here", |(_, name)| name);
    let line = format!("eval {asked} --compute cpu --keep-failures 0 -q --out {out}");
    command.env("POSESCOPE_CACHE", CACHE).current_dir(folder);
    command.args(shlex::split(&line).expect("words"));
    Said::of(&command.output().expect("it starts")).ok();
    fs::read(folder.join(out).join("results.jsonl")).expect("results")
}

fn assert_same_everywhere(asked: &str, processors: &[&str]) {
    let Some(emulator) = emulator() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    // This one first: what it leaves in the cache is drawn in half a minute by the others.
    let here = results(asked, None, folder.path());
    assert!(here.len() > 1000, "{} bytes", here.len());
    for processor in processors {
        let there = results(asked, Some((&emulator, processor)), folder.path());
        assert!(there == here, "{processor} has other results");
    }
}

#[test]
#[ignore = "emulates processors; .ci/nightly runs it"]
fn a_night_photo_of_the_street_has_the_same_results_on_any_processor() {
    let asked = "street:night --query-scene street:overcast --query 70 --reference nearest:1 \
                 --radius 5 --method fb,pm,mi,hy,nid";
    assert_same_everywhere(asked, &PROCESSORS);
}

#[test]
#[ignore = "emulates processors; .ci/nightly runs it"]
fn the_real_pair_has_the_same_results_on_any_processor() {
    if let Some(sequence) = authors_pair() {
        let asked = "--query 3823 --reference nearest:1 --radius 10.5 --method fb,pm,mi";
        let asked = format!("'{}' {asked}", sequence.display());
        assert_same_everywhere(&asked, &PROCESSORS[..1]);
    }
}
