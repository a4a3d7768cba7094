//! What leaves the program: files that are whole or not there at all, and lines on standard output.

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// What stops a command: usage, or the outside world. Printed as `error: …`, exit code 2.
#[derive(Debug)]
pub struct Failure(pub String);

impl Failure {
    pub fn at(path: &Path, what: &str, error: &io::Error) -> Failure {
        Failure(format!("cannot {what} `{}`: {error}", path.display()))
    }
}

/// Stands for standard input or output where a file is asked for.
pub const DASH: &str = "-";

/// The bytes of a file, or of standard input for `-`.
pub fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    let outcome = if path == Path::new(DASH) { read_all(io::stdin().lock()) } else { read_file(path) };
    outcome.map_err(|e| Failure::at(path, "read", &e))
}

/// The bytes of a file.
pub fn read_file(path: &Path) -> io::Result<Vec<u8>> {
    fs::File::open(path).and_then(read_all)
}

/// All there is to read, but no more than any file of ours has: a device may have no end.
pub fn read_all(from: impl Read) -> io::Result<Vec<u8>> {
    const MOST: u64 = 1 << 30;
    let mut bytes = Vec::new();
    from.take(MOST + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MOST {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, "it is larger than 1 GiB"));
    }
    Ok(bytes)
}

/// The text of a file, or of standard input for `-`.
pub fn read_text(path: &Path) -> Result<String, Failure> {
    let bytes = read(path)?;
    String::from_utf8(bytes).map_err(|e| {
        let valid = e.utf8_error().valid_up_to();
        let bytes = e.as_bytes();
        let line = 1 + bytes[..valid].iter().filter(|&&b| b == b'\n').count();
        let what = match bytes {
            [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "is UTF-16 text".to_string(),
            _ => format!("is not UTF-8 text: see line {line}"),
        };
        Failure(format!("`{}` {what}; save it as UTF-8", path.display()))
    })
}

/// Fails now if `path` could not be written later, so that nobody waits for a result that cannot be kept.
pub fn probe(path: &Path) -> Result<(), Failure> {
    if path == Path::new(DASH) || is_special(path) {
        return Ok(());
    }
    let beside = beside(&target(path));
    let outcome = if path.is_dir() {
        Err(io::Error::new(io::ErrorKind::IsADirectory, "it is a directory"))
    } else {
        fs::File::create(&beside).and_then(|_| fs::remove_file(&beside))
    };
    outcome.map_err(|e| Failure::at(path, "write", &e))
}

/// Writes a file whole: beside its place first, then renamed into it. `-` is standard output.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let outcome = if path == Path::new(DASH) {
        io::stdout().lock().write_all(bytes).or_else(closed_pipe_is_fine)
    } else if is_special(path) {
        fs::write(path, bytes)
    } else {
        replace(&target(path), bytes)
    };
    outcome.map_err(|e| Failure::at(path, "write", &e))
}

/// Makes a folder with its parents.
pub fn make_dir(path: &Path) -> Result<(), Failure> {
    fs::create_dir_all(path).map_err(|e| Failure::at(path, "create", &e))
}

/// A line on standard output. A reader that has gone away, as `head` does, is no fault.
pub fn line(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    let outcome = writeln!(out, "{text}").and_then(|()| out.flush());
    outcome.or_else(closed_pipe_is_fine).map_err(|e| Failure(format!("cannot write to standard output: {e}")))
}

/// A line on standard error, where nothing can be done about failure.
pub fn remark(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

fn closed_pipe_is_fine(error: io::Error) -> io::Result<()> {
    if error.kind() == io::ErrorKind::BrokenPipe { Ok(()) } else { Err(error) }
}

/// Pipes and devices are written to, never replaced.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|m| !m.is_file() && !m.is_dir())
}

/// The file itself where `path` is a link to it.
fn target(path: &Path) -> PathBuf {
    fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf())
}

fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let beside = beside(path);
    let written = fs::File::create(&beside).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    written.and_then(|()| fs::rename(&beside, path)).inspect_err(|_| {
        let _ = fs::remove_file(&beside);
    })
}

/// A name of our own in the same folder.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.part", std::process::id()))
}
