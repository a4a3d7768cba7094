//! `gonogo check --fix`: makes the fixes that can mean only one thing.
//!
//! In: a spec and how it is compiled. Out: the spec mended, in its file. Files it uses are never touched, and nothing is
//! written that has more faults than before.

use super::args::{Check, Global, MessageFormat};
use super::compile::Document;
use super::messages::Place;
use super::output::{self, DASH, Failure};
use crate::diag::{self, Diagnostic, Fix};
use crate::{Compiled, Options};
use std::collections::BTreeSet;
use std::io;
use std::path::Path;

/// Mending one fault uncovers the next; more rounds than this mean that two fixes undo each other.
const ROUNDS: usize = 20;

/// The spec with its fixes made, and written where it came from. Says what was mended.
pub fn mended(spec: Document, path: &Path, options: &Options) -> Result<Document, Failure> {
    let mut attempt = Attempt { compiled: compiled(&spec, options), spec, refused: BTreeSet::new() };
    let before = attempt.spec.text.clone();
    let mut said = Vec::new();
    for _ in 0..ROUNDS {
        match attempt.round(options) {
            Some(made) => said.extend(made),
            None => break,
        }
    }
    if path == Path::new(DASH) || attempt.spec.text != before {
        output::write(path, attempt.spec.text.as_bytes())?;
    }
    said.iter().for_each(|line| output::remark(line));
    Ok(attempt.spec)
}

/// The text of standard input and messages for programs cannot both go to standard output.
pub fn refuse_mixed_output(args: &Check, global: &Global) -> Result<(), Failure> {
    let for_people = matches!(global.message_format, MessageFormat::Human | MessageFormat::Short);
    if args.fix && !for_people && args.specs.iter().any(|path| path == Path::new(DASH)) {
        let why = "`--fix -` writes the spec to standard output: use `--message-format human` or `short`";
        return Err(Failure(why.into()));
    }
    Ok(())
}

struct Attempt {
    spec: Document,
    compiled: Compiled,
    /// Fixes that made it worse, by place and text.
    refused: BTreeSet<String>,
}

impl Attempt {
    /// Makes all fixes there are, or the first if together they do harm. What was made, in words; `None` when there is
    /// nothing left to make.
    fn round(&mut self, options: &Options) -> Option<Vec<String>> {
        let chosen: Vec<(Diagnostic, Fix)> = self
            .compiled
            .diagnostics
            .iter()
            .filter_map(chosen)
            .filter(|(d, f)| !self.refused.contains(&key(d, f)))
            .collect();
        let first = chosen.first()?;
        for attempt in [chosen.as_slice(), std::slice::from_ref(first)] {
            let (text, made) = diag::apply(&self.spec.text, 0, attempt.iter().map(|(_, fix)| fix));
            let spec = Document { name: self.spec.name.clone(), text };
            let compiled = compiled(&spec, options);
            if !made.is_empty() && faults(&compiled.diagnostics) <= faults(&self.compiled.diagnostics) {
                let said = made.iter().map(|&i| self.said(&attempt[i])).collect();
                (self.spec, self.compiled) = (spec, compiled);
                return Some(said);
            }
        }
        self.refused.insert(key(&first.0, &first.1));
        Some(Vec::new())
    }

    /// `plate.gng:3:5: mended E0103: write …`
    fn said(&self, (diagnostic, fix): &(Diagnostic, Fix)) -> String {
        let place = Place::of(&self.compiled.sources, diagnostic.labels[0].span);
        format!("{}:{}:{}: mended {}: {}", place.file, place.line, place.column, diagnostic.code, fix.title)
    }
}

fn compiled(spec: &Document, options: &Options) -> Compiled {
    let read = |name: &str| -> io::Result<String> { spec.text_of(name) };
    crate::compile(&spec.name, &read, options, &|_| {})
}

/// The fix to make for a diagnostic: certain, and in the spec itself.
fn chosen(diagnostic: &Diagnostic) -> Option<(Diagnostic, Fix)> {
    let own = |fix: &&Fix| fix.is_machine_applicable() && fix.edits.iter().all(|e| e.span.file == 0);
    diagnostic.fixes.iter().find(own).map(|fix| (diagnostic.clone(), fix.clone()))
}

fn key(diagnostic: &Diagnostic, fix: &Fix) -> String {
    format!("{} {} {:?}", diagnostic.code, diagnostic.message, fix.edits)
}

/// Faults of the text, and all errors: a text that can be read at last may show more errors than before.
fn faults(diagnostics: &[Diagnostic]) -> (usize, usize) {
    let errors = || diagnostics.iter().filter(|d| d.is_error());
    (errors().filter(|d| d.code.starts_with("E01")).count(), errors().count())
}
