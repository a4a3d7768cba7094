//! For build scripts: a spec becomes a model while the program that judges with it is built.
//!
//! ```no_run
//! // In the main of build.rs; the program then says include_str!(concat!(env!("OUT_DIR"), "/wheel.model.ron")).
//! gonogo::build::spec("specs/wheel.gng").compile()?;
//! # Ok::<(), gonogo::build::Failed>(())
//! ```
//!
//! In: the name of a spec. Out: the model in `OUT_DIR`, and on standard output what cargo has to know: the files to watch,
//! warnings and errors. What is rendered is kept in `OUT_DIR` for the next build. Cargo compiles build scripts and all they
//! use without optimisation unless `[profile.dev.build-override]` and `[profile.release.build-override]` say
//! `opt-level = 3`; renders take an hour without it. Never writes beside the spec: a lock file there is used, not made.

use crate::artifacts::Artifact;
use crate::cache::{Folder, folder};
use crate::diag::{Diagnostic, Sources};
use crate::runtime::model;
use crate::view::lock::Lock;
use crate::{Compiled, Options};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Begins with the spec at `path`, as seen from the package's folder.
pub fn spec(path: impl Into<PathBuf>) -> Build {
    Build { spec: path.into(), station: None, set: Vec::new(), out_dir: None, locked: false }
}

/// What is to be built.
#[derive(Debug, Clone)]
pub struct Build {
    spec: PathBuf,
    station: Option<String>,
    set: Vec<(String, String)>,
    out_dir: Option<PathBuf>,
    locked: bool,
}

/// Why nothing was built; cargo has been told the details.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failed(String);

impl fmt::Display for Failed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Failed {}

impl Build {
    /// The station the model is for; the first of the spec unless given.
    pub fn station(mut self, name: impl Into<String>) -> Build {
        self.station = Some(name.into());
        self
    }

    /// Replaces the value of a `let`; later wins.
    pub fn set(mut self, name: impl Into<String>, value: impl Into<String>) -> Build {
        self.set.push((name.into(), value.into()));
        self
    }

    /// Where the model goes; `OUT_DIR` unless given.
    pub fn out_dir(mut self, folder: impl Into<PathBuf>) -> Build {
        self.out_dir = Some(folder.into());
        self
    }

    /// Chooses nothing anew: `NAME.lock.ron` beside the spec has to hold it.
    pub fn locked(mut self) -> Build {
        self.locked = true;
        self
    }

    /// Compiles the spec; the model's path, `NAME.model.ron` or `NAME.STATION.model.ron`.
    pub fn compile(&self) -> Result<PathBuf, Failed> {
        let out = self.out_dir.clone().or_else(|| std::env::var_os("OUT_DIR").map(PathBuf::from));
        let out = out.ok_or_else(|| Failed("OUT_DIR is not set: this is for build scripts".into()))?;
        let (compiled, lines) = self.made(Artifact::Model, Some(&out.join("gonogo-cache")))?;
        lines.iter().for_each(|line| println!("{line}"));
        let text = compiled.model.map(|model| model.write()).or_else(|| compiled.rig.map(|rig| rig.write()));
        let Some(text) = text.filter(|_| !stopped(&compiled.diagnostics)) else { return Err(self.failed()) };
        if let Some(why) = model::too_large(text.len()) {
            return Err(Failed(why));
        }
        let path = out.join(self.file());
        write(&path, &text).map_err(|e| Failed(format!("cannot write `{}`: {e}", path.display())))?;
        Ok(path)
    }

    /// Checks the spec without rendering anything.
    pub fn check(&self) -> Result<(), Failed> {
        let (compiled, lines) = self.made(Artifact::View, None)?;
        lines.iter().for_each(|line| println!("{line}"));
        if stopped(&compiled.diagnostics) { Err(self.failed()) } else { Ok(()) }
    }

    /// Compiles as far as `wanted`, with the lines that cargo is to read.
    fn made(&self, wanted: Artifact, cache: Option<&Path>) -> Result<(Compiled, Vec<String>), Failed> {
        let name = self.spec.to_str().ok_or_else(|| Failed(format!("{:?} is not Unicode", self.spec)))?;
        let lock_path = self.spec.with_extension("lock.ron");
        let cache = cache.zip(Folder::this_program());
        let options = Options {
            station: self.station.clone(),
            set: self.set.clone(),
            wanted: BTreeSet::from([wanted]),
            cache: cache.map(|(path, program)| Arc::new(Folder::new(path, &program, folder::LIMIT)) as Arc<_>),
            lock: lock(&lock_path)?,
            locked: self.locked,
            ..Options::default()
        };
        let mut lines = Vec::new();
        if options.lock.is_some() || self.locked {
            lines.push(watched(&lock_path.display().to_string()));
        }
        let asked = RefCell::new(Vec::new());
        let read = |name: &str| -> io::Result<String> {
            asked.borrow_mut().push(watched(name));
            fs::read_to_string(name)
        };
        let compiled = super::compile(name, &read, &options, &|_| {});
        lines.extend(asked.into_inner());
        lines.extend(compiled.diagnostics.iter().map(|d| told(d, &compiled.sources)));
        Ok((compiled, lines))
    }

    fn file(&self) -> String {
        let stem = self.spec.file_stem().unwrap_or_default().to_string_lossy();
        let station = self.station.as_ref().map(|s| format!(".{s}")).unwrap_or_default();
        format!("{stem}{station}.model.ron")
    }

    fn failed(&self) -> Failed {
        Failed(format!("`{}` does not compile", self.spec.display()))
    }
}

fn stopped(diagnostics: &[Diagnostic]) -> bool {
    diagnostics.iter().any(Diagnostic::is_error)
}

fn watched(name: &str) -> String {
    format!("cargo::rerun-if-changed={name}")
}

fn lock(path: &Path) -> Result<Option<Lock>, Failed> {
    let fault = |why: String| Failed(format!("`{}`: {why}", path.display()));
    match fs::read_to_string(path) {
        Ok(text) => Lock::read(&text).map(Some).map_err(fault),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(fault(error.to_string())),
    }
}

/// A diagnostic on the one line that cargo shows: `file:line:column: E0305: message; help: …`.
fn told(diagnostic: &Diagnostic, sources: &Sources) -> String {
    let kind = if diagnostic.is_error() { "error" } else { "warning" };
    let span = diagnostic.labels.first().map(|l| l.span).unwrap_or_default();
    let (name, text) = sources.files.get(span.file as usize).map_or(("", ""), |(name, text)| (name, text));
    let before = text.get(..span.start as usize).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
    let help = diagnostic.help.as_ref().map(|help| format!("; help: {help}")).unwrap_or_default();
    let message = format!("{}{help}", diagnostic.message).replace('\n', " ");
    format!("cargo::{kind}={name}:{line}:{column}: {}: {message}", diagnostic.code)
}

/// Writes a file whole: beside its place first, then renamed into it.
fn write(path: &Path, text: &str) -> io::Result<()> {
    let beside = path.with_extension(format!("{}.part", std::process::id()));
    fs::write(&beside, text).and_then(|()| fs::rename(&beside, path))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPEC: &str = "tests/data/two_pins.gng";

    #[test]
    fn cargo_is_told_what_to_watch() {
        let (compiled, lines) = spec(SPEC).made(Artifact::View, None).unwrap();
        assert!(!stopped(&compiled.diagnostics));
        assert_eq!(lines[0], "cargo::rerun-if-changed=tests/data/two_pins.gng");
        assert!(lines[1..].iter().all(|line| line.starts_with("cargo::warning=")), "{lines:?}");
        assert_eq!(spec(SPEC).check(), Ok(()));
    }

    #[test]
    fn faults_are_told_on_one_line_each() {
        let (compiled, lines) = spec(SPEC).station("bank").made(Artifact::View, None).unwrap();
        assert!(stopped(&compiled.diagnostics));
        let fault = lines.iter().find(|line| line.starts_with("cargo::error=")).unwrap();
        assert!(
            fault.starts_with("cargo::error=tests/data/two_pins.gng:") && fault.contains("E0201: no station"),
            "{fault}"
        );
        assert!(spec("no/such.gng").check().is_err());
    }

    #[test]
    fn models_are_named_after_spec_and_station() {
        assert_eq!(spec("specs/wheel.gng").file(), "wheel.model.ron");
        assert_eq!(spec("wheel.gng").station("B").file(), "wheel.B.model.ron");
    }
}
