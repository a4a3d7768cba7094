//! `gonogo compile` and `gonogo check`.

use super::args::{Check, Compile, Global, Variant};
use super::messages::{self, Messages};
use super::output::{self, DASH, Failure};
use super::progress::Monitor;
use super::{Exit, fix};
use crate::artifacts::Artifact;
use crate::diag::Diagnostic;
use crate::runtime::model::{Model, Rate};
use crate::{Compiled, Options};
use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Compiles a spec and writes what was asked for, all of it or nothing.
pub fn compile(args: &Compile, global: &Global) -> Result<Exit, Failure> {
    refuse_unavailable(args)?;
    let outputs = Outputs::of(args);
    output::probe(&outputs.model)?;
    args.deps.iter().try_for_each(|deps| output::probe(deps))?;
    let spec = Document::read(&args.spec)?;
    let options = Options {
        station: args.station.clone(),
        set: args.variant.set.clone(),
        wanted: outputs.wanted.clone(),
        keep: false,
    };
    let compiled = args.jobs.run(|| run(&spec, &options, global))?;
    if !report(&compiled, &args.variant, global)? {
        return Ok(Exit::Faults);
    }
    let written = outputs.write(&compiled)?;
    if let Some(deps) = &args.deps {
        output::write(deps, make_rule(&written, &compiled.inputs).as_bytes())?;
    }
    if let (Some(model), true) = (&compiled.model, outputs.model != Path::new(DASH)) {
        summarise(model, &outputs.model)?;
    }
    Ok(Exit::Fine)
}

/// Checks specs up to the view, without rendering.
pub fn check(args: &Check, global: &Global) -> Result<Exit, Failure> {
    fix::refuse_mixed_output(args, global)?;
    let (mut exit, mut messages) = (Exit::Fine, Messages::new(global));
    for path in &args.specs {
        let spec = Document::read(path)?;
        let options = Options {
            station: None,
            set: args.variant.set.clone(),
            wanted: BTreeSet::from([Artifact::View]),
            keep: false,
        };
        let spec = if args.fix { fix::mended(spec, path, &options)? } else { spec };
        let compiled = run(&spec, &options, global);
        let diagnostics = args.variant.judged(&compiled.diagnostics);
        messages.add(&diagnostics, &compiled.sources)?;
        if diagnostics.iter().any(Diagnostic::is_error) {
            exit = Exit::Faults;
        }
    }
    messages.finish()?;
    Ok(exit)
}

fn refuse_unavailable(args: &Compile) -> Result<(), Failure> {
    if args.locked { Err(Failure("`--locked` is not available yet".into())) } else { Ok(()) }
}

/// A spec as read from a file or standard input.
pub struct Document {
    pub name: String,
    pub text: String,
}

impl Document {
    pub fn read(path: &Path) -> Result<Document, Failure> {
        let text = output::read_text(path)?;
        let name = if path == Path::new(DASH) { "<stdin>".into() } else { path.display().to_string() };
        Ok(Document { name, text })
    }

    /// The spec itself, or a file it uses.
    pub fn text_of(&self, name: &str) -> io::Result<String> {
        if name == self.name { Ok(self.text.clone()) } else { fs::read_to_string(name) }
    }
}

/// Runs the compiler with progress on the terminal.
pub fn run(document: &Document, options: &Options, global: &Global) -> Compiled {
    watched(document, global, |read, observer| crate::compile(&document.name, read, options, observer))
}

/// Work on a spec, with progress shown and its stages timed as asked for.
pub fn watched(
    document: &Document,
    global: &Global,
    work: impl FnOnce(crate::design::Read, &crate::Observer) -> Compiled,
) -> Compiled {
    let monitor = Monitor::new();
    let compiled = work(&|name: &str| document.text_of(name), &|progress| monitor.note(progress));
    monitor.finish();
    if global.timings {
        monitor.print_timings();
    }
    compiled
}

/// Prints the diagnostics; whether they allow going on.
pub fn report(compiled: &Compiled, variant: &Variant, global: &Global) -> Result<bool, Failure> {
    let diagnostics = variant.judged(&compiled.diagnostics);
    messages::print(&diagnostics, &compiled.sources, global)?;
    Ok(!diagnostics.iter().any(Diagnostic::is_error))
}

/// Where things go.
struct Outputs {
    model: PathBuf,
    wants_model: bool,
    wanted: BTreeSet<Artifact>,
}

impl Outputs {
    fn of(args: &Compile) -> Outputs {
        let mut wanted: BTreeSet<Artifact> = args.emit.iter().copied().collect();
        if wanted.is_empty() || args.output.is_some() {
            wanted.insert(Artifact::Model);
        }
        let model = args.output.clone().unwrap_or_else(|| default_name(&args.spec, args.station.as_deref()));
        Outputs { model, wants_model: wanted.contains(&Artifact::Model), wanted }
    }

    /// Writes everything; the names of the files.
    fn write(&self, compiled: &Compiled) -> Result<Vec<PathBuf>, Failure> {
        let mut written = Vec::new();
        for (name, bytes) in &compiled.artifacts {
            let path = self.beside(name);
            if let Some(folder) = path.parent().filter(|_| name.contains('/')) {
                output::make_dir(folder)?;
            }
            output::write(&path, bytes)?;
            written.push(path);
        }
        if let Some(model) = compiled.model.as_ref().filter(|_| self.wants_model) {
            output::write(&self.model, model.write().as_bytes())?;
            written.push(self.model.clone());
        }
        Ok(written)
    }

    /// `NAME.liaison.ron` beside `NAME.model.ron`.
    fn beside(&self, artifact: &str) -> PathBuf {
        let name = self.model.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let stem = name.strip_suffix(".ron").unwrap_or(&name);
        let stem = stem.strip_suffix(".model").unwrap_or(stem);
        self.model.with_file_name(format!("{stem}.{artifact}"))
    }
}

/// The spec's stem in the current folder, with the station if one was named.
fn default_name(spec: &Path, station: Option<&str>) -> PathBuf {
    let stem = match spec.file_stem() {
        Some(stem) if spec != Path::new(DASH) => stem.to_string_lossy().into_owned(),
        _ => "spec".into(),
    };
    let station = station.map(|s| format!(".{s}")).unwrap_or_default();
    PathBuf::from(format!("{stem}{station}.model.ron"))
}

/// `targets: inputs` as make reads it.
fn make_rule(targets: &[PathBuf], inputs: &[String]) -> String {
    let escaped = |name: &str| name.replace('$', "$$").replace(' ', "\\ ").replace('#', "\\#");
    let targets: Vec<String> = targets.iter().map(|t| escaped(&t.display().to_string())).collect();
    let inputs: Vec<String> = inputs.iter().map(|i| escaped(i)).collect();
    format!("{}: {}\n", targets.join(" "), inputs.join(" "))
}

/// What the model promises, in a few lines.
fn summarise(model: &Model, path: &Path) -> Result<(), Failure> {
    let promise = &model.promise;
    let nodes = model.nodes.len();
    output::line(&format!("{}: station {}, {nodes} nodes", path.display(), model.station.name))?;
    output::line(&format!("  predicted false rejects: {}", rate(&promise.false_reject)))?;
    output::line(&format!("  predicted escapes:       {}", rate(&promise.escape)))?;
    let mut escapes = promise.modes.iter().filter(|m| m.escape.events > 0);
    escapes.try_for_each(|m| output::line(&format!("    {} {}: {}", m.component, m.fault, rate(&m.escape))))
}

pub fn rate(rate: &Rate) -> String {
    format!("{} of {} (at most {:.1} %, 95 %)", rate.events, rate.trials, 100.0 * rate.upper_95)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_named_after_spec_and_station() {
        let named = |spec: &str, station| default_name(Path::new(spec), station).display().to_string();
        assert_eq!(named("specs/wheel.gng", None), "wheel.model.ron");
        assert_eq!(named("wheel.gng", Some("B")), "wheel.B.model.ron");
        assert_eq!(named("-", None), "spec.model.ron");
    }

    #[test]
    fn artifacts_lie_beside_the_model() {
        let beside = |model: &str| {
            let outputs = Outputs { model: model.into(), wants_model: true, wanted: BTreeSet::new() };
            outputs.beside("view.ron").display().to_string()
        };
        assert_eq!(beside("out/wheel.B.model.ron"), "out/wheel.B.view.ron");
        assert_eq!(beside("m.ron"), "m.view.ron");
        assert_eq!(beside("m"), "m.view.ron");
    }

    #[test]
    fn make_rules_escape_what_make_would_read() {
        let rule = make_rule(&["a b.ron".into()], &["x$y.gng".into(), "p#q.gng".into()]);
        assert_eq!(rule, "a\\ b.ron: x$$y.gng p\\#q.gng\n");
    }
}
