//! What stands in the files becomes one design: blocks are gathered by kind and resolved in the order they need each other.
//!
//! In: the trees of a spec and of what it uses, and the values that replace those of `let`s. Out: the [`Design`]; what is
//! wrong is left with the [`Resolver`]. Never reads a text.

use super::assemble::{Assembled, Catalogue};
use super::dimension;
use super::family::Family;
use super::load::Tree;
use super::model::{Design, Material, Station};
use super::part::PartSource;
use super::scope::{Named, Resolver, Title};
use crate::diag::suggest::nearest;
use crate::diag::{Diagnostic, Span};
use crate::iso::General;
use crate::syntax::ast::{self, Stmt};
use std::collections::BTreeMap;

/// Makes the design of all that was read, in spite of what is wrong with it.
pub(super) fn resolve(resolver: &mut Resolver, trees: &[Tree], overrides: &[(ast::Name, ast::Dim)]) -> Design {
    let mut blocks = resolver.collect(trees, overrides);
    let families: BTreeMap<&str, Family> =
        blocks.families.iter().rev().map(|(f, _)| (f.name.text.as_str(), *f)).collect();
    for (name, call, used) in std::mem::take(&mut blocks.members) {
        blocks.parts.push((resolver.member(name, call, &families), used));
    }
    let mut materials: Vec<Material> =
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
    let shines = |colour| stations.iter().flat_map(|s| &s.lights).any(|l| l.colour == colour);
    materials.iter_mut().for_each(|m| m.tints.retain(|t| shines(t.colour)));
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
                let units = || table.iter().map(|(unit, _)| *unit);
                let near = dimension::unit_meant(&name.text).filter(|meant| units().any(|unit| unit == *meant));
                let near = near.or_else(|| nearest(&name.text, units())).unwrap_or(example);
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
            scratch.locals.clear();
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
        (self.used, self.used_materials, self.idle) = (scratch.used, scratch.used_materials, scratch.idle);
    }

    fn warn_unused(&mut self, blocks: &Blocks) {
        self.warn_idle_names();
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

/// Where a part, a family or a member of that name stands already.
fn first_part(name: &ast::Name, blocks: &Blocks) -> Option<Span> {
    let parts = blocks.parts.iter().map(|(part, _)| part.name);
    let families = blocks.families.iter().map(|(family, _)| family.name);
    let members = blocks.members.iter().map(|(member, ..)| *member);
    parts.chain(families).chain(members).find(|known| known.text == name.text).map(|known| known.span)
}
