//! For posescope's own crates: may change in any version.
//!
//! Reading files that have an end, and writing files that are whole or not there.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs::{self, File, FileType};
use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The most of a description that a person or a program of ours wrote \[bytes\]: `run.toml`, `scene.toml`, a list,
/// parameters. What is made of it may take 70 times as much memory.
pub const DESCRIPTION: u64 = 16 << 20;
/// The most of a text with something of each frame \[bytes\], such as its pose.
pub const TABLE: u64 = 256 << 20;
/// The most of a text with something of each point of a map \[bytes\].
pub const TEXT: u64 = 1 << 30;
/// The most of a file with one scan of a laser, or one table per pixel \[bytes\]: 16 million points of KITTI.
pub const SCAN: u64 = 256 << 20;
/// The longest line of a file that is read line by line \[bytes\].
pub const LINE: u64 = 16 << 20;

/// What the names of temporary files begin with.
const TEMPORARY: &str = "tmp-posescope-";

/// Opens a file to read it. Pipes and devices are refused: reading a pipe waits for a writer, and a device may have no
/// end.
///
/// # Errors
/// The error of the system, or that the path is no file.
pub fn open(path: &Path) -> io::Result<File> {
    let found = fs::metadata(path)?.file_type();
    if !found.is_file() {
        return Err(io::Error::other(format!("a file expected, {} found", kind(found))));
    }
    File::open(path)
}

/// What a path is that is no file.
fn kind(found: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        if found.is_fifo() {
            return "a pipe";
        }
        if found.is_char_device() || found.is_block_device() {
            return "a device";
        }
        if found.is_socket() {
            return "a socket";
        }
    }
    if found.is_dir() {
        "a folder"
    } else if found.is_symlink() {
        "a link"
    } else {
        "something else"
    }
}

/// Refuses a path that is there and is no file of its own: the files of a run are never links, whose target a run would
/// change or show.
///
/// # Errors
/// The error of the system, or that the path is no file.
pub fn expect_no_link(path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.is_file() => Ok(()),
        Ok(found) => {
            Err(io::Error::other(format!("a file expected, {} found", kind(found.file_type()))))
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(error),
    }
}

/// Refuses a file that is to be changed in its place and that other folders have too, as a link of any kind.
///
/// # Errors
/// Those of [`expect_no_link`], or that the file has several names.
pub fn expect_own(path: &Path) -> io::Result<()> {
    expect_no_link(path)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let names = fs::symlink_metadata(path).map_or(1, |found| found.nlink());
        if names > 1 {
            return Err(io::Error::other(format!(
                "a file of its own expected, one with {names} names (hard links) found; copy it"
            )));
        }
    }
    Ok(())
}

/// Reads a file of at most so many bytes, or what a pipe of the command line has.
///
/// # Errors
/// The error of the system, or that the path is no file, or that it is larger.
pub fn read(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    if is_argument_pipe(path) {
        return read_pipe(path, most);
    }
    let file = open(path)?;
    let size = file.metadata()?.len();
    if size > most { Err(too_large(most)) } else { read_all(file, size, most) }
}

fn too_large(most: u64) -> io::Error {
    io::Error::other(format!("a file of at most {most} bytes expected"))
}

/// Reads to the end: the size that is announced may be wrong.
fn read_all(file: File, size: u64, most: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::with_capacity(size as usize + 1);
    file.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(too_large(most)) } else { Ok(bytes) }
}

/// Whether a path is a pipe that the shell opened for an argument of this process, as `--gps <(…)` and
/// `--gps /dev/stdin`. No file can name one: what is read must be an argument.
pub fn is_argument_pipe(path: &Path) -> bool {
    let is_opened = path.starts_with("/dev/fd") || path == Path::new("/dev/stdin");
    let is_pipe = || fs::metadata(path).is_ok_and(|found| kind(found.file_type()) == "a pipe");
    let is_given = || {
        std::env::args_os().any(|argument| {
            let value =
                argument.as_encoded_bytes().strip_suffix(path.as_os_str().as_encoded_bytes());
            value.is_some_and(|before| before.is_empty() || before.ends_with(b"="))
        })
    };
    is_opened && is_pipe() && is_given()
}

/// What a pipe has, which can be read once, and is kept for those who ask again.
fn read_pipe(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    static READ: Mutex<BTreeMap<PathBuf, Vec<u8>>> = Mutex::new(BTreeMap::new());
    let mut read = READ.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(bytes) = read.get(path) {
        return Ok(bytes.clone());
    }
    let bytes = read_all(File::open(path)?, 0, most)?;
    read.insert(path.to_owned(), bytes.clone());
    Ok(bytes)
}

/// Reads a text of at most so many bytes.
///
/// # Errors
/// Those of [`read`], or that the file is no text.
pub fn read_text(path: &Path, most: u64) -> io::Result<String> {
    let no_text = |_| io::Error::new(io::ErrorKind::InvalidData, "text in UTF-8 expected");
    String::from_utf8(read(path, most)?).map_err(no_text)
}

/// The lines of a file without their ends, each of at most [`LINE`] bytes.
///
/// # Errors
/// The error of the system, or that the path is no file.
pub fn lines(path: &Path) -> io::Result<impl Iterator<Item = io::Result<String>> + use<>> {
    let mut reader = BufReader::new(open(path)?);
    Ok(std::iter::from_fn(move || {
        let mut line = Vec::new();
        match next_line(&mut reader, &mut line) {
            Ok(0) => None,
            Ok(_) => {
                if line.last() == Some(&b'\n') {
                    line.pop();
                }
                if line.last() == Some(&b'\r') {
                    line.pop();
                }
                let no_text =
                    |_| io::Error::new(io::ErrorKind::InvalidData, "text in UTF-8 expected");
                Some(String::from_utf8(line).map_err(no_text))
            }
            Err(error) => Some(Err(error)),
        }
    }))
}

/// Appends the next line with its end, and returns its length, 0 at the end of the file.
///
/// # Errors
/// The error of the system, or a line of more than [`LINE`] bytes.
pub fn next_line(reader: &mut impl io::BufRead, line: &mut Vec<u8>) -> io::Result<usize> {
    let read = reader.by_ref().take(LINE + 1).read_until(b'\n', line)?;
    if read as u64 > LINE {
        return Err(io::Error::other(format!("lines of at most {LINE} bytes expected")));
    }
    Ok(read)
}

/// Whether a file has the name of a temporary file of ours.
pub fn is_temporary(name: &OsStr) -> bool {
    name.as_encoded_bytes().starts_with(TEMPORARY.as_bytes())
}

/// A file's name made from the name of something: letters, digits and `-_.`, at most 100 characters and 200 bytes.
pub fn file_name(name: &str) -> String {
    const BYTES: usize = 200;
    let is_plain = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    let mut bytes = 0;
    let plain = name.chars().map(|c| if is_plain(c) { c } else { '-' });
    let fits = |c: &char| {
        bytes += c.len_utf8();
        bytes <= BYTES
    };
    plain.take(LONGEST_NAME).take_while(fits).collect()
}

/// The longest name that is made for a file, without what is appended to it \[characters\].
const LONGEST_NAME: usize = 100;

/// Writes a file under a temporary name beside it, which begins with `tmp-posescope-` and ends with the same
/// extension, and gives it its name when it is complete: no reader sees half of it, and a full disk
/// leaves nothing.
///
/// # Errors
/// The error of the system.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write_whole_with(path, |file| file.write_all(bytes))
}

/// Writes a file as [`write_whole`] does, piece by piece.
///
/// # Errors
/// The error of the system or of `write`.
pub fn write_whole_with(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    replaced_with(path, write).map(drop)
}

/// Writes a file as [`write_whole`] does, and returns it, open at its end.
///
/// # Errors
/// The error of the system or of `write`.
pub fn replaced_with(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<File> {
    let suffix = path
        .extension()
        .map(|extension| format!(".{}", extension.to_string_lossy()))
        .unwrap_or_default();
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY).suffix(&suffix);
    // Not private to the user, as temporary files are, but what the umask says.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder_of(path))?;
    write(file.as_file_mut())?;
    Ok(file.persist(path)?)
}

/// The folder that a file is in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn what_has_no_end_or_is_too_large_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let said = |read: io::Result<Vec<u8>>| read.map_err(|error| error.to_string());
        let no_file = "a file expected, a folder found".to_owned();
        assert_eq!(said(read(folder.path(), 9)), Err(no_file));
        if cfg!(target_os = "linux") {
            let no_file = "a file expected, a device found".to_owned();
            assert_eq!(said(read(Path::new("/dev/zero"), 9)), Err(no_file));
        }
        let path = folder.path().join("a.txt");
        fs::write(&path, "one\r\ntwo\n\nthree").expect("writable");
        assert_eq!(read(&path, 15).expect("small enough").len(), 15);
        let too_large = "a file of at most 14 bytes expected".to_owned();
        assert_eq!(said(read(&path, 14)), Err(too_large));
        let lines: Vec<String> = lines(&path).expect("a file").flatten().collect();
        assert_eq!(lines, ["one", "two", "", "three"]);
        assert!(expect_no_link(&path).is_ok() && expect_no_link(&folder.path().join("b")).is_ok());
        assert!(expect_no_link(folder.path()).is_err());
        assert!(expect_own(&path).is_ok() && expect_own(&folder.path().join("b")).is_ok());
        fs::hard_link(&path, folder.path().join("b")).expect("writable");
        assert_eq!(expect_own(&path).is_err(), cfg!(unix));
    }

    #[test]
    fn a_name_of_anything_is_a_name_of_a_file() {
        for (name, expected) in [
            ("cam0/000003", "cam0-000003"),
            ("000070", "000070"),
            ("a b\n\u{1b}", "a-b--"),
            ("Zürich_1.x", "Zürich_1.x"),
        ] {
            assert_eq!(file_name(name), expected);
        }
        assert_eq!(file_name(&"x".repeat(300)).len(), 100);
        assert_eq!(file_name(&"東".repeat(300)), "東".repeat(66));
        assert!(is_temporary(OsStr::new("tmp-posescope-a")) && !is_temporary(OsStr::new("tmp-a")));
    }

    #[test]
    fn a_file_is_replaced_and_nothing_else_stays_behind() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.txt");
        for content in ["one", "two"] {
            write_whole(&path, content.as_bytes()).expect("writable");
            assert_eq!(fs::read_to_string(&path).expect("just written"), content);
        }
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
    }

    #[test]
    fn a_file_that_cannot_get_its_name_leaves_nothing_behind() {
        let folder = tempfile::tempdir().expect("a folder");
        let taken = folder.path().join("taken");
        fs::create_dir_all(taken.join("by a folder")).expect("writable");
        assert!(write_whole(&taken, b"bytes").is_err());
        assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn others_may_read_what_the_umask_lets_them() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().expect("a folder");
        let (whole, plain) = (folder.path().join("whole"), folder.path().join("plain"));
        write_whole(&whole, b"").expect("writable");
        fs::write(&plain, b"").expect("writable");
        let mode = |path| fs::metadata(path).expect("just written").permissions().mode();
        assert_eq!(mode(&whole), mode(&plain));
    }
}
