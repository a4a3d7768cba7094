//! Where results are kept for the next time, and the lock file beside a spec.

use super::output::{self, DASH, Failure};
use crate::cache::{Cache, Folder, folder};
use crate::view::lock::Lock;
use clap::Args;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[derive(Debug, Args)]
pub struct Keeping {
    /// Where images and what was learnt from them are kept for the next time. Default: GONOGO_CACHE_DIR, else `gonogo` in
    /// the user's cache folder.
    #[arg(long, value_name = "DIR")]
    pub cache_dir: Option<PathBuf>,
    /// Make everything anew and keep nothing.
    #[arg(long, conflicts_with = "cache_dir")]
    pub no_cache: bool,
}

impl Keeping {
    /// The cache asked for; none where the user has no folder for such things.
    pub fn cache(&self) -> Option<Arc<Folder>> {
        if self.no_cache {
            return None;
        }
        let path = self.cache_dir.clone().or_else(usual_folder)?;
        Some(Arc::new(Folder::new(path, &Folder::this_program()?, folder::LIMIT)))
    }
}

/// A cache as the compiler takes it.
pub fn shared(cache: Option<&Arc<Folder>>) -> Option<Arc<dyn Cache>> {
    cache.map(|cache| Arc::clone(cache) as Arc<dyn Cache>)
}

/// GONOGO_CACHE_DIR, or where this system's programs keep what they can make again.
fn usual_folder() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let home = |below: &str| set("HOME").map(|home| home.join(below));
    let user = || match std::env::consts::OS {
        "windows" => set("LOCALAPPDATA"),
        "macos" => home("Library/Caches"),
        // A relative path there is invalid, says the XDG base directory specification.
        _ => set("XDG_CACHE_HOME").filter(|p| p.is_absolute()).or_else(|| home(".cache")),
    };
    set("GONOGO_CACHE_DIR").or_else(|| user().map(|user| user.join("gonogo")))
}

/// `NAME.lock.ron` beside the spec; none for standard input.
pub fn lock_path(spec: &Path) -> Option<PathBuf> {
    (spec != Path::new(DASH)).then(|| spec.with_extension("lock.ron"))
}

/// The lock of a spec, if it has one. One that cannot be understood is no reason to choose anew in silence.
pub fn read_lock(spec: &Path) -> Result<Option<Lock>, Failure> {
    let Some(path) = lock_path(spec) else { return Ok(None) };
    match std::fs::read_to_string(&path) {
        Ok(text) => match Lock::read(&text) {
            Ok(lock) => Ok(Some(lock)),
            Err(why) => Err(Failure(format!(
                "`{}` is no lock: {why}; mend it, or delete it to have it made anew",
                path.display()
            ))),
        },
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(Failure::at(&path, "read", &error)),
    }
}

/// Writes the lock beside the spec if it has changed. What another process has locked since `before` was read is kept.
pub fn write_lock(spec: &Path, before: Option<&Lock>, chosen: Option<&Lock>) -> Result<(), Failure> {
    let (Some(path), Some(chosen)) = (lock_path(spec), chosen) else { return Ok(()) };
    if before == Some(chosen) {
        return Ok(());
    }
    let mut lock = chosen.clone();
    let known = |name: &String| before.and_then(|lock| lock.stations.get(name));
    for (name, entry) in read_lock(spec)?.unwrap_or_default().stations {
        if known(&name) != Some(&entry) && known(&name) == chosen.stations.get(&name) {
            lock.stations.insert(name, entry);
        }
    }
    if let Err(Failure(why)) = output::write(&path, lock.write().as_bytes()) {
        // The model does not depend on it: a spec in a place for reading only compiles all the same.
        output::remark(&format!("warning: the choice is not locked: {why}"));
    }
    Ok(())
}
