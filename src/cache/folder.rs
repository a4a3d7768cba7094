//! A cache in a folder: one file an entry, bounded in size, shared by any number of processes.
//!
//! An entry is written beside its place and renamed into it, so nobody reads half of one. Its first bytes are a digest of
//! key and content: what was cut short, damaged or moved counts as not there and is written anew. Entries that were used
//! longest ago go first when the folder outgrows its limit; the file times that say so have no influence on any result.

use super::{Cache, Key};
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::SystemTime;

/// What an entry begins with, before its digest.
const MAGIC: &[u8; 8] = b"gonogo1\n";
const DIGEST: usize = 32;
/// An entry larger than this is not ours (bytes).
const LARGEST_ENTRY: u64 = 1 << 30;
/// After a sweep this share of the limit is left, so that not every entry asks for the next one.
const LEFT: f64 = 0.9;
/// What the folder may hold unless said otherwise (bytes): a dozen models of the size of the pattern wheel.
pub const LIMIT: u64 = 4 << 30;

/// Entries asked for and found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    pub asked: u64,
    pub found: u64,
}

/// A cache in a folder.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// Digest of the program whose results these are: another build may compute otherwise.
    program: String,
    limit: u64,
    asked: AtomicU64,
    found: AtomicU64,
    /// Bytes written since the last sweep.
    written: AtomicU64,
    /// Number of the next file half written.
    serial: AtomicU64,
}

impl Folder {
    /// A cache in `path`, which is made when something is kept. Entries of another `program` are never found; name it by a
    /// digest of its code. At most `limit` bytes are left behind.
    pub fn new(path: impl Into<PathBuf>, program: &str, limit: u64) -> Folder {
        let program = blake3::hash(program.as_bytes()).to_hex().to_string();
        let zero = AtomicU64::default;
        Folder { path: path.into(), program, limit, asked: zero(), found: zero(), written: zero(), serial: zero() }
    }

    /// The digest of a running program's own file, which names its build; `None` if it cannot be read.
    pub fn this_program() -> Option<String> {
        let code = fs::read(std::env::current_exe().ok()?).ok()?;
        Some(blake3::hash(&code).to_hex().to_string())
    }

    pub fn counts(&self) -> Counts {
        Counts { asked: self.asked.load(Relaxed), found: self.found.load(Relaxed) }
    }

    fn place(&self, key: &Key) -> PathBuf {
        let name = key.with(&self.program).to_hex();
        self.path.join(&name[..2]).join(&name[2..])
    }

    fn read(&self, key: &Key) -> Option<Vec<u8>> {
        let path = self.place(key);
        let mut file = File::open(&path).ok()?;
        let mut bytes = Vec::new();
        Read::by_ref(&mut file).take(LARGEST_ENTRY).read_to_end(&mut bytes).ok()?;
        let (head, content) = bytes.split_at_checked(MAGIC.len() + DIGEST)?;
        if head != self.head(key, content) {
            return None;
        }
        // For the sweep only; a read-only cache stays as it is.
        let _ = File::options().append(true).open(&path).and_then(|f| f.set_modified(SystemTime::now()));
        bytes.drain(..MAGIC.len() + DIGEST);
        Some(bytes)
    }

    fn head(&self, key: &Key, content: &[u8]) -> Vec<u8> {
        let mut hasher = blake3::Hasher::new();
        hasher.update(key.as_bytes()).update(self.program.as_bytes()).update(content);
        [MAGIC, &hasher.finalize().as_bytes()[..]].concat()
    }

    fn write(&self, key: &Key, content: &[u8]) -> io::Result<()> {
        let path = self.place(key);
        let folder = path.parent().unwrap_or(&self.path);
        fs::create_dir_all(folder)?;
        self.tag();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let number = self.serial.fetch_add(1, Relaxed);
        let beside = folder.join(format!(".{name}.{}.{number}.part", std::process::id()));
        let written = File::create(&beside).and_then(|mut file| {
            file.write_all(&self.head(key, content))?;
            file.write_all(content)
        });
        written.and_then(|()| fs::rename(&beside, &path)).inspect_err(|_| {
            let _ = fs::remove_file(&beside);
        })
    }

    /// Tells backup programs to leave the folder out.
    fn tag(&self) {
        let path = self.path.join("CACHEDIR.TAG");
        if !path.exists() {
            let text = "Signature: 8a477f597d28d172789f06886806bc55\n# Made by gonogo; may be deleted at any time.\n";
            let _ = fs::write(path, text);
        }
    }

    /// Removes what was used longest ago until the folder keeps its limit. Touches no file that is not an entry.
    pub fn sweep(&self) {
        self.written.store(0, Relaxed);
        let mut entries = entries(&self.path);
        let mut total: u64 = entries.iter().map(|e| e.size).sum();
        if total <= self.limit {
            return;
        }
        entries.sort_by(|a, b| (a.used, &a.path).cmp(&(b.used, &b.path)));
        let goal = (self.limit as f64 * LEFT) as u64;
        for entry in entries {
            if total <= goal {
                break;
            }
            // Another process may have removed it.
            let _ = fs::remove_file(&entry.path);
            total -= entry.size;
        }
    }
}

impl Cache for Folder {
    fn get(&self, key: &Key) -> Option<Vec<u8>> {
        self.asked.fetch_add(1, Relaxed);
        let found = self.read(key);
        self.found.fetch_add(u64::from(found.is_some()), Relaxed);
        found
    }

    fn put(&self, key: &Key, value: &[u8]) {
        if value.len() as u64 <= LARGEST_ENTRY / 2 && self.write(key, value).is_ok() {
            let size = value.len() as u64;
            if self.written.fetch_add(size, Relaxed) + size > self.limit / 4 {
                self.sweep();
            }
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        if self.written.load(Relaxed) > 0 {
            self.sweep();
        }
    }
}

struct Entry {
    path: PathBuf,
    used: SystemTime,
    size: u64,
}

/// The entries of a cache, and what a killed process left half written.
fn entries(cache: &Path) -> Vec<Entry> {
    let is_hex = |name: &str, length: usize| {
        name.len() == length && name.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b))
    };
    let list = |path: &Path| -> Vec<(PathBuf, String)> {
        let found = fs::read_dir(path).into_iter().flatten().flatten();
        found.map(|e| (e.path(), e.file_name().to_string_lossy().into_owned())).collect()
    };
    let folders = list(cache).into_iter().filter(|(_, name)| is_hex(name, 2));
    let is_part =
        |name: &str| name.starts_with('.') && name.ends_with(".part") && is_hex(name.get(1..63).unwrap_or(""), 62);
    let files = folders.flat_map(|(path, _)| list(&path)).filter(|(_, name)| is_hex(name, 62) || is_part(name));
    let entry = |(path, _): (PathBuf, String)| {
        let about = fs::symlink_metadata(&path).ok().filter(|m| m.is_file())?;
        Some(Entry { path, used: about.modified().unwrap_or(SystemTime::UNIX_EPOCH), size: about.len() })
    };
    files.filter_map(entry).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn scratch(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("gonogo-cache-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        path
    }

    fn key(n: usize) -> Key {
        Key::new("test", &n)
    }

    #[test]
    fn what_is_kept_comes_back_and_only_to_the_same_program() {
        let path = scratch("back");
        let cache = Folder::new(&path, "a", LIMIT);
        assert_eq!(cache.get(&key(1)), None);
        cache.put(&key(1), b"one");
        cache.put(&key(1), b"one");
        assert_eq!(cache.get(&key(1)).as_deref(), Some(&b"one"[..]));
        assert_eq!(cache.counts(), Counts { asked: 2, found: 1 });
        assert_eq!(Folder::new(&path, "b", LIMIT).get(&key(1)), None);
        assert_eq!(entries(&path).len(), 1);
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn damage_counts_as_absence_and_is_mended() {
        let path = scratch("damage");
        let cache = Folder::new(&path, "a", LIMIT);
        cache.put(&key(1), b"content");
        let file = cache.place(&key(1));
        let whole = fs::read(&file).unwrap();
        for at in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[at] ^= 1;
            fs::write(&file, damaged).unwrap();
            assert_eq!(cache.get(&key(1)), None, "{at}");
            fs::write(&file, &whole[..at]).unwrap();
            assert_eq!(cache.get(&key(1)), None, "{at}");
        }
        // An entry moved to another's place is no answer to its question.
        let other = cache.place(&key(2));
        fs::create_dir_all(other.parent().unwrap()).unwrap();
        fs::write(other, &whole).unwrap();
        assert_eq!(cache.get(&key(2)), None);
        cache.put(&key(1), b"content");
        assert_eq!(cache.get(&key(1)).as_deref(), Some(&b"content"[..]));
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn the_longest_unused_go_first_and_strangers_stay() {
        let path = scratch("sweep");
        let cache = Folder::new(&path, "a", 10_000);
        fs::create_dir_all(path.join("ab")).unwrap();
        fs::write(path.join("ab/thesis.txt"), vec![0; 50_000]).unwrap();
        let start = SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000);
        for n in 0..8 {
            cache.write(&key(n), &[7; 2000]).unwrap();
            let file = File::options().append(true).open(cache.place(&key(n))).unwrap();
            file.set_modified(start + Duration::from_secs(n as u64)).unwrap();
        }
        // Using the oldest makes it the youngest.
        assert!(cache.get(&key(0)).is_some());
        cache.sweep();
        let kept: Vec<usize> = (0..8).filter(|&n| cache.place(&key(n)).exists()).collect();
        assert_eq!(kept, [0, 5, 6, 7]);
        assert!(path.join("ab/thesis.txt").exists());
        fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn a_place_that_cannot_be_written_is_no_fault() {
        let path = scratch("file");
        fs::write(&path, "a file").unwrap();
        let cache = Folder::new(&path, "a", LIMIT);
        cache.put(&key(1), b"one");
        assert_eq!(cache.get(&key(1)), None);
        cache.sweep();
        fs::remove_file(path).unwrap();
    }
}
