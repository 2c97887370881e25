//! Scene arguments, such as `street:night`, and the files of a scene's folder with their names.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::str::FromStr;

use super::SceneError;

/// The entries of a folder, in the order of their names, without hidden ones such as `._a.jpg` and `.DS_Store`.
pub(super) fn entries(folder: &Path) -> Result<Vec<PathBuf>, SceneError> {
    let io = SceneError::io(folder);
    let paths = std::fs::read_dir(folder).map_err(io)?;
    let mut paths = paths
        .map(|entry| entry.map(|entry| entry.path()).map_err(io))
        .collect::<Result<Vec<_>, _>>()?;
    let is_hidden = |path: &PathBuf| {
        path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
    };
    paths.retain(|path| !is_hidden(path));
    paths.sort();
    Ok(paths)
}

/// The files with an extension and a number as stem, by that number.
pub(super) fn numbered<N: FromStr + Ord>(
    folder: &Path,
    extension: &str,
) -> Result<BTreeMap<N, PathBuf>, SceneError> {
    let files = entries(folder)?.into_iter().filter_map(|path| {
        let number = stem(&path).parse().ok()?;
        path.extension().is_some_and(|found| found == extension).then_some((number, path))
    });
    Ok(files.collect())
}

/// The name of a file without its folder and extension.
pub(super) fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// The name of a folder, even if it is given as `.` or `..`.
pub(super) fn folder_name(folder: &Path) -> String {
    let folder = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let name = folder.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// The path of a file that a scene's files name, which must be inside the scene's folder.
pub(super) fn within(folder: &Path, name: &str) -> Result<PathBuf, String> {
    let leaves = |part: Component<'_>| !matches!(part, Component::Normal(_) | Component::CurDir);
    let name = Path::new(name);
    if name.as_os_str().is_empty() || name.components().any(leaves) {
        return Err(format!(
            "a file inside the scene's folder expected, `{}` found",
            name.display()
        ));
    }
    Ok(folder.join(name))
}

/// Where the files of a scene may lie by their real paths.
#[derive(Clone, Debug)]
pub(super) enum Bounds {
    /// Anywhere: the user named each file.
    Anywhere,
    /// In this folder, which has a file that names them.
    Folder(PathBuf),
    /// In the folder that the layout of a data set has them in, or in the one above it. These folders may be links.
    Layout,
}

/// Whether a file is a photo or a scan by the end of its name. Data sets are often made of links to these, and nobody
/// keeps a secret in one.
fn is_photo_or_scan(real: &Path) -> bool {
    const ENDINGS: [&str; 12] =
        ["png", "jpg", "jpeg", "tif", "tiff", "webp", "ply", "pcd", "las", "laz", "e57", "bin"];
    let ending = real.extension().and_then(|ending| ending.to_str()).map(str::to_lowercase);
    ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str()))
}

impl Bounds {
    /// Refuses a file that a link leads out of these bounds.
    pub fn check(&self, path: &Path) -> Result<(), SceneError> {
        let folders = match self {
            Self::Anywhere => return Ok(()),
            Self::Folder(folder) => vec![Some(folder.as_path())],
            Self::Layout if !path.is_symlink() => return Ok(()),
            Self::Layout => path.ancestors().skip(1).take(2).map(Some).collect(),
        };
        // Reading says why a file is not there.
        let Ok(real) = path.canonicalize() else { return Ok(()) };
        let here = |folder: &Path| {
            if folder.as_os_str().is_empty() { Path::new(".") } else { folder }.canonicalize()
        };
        let holds = |folder: &Path| here(folder).is_ok_and(|folder| real.starts_with(folder));
        if folders.into_iter().flatten().any(holds) || is_photo_or_scan(&real) {
            return Ok(());
        }
        Err(SceneError::expected(
            path,
            "a file inside the scene's folder expected, a link to one outside found that is no photo or scan by its \
             name; copy the file",
        ))
    }
}

/// Warns that a scene has only queries because the file of its poses is missing.
pub(super) fn warn_without_poses(place: &Path, missing: &str) {
    log::warn!(
        "{}: no {missing}, so no frame can be a reference and errors cannot be measured",
        place.display()
    );
}

/// Splits `PATH:WORD` if the word is one of these.
pub(super) fn split_word<'a>(argument: &'a str, words: &[&str]) -> (&'a Path, Option<&'a str>) {
    match argument.rsplit_once(':') {
        Some((path, word)) if words.contains(&word) => (Path::new(path), Some(word)),
        _ => (Path::new(argument), None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_leads_out_of_the_folder() {
        let folder = Path::new("scene");
        assert_eq!(within(folder, "./rgb/1.png"), Ok(folder.join("./rgb/1.png")));
        for name in ["../other.png", "rgb/../../other.png", "/etc/passwd", ""] {
            assert!(within(folder, name).is_err(), "{name}");
        }
    }

    #[test]
    fn only_known_words_are_split_off() {
        let split = |argument| split_word(argument, &["test"]);
        assert_eq!(split("a/b:test"), (Path::new("a/b"), Some("test")));
        assert_eq!(split("a/b:c"), (Path::new("a/b:c"), None));
        assert_eq!(split(r"c:\a"), (Path::new(r"c:\a"), None));
    }
}
