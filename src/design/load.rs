//! Reads a spec and what it uses, and runs the stage.
//!
//! The only file of this stage that asks for texts, and it does so through a function: nothing here opens a file.

use super::beside;
use super::library;
use super::model::Design;
use super::resolve::resolve;
use super::scope::Resolver;
use crate::diag::{Applicability, Diagnostic, Fix, Sources, Span};
use crate::syntax::ast::{self, Stmt};
use std::io;

/// The version of the language this compiler knows.
const VERSION: u64 = 1;
/// More files than this are a mistake.
const MAX_FILES: usize = 64;

/// A spec, read and resolved.
#[derive(Debug)]
pub struct Loaded {
    /// The texts that spans point into; the spec itself first.
    pub sources: Sources,
    /// `None` when there are errors.
    pub design: Option<Design>,
    pub diagnostics: Vec<Diagnostic>,
    /// The files that were read, in the order of their first use; those of the parts library are none.
    pub inputs: Vec<String>,
    /// All that the design depends on, in one text without file names: what a model's digest covers.
    pub text: String,
}

/// Reads one text by its name.
pub type Read<'a> = &'a dyn Fn(&str) -> io::Result<String>;

/// Loads the spec at `path`; `set` overrides its `let`s, the last of equal names wins.
///
/// Faults of the spec and files that cannot be read are diagnostics.
pub fn load(path: &str, read: Read, set: &[(String, String)]) -> Loaded {
    load_with(path, read, set, Resolver::default()).loaded
}

/// What loading leaves behind, for those who ask for more than the design.
pub(super) struct Outcome {
    pub loaded: Loaded,
    pub trees: Vec<Tree>,
    pub resolver: Resolver,
}

/// Loads with a resolver that may be told to keep its readings. It then resolves what could be read even where the spec
/// does not parse.
pub(super) fn load_with(path: &str, read: Read, set: &[(String, String)], mut resolver: Resolver) -> Outcome {
    let mut loader =
        Loader { read, sources: Sources::default(), trees: Vec::new(), diagnostics: Vec::new(), open: Vec::new() };
    loader.file(path, None);
    let names = loader.sources.files.iter().map(|(name, _)| name);
    let inputs: Vec<String> = names.filter(|name| library::text(name).is_none()).cloned().collect();
    let overrides = loader.overrides(set);
    let text = digest_text(&loader.sources);
    let Loader { sources, trees, mut diagnostics, .. } = loader;
    let mut design = None;
    let worth = beside::is_worth_resolving(&diagnostics, &trees, &sources);
    if worth || resolver.readings.is_some() {
        let resolved = resolve(&mut resolver, &trees, &overrides);
        let found = std::mem::take(&mut resolver.diagnostics);
        // What is missing from a spec that does not parse may only not have been read.
        if worth {
            design = Some(resolved);
            diagnostics.extend(beside::independent(found, &trees, &sources));
        }
    }
    tidy(&mut diagnostics);
    if diagnostics.iter().any(Diagnostic::is_error) {
        design = None;
    }
    Outcome { loaded: Loaded { sources, design, diagnostics, inputs, text }, trees, resolver }
}

/// Every text with its length in front, so that no two specs run together into the same text.
fn digest_text(sources: &Sources) -> String {
    sources.files.iter().map(|(_, text)| format!("{}\n{text}\n", text.len())).collect()
}

/// In the order of the text, each fault once: pieces of one part share its faults. What looks unused beside an error may
/// only have missed its use.
fn tidy(diagnostics: &mut Vec<Diagnostic>) {
    if diagnostics.iter().any(Diagnostic::is_error) {
        diagnostics.retain(|d| d.code != "W0209");
    }
    diagnostics.sort_by_key(|d| (d.labels[0].span.file, d.labels[0].span.start, d.code));
    diagnostics.dedup_by_key(|d| (d.code, d.labels[0].span));
}

/// A file's tree, and its index in the sources.
pub struct Tree {
    pub file: u32,
    /// Not the spec itself but used by it: what it leaves unused is no fault.
    pub used: bool,
    pub tree: ast::File,
}

struct Loader<'a> {
    read: Read<'a>,
    sources: Sources,
    trees: Vec<Tree>,
    diagnostics: Vec<Diagnostic>,
    /// Files being read, outermost first.
    open: Vec<String>,
}

impl Loader<'_> {
    fn file(&mut self, path: &str, from: Option<Span>) {
        if self.open.iter().any(|open| open == path) {
            return self.cycle(path, from.unwrap_or_default());
        }
        if self.sources.files.iter().any(|(name, _)| name == path) {
            return;
        }
        if self.sources.files.len() >= MAX_FILES {
            let message = format!("more than {MAX_FILES} files");
            return self
                .diagnostics
                .push(Diagnostic::error("E0212", from.unwrap_or_default(), message).label("one too many"));
        }
        let file = self.sources.files.len() as u32;
        let read = match library::is_meant(path).then(|| library::text(path)) {
            Some(Some(text)) => Ok(text.to_string()),
            Some(None) if from.is_some() => return self.not_in_library(path, from.unwrap_or_default()),
            _ => (self.read)(path),
        };
        let text = match read {
            Ok(text) => text,
            Err(error) => return self.unreadable(path, from, &error),
        };
        let (tree, diagnostics) = crate::syntax::parse(&text, file);
        self.sources.files.push((path.to_string(), text));
        self.diagnostics.extend(diagnostics);
        self.version(&tree, file);
        self.open.push(path.to_string());
        let uses: Vec<ast::Name> = tree.lines.iter().filter_map(as_use).cloned().collect();
        self.trees.push(Tree { file, used: from.is_some(), tree });
        for name in uses {
            let file = if library::is_meant(&name.text) { name.text.clone() } else { path_beside(path, &name.text) };
            self.file(&file, Some(name.span));
        }
        self.open.pop();
    }

    fn unreadable(&mut self, path: &str, from: Option<Span>, error: &io::Error) {
        if self.sources.files.is_empty() {
            self.sources.files.push((path.to_string(), String::new()));
        }
        let message = format!("`{path}` cannot be read: {error}");
        let span = from.unwrap_or_default();
        let fault = Diagnostic::error("E0201", span, message).label("no such file");
        // The library's files are named without their ending.
        let shelf = path.strip_suffix(".gng").and_then(|name| library::text(name).map(|_| name));
        let shelf =
            shelf.or_else(|| path.rsplit('/').next().and_then(|n| library::home_of(n.trim_end_matches(".gng"))));
        self.diagnostics.push(match shelf.filter(|_| from.is_some()) {
            Some(name) => fault.suggest(format!("the parts library has `{name}`"), span, format!("\"{name}\"")),
            None => fault,
        });
    }

    fn not_in_library(&mut self, name: &str, span: Span) {
        let message = format!("the parts library has no `{name}`");
        let diagnostic = Diagnostic::error("E0201", span, message).label("not in the library");
        self.diagnostics.push(match library::nearest_file(name) {
            Some(near) => diagnostic.suggest(format!("did you mean `{near}`?"), span, format!("\"{near}\"")),
            None => diagnostic.help(format!("a file of your own ends in `.gng`: `use \"{name}.gng\"`")),
        });
    }

    fn cycle(&mut self, path: &str, span: Span) {
        let start = self.open.iter().position(|open| open == path).unwrap_or(0);
        let chain: Vec<String> = self.open[start..].iter().map(|p| format!("`{p}`")).collect();
        let message = format!("{} uses `{path}`: files that use each other in a circle", chain.join(" uses "));
        self.diagnostics.push(
            Diagnostic::error("E0208", span, message)
                .label("closes the circle")
                .help("move what both need into a file of its own"),
        );
    }

    /// The first statement is `gonogo 1`.
    fn version(&mut self, tree: &ast::File, file: u32) {
        let first = tree.lines.first();
        let version = tree.lines.iter().find_map(|line| match line.stmt {
            Stmt::Version(version) => Some((version, line.span)),
            _ => None,
        });
        let start = Span { file, start: 0, end: 0 };
        let diagnostic = match (version, first.map(|line| line.span)) {
            (Some((VERSION, span)), Some(first)) if span == first => return,
            (Some((VERSION, span)), first) => {
                let top = first.unwrap_or(start);
                let fix = Fix::new("move `gonogo 1` to the first line", Applicability::MachineApplicable);
                Diagnostic::error("E0105", span, "the version line comes first")
                    .label("not the first statement")
                    .with_fix(fix.edit(Span { end: top.start, ..top }, "gonogo 1\n").edit(span, ""))
            }
            (Some((version, span)), _) => Diagnostic::error(
                "E0105",
                span,
                format!("this file is for gonogo {version}; this compiler knows {VERSION}"),
            )
            .label("another version of the language")
            .help(format!("write `gonogo {VERSION}`, or use a compiler that knows gonogo {version}")),
            // Whatever stands there was reported by the parser.
            (None, first) if lost_before(tree, first.unwrap_or(Span { start: u32::MAX, ..start })) => return,
            (None, first) => Diagnostic::error("E0105", first.unwrap_or(start), "the version line is missing")
                .label("before this")
                .fix(
                    "begin with the line `gonogo 1`",
                    Span { end: first.unwrap_or(start).start, ..first.unwrap_or(start) },
                    "gonogo 1\n",
                ),
        };
        self.diagnostics.push(diagnostic);
    }

    /// Each `--set NAME=VALUE` as a statement in a text of its own, so that its faults can be shown.
    fn overrides(&mut self, set: &[(String, String)]) -> Vec<(ast::Name, ast::Dim)> {
        let mut found = Vec::new();
        for (name, value) in set {
            let file = self.sources.files.len() as u32;
            let text = format!("let {name} = {value}\n");
            let (mut tree, diagnostics) = crate::syntax::parse(&text, file);
            self.sources.files.push(("--set".to_string(), text));
            self.diagnostics.extend(diagnostics);
            match tree.lines.pop().map(|line| line.stmt) {
                Some(Stmt::Let { name, dim }) if tree.lines.is_empty() => found.push((name, dim)),
                _ => {
                    let span = Span { file, start: 0, end: 0 };
                    self.diagnostics.push(Diagnostic::error("E0101", span, "expected `--set NAME=VALUE`"));
                }
            }
        }
        found
    }
}

/// Whether something that could not be read stands above a statement.
fn lost_before(tree: &ast::File, first: Span) -> bool {
    tree.lost.iter().any(|lost| lost.start < first.start)
}

fn as_use(line: &ast::Line) -> Option<&ast::Name> {
    match &line.stmt {
        Stmt::Use(name) => Some(name),
        _ => None,
    }
}

/// The name of a file that `path` refers to as `name`, with `.` and `..` resolved as far as they can be.
pub fn path_beside(path: &str, name: &str) -> String {
    if name.starts_with('/') {
        return name.to_string();
    }
    let mut steps: Vec<&str> = path.split('/').collect();
    steps.pop();
    for step in name.split('/') {
        match step {
            "." | "" => {}
            ".." if steps.last().is_some_and(|last| !last.is_empty() && *last != "..") => {
                steps.pop();
            }
            step => steps.push(step),
        }
    }
    steps.join("/")
}
