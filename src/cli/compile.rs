//! `gonogo compile` and `gonogo check`.

use super::args::{Check, Compile, Global, MessageFormat, Variant};
use super::deps::Input;
use super::messages::{self, Messages};
use super::output::{self, DASH, Failure};
use super::progress::Monitor;
use super::watch::Round;
use super::{Exit, fix, keep, rig};
use crate::artifacts::Artifact;
use crate::cache::folder::Counts;
use crate::diag::Diagnostic;
use crate::runtime::model::{self, Model, Promise, Rate};
use crate::runtime::rig::Rig;
use crate::{Compiled, Options};
use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Compiles a spec and writes what was asked for, all of it or nothing; again and again if it is watched.
pub fn compile(args: &Compile, global: &Global) -> Result<Exit, Failure> {
    let outputs = Outputs::of(args);
    output::probe(&outputs.model)?;
    args.deps.probe()?;
    args.watch.run(std::slice::from_ref(&args.spec), || compile_once(args, &outputs, global))
}

fn compile_once(args: &Compile, outputs: &Outputs, global: &Global) -> Round {
    let mut round = Round { exit: Ok(Exit::Fine), inputs: Vec::new(), summary: "not compiled".into() };
    round.exit = Document::read(&args.spec).and_then(|spec| {
        let compiled = compiled(args, outputs, &spec, global);
        round.inputs = spec.inputs();
        if args.locked {
            round.inputs.extend(keep::lock_path(&args.spec).map(|path| Input::now(&path)));
        }
        let compiled = compiled?;
        round.summary = count(&compiled.diagnostics);
        if !report(&compiled, &args.variant, global)? {
            args.deps.write_failed(&round.inputs)?;
            return Ok(Exit::Faults);
        }
        let written = outputs.write(&compiled)?;
        args.deps.write(&written, &round.inputs)?;
        if outputs.model != Path::new(DASH) {
            compiled.model.iter().try_for_each(|model| summarise(model, &outputs.model))?;
            compiled.rig.iter().try_for_each(|rig| rig::summarise(rig, &outputs.model))?;
        }
        Ok(Exit::Fine)
    });
    round
}

/// Compiles with the spec's lock and the cache, and locks what was chosen.
fn compiled(args: &Compile, outputs: &Outputs, spec: &Document, global: &Global) -> Result<Compiled, Failure> {
    let lock = keep::read_lock(&args.spec)?;
    let cache = args.keeping.cache();
    let options = Options {
        station: args.station.clone(),
        set: args.variant.set.clone(),
        wanted: outputs.wanted.clone(),
        cache: keep::shared(cache.as_ref()),
        lock,
        locked: args.locked,
        ..Options::default()
    };
    let compiled = args.jobs.run(|| run(spec, &options, global))?;
    if let (Some(cache), true) = (cache, global.timings && global.message_format != MessageFormat::Json) {
        let Counts { asked, found } = cache.counts();
        output::remark(&format!("cache      {found} of {asked} found"));
    }
    if !args.locked && !compiled.diagnostics.iter().any(Diagnostic::is_error) {
        keep::write_lock(&args.spec, options.lock.as_ref(), compiled.lock.as_ref())?;
    }
    Ok(compiled)
}

/// Checks specs up to the view, without rendering; again and again if they are watched.
pub fn check(args: &Check, global: &Global) -> Result<Exit, Failure> {
    fix::refuse_mixed_output(args, global)?;
    args.refuse_rule_without_target()?;
    args.deps.probe()?;
    args.stamp.iter().try_for_each(|stamp| output::probe(stamp))?;
    args.watch.run(&args.specs, || {
        let mut round = Round { exit: Ok(Exit::Fine), inputs: Vec::new(), summary: String::new() };
        let mut found = Vec::new();
        round.exit = check_once(args, global, &mut round.inputs, &mut found);
        round.summary = count(&found);
        round
    })
}

fn check_once(
    args: &Check,
    global: &Global,
    inputs: &mut Vec<Input>,
    found: &mut Vec<Diagnostic>,
) -> Result<Exit, Failure> {
    let (mut exit, mut messages) = (Exit::Fine, Messages::new(global));
    for path in &args.specs {
        let spec = Document::read(path)?;
        let options = Options {
            station: None,
            set: args.variant.set.clone(),
            lock: keep::read_lock(path)?,
            ..Options::default()
        };
        let spec = if args.fix { fix::mended(spec, path, &options)? } else { spec };
        let compiled = run(&spec, &options, global);
        inputs.extend(spec.inputs());
        let diagnostics = args.variant.judged(&compiled.diagnostics);
        messages.add(&diagnostics, &compiled.sources)?;
        if diagnostics.iter().any(Diagnostic::is_error) {
            exit = Exit::Faults;
        }
        found.extend(diagnostics);
    }
    messages.finish()?;
    if exit != Exit::Fine {
        args.deps.write_failed(inputs)?;
        return Ok(exit);
    }
    args.stamp.iter().try_for_each(|stamp| output::write(stamp, b""))?;
    args.deps.write(args.stamp.as_slice(), inputs)?;
    Ok(exit)
}

/// `2 errors, 1 warning`.
fn count(diagnostics: &[Diagnostic]) -> String {
    let errors = diagnostics.iter().filter(|d| d.is_error()).count();
    let counted = |n: usize, word: &str| (n > 0).then(|| format!("{n} {word}{}", if n == 1 { "" } else { "s" }));
    let counts = [counted(errors, "error"), counted(diagnostics.len() - errors, "warning")];
    let counts: Vec<String> = counts.into_iter().flatten().collect();
    if counts.is_empty() { "no faults".into() } else { counts.join(", ") }
}

/// A spec as read from a file or standard input.
pub struct Document {
    pub name: String,
    pub text: String,
    /// What was read for it, the spec itself first.
    inputs: Mutex<Vec<Input>>,
}

impl Document {
    pub fn read(path: &Path) -> Result<Document, Failure> {
        let text = output::read_text(path)?;
        let is_file = path != Path::new(DASH);
        let name = if is_file { path.display().to_string() } else { "<stdin>".into() };
        let own = Input { path: path.to_path_buf(), held: Some(blake3::hash(text.as_bytes())) };
        Ok(Document { name, text, inputs: Mutex::new(if is_file { vec![own] } else { Vec::new() }) })
    }

    /// The same file with another text.
    pub fn with_text(&self, text: String) -> Document {
        let own = |input: &Input| input.path == Path::new(&self.name);
        let held = Some(blake3::hash(text.as_bytes()));
        let inputs = self.inputs().into_iter().filter(own).take(1).map(|input| Input { held, ..input }).collect();
        Document { name: self.name.clone(), text, inputs: Mutex::new(inputs) }
    }

    /// The spec itself, or a file it uses.
    pub fn text_of(&self, name: &str) -> io::Result<String> {
        if name == self.name {
            return Ok(self.text.clone());
        }
        let read = fs::read_to_string(name);
        let input = match &read {
            Ok(text) => Input { path: name.into(), held: Some(blake3::hash(text.as_bytes())) },
            // Not there, or no text.
            Err(_) => Input::now(Path::new(name)),
        };
        if let Ok(mut inputs) = self.inputs.lock() {
            inputs.push(input);
        }
        read
    }

    /// The files that were read for it, and those that were looked for in vain.
    pub fn inputs(&self) -> Vec<Input> {
        self.inputs.lock().map(|inputs| inputs.clone()).unwrap_or_default()
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
        // A reader of standard output that has gone away shows when the rest is written.
        let _ = monitor.print_timings(&document.name, global);
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
        let text = compiled.model.as_ref().map(Model::write).or_else(|| compiled.rig.as_ref().map(Rig::write));
        if let Some(text) = text.filter(|_| self.wants_model) {
            if let Some(why) = model::too_large(text.len()) {
                return Err(Failure(why));
            }
            output::write(&self.model, text.as_bytes())?;
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

/// What the model promises, in a few lines.
fn summarise(model: &Model, path: &Path) -> Result<(), Failure> {
    let nodes = model.nodes.len();
    output::line(&format!("{}: station {}, {nodes} nodes", path.display(), model.station.name))?;
    promised(&model.promise)
}

/// Both rates, and the error modes of which some escape.
pub fn promised(promise: &Promise) -> Result<(), Failure> {
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
}
