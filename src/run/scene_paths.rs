//! What scenes are: their paths, however they are spelt, and labels that tell them apart.

use std::path::{Component, Path, PathBuf};

/// A scene or file argument with its canonical path; what follows a colon stays. `None` if there is no such path, as
/// for the built-in street.
pub fn canonical(argument: &str) -> Option<String> {
    let (path, word) = split(argument)?;
    Some(format!("{}{word}", path.canonicalize().ok()?.to_str()?))
}

/// Whether two arguments name one path. Arguments that are no paths are equal if their texts are.
pub fn is_same(one: &str, other: &str) -> bool {
    one == other || canonical(one).is_some_and(|one| canonical(other).as_ref() == Some(&one))
}

/// An argument as a path relative to an existing folder. `None` if there is no such path.
pub(super) fn relative_to(folder: &Path, argument: &str) -> Option<String> {
    let (path, word) = split(argument)?;
    let (folder, path) = (folder.canonicalize().ok()?, path.canonicalize().ok()?);
    let (from, to): (Vec<_>, Vec<_>) = (folder.components().collect(), path.components().collect());
    let common = from.iter().zip(&to).take_while(|(from, to)| from == to).count();
    let above = std::iter::repeat_n("..", from.len() - common).map(str::to_owned);
    let below = to[common..].iter().map(|part| part.as_os_str().to_string_lossy().into_owned());
    // Without a common root, as on two drives of Windows, the path stays absolute.
    let parts: Vec<String> = above.chain(below).collect();
    let relative = match (common, parts.is_empty()) {
        (0, _) => path.to_str()?.to_owned(),
        (_, true) => ".".to_owned(),
        _ => parts.join("/"),
    };
    Some(relative + word)
}

/// What finds the path now that is stored as `relative` to a folder: the argument if it still does.
pub(super) fn found_again(folder: &Path, relative: &str, argument: &str) -> String {
    let Some(stored) = folder.join(relative).to_str().and_then(canonical) else {
        return argument.to_owned();
    };
    if canonical(argument).as_ref() == Some(&stored) {
        return argument.to_owned();
    }
    let here = std::env::current_dir().and_then(|here| here.canonicalize());
    let below = here
        .ok()
        .and_then(|here| Some(Path::new(&stored).strip_prefix(here).ok()?.to_str()?.to_owned()));
    below.filter(|below| !below.is_empty()).unwrap_or(stored)
}

/// The path at the beginning of an argument, and what follows it: `:test`, or nothing.
fn split(argument: &str) -> Option<(&Path, &str)> {
    let path = Path::new(argument);
    if path.exists() {
        return Some((path, ""));
    }
    let colon = argument.rfind(':')?;
    let (path, word) = argument.split_at(colon);
    Path::new(path).exists().then_some((Path::new(path), word))
}

/// A label for each scene, from its argument and its name: the name, or where several scenes share it, also the folders
/// that tell them apart, as in `q1/night` and `q2/night`. The same scene, given twice, has one label.
pub fn labels(scenes: &[(&str, &str)]) -> Vec<String> {
    let places: Vec<Option<String>> =
        scenes.iter().map(|(argument, _)| canonical(argument)).collect();
    let label = |at: usize| {
        let name = scenes[at].1;
        let Some(place) = &places[at] else {
            return name.to_owned();
        };
        let rivals: Vec<&str> = (0..scenes.len())
            .filter(|&other| scenes[other].1 == name && places[other] != places[at])
            .map(|other| places[other].as_deref().unwrap_or_default())
            .collect();
        let own = folders(place);
        let tells_apart = |count: &usize| {
            rivals.iter().all(|rival| tail(&folders(rival), *count) != tail(&own, *count))
        };
        match (1..=own.len()).find(tells_apart) {
            _ if rivals.is_empty() => name.to_owned(),
            Some(count) => with_folders(name, &own[own.len() - count..]),
            None => format!("{name} ({})", scenes[at].0),
        }
    };
    (0..scenes.len()).map(label).collect()
}

/// The folders of a scene.
fn folders(place: &str) -> Vec<String> {
    let path = split(place).map_or(Path::new(place), |(path, _)| path);
    let folder = if path.is_file() { path.parent().unwrap_or(path) } else { path };
    let normal = folder.components().filter_map(|part| match part {
        Component::Normal(name) => Some(name.to_string_lossy().into_owned()),
        _ => None,
    });
    normal.collect()
}

fn tail(folders: &[String], count: usize) -> &[String] {
    &folders[folders.len().saturating_sub(count)..]
}

/// A scene's name with the folders above its own, which the name may contain: `kitti/a/00` for `kitti/00` in `a`.
fn with_folders(name: &str, folders: &[String]) -> String {
    let own = folders.last().and_then(|own| name.rfind(own.as_str()));
    match (own, folders.split_last()) {
        (Some(at), Some((_, above))) if !above.is_empty() => {
            format!("{}{}/{}", &name[..at], above.join("/"), &name[at..])
        }
        _ => format!("{}/{name}", folders.join("/")),
    }
}

/// A path with the same characters on all systems.
pub(super) fn of_text(path: &Path, change: &dyn Fn(&str) -> String) -> PathBuf {
    path.to_str().map_or_else(|| path.to_owned(), |text| change(text).into())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use tempfile::TempDir;

    use super::*;

    #[test]
    fn only_scenes_that_share_a_name_are_told_apart_by_their_folders() {
        let root = TempDir::new().expect("a folder");
        let path = |name: &str| {
            let path = root.path().join(name);
            fs::create_dir_all(&path).expect("writable");
            path.to_str().expect("plain").to_owned()
        };
        let labels = |scenes: &[(&str, &str)]| {
            let paths: Vec<String> = scenes.iter().map(|(folder, _)| path(folder)).collect();
            let scenes = paths.iter().zip(scenes).map(|(path, (_, name))| (path.as_str(), *name));
            super::labels(&scenes.collect::<Vec<_>>())
        };
        assert_eq!(
            labels(&[("q1/night", "night"), ("q2/night", "night")]),
            ["q1/night", "q2/night"]
        );
        assert_eq!(labels(&[("q1/night", "night"), ("q1/day", "day")]), ["night", "day"]);
        assert_eq!(
            labels(&[("q1/night", "night"), ("q1/../q1/night/", "night")]),
            ["night", "night"]
        );
        assert_eq!(
            labels(&[("a/00", "kitti/00"), ("b/00", "kitti/00")]),
            ["kitti/a/00", "kitti/b/00"]
        );
        assert_eq!(labels(&[("a", "room"), ("b", "room")]), ["a/room", "b/room"]);
        let deep = [("x/a/00", "00"), ("y/a/00", "00"), ("y/b/00", "00")];
        assert_eq!(labels(&deep), ["x/a/00", "y/a/00", "b/00"]);
        assert_eq!(
            super::labels(&[("street", "street"), ("street", "street")]),
            ["street", "street"]
        );
    }

    #[test]
    fn a_path_is_stored_relative_to_a_folder_and_found_from_it() {
        let root = TempDir::new().expect("a folder");
        let [run, scene] = ["runs/first", "data/seq"].map(|name| root.path().join(name));
        for folder in [&run, &scene] {
            fs::create_dir_all(folder).expect("writable");
        }
        let argument = format!("{}:test", scene.display());
        assert_eq!(relative_to(&run, &argument).as_deref(), Some("../../data/seq:test"));
        assert_eq!(relative_to(&run, "street:night"), None);
        assert!(is_same(&argument, &format!("{}/../seq/:test", scene.display())));
        assert!(!is_same(&argument, scene.to_str().expect("plain")));
        let found = found_again(&run, "../../data/seq:test", "seq:test");
        assert!(is_same(&found, &argument), "{found}");
        assert_eq!(found_again(&run, "../gone", "seq"), "seq");
        assert_eq!(found_again(&run, "../../data/seq:test", &argument), argument);
    }
}
