//! Reads a spec and what it uses, and runs the stage.
//!
//! The only file of this stage that asks for texts, and it does so through a function: nothing here opens a file.

use super::assemble::{Assembled, Catalogue};
use super::beside;
use super::family::Family;
use super::library;
use super::model::{Design, Material, Station};
use super::part::PartSource;
use super::scope::{Named, Resolver, Title};
use crate::diag::suggest::nearest;
use crate::diag::{Applicability, Diagnostic, Fix, Sources, Span};
use crate::iso::General;
use crate::syntax::ast::{self, Stmt};
use std::collections::BTreeMap;
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
    used: bool,
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
        self.diagnostics.push(Diagnostic::error("E0201", from.unwrap_or_default(), message).label("no such file"));
    }

    fn not_in_library(&mut self, name: &str, span: Span) {
        let message = format!("the parts library has no `{name}`");
        let diagnostic = Diagnostic::error("E0201", span, message).label("not in the library");
        self.diagnostics.push(match library::nearest_file(name) {
            Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
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

/// Where a part, a family or a member of that name stands already.
fn first_part(name: &ast::Name, blocks: &Blocks) -> Option<Span> {
    let parts = blocks.parts.iter().map(|(part, _)| part.name);
    let families = blocks.families.iter().map(|(family, _)| family.name);
    let members = blocks.members.iter().map(|(member, ..)| *member);
    parts.chain(families).chain(members).find(|known| known.text == name.text).map(|known| known.span)
}

/// The blocks of all files by kind, in the order that gives the spec's own stations the first place.
#[derive(Default)]
struct Blocks<'a> {
    lets: Vec<(&'a ast::Name, &'a ast::Dim, bool)>,
    materials: Vec<(&'a ast::Name, &'a ast::Body, bool)>,
    parts: Vec<(PartSource<'a>, bool)>,
    families: Vec<(Family<'a>, bool)>,
    members: Vec<(&'a ast::Name, &'a ast::Call, bool)>,
    assembly: Option<(&'a ast::Name, &'a ast::Body)>,
    stations: Vec<(&'a ast::Name, &'a ast::Body)>,
    inspect: Option<(Option<&'a ast::Name>, &'a ast::Body, Span)>,
    train: Option<(&'a ast::Body, Span)>,
}

fn resolve(resolver: &mut Resolver, trees: &[Tree], overrides: &[(ast::Name, ast::Dim)]) -> Design {
    let mut blocks = resolver.collect(trees, overrides);
    let families: BTreeMap<&str, Family> =
        blocks.families.iter().rev().map(|(f, _)| (f.name.text.as_str(), *f)).collect();
    for (name, call, used) in std::mem::take(&mut blocks.members) {
        blocks.parts.push((resolver.member(name, call, &families), used));
    }
    let materials: Vec<Material> =
        blocks.materials.iter().map(|(name, body, _)| resolver.material(name, body)).collect();
    let catalogue = Catalogue {
        parts: blocks.parts.iter().rev().map(|(part, _)| (part.name.text.as_str(), *part)).collect(),
        families,
        materials: blocks.materials.iter().enumerate().rev().map(|(i, m)| (m.0.text.as_str(), i)).collect(),
    };
    let mut built = Assembled::default();
    match blocks.assembly {
        Some((name, body)) => built = resolver.assemble(body, name.span, &catalogue),
        None => resolver.no_assembly(trees),
    }
    let measures = blocks.assembly.map_or(Vec::new(), |(_, body)| resolver.measures(body, &built));
    resolver.senses(&built.parts);
    resolver.settle_readings();
    let stations = resolver.stations(&blocks, &catalogue);
    let inspect = resolver.inspect(blocks.inspect.map(|(_, body, span)| (body, span)), &built);
    let train = resolver.train(blocks.train);
    resolver.check_inspect_name(&blocks);
    resolver.unplaced(&blocks, &catalogue, &built);
    resolver.warn_unused(&blocks);
    resolver.read_unread_names(false);
    resolver.settle_readings();
    let name = blocks.assembly.map_or(String::new(), |(name, _)| name.text.clone());
    let (parts, components) = (built.parts, built.components);
    let dims = std::mem::take(&mut resolver.dims);
    Design { name, dims, materials, parts, components, measures, stations, inspect, train }
}

impl Resolver {
    fn collect<'a>(&mut self, trees: &'a [Tree], overrides: &[(ast::Name, ast::Dim)]) -> Blocks<'a> {
        let mut blocks = Blocks::default();
        let files = trees.iter().map(|t| t.file as usize + 1).max().unwrap_or(0);
        self.titles = vec![Title::default(); files];
        for tree in trees {
            self.titles[tree.file as usize] = self.title_block(&tree.tree);
            tree.tree.lines.iter().for_each(|line| self.block(line, tree.used, &mut blocks));
        }
        self.define_globals(&blocks, overrides);
        blocks
    }

    fn title_block(&mut self, tree: &ast::File) -> Title {
        let mut title = Title::default();
        for line in &tree.lines {
            match &line.stmt {
                Stmt::Units(length, angle) => (title.length, title.angle) = self.units(length, angle),
                Stmt::Tolerances(class) => title.general = self.general(class),
                _ => {}
            }
        }
        title
    }

    fn units(&mut self, length: &ast::Name, angle: &ast::Name) -> (f64, f64) {
        let lengths = [("mm", 1.0), ("um", 1e-3), ("cm", 10.0), ("m", 1000.0), ("in", 25.4)];
        let angles = [("deg", 1f64.to_radians()), ("rad", 1.0)];
        let mut find = |name: &ast::Name, table: &[(&str, f64)], example: &str| {
            let known = table.iter().find(|(unit, _)| *unit == name.text);
            known.map(|(_, factor)| *factor).unwrap_or_else(|| {
                let message = format!("unknown unit `{}`", name.text);
                let near = nearest(&name.text, table.iter().map(|(unit, _)| *unit)).unwrap_or(example);
                self.report(Diagnostic::error("E0204", name.span, message).label("not a unit here").suggest(
                    format!("write `{near}`"),
                    name.span,
                    near,
                ));
                table[0].1
            })
        };
        (find(length, &lengths, "mm"), find(angle, &angles, "deg"))
    }

    fn general(&mut self, class: &ast::Name) -> Option<General> {
        let general = General::from_name(&class.text);
        if general.is_none() && class.text != "exact" {
            let message = format!("unknown general tolerances `{}`", class.text);
            let known = ["ISO2768-f", "ISO2768-m", "ISO2768-c", "ISO2768-v", "exact"];
            let near = nearest(&class.text, known).unwrap_or("ISO2768-m");
            self.report(Diagnostic::error("E0302", class.span, message).label("unknown class").suggest(
                format!("write `{near}`"),
                class.span,
                near,
            ));
        }
        general
    }

    fn block<'a>(&mut self, line: &'a ast::Line, used: bool, blocks: &mut Blocks<'a>) {
        match &line.stmt {
            Stmt::Let { name, dim } => blocks.lets.push((name, dim, used)),
            Stmt::Material { name, body } => {
                let first = blocks.materials.iter().find(|(n, ..)| n.text == name.text).map(|(n, ..)| n.span);
                self.block_name("material", name, first);
                blocks.materials.push((name, body, used));
            }
            Stmt::Part { name, body } => {
                self.block_name("part", name, first_part(name, blocks));
                self.names_inside(name, body);
                blocks.parts.push((PartSource { name, body, member: None }, used));
            }
            Stmt::Family { name, params, body } => {
                self.block_name("family", name, first_part(name, blocks));
                self.names_inside(name, body);
                blocks.families.push((Family { name, params, body }, used));
            }
            Stmt::Member { name, call } => {
                self.block_name("part", name, first_part(name, blocks));
                blocks.members.push((name, call, used));
            }
            Stmt::Assembly { name, body } => {
                self.block_name("assembly", name, blocks.assembly.map(|(first, _)| first.span));
                blocks.assembly.get_or_insert((name, body));
            }
            Stmt::Station { name, body } => {
                let first = blocks.stations.iter().find(|(n, _)| n.text == name.text).map(|(n, _)| n.span);
                self.block_name("station", name, first);
                blocks.stations.push((name, body));
            }
            // The spec's own words on what to inspect and how to train go before those of the files it uses.
            Stmt::Inspect { name, body } => {
                blocks.inspect.get_or_insert((name.as_ref(), body, line.span));
            }
            Stmt::Train(body) => {
                blocks.train.get_or_insert((body, line.span));
            }
            _ => {}
        }
    }

    fn names_inside(&mut self, owner: &ast::Name, body: &ast::Body) {
        for line in &body.lines {
            if let Stmt::Let { name, .. } = &line.stmt {
                self.inside.entry(name.text.clone()).or_insert((owner.text.clone(), name.span));
            }
        }
    }

    fn block_name(&mut self, kind: &'static str, name: &ast::Name, first: Option<Span>) {
        match first {
            Some(first) => self.duplicate(kind, name, first),
            None => {
                self.kinds.insert(name.text.clone(), kind);
            }
        }
    }

    fn define_globals(&mut self, blocks: &Blocks, overrides: &[(ast::Name, ast::Dim)]) {
        let mut globals: BTreeMap<String, Named> = BTreeMap::new();
        for (name, dim, _) in &blocks.lets {
            self.define(&mut globals, name, dim, name.text.clone());
        }
        for (name, dim) in overrides {
            match globals.get_mut(&name.text) {
                Some(named) => {
                    // An override speaks in the units of the file it overrides.
                    let title = self.titles[named.span.file as usize];
                    let file = dim.span.file as usize;
                    self.titles.resize(self.titles.len().max(file + 1), Title::default());
                    self.titles[file] = title;
                    named.dim = dim.clone();
                }
                None => {
                    let message = format!("no `let` is named `{}`", name.text);
                    let diagnostic = Diagnostic::error("E0201", name.span, message).label("nothing to set");
                    self.report(match nearest(&name.text, globals.keys().map(String::as_str)) {
                        Some(near) => diagnostic.help(format!("did you mean `{near}`?")),
                        None => diagnostic,
                    });
                }
            }
        }
        self.globals = globals;
    }

    fn no_assembly(&mut self, trees: &[Tree]) {
        let at = trees.first().and_then(|t| t.tree.lines.first()).map_or(Span::default(), |line| line.span);
        self.report(
            Diagnostic::error("E0207", at, "this spec has no assembly")
                .label("nothing is put together")
                .help("write `assembly name { root plate }`, or `use` a file that has one"),
        );
    }

    fn stations(&mut self, blocks: &Blocks, catalogue: &Catalogue) -> Vec<Station> {
        if let (true, Some((assembly, _))) = (blocks.stations.is_empty(), blocks.assembly) {
            self.report(
                Diagnostic::error("E0207", assembly.span, "this spec has no station")
                    .label("nobody looks at it")
                    .help("write `station bench { light room = room(patches = 9) }`"),
            );
        }
        blocks.stations.iter().flat_map(|(name, body)| self.station(name, body, &catalogue.materials)).collect()
    }

    fn check_inspect_name(&mut self, blocks: &Blocks) {
        let (Some((Some(name), ..)), Some((assembly, _))) = (blocks.inspect, blocks.assembly) else { return };
        if name.text != assembly.text {
            let message = format!("no assembly is named `{}`", name.text);
            self.report(
                Diagnostic::error("E0201", name.span, message)
                    .label("unknown assembly")
                    .meant(name.span, &assembly.text),
            );
        }
    }

    /// Parts that are placed nowhere are still checked, on a copy of the stage that is thrown away.
    fn unplaced(&mut self, blocks: &Blocks, catalogue: &Catalogue, built: &Assembled) {
        // Those of a file that is used are its own affair: a library may hold what nobody needs here.
        let idle = blocks.parts.iter().filter(|(source, used)| !used && !built.placed.contains(&source.name.text));
        let idle: Vec<_> = idle.collect();
        if idle.is_empty() {
            return;
        }
        let mut scratch = self.clone();
        let mut parts = Vec::new();
        for (source, _) in idle {
            parts.push(scratch.part(*source, &source.name.text, &catalogue.materials));
            if blocks.assembly.is_some() {
                let message = format!("part `{}` is never placed", source.name.text);
                scratch.report(
                    Diagnostic::warning("W0209", source.name.span, message)
                        .label("not used")
                        .help("place it or remove it"),
                );
            }
        }
        scratch.senses(&parts);
        scratch.settle_readings();
        self.readings = scratch.readings;
        self.diagnostics = scratch.diagnostics;
        (self.used, self.used_materials) = (scratch.used, scratch.used_materials);
    }

    fn warn_unused(&mut self, blocks: &Blocks) {
        for (name, _, _) in blocks.lets.iter().filter(|(_, _, used)| !used) {
            if !self.is_used(name.span) {
                self.unused("dimension", &name.text, name.span);
            }
        }
        for (family, _) in blocks.families.iter().filter(|(_, used)| !used) {
            if !self.used_families.contains(&family.name.text) {
                self.unused("family", &family.name.text, family.name.span);
            }
        }
        for (i, (name, _, used)) in blocks.materials.iter().enumerate() {
            if !used && !self.used_materials.contains(&i) {
                self.unused("material", &name.text, name.span);
            }
        }
    }
}
