//! Where photos come from: files, folders, standard input, and a folder that is watched.
//!
//! In: what the command line names. Out: a photo's name and bytes, one after the other. Never looks at a pixel.

use super::output::{self, DASH, Failure};
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io::{self, BufRead, Read};
use std::path::{Path, PathBuf};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime};

/// Files of these kinds are photos when a folder is named.
const KINDS: [&str; 6] = ["png", "jpg", "jpeg", "tif", "tiff", "bmp"];

/// Time between two looks at a watched folder.
const PAUSE: Duration = Duration::from_millis(50);
/// A file that has not grown for so long may be complete.
const SETTLED: Duration = Duration::from_millis(150);
/// A file that cannot be read as an image is given so long to become one: writers pause.
const PATIENCE: Duration = Duration::from_secs(2);

/// The photos named: folders are replaced by what is in them, in the order of names.
pub fn listed(named: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut photos = Vec::new();
    for path in named {
        if path.is_dir() {
            let found: Vec<PathBuf> = in_folder(path)?.into_keys().collect();
            if found.is_empty() {
                let kinds = KINDS.join(", ");
                return Err(Failure(format!("there is no photo in `{}` ({kinds})", path.display())));
            }
            photos.extend(found);
        } else {
            photos.push(path.clone());
        }
    }
    Ok(photos)
}

/// What standard input holds: one image, or the names of photos, one a line, each judged as soon as its line is there.
pub fn standard_input(mut each: impl FnMut(&Path, Option<Vec<u8>>) -> Result<(), Failure>) -> Result<(), Failure> {
    let failed = |e: io::Error| Failure::at(Path::new(DASH), "read", &e);
    let mut input = io::stdin().lock();
    let start = beginning(&mut input).map_err(failed)?;
    if is_image(&start) {
        let bytes = output::read_all(start.as_slice().chain(input)).map_err(failed)?;
        return each(Path::new(DASH), Some(bytes));
    }
    for line in start.as_slice().chain(input).lines() {
        let line = line.map_err(failed)?;
        let name = line.trim_end_matches('\r');
        if !name.is_empty() {
            each(Path::new(name), None)?;
        }
    }
    Ok(())
}

/// As many bytes as tell an image from a list; a list may stop in mid-stream and is not waited for.
fn beginning(input: &mut impl BufRead) -> io::Result<Vec<u8>> {
    const TELLING: usize = 16;
    let mut start = Vec::new();
    while start.len() < TELLING && !(start.is_ascii() && start.contains(&b'\n')) {
        let buffer = input.fill_buf()?;
        if buffer.is_empty() {
            break;
        }
        let taken = buffer.len();
        start.extend_from_slice(buffer);
        input.consume(taken);
    }
    Ok(start)
}

/// BMP and TIFF begin with letters, as names do, but no name goes on with a zero.
fn is_image(start: &[u8]) -> bool {
    let start = &start[..start.len().min(16)];
    image::guess_format(start).is_ok() && start.iter().any(|b| *b == 0 || !b.is_ascii())
}

/// A folder in which photos appear.
pub struct Watch {
    folder: PathBuf,
    /// Photos that are done with, as they were then.
    seen: BTreeMap<PathBuf, Stamp>,
    /// Photos that may still be growing.
    waiting: BTreeMap<PathBuf, (Stamp, Instant)>,
}

/// What changes when a file is written to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stamp {
    modified: Option<SystemTime>,
    size: u64,
}

/// A photo that has stopped growing, and whether it may be given more time.
type Settled = (PathBuf, Stamp, bool);

/// The names without their endings, in the order in which they were first complete.
fn names(looks: &[Vec<Settled>]) -> Vec<OsString> {
    let mut all: Vec<OsString> = Vec::new();
    for (path, ..) in looks.iter().flatten() {
        all.extend(path.file_stem().map(OsStr::to_os_string).filter(|name| !all.contains(name)));
    }
    all
}

/// When watching ends, if ever.
pub struct End<'a> {
    pub after: Option<u64>,
    pub once_there: Option<&'a Path>,
}

impl Watch {
    /// What is in the folder now is not new.
    pub fn new(folder: &Path) -> Result<Watch, Failure> {
        Ok(Watch { folder: folder.to_path_buf(), seen: in_folder(folder)?, waiting: BTreeMap::new() })
    }

    /// Hands over each new or changed photo once it is complete. `each` answers whether it was: if not, and the last
    /// argument says that there is time, the photo comes again.
    pub fn run(
        &mut self,
        end: &End,
        mut each: impl FnMut(&Path, Vec<u8>, bool) -> Result<bool, Failure>,
    ) -> Result<(), Failure> {
        let mut count = 0;
        while end.after.is_none_or(|after| count < after) {
            // The sentinel is looked for first: photos that were there before it are judged.
            let ending = end.once_there.is_some_and(Path::exists);
            let settled = self.look()?;
            for (path, stamp, patient) in settled {
                if end.after.is_some_and(|after| count >= after) {
                    break;
                }
                let Ok(bytes) = output::read(&path) else { continue };
                if stamp_of(&path) == Some(stamp) && each(&path, bytes, patient)? {
                    self.waiting.remove(&path);
                    self.seen.insert(path, stamp);
                    count += 1;
                }
            }
            if ending && self.waiting.is_empty() {
                break;
            }
            sleep(PAUSE);
        }
        Ok(())
    }

    /// The same for several cameras, a folder each: hands over the photos of one name when all are there and complete. When
    /// watching is to end, what has waited in vain for the others comes without them.
    pub fn run_together(
        watches: &mut [Watch],
        end: &End,
        mut each: impl FnMut(&[Option<(PathBuf, Vec<u8>)>], bool) -> Result<bool, Failure>,
    ) -> Result<(), Failure> {
        let mut count = 0;
        while end.after.is_none_or(|after| count < after) {
            let ending = end.once_there.is_some_and(Path::exists);
            let looks = watches.iter_mut().map(Watch::look).collect::<Result<Vec<_>, Failure>>()?;
            for name in names(&looks) {
                if end.after.is_some_and(|after| count >= after) {
                    break;
                }
                let of = |look: &Vec<Settled>| look.iter().find(|(path, ..)| path.file_stem() == Some(&name)).cloned();
                let found: Vec<Option<Settled>> = looks.iter().map(of).collect();
                let patient = found.iter().flatten().all(|(_, _, patient)| *patient);
                if !(found.iter().all(Option::is_some) || ending && !patient) {
                    continue;
                }
                let read = |found: &Option<Settled>| match found {
                    Some((path, stamp, _)) => {
                        let bytes = output::read(path).ok().filter(|_| stamp_of(path) == Some(*stamp))?;
                        Some(Some((path.clone(), bytes)))
                    }
                    None => Some(None),
                };
                let Some(photos) = found.iter().map(read).collect::<Option<Vec<_>>>() else { continue };
                if each(&photos, patient)? {
                    for (watch, (path, stamp, _)) in
                        watches.iter_mut().zip(&found).filter_map(|(w, f)| Some((w, f.as_ref()?)))
                    {
                        watch.waiting.remove(path);
                        watch.seen.insert(path.clone(), *stamp);
                    }
                    count += 1;
                }
            }
            if ending && watches.iter().all(|watch| watch.waiting.is_empty()) {
                break;
            }
            sleep(PAUSE);
        }
        Ok(())
    }

    /// The photos that have stopped growing, oldest first, and whether they may be given more time.
    fn look(&mut self) -> Result<Vec<Settled>, Failure> {
        let now = in_folder(&self.folder)?;
        self.seen.retain(|path, _| now.contains_key(path));
        self.waiting.retain(|path, _| now.contains_key(path));
        let mut settled = Vec::new();
        for (path, stamp) in now {
            if self.seen.get(&path) == Some(&stamp) {
                continue;
            }
            let (before, since) = self.waiting.entry(path.clone()).or_insert((stamp, Instant::now()));
            if *before != stamp {
                (*before, *since) = (stamp, Instant::now());
            }
            let rested = since.elapsed();
            if rested >= SETTLED {
                settled.push((path, stamp, rested < PATIENCE));
            }
        }
        settled.sort_by(|a, b| (a.1.modified, &a.0).cmp(&(b.1.modified, &b.0)));
        Ok(settled)
    }
}

/// The photos in a folder, hidden ones left out.
fn in_folder(folder: &Path) -> Result<BTreeMap<PathBuf, Stamp>, Failure> {
    let failed = |e: io::Error| Failure::at(folder, "read", &e);
    let mut photos = BTreeMap::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if is_photo(&path)
            && let Some(stamp) = stamp_of(&path)
        {
            photos.insert(path, stamp);
        }
    }
    Ok(photos)
}

fn is_photo(path: &Path) -> bool {
    let hidden = path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
    let kind = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    !hidden && kind.is_some_and(|kind| KINDS.contains(&kind.as_str()))
}

/// `None` for what is no file, or is gone again.
fn stamp_of(path: &Path) -> Option<Stamp> {
    let about = fs::metadata(path).ok().filter(|m| m.is_file())?;
    Some(Stamp { modified: about.modified().ok(), size: about.len() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_and_lists_are_told_apart() {
        for image in [
            &b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"[..],
            b"\xff\xd8\xff\xe0\0\x10JFIF\0",
            b"II*\0\x08\0\0\0",
            b"BM\x36\0\0\0\0\0\0\0",
        ] {
            assert!(is_image(image), "{image:?}");
        }
        for list in [&b"BMW.png\nBMX.png\nBMY.png\n"[..], b"II*.tif\n", b"photos/a.png", b"", b"\n"] {
            assert!(!is_image(list), "{list:?}");
        }
    }

    #[test]
    fn a_short_list_is_not_waited_for() {
        let mut endless = io::BufReader::new((&b"a.png\n"[..]).chain(io::repeat(b'x')));
        let mut first = io::BufReader::with_capacity(6, &mut endless);
        assert_eq!(beginning(&mut first).unwrap(), b"a.png\n");
    }

    #[test]
    fn photos_are_known_by_their_names() {
        assert!(is_photo(Path::new("x/a.PNG")) && is_photo(Path::new("b.tiff")));
        assert!(!is_photo(Path::new(".a.png")) && !is_photo(Path::new("a.png.part")) && !is_photo(Path::new("png")));
    }
}
